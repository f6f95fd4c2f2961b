// Odd circumstances: narrow windows, links of strangers, slow networks, a daemon that is away, stores that are replaced.
import assert from "node:assert/strict";
import { copyFileSync, renameSync, writeFileSync } from "node:fs";
import { createServer, request } from "node:http";
import { before, test } from "node:test";
import { PATIENCE, Daemon, inFolder, lambert, makeStore, openPage, settled, violations } from "./page.mjs";

let cornell, patio, few, daemon;
before(async () => {
    cornell = makeStore("cornell", "cornell", { generate: ["--elements", 300], precompute: ["--probes", 0] });
    patio = makeStore("patio", "patio", { generate: ["--elements", 300], precompute: ["--probes", 0, "--rays", 128, "--sky", "tregenza"] });
    few = makeStore("few", "cornell", { generate: ["--elements", 300], precompute: ["--probes", 0, "--emitters", "group=lamp"] });
    daemon = await Daemon.start([cornell, patio, few]);
});

const linkOf = (state) => `#1.${Buffer.from(JSON.stringify(state)).toString("base64url")}`;
const sceneNow = (page) => page.evaluate(() => [window.lambert.store.now.scene, window.lambert.scene.now.mesh.elements]);
const dim = (page, factor) => page.evaluate((f) => {
    const { store } = window.lambert, { now } = store;
    store.change({ ...now, lighting: { ...now.lighting, dim: now.lighting.dim * f } });
}, factor);

test("a phone's picture grows when the panels are folded, under one row of controls", async () => {
    const page = await openPage(daemon.address, { width: 360, height: 640, touch: true });
    const height = async () => (await page.locator("main canvas").first().boundingBox()).height;
    const open = await height(), bar = await page.locator("header").boundingBox();
    await page.getByRole("button", { name: "Fold the panels" }).tap();
    const folded = await height();
    assert.ok(bar.height < 50 && open > 230 && folded > open + 150, `${bar.height}, ${open}, ${folded}`);
    assert.deepEqual(await violations(page), []);
    await page.getByRole("button", { name: "Fold the panels" }).tap();
    assert.equal(await height(), open);
    await page.getByRole("combobox", { name: "Scene" }).selectOption("patio");
    await settled(page);
    assert.equal((await sceneNow(page))[0], "patio");
    assert.deepEqual(page.faults, []);
    await page.context().close();
});

test("the panel of the lights is shown first, and the tabs take two rows", async () => {
    const page = await openPage(daemon.address), rows = [];
    for (const [name, panel] of [["few", "Emitters"], ["patio", "Lights"], ["cornell", "Lights"]]) {
        await page.getByRole("combobox", { name: "Scene" }).selectOption(name);
        await page.getByRole("tab", { name: panel, selected: true }).waitFor();
        await settled(page);
        rows.push((await page.getByRole("tablist").boundingBox()).height);
    }
    assert.ok(Math.max(...rows) < 90, `${rows}`);
    // A panel that a person chose stays.
    await page.getByRole("tab", { name: "View" }).click();
    await page.getByRole("combobox", { name: "Scene" }).selectOption("few");
    await settled(page);
    assert.equal(await page.getByRole("tab", { name: "View" }).getAttribute("aria-selected"), "true");
    await page.context().close();
});

test("links with names and numbers that there are not are shown without faults", async () => {
    const odd = { picture: "false", quantity: "colour", palette: "constructor", tone: "toString", unit: "lumen", isoLines: 1e9, exposure: 1e9, uniformity: -1, range: [5, 1] };
    const page = await openPage(daemon.address, { hash: linkOf({
        scene: "cornell", view: odd, lighting: { dim: 1e300, groups: { lamp: { power: 1e300 }, "no such": { power: 2 } }, emitters: { 0: 1e300, 99: 1 } }, compare: { scene: "patio" },
    }) });
    assert.deepEqual(page.faults, []);
    await page.context().close();
    for (const hash of ["#1.%%%", "#top", linkOf([])]) {
        const other = await openPage(daemon.address, { hash });
        await other.getByText("This link cannot be read; this is").waitFor();
        assert.deepEqual(await violations(other), []);
        await other.getByRole("button", { name: "Close this note" }).click();
        await other.getByText("This link cannot be read").waitFor({ state: "hidden" });
        await dim(other, 0.5);
        await settled(other);
        assert.equal(await other.getByText("This link cannot be read").isVisible(), false);
        await other.context().close();
    }
});

