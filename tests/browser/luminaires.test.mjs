// Luminaires on the page: dimmers, tints, groups and shares agree with what the daemon answers; openings are drawn where they are.
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { before, test } from "node:test";
import { change, Daemon, elementAt, inFolder, lambert, near, openPage, pixel, settled, toSrgb, violations } from "./page.mjs";

const IES = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 4 1 1 2 .3 1.2 0\n1 1 30\n0 30 60 90\n0\n1000 850 450 0\n";
// Three luminaires, two of them a row, in a room of 6 by 6 by 3 m.
const ROW = { name: "row", file: "room.ies", from: [1.5, 1.5, 2.8], steps: [[3, 0, 0]], counts: [2] };
const DESK = { name: "desk", file: "room.ies", at: [3, 4.5, 2.8], dim: 0.5, cct: 2700 };
const MTL = "newmtl box\nKd .6 .5 .4\n";
const WEIGHTS = [0.2126, 0.7152, 0.0722];
const luminance = (c) => c.reduce((sum, v, i) => sum + v * WEIGHTS[i], 0);
const close = (a, b, relative, what) => assert.ok(Math.abs(a - b) <= relative * Math.abs(b), `${what}: ${a} must be ${b}`);
/** Numbers are told with three digits. */
const told = (text, value) => close(Number(text.replaceAll(",", "").match(/[\d.]+/)[0]), value, 0.0055, text);

let daemon;
before(async () => {
    writeFileSync(inFolder("room.ies"), IES);
    lambert("generate", "box", "--size", "6,6,3", "-o", inFolder("room.obj"));
    const many = { luminaires: [{ ...ROW, from: [0.5, 0.5, 2.8], steps: [[0.1, 0, 0]], counts: [50] }, ...Array.from({ length: 10 }, (_, k) => ({ ...DESK, name: `desk-${k}`, at: [3, 0.5 * (k + 1), 2.5] }))] };
    for (const [name, list] of [["room", { luminaires: [ROW, DESK] }], ["moved", { luminaires: [ROW, { ...DESK, at: [3, 4, 2.8] }] }], ["renamed", { luminaires: [ROW, { ...DESK, name: "table" }] }], ["many", many]])
        writeFileSync(inFolder(`${name}.json`), JSON.stringify(list));
    writeFileSync(inFolder("colours.mtl"), MTL);
    writeFileSync(inFolder("colours.obj"), colouredBox());
    const make = (name, scene, list, ...more) => lambert("precompute", inFolder(scene), "-o", inFolder(`${name}.h5`), "--quiet", "--luminaires", inFolder(`${list}.json`), ...more);
    const draft = ["--probes", 0, "--rays", 256];
    make("room", "colours.obj", "room", ...draft, "--elements", 700, "--sky", "grid:4x3");
    make("grey", "room.obj", "room", ...draft, "--elements", 400);
    make("moved", "grey.h5", "moved");
    make("renamed", "grey.h5", "renamed");
    lambert("precompute", inFolder("grey.h5"), "-o", inFolder("none.h5"), "--quiet", "--luminaires", "none");
    make("many", "room.obj", "many", ...draft, "--elements", 100);
    daemon = await Daemon.start(["room", "grey", "moved", "renamed", "none", "many"].map((name) => inFolder(`${name}.h5`)));
});

/** The same room by hand, without a ceiling, of three channels. */
function colouredBox() {
    const corners = [[0, 0, 0], [6, 0, 0], [6, 6, 0], [0, 6, 0], [0, 0, 3], [6, 0, 3], [6, 6, 3], [0, 6, 3]].map((v) => `v ${v.join(" ")}`);
    const faces = [["floor", "1 2 3 4"], ["south", "1 5 6 2"], ["north", "4 3 7 8"], ["west", "1 4 8 5"], ["east", "2 6 7 3"]];
    return ["mtllib colours.mtl", ...corners, "usemtl box", ...faces.map(([name, f]) => `o ${name}\nf ${f}`)].join("\n") + "\n";
}

