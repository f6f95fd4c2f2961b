// What leaves the page: numbers as text, commands and programs; differences, and names of variants.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { test } from "node:test";
import { sourceOf } from "../source.mjs";

const [csv, snippets, changes, variants, request, state] = await Promise.all(
    ["base/csv", "state/snippets", "picture/changes", "state/variants", "state/request", "state/state"].map(sourceOf));
const run = (program, args, options = {}) => execFileSync(program, args, { encoding: "utf8", ...options });

test("a number in text reads as the same", () => {
    for (const value of [0, 1, 0.1, 1 / 3, 16777217, 1e-38, 3.4e38, 17, 1e-45].map(Math.fround))
        assert.equal(Math.fround(Number(csv.floatText(value))), value);
    assert.equal(csv.floatText(Math.fround(0.1)), "0.1");
});

test("shells and Python read what was written for them", () => {
    const odd = ["plain", "it's", '"$(id)`id`', "a\\b\nc", "ä “é” \u2028 😀", "-n", "!x"];
    for (const text of odd) {
        assert.equal(run("sh", ["-c", `printf %s ${snippets.shellWord(text)}`]), text);
        assert.equal(run("python3", ["-c", `import sys; sys.stdout.buffer.write(${snippets.pythonString(text)}.encode())`]), text);
    }
    // A body beyond what a command may hold goes by standard input.
    const sky = Array.from({ length: 20000 }, (_, i) => 0.001 * i);
    const long = snippets.curlCommand("http://127.0.0.1:1", { scene: "it's", body: { emission: { sky }, quantity: "radiosity" } }, false);
    assert.match(long, /--data-binary @- <<'BODY'\n/);
    const echoed = run("sh", [], { input: long.replace(/^curl .*\\\n.*\\\n.*--data-binary @-/, "cat"), maxBuffer: 1e7 });
    assert.deepEqual(JSON.parse(echoed).emission.sky, sky);
});

test("of a sun only the light is scaled, and scaled back", () => {
    const lighting = state.firstLighting;
    const sun = { azimuth: 100, altitude: 30, direct: [800, 700, 600] };
    const wanted = request.wantedFor("s", "radiosity", lighting, { channels: 3, groups: [], emitters: 0, luminaires: null, sky: [[1, 2, 400], [0, 0, 0]], sun });
    assert.equal(wanted.scale, 800);
    assert.deepEqual(wanted.emission.sun, { azimuth: 100, altitude: 30, direct: [1, 0.875, 0.75] });
    const { body } = snippets.plainRequest(wanted, null);
    assert.deepEqual(body.emission, { sky: [[1, 2, 400], [0, 0, 0]], sun: { azimuth: 100, altitude: 30, direct: [800, 700, 600] } });
    assert.equal(request.wantedFor("s", "radiosity", lighting, { channels: 1, groups: [], emitters: 0, luminaires: null, sky: null, sun: { ...sun, direct: 0 } }).emission, null);
});

test("ends of the scale of differences are round", () => {
    assert.deepEqual([0.0017, 1, 1.01, 4.9, 700].map(changes.roundUp), [0.002, 1, 2, 5, 1000]);
});

test("variants have names and reflectances, or a sentence on what is wrong", () => {
    assert.deepEqual(["a", "a@b", "a@b@c"].map((name) => variants.baseOf(name, ["a", "a@b", "a@b@c"])), ["a", "a", "a@b"]);
    assert.equal(variants.checkReflectances("v", { wall: [0, 0.999] }), null);
    for (const [name, groups] of [["", { wall: [0] }], ["v", {}], ["v", { wall: [1] }], ["v", { wall: [NaN] }], ["a b", { wall: [0] }], ["v", { wall: [-0.1] }]])
        assert.equal(typeof variants.checkReflectances(name, groups), "string", JSON.stringify([name, groups]));
});
