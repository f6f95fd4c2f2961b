// What lights a point, and lamps on their way.
import assert from "node:assert/strict";
import { test } from "node:test";
import { sourceOf } from "../source.mjs";

const { alongOf, positionOf } = await sourceOf("state/path"), { partsOf, pinsAfter, PINS_MOST } = await sourceOf("state/shares");
const { firstLighting } = await sourceOf("state/state");

test("a lamp between two positions has both their weights", () => {
    assert.deepEqual([positionOf({ 2: 3 }), positionOf({ 1: 1, 2: 3 }), positionOf({ 1: 1, 3: 1 }), positionOf({})], [2, 1.75, null, null]);
    for (const position of [0, 0.25, 3, 11.875]) {
        const weights = alongOf(position, 2);
        assert.equal(positionOf(weights), position);
        assert.equal(Object.values(weights).reduce((sum, weight) => sum + weight, 0), 2);
    }
});

const lamp = (power, colour, on = true) => ({ on, power, colour, kelvin: null });

test("shares are products of a gradient with what shines, the largest first", () => {
    const groups = { b: lamp(2, [1, 1, 1]), a: lamp(10, [2, 1, 0.5]), off: lamp(9, [1, 1, 1], false), "not of the store": lamp(9, [1, 1, 1]) };
    const lighting = { ...firstLighting, groups, dim: 0.5 }, names = ["a", "b", "off"];
    const rows = [[1, 2, 4], [8, 16, 32], [64, 128, 256]];
    // By channel, at the group's place: 5 (2 · 1 + 1 · 8 + .5 · 64) and 1 (2 + 16 + 128).
    assert.deepEqual(partsOf({ groups: rows }, lighting, 3, names, [], [], null), [{ name: "a", value: 210 }, { name: "b", value: 146 }]);
    assert.deepEqual(partsOf({ groups: rows[0] }, lighting, 1, names, [], [], null), [{ name: "a", value: 5 }, { name: "b", value: 2 }]);
    assert.deepEqual(partsOf({ groups: rows }, { ...lighting, solo: "b" }, 3, names, [], [], null), [{ name: "b", value: 146 }]);
    const sky = [[1, 0, 0], [0, 2, 1]];
    assert.deepEqual(partsOf({ groups: rows, sky: [[3, 5], [7, 11], [13, 17]] }, lighting, 3, names, [], [], sky).map(({ name, value }) => [name, value]),
        [["a", 210], ["b", 146], ["sky", 3 + 2 * 11 + 17]]);
});

test("a store of emitters has the shares of these, or that of the sky whose tiles they are", () => {
    const lighting = { ...firstLighting, dim: 2, emitters: { 1: 3, 2: 0, 7: 1 } };
    assert.deepEqual(partsOf({ emitters: [5, 7, 11] }, lighting, 1, [], ["x", "y", "z"], [], null), [{ name: "y", value: 42 }]);
    assert.deepEqual(partsOf({ emitters: [5, 7] }, firstLighting, 1, [], ["x", "y"], [], [2, 3]), [{ name: "sky", value: 31 }]);
    assert.deepEqual(partsOf({ emitters: [5, 7] }, firstLighting, 1, [], ["x", "y"], [], [2]), []);
    // Luminaires are the last of its emitters, and do not shine twice.
    const desk = [{ name: "desk", group: null, dim: 1 }];
    assert.deepEqual(partsOf({ emitters: [5, 7, 40], luminaires: [40] }, firstLighting, 1, [], ["x", "y"], desk, [2, 3]),
        [{ name: "desk", value: 40 }, { name: "sky", value: 31 }]);
});

test("a luminaire has the share of its own dimmer and tint", () => {
    const luminaires = ["a", "b", "c"].map((name) => ({ name, group: name === "c" ? null : "row", dim: name === "b" ? 0 : 0.5 }));
    const lighting = { ...firstLighting, dim: 2, luminaires: { c: { on: true, dim: 3, tint: [1, 2, 0], kelvin: null } } };
    const rows = [[1, 2, 4], [8, 16, 32], [64, 128, 256]];
    // By channel: 6 (1 · 4 + 2 · 32) and 1 (1 + 8 + 64); b is dark by its list.
    assert.deepEqual(partsOf({ luminaires: rows }, lighting, 3, [], [], luminaires, null), [{ name: "c", value: 408 }, { name: "a", value: 73 }]);
    assert.deepEqual(partsOf({ luminaires: rows[0] }, lighting, 1, [], [], luminaires, null), [{ name: "c", value: 24 }, { name: "a", value: 1 }]);
    assert.deepEqual(partsOf({ groups: [9], luminaires: rows[0] }, { ...lighting, groups: { g: lamp(1, [1, 1, 1]) }, soloLuminaire: "row" }, 1, ["g"], [], luminaires, null),
        [{ name: "a", value: 1 }]);
});

test("a click pins an element, or forgets it", () => {
    assert.deepEqual([pinsAfter([], 4, false), pinsAfter([1, 2], 4, false), pinsAfter([1, 2], 4, true), pinsAfter([1, 4], 4, true), pinsAfter([4], 4, false)],
        [[4], [4], [1, 2, 4], [1], []]);
    const full = Array.from({ length: PINS_MOST }, (_, k) => k);
    assert.deepEqual(pinsAfter(full, 99, true), [...full.slice(1), 99]);
});