const openRoom = async (scene, state = {}, options = {}) => {
    const page = await openPage(daemon.address, { hash: "#1." + Buffer.from(JSON.stringify({ scene, ...state })).toString("base64url"), ...options });
    await settled(page);
    await page.getByRole("tab", { name: "Lights" }).click();
    return page;
};

const ask = async (scene, luminaires, more = {}) =>
    (await daemon.json(`/v1/scenes/${scene}/radiosity`, { emission: { luminaires }, ...more }))[more.quantity ?? "radiosity"];

const rowNamed = (page, name) => page.locator(`[data-luminaire="${name}"]`);
const field = (page, name, label = "Dimmer in ×") => rowNamed(page, name).getByLabel(label, { exact: true }).first();
const setNumber = async (page, name, value, label) => {
    const box = field(page, name, label);
    await box.fill(String(value));
    await box.press("Enter");
    await settled(page);
};
const lumens = (page, name) => rowNamed(page, name).locator(".lumens").first().textContent();
const isFine = async (page) => {
    assert.deepEqual(page.faults, []);
    assert.equal(await page.evaluate(() => window.lambert.tell.problem), null);
};

/** The luminances of the picture, element by element, are these of a request; halves have 11 bits, and answers of single precision 24. */
async function isShown(page, scene, luminaires, quantity = "radiosity") {
    const shown = await page.evaluate(() => [...window.lambert.scene.fields[0].values]), answer = await ask(scene, luminaires, { quantity });
    const values = Array.isArray(answer[0]) ? answer[0].map((_, i) => luminance(answer.map((row) => row[i]))) : answer;
    assert.equal(shown.length, values.length);
    values.forEach((v, i) => close(shown[i], v, 2 ** -10, `element ${i}`));
}

test("luminaires shine as their list says, and a dimmer changes the picture and the figures", async () => {
    const page = await openRoom("grey");
    await isShown(page, "grey", { row: 1, desk: 0.5 });
    assert.equal(await field(page, "desk").inputValue(), "0.5");
    const { luminaires: [one,, desk], lumens: sum } = await daemon.json("/v1/scenes/grey/luminaires");
    told(await lumens(page, "desk"), desk.lumens / 2);
    told(await lumens(page, "row"), 2 * one.lumens);
    told(await page.locator('[data-figure="lumens"]').textContent().then((text) => text.split("together")[1]), sum - desk.lumens / 2);
    await change(page, "view", { smooth: false, tone: "linear", exposure: -6, openings: false });
    const element = await elementAt(page, 0.5, 0.75), first = await pixel(page, 0.5, 0.75);
    const grey = async (luminaires) => toSrgb(new Array(3).fill((await ask("grey", luminaires, { select: { elements: [element] } }))[0] * 2 ** -6));
    near(first, await grey({ row: 1, desk: 0.5 }), 2);
    const slider = await field(page, "row", "Dimmer").boundingBox();
    await page.mouse.move(slider.x + slider.width - 8, slider.y + slider.height / 2);
    await page.mouse.down();
    for (let step = 1; step <= 10; step++) await page.mouse.move(slider.x + slider.width * (1 - step / 15), slider.y + slider.height / 2);
    await page.mouse.up();
    await settled(page);
    const { dim } = await page.evaluate(() => window.lambert.store.now.lighting.luminaires.row);
    assert.ok(dim > 0.1 && dim < 0.6, `dim is ${dim}`);
    await isShown(page, "grey", { row: dim, desk: 0.5 });
    near(await pixel(page, 0.5, 0.75), await grey({ row: dim, desk: 0.5 }), 2);
    told(await lumens(page, "row"), 2 * dim * one.lumens);
    assert.ok((await pixel(page, 0.5, 0.75))[0] < first[0]);
    // One drag is one step of undo. Beyond 1 the number goes, and All dims luminaires as well.
    await page.keyboard.press("Control+z");
    await settled(page);
    await isShown(page, "grey", { row: 1, desk: 0.5 });
    await setNumber(page, "desk", 2.5);
    await change(page, "lighting", { dim: 0.5 });
    await isShown(page, "grey", { row: 0.5, desk: 1.25 });
    told(await lumens(page, "desk"), 1.25 * desk.lumens);
    await page.getByRole("button", { name: "As the scene comes" }).click();
    await settled(page);
    await isShown(page, "grey", { row: 1, desk: 0.5 });
    await isFine(page);
    await page.context().close();
});

