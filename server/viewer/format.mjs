// Layout of the sources of the viewer and of Lambert's client: node format.mjs MODULES [--write]
//   MODULES  the node_modules that `npm ci` made, with the packages for development
// Names the files that dprint would lay out otherwise, and with --write lays them out. It breaks no comments: files
// with long ones are named, too.
import { existsSync, readdirSync, readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";

const [modules, write] = process.argv.slice(2), folder = dirname(fileURLToPath(import.meta.url));
const WIDTH = 120, COMMENT = /^\s*(\/\/|\/?\*)/;
const require = createRequire(join(resolve(modules), "of-the-viewer.js"));
const formatter = require("@dprint/formatter").createFromBuffer(readFileSync(require("@dprint/typescript").getPath()));
formatter.setConfig({ lineWidth: WIDTH, indentWidth: 4 }, {
    "preferHanging": true,
    "quoteStyle": "preferDouble",
    "useBraces": "maintain",
    "singleBodyPosition": "maintain",
    "arrowFunction.useParentheses": "force",
    "module.sortImportDeclarations": "maintain",
    "importDeclaration.sortNamedImports": "maintain",
});
/** What is laid out once may still be laid out otherwise. */
const PASSES_MOST = 4;

// Lambert's client stands elsewhere in the tree, and beside the copy of these sources that is checked.
const client = ["js", "../../deploy/js"].find((name) => existsSync(join(folder, name))) ?? "js";
const files = [...readdirSync(join(folder, "src"), { recursive: true }).map((name) => join("src", name)),
    ...readdirSync(folder), ...["lambert.js", "lambert.d.ts"].map((name) => join(client, name))]
    .filter((name) => /\.(ts|mjs|js)$/.test(name));
for (const name of files) {
    const filePath = join(folder, name), text = readFileSync(filePath, "utf8");
    let laid = text;
    for (let pass = 0, before = ""; pass < PASSES_MOST && laid !== before; pass++) {
        before = laid;
        laid = formatter.formatText({ filePath, fileText: laid });
    }
    const isLong = laid.split("\n").some((line) => line.length > WIDTH && COMMENT.test(line));
    if (isLong) console.error(`${name} has comments beyond column ${WIDTH}`);
    if (laid !== text && write === "--write") writeFileSync(filePath, laid);
    else if (laid !== text)
        console.error(`${name} is laid out otherwise: node server/viewer/format.mjs MODULES --write`);
    if (isLong || (laid !== text && write !== "--write")) process.exitCode = 1;
}
