// The panel of readings: what it tells agrees with what the daemon answers.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { Daemon, elementAt, inFolder, lambert, openPage, settled, violations } from "./page.mjs";

// A coloured yard under a sky, with two lamps on its walls. The floor is 4 m by 4 m.
const OBJ = `mtllib yard.mtl
v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 0 0 2\nv 4 0 2\nv 4 4 2\nv 0 4 2
v 1 .01 .8\nv 2 .01 .8\nv 2 .01 1.4\nv 1 .01 1.4\nv 3.99 2 1\nv 3.99 3 1\nv 3.99 3 1.5\nv 3.99 2 1.5
o floor\nusemtl floor\nf 1 2 3 4\no south\nusemtl wall\nf 1 5 6 2\no north\nusemtl black\nf 4 3 7 8\no west\nusemtl red\nf 1 4 8 5\no east\nusemtl wall\nf 2 6 7 3
o lamp\nusemtl lamp\nf 9 12 11 10\no spot\nusemtl spot\nf 13 16 15 14
`;
const MTL = `newmtl floor\nKd .5 .5 .5\nnewmtl wall\nKd .7 .7 .6\nnewmtl red\nKd .7 .1 .1\nnewmtl black\nKd 0 0 0
newmtl lamp\nKd .5 .5 .5\nKe 900 700 400\nnewmtl spot\nKd .3 .3 .3\nKe 100 200 900
`;
const WEIGHTS = [0.2126, 0.7152, 0.0722];
const luminance = (c) => c.reduce((sum, v, i) => sum + v * WEIGHTS[i], 0);
/** Numbers are told with three digits. */
const told = (text, value) => assert.ok(Math.abs(Number(text.replaceAll(",", "").match(/-?[\d.]+(e[+-]?\d+)?/)?.[0]) - value) <= 0.0055 * Math.abs(value) + 1e-6,
    `"${text}" is told, it is ${value}`);

let daemon;
before(async () => {
    writeFileSync(inFolder("yard.obj"), OBJ);
    writeFileSync(inFolder("yard.mtl"), MTL);
    lambert("precompute", inFolder("yard.obj"), "-o", inFolder("yard.h5"), "--elements", 500, "--rays", 512, "--probes", 2, "--quiet",
        "--method", "low-rank", "--epsilon", 0.02, "--sky", "grid:4x3");
    // The same under the tiles of its sky, each solved once: the sky is all the light there is.
    lambert("precompute", inFolder("yard.obj"), "-o", inFolder("tiles.h5"), "--elements", 200, "--rays", 256, "--probes", 2, "--quiet",
        "--sky", "grid:4x3", "--emitters", "sky");
    lambert("precompute", inFolder("yard.obj"), "-o", inFolder("lumens.h5"), "--rays", 64, "--probes", 0, "--quiet", "--lights", "lm", "--sky", "grid:4x3");
    daemon = await Daemon.start([inFolder("yard.h5"), `${inFolder("tiles.h5")}:tiles`, inFolder("lumens.h5")]);
});

/** A page that shows the panel, seen from above, under an even sky. */
async function openReading({ scene = "yard", ...options } = {}) {
    options.hash = "#1." + Buffer.from(JSON.stringify({ scene })).toString("base64url");
    const page = await openPage(daemon.address, options);
    await page.evaluate(() => {
        const { store } = window.lambert, { now } = store;
        window.lambert.scene.cameras.place([2, 7, -1, 2, 0, -2.2], false);
        store.change({ ...now, lighting: { ...now.lighting, sky: { ...now.lighting.sky, model: "even", strength: 40 } } });
    });
    await settled(page);
    await page.getByRole("tab", { name: "Reading" }).click();
    await page.locator(".pins > *").first().waitFor();
    return page;
}

const ask = async (emission, more, scene = "yard") => daemon.json(`/v1/scenes/${scene}/radiosity`, { emission, ...more });

