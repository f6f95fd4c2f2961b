// The panels of trust and of comparisons: their numbers are those that the daemon's own answers give.
import assert from "node:assert/strict";
import { before, test } from "node:test";
import { Daemon, inFolder, lambert, makeStore, openPage, pixel, settled, violations, elementAt } from "./page.mjs";

let daemon;
before(async () => {
    const store = makeStore("box", "cornell", { generate: ["--elements", 500], precompute: ["--probes", 2, "--keep-form-factors", "--method", "exact"] });
    lambert("precompute", inFolder("box.obj"), "-o", inFolder("rank.h5"), "--quiet", "--probes", 2, "--method", "low-rank");
    daemon = await Daemon.start([store, `${inFolder("rank.h5")}:rank “é”`]);
});

const WEIGHTS = [0.2126, 0.7152, 0.0722];

/** All values by JSON, [C][n], of a lighting as the page has it. */
async function values(page, scene, extra = {}) {
    const emission = await page.evaluate(() => {
        const { lighting } = window.lambert.store.now;
        return { groups: Object.fromEntries(Object.entries(lighting.groups).map(([name, l]) => [name, l.colour.map((c) => c * l.power * lighting.dim)])) };
    });
    return daemon.json(`/v1/scenes/${encodeURIComponent(scene)}/radiosity`, { emission, ...extra });
}

const areas = (page) => page.evaluate(() => [...window.lambert.scene.now.mesh.area]);
const close = (a, b, relative, what) => assert.ok(Math.abs(a - b) <= relative * Math.abs(b), `${what}: ${a} is not near ${b}`);

test("the error of a lighting and a certificate", async () => {
    const page = await openPage(daemon.address);
    await page.getByRole("tab", { name: "Trust" }).click();
    const table = page.getByRole("table", { name: "Error of this lighting by group" });
    await table.waitFor();
    const told = await values(page, "box", { reduce: { groups: ["floor", "tall-block"], with: ["mean", "max"] } });
    const percent = (v) => `${Number((100 * v).toPrecision(2))} %`;
    for (const [name, { mean, elements }] of Object.entries(told.error.groups)) {
        const cells = await table.getByRole("row").filter({ hasText: name }).getByRole("cell").allTextContents();
        assert.deepEqual(cells, [percent(mean), percent(elements)], name);
    }
    await page.getByLabel("Tolerance, a share").fill("0.00001");
    await page.getByRole("button", { name: "Certify" }).click();
    await page.getByText(/^Certified: no number/).waitFor();
    const exact = await values(page, "box", { tolerance: 1e-5 });
    const shown = await page.evaluate(() => ({ values: [...window.lambert.scene.fields[0].values], ...window.lambert.scene.certificate }));
    assert.equal(shown.iterations, exact.iterations);
    // The bound is that of the answer scaled to 1, in single precision: its rounding is counted.
    const largest = Math.max(...exact.radiosity.flat());
    assert.ok(shown.bound >= exact.certificate * 0.5 && shown.bound <= exact.certificate + 2 ** -23 * largest, `${shown.bound}, ${exact.certificate}`);
    for (let i = 0; i < shown.values.length; i++)
        close(shown.values[i], exact.radiosity.reduce((sum, channel, c) => sum + WEIGHTS[c] * channel[i], 0), 2 ** -10, `element ${i}`);
    assert.match(await page.getByRole("contentinfo").textContent(), /certified.*solve [\d.]+ ms/);
    // Another lighting is certified when it rests; the link has the tolerance.
    await page.evaluate(() => { const { store: s } = window.lambert; s.change({ ...s.now, lighting: { ...s.now.lighting, dim: 0.5 } }); });
    await page.waitForFunction((bound) => window.lambert.scene.certificate !== null && window.lambert.scene.certificate.bound < 0.9 * bound, shown.bound);
    await page.waitForTimeout(500);
    const other = await openPage(daemon.address, { hash: await page.evaluate(() => location.hash) });
    await other.waitForFunction(() => window.lambert.scene.certificate !== null);
    assert.equal(await other.evaluate(() => window.lambert.store.now.tolerance), 1e-5);
    await other.context().close();
    await page.getByRole("button", { name: "As stored" }).click();
    await page.waitForFunction(() => window.lambert.scene.certificate === null && window.lambert.ask.isIdle);
    assert.deepEqual(page.faults, []);
    assert.deepEqual(await violations(page), []);
    await page.context().close();
});

