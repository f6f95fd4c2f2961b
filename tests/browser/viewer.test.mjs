// The page as people use it: what it draws agrees with what the daemon answers.
import assert from "node:assert/strict";
import { before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { Daemon, elementAt, makeStore, near, openPage, pixel, settled, toSrgb, violations } from "./page.mjs";

let daemon, store;
before(async () => {
    store = makeStore("cornell", "cornell", { generate: ["--elements", 700] });
    daemon = await Daemon.start([store]);
});

/** Radiosity of one element by JSON, per channel. */
async function radiosity(element, groups, quantity = "radiosity") {
    const answer = await daemon.json("/v1/scenes/cornell/radiosity", { emission: { groups }, select: { elements: [element] }, quantity });
    return answer[quantity].map((channel) => channel[0]);
}

const change = (page, part, to) => page.evaluate(([where, what]) => {
    const { store: s } = window.lambert;
    s.change({ ...s.now, [where]: { ...s.now[where], ...what } });
}, [part, to]);

const lampNow = (page) => page.evaluate(() => {
    const { lighting } = window.lambert.store.now, { lamp } = lighting.groups;
    return lamp.colour.map((c) => c * lamp.power * lighting.dim);
});

test("pixels are the daemon's numbers", async () => {
    const page = await openPage(daemon.address);
    await change(page, "view", { smooth: false, tone: "linear", exposure: -5 });
    await settled(page);
    for (const [x, y] of [[0.5, 0.9], [0.25, 0.5], [0.75, 0.5], [0.5, 0.15]]) {
        const element = await elementAt(page, x, y);
        const B = await radiosity(element, { lamp: await lampNow(page) });
        // Half precision is 2^-11, a step of 255 is 1/255: one step of rounding, one of antialiasing at an edge.
        near(await pixel(page, x, y), toSrgb(B.map((v) => v * 2 ** -5)), 2);
    }
    // The page's own objects are for tests alone, which ask for them in the address.
    const plain = await page.context().newPage();
    await plain.goto(daemon.address);
    await plain.getByText(/solve/).first().waitFor();
    assert.equal(await plain.evaluate(() => typeof window.lambert), "undefined");
    assert.deepEqual(page.faults, []);
    await page.context().close();
});

test("dragging a slider changes the picture as the numbers say", async () => {
    const page = await openPage(daemon.address);
    await change(page, "view", { smooth: false, tone: "linear", exposure: -5 });
    await settled(page);
    const element = await elementAt(page, 0.5, 0.9), first = await pixel(page, 0.5, 0.9);
    const before = await page.evaluate(() => window.lambert.scene.answers);
    const slider = page.getByLabel("All", { exact: true });
    const box = await slider.boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.down();
    for (let step = 1; step <= 20; step++) {
        await page.mouse.move(box.x + box.width * (0.5 - step / 60), box.y + box.height / 2);
        if (step === 10) await page.waitForTimeout(1600);  // longer than keys may pause within a step
    }
    await page.mouse.up();
    await settled(page);
    const dim = await page.evaluate(() => window.lambert.store.now.lighting.dim);
    assert.ok(dim > 0.1 && dim < 0.6, `dim is ${dim}`);
    const B = await radiosity(element, { lamp: await lampNow(page) });
    const last = await pixel(page, 0.5, 0.9);
    near(last, toSrgb(B.map((v) => v * 2 ** -5)), 2);
    assert.ok(last[0] < first[0]);
    assert.ok(await page.evaluate(() => window.lambert.scene.answers) > before);
    // One drag is one step of undo, and another one at once another step.
    await page.mouse.move(box.x + box.width / 4, box.y + box.height / 2);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width / 8, box.y + box.height / 2);
    await page.mouse.up();
    assert.ok(await page.evaluate(() => window.lambert.store.now.lighting.dim) < dim);
    await page.keyboard.press("Control+z");
    assert.equal(await page.evaluate(() => window.lambert.store.now.lighting.dim), dim);
    await page.keyboard.press("Control+z");
    assert.equal(await page.evaluate(() => window.lambert.store.now.lighting.dim), 1);
    await settled(page);
    near(await pixel(page, 0.5, 0.9), first, 1);
    await page.keyboard.press("Control+y");
    assert.equal(await page.evaluate(() => window.lambert.store.now.lighting.dim), dim);
    assert.deepEqual(page.faults, []);
    await page.context().close();
});

