// Nodes of smooth shading, T-junctions, and elements that are drawn with the corners in their edges.
import assert from "node:assert/strict";
import { test } from "node:test";
import { sourceOf } from "../source.mjs";

const { findNodes } = await sourceOf("picture/nodes"), { splitEdges, trianglesOf } = await sourceOf("picture/split_edges");

test("corners of other groups, normals or places are no node", async () => {
    // Three triangles at one corner in the plane z = 0: two of group 0, one of group 1; and one of group 0 that stands upright.
    const corners = [[0, 0, 0, 1, 0, 0, 0, 1, 0], [0, 0, 0, 0, 1, 0, -1, 0, 0], [0, 0, 0, -1, 0, 0, 0, -1, 0], [0, 0, 0, 0, -1, 0, 0, 0, 1]];
    const normals = [[0, 0, 1], [0, 0, 1], [0, 0, 1], [1, 0, 0]];
    const nodes = findNodes({
        positions: Float32Array.from(corners.flat()), normals: Float32Array.from(normals.flatMap((n) => [...n, ...n, ...n])),
        elementOf: Uint32Array.from([0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3]), groupOf: Uint32Array.of(0, 0, 1, 0),
    });
    const at = (vertex) => [...nodes.elements.subarray(nodes.first[nodes.nodeOf[vertex]], nodes.first[nodes.nodeOf[vertex] + 1])].sort();
    assert.deepEqual([at(0), at(3), at(6), at(9)], [[0, 1], [0, 1], [2], [3]]);
    assert.deepEqual([at(2), at(4), at(1)], [[0, 1], [0, 1], [0]]);
    assert.equal(nodes.count, 10);
});

/** A mesh of quads in the plane z = 0, each [x, y, width, height]. */
function quads(list) {
    const corners = list.flatMap(([x, y, w, h]) => [x, y, 0, x + w, y, 0, x + w, y + h, 0, x, y + h, 0]);
    return {
        positions: Float32Array.from(corners), normals: Float32Array.from(corners, (_, k) => (k % 3 === 2 ? 1 : 0)),
        elementOf: Uint32Array.from({ length: 4 * list.length }, (_, v) => v >> 2), groupOf: new Uint32Array(list.length),
    };
}

test("an element is drawn with the corners inside its edges", async () => {
    // A square of side 2 with corners in all of its edges, two of them in one.
    const places = [[0, 0], [0.5, 0], [1.5, 0], [2, 0], [2, 1], [2, 2], [1, 2], [0, 2], [0, 1]];
    for (const flat of [[1, 2, 4, 6, 8], [1], [2, 4], []]) {
        const kept = places.map((_, k) => k).filter((k) => [0, 3, 5, 7].includes(k) || flat.includes(k));
        const found = trianglesOf(kept, kept.map((k) => flat.includes(k)));
        assert.equal(found.length, 3 * (kept.length - 2));
        let area = 0;
        for (let t = 0; t < found.length; t += 3) {
            const [a, b, c] = found.slice(t, t + 3).map((k) => places[k]), own = ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2;
            assert.ok(own > 0, `a triangle of ${own}`);
            area += own;
        }
        assert.equal(area, 4);
    }
});

/** The value at a corner, and what it is made of. */
function nodeAt(mesh, nodes, values, x, y) {
    const vertex = mesh.elementOf.findIndex((_, v) => mesh.positions[3 * v] === Math.fround(x) && mesh.positions[3 * v + 1] === Math.fround(y));
    const node = nodes.nodeOf[vertex], [begin, end] = [nodes.first[node], nodes.first[node + 1]];
    let sum = 0;
    for (let k = begin; k < end; k++) sum += values[nodes.elements[k]] * (nodes.weights?.[k] ?? 1 / (end - begin));
    return sum;
}

