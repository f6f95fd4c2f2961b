// The sun that is drawn: shadows where the sun's direction puts them, light as bright as the sky's figures say; numbers stay the store's.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { before, test } from "node:test";
import { Daemon, inFolder, lambert, near, openPage, pixel, pixels, settled, toSrgb, violations } from "./page.mjs";

const RHO = 0.5, PARTS = 20;

/** Without a graphics card each point of the sun takes time by the pixel. */
const SMALL = { width: 900, height: 600 };

/** Of a point (east, north, up) the axes of a store, as solver/daylight/sky_tiles.h has them, and those of the picture. */
const AXES = {
    z: [([e, n, u]) => [e, n, u], ([e, n, u]) => [e, u, -n]], y: [([e, n, u]) => [e, u, -n], ([e, n, u]) => [e, u, -n]], x: [([e, n, u]) => [u, e, n], ([e, n, u]) => [-e, u, n]],
};

/** A floor of 10 m, and a plate of 2 m, 2 m above its middle, which faces up alone: light from above meets its front, from below its back. */
function plateAboveFloor(up) {
    const lines = ["mtllib plate.mtl"];
    let vertices = 0;
    const square = (x, y, z, size) => {
        for (const [u, v] of [[0, 0], [1, 0], [1, 1], [0, 1]]) lines.push(`v ${AXES[up][0]([x + u * size, y + v * size, z]).join(" ")}`);
        lines.push(`f ${[1, 2, 3, 4].map((k) => vertices + k).join(" ")}`);
        vertices += 4;
    };
    lines.push("g floor", "usemtl grey");
    for (let i = 0; i < PARTS; i++) for (let j = 0; j < PARTS; j++) square((10 * i) / PARTS, (10 * j) / PARTS, 0, 10 / PARTS);
    lines.push("g plate", "usemtl grey");
    square(4, 4, 2, 2);
    return `${lines.join("\n")}\n`;
}

/** Half the angle that the sun is wide. */
const SUN = 0.00465;

/** A plate from 3 to 7 m, 5 m above a floor of 10 m, each one element, z up. */
const HIGH = 5;
function highPlate() {
    const square = (low, high, z) => [[low, low], [high, low], [high, high], [low, high]].map(([x, y]) => `v ${x} ${y} ${z}\n`).join("");
    return `mtllib plate.mtl\n${square(0, 10, 0)}${square(3, 7, HIGH)}g floor\nusemtl grey\nf 1 2 3 4\ng plate\nusemtl grey\nf 5 6 7 8\n`;
}

/** The pane at normal incidence. */
const PASSES = 0.5;

let daemon;
before(async () => {
    writeFileSync(inFolder("plate.mtl"), `newmtl grey\nKd ${RHO} ${RHO} ${RHO}\n`);
    for (const up of Object.keys(AXES)) {
        writeFileSync(inFolder(`${up}.obj`), plateAboveFloor(up));
        lambert("precompute", inFolder(`${up}.obj`), "-o", inFolder(`${up}.h5`), "--quiet", "--probes", 0, "--rays", 256, "--sky", "tregenza", "--up", up);
    }
    writeFileSync(inFolder("high.obj"), highPlate());
    lambert("precompute", inFolder("high.obj"), "-o", inFolder("high.h5"), "--quiet", "--probes", 0, "--rays", 256, "--sky", "tregenza", "--up", "z");
    lambert("precompute", inFolder("z.obj"), "-o", inFolder("pane.h5"), "--quiet", "--probes", 0, "--rays", 256, "--sky", "tregenza", "--up", "z", "--mesh", "faces",
        "--glass", `plate=${PASSES}`);
    daemon = await Daemon.start([...Object.keys(AXES), "high", "pane"].map((name) => inFolder(`${name}.h5`)));
});

const LIGHT = { model: "given", direct: 700, diffuse: 100, factor: 1, latitude: 20, longitude: 0, zone: 0, day: 80 };
const EXPOSURE = -10;

