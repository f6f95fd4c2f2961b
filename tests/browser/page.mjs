// Stores, daemons and pages for the tests in a browser. LAMBERT and LAMBERTD name the programs, CHROMIUM the browser; MODULES
// is the folder of the viewer's packages.
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after } from "node:test";
import { chromium } from "playwright-core";

export const LAMBERT = process.env.LAMBERT ?? "lambert";
export const LAMBERTD = process.env.LAMBERTD ?? "lambertd";
/** Milliseconds that only a page that hangs takes: no measure of speed. */
export const PATIENCE = 600_000;

const folder = mkdtempSync(join(tmpdir(), "lambert-browser-"));
const ends = [];
after(async () => {
    for (const end of ends.reverse()) await end();
    rmSync(folder, { recursive: true, force: true });
});

export function inFolder(name) {
    return join(folder, name);
}

/** Runs lambert; where no option of the mesh says otherwise the faces of a scene are its elements, which tests know. */
export function lambert(...args) {
    const own = args.map(String), makes = own[0] === "precompute" && !own[1].endsWith(".h5");
    if (makes && !own.some((a) => /^--(mesh|mesh-error|elements|max-edge)$/.test(a))) own.splice(2, 0, "--mesh", "faces");
    return execFileSync(LAMBERT, own, { encoding: "utf8", stdio: ["ignore", "pipe", "pipe"] });
}

/** A store of a generated scene, named NAME. */
export function makeStore(name, kind, { generate = [], precompute = ["--probes", 2] } = {}) {
    const scene = inFolder(`${name}.obj`), store = inFolder(`${name}.h5`);
    lambert("generate", kind, ...generate, "-o", scene);
    lambert("precompute", scene, "-o", store, "--quiet", ...precompute);
    return store;
}

/** sRGB of linear values, as IEC 61966-2-1 has it, of 255. */
export function toSrgb(linear) {
    return linear.map((v) => {
        const c = Math.min(1, Math.max(0, v));
        return Math.round(255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055));
    });
}

export function near(a, b, tolerance) {
    assert.ok(a.every((v, i) => Math.abs(v - b[i]) <= tolerance), `${a} is not near ${b}`);
}

export class Daemon {
    /** Starts lambertd on loopback; port 0 is a free one. */
    static async start(stores, { port = 0, options = [] } = {}) {
        const daemon = new Daemon();
        daemon.process = spawn(LAMBERTD, [...stores, "--listen", `127.0.0.1:${port}`, ...options].map(String));
        ends.push(() => daemon.stop("SIGTERM"));
        daemon.gone = new Promise((resolve) => daemon.process.once("exit", resolve));
        daemon.address = await new Promise((resolve, reject) => {
            let said = "";
            const read = (bytes) => {
                said += bytes;
                const found = /listening on (http:\S+)/.exec(said);
                if (found) resolve(found[1].replace(/\/$/, ""));
            };
            daemon.process.stdout.on("data", read);
            daemon.process.stderr.on("data", read);
            daemon.process.once("exit", () => reject(new Error(`lambertd ended: ${said}`)));
        });
        return daemon;
    }

    get port() {
        return Number(new URL(this.address).port);
    }

    async stop(signal = "SIGTERM") {
        if (this.process.exitCode === null && this.process.signalCode === null) this.process.kill(signal);
        await this.gone;
    }

    async json(path, body) {
        const response = await fetch(this.address + path, body === undefined ? {} : {
            method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body),
        });
        return response.json();
    }
}

let browser = null;

/** Tests draw by software, which is the same everywhere; CARD=vulkan, or another backend of ANGLE, draws by a graphics card. */
const DRAWING = process.env.CARD === undefined ? ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    : [`--use-angle=${process.env.CARD}`, "--enable-gpu", ...(process.env.CARD === "vulkan" ? ["--enable-features=Vulkan", "--disable-vulkan-surface"] : [])];

/** A page of the viewer, which has shown its first answer. Its `faults` are errors and requests to other origins. */
export async function openPage(address, { width = 1000, height = 600, query = "?inspect", hash = "", touch = false, wait = true, before, storage } = {}) {
    if (browser === null) {
        browser = await chromium.launch({
            executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
            args: ["--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
                "--disable-component-update", "--disable-sync", "--ignore-gpu-blocklist", ...DRAWING],
        });
        ends.push(() => browser.close());
    }
    const context = await browser.newContext({
        viewport: { width, height }, hasTouch: touch, isMobile: touch, permissions: ["clipboard-read", "clipboard-write"], ...storage,
    });
    const page = await context.newPage();
    page.setDefaultTimeout(PATIENCE);
    page.faults = [];
    page.on("pageerror", (error) => page.faults.push(String(error)));
    page.on("request", (request) => {
        const url = request.url();
        if (!url.startsWith(address) && !url.startsWith("data:") && !url.startsWith("blob:")) page.faults.push(`asked ${url}`);
    });
    page.on("console", (message) => {
        // A daemon that is gone, or a token that is missing, is told by the browser itself.
        if (message.type() === "error" && !/Failed to load resource/.test(message.text())) page.faults.push(message.text());
    });
    if (before !== undefined) await before(page);
    await page.goto(`${address}/${query}${hash}`);
    if (wait) await settled(page);
    return page;
}

/** Waits until all that was asked for is shown and drawn. */
export async function settled(page) {
    await page.waitForFunction(() => window.lambert?.scene.answers > 0 && window.lambert.scene.loading === null && window.lambert.ask.isIdle);
    await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))));
}

/** Puts members into a part of the page's state, as its panels do, and waits for the answer. */
export async function change(page, part, to) {
    await page.evaluate(([where, what]) => {
        const { store: s } = window.lambert;
        s.change({ ...s.now, [where]: { ...s.now[where], ...what } });
    }, [part, to]);
    await settled(page);
}

/** The colours of one picture, drawn anew, at points given in shares of its width and height, each [r, g, b] of 255. */
export function pixels(page, places) {
    return page.evaluate((all) => {
        const { stage } = window.lambert.scene, gl = stage.renderer.getContext(), bytes = new Uint8Array(4);
        stage.draw();
        return all.map(([u, v]) => {
            gl.readPixels(Math.floor(u * gl.drawingBufferWidth), Math.floor((1 - v) * gl.drawingBufferHeight), 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
            return [...bytes.subarray(0, 3)];
        });
    }, places);
}

export async function pixel(page, x, y) {
    return (await pixels(page, [[x, y]]))[0];
}

/** The element under a point, found by the page's own picking. */
export function elementAt(page, x, y) {
    return page.evaluate(([u, v]) => {
        const { now: scene, cameras } = window.lambert.scene;
        cameras.camera.updateMatrixWorld();
        return scene.picker.at(2 * u - 1, 1 - 2 * v, cameras.camera);
    }, [x, y]);
}

/** axe-core's violations, as texts. */
export async function violations(page) {
    const source = readFileSync(new URL(import.meta.resolve("axe-core/axe.min.js")), "utf8");
    await page.evaluate(source);
    return page.evaluate(async () => (await window.axe.run()).violations
        .map((v) => `${v.id}: ${v.nodes.map((n) => n.html.slice(0, 120)).join(" | ")}`));
}
