// Links: they restore every state, and what strangers put into them is held to what there is.
import assert from "node:assert/strict";
import { test } from "node:test";
import { sourceOf } from "../source.mjs";

const { fromFragment, toFragment } = await sourceOf("state/link"), { firstLighting, firstState, firstView, skyOff } = await sourceOf("state/state");
const linkOf = (state) => `#1.${Buffer.from(JSON.stringify(state)).toString("base64url")}`;
const textOf = (fragment) => JSON.parse(Buffer.from(fragment.slice(3), "base64url").toString());
const noMoment = () => null;

const moment = { day: 80, hour: 9.25, year: 1997, direct: 500, isHorizontal: true, diffuse: 90, dewPoint: null };
const lighting = {
    groups: { "lamp “é”": { on: false, power: 12.5, colour: [1.5, 0.9, 0.4], kelvin: 2700 } }, dim: 0.25, solo: "lamp “é”", soloLuminaire: null, emitters: { 0: 1, 17: 0.5 },
    luminaires: { "row “é”": { on: false, dim: 1.5, tint: [1.2, 1, 0.5], kelvin: 2700 } },
    sky: { ...skyOff, model: "clear", sun: "tile", tinted: true, hour: 9.25, day: 80, latitude: -33 },
};
const state = {
    ...firstState, scene: "a@b “ü”", lighting, pins: [3, 0, 99], sensor: { set: "desks “é”", index: 12 }, tolerance: 1e-5,
    view: { ...firstView, picture: "false", quantity: "indirect", palette: "turbo", tone: "linear", unit: "lx", exposure: -3.5, range: [0, 77], isoLines: 7,
        threshold: 300, judged: "floor", uniformity: 0.4, sharpSun: true, openings: false, sensors: false, hiddenSets: ["a"], required: 500, camera: [1, 2, 3, 4, 5, 6, 50, 0, 1, 0] },
    presets: [{ name: "evening", lighting }], views: [{ name: "door", camera: [1, 2, 3, 4, 5, 6] }],
    compare: { how: "difference", scene: "other", lighting, split: 0.25 },
};

test("a link restores the state", () => {
    for (const one of [firstState, state, { ...state, compare: { how: "split", scene: null, lighting: null, split: 0.5 } }])
        assert.deepEqual(fromFragment(toFragment(one, noMoment)), one);
    // Members that are as they come stand in no link, but the lighting does.
    assert.deepEqual(Object.keys(textOf(toFragment({ ...firstState, pins: [1] }, noMoment))).sort(), ["lighting", "pins", "view"]);
    assert.deepEqual(textOf(toFragment(firstState, noMoment)).view, {});
});

test("a link holds the weather of each light that needs it", () => {
    const restored = fromFragment(toFragment(state, (sky) => (sky.model === "clear" ? moment : null)));
    for (const one of [restored.lighting, restored.presets[0].lighting, restored.compare.lighting]) assert.deepEqual(one.sky.moment, moment);
    const { sky } = fromFragment(linkOf({ lighting: { sky: { moment: { ...moment, day: 400, diffuse: -1, direct: "x", dewPoint: 1e9 } } } })).lighting;
    assert.deepEqual(sky.moment, { ...moment, day: 365, diffuse: 0, direct: 0, dewPoint: 100 });
});

test("names and numbers that there are not are held to those that there are", () => {
    const odd = { picture: "false", quantity: "colour", palette: "constructor", tone: "toString", unit: "lumen", isoLines: 1e9, exposure: 1e9, uniformity: -1,
        range: [5, 1], camera: [1, 2, 3], judged: 5, smooth: "yes", sensors: 1, hiddenSets: "all", required: -1 };
    const { view } = fromFragment(linkOf({ view: odd }));
    assert.deepEqual(view, { ...firstView, picture: "false", isoLines: 100, exposure: 60, uniformity: 0, range: [5, 1] });
    const spoilt = fromFragment(linkOf({ lighting: { sky: { model: "none", latitude: 1e9, day: "x", hour: -3 } } }));
    assert.deepEqual(spoilt.lighting.sky, { ...skyOff, latitude: 90, hour: 0 });
    const dazzling = fromFragment(linkOf({ lighting: { dim: 1e300, groups: { lamp: { power: 1e300, colour: [1, -2, "x"] }, bad: 5 }, emitters: { 0: 1e300, 1: -1 } } }));
    assert.deepEqual(dazzling.lighting, { ...firstLighting, dim: 1e12, groups: { lamp: { on: true, power: 1e12, colour: [1, 0, 1], kelvin: null } }, emitters: { 0: 1e12, 1: 0 } });
    const dimmed = fromFragment(linkOf({ lighting: { soloLuminaire: "row", luminaires: { row: { dim: 1e300, tint: [1, -2] }, desk: { on: false, dim: "x", tint: [2, -2, 1], kelvin: "x" }, bad: 5 } } }));
    assert.deepEqual(dimmed.lighting, { ...firstLighting, soloLuminaire: "row", luminaires: { row: { on: true, dim: 1e12, tint: [1, 1, 1], kelvin: null },
        desk: { on: false, dim: 0, tint: [2, 0, 1], kelvin: null } } });
    // One of the two shines alone.
    assert.equal(fromFragment(linkOf({ lighting: { solo: "lamp", soloLuminaire: "row" } })).lighting.soloLuminaire, null);
    for (const sensor of [5, {}, { set: "a", index: -1 }, { set: "a", index: 0.5 }, { set: 5, index: 0 }, [1]])
        assert.deepEqual(fromFragment(linkOf({ sensor, view: { hiddenSets: ["a", 5, null] } })), { ...firstState, view: { ...firstView, hiddenSets: ["a"] } });
    assert.deepEqual(fromFragment(linkOf({ pins: [1, -1, 0.5, "x", 7], views: [{ name: "x", camera: [1] }, null], compare: { scene: 5 }, scene: {}, stranger: 1 })),
        { ...firstState, pins: [1, 7], compare: { how: "difference", scene: null, lighting: firstLighting, split: 0.5 } });
});

test("what is no link of this page is none", () => {
    for (const fragment of ["", "#", "#top", "#1.%%%", "#1.", "#2.e30", linkOf([]), linkOf(null), linkOf("x")]) assert.equal(fromFragment(fragment), null, fragment);
});
