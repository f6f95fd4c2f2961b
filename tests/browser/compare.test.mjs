// Scenes side by side: what can be compared is, whatever its tiles of the sky; of what cannot the page says why, and asks nothing.
import assert from "node:assert/strict";
import { before, test } from "node:test";
import { Daemon, inFolder, lambert, makeStore, openPage, settled, violations } from "./page.mjs";

const DRAFT = ["--probes", 0, "--rays", 256];

let daemon;
before(async () => {
    const fine = makeStore("fine", "patio", { generate: ["--elements", 200], precompute: [...DRAFT, "--sky", "reinhart:2"] });
    const stores = [fine];
    for (const [name, options] of [["coarse", ["--sky", "tregenza"]], ["closed", []], ["other", ["--elements", 2000]]]) {
        lambert("precompute", inFolder("fine.obj"), "-o", inFolder(`${name}.h5`), "--quiet", ...DRAFT, ...options);
        stores.push(`${inFolder(`${name}.h5`)}:${name}`);
    }
    daemon = await Daemon.start(stores);
});

/** Scenes that the page asks radiosity of. */
function watched(page) {
    const asked = new Set();
    page.on("request", (request) => {
        const found = /\/v1\/scenes\/([^/]+)\/radiosity/.exec(request.url());
        if (found) asked.add(found[1]);
    });
    return asked;
}

const figure = (page) => page.evaluate(() => {
    const mean = (field, area) => field.values.reduce((sum, v, i) => sum + v * area[i], 0);
    const { fields, now: { mesh: { area } } } = window.lambert.scene;
    return { ratio: mean(fields[1], area) / mean(fields[0], area), problem: window.lambert.tell.problem };
});

test("another tiling of the sky has the same sky", async () => {
    const page = await openPage(daemon.address);
    await page.getByRole("combobox", { name: "Scene" }).selectOption("fine");
    await settled(page);
    await page.evaluate(() => {
        const { store: s } = window.lambert;
        s.change({ ...s.now, lighting: { ...s.now.lighting, sky: { ...s.now.lighting.sky, model: "even" } } });
    });
    await page.getByRole("tab", { name: "Compare" }).click();
    assert.ok((await page.getByText("Not offered").textContent()).includes("other"));
    await page.getByLabel("B is").selectOption("s:coarse");
    await page.waitForFunction(() => window.lambert.scene.fields[1] !== null);
    await settled(page);
    const { ratio, problem } = await figure(page);
    assert.equal(problem, null);
    // An even sky lights alike whatever its tiles: what differs is the noise of the rays to each.
    assert.ok(Math.abs(ratio - 1) < 0.05, `the means are as ${ratio}`);
    // A link has it, too.
    await page.waitForTimeout(500);
    const other = await openPage(daemon.address, { hash: await page.evaluate(() => location.hash) });
    await other.waitForFunction(() => window.lambert.scene.fields[1] !== null);
    await settled(other);
    assert.ok(Math.abs((await figure(other)).ratio - ratio) < 1e-6);
    await other.context().close();
    const asked = watched(page);
    await page.getByLabel("B is").selectOption("s:closed");
    await page.getByText("Only one of fine and closed has a sky").waitFor();
    assert.equal(await page.getByLabel("B is").inputValue(), "s:coarse");
    assert.ok(!asked.has("closed"));
    assert.deepEqual(await violations(page), []);
    assert.deepEqual(page.faults, []);
    await page.context().close();
});

test("a link to what cannot be compared says so and asks nothing", async () => {
    for (const [scene, sentence] of [["other", /has [\d,]+ elements and fine [\d,]+: another mesh/], ["closed", /Only one of/], ["palace", /palace cannot be compared: /]]) {
        const hash = "#1." + Buffer.from(JSON.stringify({ scene: "fine", compare: { how: "split", scene, lighting: null, split: 0.5 } })).toString("base64url");
        const page = await openPage(daemon.address, { hash, wait: false }), asked = watched(page);
        await page.locator("#panel-compare [role=status]").filter({ hasText: sentence }).waitFor({ state: "attached" });
        await settled(page);
        assert.equal(await page.evaluate(() => window.lambert.store.now.compare), null);
        assert.ok(!asked.has(scene));
        await page.getByRole("tab", { name: "Compare" }).click();
        await page.getByText(sentence).waitFor();
        assert.deepEqual(page.faults, []);
        await page.context().close();
    }
});
