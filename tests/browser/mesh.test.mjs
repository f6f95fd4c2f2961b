// Khronos' validator on the meshes that the daemon makes: no error, no warning. Nothing is drawn.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { test } from "node:test";
import validator from "gltf-validator";
import { Daemon, inFolder, lambert, makeStore } from "./page.mjs";

/** The validator's report of bytes, which has no fault and no warning. */
async function reportOn(bytes, name) {
    const report = await validator.validateBytes(bytes, { maxIssues: 20 });
    const said = report.issues.messages.map((m) => `${m.code} ${m.pointer}: ${m.message}`).join("\n");
    assert.deepEqual([report.issues.numErrors, report.issues.numWarnings], [0, 0], `${name}\n${said}`);
    assert.equal(report.mimeType, "model/gltf-binary");
    return report;
}

/** That of a mesh, whose elements and groups are counted. */
async function validated(daemon, name, query = "") {
    const response = await fetch(`${daemon.address}/v1/scenes/${encodeURIComponent(name)}/mesh${query}`);
    assert.equal(response.status, 200, name);
    const report = await reportOn(new Uint8Array(await response.arrayBuffer()), name);
    const about = await daemon.json(`/v1/scenes/${encodeURIComponent(name)}`);
    assert.equal(report.info.materialCount, about.groups.filter((g) => g.elements > 0).length);
    assert.ok(report.info.totalTriangleCount >= about.elements);
    return report;
}

test("meshes of generated scenes are valid glTF", async () => {
    const draft = ["--probes", 0, "--quality", "draft"];
    const stores = [
        makeStore("cornell", "cornell", { generate: ["--elements", 700], precompute: draft }),
        makeStore("sides", "cornell", { generate: ["--elements", 300], precompute: [...draft, "--two-sided"] }),
        makeStore("city", "city", { generate: ["--variant", 2, "--terrain", "hill", "--elements", 2000], precompute: draft }),
        makeStore("rooms", "rooms", { generate: ["--elements", 2000], precompute: [...draft, "--elements", 3000] }),
        makeStore("canopy", "canopy", { generate: ["--elements", 1000], precompute: [...draft, "--up", "x"] }),
    ];
    const daemon = await Daemon.start(stores);
    for (const name of ["cornell", "sides", "city", "rooms", "canopy"])
        for (const query of ["", "?corners", "?corners=elements"]) await validated(daemon, name, query);
    const emissive = await validated(daemon, "cornell");
    assert.deepEqual(emissive.info.extensionsUsed, ["KHR_materials_emissive_strength"]);
    await daemon.stop();
});

test("so is light on a mesh", async () => {
    const store = makeStore("lit", "cornell", { generate: ["--elements", 300], precompute: ["--probes", 0, "--quality", "draft"] });
    for (const options of [[], ["--smooth"], ["--quantity", "irradiance", "--smooth"]]) {
        lambert("solve", store, "--emit", "lamp=1700,1200,400", ...options, "-o", inFolder("lit.glb"));
        const report = await reportOn(new Uint8Array(readFileSync(inFolder("lit.glb"))), options.join(" "));
        assert.deepEqual(report.info.extensionsUsed, ["KHR_materials_unlit"]);
    }
});

/** A glTF with few words for much that is unusual: names, scales that mirror, slivers, one triangle twice. */
function oddScene() {
    const corners = [0, 0, 0, 1, 0, 0, 0, 1, 0, 1e-4, 1, 0, 1, 1e-4, 5, 1e6, 0, 0], triangles = [0, 1, 2, 0, 2, 3, 1, 4, 5, 0, 1, 2];
    const bytes = Buffer.concat([Buffer.from(new Float32Array(corners).buffer), Buffer.from(new Uint16Array(triangles).buffer)]);
    const material = { pbrMetallicRoughness: { baseColorFactor: [0.8, 0.2, 0.05, 1] } };
    return JSON.stringify({
        asset: { version: "2.0" }, scene: 0, scenes: [{ nodes: [0, 1, 2] }],
        nodes: [
            { name: "a \"quoted\" \\ name", mesh: 0 },
            { name: "ランプ 💡", mesh: 1, scale: [-1, 2, 1], translation: [0, 0, -3] },
            { name: "turned", mesh: 0, rotation: [0.5, 0.5, 0.5, 0.5], scale: [1e-3, 1e-3, 1e-3] },
        ],
        meshes: [0, 1].map((k) => ({ primitives: [{ attributes: { POSITION: 0 }, indices: 1, material: k }] })),
        materials: [material, { ...material, emissiveFactor: [1, 0.5, 0] }],
        accessors: [
            { bufferView: 0, componentType: 5126, count: 6, type: "VEC3", min: [0, 0, 0], max: [1e6, 1, 5] },
            { bufferView: 1, componentType: 5123, count: 12, type: "SCALAR" },
        ],
        bufferViews: [{ buffer: 0, byteLength: 72 }, { buffer: 0, byteOffset: 72, byteLength: 24 }],
        buffers: [{ byteLength: 96, uri: `data:application/octet-stream;base64,${bytes.toString("base64")}` }],
    });
}

test("so is that of an odd scene", async () => {
    const scene = inFolder("odd.gltf"), store = inFolder("odd.h5");
    writeFileSync(scene, oddScene());
    lambert("precompute", scene, "-o", store, "--quiet", "--probes", 0, "--two-sided");
    const daemon = await Daemon.start([`${store}:Küche 3`]);
    await validated(daemon, "Küche 3");
    await daemon.stop();
});
