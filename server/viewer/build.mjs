// Bundles the viewer: node build.mjs SOURCES MODULES OUT
//   SOURCES  this folder;  MODULES  the node_modules that `npm ci` made;  OUT  a folder for what is written:
// the files of the page, each also compressed, and viewer_files.c, which holds them in the daemon.
import { readFileSync, writeFileSync, mkdirSync } from "node:fs";
import { createHash } from "node:crypto";
import { createRequire } from "node:module";
import { join, resolve } from "node:path";
import { gzipSync } from "node:zlib";

const [sources, modules, out] = process.argv.slice(2).map((p) => resolve(p));
const require = createRequire(join(modules, "of-the-viewer.js"));
const esbuild = require("esbuild");
mkdirSync(out, { recursive: true });

const result = await esbuild.build({
    entryPoints: { viewer: join(sources, "src/main.ts") },
    bundle: true,
    minify: true,
    format: "esm",
    target: "es2022",
    outdir: out,
    metafile: true,
    legalComments: "none",
    nodePaths: [modules],
    alias: { "lambert-light": join(sources, "../../deploy/js/lambert.js") },
    absWorkingDir: sources,
    logLevel: "warning",
});

// The licences of the packages whose files are in the bundle, uPlot's stylesheet included.
const packages = new Set();
for (const input of Object.keys(result.metafile.inputs)) {
    const found = /node_modules\/((?:@[^/]+\/)?[^/]+)\//.exec(input);
    if (found) packages.add(found[1]);
}
const licence = (name) => {
    const folder = join(modules, name);
    const about = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
    const text = ["LICENSE", "LICENSE.md", "LICENSE.txt", "LICENCE"]
        .map((file) => {
            try {
                return readFileSync(join(folder, file), "utf8");
            } catch {
                return null;
            }
        })
        .find((content) => content !== null);
    if (text === undefined) throw new Error(`${name} has no licence file`);
    return `${name} ${about.version} (${about.license})\n\n${text.trim()}\n`;
};
writeFileSync(join(out, "licences.txt"), [...packages].sort().map(licence).join(`\n${"-".repeat(80)}\n\n`));
for (const file of ["page.html", "icon.svg"]) writeFileSync(join(out, file), readFileSync(join(sources, file)));

// In the order of viewer_part in server/route/viewer_files.h.
const files = ["page.html", "viewer.js", "viewer.css", "icon.svg", "licences.txt"];
const text = (path) => JSON.stringify(path).slice(1, -1).replaceAll("\\", "\\\\");
const include = (symbol, path) =>
    `__asm__(".section .rodata\\n.hidden ${symbol}\\n.global ${symbol}\\n${symbol}:\\n"
        ".incbin \\"${text(path)}\\"\\n.byte 0\\n.previous\\n");
extern const unsigned char ${symbol}[];
`;
let code = '#include "server/route/viewer_files.h"\n\n', rows = "";
files.forEach((file, i) => {
    const bytes = readFileSync(join(out, file)), packed = gzipSync(bytes, { level: 9 });
    writeFileSync(join(out, `${file}.gz`), packed);
    code += include(`viewer_plain_${i}`, join(out, file)) + include(`viewer_gzip_${i}`, join(out, `${file}.gz`));
    const tag = createHash("sha256").update(bytes).digest("hex").slice(0, 16);
    rows += `    {viewer_plain_${i}, ${bytes.length}, viewer_gzip_${i}, ${packed.length}, 0x${tag}u},\n`;
});
code += `\nconst bool viewer_is_built = true;\nconst fixed_bytes viewer_files[VIEWER_PARTS] = {\n${rows}};\n`;
writeFileSync(join(out, "viewer_files.c"), code);
