// Probes as three.js reads them: the irradiance that it finds from their coefficients against planes at the same places.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";
import { lightProbes, mix } from "../../../deploy/examples/probes_for_three.mjs";

const THREE = createRequire(join(process.env.MODULES, "of-the-test.js"))("three");

// Radiance 1 from the upper half has even light of order 0 and 1 alone, and odd parts from order 3 on, which irradiance does not
// see: upwards it is pi, to a side pi / 2, downwards 0. Order 2 of three.js gives these without error but for six decimals.
test("three.js finds the irradiance of planes in the upper half of a box", () => {
    const folder = mkdtempSync(join(tmpdir(), "lambert-probes-"));
    const file = (name, text) => {
        if (text !== undefined) writeFileSync(join(folder, name), text);
        return join(folder, name);
    };
    const lambert = (...options) => execFileSync(process.env.LAMBERT, options, { encoding: "utf8", stdio: ["ignore", "pipe", "ignore"] });
    try {
        const corners = [0, 1, 2].map((z) => [[0, 0], [4, 0], [4, 4], [0, 4]].map(([x, y]) => `v ${x} ${y} ${z}\n`).join("")).join("");
        file("box.mtl", "newmtl black\nKd 0 0 0\nnewmtl lamp\nKd 0 0 0\nKe 3.14159265 3.14159265 6.28318531\n");
        file("box.obj", `mtllib box.mtl\n${corners}usemtl black\no lower\nf 1 2 3 4\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n` +
            "usemtl lamp\no upper\nf 5 9 10 6\nf 6 10 11 7\nf 7 11 12 8\nf 8 12 9 5\nf 12 11 10 9\n");
        const game = { name: "game", at: [[2, 2, 1], [1, 3, 1], [2, 2, -1]], axes: "y-up" };
        file("s.json", JSON.stringify({ probes: [game], cubes: [{ name: "cube", at: [2, 2, 1] }] }));
        lambert("precompute", file("box.obj"), "--elements", "600", "--sensors", file("s.json"), "--probes", "0", "-o", file("box.h5"));
        const answer = JSON.parse(lambert("solve", file("box.h5"), "--sensors", "all", "--json"));
        const probes = lightProbes(THREE, answer), cube = answer.sensors.find(({ name }) => name === "cube").values[2];
        assert.equal(probes.length, 2); // one lies outside
        assert.deepEqual(probes[1].at.toArray(), [1, 1, -3]);
        // +x -x +y -y +z -z of the scene are +x -x -z +z +y -y of three.js
        const sides = [[1, 0, 0], [-1, 0, 0], [0, 0, -1], [0, 0, 1], [0, 1, 0], [0, -1, 0]], expected = [0.5, 0.5, 0.5, 0.5, 1, 0];
        const sh = mix(THREE, probes, new THREE.Vector3(2, 1, -2)), light = new THREE.LightProbe(sh);
        assert.equal(light.sh, sh);
        sides.forEach((side, k) => {
            const E = sh.getIrradianceAt(new THREE.Vector3(...side), new THREE.Vector3());
            for (const [channel, L] of [1, 1, 2].entries())
                assert.ok(Math.abs(E.getComponent(channel) - Math.PI * L * expected[k]) < 3e-3 * L, `${side}: ${E.toArray()}`);
            assert.ok(Math.abs(E.z - cube[k]) < 6e-3, `${side}: ${E.z} of the probe, ${cube[k]} of a plane`);
        });
    } finally {
        rmSync(folder, { recursive: true });
    }
});
