// deploy/examples/three as it is served to a browser: the light at corners, drawn smoothly, and its slider.
import assert from "node:assert/strict";
import { createReadStream, readFileSync } from "node:fs";
import { createServer } from "node:http";
import { extname, join } from "node:path";
import { after, test } from "node:test";
import { Daemon, makeStore, near, openPage, toSrgb } from "./page.mjs";

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
});

test("the example has few lines of its own", () => {
    assert.ok(readFileSync(join(EXAMPLE, "main.js"), "utf8").trimEnd().split("\n").length <= 45);
});