test("a group opens to its luminaires, each dimmed by itself, and is dimmed together again", async () => {
    const page = await openRoom("grey");
    await page.getByText("2 luminaires", { exact: true }).click();
    await setNumber(page, "row.1", 0.25);
    await isShown(page, "grey", { "row.0": 1, "row.1": 0.25, desk: 0.5 });
    assert.deepEqual([await field(page, "row").inputValue(), await field(page, "row").getAttribute("placeholder")], ["", "several"]);
    await rowNamed(page, "row.0").getByRole("checkbox").uncheck();
    await settled(page);
    await isShown(page, "grey", { "row.1": 0.25, desk: 0.5 });
    assert.equal(await rowNamed(page, "row").getByRole("checkbox").first().evaluate((box) => box.indeterminate), true);
    await setNumber(page, "row", 0.75);
    assert.deepEqual([await field(page, "row.0").inputValue(), await field(page, "row.1").inputValue()], ["0.75", "0.75"]);
    await rowNamed(page, "row.0").getByRole("checkbox").check();
    await settled(page);
    assert.deepEqual(await page.evaluate(() => window.lambert.ask.wanted().emission.luminaires && Object.keys(window.lambert.ask.wanted().emission.luminaires)), ["row", "desk"]);
    await isShown(page, "grey", { row: 0.75, desk: 0.5 });
    await page.getByRole("button", { name: "All off" }).click();
    await settled(page);
    assert.equal(await page.evaluate(() => Math.max(...window.lambert.scene.fields[0].values)), 0);
    await isFine(page);
    await page.context().close();
});

test("solo leaves one luminaire, a group or a lamp alone, and the sky dark", async () => {
    const page = await openRoom("room");
    await change(page, "lighting", { sky: await page.evaluate(() => ({ ...window.lambert.store.now.lighting.sky, model: "even" })) });
    await page.getByRole("button", { name: "Solo desk" }).click();
    await settled(page);
    await isShown(page, "room", { desk: 0.5 });
    assert.match(await rowNamed(page, "row").getAttribute("class"), /dark/);
    assert.equal(await lumens(page, "row"), "0 lm");
    await page.getByText("2 luminaires", { exact: true }).click();
    await page.getByRole("button", { name: "Solo row.1" }).click();
    await settled(page);
    await isShown(page, "room", { "row.1": 1 });
    await page.getByRole("combobox", { name: "Let another group shine" }).selectOption("floor");
    await page.getByRole("button", { name: "Solo floor" }).click();
    await settled(page);
    assert.deepEqual(await page.evaluate(() => [Object.keys(window.lambert.ask.wanted().emission), window.lambert.store.now.lighting.soloLuminaire]), [["groups"], null]);
    await page.getByRole("button", { name: "Solo row", exact: true }).click();
    await settled(page);
    await isShown(page, "room", { row: 1 });
    await page.getByRole("button", { name: "Solo row", exact: true }).click();
    await settled(page);
    assert.deepEqual(await page.evaluate(() => Object.keys(window.lambert.ask.wanted().emission).sort()), ["groups", "luminaires", "sky"]);
    await isFine(page);
    await page.context().close();
});

