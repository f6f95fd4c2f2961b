// Bundles the viewer: node build.mjs SOURCES MODULES OUT
//   SOURCES  this folder;  MODULES  the node_modules that `npm ci` made;  OUT  a folder for what is written:
// the files of the page, each also compressed, and viewer_files.c, which holds them in the daemon.
import { readFileSync, writeFileSync, mkdirSync } from "node:fs";
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
        .map((file) => { try { return readFileSync(join(folder, file), "utf8"); } catch { return null; } })
        .find((content) => content !== null);
    if (text === undefined) throw new Error(`${name} has no licence file`);
    return `${name} ${about.version} (${about.license})\n\n${text.trim()}\n`;
};
writeFileSync(join(out, "licences.txt"), [...packages].sort().map(licence).join(`\n${"-".repeat(80)}\n\n`));
for (const file of ["page.html", "icon.svg"]) writeFileSync(join(out, file), readFileSync(join(sources, file)));

// Paths of the daemon, files, types. The names of the C side stand in server/route/viewer_files.h.
const files = [
    ["/", "page.html", "text/html; charset=utf-8"],
    ["/viewer.js", "viewer.js", "text/javascript; charset=utf-8"],
    ["/viewer.css", "viewer.css", "text/css; charset=utf-8"],
    ["/viewer.svg", "icon.svg", "image/svg+xml"],
    ["/viewer.txt", "licences.txt", "text/plain; charset=utf-8"],
];
const quoted = (path) => JSON.stringify(path);
const pieces = ['#include "server/route/viewer_files.h"\n'];
const rows = [];
files.forEach(([path, file, type], i) => {
    const bytes = readFileSync(join(out, file));
    const packed = gzipSync(bytes, { level: 9 });
    writeFileSync(join(out, `${file}.gz`), packed);
    for (const [symbol, name] of [[`viewer_plain_${i}`, file], [`viewer_gzip_${i}`, `${file}.gz`]]) {
        pieces.push(`__asm__(".section .rodata\\n.hidden ${symbol}\\n.global ${symbol}\\n${symbol}:\\n"
        ".incbin ${quoted(join(out, name)).replaceAll('"', '\\"')}\\n.byte 0\\n.previous");
extern const unsigned char ${symbol}[];`);
    }
    rows.push(`    {${quoted(path)}, ${quoted(type)}, viewer_plain_${i}, ${bytes.length}, viewer_gzip_${i}, ${packed.length}},`);
});
pieces.push(`\nconst viewer_file viewer_files[] = {\n${rows.join("\n")}\n};\nconst size_t viewer_file_count = ${files.length};\n`);
writeFileSync(join(out, "viewer_files.c"), pieces.join("\n"));