test("the line at the bottom has the part of the mesh", async () => {
    const page = await openPage(daemon.address), line = page.getByRole("contentinfo");
    await settled(page);
    const { error } = await daemon.json("/v1/scenes/box"), percent = (v) => `${Number((100 * v).toPrecision(2))} %`;
    const whole = Math.hypot(error.lights.total_indirect_mean, error.mesh.lights);
    assert.ok(error.mesh.lights > 2 * error.lights.total_indirect_mean, "the mesh is most of it");
    const text = await line.textContent();
    assert.ok(text.includes(`error ${percent(whole)}${whole > 0.1 ? ", coarse" : ""}`), text);
    close(error.stated, whole, 1e-12, "the stated error"); // two libraries' hypot may differ in the last bit
    assert.equal(error.coarse === true, whole > 0.1);
    const title = await line.locator("span").nth(1).getAttribute("title");
    assert.ok(title.includes(`${percent(error.lights.total_indirect_mean)} by operator and form factors, ${percent(error.mesh.lights)} by the mesh`), title);
    assert.deepEqual(page.faults, []);
    await page.context().close();
});

test("a store without form factors says how to make one with them", async () => {
    const page = await openPage(daemon.address);
    await page.locator("header select").selectOption("rank “é”");
    await settled(page);
    await page.getByRole("tab", { name: "Trust" }).click();
    await page.getByRole("button", { name: "Certify" }).click();
    await page.getByText(/Not certified: .*--keep-form-factors/).waitFor();
    assert.equal(await page.evaluate(() => window.lambert.store.now.tolerance), null);
    assert.deepEqual(page.faults, []);
    await page.context().close();
});