/** Nothing failed, and no request was refused. */
async function isFine(page) {
    assert.deepEqual(page.faults, []);
    assert.equal(await page.evaluate(() => window.lambert.tell.problem), null);
}

/** What shines, as the page says: by group, and of the sky's tiles. */
const lightsOf = (page) => page.evaluate(() => {
    const { store: { now: { lighting } }, scene: { now: scene, sky } } = window.lambert;
    const groups = Object.fromEntries(Object.entries(lighting.groups).map(([name, light]) => [name, light.colour.map((c) => c * light.power * lighting.dim)]));
    return { groups, sky: sky.radiances(lighting, scene.description) };
});

/** [C] of one element. */
async function at(element, emission, quantity) {
    return (await ask(emission, { quantity, select: { elements: [element] } }))[quantity].map((row) => row[0]);
}

async function click(page, x, y) {
    const box = await page.locator("main canvas").first().boundingBox();
    await page.mouse.move(box.x + x * box.width, box.y + y * box.height);
    await page.mouse.click(box.x + x * box.width, box.y + y * box.height);
    return elementAt(page, x, y);
}

const change = (page, to) => page.evaluate((what) => {
    const { store: s } = window.lambert;
    s.change({ ...s.now, view: { ...s.now.view, ...what } });
}, to);

test("a pinned element has the numbers of the daemon", async () => {
    const page = await openReading();
    const first = await click(page, 0.53, 0.63);
    await page.keyboard.down("Shift");
    const second = await click(page, 0.35, 0.75);
    await page.keyboard.up("Shift");
    assert.deepEqual(await page.evaluate(() => window.lambert.store.now.pins), [first, second]);
    const lights = await lightsOf(page);
    for (const element of [first, second]) {
        for (const [row, quantity] of [["B", "radiosity"], ["H", "irradiance"]]) {
            const wanted = await at(element, lights, quantity);
            const cells = page.locator(`.pin[data-pin="${element}"] tr[data-row="${row}"] td`);
            await page.waitForFunction(([pin, r]) => !document.querySelector(`.pin[data-pin="${pin}"] tr[data-row="${r}"] td`).textContent.includes("–"), [element, row]);
            const texts = await cells.allTextContents();
            [...wanted, luminance(wanted)].forEach((value, i) => told(texts[i], value));
        }
        assert.deepEqual((await page.locator(`.pin[data-pin="${element}"] tr[data-row="E"] td`).allTextContents()), ["0", "0", "0", "0"]);
    }
    // The numbers follow a slider.
    const before = await page.locator(`.pin[data-pin="${first}"] tr[data-row="B"] td`).first().textContent();
    await page.evaluate(() => { const { store: s } = window.lambert; s.change({ ...s.now, lighting: { ...s.now.lighting, dim: 0.5 } }); });
    await settled(page);
    const dimmed = await at(first, await lightsOf(page), "radiosity");
    await page.waitForFunction(([pin, old]) => document.querySelector(`.pin[data-pin="${pin}"] tr[data-row="B"] td`).textContent !== old, [first, before]);
    told(await page.locator(`.pin[data-pin="${first}"] tr[data-row="B"] td`).first().textContent(), dimmed[0]);
    // A second click takes the pin away; the number beside the pointer is that of the picture.
    await click(page, 0.53, 0.63);
    assert.deepEqual(await page.evaluate(() => window.lambert.store.now.pins), [second]);
    told(await page.locator(".tip").textContent(), luminance(dimmed));
    assert.match(await page.locator(".tip").textContent(), /W\/m² · floor/);
    await isFine(page);
    await page.context().close();
});

