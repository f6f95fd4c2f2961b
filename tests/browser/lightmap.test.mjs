// Lightmaps in a glTF: Khronos' validator, and three.js' GLTFLoader, whose rays find at ten places what the map alone holds. Nothing is
// drawn.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { pathToFileURL } from "node:url";
import { inflateSync } from "node:zlib";
import validator from "gltf-validator";
import { inFolder, lambert, makeStore } from "./page.mjs";

const three = (path) => import(pathToFileURL(join(process.env.MODULES, "three", path)));

/** The values 0 to 65535 of a PNG of 16 bits, by rows, and its size. */
function readPng(bytes) {
    let at = 8, width = 0, height = 0, channels = 0;
    const packed = [];
    while (at < bytes.length) {
        const length = bytes.readUInt32BE(at), kind = bytes.toString("latin1", at + 4, at + 8), body = bytes.subarray(at + 8, at + 8 + length);
        if (kind === "IHDR") {
            width = body.readUInt32BE(0);
            height = body.readUInt32BE(4);
            assert.equal(body[8], 16);
            channels = body[9] === 2 ? 3 : 1;
        }
        if (kind === "IDAT") packed.push(body);
        at += 12 + length;
    }
    const raw = inflateSync(Buffer.concat(packed)), step = 2 * channels, row = step * width, out = Buffer.alloc(row * height);
    for (let y = 0; y < height; y++) {
        const filter = raw[y * (row + 1)];
        for (let x = 0; x < row; x++) {
            const left = x >= step ? out[y * row + x - step] : 0, up = y > 0 ? out[(y - 1) * row + x] : 0;
            const corner = x >= step && y > 0 ? out[(y - 1) * row + x - step] : 0, p = left + up - corner;
            const near = [left, up, corner].reduce((best, v) => (Math.abs(p - v) < Math.abs(p - best) ? v : best));
            out[y * row + x] = raw[y * (row + 1) + 1 + x] + [0, left, up, (left + up) >> 1, near][filter];
        }
    }
    return { width, height, channels, value: (x, y, c) => out.readUInt16BE(y * row + x * step + 2 * Math.min(c, channels - 1)) };
}

/** The bilinear values of an image, 0 to 1, as texture units find them: sRGB is decoded before. */
function sample(image, u, v, decode) {
    const x = u * image.width - 0.5, y = v * image.height - 0.5, i = Math.floor(x), j = Math.floor(y);
    return [0, 1, 2].map((c) => [0, 1].reduce((sum, dy) => sum + [0, 1].reduce((part, dx) =>
        part + (dx ? x - i : 1 - x + i) * (dy ? y - j : 1 - y + j) * decode(image.value(i + dx, j + dy, c) / 65535), 0), 0));
}

/** three.js' scene of a glTF; its images are left out, as Node has none. */
async function load(file) {
    globalThis.self ??= globalThis;
    const { GLTFLoader } = await three("examples/jsm/loaders/GLTFLoader.js"), bytes = readFileSync(file), loader = new GLTFLoader();
    loader.register((parser) => ({ name: "none", loadTexture: () => Promise.resolve(null), parser }));
    return loader.parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), "");
}

/** A valid file of a lightmap as three.js has it, with its image and what its values are of. */
async function lightmap(store, options, extensions) {
    lambert("solve", store, "--at", "texels", "--texel", 0.02, ...options, "-o", inFolder("map.glb"));
    const report = await validator.validateBytes(new Uint8Array(readFileSync(inFolder("map.glb"))), { maxIssues: 60 });
    const said = report.issues.messages.map((m) => `${m.code} ${m.pointer}: ${m.message}`).join("\n");
    assert.deepEqual([report.issues.numErrors, report.issues.numWarnings], [0, 0], said);
    assert.deepEqual(report.info.extensionsUsed ?? [], extensions);
    const { scene, parser } = await load(inFolder("map.glb"));
    scene.updateMatrixWorld(true);
    const image = readPng(Buffer.from(await parser.getDependency("bufferView", parser.json.images[0].bufferView)));
    const { white, unit } = parser.json.extras.lambert.lightmap;
    assert.equal(unit, "W/m2");
    const decode = options.length > 0 ? (v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4) : (v) => v;
    return { scene, parser, white, at: (uv) => sample(image, uv.x, uv.y, decode).map((v) => v * white) };
}

test("lightmaps are valid glTF, and three.js finds their light", async () => {
    const store = makeStore("map", "cornell", { generate: ["--elements", 700], precompute: ["--probes", 0, "--quality", "draft"] });
    const { Raycaster, Vector3 } = await three("build/three.module.js");
    const map = await lightmap(store, [], ["KHR_materials_emissive_strength", "MOZ_lightmap"]);
    // Rays from the middle of the room, y up, to all sides but the open front.
    const hits = [], middle = new Vector3(0.278, 0.4, -0.2);
    for (let k = 0; hits.length < 12; k++) {
        const way = new Vector3(Math.cos(2.4 * k), -0.9 + 0.15 * k, Math.sin(2.4 * k)).normalize();
        const hit = new Raycaster(middle, way).intersectObject(map.scene, true)[0];
        if (hit !== undefined) hits.push(hit);
        assert.ok(k < 40);
    }
    // The scene has z up.
    const turned = ({ x, y, z }) => [x, -z, y];
    writeFileSync(inFolder("hits.json"), JSON.stringify({ points: hits.map((hit, k) =>
        ({ name: `p${k}`, at: [turned(hit.point)], normal: turned(hit.face.normal) })) }));
    lambert("precompute", store, "--sensors", inFolder("hits.json"), "--quality", "high", "-o", inFolder("sensors.h5"));
    const { sensors } = JSON.parse(lambert("solve", inFolder("sensors.h5"), "--sensors", "all", "--json"));
    const shining = await lightmap(store, ["--emissive"], []);
    let off = 0, seen = 0;
    for (const [k, hit] of hits.entries()) {
        const wanted = sensors[k].values.flat(), found = map.at(hit.uv1);
        if (wanted.includes(null) || Math.max(...wanted) > map.white) continue;
        // Bilinear values of texels of 0.02 m: noise of 1 %, and more beside shadows.
        off += Math.abs(found[1] / wanted[1] - 1);
        seen++;
        assert.ok(found.every((v, c) => Math.abs(v / wanted[c] - 1) < 0.25), `place ${k}: ${found}, must be ${wanted}`);
        // The other file has the light that leaves there, which is the irradiance times the colour of the surface.
        const again = new Raycaster(middle, hit.point.clone().sub(middle).normalize()).intersectObject(shining.scene, true)[0];
        assert.equal(again.object.name, hit.object.name);
        const leaving = shining.at(again.uv1);
        const material = map.parser.json.materials.find(({ name }) => name === hit.object.name);
        if (material.emissiveFactor !== undefined) continue;
        material.pbrMetallicRoughness.baseColorFactor.slice(0, 3).forEach((rho, c) =>
            assert.ok(Math.abs(leaving[c] - rho * found[c]) < 2e-3 * rho * found[c] + 1e-4 * shining.white,
                `place ${k}: ${leaving}, must be ${rho} of ${found}`));
    }
    assert.ok(seen >= 10 && off / seen < 0.04, `${seen} places, off by ${off / seen}`);
});
