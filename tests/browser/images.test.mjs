// Images of materials: the page draws what falls on an element times the image at each pixel, not the element's mean.
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { test } from "node:test";
import { deflateSync } from "node:zlib";
import { Daemon, inFolder, lambert, openPage, pixel, settled, toSrgb } from "./page.mjs";

/** The two colours of an image; a grey one makes a store of one channel. */
const COLOURS = { two: [[200, 60, 40], [40, 90, 180]], grey: [[200, 200, 200], [60, 60, 60]] };
const SIZE = 64, EDGE = 22; // columns of the first colour: the colours meet inside an element

/** The checksum of PNG's chunks (ISO 3309), which Node.js has only since 20.15. */
function crc32(bytes) {
    let c = 0xffffffff;
    for (const byte of bytes) {
        c ^= byte;
        for (let k = 0; k < 8; k++) c = c & 1 ? 0xedb88320 ^ (c >>> 1) : c >>> 1;
    }
    return (c ^ 0xffffffff) >>> 0;
}

function png([left, right]) {
    const chunk = (kind, body) => {
        const head = Buffer.alloc(4), tail = Buffer.alloc(4), text = Buffer.concat([Buffer.from(kind), body]);
        head.writeUInt32BE(body.length);
        tail.writeUInt32BE(crc32(text));
        return Buffer.concat([head, text, tail]);
    };
    const size = Buffer.from([0, 0, 0, SIZE, 0, 0, 0, SIZE, 8, 2, 0, 0, 0]);
    const row = Buffer.from([0, ...Array.from({ length: SIZE }, (_, x) => (x < EDGE ? left : right)).flat()]);
    return Buffer.concat([Buffer.from([0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a]), chunk("IHDR", size),
        chunk("IDAT", deflateSync(Buffer.concat(Array(SIZE).fill(row)))), chunk("IEND", Buffer.alloc(0))]);
}

const decode = (v) => (v / 255 <= 0.04045 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4);

