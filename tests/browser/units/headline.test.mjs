// The error in one line.
import assert from "node:assert/strict";
import { test } from "node:test";
import { sourceOf } from "../source.mjs";

const { headlineOf } = await sourceOf("daemon/headline");
const close = (a, b, relative, what) => assert.ok(Math.abs(a - b) <= relative * b, `${what}: ${a} must be ${b}`);

test("the headline has the part of the mesh, of the kind of light that shines", () => {
    // Of skies alone it is theirs; without a figure of the mesh it is the rest; without any it is not known.
    const figures = (indirect, relative) => ({ total_indirect_mean: indirect, total_relative_mean: relative });
    const made = { lights: figures(0.03, 0.01), sky: figures(0.05, 0.04), mesh: { lights: 0.04, even: 0.9, sky_even: 0.1, sky_cloudy: 0.12 } };
    close(headlineOf(made, { groups: {} }).indirect, 0.05, 1e-9, "of lamps");
    close(headlineOf(made, { groups: {} }).relative, 0.05 / 3, 1e-9, "of lamps, of all");
    close(headlineOf(made, { sky: [1] }).indirect, 0.13, 1e-9, "of skies");
    close(headlineOf({ random: figures(0.03, 0.01), mesh: { even: 0.04 } }, null).indirect, 0.05, 1e-9, "without lamps");
    close(headlineOf({ lights: figures(0.03, 0.01) }, null).indirect, 0.03, 1e-9, "without a mesh");
    assert.equal(headlineOf({ mesh: { even: 0.1 } }, null), null);
});
