// The mesh of a scene as the daemon writes it: groups, areas, and elements that figures leave out.
import assert from "node:assert/strict";
import { test } from "node:test";
import { sourceOf } from "../source.mjs";

const { glassText, readMesh } = await sourceOf("picture/glb"), { figuresOf } = await sourceOf("picture/scale");

/** A binary glTF of unit squares in the plane y = 0, those of a group side by side. */
function squares(groups, lambert = {}) {
    const gltf = { extras: { lambert }, materials: [], nodes: [{ children: groups.map((_, k) => k + 1) }], meshes: [], accessors: [], bufferViews: [] }, parts = [];
    let at = 0, element = 0;
    const put = (values, type, width) => {
        parts.push(Buffer.from(values.buffer));
        gltf.bufferViews.push({ byteOffset: at, byteLength: values.byteLength });
        gltf.accessors.push({ bufferView: gltf.bufferViews.length - 1, componentType: values instanceof Uint32Array ? 5125 : 5126, type,
            count: values.length / width });
        at += values.byteLength;
        return gltf.accessors.length - 1;
    };
    for (const { name, count, buried, glass, colour } of groups) {
        const each = (make) => Array.from({ length: count }, (_, k) => make(k)).flat();
        const attributes = { POSITION: put(Float32Array.from(each((k) => [k, 0, 0, k, 0, 1, k + 1, 0, 1, k + 1, 0, 0])), "VEC3", 3),
            NORMAL: put(Float32Array.from(each(() => [0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0])), "VEC3", 3),
            _ELEMENT: put(Float32Array.from(each((k) => Array(4).fill(element + k))), "SCALAR", 1),
            _CORNER: put(Float32Array.from(each((k) => [0, 1, 2, 3].map((i) => 4 * (element + k) + i))), "SCALAR", 1) };
        const indices = put(Uint32Array.from(each((k) => [0, 1, 2, 0, 2, 3].map((i) => 4 * k + i))), "SCALAR", 1);
        gltf.nodes.push({ name, mesh: gltf.meshes.length, extras: { buried, glass } });
        if (colour !== undefined) gltf.materials.push({ pbrMetallicRoughness: { baseColorFactor: colour } });
        gltf.meshes.push({ primitives: [{ attributes, indices, ...(colour === undefined ? {} : { material: gltf.materials.length - 1 }) }] });
        element += count;
    }
    // No corner is shared: each has the light of its element.
    const view = (values) => gltf.accessors[put(values, "SCALAR", 1)].bufferView, corners = Array.from({ length: 4 * element }, (_, k) => k);
    lambert.corners = { count: corners.length, parts: view(Uint32Array.from([...corners, corners.length])), first: view(Uint32Array.from([...corners, corners.length])),
        elements: view(Uint32Array.from(corners, (k) => k >> 2)), weights: view(Float32Array.from(corners, () => 1)) };
    let text = JSON.stringify(gltf);
    text += " ".repeat((4 - text.length % 4) % 4);
    const file = Buffer.concat([Buffer.alloc(20), Buffer.from(text), Buffer.alloc(8), ...parts]);
    file.writeUInt32LE(0x46546c67, 0);
    file.writeUInt32LE(text.length, 12);
    return file.buffer.slice(file.byteOffset, file.byteOffset + file.length);
}

test("elements below a body have no part in figures", () => {
    const mesh = readMesh(squares([{ name: "floor", count: 4, buried: [1, 3] }, { name: "lamp", count: 2 }]));
    assert.deepEqual(mesh.groups.map(({ name, elements, counted }) => [name, [...elements], [...counted]]),
        [["floor", [0, 1, 2, 3], [0, 2]], ["lamp", [4, 5], [4, 5]]]);
    assert.deepEqual([...mesh.buried], [1, 3]);
    const { min, mean, area, uniformity } = figuresOf(Float32Array.of(2, 0, 6, 0, 9, 9), mesh.area, mesh.groups[0].counted);
    assert.deepEqual([min, mean, area, uniformity], [2, 4, 2, 0.5]);
});

test("panes have their part of the index, what they let pass and what they reflect", () => {
    const glass = { transmittance: 0.49, faces: 2 };
    const mesh = readMesh(squares([{ name: "floor", count: 2, colour: [0.5, 0.4, 0.3, 1] }, { name: "pane", count: 3, glass, colour: [0.2, 0.2, 0.1, 0.3] }],
        { glass_law: "none" }));
    assert.deepEqual([mesh.panes, mesh.glassByAngle], [[{ first: 12, count: 18, glass }], false]);
    assert.deepEqual(mesh.groups.map((group) => group.glass), [null, glass]);
    const near = mesh.groups.map((group) => group.reflectance.map((v) => Number(v.toFixed(12))));
    assert.deepEqual(near, [[0.5, 0.4, 0.3], [0.06, 0.06, 0.03]]);
    assert.equal(readMesh(squares([{ name: "floor", count: 1 }])).glassByAngle, true);
    assert.deepEqual([glassText(glass), glassText({ transmittance: 0.7812, faces: 1 })], ["pane, T = 0.49 of 2 faces together", "pane, T = 0.781"]);
});

test("corners have the weights of elements", () => {
    const { corners, cornerOf, elementOf } = readMesh(squares([{ name: "floor", count: 2 }, { name: "lamp", count: 1 }]));
    assert.equal(corners.count, 12);
    assert.deepEqual([...cornerOf], Array.from({ length: 12 }, (_, v) => v));
    for (let v = 0; v < 12; v++) assert.deepEqual([...corners.elements.subarray(corners.first[v], corners.first[v + 1])], [elementOf[v]]);
    assert.deepEqual([...corners.weights], Array(12).fill(1));
});
