// Types of what is sent and answered, from the daemon's description of its routes: node types.mjs MODULES [--write]
//   MODULES  the node_modules that `npm ci` made in a build folder of the viewer, with the packages for development
// Says where openapi.d.ts is not the one of server/route/openapi.json, and with --write makes it.
import { readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";

const [modules, write] = process.argv.slice(2), folder = dirname(fileURLToPath(import.meta.url));
const { default: typesOf, astToString } = createRequire(join(resolve(modules), "of-the-types.js"))("openapi-typescript");
const { openapi, info, components: { schemas } } = JSON.parse(
    readFileSync(join(folder, "../../server/route/openapi.json"), "utf8"));

const made = await typesOf({ openapi, info, paths: {}, components: { schemas } },
    { rootTypes: true, rootTypesNoSchemaPrefix: true, defaultNonNullable: false });
const text = "// Made from server/route/openapi.json by types.mjs: do not edit.\n"
    + astToString(made).replace(/^export (type|interface) [^{;]*Record<string, never>;\n/gm, "")
        .replace(/^ *(\/\*\* @enum .*\*\/|\* @enum .*)\n/gm, "");
const file = join(folder, "openapi.d.ts");
let before = "";
try {
    before = readFileSync(file, "utf8");
} catch {
    // It is made for the first time.
}
if (write === "--write") writeFileSync(file, text);
else if (before !== text) {
    console.error("deploy/js/openapi.d.ts is not that of server/route/openapi.json: node deploy/js/types.mjs MODULES --write");
    process.exitCode = 1;
}
