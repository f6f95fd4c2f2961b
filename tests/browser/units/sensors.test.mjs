// Sensors of a scene: values of an answer at their places, figures of sets, and where their marks are met.
import assert from "node:assert/strict";
import { createRequire } from "node:module";
import { join } from "node:path";
import { test } from "node:test";
import { sourceOf } from "../source.mjs";

const [{ choiceOfPlace, darkValuesOf, figuresOfSet, placeOfChoice, sensorsOf, valuesOf, vectorOf, whyNone }, { SensorMarks }, { sensorLinesOf }] =
    await Promise.all(["state/sensors", "picture/sensor_marks", "base/csv"].map(sourceOf));
const { PerspectiveCamera } = createRequire(join(process.env.MODULES, "of-the-test.js"))("three");

const set = (name, kind, at, more = {}) => ({ name, kind, at, axis: [0, 0, 1], look: null, in_walls: [], in_luminaires: [], ...more });
const SETS = [set("a", "points", [[0, 0, 0], [1, 0, 0], [2, 0, 0]], { in_walls: [1] }), set("p", "probes", [[0, 0, 1]]),
    set("constructor", "eyes", [[0, 0, 2], [0, 5, 2]], { axis: [[1, 0, 0], [0, 1, 0]], in_luminaires: [1] }), set("none", "points", [], { axis: null })];
const all = sensorsOf(SETS);
const plain = (values) => [...values].map((v) => (Number.isNaN(v) ? null : v));

test("places are counted through all sets, and values are of those that are no probes", () => {
    assert.deepEqual([all.places, all.names, sensorsOf([]), sensorsOf([SETS[3]])], [6, ["a", "constructor", "none"], null, null]);
    assert.deepEqual(plain(valuesOf(all, [1, NaN, 3, 4, NaN], 1, 2)), [2, null, 6, null, 8, null]);
    // Of three channels the luminance, of two the mean.
    const three = valuesOf(all, [1, NaN, 0, 0, NaN, 0, NaN, 1, 0, NaN, 0, NaN, 0, 1, NaN], 3, 10);
    assert.deepEqual(plain(three).map((v) => v && Number(v.toFixed(3))), [2.126, null, 7.152, null, 0.722, null]);
    assert.deepEqual(plain(valuesOf(all, [1, NaN, 3, 4, NaN, 2, NaN, 5, 6, NaN], 2, 2)), [3, null, 8, null, 10, null]);
    assert.deepEqual(plain(darkValuesOf(all)), [0, null, 0, null, 0, null]);
});

test("figures are of places that have a value", () => {
    const values = valuesOf(all, [1, NaN, 3, 4, NaN], 1, 1);
    assert.deepEqual(figuresOfSet(all.sets[0], values, 2), { valued: 2, mean: 2, min: 1, uniformity: 0.5, reached: 0.5 });
    assert.ok(Number.isNaN(figuresOfSet(all.sets[0], values, null).reached));
    assert.equal(figuresOfSet(all.sets[1], values, 2).valued, 0);
    assert.equal(figuresOfSet(all.sets[0], values, 1).reached, 1);
    assert.ok(Number.isNaN(figuresOfSet(all.sets[0], darkValuesOf(all), 1).uniformity));
});

test("a place has a set and a number, and the other way round", () => {
    for (const [place, name, index] of [[0, "a", 0], [2, "a", 2], [3, "p", 0], [4, "constructor", 0], [5, "constructor", 1]]) {
        const { of, index: found } = choiceOfPlace(all, place);
        assert.deepEqual([of.set.name, found, placeOfChoice(all, { set: name, index })], [name, index, place]);
    }
    assert.deepEqual([{ set: "a", index: 3 }, { set: "b", index: 0 }, null].map((choice) => placeOfChoice(all, choice)), [null, null, null]);
    assert.deepEqual([vectorOf(SETS[0].axis, 2), vectorOf(SETS[2].axis, 1), vectorOf(null, 0)], [[0, 0, 1], [0, 1, 0], null]);
    assert.deepEqual([whyNone(all.sets[0], 0), whyNone(all.sets[0], 1), whyNone(all.sets[2], 1)], [null, "no value: in a wall", "no value: in a luminaire"]);
});

test("a mark is met where it is drawn, the nearest one, before a surface", () => {
    // Up is z: (x, y, z) of the store is (x, z, −y) of the picture, where the eye looks down at y = 0 from 10 m above.
    const marks = new SensorMarks(all, "z", 10, { palette: {}, range: {}, is_log: {} }), camera = new PerspectiveCamera(50, 1, 0.1, 100);
    camera.position.set(0, 10, 0);
    camera.up.set(0, 0, -1);
    camera.lookAt(0, 0, 0);
    camera.updateMatrixWorld();
    const met = (x, y, z, reach = null) => {
        const p = camera.position.clone().set(x, z, -y).project(camera);
        return marks.at(p.x, p.y, camera, reach);
    };
    // The eye's set stands at z = 2 above the first of "a", and the probe between them.
    assert.deepEqual([met(0, 0, 0), met(1, 0, 0), met(2, 0, 0), met(1.5, 0, 0), met(0, 5, 2)], [4, 1, 2, null, 5]);
    // A radius is a hundredth of the diagonal, .1 m, and .004 of the height, 2 · 10 tan(25 degrees) m, are still met around.
    assert.deepEqual([met(1.13, 0, 0), met(1.145, 0, 0)], [1, null]);
    assert.deepEqual([met(1, 0, 0, 9), met(1, 0, 0, 10.05)], [null, 1]);
    marks.hide(["constructor"]);
    assert.deepEqual([met(0, 0, 0), met(0, 5, 2)], [3, null]);
    marks.hide(["constructor", "p", "gone"]);
    assert.equal(met(0, 0, 0), 0);
    marks.hide([]);
    assert.equal(met(0, 0, 0), 4);
    // Both eyes have an arrow beside their disc; values of both are the same.
    assert.equal(marks.mesh.geometry.instanceCount, 8);
    marks.setValues(valuesOf(all, [1, NaN, 3, 4, NaN], 1, 1));
    assert.deepEqual([...marks.mesh.geometry.attributes.value.array], [1, -2, 3, -1, 4, -2, 4, -2]);
    marks.setValues(null);
    assert.deepEqual([...marks.mesh.geometry.attributes.value.array], [-1, -2, -1, -1, -1, -2, -1, -2]);
});

test("a line of CSV has what a sensor has, and nothing where it has no value", () => {
    assert.equal(sensorLinesOf([{ set: 'a "b"', at: [0.1, 2, -3], axis: [0, 0, 1], value: Math.fround(0.1) }, { set: "c", at: [0, 0, 0], axis: [0, 0, 0], value: NaN }], "lx"),
        'sensors,x [m],y [m],z [m],nx,ny,nz,irradiance (lx)\r\n"a ""b""",0.1,2,-3,0,0,1,0.1\r\nc,0,0,0,0,0,0,\r\n');
});