test("shares are those of each lamp and of the sky alone", async () => {
    const page = await openReading();
    for (const [quantity, shows] of [["radiosity", "light"], ["irradiance", "irradiance"]]) {
        await page.locator(".reading").getByLabel("Shows").selectOption(shows);
        await settled(page);
        await page.evaluate(() => { const { store: s } = window.lambert; s.change({ ...s.now, pins: [] }); });
        const element = await click(page, 0.53, 0.63);
        const { groups, sky } = await lightsOf(page);
        const alone = {};
        for (const name of ["lamp", "spot"]) alone[name] = luminance(await at(element, { groups: { [name]: groups[name] } }, quantity));
        alone.sky = luminance(await at(element, { sky }, quantity));
        const all = Object.values(alone).reduce((sum, v) => sum + v, 0);
        // Light is linear: what they give one by one is what they give together, but for single precision.
        const together = luminance(await at(element, { groups, sky }, quantity));
        assert.ok(Math.abs(all - together) < 1e-4 * together, `${all} is not ${together}`);
        await page.locator('.shares li[data-part="sky"]').waitFor();
        let sum = 0;
        for (const [name, value] of Object.entries(alone)) {
            const text = await page.locator(`.shares li[data-part="${name}"] .figures`).textContent();
            const [share, figure] = text.split("·");
            told(figure, value);
            // Shares are told with two digits.
            assert.ok(Math.abs(parseFloat(share) / 100 - value / all) <= 0.06 * (value / all), `${name}: ${text}, it is ${value / all}`);
            sum += parseFloat(share);
        }
        assert.ok(Math.abs(sum - 100) < 2, `the shares sum to ${sum} %`);
        told(await page.locator(".shares p").first().textContent().then((text) => text.split(`${quantity} `)[1]), together);
    }
    // A lamp that is dimmed costs no adjoint request.
    let adjoints = 0;
    page.on("request", (request) => { if (request.url().endsWith("/adjoint")) adjoints += 1; });
    await page.evaluate(() => {
        const { store: s } = window.lambert, { lighting } = s.now;
        s.change({ ...s.now, lighting: { ...lighting, groups: { ...lighting.groups, lamp: { ...lighting.groups.lamp, on: false } } } });
    });
    await settled(page);
    assert.equal(await page.locator('.shares li[data-part="lamp"]').count(), 0);
    assert.equal(adjoints, 0);
    // Nor does one that is dimmed before the first answer has come.
    let answer;
    const held = new Promise((resolve) => { answer = resolve; });
    await page.route("**/adjoint", async (route) => {
        await held;
        await route.continue();
    });
    const isAsked = page.waitForRequest((request) => request.url().endsWith("/adjoint"));
    await click(page, 0.45, 0.6);
    await isAsked;
    for (const dim of [0.9, 0.8, 0.7]) {
        await page.evaluate((to) => { const { store: s } = window.lambert; s.change({ ...s.now, lighting: { ...s.now.lighting, dim: to } }); }, dim);
        await settled(page);
    }
    // Nor one that waits for the answer to another pin, nor one that was answered before.
    const pin = async (pins) => {
        await page.evaluate((to) => { const { store: s } = window.lambert; s.change({ ...s.now, pins: to }); }, pins);
        await settled(page);
    };
    const [last] = await page.evaluate(() => window.lambert.store.now.pins);
    await pin([last + 1]);
    await pin([last]);
    answer();
    await page.locator(".shares li").first().waitFor();
    await page.waitForTimeout(200);
    assert.equal(adjoints, 1);
    await pin([last, last + 1]);
    await page.getByText(`element ${last + 1}: irradiance`).waitFor();
    await pin([last]);
    await page.getByText(`element ${last}: irradiance`).waitFor();
    await page.waitForTimeout(200);
    assert.equal(adjoints, 2);
    // A store that is opened anew is asked once, though its state comes before its picture.
    await page.evaluate(async () => { const { store: s } = window.lambert; await window.lambert.ask.open(s.now.scene, { ...s.now, pins: [s.now.pins[0] + 1] }); });
    await page.getByText(`element ${last + 1}: irradiance`).waitFor();
    await settled(page);
    await page.waitForTimeout(200);
    assert.equal(adjoints, 3);
    await isFine(page);
    await page.context().close();
});