test("a tint is a factor of each channel at the same lumens, and a link restores all of it", async () => {
    const page = await openRoom("room");
    await change(page, "lighting", { sky: await page.evaluate(() => ({ ...window.lambert.store.now.lighting.sky, model: "off" })) });
    await setNumber(page, "desk", 6500, "Temperature in K");
    const { tint } = await page.evaluate(() => window.lambert.store.now.lighting.luminaires.desk);
    const { luminaires } = await daemon.json("/v1/scenes/room/luminaires"), own = luminaires[2].colour;
    // A black body of 2,700 K by the list; one of 6,500 K is nearly white, and its luminance is 1.
    const made = tint.map((v, c) => v * own[c]);
    close(luminance(made), 1, 1e-6, "luminance");
    made.forEach((v, c) => close(v, 1, 0.06, `channel ${c}`));
    assert.ok(tint[2] > 2 && tint[0] < 0.8, String(tint));
    const wanted = { row: 1, desk: tint.map((v) => 0.5 * v) };
    await isShown(page, "room", wanted);
    told(await lumens(page, "desk"), luminaires[2].lumens / 2);
    await page.getByRole("checkbox", { name: "Draw openings" }).uncheck();
    await page.getByRole("button", { name: "Solo desk" }).click();
    await page.waitForFunction(() => location.hash.length > 10);
    await page.waitForTimeout(600);
    const other = await openPage(daemon.address, { hash: await page.evaluate(() => location.hash) });
    assert.deepEqual(await other.evaluate(() => window.lambert.store.now.lighting), await page.evaluate(() => window.lambert.store.now.lighting));
    assert.equal(await field(other, "desk", "Temperature in K").inputValue(), "6500");
    await other.getByRole("tab", { name: "Lights" }).click();
    assert.equal(await other.getByRole("checkbox", { name: "Draw openings" }).isChecked(), false);
    await isShown(other, "room", { desk: wanted.desk });
    // A link that names a luminaire which is not there leaves none alone.
    const stale = await openRoom("room", { lighting: { soloLuminaire: "gone", luminaires: { gone: { dim: 3 } } } });
    await isShown(stale, "room", { row: 1, desk: 0.5 });
    for (const one of [page, other, stale]) {
        await isFine(one);
        await one.context().close();
    }
});

test("shares at a point have each luminaire and add up to the light there", async () => {
    const page = await openRoom("room", { pins: [5], view: { picture: "false", quantity: "irradiance" } });
    await change(page, "lighting", { sky: await page.evaluate(() => ({ ...window.lambert.store.now.lighting.sky, model: "even", strength: 200 })) });
    await page.getByRole("tab", { name: "Reading" }).click();
    await page.locator("[data-part=desk]").waitFor();
    const parts = await page.locator("[data-part]").evaluateAll((items) => items.map((item) => [item.dataset.part, item.querySelector(".figures").textContent]));
    assert.deepEqual(parts.map(([name]) => name).sort(), ["desk", "row.0", "row.1", "sky"]);
    const at = async (emission) => luminance((await daemon.json("/v1/scenes/room/radiosity", { emission, quantity: "irradiance", select: { elements: [5] }, limit: false })).irradiance.map(([v]) => v));
    const of = { desk: 0.5, "row.0": 1, "row.1": 1 };
    for (const [name, text] of parts) if (name !== "sky") told(text.split("·")[1], await at({ luminaires: { [name]: of[name] } }));
    const sum = parts.reduce((total, [, text]) => total + Number(text.split("·")[1].replaceAll(",", "").match(/[\d.]+/)[0]), 0);
    const whole = await page.evaluate(() => { const { emission, scale } = window.lambert.ask.wanted(); return { emission, scale }; });
    close(sum, whole.scale * await at(whole.emission), 0.0055, "their sum");
    assert.match(parts[0][1], / lx$/);
    // Dimming costs no other request to the adjoint.
    const asked = [];
    page.on("request", (request) => request.url().endsWith("/adjoint") && asked.push(request.url()));
    await change(page, "lighting", { luminaires: { desk: { on: true, dim: 0, tint: [1, 1, 1], kelvin: null } } });
    await page.locator("[data-part=desk]").waitFor({ state: "detached" });
    assert.deepEqual(asked, []);
    await isFine(page);
    await page.context().close();
});