/** The daemon's sky of this light: radiances of its tiles and of those of its sun, spread, apart; light on the ground by the sun; its direction. */
async function skyAt(name, hour) {
    const { latitude, longitude, zone, day, direct, diffuse } = LIGHT, place = { latitude, longitude, zone };
    const asked = { direct, diffuse, place, hour: 24 * (day - 1) + hour, sun_in_tiles: false, sun_spread: true };
    const { skies: [{ sky, sun, direct: horizontal }] } = await daemon.json(`/v1/scenes/${name}/skies`, { sky: asked });
    const [azimuth, altitude] = [sun.azimuth, sun.altitude].map((angle) => (angle * Math.PI) / 180), tiles = sky.map(() => 0);
    sun.tiles.forEach((t, k) => { tiles[t] = sun.radiance[k]; });
    return { sky, tiles, horizontal, direction: [Math.cos(altitude) * Math.sin(azimuth), Math.cos(altitude) * Math.cos(azimuth), Math.sin(altitude)] };
}

const set = (page, view, sky) => page.evaluate(([v, s]) => {
    const { store } = window.lambert, { now } = store;
    store.change({ ...now, view: { ...now.view, ...v }, lighting: { ...now.lighting, sky: { ...now.lighting.sky, ...s } } });
}, [view, sky]);

/** A weak graphics card: maps of a quarter of the texels, and none of single precision to draw into, which points of the sun besides its
 * middle are summed in. */
const weakCard = (page) => page.addInitScript(() => {
    const { prototype } = WebGL2RenderingContext, { getExtension, getParameter } = prototype;
    prototype.getExtension = function (name) { return name === "EXT_color_buffer_float" ? null : getExtension.call(this, name); };
    prototype.getParameter = function (name) { return name === this.MAX_TEXTURE_SIZE ? 2048 : getParameter.call(this, name); };
});

/** Where points (east, north, up) are seen, in shares of the picture. */
const seenAt = (page, up, points) => page.evaluate((all) => {
    const { camera } = window.lambert.scene.cameras;
    camera.updateMatrixWorld();
    return all.map((at) => camera.position.clone().set(...at).project(camera)).map((p) => [(p.x + 1) / 2, (1 - p.y) / 2]);
}, points.map(AXES[up][1]));

async function openFromAbove(up) {
    const page = await openPage(daemon.address, { ...SMALL, before: weakCard });
    await page.evaluate((name) => window.lambert.ask.open(name, null), up);
    await settled(page);
    await page.evaluate((place) => {
        const { cameras } = window.lambert.scene;
        cameras.place(place, false);
        cameras.advance(1);
    }, [[5, 4.9, 13], [5, 5, 0]].flatMap((AXES[up] ?? AXES.z)[1]));
    return page;
}

for (const [up, hours] of [["z", [9.5, 12, 15]], ["y", [15]], ["x", [15]]]) test(`the sun's shadow and light are where and as they must be, ${up} up`, async () => {
    const page = await openFromAbove(up);
    await set(page, { smooth: false, tone: "linear", exposure: EXPOSURE, sharpSun: true }, { ...LIGHT, sun: "spread" });
    for (const hour of hours) {
        await set(page, {}, { hour });
        await settled(page);
        const { sky, tiles, horizontal, direction: [east, north, height] } = await skyAt(up, hour);
        assert.ok(Math.abs(horizontal - 700 * height) < 1e-6 * horizontal);
        const ask = async (radiances, quantity) => (await daemon.json(`/v1/scenes/${up}/radiosity`, { emission: { sky: radiances }, quantity }))[quantity].flat();
        const [rest, further] = await Promise.all([ask(sky, "radiosity"), ask(tiles, "indirect")]);
        // The shadow of the plate's corners, 4 to 6, by similar triangles; points 5 cm to either side of its edges, and the plate itself.
        const [dx, dy] = [(-2 * east) / height, (-2 * north) / height], points = [];
        for (const t of [4.3, 5, 5.8])
            for (const side of [-0.05, 0.05]) points.push([4 + side + dx, t + dy, 0], [6 + side + dx, t + dy, 0], [t + dx, 4 + side + dy, 0], [t + dx, 6 + side + dy, 0]);
        let lit = 0, dark = 0;
        const isHidden = ([x, y]) => { const k = 11 / 13; return [x, y].every((v) => { const c = 5 + (v - 5) * k; return c > 3.95 && c < 6.05; }); };
        const open = points.filter((p) => !isHidden(p) && p.every((v) => v >= 0 && v < 10)), colours = await pixels(page, await seenAt(page, up, [...open, [5, 5, 2]]));
        for (const [k, [x, y]] of open.entries()) {
            const isDark = x > 4 + dx && x < 6 + dx && y > 4 + dy && y < 6 + dy, element = Math.floor((x * PARTS) / 10) * PARTS + Math.floor((y * PARTS) / 10);
            const B = rest[element] + further[element] + (isDark ? 0 : RHO * 700 * height);
            if (isDark) dark += 1;
            else lit += 1;
            near(colours[k], toSrgb([B, B, B].map((v) => v * 2 ** EXPOSURE)), 2);
        }
        const top = rest[PARTS * PARTS] + further[PARTS * PARTS] + RHO * 700 * height;
        near(colours.at(-1), toSrgb([top, top, top].map((v) => v * 2 ** EXPOSURE)), 2);
        console.log(`${hour} h: ${dark} points in the shadow, ${lit} beside it`);
        assert.ok(dark >= 3 && lit >= 3, `${dark} dark, ${lit} lit`);
    }
    // A weak card has nothing to add to that picture.
    await finished(page);
    assert.equal(await page.evaluate(() => window.lambert.scene.stage.uniforms.is_soft.value), false);
    assert.deepEqual(page.faults, []);
    await page.context().close();
});