test("smooth shading is the mean at a corner", async () => {
    const page = await openPage(daemon.address);
    await change(page, "view", { smooth: true, tone: "linear", exposure: -5 });
    await settled(page);
    const found = await page.evaluate(() => {
        const { now: { mesh }, cameras: { camera }, stage } = window.lambert.scene;
        camera.updateMatrixWorld();
        // A corner of the floor where four elements meet, and its place in the picture.
        const floor = mesh.groups.findIndex((g) => g.name === "floor"), at = new Map();
        for (let v = 0; v < mesh.elementOf.length; v++) {
            if (mesh.groupOf[mesh.elementOf[v]] !== floor) continue;
            const key = [0, 1, 2].map((k) => mesh.positions[3 * v + k]).join();
            at.set(key, [...(at.get(key) ?? []), mesh.elementOf[v]]);
        }
        for (const [key, elements] of at) {
            if (elements.length !== 4) continue;
            const p = camera.position.clone().set(...key.split(",").map(Number)).project(camera);
            const seen = scene => scene.picker.at(p.x, p.y, camera);
            if (Math.abs(p.x) < 0.9 && Math.abs(p.y) < 0.9 && elements.includes(seen(window.lambert.scene.now)))
                return { elements, x: (p.x + 1) / 2, y: (1 - p.y) / 2, width: stage.canvas.width };
        }
        return null;
    });
    assert.ok(found, "no corner of four elements is seen");
    const lamp = await lampNow(page);
    const all = await Promise.all(found.elements.map((element) => radiosity(element, { lamp })));
    const mean = [0, 1, 2].map((c) => all.reduce((sum, B) => sum + B[c], 0) / 4);
    near(await pixel(page, found.x, found.y), toSrgb(mean.map((v) => v * 2 ** -5)), 3);
    await page.context().close();
});

test("false colour is the palette at the value", async () => {
    const page = await openPage(daemon.address);
    await page.getByRole("tab", { name: "View" }).click();
    await page.getByLabel("Picture").selectOption("false");
    await page.getByLabel("Quantity").selectOption("irradiance");
    const element = await elementAt(page, 0.5, 0.9);
    const H = await radiosity(element, { lamp: await lampNow(page) }, "irradiance");
    const value = 0.2126 * H[0] + 0.7152 * H[1] + 0.0722 * H[2];
    await page.getByLabel("Largest value of the palette").fill(String(1.5 * value));
    await page.getByLabel("Least value of the palette").fill("0");
    await page.keyboard.press("Enter");
    await change(page, "view", { smooth: false });
    await settled(page);
    const { interpolateViridis } = await import(pathToFileURL(`${process.env.MODULES}/d3-scale-chromatic/dist/d3-scale-chromatic.mjs`));
    near(await pixel(page, 0.5, 0.9), interpolateViridis(1 / 1.5).match(/[0-9a-f]{2}/g).map((hex) => parseInt(hex, 16)), 3);
    assert.deepEqual(page.faults, []);
    await page.context().close();
});

test("a link restores the state", async () => {
    const page = await openPage(daemon.address);
    await change(page, "view", { tone: "aces", exposure: -4.5, smooth: false });
    await page.getByLabel("Power in W/m²").fill("7");
    await page.keyboard.press("Enter");
    await page.getByPlaceholder("Name of this lighting").fill("Evening “7”");
    await page.getByRole("button", { name: "Keep" }).click();
    await page.evaluate(() => window.lambert.scene.cameras.place([1, 1, 4, 1, 1, 0], false));
    await settled(page);
    await page.waitForTimeout(800);
    const [hash, state] = await page.evaluate(() => [location.hash, window.lambert.store.now]);
    const other = await openPage(daemon.address, { hash });
    const now = await other.evaluate(() => window.lambert.store.now);
    assert.deepEqual({ ...now, view: { ...now.view, camera: null } }, { ...state, view: { ...state.view, camera: null } });
    near(now.view.camera, state.view.camera, 1e-3);
    assert.deepEqual(now.presets.map((preset) => preset.name), ["Evening “7”"]);
    near(await pixel(other, 0.5, 0.7), await pixel(page, 0.5, 0.7), 1);
    // What strangers write into a link is checked.
    const bad = (text) => "#1." + Buffer.from(text).toString("base64url");
    for (const hash of ["#1.%%%", bad("[]"), bad('{"view":7,"lighting":{"groups":{"lamp":{"power":"x","colour":[1]},"no":3}}}'),
        bad('{"scene":"cornell","pins":["a",1e9],"compare":{"how":7},"view":{"range":"a","camera":[1]}}')]) {
        const odd = await openPage(daemon.address, { hash });
        assert.deepEqual(odd.faults, [], hash);
        await odd.context().close();
    }
    // So is the scene, which may be another daemon's.
    const absent = await openPage(daemon.address, { hash: bad('{"scene":"palace"}') });
    await absent.getByText("The link asks for the scene palace").waitFor();
    await absent.context().close();
    await other.context().close();
    await page.context().close();
});

