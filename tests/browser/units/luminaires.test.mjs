// Luminaires under a lighting: dimmers by luminaire and by group, what is asked of them, and where their openings are met.
import assert from "node:assert/strict";
import { createRequire } from "node:module";
import { join } from "node:path";
import { test } from "node:test";
import { sourceOf } from "../source.mjs";

const [{ dimmersOf, isRow, lightOf, lumensOf, luminairesOf, meanLightOf, withRows }, { wantedFor }, { firstLighting }, { plainRequest }, { Openings }] =
    await Promise.all(["state/luminaires", "state/request", "state/state", "state/snippets", "picture/openings"].map(sourceOf));
const { PerspectiveCamera } = createRequire(join(process.env.MODULES, "of-the-test.js"))("three");

const lamp = (name, group, dim = 1, lumens = 100) => ({ name, group, dim, lumens, at: [0, 0, 0], aim: [0, 0, -1], c0: [1, 0, 0], colour: [1, 1, 1],
    opening: { shape: "rectangle", size: [0.2, 1, 0] } });
const LIST = [lamp("row.0", "row"), lamp("desk", null, 0.5, 60), lamp("row.1", "row"), lamp("constructor", null, 2, 10)];
const all = luminairesOf(LIST, new Float64Array([1, 3]));
const [row, desk, odd] = all.rows;

test("a row is a group, or a luminaire without one", () => {
    assert.deepEqual(all.rows.map(({ name, isGroup, members }) => [name, isGroup, members.map((one) => one.name)]),
        [["row", true, ["row.0", "row.1"]], ["desk", false, ["desk"]], ["constructor", false, ["constructor"]]]);
    assert.deepEqual(["row", "row.1", "desk", "lamp", null].map((name) => isRow(all, name)), [true, true, true, false, false]);
    assert.deepEqual([luminairesOf([], new Float64Array([1])), isRow(null, "row")], [null, false]);
});

test("luminaires are as dim as their list says, until a person dims them", () => {
    assert.deepEqual(dimmersOf(all.rows, firstLighting, 1), { row: 1, desk: 0.5, constructor: 2 });
    assert.deepEqual([lumensOf(row, firstLighting), lumensOf(desk, firstLighting), meanLightOf(all, firstLighting)], [200, 30, 62.5]);
    // A group of one dimmer is asked for by its name; a member that differs by its own, as are the others of it then.
    const one = { ...firstLighting, dim: 0.5, luminaires: withRows([{ name: "row.1", members: [LIST[2]] }], firstLighting, { dim: 0.25 }) };
    assert.deepEqual(dimmersOf(all.rows, one, 1), { "row.0": 0.5, "row.1": 0.125, desk: 0.25, constructor: 1 });
    assert.equal(lumensOf(row, one), 62.5);
    const off = { ...one, luminaires: withRows([row], one, { on: false }) };
    assert.deepEqual([dimmersOf(all.rows, off, 1), lightOf(LIST[2], off).dim], [{ desk: 0.25, constructor: 1 }, 0.25]);
    const together = withRows(all.rows, off, { on: true, dim: 3 });
    assert.deepEqual(Object.keys(together), ["row", "desk", "constructor"]);
    assert.deepEqual(dimmersOf(all.rows, { ...off, luminaires: together }, 1), { row: 1.5, desk: 1.5, constructor: 1.5 });
});

test("a tint is of channels, and does not change the lumens", () => {
    const lighting = { ...firstLighting, dim: 2, luminaires: withRows([desk], firstLighting, { tint: [2, 1, 0] }) };
    assert.deepEqual(dimmersOf(all.rows, lighting, 3), { row: 2, desk: [2, 1, 0], constructor: 4 });
    assert.deepEqual(dimmersOf(all.rows, lighting, 1), { row: 2, desk: 1, constructor: 4 });
    assert.equal(lumensOf(desk, lighting), 60);
});

test("one that shines alone leaves lamps, luminaires and groups of them dark", () => {
    const alone = (to) => dimmersOf(all.rows, { ...firstLighting, ...to }, 1);
    assert.deepEqual([alone({ soloLuminaire: "row" }), alone({ soloLuminaire: "row.0" }), alone({ soloLuminaire: "desk" }), alone({ solo: "lamp" })],
        [{ row: 1 }, { "row.0": 1 }, { desk: 0.5 }, {}]);
    const groups = { lamp: { on: true, power: 5, colour: [1, 1, 1], kelvin: null } }, can = { channels: 1, groups: ["lamp"], emitters: 0, luminaires: all, sky: null };
    const asked = (to) => plainRequest(wantedFor("s", "radiosity", { ...firstLighting, groups, ...to }, can), null).body.emission;
    assert.deepEqual([asked({}), asked({ soloLuminaire: "desk" }), asked({ solo: "lamp" })],
        [{ groups: { lamp: 5 }, luminaires: { row: 1, desk: 0.5, constructor: 2 } }, { luminaires: { desk: 0.5 } }, { groups: { lamp: 5 } }]);
    assert.equal(wantedFor("s", "radiosity", { ...firstLighting, dim: 0 }, can).emission, null);
});