test("a store of a sky's tiles tells the sky's share", async () => {
    const page = await openReading({ scene: "tiles" });
    const element = await click(page, 0.53, 0.63);
    const { sky } = await lightsOf(page);
    const answer = await ask({ sky }, { select: { elements: [element] } }, "tiles");
    const figures = page.locator(".shares li .figures");
    await figures.first().waitFor();
    assert.equal(await figures.count(), 1);
    const [share, value] = (await figures.textContent()).split("·");
    assert.equal(share.trim(), "100 %");
    told(value, luminance(answer.radiosity.map((row) => row[0])));
    // Emission by group is none of such a store's.
    assert.deepEqual([...new Set(await page.locator('.pin tr[data-row="E"] td').allTextContents())], ["–"]);
    await isFine(page);
    await page.context().close();
});

test("groups, threshold and legend say what the answer says", async () => {
    const page = await openReading();
    await page.locator(".reading").getByLabel("Shows").selectOption("irradiance");
    await settled(page);
    const answer = (await ask(await lightsOf(page), { quantity: "irradiance" })).irradiance;
    const { groups, areas } = await page.evaluate(() => ({
        areas: [...window.lambert.scene.now.mesh.area], groups: window.lambert.scene.now.mesh.groups.map((g) => ({ name: g.name, elements: [...g.elements] })),
    }));
    const H = answer[0].map((_, i) => luminance(answer.map((row) => row[i])));
    const figures = ({ elements }) => {
        const area = elements.reduce((sum, i) => sum + areas[i], 0), mean = elements.reduce((sum, i) => sum + areas[i] * H[i], 0) / area;
        const values = elements.map((i) => H[i]);
        return { area, mean, min: Math.min(...values), max: Math.max(...values) };
    };
    await page.locator(".groups tbody tr").first().waitFor();
    for (const group of groups) {
        const cells = await page.locator(`.groups tr[data-group="${group.name}"] td`).allTextContents();
        const { mean, min, max } = figures(group);
        [mean, min, max].forEach((value, i) => told(cells[i], value));
        assert.ok(Math.abs(Number(cells[3]) - min / mean) < 0.006, `${group.name}: ${cells[3]}, it is ${min / mean}`);
    }
    const order = await page.locator(".groups tbody tr").evaluateAll((rows) => rows.map((row) => row.dataset.group));
    assert.deepEqual(order, [...groups].sort((a, b) => figures(b).mean - figures(a).mean).map((g) => g.name));
    await page.locator(".groups thead button", { hasText: "Group" }).click();
    assert.deepEqual(await page.locator(".groups tbody tr").evaluateAll((rows) => rows.map((row) => row.dataset.group)), groups.map((g) => g.name).sort());

    // The floor is judged, with a threshold between its values.
    await page.locator(".groups").getByRole("button", { name: "floor" }).click();
    assert.equal(await page.evaluate(() => window.lambert.store.now.view.judged), "floor");
    const floor = groups.find((g) => g.name === "floor"), { area, mean, min } = figures(floor);
    const sorted = floor.elements.map((i) => H[i]).sort((a, b) => a - b), middle = sorted[Math.floor(0.4 * sorted.length)] * 1.001;
    const level = Number(middle.toPrecision(4));
    await page.getByLabel("Judge by a threshold").check();
    await page.getByLabel("Threshold, target of the mean").fill(String(level));
    await page.keyboard.press("Enter");
    const reached = floor.elements.reduce((sum, i) => sum + (H[i] >= level ? areas[i] : 0), 0) / area;
    const verdict = await page.locator(".judge [role=status]").textContent();
    assert.ok(Math.abs(parseFloat(verdict) / 100 - reached) < 0.02, `${verdict}; it is ${reached}`);
    const rows = await page.locator(".judge tbody tr").allTextContents();
    told(rows[0].replace("Mean Em", ""), mean);
    assert.match(rows[0], mean >= level ? /✓ met/ : /✗ not met/);
    assert.match(rows[1], min / mean >= 0.6 ? /✓ met/ : /✗ not met/);
    await page.getByLabel("Task").selectOption({ label: "Corridor: 100 lx, U0 0.40" });
    assert.deepEqual(await page.evaluate(() => { const { view } = window.lambert.store.now; return [view.threshold, view.uniformity, view.judged]; }), [100, 0.4, "floor"]);
    await change(page, { threshold: null, judged: null });

    // The colour of the legend beside a number is the palette's at that number.
    await change(page, { range: [0, 200], isoLines: 0 });
    const { interpolateViridis } = await import(pathToFileURL(`${process.env.MODULES}/d3-scale-chromatic/dist/d3-scale-chromatic.mjs`));
    const ticks = await page.locator(".legend .ticks span").evaluateAll((spans) => {
        const ramp = document.querySelector(".legend canvas"), box = ramp.getBoundingClientRect();
        return spans.map((span) => {
            const { top, height } = span.getBoundingClientRect(), place = (top + height / 2 - box.top) / box.height;
            const row = Math.min(255, Math.max(0, Math.floor(place * 256)));
            return { text: span.textContent, colour: [...ramp.getContext("2d").getImageData(0, row, 1, 1).data].slice(0, 3) };
        });
    });
    assert.ok(ticks.length >= 3, JSON.stringify(ticks));
    for (const { text, colour } of ticks) {
        const wanted = interpolateViridis(Number(text) / 200).match(/[0-9a-f]{2}/g).map((hex) => parseInt(hex, 16));
        assert.ok(colour.every((c, i) => Math.abs(c - wanted[i]) <= 6), `${text}: ${colour} is not ${wanted}`);
    }
    await change(page, { isoLines: 4 });
    assert.deepEqual(await page.locator(".legend .ticks span").allTextContents(), ["50", "100", "150", "200"]);
    await isFine(page);
    await page.context().close();
});