/** A store of a floor with an image of two colours under a lamp. */
function withImage(name, ...options) {
    writeFileSync(inFolder(`${name}.png`), png(COLOURS[name]));
    writeFileSync(inFolder(`${name}.mtl`), `newmtl floor\nKd 1 1 1\nmap_Kd ${name}.png\nnewmtl lamp\nKd .5 .5 .5\nKe 8 8 8\n`);
    writeFileSync(inFolder(`${name}.obj`), `mtllib ${name}.mtl\nv 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 3\nv 1 3 3\nv 3 3 3\nv 3 1 3\n`
        + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\no floor\nusemtl floor\nf 1/1 2/2 3/3 4/4\no lamp\nusemtl lamp\nf 5 6 7 8\n");
    lambert("precompute", inFolder(`${name}.obj`), "-o", inFolder(`${name}.h5`), "--quiet", "--probes", 2, "--elements", 40, ...options);
    return inFolder(`${name}.h5`);
}

for (const name of ["two", "grey"]) test(`an image keeps its pixels within an element, ${name}`, async () => {
    const daemon = await Daemon.start([withImage(name)]), channels = name === "grey" ? 1 : 3;
    const page = await openPage(daemon.address);
    await page.waitForFunction(() => window.lambert.scene.stage.uniforms.is_textured.value);
    await page.evaluate(() => {
        const { store: s, scene: { cameras } } = window.lambert;
        s.change({ ...s.now, view: { ...s.now.view, smooth: false, tone: "linear", exposure: -2 } });
        cameras.place([2, 2.5, 1.5, 2, 0, -2], false);
    });
    await settled(page);
    // Points of the floor on both sides of the edge, within one element; y is up in the picture, and -z the store's y.
    const points = await page.evaluate((edge) => [-1, 1].map((side) => {
        const { cameras: { camera }, now: scene } = window.lambert.scene;
        camera.updateMatrixWorld();
        const p = camera.position.clone().set(4 * edge + 0.08 * side, 0, -2.3).project(camera);
        return { x: (p.x + 1) / 2, y: (1 - p.y) / 2, element: scene.picker.at(p.x, p.y, camera) };
    }), EDGE / SIZE);
    assert.equal(points[0].element, points[1].element);
    const answer = await daemon.json(`/v1/scenes/${name}/radiosity`,
        { emission: { groups: { lamp: channels === 1 ? 8 : [8, 8, 8] } }, select: { elements: [points[0].element] }, quantity: "irradiance" });
    const H = channels === 1 ? new Array(3).fill(answer.irradiance[0]) : answer.irradiance.map((channel) => channel[0]);
    for (const [k, colour] of COLOURS[name].entries()) {
        const wanted = toSrgb(colour.map((v, c) => decode(v) * H[c] / 4));
        const shown = await pixel(page, points[k].x, points[k].y);
        // JPEG keeps even colours within a few steps; its blocks of 8 pixels end beside the edge.
        assert.ok(wanted.every((v, c) => Math.abs(v - shown[c]) <= 10), `${shown} is shown, must be near ${wanted}`);
    }
    // Without images the element has its mean.
    await page.getByRole("tab", { name: "View" }).click();
    await page.getByLabel("Images of materials").uncheck();
    await settled(page);
    assert.deepEqual(await pixel(page, points[0].x, points[0].y), await pixel(page, points[1].x, points[1].y));
    assert.deepEqual(page.faults, []);
    await page.context().close();
});

test("a variant keeps the images of groups that it does not change", async () => {
    writeFileSync(inFolder("tokens"), "writer read vary\n", { mode: 0o600 });
    const store = withImage("two", "--method", "low-rank", "--keep-factors"), headers = { Authorization: "Bearer writer", "Content-Type": "application/json" };
    const daemon = await Daemon.start([store], { options: ["--token-file", inFolder("tokens"), "--max-variants", 2] });
    const ask = (path, more) => fetch(`${daemon.address}/v1/scenes/${path}`, { headers, ...more });
    const texturesOf = async (name) => {
        const file = await (await ask(`${encodeURIComponent(name)}/mesh`)).arrayBuffer(), length = new DataView(file).getUint32(12, true);
        return JSON.parse(new TextDecoder().decode(new Uint8Array(file, 20, length))).textures?.length ?? 0;
    };
    assert.equal(await texturesOf("two"), 1);
    for (const [variant, groups, textures] of [["lamp", { lamp: [0.2, 0.2, 0.2] }, 1], ["floor", { floor: [0.1, 0.5, 0.1] }, 0]]) {
        const made = await ask("two/reflectance", { method: "PUT", body: JSON.stringify({ variant, groups }) });
        assert.equal(made.status, 202, await made.text());
        while ((await ask(encodeURIComponent(`two@${variant}`))).status !== 200) await new Promise((resolve) => { setTimeout(resolve, 50); });
        assert.equal(await texturesOf(`two@${variant}`), textures, variant);
    }
    await daemon.stop();
});

test("an image under the sun that is drawn keeps its pixels, too", async () => {
    const daemon = await Daemon.start([withImage("two", "--sky", "tregenza")]), page = await openPage(daemon.address);
    await page.waitForFunction(() => window.lambert.scene.stage.uniforms.is_textured.value);
    await page.evaluate(() => {
        const { store: s, scene: { cameras } } = window.lambert, { lighting, view } = s.now;
        const sky = { ...lighting.sky, model: "given", direct: 700, diffuse: 100, latitude: 0, longitude: 0, zone: 0, day: 80, hour: 12, sun: "tile" };
        s.change({ ...s.now, lighting: { ...lighting, groups: {}, sky }, view: { ...view, smooth: false, tone: "linear", exposure: -8, sharpSun: true } });
        cameras.place([1.4, 2.5, 1.5, 1.4, 0, -0.5], false);
    });
    await settled(page);
    // In front of the lamp's shadow, on both sides of the edge in the image.
    const { points, parts } = await page.evaluate((edge) => {
        const { store: { now }, scene: { cameras: { camera }, now: scene, sky } } = window.lambert;
        camera.updateMatrixWorld();
        return {
            points: [-1, 1].map((side) => {
                const p = camera.position.clone().set(4 * edge + 0.08 * side, 0, -0.5).project(camera);
                return { x: (p.x + 1) / 2, y: (1 - p.y) / 2, element: scene.picker.at(p.x, p.y, camera) };
            }),
            parts: sky.parts(now.lighting, scene.description),
        };
    }, EDGE / SIZE);
    const ask = async (sky, quantity, element) => (await daemon.json("/v1/scenes/two/radiosity", { emission: { sky }, select: { elements: [element] }, quantity }))[quantity].map((channel) => channel[0]);
    for (const [k, colour] of COLOURS.two.entries()) {
        const { x, y, element } = points[k], [B, H, further] = await Promise.all([ask(parts.sky, "radiosity", element), ask(parts.sky, "irradiance", element), ask(parts.sun, "indirect", element)]);
        const received = H.map((h, c) => h + (further[c] * h) / B[c] + parts.light[c] * parts.direction[2]);
        const wanted = toSrgb(colour.map((v, c) => decode(v) * received[c] * 2 ** -8)), shown = await pixel(page, x, y);
        assert.ok(wanted.every((v, c) => Math.abs(v - shown[c]) <= 10), `${shown} is shown, must be near ${wanted}`);
    }
    assert.deepEqual(page.faults, []);
    await page.context().close();
    await daemon.stop();
});
