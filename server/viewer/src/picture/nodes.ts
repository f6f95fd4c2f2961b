// Nodes of smooth shading: corners of equal position, normal and group share one; its value is the mean of theirs; one
// inside an edge of a larger element has the value there. Creases stand in the normals, which the daemon makes; so
// light does not bleed around an edge or into another material.
import type { SceneMesh } from "./glb.ts";
import { tieTJunctions, type Nodes } from "./t_junctions.ts";

/** O(vertices), by a hash table of open addressing over the bits of the six numbers. */
export function findNodes(mesh: SceneMesh): Nodes {
    const vertices = mesh.elementOf.length;
    const position = new Int32Array(mesh.positions.buffer, mesh.positions.byteOffset, 3 * vertices);
    const normal = new Int32Array(mesh.normals.buffer, mesh.normals.byteOffset, 3 * vertices);
    let slots = 16;
    while (slots < 2 * vertices) slots *= 2;
    const table = new Int32Array(slots).fill(-1);
    const nodeOf = new Uint32Array(vertices);
    let count = 0;
    for (let v = 0; v < vertices; v++) {
        const group = mesh.groupOf[mesh.elementOf[v]];
        let hash = group;
        for (let k = 3 * v; k < 3 * v + 3; k++) {
            hash = Math.imul(hash ^ position[k], 0x9e3779b1);
            hash = Math.imul(hash ^ (hash >>> 15) ^ normal[k], 0x85ebca6b);
        }
        let slot = (hash ^ (hash >>> 13)) & (slots - 1);
        for (;;) {
            const other = table[slot];
            if (other < 0) {
                table[slot] = v;
                nodeOf[v] = count++;
                break;
            }
            if (mesh.groupOf[mesh.elementOf[other]] === group && isEqual(position, v, other)
                && isEqual(normal, v, other))
            {
                nodeOf[v] = nodeOf[other];
                break;
            }
            slot = (slot + 1) & (slots - 1);
        }
    }
    const first = new Uint32Array(count + 1);
    for (let v = 0; v < vertices; v++) first[nodeOf[v] + 1] += 1;
    for (let i = 0; i < count; i++) first[i + 1] += first[i];
    const at = first.slice(0, count), elements = new Uint32Array(vertices);
    for (let v = 0; v < vertices; v++) elements[at[nodeOf[v]]++] = mesh.elementOf[v];
    return tieTJunctions(mesh, { count, nodeOf, first, elements, weights: null, inner: new Map() });
}

function isEqual(bits: Int32Array, a: number, b: number): boolean {
    return bits[3 * a] === bits[3 * b] && bits[3 * a + 1] === bits[3 * b + 1] && bits[3 * a + 2] === bits[3 * b + 2];
}