test("a histogram's part that is dragged over becomes the range", async () => {
    const page = await openReading();
    await page.locator(".reading").getByLabel("Shows").selectOption("irradiance");
    await settled(page);
    const over = page.locator(".histogram .u-over");
    await over.scrollIntoViewIfNeeded();
    const box = await over.boundingBox();
    await page.mouse.move(box.x + box.width * 0.2, box.y + 40);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width * 0.4, box.y + 40, { steps: 4 });
    await page.mouse.move(box.x + box.width * 0.6, box.y + 40, { steps: 4 });
    await page.mouse.up();
    const { range, high } = await page.evaluate(() => ({ range: window.lambert.store.now.view.range, high: window.lambert.scene.exposure.spread.high * 1.15 }));
    assert.ok(range !== null && Math.abs(range[0] - 0.2 * high) < 0.02 * high && Math.abs(range[1] - 0.6 * high) < 0.02 * high, `${range} of ${high}`);
    await page.getByLabel("High end of the palette").fill("77");
    await page.keyboard.press("Enter");
    assert.equal(await page.evaluate(() => window.lambert.store.now.view.range[1]), 77);
    await page.getByRole("button", { name: "Auto" }).last().click();
    assert.equal(await page.evaluate(() => window.lambert.store.now.view.range), null);
    await isFine(page);
    await page.context().close();
});

