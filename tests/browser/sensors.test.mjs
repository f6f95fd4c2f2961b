// Sensors on the page: figures, colours and numbers are those of the daemon, and follow the light; sets can be hidden.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { before, test } from "node:test";
import { change, Daemon, inFolder, lambert, near, openPage, pixels, settled, violations } from "./page.mjs";
import { sourceOf } from "./source.mjs";

const IES = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 4 1 1 2 .3 1.2 0\n1 1 30\n0 30 60 90\n0\n1000 850 450 0\n";
const LAMPS = { luminaires: [{ name: "row", file: "lamp.ies", from: [1.5, 1.5, 2.8], steps: [[3, 0, 0]], counts: [2] },
    { name: "desk", file: "lamp.ies", at: [3, 4.5, 2.8], dim: 0.5 }] };
// One of "wall" looks away from the eye above, and one of "lamp" stands in the opening of the desk's luminaire.
const SENSORS = { grids: [{ name: "plane", over: "floor", height: 0.85, spacing: 1, border: 0.5 }],
    points: [{ name: "wall", at: [[5, 5, 1.5], [5, 1, 1.5]], normal: [0, 0, -1] }, { name: "lamp", at: [[3, 4.5, 2.8], [1, 3, 1.2]], normal: [0, 0, 1] }],
    eyes: [{ name: "seat", at: [1, 2.5, 1.2], view: [1, 0, 0] }], cylinders: [{ name: "faces", at: [2, 5.5, 1.2] }],
    probes: [{ name: "hall", at: [5.5, 3, 1.5] }] };
const READ = ["wall", "lamp", "plane", "seat", "faces"];
const WEIGHTS = [0.2126, 0.7152, 0.0722];
/** From above, and the ends of a palette that no value reaches. */
const ABOVE = { camera: [3, 9, -2.6, 3, 0.85, -3], smooth: false, openings: false }, FALSE = { picture: "false", quantity: "irradiance", range: [0, 1000] };
/** Numbers are told with three digits. */
const told = (text, value) => assert.ok(Math.abs(Number(text.replaceAll(",", "").match(/[\d.]+/)[0]) - value) <= 0.0055 * value, `${text} must be ${value}`);

let daemon, palette;
before(async () => {
    palette = (await sourceOf("picture/palettes")).paletteBytes("viridis");
    writeFileSync(inFolder("lamp.ies"), IES);
    writeFileSync(inFolder("lamps.json"), JSON.stringify(LAMPS));
    writeFileSync(inFolder("sensors.json"), JSON.stringify(SENSORS));
    writeFileSync(inFolder("many.json"), JSON.stringify({ grids: [{ name: "dense", over: "floor", height: 0.85, spacing: 0.04 }] }));
    lambert("generate", "box", "--size", "6,6,3", "-o", inFolder("room.obj"));
    lambert("generate", "cornell", "--elements", 150, "-o", inFolder("cornell.obj"));
    writeFileSync(inFolder("colours.json"), JSON.stringify({ points: [{ name: "middle", at: [[0.2, 0.2, 0.4], [0.4, 0.1, 0.45]], normal: [0, 0, 1] }] }));
    const draft = ["--quiet", "--probes", 0, "--rays", 256];
    lambert("precompute", inFolder("room.obj"), "-o", inFolder("room.h5"), ...draft, "--elements", 400, "--luminaires", inFolder("lamps.json"), "--sensors", inFolder("sensors.json"));
    lambert("precompute", inFolder("room.h5"), "-o", inFolder("none.h5"), "--quiet", "--sensors", "none");
    lambert("precompute", inFolder("room.h5"), "-o", inFolder("many.h5"), "--quiet", "--quality", "draft", "--sensors", inFolder("many.json"));
    lambert("precompute", inFolder("cornell.obj"), "-o", inFolder("colours.h5"), ...draft, "--sensors", inFolder("colours.json"));
    daemon = await Daemon.start(["room", "none", "many", "colours"].map((name) => inFolder(`${name}.h5`)));
});

const openRoom = async (scene, state = {}, options = {}) => {
    const page = await openPage(daemon.address, { hash: "#1." + Buffer.from(JSON.stringify({ scene, ...state })).toString("base64url"), ...options });
    await settled(page);
    await page.getByRole("tab", { name: options.tab ?? "Sensors" }).click();
    await settled(page);
    return page;
};

