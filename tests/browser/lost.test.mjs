// A graphics context that is lost and comes back: the picture is what it was, and nothing of the lost one is touched again.
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { test } from "node:test";
import { Daemon, inFolder, makeStore, openPage, settled } from "./page.mjs";

const SKY = { model: "given", direct: 700, diffuse: 100, latitude: 20, longitude: 0, zone: 0, day: 80, hour: 14 };

/** Each call that leaves an error behind is kept, with its number. */
const watchCalls = (page) => page.evaluate(() => {
    const gl = window.lambert.scene.stage.renderer.getContext(), names = new Set();
    for (let of = gl; of !== Object.prototype; of = Object.getPrototypeOf(of))
        for (const name of Object.getOwnPropertyNames(of)) if (typeof Object.getOwnPropertyDescriptor(of, name).value === "function") names.add(name);
    window.wrong = [];
    for (const name of names) {
        if (["constructor", "getError", "isContextLost"].includes(name)) continue;
        gl[name] = (...args) => {
            const out = Object.getPrototypeOf(gl)[name].apply(gl, args), error = gl.getError();
            if (error !== gl.NO_ERROR && error !== gl.CONTEXT_LOST_WEBGL) window.wrong.push(`${name}: ${error}`);
            return out;
        };
    }
});

const lose = (page) => page.evaluate(async () => {
    const { canvas, renderer } = window.lambert.scene.stage, ext = renderer.getContext().getExtension("WEBGL_lose_context");
    const told = (name) => new Promise((resolve) => canvas.addEventListener(name, resolve, { once: true })), lost = told("webglcontextlost");
    ext.loseContext();
    await lost;
    // The event has to be over before the context can be asked for again.
    await new Promise((resolve) => setTimeout(resolve, 100));
    const back = told("webglcontextrestored");
    ext.restoreContext();
    await back;
});

/** All that the picture has, drawn anew; the sun by its middle alone, however much of it was drawn. */
const pixels = (page) => page.evaluate(() => {
    const { stage, stage: { canvas } } = window.lambert.scene, gl = stage.renderer.getContext(), bytes = new Uint8Array(4 * canvas.width * canvas.height);
    stage.sunlight?.begin();
    stage.invalidate();
    stage.draw();
    gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
});

const set = (page, view, lighting) => page.evaluate(([v, l]) => {
    const { store } = window.lambert, { now } = store;
    store.change({ ...now, view: { ...now.view, ...v }, lighting: { ...now.lighting, ...l, sky: { ...now.lighting.sky, ...l.sky } } });
}, [view, lighting]);

test("after a lost graphics context the picture is the same, and no call fails", async () => {
    writeFileSync(inFolder("sensors.json"), JSON.stringify({ grids: [{ name: "plane", over: "floor", height: 1, spacing: 1 }] }));
    const options = { generate: ["--elements", 300], precompute: ["--probes", 0, "--rays", 128, "--sky", "grid:2x4", "--up", "z", "--sensors", inFolder("sensors.json")] };
    const daemon = await Daemon.start([makeStore("patio", "patio", options), makeStore("cornell", "cornell", { ...options, precompute: ["--probes", 0] })]);
    const page = await openPage(daemon.address, { width: 700, height: 420 });
    const steps = {
        "another judged group": () => set(page, { threshold: 5, judged: "floor" }, {}),
        "false colour of another palette": () => set(page, { threshold: null, picture: "false", palette: "turbo" }, {}),
        "the drawn sun": () => set(page, { picture: "light", sharpSun: true }, { sky: SKY }),
        "a smaller window": () => page.setViewportSize({ width: 600, height: 400 }),
        "no drawn sun": () => set(page, { sharpSun: false }, {}),
        "another lighting": () => set(page, {}, { dim: 0.5 }),
        "another scene": () => page.evaluate(() => window.lambert.ask.open(window.lambert.store.now.scene === "patio" ? "cornell" : "patio", null)),
    };
    // Everything there is has been used before: what is lost is more than one picture takes.
    await page.evaluate(() => window.lambert.ask.open("patio", null));
    await settled(page);
    assert.ok(await page.evaluate(() => window.lambert.scene.now.sensors.places > 3));
    await set(page, { sharpSun: true }, { sky: SKY });
    await settled(page);
    const wrong = async () => page.evaluate(() => window.wrong.splice(0));
    await watchCalls(page);
    for (const [name, step] of Object.entries(steps)) {
        const before = await pixels(page);
        assert.deepEqual(await wrong(), [], `before ${name}`);
        await lose(page);
        await settled(page);
        assert.equal(await pixels(page) === before, true, `the picture before ${name}`);
        assert.deepEqual(await wrong(), [], `the context is back, before ${name}`);
        await step();
        await settled(page);
        assert.deepEqual(await wrong(), [], name);
    }
    assert.deepEqual(page.faults, []);
    await page.context().close();
    await daemon.stop();
});