const law = (c) => Math.min(1, 1.018 * c * (1 + (1 - c * c) ** 1.5));

/** The plate as a pane: the sun comes through it, dimmed by its angle, and the floor is seen through it. */
test("light passes panes, and so do looks", async () => {
    const page = await openFromAbove("pane");
    assert.deepEqual(await page.evaluate(() => window.lambert.scene.now.mesh.groups.map(({ name, glass }) => [name, glass?.transmittance ?? 0])),
        [["floor", 0], ["plate", PASSES], ["plate.back", PASSES]]);
    await set(page, { smooth: false, tone: "linear", exposure: EXPOSURE, sharpSun: true }, { ...LIGHT, sun: "spread", hour: 15 });
    await settled(page);
    const { sky, tiles, direction: [east, north, height] } = await skyAt("pane", 15);
    const ask = async (radiances, quantity) => (await daemon.json("/v1/scenes/pane/radiosity", { emission: { sky: radiances }, quantity }))[quantity].flat();
    const [rest, further] = await Promise.all([ask(sky, "radiosity"), ask(tiles, "indirect")]);
    const direct = RHO * 700 * height, [dx, dy] = [(-2 * east) / height, (-2 * north) / height];
    const floorAt = ([x, y]) => {
        const isBehind = x > 4 + dx && x < 6 + dx && y > 4 + dy && y < 6 + dy, i = Math.floor((x * PARTS) / 10) * PARTS + Math.floor((y * PARTS) / 10);
        return [rest[i] + further[i] + direct * (isBehind ? PASSES * law(height) : 1), isBehind];
    };
    // Beside the plate, in its shadow and out of it; and through it, whose own light comes on top.
    const places = [[3.2, 5.3], [3.7, 4.3], [6.7, 5.2], [8.2, 8.2], [5, 5], [4.4, 5.3]].map((at) => [...at, 0]);
    const colours = await pixels(page, await seenAt(page, "z", places)), plate = PARTS * PARTS, own = rest[plate] + further[plate] + direct;
    let behind = 0;
    for (const [k, at] of places.entries()) {
        const [B, isBehind] = floorAt(at), seen = toSrgb(Array(3).fill(B * 2 ** EXPOSURE)), glare = toSrgb(Array(3).fill(own * 2 ** EXPOSURE));
        behind += isBehind;
        near(colours[k], k < 4 ? seen : seen.map((v, c) => Math.min(255, glare[c] + v * PASSES ** (1 / 2.2))), 2);
    }
    assert.ok(behind >= 1 && behind < places.length, `${behind}`);
    // What a person picks, and the list of groups, say what passes.
    await page.evaluate((element) => {
        const { store } = window.lambert;
        store.change({ ...store.now, pins: [element] });
    }, plate);
    await page.getByRole("tab", { name: "Reading" }).click();
    await page.locator(".pin h2", { hasText: "pane, T = 0.5" }).waitFor();
    await page.locator('tr[data-group="plate.back"] small', { hasText: "pane, T = 0.5" }).waitFor();
    assert.deepEqual(page.faults, []);
    assert.deepEqual(await violations(page), []);
    await page.context().close();
});

