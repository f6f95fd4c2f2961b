// How a scene is looked at: cameras of its file, and smooth light where elements of different sizes meet.
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { test } from "node:test";
import { Daemon, inFolder, lambert, near, openPage, settled } from "./page.mjs";

/** A floor and a lamp above it, seen by two cameras: one looks down, the other is tilted sideways, too. */
function withCameras() {
    const floor = [-2, 0, -2, -2, 0, 2, 2, 0, 2, 2, 0, -2], lamp = [-1, 3, -1, 1, 3, -1, 1, 3, 1, -1, 3, 1], quad = [0, 1, 2, 0, 2, 3];
    const bytes = Buffer.concat([Buffer.from(new Float32Array([...floor, ...lamp]).buffer), Buffer.from(new Uint16Array(quad).buffer)]);
    const half = Math.PI / 16, roll = Math.PI / 10;
    return JSON.stringify({
        asset: { version: "2.0" }, scene: 0, scenes: [{ nodes: [0, 1, 2, 3] }],
        nodes: [
            { name: "floor", mesh: 0 }, { name: "lamp", mesh: 1 },
            { name: "down", camera: 0, translation: [0.5, 1.5, 4], rotation: [-Math.sin(half), 0, 0, Math.cos(half)] },
            { name: "tilted", camera: 1, translation: [0, 1, 5], rotation: [0, 0, Math.sin(roll), Math.cos(roll)] },
        ],
        cameras: [0.6, 0.9].map((yfov) => ({ type: "perspective", perspective: { yfov, znear: 0.1 } })),
        meshes: [0, 1].map((k) => ({ primitives: [{ attributes: { POSITION: k }, indices: 2, material: k }] })),
        materials: [{ pbrMetallicRoughness: { baseColorFactor: [0.5, 0.5, 0.5, 1] } }, { emissiveFactor: [1, 1, 1] }],
        accessors: [
            { bufferView: 0, componentType: 5126, count: 4, type: "VEC3", min: [-2, 0, -2], max: [2, 0, 2] },
            { bufferView: 0, byteOffset: 48, componentType: 5126, count: 4, type: "VEC3", min: [-1, 3, -1], max: [1, 3, 1] },
            { bufferView: 1, componentType: 5123, count: 6, type: "SCALAR" },
        ],
        bufferViews: [{ buffer: 0, byteLength: 96 }, { buffer: 0, byteOffset: 96, byteLength: 12 }],
        buffers: [{ byteLength: 108, uri: `data:application/octet-stream;base64,${bytes.toString("base64")}` }],
    });
}

const dot = (a, b) => a.reduce((sum, v, k) => sum + v * b[k], 0);

/** Where a camera of the daemon's description sees a point, from −1 to 1. */
function seenAt({ eye, direction: d, up, fov }, aspect, point) {
    const from = point.map((v, k) => v - eye[k]), right = [d[1] * up[2] - d[2] * up[1], d[2] * up[0] - d[0] * up[2], d[0] * up[1] - d[1] * up[0]];
    const scale = dot(from, d) * Math.tan((fov * Math.PI) / 360);
    return [dot(from, right) / scale / aspect, dot(from, up) / scale];
}

const POINTS = [[0, 0, 0], [-1.5, 0.2, 1], [1, 3, -1]];

const shown = (page) => page.evaluate((points) => {
    const { camera } = window.lambert.cameras;
    camera.updateMatrixWorld();
    return { aspect: camera.aspect, points: points.map((p) => { const at = camera.position.clone().set(...p).project(camera); return [at.x, at.y]; }) };
}, POINTS);

test("a camera of the scene shows what it sees: its angle of view and its up", async () => {
    const scene = inFolder("seen.gltf"), store = inFolder("seen.h5");
    writeFileSync(scene, withCameras());
    // Any axis of the store becomes y in the picture.
    for (const up of ["y", "z"]) {
        lambert("precompute", scene, "-o", store, "--quiet", "--probes", 0, "--elements", 40, "--up", up);
        const daemon = await Daemon.start([store]);
        const { cameras } = await daemon.json("/v1/scenes/seen");
        const page = await openPage(daemon.address);
        await page.getByRole("tab", { name: "View" }).click();
        const turned = ([x, y, z]) => (up === "z" ? [x, z, -y] : [x, y, z]);
        for (const camera of cameras) {
            await page.getByRole("button", { name: camera.name }).click();
            await page.waitForFunction((angle) => window.lambert.cameras.camera.fov === angle, camera.fov);
            const of = { ...camera, eye: turned(camera.eye), direction: turned(camera.direction), up: turned(camera.up) };
            await page.waitForFunction(({ eye, direction }) => {
                const { camera } = window.lambert.cameras, now = camera.getWorldDirection(camera.position.clone());
                return [...camera.position.toArray(), ...now.toArray()].every((v, k) => Math.abs(v - [...eye, ...direction][k]) < 1e-4);
            }, of);
            await settled(page);
            const now = await shown(page);
            for (const [k, point] of POINTS.entries()) near(now.points[k], seenAt(of, now.aspect, point), 2e-3);
        }
        // A link has it all, and the whole scene is seen as before.
        await page.waitForTimeout(800);
        const other = await openPage(daemon.address, { hash: await page.evaluate(() => window.location.hash) });
        const [one, two] = [await shown(page), await shown(other)];
        for (const k of POINTS.keys()) near(one.points[k], two.points[k], 2e-3);
        await other.getByRole("tab", { name: "View" }).click();
        await other.getByRole("button", { name: "Fit (F)" }).click();
        await other.waitForFunction(() => window.lambert.cameras.camera.fov === 50 && window.lambert.cameras.camera.up.y === 1);
        assert.deepEqual([...page.faults, ...other.faults], []);
        await other.context().close();
        await page.context().close();
        await daemon.stop();
    }
});