test("it recovers when the daemon was killed", async () => {
    const own = await Daemon.start([store]);
    const page = await openPage(own.address);
    const { port } = own;
    await own.stop("SIGKILL");
    await page.getByLabel("All", { exact: true }).fill("0.5");
    await page.getByText("The daemon does not answer. This page asks again").waitFor();
    const again = await Daemon.start([store], { port });
    await page.getByText("The daemon does not answer. This page asks again").waitFor({ state: "hidden" });
    await settled(page);
    const scale = await page.evaluate(() => window.lambert.scene.fields[0].scale);
    const lamp = await lampNow(page);
    assert.ok(Math.abs(scale - Math.max(...lamp)) < 1e-6 * scale, `${scale} is shown, ${lamp} was asked for`);
    assert.deepEqual(page.faults, []);
    await page.context().close();
    await again.stop();
});

test("a token is asked for and kept for the tab", async () => {
    const { writeFileSync } = await import("node:fs");
    const { inFolder } = await import("./page.mjs");
    writeFileSync(inFolder("tokens"), "right-one read\n", { mode: 0o600 });
    const own = await Daemon.start([store], { options: ["--token-file", inFolder("tokens")] });
    const page = await openPage(own.address, { wait: false });
    const field = page.getByLabel("Token", { exact: true });
    await field.fill("wrong");
    await page.keyboard.press("Enter");
    await field.waitFor();
    await field.fill("right-one");
    await page.keyboard.press("Enter");
    await settled(page);
    await page.reload();
    await settled(page);
    const kept = await page.evaluate(() => [localStorage.length, document.cookie, location.href.includes("right-one")]);
    assert.deepEqual(kept, [0, "", false]);
    assert.deepEqual(page.faults, []);
    await page.context().close();
    await own.stop();
});

test("everything is reached by keyboard", async () => {
    const page = await openPage(daemon.address);
    const reached = new Set();
    for (let i = 0; i < 60; i++) {
        await page.keyboard.press("Tab");
        reached.add(await page.evaluate(() => {
            const e = document.activeElement;
            return `${e.tagName} ${e.getAttribute("aria-label") ?? e.textContent ?? ""}`.trim().slice(0, 40);
        }));
    }
    for (const wanted of ["CANVAS", "SELECT", "BUTTON Link", "INPUT All", "BUTTON Solo lamp"])
        assert.ok([...reached].some((name) => name.startsWith(wanted)), `${wanted} is not among ${[...reached]}`);
    await page.locator("main canvas").first().focus();
    const eye = await page.evaluate(() => window.lambert.scene.cameras.now);
    await page.keyboard.down("ArrowLeft");
    await page.waitForFunction((from) => window.lambert.scene.cameras.now.some((v, i) => Math.abs(v - from[i]) > 0.05), eye);
    await page.keyboard.up("ArrowLeft");
    await page.keyboard.press("f");
    await page.getByRole("tab", { name: "Lights" }).focus();
    await page.keyboard.press("ArrowRight");
    assert.equal(await page.getByRole("tab", { name: "View" }).getAttribute("aria-selected"), "true");
    assert.deepEqual(page.faults, []);
    await page.context().close();
});

test("a phone has it all, and nothing is wider than it", async () => {
    const page = await openPage(daemon.address, { width: 360, height: 740, touch: true });
    for (const tab of await page.getByRole("tab").all()) {
        if (!(await tab.isVisible())) continue;
        await tab.tap();
        const wide = await page.evaluate(() => [document.documentElement.scrollWidth,
            ...[...document.querySelectorAll("[role=tabpanel]:not([hidden]), header, footer")].map((e) => e.scrollWidth - e.clientWidth)]);
        assert.ok(wide[0] <= 360 && wide.slice(1).every((w) => w <= 0), `${await tab.textContent()}: ${wide}`);
    }
    const canvas = await page.locator("main canvas").first().boundingBox();
    assert.ok(canvas.height > 200 && canvas.width === 360, JSON.stringify(canvas));
    assert.deepEqual(page.faults, []);
    await page.context().close();
});

test("axe-core finds nothing, dark or light", async () => {
    for (const theme of ["dark", "light"]) {
        const page = await openPage(daemon.address);
        await page.evaluate((t) => { document.documentElement.dataset.theme = t; }, theme);
        for (const tab of await page.getByRole("tab").all()) {
            if (!(await tab.isVisible())) continue;
            await tab.click();
            assert.deepEqual(await violations(page), [], `${theme}, ${await tab.textContent()}`);
        }
        await page.context().close();
    }
});
