// How a scene is looked at: cameras of its file, and smooth light where elements of different sizes meet.
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { test } from "node:test";
import { Daemon, inFolder, lambert, makeStore, near, openPage, pixel, settled } from "./page.mjs";

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
    const { camera } = window.lambert.scene.cameras;
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
            await page.waitForFunction((angle) => window.lambert.scene.cameras.camera.fov === angle, camera.fov);
            const of = { ...camera, eye: turned(camera.eye), direction: turned(camera.direction), up: turned(camera.up) };
            await page.waitForFunction(({ eye, direction }) => {
                const { camera } = window.lambert.scene.cameras, now = camera.getWorldDirection(camera.position.clone());
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
        await other.waitForFunction(() => window.lambert.scene.cameras.camera.fov === 50 && window.lambert.scene.cameras.camera.up.y === 1);
        assert.deepEqual([...page.faults, ...other.faults], []);
        await other.context().close();
        await page.context().close();
        await daemon.stop();
    }
});

test("smooth light has no step where elements of different sizes meet", async () => {
    const store = makeStore("adaptive", "cornell", { generate: ["--elements", 300], precompute: ["--probes", 0, "--mesh-error", 0.05, "--elements", 1500] });
    const daemon = await Daemon.start([store]);
    const page = await openPage(daemon.address);
    await page.evaluate(() => {
        const { store: s } = window.lambert;
        s.change({ ...s.now, view: { ...s.now.view, smooth: true, tone: "linear", exposure: null } });
    });
    await settled(page);
    // Corners that stand in the middle of an edge, found the plain way, and both sides of that edge; those where means differ most.
    const places = await page.evaluate(() => {
        const { now: { mesh, picker }, cameras: { camera } } = window.lambert.scene, { positions: p, elementOf } = mesh, out = [];
        camera.updateMatrixWorld();
        const at = (v) => [p[3 * v], p[3 * v + 1], p[3 * v + 2]];
        const { values } = window.lambert.scene.fields[0], far = (a, b) => Math.max(...a.map((x, d) => Math.abs(x - b[d])));
        const meanAt = (point, group) => {
            const all = [];
            for (let v = 0; v < elementOf.length; v++) if (mesh.groupOf[elementOf[v]] === group && far(at(v), point) < 1e-5) all.push(values[elementOf[v]]);
            return all.reduce((sum, x) => sum + x, 0) / all.length;
        };
        const normal = (v) => [0, 1, 2].map((d) => mesh.normals[3 * v + d]), seen = (point) => camera.position.clone().set(...point).project(camera);
        for (let begin = 0, end = 0; begin < elementOf.length; begin = end) {
            while (end < elementOf.length && elementOf[end] === elementOf[begin]) end++;
            if (end - begin < 5) continue; // a quad has its corners alone, and a corner of another more where one is inside an edge
            const centre = [0, 1, 2].map((d) => { let sum = 0; for (let v = begin; v < end; v++) sum += p[3 * v + d]; return sum / (end - begin); });
            for (let v = begin; v < end; v++) {
                const a = at(v > begin ? v - 1 : end - 1), b = at(v + 1 < end ? v + 1 : begin), middle = at(v), own = elementOf[v];
                if (far(middle, a.map((x, d) => (x + b[d]) / 2)) > 1e-5) continue;
                const u = elementOf.findIndex((other, w) => mesh.groupOf[other] === mesh.groupOf[own] && other !== own && far(at(w), middle) < 1e-5 && far(normal(w), normal(v)) < 1e-3);
                if (u < 0) continue;
                // A fiftieth into the large element, and as far beyond the edge.
                const sides = [1, -1].map((side) => middle.map((x, d) => x + side * 0.02 * (centre[d] - middle[d]))).map(seen);
                const elements = sides.map((s) => picker.at(s.x, s.y, camera));
                if (elements[0] !== own || elements[1] === null || elements[1] === own || mesh.groupOf[elements[1]] !== mesh.groupOf[own]) continue;
                if (!sides.every((s) => Math.abs(s.x) < 0.95 && Math.abs(s.y) < 0.95)) continue;
                const group = mesh.groupOf[own], plain = meanAt(middle, group), along = (meanAt(a, group) + meanAt(b, group)) / 2;
                out.push({ step: Math.abs(plain - along) / along, sides: sides.map((s) => [(s.x + 1) / 2, (1 - s.y) / 2]) });
            }
        }
        return out.sort((one, other) => other.step - one.step).slice(0, 12);
    });
    // The box is closed where it is looked into: nothing of the background is seen through it.
    const holes = await page.evaluate(() => {
        const { stage } = window.lambert.scene, gl = stage.renderer.getContext(), [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
        const bytes = new Uint8Array(4 * w * h);
        stage.background = "#ff00ff";
        stage.draw();
        gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
        let found = 0;
        for (let y = Math.round(0.15 * h); y < 0.9 * h; y++)
            for (let x = Math.round(0.2 * w); x < 0.8 * w; x++) {
                const k = 4 * (y * w + x);
                if (bytes[k + 2] > bytes[k + 1] + 40 && bytes[k] > bytes[k + 1] + 10) found += 1;
            }
        return found;
    });
    console.log(`pixels that show the background: ${holes}`);
    assert.equal(holes, 0);
    assert.ok(places.length >= 5, `${places.length} such places are seen`);
    let most = 0;
    for (const { sides: [inside, beyond] } of places) {
        const [one, other] = [await pixel(page, ...inside), await pixel(page, ...beyond)];
        most = Math.max(most, ...one.map((v, c) => Math.abs(v - other[c])));
    }
    // Of plain means these pixels differed by up to 10 of 255.
    assert.ok(places[0].step > 0.1, `means differ by ${places[0].step} at most`);
    console.log(`largest step across such an edge: ${most} of 255 at ${places.length} places`);
    // Light that is the same along the edge changes by a twentieth of its slope in either element.
    assert.ok(most <= 6, `${most} of 255`);
    assert.deepEqual(page.faults, []);
    await page.context().close();
    await daemon.stop();
});

test("in a model lower than people the eye is at .6 of its height", async () => {
    const store = makeStore("low", "cornell", { generate: ["--elements", 300], precompute: ["--probes", 0, "--quality", "draft"] });
    const daemon = await Daemon.start([store]), page = await openPage(daemon.address);
    await page.evaluate(() => { const { store: s } = window.lambert; s.change({ ...s.now, view: { ...s.now.view, walk: true } }); });
    await page.waitForFunction(() => { const { camera } = window.lambert.store.now.view; return camera !== null && Math.abs(camera[1] - camera[4]) < 1e-3; });
    await settled(page);
    const [eye, low, high] = await page.evaluate(() => {
        const { cameras } = window.lambert.scene, heights = window.lambert.scene.now.mesh.positions.filter((_, k) => k % 3 === 1);
        return [cameras.now[1], Math.min(...heights), Math.max(...heights)];
    });
    assert.ok(high - low < 0.6 && Math.abs(eye - low - 0.6 * (high - low)) < 1e-3, `${eye} in ${low} to ${high}`);
    await page.context().close();
    await daemon.stop();
});

test("who walks into a scene stands on its ground and looks ahead, and a cross reads what is under it then", async () => {
    const store = makeStore("hill", "city", { generate: ["--variant", 2, "--terrain", "hill", "--elements", 600], precompute: ["--probes", 0, "--rays", 128, "--sky", "tregenza"] });
    const daemon = await Daemon.start([store]), page = await openPage(daemon.address);
    await page.locator("main canvas").first().focus();
    await page.keyboard.press("r");
    await page.waitForFunction(() => window.lambert.scene.hovered !== null);
    await page.evaluate(() => { const { store: s } = window.lambert; s.change({ ...s.now, view: { ...s.now.view, walk: true } }); });
    await page.waitForFunction(() => { const { camera } = window.lambert.store.now.view; return camera !== null && Math.abs(camera[1] - camera[4]) < 1e-3; });
    await settled(page);
    const found = await page.evaluate(() => {
        const { scene: { now: { mesh, picker }, cameras, hovered }, store: { now } } = window.lambert, [x, y, z] = now.view.camera, { positions: p, index } = mesh;
        // Heights of the triangles that face up at x and z, the plain way.
        const heights = [], side = (a, b) => (p[3 * b] - p[3 * a]) * (z - p[3 * a + 2]) - (p[3 * b + 2] - p[3 * a + 2]) * (x - p[3 * a]);
        for (let t = 0; t < index.length; t += 3) {
            const [a, b, c] = index.subarray(t, t + 3), [u, v, w] = [side(b, c), side(c, a), side(a, b)];
            if (u < 0 && v < 0 && w < 0) heights.push((u * p[3 * a + 1] + v * p[3 * b + 1] + w * p[3 * c + 1]) / (u + v + w));
        }
        cameras.camera.updateMatrixWorld();
        return { y, heights, hovered, under: picker.at(0, 0, cameras.camera) };
    });
    assert.ok(found.heights.length > 0 && Math.abs(found.y - Math.min(...found.heights) - 1.6) < 0.01, JSON.stringify(found));
    assert.equal(found.hovered, found.under);
    // Another scene is entered on foot, too.
    await page.evaluate(() => window.lambert.ask.open("hill", null));
    await settled(page);
    assert.ok(Math.abs((await page.evaluate(() => window.lambert.scene.cameras.now))[1] - found.y) < 0.01);
    assert.deepEqual(page.faults, []);
    await page.context().close();
    await daemon.stop();
});
