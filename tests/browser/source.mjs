// Modules of the viewer's sources, for tests of parts that need no page. VIEWER is the folder of these, MODULES the one of
// their packages.
import { createRequire } from "node:module";
import { join } from "node:path";

/** One module (picture/nodes), bundled with what it imports. */
export function sourceOf(module) {
    const { buildSync } = createRequire(join(process.env.MODULES, "of-the-test.js"))("esbuild");
    const { outputFiles: [{ text }] } = buildSync({
        entryPoints: [join(process.env.VIEWER, "src", `${module}.ts`)], bundle: true, format: "esm", write: false, nodePaths: [process.env.MODULES],
        alias: { "lambert-light": join(process.env.VIEWER, "../../deploy/js/lambert.js") },
    });
    return import(`data:text/javascript;base64,${Buffer.from(text).toString("base64")}`);
}