/** Waits, however long it takes a machine, until pictures get no better. */
const finished = (page) => page.evaluate(async () => { while (!window.lambert.scene.stage.isFinished) await new Promise(requestAnimationFrame); });

/** Linear values of red at points given in shares of the picture, which is drawn as it is by now, or begun anew. */
const lightAt = (page, places, isNew) => page.evaluate(([all, anew]) => {
    const { stage } = window.lambert.scene, gl = stage.renderer.getContext(), [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight], bytes = new Uint8Array(4 * w * h);
    if (anew) {
        stage.sunlight.lose();
        stage.invalidate();
    }
    stage.draw();
    gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    return all.map(([x, y]) => bytes[4 * (Math.floor((1 - y) * h) * w + Math.floor(x * w))] / 255).map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
}, [places, isNew]);

/** Shadow of the high plate: its offset, and half the width of half-shadows across edges to the east (0) and to the north (1). A point of the
 * plate above m·x = 0 has its shadow of s + δ, δ across s and |δ| ≤ SUN, at −h (s + δ)·m / (s + δ)·up; the largest change of that is
 * (h / s·up) SUN |m − up (s·m) / (s·up)|. */
function shadowOf([east, north, up]) {
    return { offset: [(-HIGH * east) / up, (-HIGH * north) / up], half: [east, north].map((s) => ((HIGH * SUN) / up) * Math.hypot(1, s / up)) };
}

/** The share of a disc of radius 1 that is beyond a line at −x from its middle. */
const shareOfDisc = (x) => (Math.abs(x) >= 1 ? Number(x > 0) : 0.5 + (x * Math.sqrt(1 - x * x) + Math.asin(x)) / Math.PI);

async function openHigh(hour) {
    const page = await openPage(daemon.address, SMALL);
    await page.evaluate(() => window.lambert.ask.open("high", null));
    await set(page, { smooth: false, tone: "linear", exposure: -9, sharpSun: true }, { ...LIGHT, sun: "spread", hour });
    await settled(page);
    return { page, sun: (await skyAt("high", hour)).direction };
}

const look = (page, eye, target) => page.evaluate((place) => {
    const { cameras, stage } = window.lambert.scene;
    cameras.place(place, false);
    cameras.advance(1);
    stage.draw();
}, [eye, target].flatMap(AXES.z[1]));

