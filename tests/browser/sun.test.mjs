// The sun that is drawn: shadows where the sun's direction puts them, light as bright as the sky's figures say; numbers stay the store's.
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { before, test } from "node:test";
import { Daemon, inFolder, lambert, near, openPage, pixel, settled, sourceOf, toSrgb, violations } from "./page.mjs";

const RHO = 0.5, PARTS = 20;

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

let daemon, daylight, state;
before(async () => {
    daylight = { ...await sourceOf("daylight/source"), ...await sourceOf("daylight/sun") };
    state = await sourceOf("state/state");
    writeFileSync(inFolder("plate.mtl"), `newmtl grey\nKd ${RHO} ${RHO} ${RHO}\n`);
    for (const up of Object.keys(AXES)) {
        writeFileSync(inFolder(`${up}.obj`), plateAboveFloor(up));
        lambert("precompute", inFolder(`${up}.obj`), "-o", inFolder(`${up}.h5`), "--quiet", "--probes", 0, "--rays", 256, "--sky", "tregenza", "--up", up);
    }
    daemon = await Daemon.start(Object.keys(AXES).map((up) => inFolder(`${up}.h5`)));
});

const LIGHT = { model: "given", direct: 700, diffuse: 100, factor: 1, latitude: 20, longitude: 0, zone: 0, day: 80 };
const EXPOSURE = -10;

const set = (page, view, sky) => page.evaluate(([v, s]) => {
    const { store } = window.lambert, { now } = store;
    store.change({ ...now, view: { ...now.view, ...v }, lighting: { ...now.lighting, sky: { ...now.lighting.sky, ...s } } });
}, [view, sky]);

/** Where points (east, north, up) are seen, in shares of the picture. */
const seenAt = (page, up, points) => page.evaluate((all) => {
    const { camera } = window.lambert.cameras;
    camera.updateMatrixWorld();
    return all.map((at) => camera.position.clone().set(...at).project(camera)).map((p) => [(p.x + 1) / 2, (1 - p.y) / 2]);
}, points.map(AXES[up][1]));

async function openFromAbove(up) {
    const page = await openPage(daemon.address);
    await page.evaluate((name) => window.lambert.open(name, null), up);
    await settled(page);
    await page.evaluate((place) => {
        const { cameras } = window.lambert;
        cameras.place(place, false);
        cameras.advance(1);
    }, [[5, 4.9, 13], [5, 5, 0]].flatMap(AXES[up][1]));
    return page;
}

for (const [up, hours] of [["z", [9.5, 12, 15]], ["y", [15]], ["x", [15]]]) test(`the sun's shadow and light are where and as they must be, ${up} up`, async () => {
    const page = await openFromAbove(up), source = new daylight.SkySource();
    source.take(await daemon.json(`/v1/scenes/${up}/sky`));
    await set(page, { smooth: false, tone: "linear", exposure: EXPOSURE, sharpSun: true }, { ...LIGHT, sun: "spread" });
    for (const hour of hours) {
        await set(page, {}, { hour });
        await settled(page);
        const { sun, directHorizontal } = source.sky({ ...state.skyOff, ...LIGHT, sun: "spread", hour }, false), [east, north, height] = sun.direction;
        assert.ok(Math.abs(directHorizontal - 700 * height) < 1e-6 * directHorizontal);
        const { sky, sun: tiles } = source.parts({ ...state.skyOff, ...LIGHT, sun: "spread", hour }, false, 1);
        const ask = async (radiances, quantity) => (await daemon.json(`/v1/scenes/${up}/radiosity`, { emission: { sky: radiances }, quantity }))[quantity].flat();
        const [rest, further] = await Promise.all([ask([...sky], "radiosity"), ask([...tiles], "indirect")]);
        // The shadow of the plate's corners, 4 to 6, by similar triangles; points 5 cm to either side of its edges, and the plate itself.
        const [dx, dy] = [(-2 * east) / height, (-2 * north) / height], points = [];
        for (const t of [4.3, 5, 5.8])
            for (const side of [-0.05, 0.05]) points.push([4 + side + dx, t + dy, 0], [6 + side + dx, t + dy, 0], [t + dx, 4 + side + dy, 0], [t + dx, 6 + side + dy, 0]);
        let lit = 0, dark = 0;
        const isHidden = ([x, y]) => { const k = 11 / 13; return [x, y].every((v) => { const c = 5 + (v - 5) * k; return c > 3.95 && c < 6.05; }); };
        const open = points.filter((p) => !isHidden(p) && p.every((v) => v >= 0 && v < 10)), places = await seenAt(page, up, [...open, [5, 5, 2]]);
        for (const [k, [x, y]] of open.entries()) {
            const isDark = x > 4 + dx && x < 6 + dx && y > 4 + dy && y < 6 + dy, element = Math.floor((x * PARTS) / 10) * PARTS + Math.floor((y * PARTS) / 10);
            const B = rest[element] + further[element] + (isDark ? 0 : RHO * 700 * height);
            if (isDark) dark += 1;
            else lit += 1;
            near(await pixel(page, ...places[k]), toSrgb([B, B, B].map((v) => v * 2 ** EXPOSURE)), 2);
        }
        const top = rest[PARTS * PARTS] + further[PARTS * PARTS] + RHO * 700 * height;
        near(await pixel(page, ...places.at(-1)), toSrgb([top, top, top].map((v) => v * 2 ** EXPOSURE)), 2);
        console.log(`${hour} h: ${dark} points in the shadow, ${lit} beside it`);
        assert.ok(dark >= 3 && lit >= 3, `${dark} dark, ${lit} lit`);
    }
    assert.deepEqual(page.faults, []);
    await page.context().close();
});

test("numbers, false colour and comparisons have the store's sun, and the page says which is shown", async () => {
    const page = await openFromAbove("z"), isDrawn = () => page.evaluate(() => window.lambert.stage.uniforms.is_sunny.value);
    const bits = () => page.evaluate(() => [...window.lambert.fields[0].bits].join());
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
    const other = await openPage(daemon.address, { hash: await page.evaluate(() => location.hash) });
    assert.equal(await other.evaluate(() => window.lambert.stage.uniforms.is_sunny.value), true);
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
