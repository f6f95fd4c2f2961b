// What leaves the page (pictures, numbers, requests) and the variants that it makes agree with the daemon's own answers.
import assert from "node:assert/strict";
import { execFile } from "node:child_process";
import { readFileSync, writeFileSync } from "node:fs";
import { before, test } from "node:test";
import { promisify } from "node:util";
import { Daemon, inFolder, lambert, makeStore, openPage, settled, violations } from "./page.mjs";

const run = promisify(execFile);
/** Names that shells, Python and CSV have to take as they are. */
const SCENE = `it's “ä” $x`, LAMP = `la'mp,"$(id)\`ü\``;
let daemon, made;
before(async () => {
    makeStore("box", "cornell", { generate: ["--elements", 300], precompute: ["--probes", 2, "--method", "low-rank", "--keep-factors"] });
    const text = readFileSync(inFolder("box.obj"), "utf8");
    assert.ok(text.includes("\no lamp\n"));
    writeFileSync(inFolder("odd.obj"), text.replace("\no lamp\n", () => `\no ${LAMP}\n`));
    lambert("precompute", inFolder("odd.obj"), "-o", inFolder("odd.h5"), "--quiet", "--probes", 2, "--method", "exact");
    daemon = await Daemon.start([`${inFolder("odd.h5")}:${SCENE}`, inFolder("box.h5")]);
    made = `/v1/scenes/${encodeURIComponent(SCENE)}/radiosity`;
});

const lampOf = (page) => page.evaluate(() => {
    const { lighting } = window.lambert.store.now;
    return Object.fromEntries(Object.entries(lighting.groups).map(([name, l]) => [name, l.colour.map((c) => Number((c * l.power * lighting.dim).toPrecision(12)))]));
});
const openTab = (page, name) => page.getByRole("tab", { name }).click();
const change = (page, part, to) => page.evaluate(([where, what]) => {
    const { store: s } = window.lambert;
    s.change({ ...s.now, [where]: { ...s.now[where], ...what } });
}, [part, to]);

async function openOdd() {
    const page = await openPage(daemon.address);
    if (await page.evaluate(() => window.lambert.store.now.scene) !== SCENE) {
        await page.locator("header select").selectOption(SCENE);
        await page.waitForFunction((name) => window.lambert.store.now.scene === name && window.lambert.scene.fields[0] !== null, SCENE);
        await settled(page);
    }
    await openTab(page, "Export");
    return page;
}

async function saved(page, name) {
    const [file] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name }).click()]);
    return { name: file.suggestedFilename(), bytes: readFileSync(await file.path()) };
}

test("the command and the program give the numbers shown", async () => {
    const page = await openOdd();
    await change(page, "lighting", { dim: 0.7 });
    await settled(page);
    for (const quantity of ["radiosity", "irradiance"]) {
        if (quantity === "irradiance") await change(page, "view", { picture: "false", quantity });
        await settled(page);
        const own = await daemon.json(made, { emission: { groups: await lampOf(page) }, quantity });
        const command = await page.getByLabel("Command of curl").inputValue(), program = await page.getByLabel("Program in Python").inputValue();
        assert.ok(command.includes(`"quantity":"${quantity}"`), command);
        writeFileSync(inFolder("asks.py"), program);
        assert.deepEqual(JSON.parse((await run("sh", ["-c", command])).stdout)[quantity], own[quantity]);
        assert.deepEqual(JSON.parse((await run("python3", [inFolder("asks.py")])).stdout), own[quantity]);
        const shown = await page.evaluate(() => [0, 7, 100].map((element) => window.lambert.scene.fields[0].at(element)));
        [0, 7, 100].forEach((element, k) => shown[k].forEach((v, c) => assert.ok(Math.abs(v - own[quantity][c][element]) <= 2 ** -11 * v, `${v}`)));
    }
    await page.getByRole("button", { name: "Copy" }).first().click();
    assert.equal(await page.evaluate(() => navigator.clipboard.readText()), await page.getByLabel("Command of curl").inputValue());
    // A token is not copied.
    await page.evaluate(() => { sessionStorage.setItem("lambert-token", "secret"); });
    await change(page, "lighting", { dim: 0.5 });
    for (const text of await page.locator("textarea").evaluateAll((all) => all.map((t) => t.value)))
        assert.ok(text.includes("LAMBERT_TOKEN") && !text.includes("secret"), text);
    assert.deepEqual(page.faults, []);
    assert.deepEqual(await violations(page), []);
    await page.context().close();
});