test("a half-shadow is as wide as the sun's disc makes it", async () => {
    const { page, sun } = await openHigh(15), { offset, half } = shadowOf(sun), corner = [3 + offset[0], 3 + offset[1]];
    // From less than 2 m above, a pixel is some 2 mm; half-shadows of edges along both axes are in the picture, apart from each other's.
    await look(page, [corner[0] + 0.2, corner[1] + 0.19, 1.6], [corner[0] + 0.2, corner[1] + 0.2, 0]);
    const canvas = await page.evaluate(() => [window.lambert.scene.stage.canvas.width, window.lambert.scene.stage.canvas.height]), lines = [];
    for (const axis of [0, 1]) {
        const at = (t) => [...corner.map((v, k) => v + (k === axis ? t : 0.5)), 0], [a, b] = await seenAt(page, "z", [at(-0.1), at(0.1)]);
        const step = 0.2 / Math.hypot(...a.map((v, k) => (v - b[k]) * canvas[k])), n = Math.ceil((2 * half[axis]) / step);
        const t = Array.from({ length: 2 * n + 1 }, (_, k) => (k - n) * step);
        lines.push({ step, t, half: half[axis], places: await seenAt(page, "z", t.map(at)) });
    }
    // Of both lines from one picture: the page goes on with it while a test asks.
    const profiles = async (isNew) => (await lightAt(page, lines.flatMap(({ places }) => places), isNew)).reduce((all, v, k) => {
        all[k < lines[0].places.length ? 0 : 1].push(v);
        return all;
    }, [[], []]).map((light, axis) => {
        const { t, step } = lines[axis], shares = light.map((v) => (v - light.at(-1)) / (light[0] - light.at(-1)));
        const where = (level) => { const k = shares.findIndex((v) => v < level); return t[k - 1] + (step * (shares[k - 1] - level)) / (shares[k - 1] - shares[k]); };
        return { shares, middle: where(0.5), width: where(0.1) - where(0.9) };
    });
    // The first picture has the middle of the disc alone.
    const sharp = await profiles(true);
    await finished(page);
    const soft = await profiles(false);
    lines.forEach(({ step, t, half: radius }, axis) => {
        // From a tenth to nine tenths of the disc are 0.687 of its radius to either side.
        const { shares, width, middle } = soft[axis], wanted = 2 * 0.687 * radius, off = Math.max(...shares.map((v, k) => Math.abs(v - shareOfDisc((middle - t[k]) / radius))));
        console.log(`axis ${axis}: a pixel is ${(1e3 * step).toFixed(2)} mm; ${(1e3 * width).toFixed(1)} mm from .1 to .9, by the disc ${(1e3 * wanted).toFixed(1)} mm, `
            + `sharp ${(1e3 * sharp[axis].width).toFixed(1)} mm; the middle at ${(1e3 * middle).toFixed(1)} mm, sharp ${(1e3 * sharp[axis].middle).toFixed(1)} mm; shares are off by ${off.toFixed(3)}`);
        assert.ok(Math.abs(width - wanted) < 1.5 * step && Math.abs(middle - sharp[axis].middle) < step);
        // Places are lifted by 2.5 texels of the map, of 4 mm at most, before they are looked for in it; the sun is 43 degrees high.
        assert.ok(sharp[axis].width < 0.35 * wanted && Math.abs(sharp[axis].middle) < 0.011 + step);
        // 64 points come within 0.05 of a disc along any line.
        assert.ok(off < 0.05);
    });
    assert.deepEqual(page.faults, []);
    await page.context().close();
});

test("far from the edges of shadows the picture stays as it was, and one that is saved is the finished one", async () => {
    const { page, sun } = await openHigh(10), { offset, half } = shadowOf(sun);
    await look(page, [5, 4.9, 13], [5, 5, 0]);
    const changed = await page.evaluate(() => {
        const { stage, cameras: { camera } } = window.lambert.scene, gl = stage.renderer.getContext(), [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
        const read = () => { const bytes = new Uint8Array(4 * w * h); gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, bytes); return bytes; };
        stage.draw();
        const before = read();
        stage.drawFinished();
        const after = window.finished = read(), places = [];
        for (let i = 0; i < w * h; i++) {
            if (Math.max(...[0, 1, 2].map((c) => Math.abs(after[4 * i + c] - before[4 * i + c]))) <= 2) continue;
            // On the floor, in the axes of the store.
            const far = camera.position.clone().set((2 * ((i % w) + 0.5)) / w - 1, (2 * (Math.floor(i / w) + 0.5)) / h - 1, 0.5).unproject(camera).sub(camera.position);
            const on = camera.position.clone().addScaledVector(far, -camera.position.y / far.y);
            places.push([on.x, -on.z]);
        }
        return { places, pixel: (2 * camera.position.y * Math.tan((camera.fov * Math.PI) / 360)) / h };
    });
    // Texels of the map are below 4 mm; three are averaged.
    const near = Math.max(...half) + 0.012 + 1.5 * changed.pixel;
    const fromEdge = changed.places.map((p) => { const d = p.map((v, k) => Math.abs(v - 5 - offset[k]) - 2); return Math.max(...d) > 0 ? Math.hypot(...d.map((v) => Math.max(0, v))) : -Math.max(...d); });
    console.log(`${fromEdge.length} pixels changed, the farthest ${(1e3 * Math.max(...fromEdge)).toFixed(0)} mm from an edge of the shadow; ${(1e3 * near).toFixed(0)} mm may`);
    assert.ok(fromEdge.length > 500 && Math.max(...fromEdge) < near);
    // A picture of the same view that is saved before it stood still.
    await look(page, [5, 4.8, 13], [5, 5, 0]);
    await look(page, [5, 4.9, 13], [5, 5, 0]);
    await page.getByRole("tab", { name: "Export" }).click();
    await page.getByRole("button", { name: "Window" }).click();
    const [file] = await Promise.all([page.waitForEvent("download", { timeout: 0 }), page.getByRole("button", { name: "Save PNG" }).click()]);
    const different = await page.evaluate(async (base64) => {
        const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))])), { width: w, height: h } = bitmap, canvas = new OffscreenCanvas(w, h).getContext("2d");
        canvas.drawImage(bitmap, 0, 0);
        const saved = canvas.getImageData(0, 0, w, h).data, { finished } = window;
        let sum = saved.length === finished.length ? 0 : NaN;
        for (let y = 0; y < h; y++) for (let k = 0; k < 4 * w; k++) if (Math.abs(saved[4 * w * (h - 1 - y) + k] - finished[4 * w * y + k]) > 2) sum++;
        return sum;
    }, readFileSync(await file.path()).toString("base64"));
    assert.equal(different, 0);
    // The page goes on meanwhile; a picture that changes is not saved half of it before and half after.
    await page.getByLabel("Width in pixels").fill("2100");
    await page.getByRole("button", { name: "Save PNG" }).click();
    await page.getByText(/^Drawing, \d+ % …$/).waitFor();
    await set(page, { exposure: -8 }, {});
    await page.getByText("The picture was changed while it was drawn; save it again.").waitFor();
    await page.waitForFunction(() => window.lambert.scene.stage.uniforms.is_soft.value);
    // Textures of a scene are given back when another is opened.
    const textures = async () => {
        await page.evaluate(() => window.lambert.ask.open("high", window.lambert.store.now));
        await settled(page);
        return page.evaluate(() => {
            // Half-shadows take their textures one after the other, as far as the page has come.
            window.lambert.scene.stage.drawFinished();
            return window.lambert.scene.stage.renderer.info.memory.textures;
        });
    };
    assert.equal(await textures(), await textures());
    assert.deepEqual(page.faults, []);
    await page.context().close();
});