const ask = (scene, emission, more) => daemon.json(`/v1/scenes/${scene}/radiosity`, { emission, quantity: "irradiance", ...more });
const dimmed = (dim) => ({ row: { on: true, dim, tint: [1, 1, 1], kelvin: null } });
const cells = (page, name) => page.locator(`[data-set="${name}"] td:visible`).allTextContents();
const isFine = async (page) => {
    assert.deepEqual(page.faults, []);
    assert.equal(await page.evaluate(() => window.lambert.tell.problem), null);
};

/** Where a point of the store (z up) is in the picture, in shares of its size, and in the window. */
const placeOf = (page, at) => page.evaluate(([x, y, z]) => {
    const { camera } = window.lambert.scene.cameras, box = document.querySelector("main canvas").getBoundingClientRect();
    camera.updateMatrixWorld();
    const p = camera.position.clone().set(x, z, -y).project(camera), share = [(p.x + 1) / 2, (1 - p.y) / 2];
    return { share, window: [box.left + share[0] * box.width, box.top + share[1] * box.height] };
}, at);

/** The colours in the middle of places. */
const coloursAt = async (page, places) => pixels(page, (await Promise.all(places.map((at) => placeOf(page, at)))).map(({ share }) => share));
const colourOf = (value, [low, high]) => {
    const i = Math.round(255 * Math.min(1, Math.max(0, (value - low) / (high - low))));
    return [...palette.subarray(4 * i, 4 * i + 3)];
};

async function areFigures(page, emission, required) {
    const { sensors } = await ask("room", emission, { reduce: { sensors: READ, with: ["mean", "min", "uniformity", "share"], at_least: [required] } });
    for (const name of READ) {
        const [mean, min, uniformity, share] = await cells(page, name), of = sensors[name];
        told(mean, of.mean);
        told(min, of.min);
        assert.equal(uniformity, of.uniformity.toFixed(2), name);
        assert.ok(Math.abs(Number(share.replace(" %", "")) - 100 * of.share[required]) <= 0.5, `${name}: ${share} must be ${of.share[required]}`);
    }
}

test("figures of sets are those of the daemon, and follow the light, one request at a time", async () => {
    const page = await openRoom("room");
    assert.equal((await cells(page, "plane")).length, 3);
    const level = page.getByLabel("Required irradiance");
    await level.fill("150");
    await level.press("Enter");
    await areFigures(page, { luminaires: { row: 1, desk: 0.5 } }, 150);
    assert.equal(await page.locator("th:visible", { hasText: "≥ 150" }).count(), 1);
    assert.match(await page.locator('[data-set="lamp"] small').textContent(), /^2 sensors, 1 without a value$/);
    assert.match(await page.locator('[data-set="hall"] small').textContent(), /^1 probe$/);
    assert.deepEqual(await cells(page, "hall"), ["–", "–", "–", "–"]);
    // Of answers on their way the newest alone is shown.
    let onTheirWay = 0, most = 0, asked = 0;
    const isOne = (request) => request.method() === "POST" && request.postData()?.includes('"sensors"');
    page.on("request", (request) => { if (isOne(request)) { asked += 1; most = Math.max(most, ++onTheirWay); } });
    for (const event of ["requestfinished", "requestfailed"]) page.on(event, (request) => { if (isOne(request)) onTheirWay -= 1; });
    await page.evaluate(async (dims) => {
        const { store: s } = window.lambert;
        for (const row of dims) {
            s.change({ ...s.now, lighting: { ...s.now.lighting, luminaires: row } });
            await new Promise(requestAnimationFrame);
        }
    }, Array.from({ length: 12 }, (_, k) => dimmed(1 - 0.05 * k)));
    await settled(page);
    assert.ok(asked >= 1 && asked <= 12 && most === 1, `${asked} requests, ${most} at once`);
    await areFigures(page, { luminaires: { row: 1 - 0.05 * 11, desk: 0.5 } }, 150);
    await change(page, "lighting", { dim: 0 });
    assert.deepEqual((await cells(page, "plane")).slice(0, 2), ["0", "0"]);
    await level.fill("");
    await level.press("Enter");
    assert.equal((await cells(page, "plane")).length, 3);
    await isFine(page);
    await page.context().close();
});

