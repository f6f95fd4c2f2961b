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
    close(headlineOf(made, { groups: {} }).stated, 0.05, 1e-9, "of lamps");
    assert.equal(headlineOf(made, { groups: {} }).coarse, false);
    assert.equal(headlineOf(made, { sky: [1] }).coarse, true);
    close(headlineOf(made, { sky: [1] }).stated, Math.hypot(0.04, 0.12), 1e-9, "of skies, over all that is reflected");
    // Beside lamps the larger of both; the mesh of even light is none of luminaires.
    const lit = { random: figures(0.03, 0.01), mesh: { even: 1e-9, luminaires: 0.04 } };
    close(headlineOf(lit, { luminaires: {} }).stated, 0.05, 1e-9, "of luminaires");
    close(headlineOf({ ...lit, mesh: { ...lit.mesh, lights: 0.12 } }, { groups: {}, luminaires: {} }).mesh, 0.12, 1e-9, "of lamps and luminaires");
    close(headlineOf({ random: figures(0.03, 0.01), mesh: { even: 0.04 } }, { luminaires: {} }).mesh, 0.04, 1e-9, "of luminaires without a figure of theirs");
    close(headlineOf({ random: figures(0.03, 0.01), mesh: { even: 0.04 } }, null).stated, 0.05, 1e-9, "without lamps");
    close(headlineOf({ lights: figures(0.03, 0.01) }, null).stated, 0.03, 1e-9, "without a mesh");
    assert.equal(headlineOf({ mesh: { even: 0.1 } }, null), null);
});