test("a scene that is long on its way is told of, and one that is not there leaves the other", async () => {
    const page = await openPage(daemon.address, { wait: false, before: (p) => p.route(/\/v1\//, async (route) => {
        await new Promise((resolve) => setTimeout(resolve, 1200));
        await route.continue().catch(() => undefined);
    }) });
    await page.getByText(/^Loading the scene …$/).waitFor();
    await page.getByText(/^Loading cornell …$/).waitFor();
    // Nothing is offered that this scene may not have.
    for (const name of ["Undo (Ctrl+Z)", "Redo (Ctrl+Y)"]) assert.ok(await page.getByRole("button", { name }).isDisabled(), name);
    assert.deepEqual(await page.getByRole("tab").allInnerTexts(), ["Lights", "View", "Reading", "Trust", "Compare", "Materials", "Export"]);
    assert.equal(await page.getByRole("button", { name: "All off" }).isVisible(), false);
    await settled(page);
    await page.getByText(/^Loading/).waitFor({ state: "hidden" });
    await page.getByRole("combobox", { name: "Scene" }).selectOption("patio");
    await page.getByText(/^Loading patio …$/).waitFor();
    await page.getByText(/^Loading/).waitFor({ state: "hidden" });
    assert.equal((await sceneNow(page))[0], "patio");
    await page.unroute(/\/v1\//);
    await page.route(/\/v1\/scenes\/cornell/, (route) => route.fulfill({ status: 404, contentType: "application/problem+json", body: '{"detail":"there is no scene cornell"}' }));
    await page.getByRole("combobox", { name: "Scene" }).selectOption("cornell");
    await page.getByText("there is no scene cornell").waitFor();
    assert.equal(await page.getByRole("combobox", { name: "Scene" }).inputValue(), "patio");
    assert.equal((await sceneNow(page))[0], "patio");
    assert.deepEqual(page.faults, []);
    await page.context().close();
});

test("a scene that is chosen while the daemon is away is opened when it is back", async () => {
    const own = await Daemon.start([cornell, patio]), page = await openPage(own.address), { port } = own;
    await page.getByRole("tab", { name: "Trust" }).click();
    await own.stop("SIGKILL");
    await page.getByRole("combobox", { name: "Scene" }).selectOption("patio");
    await page.getByText("The daemon does not answer. This page asks again").waitFor();
    const again = await Daemon.start([cornell, patio], { port });
    await page.waitForFunction(() => window.lambert.store.now.scene === "patio");
    await settled(page);
    assert.equal(await page.getByRole("combobox", { name: "Scene" }).inputValue(), "patio");
    await page.getByText("The daemon does not answer. This page asks again").waitFor({ state: "hidden" });
    assert.deepEqual(page.faults, []);
    await page.context().close();
    await again.stop();
});

test("a store that is replaced is shown as it is now, and one that is gone is told of", async () => {
    const place = (from) => {
        copyFileSync(from, inFolder("live.new"));
        renameSync(inFolder("live.new"), inFolder("live.h5"));
    };
    place(cornell);
    const own = await Daemon.start([`${inFolder("live.h5")}:live`, few]), page = await openPage(own.address);
    await page.evaluate(() => window.lambert.ask.open("live", null));
    await settled(page);
    const replace = async (store) => {
        place(store);
        const { created } = (await own.json("/v1/scenes/live")).provenance;
        own.process.kill("SIGHUP");
        for (let i = 0; i < PATIENCE / 100 && (await own.json("/v1/scenes/live")).provenance.created === created; i++) await new Promise((resolve) => setTimeout(resolve, 100));
    };
    // The same mesh, built otherwise: answers have as many numbers, and the state is kept.
    await new Promise((resolve) => setTimeout(resolve, 1100));
    lambert("precompute", inFolder("cornell.obj"), "-o", inFolder("coarse.h5"), "--quiet", "--probes", 0, "--epsilon", 0.2);
    await replace(inFolder("coarse.h5"));
    await dim(page, 0.5);
    await page.getByText("The store of live was replaced").waitFor();
    await settled(page);
    assert.equal(await page.evaluate(() => window.lambert.store.now.lighting.dim), 0.5);
    // Another scene: its own lamps, and the whole of it is seen.
    await replace(patio);
    await dim(page, 0.5);
    await page.waitForFunction(() => window.lambert.scene.now.mesh.groups.some((group) => group.name === "pillar"));
    await settled(page);
    assert.deepEqual(await sceneNow(page), ["live", (await own.json("/v1/scenes/live")).elements]);
    await page.getByRole("tab", { name: "Sky" }).waitFor();
    assert.equal(await page.evaluate(() => window.lambert.store.now.lighting.dim), 1);
    await page.route(/\/v1\/scenes\/live/, (route) => route.fulfill({ status: 404, contentType: "application/problem+json", body: '{"detail":"there is no scene live"}' }));
    await dim(page, 0.5);
    await page.getByText("The daemon serves live no more").waitFor();
    assert.deepEqual(page.faults, []);
    await page.context().close();
    await own.stop();
});

