// deploy/examples/three as it is served to a browser: the light at corners, drawn smoothly, and its slider.
import assert from "node:assert/strict";
import { createReadStream, readFileSync } from "node:fs";
import { createServer } from "node:http";
import { extname, join } from "node:path";
import { after, test } from "node:test";
import { change, Daemon, inFolder, lambert, makeStore, near, openPage, toSrgb } from "./page.mjs";

const EXAMPLE = join(process.env.VIEWER, "../../deploy/examples/three"), CLIENT = join(process.env.VIEWER, "../../deploy/js");
const TYPES = { ".html": "text/html", ".js": "text/javascript" };

/** Serves the example with what npm would install beside it. */
async function serve() {
    const server = createServer((request, response) => {
        const { pathname } = new URL(request.url, "http://x"), [, module, rest] = /^\/node_modules\/(three|lambert-light)\/([\w./-]+)$/.exec(pathname) ?? [];
        const file = module === undefined ? join(EXAMPLE, pathname === "/" ? "index.html" : pathname)
            : module === "three" ? join(process.env.MODULES, "three", rest) : join(CLIENT, rest);
        response.writeHead(200, { "Content-Type": TYPES[extname(file)] ?? "application/octet-stream" });
        createReadStream(file).on("error", () => response.end()).pipe(response);
    });
    await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
    after(() => server.closeAllConnections());
    after(() => server.close());
    return `http://127.0.0.1:${server.address().port}`;
}

const PLACES = [[0.5, 0.79], [0.34, 0.5], [0.65, 0.5], [0.46, 0.55], [0.58, 0.4], [0.54, 0.7], [0.42, 0.25]];