test("figures of three channels are of their luminance", async () => {
    const page = await openRoom("colours");
    const emission = await page.evaluate(() => { const { emission, scale } = window.lambert.ask.wanted(); return { emission, scale }; });
    const { irradiance } = await ask("colours", emission.emission, { select: { sensors: ["middle"] } });
    const values = [0, 1].map((k) => emission.scale * irradiance.reduce((sum, row, c) => sum + WEIGHTS[c] * row[k], 0));
    assert.ok(irradiance.length === 3 && values.every((v) => v > 0));
    const [mean, min] = await cells(page, "middle");
    told(mean, (values[0] + values[1]) / 2);
    told(min, Math.min(...values));
    assert.equal(await page.locator("thead small:visible").textContent(), "W/m²");
    await isFine(page);
    await page.context().close();
});

test("discs have the colours of their values in false colour of irradiance, and one colour elsewhere", async () => {
    // Others would stand before some of the plane.
    const hiddenSets = ["lamp", "seat", "faces", "hall"], page = await openRoom("room", { view: { ...ABOVE, ...FALSE, hiddenSets } }), { sets } = await daemon.json("/v1/scenes/room/sensors");
    const at = sets.find(({ name }) => name === "plane").at, isColoured = async (row) => {
        const { irradiance } = await ask("room", { luminaires: { row, desk: 0.5 } }, { select: { sensors: ["plane"] } });
        (await coloursAt(page, at)).forEach((colour, k) => near(colour, colourOf(irradiance[k], FALSE.range), 3));
        return irradiance;
    };
    const bright = await isColoured(1);
    await change(page, "lighting", { luminaires: dimmed(4) });
    assert.ok((await isColoured(4)).every((v, k) => v > bright[k]));
    // The range and the palette are those of the picture.
    await change(page, "view", { range: [100, 300], log: true });
    const value = (await ask("room", { luminaires: { row: 4, desk: 0.5 } }, { select: { sensors: ["wall"] } })).irradiance[0];
    await change(page, "view", { range: [value / 2, value * 2] });
    // In the middle of a logarithmic palette; the disc is seen from behind, and dark with its colour around.
    const [behind] = await coloursAt(page, [[5, 5, 1.5]]);
    near(behind, [20, 20, 20], 3);
    const ring = await page.evaluate((place) => {
        const { stage } = window.lambert.scene, gl = stage.renderer.getContext(), bytes = new Uint8Array(4 * 441);
        stage.draw();
        gl.readPixels(Math.floor(place[0] * gl.drawingBufferWidth) - 10, Math.floor((1 - place[1]) * gl.drawingBufferHeight) - 10, 21, 21, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
        return Array.from({ length: 441 }, (_, k) => [...bytes.subarray(4 * k, 4 * k + 3)]);
    }, (await placeOf(page, [5, 5, 1.5])).share);
    const wanted = colourOf(0.5, [0, 1]).map((v) => 0.75 * v + 0.25 * 20.4);
    assert.ok(ring.some((colour) => colour.every((v, c) => Math.abs(v - wanted[c]) <= 4)), `no ${wanted} around it`);
    // What has no value is grey in each of them, and the light of the eye and radiosity leave all others alike.
    for (const view of [{}, { quantity: "radiosity" }, { picture: "light" }]) {
        await change(page, "view", { ...view, hiddenSets: [] });
        near((await coloursAt(page, [[3, 4.5, 2.8]]))[0], [158, 158, 158], 3);
        await change(page, "view", { hiddenSets });
        if (Object.keys(view).length > 0) for (const colour of await coloursAt(page, at)) near(colour, [237, 237, 237], 3);
    }
    await page.getByText("Sensors have colours where the picture shows irradiance").waitFor();
    await page.getByRole("button", { name: "False colour of irradiance" }).click();
    await change(page, "view", { range: FALSE.range, log: false });
    await isColoured(4);
    await isFine(page);
    await page.context().close();
});

test("sets can be hidden, one by one and together, and a link has it", async () => {
    const page = await openRoom("room", { view: ABOVE }), { sets } = await daemon.json("/v1/scenes/room/sensors");
    const places = [[5, 5, 1.5], sets.find(({ name }) => name === "plane").at[0]], first = await coloursAt(page, places);
    near(first[1], [237, 237, 237], 3);
    await page.getByRole("checkbox", { name: "plane" }).uncheck();
    await settled(page);
    const second = await coloursAt(page, places);
    near(second[0], first[0], 1);
    assert.ok(Math.abs(second[1][0] - 237) > 20, String(second[1]));
    await page.getByRole("button", { name: "Hide all" }).click();
    await page.waitForTimeout(600);
    const other = await openPage(daemon.address, { hash: await page.evaluate(() => location.hash) });
    await settled(other);
    for (const one of [page, other]) assert.ok((await coloursAt(one, [places[0]]))[0][0] > 40, "a set that is hidden is drawn");
    await page.getByRole("button", { name: "Show all" }).click();
    near((await coloursAt(page, places))[1], first[1], 1);
    await page.getByRole("checkbox", { name: "Draw sensors" }).uncheck();
    near((await coloursAt(page, places))[1], second[1], 1);
    // Figures are of all sets, drawn or not.
    await change(page, "lighting", { luminaires: dimmed(0.25) });
    told((await cells(page, "plane"))[0], (await ask("room", { luminaires: { row: 0.25, desk: 0.5 } }, { reduce: { sensors: ["plane"], with: ["mean"] } })).sensors.plane.mean);
    for (const one of [page, other]) {
        await isFine(one);
        await one.context().close();
    }
});

test("a click or the keys mark a sensor, and tell its set, number, place and value", async () => {
    const page = await openRoom("room", { view: ABOVE }, { tab: "Reading" });
    const { sets } = await daemon.json("/v1/scenes/room/sensors"), { at } = sets.find(({ name }) => name === "plane");
    const { irradiance } = await ask("room", { luminaires: { row: 1, desk: 0.5 } }, { select: { sensors: ["plane"] } });
    const place = (await placeOf(page, at[7])).window;
    await page.mouse.move(...place);
    await page.locator(".tip", { hasText: /^plane, sensor 7: [\d.]+ lx · [\d.]+ lm\/m² · floor/ }).waitFor();
    await page.mouse.click(...place);
    const card = page.locator('[data-figure="sensor"]:visible'), text = () => card.textContent();
    await card.waitFor();
    assert.match(await text(), /^plane, sensor 7×Irradiance H[\d.]+ lxPlace[\d., ]+ mFaces0, 0, 1Of the grid/);
    told((await text()).split("Irradiance H")[1], irradiance[7]);
    assert.deepEqual((await text()).match(/Place([\d., ]+) m/)[1].split(", ").map(Number), at[7]);
    assert.deepEqual(await page.evaluate(() => [window.lambert.store.now.pins, window.lambert.store.now.sensor]), [[], { set: "plane", index: 7 }]);
    await page.waitForTimeout(600);
    const other = await openPage(daemon.address, { hash: await page.evaluate(() => location.hash) });
    assert.deepEqual(await other.evaluate(() => window.lambert.store.now.sensor), { set: "plane", index: 7 });
    await change(page, "lighting", { luminaires: dimmed(0.5) });
    told((await text()).split("Irradiance H")[1], (await ask("room", { luminaires: { row: 0.5, desk: 0.5 } }, { select: { sensors: ["plane"] } })).irradiance[7]);
    await page.mouse.click(...place);
    await card.waitFor({ state: "hidden" });
    assert.equal(await card.count(), 0);
    // The cross begins in the middle of the picture; one without a value says why.
    await page.evaluate(() => window.lambert.scene.cameras.place([3, 8, -4, 3, 2.8, -4.5], false));
    await settled(page);
    await page.locator("main canvas").first().focus();
    await page.keyboard.press("r");
    await page.waitForFunction(() => /^lamp, sensor 0: no value: in a luminaire/.test(document.querySelector(".unseen[role=status]").textContent));
    await page.keyboard.press("Enter");
    assert.match(await text(), /^lamp, sensor 0×Irradiance Hno value: in a luminaire/);
    await page.keyboard.press("Escape");
    assert.deepEqual(await violations(page), []);
    for (const one of [page, other]) {
        await isFine(one);
        await one.context().close();
    }
});

test("a store without sensors has no panel of them, and links to them do no harm", async () => {
    const page = await openPage(daemon.address, { hash: "#1." + Buffer.from(JSON.stringify({ scene: "none", sensor: { set: "plane", index: 3 },
        view: { hiddenSets: ["plane", 7], required: "much" } })).toString("base64url") });
    await settled(page);
    assert.equal(await page.getByRole("tab", { name: "Sensors" }).isVisible(), false);
    assert.deepEqual(await page.evaluate(() => { const { scene, store: { now } } = window.lambert; return [scene.now.sensors, now.sensor, now.view.hiddenSets, now.view.required]; }), [null, null, ["plane"], null]);
    await page.getByRole("combobox", { name: "Scene" }).selectOption("room");
    await settled(page);
    await page.getByRole("tab", { name: "Sensors" }).click();
    assert.equal(await page.locator("[data-set]:visible").count(), 6);
    assert.deepEqual(await violations(page), []);
    await isFine(page);
    await page.context().close();
});

test("where the daemon refuses sensors the panel has its line, and all else goes on", async () => {
    const line = "select: sensors of such a store have no values", isOne = (request) => request.method() === "POST" && request.postData()?.includes('"sensors"');
    let isRefusing = true;
    const page = await openRoom("room", {}, { before: (one) => one.route("**/radiosity", (route) => (isRefusing && isOne(route.request())
        ? route.fulfill({ status: 422, contentType: "application/problem+json", body: JSON.stringify({ detail: line }) }) : route.continue())) });
    await page.getByText(line).waitFor();
    assert.deepEqual(await cells(page, "plane"), ["–", "–", "–"]);
    assert.equal(await page.evaluate(() => window.lambert.scene.answers > 0 && !document.querySelector(".banner:not([hidden])")), true);
    isRefusing = false;
    await change(page, "lighting", { luminaires: dimmed(0.5) });
    assert.equal(await page.getByText(line).count(), 0);
    told((await cells(page, "plane"))[0], (await ask("room", { luminaires: { row: 0.5, desk: 0.5 } }, { reduce: { sensors: ["plane"], with: ["mean"] } })).sensors.plane.mean);
    await isFine(page);
    await page.context().close();
});

test("thousands of sensors are one object, and a phone has the panel as wide as itself", async () => {
    const page = await openRoom("many", { view: { required: 12345.6 } }, { width: 360, height: 740, touch: true });
    const { drawn, places } = await page.evaluate(() => {
        const { stage, now } = window.lambert.scene, { marks, sensors } = now;
        stage.draw();
        const { calls } = stage.renderer.info.render;
        marks.mesh.visible = false;
        stage.draw();
        return { drawn: calls - stage.renderer.info.render.calls, places: sensors.places };
    });
    assert.ok(places > 20_000 && drawn === 1, `${places} sensors, ${drawn} objects`);
    const wide = await page.evaluate(() => [document.documentElement.scrollWidth,
        ...[...document.querySelectorAll("[role=tabpanel]:not([hidden]), header, footer, .wide")].map((e) => e.scrollWidth - e.clientWidth)]);
    assert.ok(wide[0] <= 360 && wide.slice(1).every((w) => w <= 0), String(wide));
    await isFine(page);
    await page.context().close();
});

test("CSV of sensors has the daemon's numbers, and an empty cell where there is none", async () => {
    const page = await openRoom("room", {}, { tab: "Export" });
    const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "Save sensors as CSV" }).click()]);
    const lines = readFileSync(await download.path(), "utf8").trim().split("\r\n").map((line) => line.split(","));
    assert.equal(download.suggestedFilename(), "room-sensors.csv");
    assert.deepEqual(lines[0], ["sensors", "x [m]", "y [m]", "z [m]", "nx", "ny", "nz", "irradiance (lx)"]);
    const { sets } = await daemon.json("/v1/scenes/room/sensors"), read = sets.filter(({ kind }) => kind !== "probes");
    const { irradiance } = await ask("room", { luminaires: { row: 1, desk: 0.5 } }, { select: { sensors: read.map(({ name }) => name) } });
    const places = read.flatMap(({ name, at }) => at.map((place) => [name, ...place.map(String)]));
    assert.deepEqual(lines.slice(1).map((line) => line.slice(0, 4)), places);
    lines.slice(1).forEach((line, k) => assert.equal(line[7] === "" ? null : Math.fround(Number(line[7])), irradiance[k] === null ? null : Math.fround(irradiance[k])));
    assert.ok(irradiance.includes(null));
    await isFine(page);
    await page.context().close();
});