test("CSV and NPY are the daemon's numbers in single precision", async () => {
    const page = await openOdd();
    const own = (await daemon.json(made, { emission: { groups: await lampOf(page) } })).radiosity;
    const csv = await saved(page, "Save CSV"), lines = csv.bytes.toString("utf8").trim().split("\r\n");
    assert.match(csv.name, /^it-s.*ä.*\.csv$/);
    assert.equal(lines[0], "element,group,area_m2,radiosity_red (W/m²),radiosity_green (W/m²),radiosity_blue (W/m²)");
    assert.equal(lines.length - 1, own[0].length);
    let area = 0, lamps = 0;
    lines.slice(1).forEach((line, i) => {
        const [, element, group, A, ...values] = /^(\d+),("(?:[^"]|"")*"|[^",]*),([^,]+),([^,]+),([^,]+),([^,]+)$/.exec(line);
        assert.equal(Number(element), i);
        if (group === `"${LAMP.replaceAll('"', '""')}"`) lamps += 1;
        area += Number(A);
        assert.deepEqual(values.map((v) => Math.fround(Number(v))), own.map((channel) => Math.fround(channel[i])));
    });
    assert.ok(lamps > 0);
    const whole = await page.evaluate(() => window.lambert.scene.now.mesh.groups.reduce((sum, group) => sum + group.area, 0));
    assert.ok(Math.abs(area - whole) < 1e-5 * whole);
    const npy = await saved(page, "Save NPY");
    const head = 10 + npy.bytes.readUInt16LE(8), text = npy.bytes.toString("latin1", 10, head);
    assert.match(text, new RegExp(`'descr': *'<f4'.*'shape': *\\(3, *${own[0].length}\\)`));
    const read = Array.from({ length: (npy.bytes.length - head) / 4 }, (_, k) => npy.bytes.readFloatLE(head + 4 * k));
    assert.deepEqual(read, own.flat().map(Math.fround));
    assert.deepEqual(page.faults, []);
    await page.context().close();
});

test("a picture of any size, in parts, with a legend", async () => {
    const page = await openOdd();
    await change(page, "view", { smooth: false, tone: "linear", exposure: -5 });
    await settled(page);
    const before = await page.evaluate(() => [window.lambert.scene.stage.canvas.width, window.lambert.scene.stage.canvas.height]);
    await page.getByLabel("Width in pixels").fill("3000");
    await page.getByLabel("Height in pixels").fill("2200");
    const first = await saved(page, "Save PNG");
    assert.deepEqual([first.bytes.readUInt32BE(16), first.bytes.readUInt32BE(20)], [3000, 2200]);
    assert.deepEqual(await page.evaluate(() => [window.lambert.scene.stage.canvas.width, window.lambert.scene.stage.canvas.height]), before);
    const places = [[0.5, 0.9], [0.3, 0.4], [0.7, 0.5], [0.6, 0.93]];
    const read = (bytes, at) => page.evaluate(async ([text, points]) => {
        const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))]));
        const canvas = new OffscreenCanvas(bitmap.width, bitmap.height), context = canvas.getContext("2d");
        context.drawImage(bitmap, 0, 0);
        return points.map(([x, y]) => [...context.getImageData(Math.floor(x * bitmap.width), Math.floor(y * bitmap.height), 1, 1).data.slice(0, 3)]);
    }, [bytes.toString("base64"), at]);
    const elements = await page.evaluate((points) => {
        const { now: scene, stage, cameras: { camera } } = window.lambert.scene;
        camera.aspect = 3000 / 2200;
        camera.updateProjectionMatrix();
        camera.updateMatrixWorld();
        const out = points.map(([x, y]) => scene.picker.at(2 * x - 1, 1 - 2 * y, camera));
        stage.resize();
        return out;
    }, places);
    const own = (await daemon.json(made, { emission: { groups: await lampOf(page) } })).radiosity;
    (await read(first.bytes, places)).forEach((colour, k) => {
        const wanted = own.map((channel) => Math.min(1, channel[elements[k]] / 32)).map((v) => 255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055));
        colour.forEach((v, c) => assert.ok(Math.abs(v - wanted[c]) <= 2, `${v} for ${wanted[c]} at ${places[k]}`));
    });
    // The legend's ramp ends in the last colour of viridis, #fde725.
    await change(page, "view", { picture: "false", range: [0, 20] });
    await settled(page);
    await page.getByLabel("With a legend of colours").check();
    const second = await saved(page, "Save PNG"), unit = Math.min(3000 / 40, 2200 / 28);
    const [end] = await read(second.bytes, [[(2 * unit + 16 * unit - 4) / 3000, (2200 - 5.2 * unit + 1.9 * unit) / 2200]]);
    [253, 231, 37].forEach((v, c) => assert.ok(Math.abs(v - end[c]) <= 3, `${end}`));
    await page.getByLabel("Width in pixels").fill("9000");
    await page.getByRole("button", { name: "Save PNG" }).click();
    await page.getByText("16 to 8192 pixels").waitFor();
    assert.deepEqual(page.faults, []);
    await page.context().close();
});