test("keys and fingers read too, and a link keeps the pins", async () => {
    const page = await openReading();
    await page.locator("main canvas").first().focus();
    await page.keyboard.press("r");
    const eye = await page.evaluate(() => window.lambert.scene.cameras.now);
    for (let i = 0; i < 4; i++) await page.keyboard.press("ArrowDown");
    await page.keyboard.press("Shift+ArrowLeft");
    await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))));
    assert.match(await page.locator("main [role=status].unseen").textContent(), /W\/m² · .*, element \d+/);
    await page.keyboard.press("Enter");
    const pins = await page.evaluate(() => window.lambert.store.now.pins);
    assert.equal(pins.length, 1);
    assert.equal(pins[0], await page.evaluate(() => window.lambert.scene.hovered));
    assert.deepEqual(await page.evaluate(() => window.lambert.scene.cameras.now), eye);
    await page.keyboard.press("Escape");
    assert.ok(await page.locator(".cross").isHidden());
    await page.waitForTimeout(800);
    const hash = await page.evaluate(() => location.hash);
    const other = await openPage(daemon.address, { hash, width: 360, height: 740, touch: true });
    assert.deepEqual(await other.evaluate(() => window.lambert.store.now.pins), pins);
    await other.getByRole("tab", { name: "Reading" }).tap();
    await other.locator(".pins > *").first().waitFor();
    const canvas = await other.locator("main canvas").first().boundingBox();
    const tapped = await elementAt(other, 0.53, 0.63);
    await other.touchscreen.tap(canvas.x + 0.53 * canvas.width, canvas.y + 0.63 * canvas.height);
    await other.waitForFunction((element) => window.lambert.store.now.pins.includes(element) && window.lambert.store.now.pins.length === 1, tapped);
    assert.ok(await other.evaluate(() => document.documentElement.scrollWidth <= 360));
    await change(other, { picture: "false", threshold: 100, isoLines: 6 });
    await settled(other);
    for (const theme of ["dark", "light"]) {
        await other.evaluate((t) => { document.documentElement.dataset.theme = t; }, theme);
        assert.deepEqual(await violations(other), [], theme);
    }
    assert.deepEqual([...page.faults, ...other.faults], []);
    await other.context().close();
    await page.context().close();
});

test("lamps, skies and readings are in the unit of the store, whatever a link says", async () => {
    for (const [scene, unit, lamp, strength] of [["yard", "W/m²", "W/m²", 100], ["lumens", "lx", "lm/m²", 10000]]) {
        const odd = { scene, view: { unit: unit === "lx" ? "W/m²" : "lx" } };
        const page = await openPage(daemon.address, { hash: "#1." + Buffer.from(JSON.stringify(odd)).toString("base64url") });
        await settled(page);
        assert.equal(await page.evaluate(() => window.lambert.store.now.view.unit), unit);
        assert.equal(await page.evaluate(() => window.lambert.store.now.lighting.sky.strength), strength);
        await page.getByRole("tab", { name: "View" }).click();
        await page.getByText(unit === "lx" ? "The store counts in lm" : "The store counts in W").waitFor();
        await page.getByRole("tab", { name: "Lights" }).click();
        await page.locator(".unit:visible", { hasText: lamp }).first().waitFor();
        await page.getByRole("tab", { name: "Sky" }).click();
        await page.locator(".unit:visible", { hasText: unit }).first().waitFor();
        // Light that falls on a surface is in lx; light that leaves one is not, whatever part of the page says so.
        await page.getByRole("tab", { name: "Reading" }).click();
        await page.evaluate(() => {
            const { store } = window.lambert;
            store.change({ ...store.now, pins: [0] });
        });
        for (const quantity of ["radiosity", "irradiance", "indirect"]) {
            const word = quantity === "irradiance" ? unit : lamp;
            await page.evaluate((wanted) => {
                const { store } = window.lambert, { now } = store;
                store.change({ ...now, view: { ...now.view, picture: "false", quantity: wanted } });
            }, quantity);
            await settled(page);
            await page.getByText(`Groups: ${quantity}, ${word}`).waitFor();
            await page.getByText(`Spread over the area of all groups, ${word}`).waitFor();
            assert.match(await page.locator(".legend").getAttribute("aria-label"), new RegExp(`, ${word}, from `));
            assert.deepEqual(await page.locator('.pin[data-pin="0"] tr small').allTextContents(), [lamp, unit, lamp]);
            await page.getByRole("tab", { name: "Export" }).click();
            const coming = page.waitForEvent("download");
            await page.getByRole("button", { name: "Save CSV" }).click();
            const csv = readFileSync(await (await coming).path(), "utf8").split("\r\n")[0];
            assert.ok(csv.includes(`${quantity}${scene === "yard" ? "_red" : ""}`) && csv.endsWith(` (${word})`), csv);
            await page.getByRole("tab", { name: "Reading" }).click();
        }
        await isFine(page);
        await page.context().close();
    }
});
