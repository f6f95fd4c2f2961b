#!/usr/bin/env node
// Light probes for three.js, from probes that Lambert has found with y up.
//
//   lambert precompute room.obj --probes-grid 1 --probes-y-up -o room.h5
//   lambert solve room.h5 --sensors probes --json > probes.json
//   node probes_for_three.mjs probes.json 1,1.5,-2      npm install three, for the irradiance of six sides there
//
// In a page: const probes = lightProbes(THREE, await (await fetch("probes.json")).json());
//            const light = new THREE.LightProbe(mix(THREE, probes, ball.position)); scene.add(light);
// three.js lights by coefficients of the radiance as they are, and so does a surface of albedo a leave a E / pi.
// A LightProbe lights all objects of a scene alike: mix its coefficients anew for the object that matters, in each frame.
import { readFile } from "node:fs/promises";
import { argv } from "node:process";
import { pathToFileURL } from "node:url";

/** The probes of all sets of an answer that have a value: [{ at: Vector3, sh: SphericalHarmonics3 }]. */
export function lightProbes(THREE, answer) {
    const probes = [];
    for (const set of answer.sensors) {
        if (set.coefficients === undefined) continue;
        if (set.axes !== "y-up") throw new Error(`${set.name} is in the axes of its scene: give it "axes": "y-up"`);
        set.coefficients.forEach((nine, k) => {
            if (nine === null) return; // in a wall
            const colours = nine.map((c) => (c.length === 3 ? c : [c[0], c[0], c[0]]));
            probes.push({ at: new THREE.Vector3(...set.at[k]), sh: new THREE.SphericalHarmonics3().fromArray(colours.flat()) });
        });
    }
    return probes;
}

/** The coefficients at a point, between the nearest probes, by the inverse squares of their distances. */
export function mix(THREE, probes, point, most = 8) {
    const far = probes.map(({ at, sh }) => ({ sh, square: at.distanceToSquared(point) })).sort((a, b) => a.square - b.square);
    const near = far.slice(0, most);
    const weights = near.map(({ square }) => 1 / (square + 1e-6)), all = weights.reduce((a, b) => a + b, 0);
    const mixed = new THREE.SphericalHarmonics3();
    near.forEach(({ sh }, k) => mixed.addScaledSH(sh, weights[k] / all));
    return mixed;
}

if (argv[1] !== undefined && import.meta.url === pathToFileURL(argv[1]).href) {
    if (argv.length < 4) throw new Error("usage: probes_for_three.mjs ANSWER.json X,Y,Z");
    const THREE = await import("three");
    const probes = lightProbes(THREE, JSON.parse(await readFile(argv[2], "utf8")));
    const sh = mix(THREE, probes, new THREE.Vector3(...argv[3].split(",").map(Number)));
    console.log(`${probes.length} probes; irradiance of sides that look along`);
    for (const [axis, name] of ["x", "y", "z"].entries())
        for (const sign of [1, -1]) {
            const E = sh.getIrradianceAt(new THREE.Vector3().setComponent(axis, sign), new THREE.Vector3());
            console.log(`${sign < 0 ? "-" : "+"}${name} ${E.toArray().map((c) => c.toPrecision(4)).join(" ")}`);
        }
}