async function withToken(address, token) {
    const page = await openPage(address, { wait: false });
    await page.getByLabel("Token", { exact: true }).fill(token);
    await page.keyboard.press("Enter");
    await settled(page);
    await openTab(page, "Materials");
    return page;
}

async function make(page, red) {
    await page.getByLabel("floor: red").fill(red);
    await page.getByRole("button", { name: "Make variant" }).click();
}

test("colours make a variant, which is opened, compared and deleted", async () => {
    writeFileSync(inFolder("tokens"), "writer read vary\nreader read\n", { mode: 0o600 });
    const own = await Daemon.start([inFolder("box.h5")], { options: ["--token-file", inFolder("tokens"), "--max-variants", 1] });
    const page = await withToken(own.address, "writer"), said = page.locator("#panel-materials [role=status]");
    await make(page, "1");
    await said.getByText("below 1; floor has 1").waitFor();
    await page.getByLabel("Name of the variant").fill("bleu-“é”");
    await make(page, "0.1");
    await said.getByText("is ready").waitFor();
    const row = page.getByRole("group", { name: "box@bleu-“é”" });
    await row.getByRole("button", { name: "Compare" }).click();
    await page.waitForFunction(() => window.lambert.scene.fields[1] !== null && window.lambert.ask.isIdle);
    const ask = async (scene) => (await fetch(`${own.address}/v1/scenes/${encodeURIComponent(scene)}/radiosity`, {
        method: "POST", headers: { "Content-Type": "application/json", Authorization: "Bearer writer" },
        body: JSON.stringify({ emission: { groups: await lampOf(page) } }),
    })).json();
    const [plain, varied] = [(await ask("box")).radiosity, (await ask("box@bleu-“é”")).radiosity];
    const floor = await page.evaluate(() => window.lambert.scene.now.mesh.groups.find((g) => g.name === "floor").elements[3]);
    const shown = await page.evaluate((i) => window.lambert.scene.fields.map((field) => field.at(i)[0]), floor);
    [plain[0][floor], varied[0][floor]].forEach((v, k) => assert.ok(Math.abs(shown[k] - v) <= 2 ** -10 * v, `${shown[k]} for ${v}`));
    assert.ok(varied[0][floor] < 0.3 * plain[0][floor]);
    await row.getByRole("button", { name: "Open" }).click();
    await page.waitForFunction(() => window.lambert.store.now.scene.includes("@") && window.lambert.scene.fields[0] !== null);
    assert.equal(Number(await page.getByLabel("floor: red").inputValue()), 0.1);
    await page.getByLabel("Name of the variant").fill("other");
    await make(page, "0.2");
    await said.getByText("as many variants as the daemon keeps").waitFor();
    assert.deepEqual(await violations(page), []);
    await row.getByRole("button", { name: "Delete" }).click();
    await said.getByText("is gone").waitFor();
    assert.equal(await page.evaluate(() => window.lambert.store.now.scene), "box");
    assert.deepEqual(page.faults, []);
    await page.context().close();
    const reader = await withToken(own.address, "reader");
    await make(reader, "0.3");
    await reader.getByText("This daemon does not allow that").waitFor();
    await reader.context().close();
    await own.stop();
});

test("refusals of variants are told in words", async () => {
    const page = await openPage(daemon.address);
    await page.locator("header select").selectOption("box");
    await page.waitForFunction(() => window.lambert.store.now.scene === "box" && window.lambert.scene.fields[0] !== null);
    await openTab(page, "Materials");
    await make(page, "0.3");
    await page.getByText(/does not allow that: .*--max-variants/).waitFor();
    assert.deepEqual(page.faults, []);
    await page.context().close();
    const own = await Daemon.start([`${inFolder("odd.h5")}:odd`], { options: ["--token-file", inFolder("tokens"), "--max-variants", 1] });
    const other = await withToken(own.address, "writer");
    await make(other, "0.3");
    await other.getByText(/cannot have variants: .*--keep-factors/).waitFor();
    await other.context().close();
    await own.stop();
});
