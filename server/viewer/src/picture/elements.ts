// Normals and reflectances of elements, [3][n], for light that is drawn on the page.
import type { SceneMesh } from "./glb.ts";

/** Unit normals of elements' planes: sums of those of their triangles, by area. */
export function normalsOf(
    { elements, positions: p, elementOf, index }: Pick<SceneMesh, "elements" | "positions" | "elementOf" | "index">,
): Float32Array {
    const out = new Float32Array(3 * elements);
    for (let t = 0; t < index.length; t += 3) {
        const [a, b, c] = [3 * index[t], 3 * index[t + 1], 3 * index[t + 2]], i = elementOf[index[t]];
        const [ux, uy, uz] = [p[b] - p[a], p[b + 1] - p[a + 1], p[b + 2] - p[a + 2]],
            [vx, vy, vz] = [p[c] - p[a], p[c + 1] - p[a + 1], p[c + 2] - p[a + 2]];
        out[i] += uy * vz - uz * vy;
        out[elements + i] += uz * vx - ux * vz;
        out[2 * elements + i] += ux * vy - uy * vx;
    }
    for (let i = 0; i < elements; i++) {
        const length = Math.hypot(out[i], out[elements + i], out[2 * elements + i]);
        for (let d = 0; d < 3 && length > 0; d++) out[d * elements + i] /= length;
    }
    return out;
}

/** Of an element with an image its own, of others the mean of their group. */
export function reflectancesOf(mesh: SceneMesh): Float32Array {
    const { elements: n, groupOf, groups, reflectance, images } = mesh, out = new Float32Array(3 * n),
        hasImage = new Set(images.map(({ group }) => group));
    for (let i = 0; i < n; i++)
        for (let c = 0; c < 3; c++)
            out[c * n + i] = reflectance !== null && hasImage.has(groupOf[i])
                ? reflectance[c * n + i]
                : groups[groupOf[i]].reflectance[c];
    return out;
}