test("a corner inside an edge has the edge's value there", async () => {
    // A large element; at its right two of the height 1, of which the lower one has two of the height .5 at its right.
    const mesh = quads([[0, 0, 2, 2], [2, 0, 1, 1], [2, 1, 1, 1], [3, 0, 0.5, 0.5], [3, 0.5, 0.5, 0.5], [3, 1, 1, 1]]), values = [1, 2, 4, 8, 16, 32];
    const nodes = findNodes(mesh), at = (x, y) => nodeAt(mesh, nodes, values, x, y);
    const close = (a, b) => assert.ok(Math.abs(a - b) < 1e-6 * b, `${a} must be ${b}`);
    close(at(2, 0), (1 + 2) / 2);
    close(at(2, 2), (1 + 4) / 2);
    close(at(2, 1), (at(2, 0) + at(2, 2)) / 2);
    close(at(3, 0), (2 + 8) / 2);
    close(at(3, 0.5), (at(3, 0) + at(3, 1)) / 2);
    // The lower edge of the last one has a corner of an element below it.
    close(at(3.5, 1), (at(3, 1) + at(4, 1)) / 2);
    // A corner a quarter along an edge whose end hangs itself, a third along another one.
    const uneven = quads([[0, 0, 3, 3], [3, 0, 0.5, 1], [3.5, 0, 1.5, 1], [3, 1, 2, 2]]), hung = findNodes(uneven), of = (x, y) => nodeAt(uneven, hung, values, x, y);
    close(of(3, 1), (2 * of(3, 0) + of(3, 3)) / 3);
    close(of(3.5, 1), (3 * of(3, 1) + of(5, 1)) / 4);
    // Even meshes have plain means.
    assert.equal(findNodes(quads([[0, 0, 1, 1], [1, 0, 1, 1], [0, 1, 1, 1], [1, 1, 1, 1]])).weights, null);
    // Another group, or a surface that stands upright, has no part in it.
    const apart = quads([[0, 0, 2, 2], [2, 0, 1, 1], [2, 1, 1, 1]]);
    for (const other of [{ groupOf: Uint32Array.of(0, 1, 1) }, { normals: apart.normals.map((v, k) => (k < 12 ? [0, 1, 0][k % 3] : v)) }]) {
        const changed = { ...apart, ...other }, own = findNodes(changed), within = [...own.inner.values()].flat();
        close(nodeAt(changed, own, [1, 2, 4], 2, 1), (2 + 4) / 2);
        // The large element is drawn with that corner, under its own light.
        assert.deepEqual(within.map(({ along }) => along), [0.5]);
        assert.deepEqual([...own.elements.subarray(own.first[within[0].node], own.first[within[0].node + 1])], [0, 0]);
    }
    // Parts of 1/3 meet parts of 1/4: every corner of one hangs in an edge of the other, and none of them on itself.
    const thirds = [0, 1, 2].map((k) => [0, k * 4, 1, 4]), quarters = [0, 1, 2, 3].map((k) => [1, k * 3, 1, 3]);
    const crossed = quads([...thirds, ...quarters]), found = findNodes(crossed), light = [1, 1, 1, 1, 1, 1, 1];
    for (const y of [0, 3, 4, 6, 8, 9, 12]) close(nodeAt(crossed, found, light, 1, y), 1);
    close(nodeAt(crossed, found, [0, 8, 0, 0, 0, 0, 0], 1, 6), nodeAt(crossed, found, [0, 4, 0, 0, 0, 0, 0], 1, 4) + nodeAt(crossed, found, [0, 4, 0, 0, 0, 0, 0], 1, 8));
});

test("images and panes keep to their elements, and places in images to these", async () => {
    const mesh = quads([[0, 0, 2, 2], [2, 0, 1, 1], [2, 1, 1, 1]]), uv = Float32Array.from({ length: 24 }, (_, k) => mesh.positions[3 * (k >> 1) + k % 2]);
    const index = Uint32Array.from([0, 1, 2].flatMap((e) => [0, 1, 2, 0, 2, 3].map((k) => 4 * e + k)));
    const drawn = splitEdges({ ...mesh, index, uv, images: [{ first: 0, count: 6 }, { first: 6, count: 12 }], panes: [{ first: 6, count: 6 }] },
        findNodes(mesh));
    assert.deepEqual(drawn.images, [{ first: 0, count: 9 }, { first: 9, count: 12 }]);
    assert.deepEqual(drawn.panes, [{ first: 9, count: 6 }]);
    assert.deepEqual([...drawn.index.subarray(9)], [...index.subarray(6)]);
    assert.deepEqual([[...drawn.positions.subarray(36)], [...drawn.uv.subarray(24)], [...drawn.elementOf.subarray(12)]], [[2, 1, 0], [2, 1], [0]]);
});
