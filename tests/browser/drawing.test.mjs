// The graphics card's part of the picture: no pixel has light that no element near it has.
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { test } from "node:test";
import { Daemon, inFolder, lambert, openPage } from "./page.mjs";

const STRIPS = 600;

/** A wall of 3 m by 2 m in narrow strips, and a dark one twelve millimetres behind it. Both face +z; y is up. */
function wallInStrips() {
    const lines = ["mtllib walls.mtl"];
    let vertices = 0;
    const quad = (x, width, z) => {
        for (const [px, py] of [[x, 0], [x + width, 0], [x + width, 2], [x, 2]]) lines.push(`v ${px.toFixed(6)} ${py} ${z}`);
        lines.push(`f ${[1, 2, 3, 4].map((k) => vertices + k).join(" ")}`);
        vertices += 4;
    };
    lines.push("g wall", "usemtl white");
    for (let k = 0; k < STRIPS; k++) quad((3 * k) / STRIPS, 3 / STRIPS, 0);
    lines.push("g behind", "usemtl black");
    quad(0, 3, -0.012);
    // It makes the scene as long as a house.
    lines.push("g far", "usemtl black");
    quad(0, 0.01, -10);
    return `${lines.join("\n")}\n`;
}

test("narrow elements have light between that of their corners, and hide what is close behind them", async () => {
    writeFileSync(inFolder("walls.mtl"), "newmtl white\nKd .5 .5 .5\nKe 1 1 1\nnewmtl black\nKd .1 .1 .1\n");
    writeFileSync(inFolder("walls.obj"), wallInStrips());
    lambert("precompute", inFolder("walls.obj"), "-o", inFolder("walls.h5"), "--quiet", "--probes", 0, "--up", "y");
    const daemon = await Daemon.start([inFolder("walls.h5")]);
    const page = await openPage(daemon.address);
    const found = await page.evaluate(() => {
        const { stage, cameras, now: { mesh } } = window.lambert.scene, gl = stage.renderer.getContext();
        // A quarter or half, in no order that the strips' pixels could have; 0 behind.
        const bits = new Uint16Array(mesh.elements), isWall = mesh.groups.map((group) => group.name === "wall");
        let seed = 1;
        for (let i = 0; i < mesh.elements; i++) {
            seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0;
            bits[i] = isWall[mesh.groupOf[i]] ? (seed >>> 31 === 1 ? 0x3800 : 0x3400) : 0;
        }
        stage.setField(0, { bits, scale: 1 });
        const { uniforms } = stage;
        Object.assign(uniforms.tone, { value: 0 });
        Object.assign(uniforms.exposure, { value: 1 });
        if (uniforms.is_smooth.value !== true) throw new Error("the picture is not smooth");
        stage.background = "#000";
        // Corners are rounded to sixteenths of a pixel; from the side that would let the wall behind through, however fine depths are.
        const out = { pixels: 0, low: 255, high: 0, distances: [] };
        for (const [x, y, z] of [[1.5, 1, 4], [9, 1, 6], [1.5, 6, 20], [1.5, 1, 40], [6, 3, 30]]) {
            cameras.place([x, y, z, 1.5, 1, 0], false);
            cameras.advance(1);
            stage.draw();
            const [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight], bytes = new Uint8Array(4 * w * h), { camera } = cameras;
            gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
            camera.updateMatrixWorld();
            // Pixels of the wall that are two pixels from its edges.
            const corners = [[0, 0], [3, 0], [3, 2], [0, 2]].map(([u, v]) => camera.position.clone().set(u, v, 0).project(camera)).map((p) => [(p.x + 1) * w / 2, (p.y + 1) * h / 2]);
            const isWithin = (px, py) => corners.every(([ax, ay], k) => {
                const [bx, by] = corners[(k + 1) % 4], length = Math.hypot(bx - ax, by - ay);
                return ((bx - ax) * (py - ay) - (by - ay) * (px - ax)) / length > 2;
            });
            let pixels = 0;
            for (let py = 0; py < h; py++)
                for (let px = 0; px < w; px++) {
                    if (!isWithin(px + 0.5, py + 0.5)) continue;
                    const value = bytes[4 * (py * w + px)];
                    pixels += 1;
                    out.low = Math.min(out.low, value);
                    out.high = Math.max(out.high, value);
                }
            out.distances.push(pixels);
            out.pixels += pixels;
        }
        return out;
    });
    console.log(`${found.pixels} pixels of the wall have ${found.low} to ${found.high} of 255`);
    assert.ok(found.distances.every((pixels) => pixels > 100), JSON.stringify(found.distances));
    // sRGB of 1/4 is 137, of 1/2 is 188; one step more for rounding.
    assert.ok(found.low >= 136 && found.high <= 189, `${found.low} to ${found.high} of 255`);
    assert.deepEqual(page.faults, []);
    await page.context().close();
    await daemon.stop();
});