/** Of each place the colour of the picture, the corners of the triangle there, and the share of each. */
function look(page) {
    return page.evaluate(async (places) => {
        const { Raycaster, Vector2 } = await import("three"), { renderer, camera, mesh } = window.shown, gl = renderer.getContext(), ray = new Raycaster();
        renderer.render(mesh.parent, camera);
        return places.map(([u, v]) => {
            const bytes = new Uint8Array(4), { drawingBufferWidth: width, drawingBufferHeight: height } = gl;
            const x = Math.floor(u * width), y = Math.floor((1 - v) * height);
            gl.readPixels(x, y, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
            ray.setFromCamera(new Vector2(2 * (x + 0.5) / width - 1, 2 * (y + 0.5) / height - 1), camera);
            const [hit] = ray.intersectObject(mesh);
            return { colour: [...bytes.subarray(0, 3)], corners: hit && [hit.face.a, hit.face.b, hit.face.c], shares: hit?.barycoord.toArray(), exposure: renderer.toneMappingExposure };
        });
    }, PLACES);
}

const until = (page, dim) => page.waitForFunction((d) => window.shown?.dim === d && window.shown.light.isIdle, dim);

test("three.js shows the light at corners, and the slider dims it", async () => {
    const address = await serve(), daemon = await Daemon.start([makeStore("box", "cornell", { generate: ["--elements", 300] })], { options: ["--allow-origin", address] });
    const page = await openPage(address, { query: `?scene=${daemon.address}/box`, wait: false });
    await until(page, 1);
    const faults = page.faults.filter((fault) => !fault.startsWith(`asked ${daemon.address}/`) && !/favicon/.test(fault));
    assert.deepEqual(faults, []);
    const { groups } = await daemon.json("/v1/scenes/box/groups"), { emission } = groups.find(({ name }) => name === "lamp");
    for (const dim of [1, 0.25]) {
        if (dim !== 1) await page.locator("input").fill(String(dim));
        await until(page, dim);
        const { radiosity } = await daemon.json("/v1/scenes/box/radiosity", { emission: { groups: { lamp: emission.map((e) => dim * e) } }, at: "corners" });
        const seen = await look(page);
        for (const [k, { colour, corners, shares, exposure }] of seen.entries()) {
            assert.ok(corners !== undefined, `there is no surface at ${PLACES[k]}`);
            const linear = radiosity.map((of) => exposure * corners.reduce((sum, corner, i) => sum + shares[i] * of[corner], 0));
            near(colour, toSrgb(linear), 2); // a half has 11 bits, a colour 8; shares are those of single precision
        }
        assert.ok(new Set(seen.map(({ colour }) => String(colour))).size > 3, "the places look alike");
    }
    await page.context().close(); // it draws all the time
});

/** Luminance of the linear light that a byte of sRGB stands for. */
const LINEAR = Float64Array.from({ length: 256 }, (_, v) => (v <= 10 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4));
const luminance = (bytes, at) => 0.2126 * LINEAR[bytes[at]] + 0.7152 * LINEAR[bytes[at + 1]] + 0.0722 * LINEAR[bytes[at + 2]];

/** Reads what is drawn; it runs in pages. */
const read = `(gl) => {
    const { drawingBufferWidth: width, drawingBufferHeight: height } = gl, bytes = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    return new Promise((resolve) => Object.assign(new FileReader(), { onload: (event) => resolve(event.target.result) }).readAsDataURL(new Blob([bytes])));
}`;

/** The picture of the page, linear and on black, and of three.js by the same camera, exposure and size. */
async function bothPictures(page, three) {
    const exposure = await three.evaluate(() => window.shown.renderer.toneMappingExposure);
    await change(page, "view", { tone: "linear", exposure: Math.log2(exposure) });
    const { size, place, url } = await page.evaluate(async (reading) => {
        const { stage, cameras } = window.lambert.scene, gl = stage.renderer.getContext();
        if (stage.uniforms.is_smooth.value !== true) throw new Error("the picture is not smooth");
        stage.background = "#000";
        stage.draw();
        return { size: [gl.drawingBufferWidth, gl.drawingBufferHeight], place: cameras.now, url: await eval(reading)(gl) };
    }, read);
    const other = await three.evaluate(([reading, [width, height], [x, y, z, tx, ty, tz]]) => {
        const { renderer, camera, mesh } = window.shown;
        renderer.setSize(width, height);
        camera.aspect = width / height;
        camera.position.set(x, y, z);
        camera.lookAt(tx, ty, tz);
        camera.updateProjectionMatrix();
        renderer.render(mesh.parent, camera);
        return eval(reading)(renderer.getContext());
    }, [read, size, place]);
    return [url, other].map((of) => Buffer.from(of.slice(of.indexOf(",") + 1), "base64"));
}

test("the picture of three.js is the page's smooth one", async () => {
    const address = await serve();
    for (const [name, kind] of [["parts", "cornell"], ["halls", "rooms"]]) {
        lambert("generate", kind, "--elements", 300, "-o", inFolder(`${name}.obj`));
        // Elements of many sizes: corners hang in edges.
        lambert("precompute", inFolder(`${name}.obj`), "-o", inFolder(`${name}.h5`), "--quiet", "--probes", 0, "--mesh", "light");
        const daemon = await Daemon.start([inFolder(`${name}.h5`)], { options: ["--allow-origin", address] });
        const page = await openPage(daemon.address, { width: 900, height: 500 }), three = await openPage(address, { query: `?scene=${daemon.address}`, wait: false });
        await until(three, 1);
        const [own, other] = await bothPictures(page, three);
        for (const one of [page, three]) await one.context().close();
        assert.equal(own.length, other.length);
        let lit = 0, alike = 0, strictly = 0;
        for (let at = 0; at < own.length; at += 4) {
            const mine = luminance(own, at), theirs = luminance(other, at);
            if (mine === 0 && theirs === 0) continue;
            lit += 1;
            const isClose = Math.abs(mine - theirs) <= 0.02 * mine;
            if (isClose) strictly += 1;
            // In the dark one step of a byte is more than that, and light within 0.1 % of a border between two may be on either side of it.
            if (isClose || [0, 1, 2].every((c) => Math.abs(own[at + c] - other[at + c]) <= 1)) alike += 1;
        }
        console.log(`${name}: of ${lit} pixels with light ${alike} agree, ${strictly} within 2 % of their luminance; ${own.length / 4} in all`);
        assert.ok(lit > own.length / 16, "there is little light");
        // Edges between surfaces differ, where the page takes light inside of them.
        assert.ok(alike >= 0.995 * lit && own.length / 4 - lit + strictly >= 0.99 * own.length / 4, `${lit - alike} of ${lit} pixels differ`);
    }
});

test("the example has few lines of its own", () => {
    assert.ok(readFileSync(join(EXAMPLE, "main.js"), "utf8").trimEnd().split("\n").length <= 45);
});
