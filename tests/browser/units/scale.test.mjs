// Axes and their ticks, and figures of the values on them.
import assert from "node:assert/strict";
import { test } from "node:test";
import { sourceOf } from "../source.mjs";

test("ticks are round and within the axis", async () => {
    const { ticksOf, placeOf, valueAt, areaByValue, figuresOf } = await sourceOf("picture/scale");
    assert.deepEqual(ticksOf({ low: 0, high: 1000, log: false }, 5), [0, 200, 400, 600, 800, 1000]);
    assert.deepEqual(ticksOf({ low: 0.13, high: 0.31, log: false }, 4), [0.15, 0.2, 0.25, 0.3]);
    assert.deepEqual(ticksOf({ low: 1, high: 1000, log: true }, 4), [1, 10, 100, 1000]);
    assert.deepEqual(ticksOf({ low: 3, high: 60, log: true }, 6), [5, 10, 20, 50]);
    for (const axis of [{ low: -3, high: 17.3, log: false }, { low: 2e-7, high: 3e5, log: true }, { low: 41, high: 47, log: true }])
        for (const wanted of [3, 6]) {
            const ticks = ticksOf(axis, wanted);
            assert.ok(ticks.length >= 2 && ticks.length <= 2 * wanted + 1, `${JSON.stringify(axis)}: ${ticks}`);
            for (const tick of ticks) {
                assert.ok(placeOf(tick, axis) > -1e-9 && placeOf(tick, axis) < 1 + 1e-9);
                assert.ok(Math.abs(valueAt(placeOf(tick, axis), axis) - tick) <= 1e-9 * Math.max(1, Math.abs(tick)));
            }
        }
    const values = Float32Array.of(1, 2, 3, 4), area = Float64Array.of(1, 1, 2, 4);
    assert.deepEqual([...areaByValue(values, area, (i) => i > 0, { low: 0, high: 4, log: false }, 4)], [0, 0, 1, 6]);
    assert.deepEqual(figuresOf(values, area, [1, 2, 3], 3), { area: 7, mean: 24 / 7, min: 2, max: 4, uniformity: 7 / 12, reached: 6 / 7 });
    assert.ok(Number.isNaN(figuresOf(values, area, []).mean));
});
