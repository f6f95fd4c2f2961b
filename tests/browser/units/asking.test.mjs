// The order of what is asked for: the sky of a moment, then its values, and nothing of a moment that is past.
import assert from "node:assert/strict";
import { test } from "node:test";
import { sourceOf } from "../source.mjs";

const { Asking } = await sourceOf("app/asking"), { firstState, firstView, skyOff } = await sourceOf("state/state"), { Store } = await sourceOf("state/store");

/** What is on its way, to be answered by hand. */
function makePage() {
    const asked = [], shown = [], told = [];
    const later = (what) => new Promise((resolve, reject) => asked.push({ what, resolve, reject }));
    const description = { name: "s", channels: 1, groups: [], emitters: null, sky: { tiles: 1 } };
    const store = new Store({ ...firstState, view: firstView }), known = new Map();
    const sky = {
        keyOf: ({ sky: light }) => `${light.model} ${light.hour}`,
        known: ({ sky: light }) => (light.model === "off" ? { sky: null, sun: null } : known.get(light.hour)),
        ask: async ({ sky: light }) => {
            const share = { sky: [await later(`sky ${light.hour}`)], sun: null };
            known.set(light.hour, share);
            return share;
        },
    };
    const api = { radiosity: async (_, { emission: { sky: [value] } }) => ({ values: { data: new Uint16Array([await later(`values ${value}`)]), shape: [1, 1] }, solveMs: null }) };
    const scene = { now: { description, mesh: { elements: 1 }, luminaires: null }, fields: [null, null], sky, tell() {}, show: (side, field) => shown.push(field.bits[0]) };
    const asking = new Asking(api, store, scene, { get: () => undefined }, { answered() {}, fail: (reason) => told.push(reason.message) });
    const settle = () => new Promise(setImmediate);
    return { asked, shown, told, asking, settle,
        to: async (light) => {
            store.change({ ...store.now, lighting: { ...store.now.lighting, sky: { ...skyOff, ...light } } });
            asking.ask(false);
            await settle();
        },
        answer: async (what, value) => {
            const at = asked.findIndex((one) => one.what === what);
            assert.ok(at >= 0, `${what} is not on its way: ${asked.map((one) => one.what)}`);
            const [{ resolve, reject }] = asked.splice(at, 1);
            if (value instanceof Error) reject(value);
            else resolve(value);
            await settle();
        } };
}

test("while values are on their way the sky of the next moment is asked for, and moments between are left out", async () => {
    const page = makePage(), now = () => page.asked.map(({ what }) => what);
    for (const hour of [9, 10, 11]) await page.to({ model: "clear", hour });
    assert.deepEqual(now(), ["sky 9"]);
    await page.answer("sky 9", 0.5);
    // Emission is scaled to 1; the next sky is the newest.
    assert.deepEqual(now().toSorted(), ["sky 11", "values 1"]);
    assert.equal(page.asking.isIdle, false);
    await page.answer("values 1", 9);
    assert.deepEqual(page.shown, [9]);
    await page.answer("sky 11", 0.25);
    await page.answer("values 1", 11);
    assert.deepEqual([page.shown, now(), page.asking.isIdle], [[9, 11], [], true]);
    // A sky that is known is not asked for again.
    await page.to({ model: "clear", hour: 9 });
    assert.deepEqual(now(), ["values 1"]);
});

test("a sky that comes after another state is shown no more", async () => {
    const page = makePage();
    await page.to({ model: "clear", hour: 9 });
    await page.to({ model: "off" });
    assert.deepEqual(page.shown, [0]);
    await page.answer("sky 9", 0.5);
    assert.deepEqual([page.shown, page.asked.length, page.asking.isIdle], [[0], 0, true]);
});

test("a sky that fails is told of once, and asked for again when that is wanted", async () => {
    const page = makePage();
    await page.to({ model: "clear", hour: 9 });
    await page.answer("sky 9", new Error("gone"));
    assert.deepEqual([page.told, page.asked.length, page.asking.isIdle], [["gone"], 0, true]);
    page.asking.ask(false);
    assert.equal(page.asked.length, 0);
    page.asking.ask(true);
    await page.settle();
    await page.answer("sky 9", 0.5);
    await page.answer("values 1", 3);
    assert.deepEqual(page.shown, [3]);
});