for (const ratio of [1, 2])
    test(`two methods by a split and by their difference, ${ratio} pixels a point`, async () => {
        const page = await openPage(daemon.address, { storage: { deviceScaleFactor: ratio } });
        await page.evaluate(() => {
            const { store: s } = window.lambert;
            s.change({ ...s.now, view: { ...s.now.view, smooth: false, tone: "linear", exposure: -5 } });
        });
        await page.getByRole("tab", { name: "Compare" }).click();
        await page.getByLabel("B is").selectOption("s:rank “é”");
        await page.locator("[data-rough=no]").waitFor();
        const [a, b, area] = [(await values(page, "box")).radiosity, (await values(page, "rank “é”")).radiosity, await areas(page)];
        let square = 0, total = 0, apart = 0, whole = 0, most = 0;
        area.forEach((A, i) => {
            const by = b.map((channel, c) => channel[i] - a[c][i]), L = by.reduce((sum, v, c) => sum + WEIGHTS[c] * v, 0);
            square += A * L * L;
            total += A;
            apart += A * by.reduce((sum, v) => sum + v * v, 0);
            whole += A * a.reduce((sum, channel) => sum + channel[i] ** 2, 0);
            if (Math.abs(L) > Math.abs(most)) most = L;
        });
        const told = await page.locator("[data-rough=no] [data-number]").evaluateAll((all) => all.map((e) => Number(e.dataset.number)));
        [Math.sqrt(square / total), most, Math.sqrt(apart / whole)].forEach((v, k) => close(told[k], v, 1e-3, `figure ${k}`));
        // Left of the line is A, right of it B, wherever it is moved to by keys.
        const line = page.getByRole("slider", { name: "Line between A and B" });
        await line.focus();
        for (const [key, share] of [["Home", 0], ["PageUp", 0.1], ["PageUp", 0.2], ["ArrowRight", 0.21]]) {
            await page.keyboard.press(key);
            assert.equal(await page.evaluate(() => window.lambert.store.now.compare.split), share);
        }
        const box = await page.locator("canvas").first().boundingBox();
        const middle = await line.boundingBox();
        assert.ok(Math.abs(middle.x + middle.width / 2 - box.x - 0.21 * box.width) < 1);
        assert.ok(middle.width >= 32);
        await settled(page);
        const side = () => page.evaluate(() => {
            const { stage } = window.lambert.scene, gl = stage.renderer.getContext(), width = gl.drawingBufferWidth, row = new Uint8Array(4 * width);
            stage.draw();
            gl.readPixels(0, Math.floor(gl.drawingBufferHeight / 2), width, 1, gl.RGBA, gl.UNSIGNED_BYTE, row);
            // The line is white, where the picture is not.
            return Array.from({ length: width }, (_, x) => x).filter((x) => [0, 1, 2].every((k) => row[4 * x + k] > 250)).map((x) => x / width);
        });
        const white = await side();
        assert.ok(white.length > 0 && white.every((x) => Math.abs(x - 0.21) < 0.004), `the line is at ${white}`);
        // The difference is blue where B is darker and red where it is brighter.
        await page.getByLabel("Shown as").selectOption("difference");
        await settled(page);
        const [title, ramp, ends] = await page.locator(".changes > *").evaluateAll((all) => all.map((e) => e.getBoundingClientRect().top));
        assert.ok(title < ramp && ramp < ends, `the legend stands at ${[title, ramp, ends]}`);
        const end = Number((await page.locator(".changes .ends span").last().textContent()).replace(/[^\d.e-]/g, ""));
        for (const [x, y] of [[0.5, 0.9], [0.3, 0.4], [0.75, 0.5]]) {
            const element = await elementAt(page, x, y), t = Math.max(-1, Math.min(1, WEIGHTS.reduce((sum, w, c) => sum + w * (b[c][element] - a[c][element]), 0) / end));
            const colour = [0.8, 0.8, 0.8].map((v, k) => v + Math.abs(t) * ((t < 0 ? [0.02, 0.13, 0.65] : [0.62, 0.02, 0.05])[k] - v))
                .map((v) => 255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055));
            // Both sides are half precision: 2^-11 of the value, as a share of the end of the scale.
            const doubt = Math.max(...a.map((channel) => channel[element])) * 2 ** -10 / end;
            (await pixel(page, x, y)).forEach((v, k) => assert.ok(Math.abs(v - colour[k]) <= 3 + 255 * doubt, `${v} for ${colour[k]} at ${x}, ${y}`));
        }
        assert.deepEqual(page.faults, []);
        assert.deepEqual(await violations(page), []);
        await page.context().close();
    });

test("a lighting that was kept stands in the link", async () => {
    const page = await openPage(daemon.address, { width: 360, height: 740, touch: true });
    await page.getByRole("tab", { name: "Compare" }).click();
    await page.getByRole("button", { name: "Keep this lighting as B" }).click();
    await page.evaluate(() => { const { store: s } = window.lambert; s.change({ ...s.now, lighting: { ...s.now.lighting, dim: 0.5 } }); });
    await page.locator("[data-rough=no]").waitFor();
    // B is twice A: |B − A| / |A| is 1.
    close(Number(await page.locator("[data-rough=no] [data-number]").last().getAttribute("data-number")), 1, 1e-5, "twice");
    const line = await page.getByRole("slider", { name: "Line between A and B" }).boundingBox();
    await page.mouse.move(line.x + line.width / 2, line.y + line.height / 2);
    await page.mouse.down();
    await page.mouse.move(90, line.y + line.height / 2, { steps: 5 });
    await page.mouse.up();
    close(await page.evaluate(() => window.lambert.store.now.compare.split), 0.25, 0.02, "dragged");
    await page.waitForTimeout(500);
    const other = await openPage(daemon.address, { hash: await page.evaluate(() => location.hash) });
    assert.deepEqual(await other.evaluate(() => window.lambert.store.now.compare), await page.evaluate(() => window.lambert.store.now.compare));
    // Only scenes of as many elements are offered, and a comparison ends.
    await page.getByLabel("B is").selectOption("");
    assert.equal(await page.evaluate(() => window.lambert.store.now.compare), null);
    assert.deepEqual(page.faults, []);
    assert.deepEqual(await violations(page), []);
    await other.context().close();
    await page.context().close();
});