/** A floor under many lamps, some of which have odd names. */
function manyLamps(names) {
    const lines = ["mtllib many.mtl"];
    let vertices = 0;
    const square = (x, y, z, size, isDown) => {
        const corners = [[0, 0], [1, 0], [1, 1], [0, 1]];
        for (const [u, v] of isDown ? corners.reverse() : corners) lines.push(`v ${x + u * size} ${y + v * size} ${z}`);
        lines.push(`f ${[1, 2, 3, 4].map((k) => vertices + k).join(" ")}`);
        vertices += 4;
    };
    lines.push("g floor", "usemtl grey");
    square(0, 0, 0, 12, false);
    names.forEach((name, k) => {
        lines.push(`g ${name}`, "usemtl blue");
        square((k % 12) + 0.4, Math.floor(k / 12) + 0.4, 2.5, 0.2, true);
    });
    return `${lines.join("\n")}\n`;
}

test("many lamps with odd names are found, and fit", async () => {
    const names = ["<b>bold</b>", `a-long-${"x".repeat(90)}`, "lamp&amp;", "日本の灯", ...Array.from({ length: 56 }, (_, k) => `desk-${k + 1}`)];
    writeFileSync(inFolder("many.mtl"), "newmtl grey\nKd .5 .5 .5\nnewmtl blue\nKd .1 .1 .1\nKe 10 10 90\n");
    writeFileSync(inFolder("many.obj"), manyLamps(names));
    lambert("precompute", inFolder("many.obj"), "-o", inFolder("many.h5"), "--quiet", "--probes", 0);
    const own = await Daemon.start([`${inFolder("many.h5")}:<i>many & "odd"`]), page = await openPage(own.address, { width: 360, height: 740, touch: true });
    const rows = page.locator(".light"), on = () => page.evaluate(() => Object.entries(window.lambert.store.now.lighting.groups).filter(([, light]) => light.on).map(([name]) => name).sort());
    assert.equal(await rows.count(), 40);
    assert.equal(await page.locator(".light b").count(), 0);
    await page.getByText("20 more: name a part of theirs above.").waitFor();
    const filter = page.getByLabel("Show lamps whose names have");
    await filter.fill("DESK-5");
    assert.equal(await rows.count(), 8);
    await page.getByRole("button", { name: "All off" }).tap();
    await settled(page);
    assert.equal((await on()).length, 52);
    await filter.fill("");
    await page.getByRole("button", { name: "All off" }).tap();
    await filter.fill("desk-7");
    await page.getByRole("button", { name: "All on" }).tap();
    await settled(page);
    assert.deepEqual(await on(), ["desk-7"]);
    // A lamp whose colour was not chosen by a temperature has none.
    const kelvin = rows.first().getByRole("spinbutton", { name: "Temperature in K" });
    assert.deepEqual([await kelvin.inputValue(), await kelvin.getAttribute("placeholder")], ["", "own"]);
    await kelvin.fill("3000");
    await page.keyboard.press("Enter");
    assert.equal(await page.evaluate(() => window.lambert.store.now.lighting.groups["desk-7"].kelvin), 3000);
    // A comma is the point of a number, not nothing.
    const strength = rows.first().getByRole("spinbutton").first();
    await strength.fill("");
    await strength.pressSequentially("12,5");
    await page.keyboard.press("Enter");
    assert.deepEqual([await strength.inputValue(), await page.evaluate(() => window.lambert.store.now.lighting.groups["desk-7"].power)], ["12.5", 12.5]);
    await filter.fill("");
    for (const tab of await page.getByRole("tab").all()) {
        if (!(await tab.isVisible())) continue;
        await tab.tap();
        const wide = await page.evaluate(() => [...document.querySelectorAll("[role=tabpanel]:not([hidden]), [role=tabpanel]:not([hidden]) :is(fieldset, legend, .light)")].map((e) => e.getBoundingClientRect().right));
        assert.ok(Math.max(...wide) <= 361, `${await tab.textContent()}: ${Math.max(...wide)}`);
    }
    assert.deepEqual(await violations(page), []);
    assert.deepEqual(page.faults, []);
    await page.context().close();
    await own.stop();
});

/** A proxy as nginx is by `location /light/ { proxy_pass http://127.0.0.1:PORT/; }`: it writes a Host of its own. */
async function proxyBelow(path, port) {
    const server = createServer((asked, answer) => {
        if (!asked.url.startsWith(path)) return void answer.writeHead(404).end();
        const options = { port, method: asked.method, path: asked.url.slice(path.length - 1),
            headers: { ...asked.headers, host: `127.0.0.1:${port}` } };
        asked.pipe(request(options, (got) => got.pipe(answer.writeHead(got.statusCode, got.headers))));
    });
    await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
    return server;
}

test("the page stands below a path of a proxy", async () => {
    const server = await proxyBelow("/light/", daemon.port);
    const page = await openPage(`http://127.0.0.1:${server.address().port}/light`);
    assert.equal(await page.title(), "cornell · Lambert");
    await page.getByRole("combobox", { name: "Scene" }).selectOption("patio");
    await settled(page);
    assert.equal((await sceneNow(page))[0], "patio");
    // Faults are requests to other addresses, those outside the path among them.
    assert.deepEqual(page.faults, []);
    await page.context().close();
    server.closeAllConnections();
    server.close();
});