test("halves of an answer hold what a luminaire gives on average, and a million times as much", () => {
    // 62.5 lx: halves are precise from 6.1e-5 of the scale to 65,504 of it.
    const { scale } = wantedFor("s", "irradiance", firstLighting, { channels: 1, groups: [], emitters: 0, luminaires: all, sky: null });
    assert.ok(65504 * scale > 1e6 * 62.5 && 6.1e-5 * scale < 0.01 * 62.5, String(scale));
});

test("an opening is met by a ray inside its outline, and a little beside it, unless a surface is far before it", () => {
    // Seen from 4 m below in a picture of 400 pixels: 5 pixels are 5 · 8 tan(25 degrees) / 400 = .0466 m.
    const tilted = { ...lamp("tilted", null), at: [3, 0, 0], aim: [1, 0, 0], c0: [0, 0, 1] };
    const openings = new Openings([lamp("flat", null), tilted], "y", 10), camera = new PerspectiveCamera(50, 1, 0.1, 100);
    camera.position.set(0, 0, -4);
    camera.lookAt(0, 0, 0);
    camera.updateMatrixWorld();
    const at = (x, y, z, reach = null) => {
        const p = camera.position.clone().set(x, y, z).project(camera);
        return openings.at(p.x, p.y, camera, 400, reach)?.name ?? null;
    };
    // x is C0 and y is C90: .2 m by 1 m.
    assert.deepEqual([at(0, 0, 0), at(0.09, 0.49, 0), at(0.14, 0.54, 0), at(0.16, 0, 0), at(0, 0.56, 0)], ["flat", "flat", "flat", null, null]);
    // A surface before it hides it, but not a housing of .3 m.
    assert.deepEqual([at(0, 0, 0, 3), at(0, 0, 0, 3.8)], [null, "flat"]);
    // The other one stands upright across x, .2 m along z.
    assert.deepEqual([at(3, 0.4, -0.05), at(3.3, 0, 0)], ["tilted", null]);
});

test("outlines have the size and the place of the opening, and an arrow along the aim", () => {
    const boxOf = (opening) => {
        const { lines } = new Openings([{ ...lamp("x", null), opening, at: [1, 2, 3], aim: [0, 1, 0], c0: [0, 0, -1] }], "z", 10);
        const { geometry } = lines.children[0];
        geometry.computeBoundingBox();
        const { min, max } = geometry.boundingBox;
        return [min.toArray(), max.toArray()].map((point) => point.map((v) => Number(v.toFixed(3)) + 0));
    };
    // Up is z: (x, y, z) of the store is (x, z, −y) of the picture, where the aim goes along −z. C0 goes down, C90 along x. Arrows of .3 m at most.
    assert.deepEqual(boxOf({ shape: "rectangle", size: [0.4, 1, 0] }), [[0.5, 2.8, -2.3], [1.5, 3.2, -2]]);
    assert.deepEqual(boxOf({ shape: "box", size: [0.4, 1, 0.2] }), [[0.5, 2.8, -2.3], [1.5, 3.2, -1.9]]);
    assert.deepEqual(boxOf({ shape: "disc", size: [0.4, 0.4, 0] }), [[0.8, 2.8, -2.2], [1.2, 3.2, -2]]);
    assert.deepEqual(boxOf({ shape: "upright disc", size: [0, 0.4, 0.4] }), [[0.8, 2.97, -2.2], [1.2, 3.03, -1.8]]);
    assert.deepEqual(boxOf({ shape: "cylinder along y", size: [0.4, 1, 0.4] }), [[0.5, 2.8, -2.3], [1.5, 3.2, -1.8]]);
    assert.deepEqual(boxOf({ shape: "sphere", size: [0.4, 0.4, 0.4] }), [[0.8, 2.8, -2.2], [1.2, 3.2, -1.8]]);
    assert.deepEqual(boxOf({ shape: "point", size: [0, 0, 0] }), [[0.9, 2.9, -2.1], [1.1, 3.1, -1.9]]);
});