test("numbers, false colour and comparisons have the store's sun, and the page says which is shown", async () => {
    const page = await openFromAbove("z"), isDrawn = () => page.evaluate(() => window.lambert.scene.stage.uniforms.is_sunny.value);
    const bits = () => page.evaluate(() => [...window.lambert.scene.fields[0].bits].join());
    const note = page.getByText("sun drawn sharp, numbers have it in tiles");
    await set(page, { smooth: false, tone: "linear", exposure: EXPOSURE }, { ...LIGHT, hour: 15 });
    await settled(page);
    const [[x, y]] = await seenAt(page, "z", [[2, 2, 0]]), [before, plain] = [await bits(), await pixel(page, x, y)];
    await page.getByRole("tab", { name: "Sky" }).click();
    await page.getByLabel("Sharp sun (drawn)").check();
    await settled(page);
    await note.waitFor();
    assert.equal(await isDrawn(), true);
    assert.equal(await bits(), before);
    assert.deepEqual(await violations(page), []);
    for (const view of [{ picture: "false" }, { threshold: 50 }]) {
        await set(page, view, {});
        await settled(page);
        assert.equal(await isDrawn(), false);
        await note.waitFor({ state: "hidden" });
        await page.getByText("Not now: no sun shines, or the picture shows numbers").waitFor();
        await set(page, { picture: "light", threshold: null, exposure: EXPOSURE }, {});
        await settled(page);
        assert.equal(await isDrawn(), true);
    }
    // A link has it, too.
    await page.waitForTimeout(500);
    const other = await openPage(daemon.address, { hash: await page.evaluate(() => location.hash), before: weakCard });
    assert.equal(await other.evaluate(() => window.lambert.scene.stage.uniforms.is_sunny.value), true);
    await other.context().close();
    await set(page, {}, { sun: "off" });
    await settled(page);
    assert.equal(await isDrawn(), false);
    await set(page, {}, { sun: "spread" });
    await settled(page);
    await page.getByLabel("Sharp sun (drawn)").uncheck();
    await settled(page);
    assert.equal(await isDrawn(), false);
    near(await pixel(page, x, y), plain, 0);
    assert.deepEqual(page.faults, []);
    await page.context().close();
});
