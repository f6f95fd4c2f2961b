// Circles of imports among the viewer's sources, those of types included: node circles.mjs
// Names a circle, and each file of panels/ that imports app.ts: only main.ts knows it.
import { readdirSync, readFileSync } from "node:fs";
import { dirname, join, normalize } from "node:path";
import { fileURLToPath } from "node:url";

const folder = join(dirname(fileURLToPath(import.meta.url)), "src"), imports = new Map();
for (const file of readdirSync(folder, { recursive: true }).filter((name) => name.endsWith(".ts"))) {
    const text = readFileSync(join(folder, file), "utf8");
    imports.set(file, [...text.matchAll(/^(?:import|export)\b[^;]*? from "(\.[^"]+)";/gm)]
        .map(([, path]) => normalize(join(dirname(file), path))));
}
const faults = [], done = new Set();
const visit = (file, path) => {
    if (path.includes(file))
        faults.push(`a circle of imports: ${[...path.slice(path.indexOf(file)), file].join(" → ")}`);
    if (path.includes(file) || done.has(file)) return;
    for (const other of imports.get(file)) visit(other, [...path, file]);
    done.add(file);
};
for (const [file, others] of imports) {
    visit(file, []);
    if (others.includes("app/app.ts") && file !== "main.ts") faults.push(`${file} imports app/app.ts`);
}
if (faults.length > 0) throw new Error(faults.join("\n"));