test("openings are drawn at their place, named under the pointer, and can be left out", async () => {
    const page = await openRoom("grey");
    // The middle of a long side of the desk's opening, 1.2 m along x, and the point in the window where it is seen.
    const place = await page.evaluate(() => {
        const { camera } = window.lambert.scene.cameras, box = document.querySelector("main canvas").getBoundingClientRect();
        camera.updateMatrixWorld();
        const p = camera.position.clone().set(3, 2.8, -4.35).project(camera), share = [(p.x + 1) / 2, (1 - p.y) / 2];
        return { share, window: [box.left + share[0] * box.width, box.top + share[1] * box.height] };
    });
    /** Pixels around that point that are blue. */
    const blue = () => page.evaluate(([u, v]) => {
        const { stage } = window.lambert.scene, gl = stage.renderer.getContext(), bytes = new Uint8Array(4 * 81);
        stage.draw();
        gl.readPixels(Math.floor(u * gl.drawingBufferWidth) - 4, Math.floor((1 - v) * gl.drawingBufferHeight) - 4, 9, 9, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
        return Array.from({ length: 81 }, (_, k) => bytes[4 * k + 2] - bytes[4 * k]).filter((more) => more > 40).length;
    }, place.share);
    assert.ok(await blue() >= 9, "no outline is drawn");
    await page.mouse.move(...place.window);
    await page.locator(".tip", { hasText: /^desk, 1,451 lm · [\d.]+ lm\/m²/ }).waitFor();
    await page.getByText("2 luminaires", { exact: true }).click();
    await page.mouse.click(...place.window);
    await page.waitForFunction(() => document.activeElement?.closest("[data-luminaire]")?.dataset.luminaire === "desk");
    await page.getByRole("checkbox", { name: "Draw openings" }).uncheck();
    await settled(page);
    assert.equal(await blue(), 0);
    await page.mouse.move(place.window[0] + 1, place.window[1]);
    await page.locator(".tip", { hasText: /^[\d.]+ lm\/m²/ }).waitFor();
    await isFine(page);
    await page.context().close();
});

test("scenes whose luminaires have the same names are compared, and others are not", async () => {
    const page = await openRoom("grey");
    const admit = (name) => page.evaluate((other) => {
        let why = null;
        window.lambert.tell.on("incomparable", (text) => { why = text; });
        return window.lambert.ask.admit(other).then((is) => [is, why]);
    }, name);
    assert.deepEqual(await admit("moved"), [true, null]);
    for (const name of ["renamed", "none"]) assert.deepEqual(await admit(name), [false, `${name} has other luminaires than grey, so it cannot be lit alike.`]);
    await change(page, "compare", { how: "difference", scene: "moved", lighting: null, split: 0.5 });
    const values = await page.evaluate(() => [...window.lambert.scene.fields[1].values]), answer = await ask("moved", { row: 1, desk: 0.5 });
    answer.forEach((v, i) => close(values[i], v, 2 ** -10, `element ${i} of B`));
    await isFine(page);
    await page.context().close();
});

test("a store without luminaires has none of it", async () => {
    const page = await openRoom("none");
    assert.equal(await page.getByText("Luminaires", { exact: true }).isVisible(), false);
    assert.equal(await page.evaluate(() => window.lambert.scene.now.openings), null);
    await page.getByText("No group of this scene emits light").waitFor();
    // Its ceiling shines in their place; that of a store with luminaires does not.
    assert.equal(await page.evaluate(() => Object.keys(window.lambert.store.now.lighting.groups).length), 1);
    await page.getByRole("combobox", { name: "Scene" }).selectOption("grey");
    await settled(page);
    assert.equal(await page.evaluate(() => Object.keys(window.lambert.store.now.lighting.groups).length), 0);
    await isShown(page, "grey", { row: 1, desk: 0.5 });
    await isFine(page);
    await page.context().close();
});

test("of many luminaires groups are asked for, and a part of a name finds the others", async () => {
    const page = await openRoom("many");
    assert.equal(await page.locator("[data-luminaire]").count(), 11);
    assert.equal(await page.evaluate(() => Object.keys(window.lambert.ask.wanted().emission.luminaires).length), 11);
    await page.getByText("50 luminaires", { exact: true }).click();
    assert.equal(await page.locator("[data-luminaire]").count(), 51);
    await page.getByText("10 more: name a part of theirs above.").waitFor();
    await page.getByLabel("Show luminaires whose names have").fill("row.49");
    assert.equal(await page.locator("[data-luminaire]").count(), 1);
    await page.getByRole("button", { name: "All off" }).click();
    await settled(page);
    assert.equal(await page.evaluate(() => Object.keys(window.lambert.ask.wanted().emission.luminaires).length), 59);
    assert.deepEqual(await violations(page), []);
    await isFine(page);
    await page.context().close();
});
