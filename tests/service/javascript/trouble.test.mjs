// Lambert's client beside daemons that are busy, gone, replaced or slow, and askers that give up. LAMBERTD names the daemon; FOLDER has the
// stores a, b of another geometry and c, which is a with other reflectances.
import assert from "node:assert/strict";
import { copyFileSync, renameSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { connect, open, writeNpy } from "../../../deploy/js/lambert.js";
import { says, startDaemon, startFake } from "./servers.mjs";

const FOLDER = process.env.FOLDER, NONE = '{"scenes":[]}';

test("a busy daemon is asked again after the time that it names", async () => {
    for (const status of [429, 503]) {
        const busy = says(status, '{"title":"Full","detail":"later"}', { "Retry-After": "0.05" });
        const some = await startFake(busy, busy, says(200, NONE));
        assert.deepEqual(await connect(some.address).scenes(), []);
        assert.equal(some.asked.length, 3);
        const all = await startFake(busy);
        await assert.rejects(connect(all.address, { retries: 2 }).scenes(), { status, title: "Full", detail: "later", retryAfter: 0.05, route: "GET /v1/scenes" });
        assert.equal(all.asked.length, 3);
    }
    const long = await startFake(says(503, "{}", { "Retry-After": "3600" })); // longer than the time limit
    await assert.rejects(connect(long.address).scenes(), { status: 503, retryAfter: 3600 });
    const put = await startFake(says(429));
    await assert.rejects(connect(put.address).ask("PUT", "x"), { status: 429 });
    assert.deepEqual([long.asked.length, put.asked.length], [1, 1]);
});

test("one connection is kept, and replaced when it was closed", async () => {
    const ports = new Set(), fake = await startFake((request, response) => {
        ports.add(request.socket.remotePort);
        response.end(NONE);
    });
    for (let i = 0; i < 20; i++) await connect(fake.address).scenes();
    assert.ok(ports.size <= 2, `${ports.size} connections`); // one may be about to end while another is opened
    // Each answer is the last of its connection, without a word of it.
    const closing = await startFake((request, response) => response.end(NONE, () => request.socket.destroy()));
    const daemon = connect(closing.address);
    for (let i = 0; i < 5; i++) assert.deepEqual(await daemon.scenes(), []);
    const cut = await startFake((request) => request.socket.destroy());
    await assert.rejects(connect(cut.address).scenes(), { kind: "disconnected", status: null });
    assert.equal(cut.asked.length, 1); // a new connection that breaks is a daemon that fails
});

test("askers give up", async () => {
    const fake = await startFake(() => {}), daemon = connect(fake.address);
    await assert.rejects(daemon.scenes({ timeout: 0.1 }), { kind: "timed-out", message: "GET /v1/scenes: no answer within 0.1 s" });
    const end = new AbortController(), asked = daemon.scenes({ signal: end.signal });
    setTimeout(() => end.abort(), 10);
    await assert.rejects(asked, { name: "AbortError" });
    await assert.rejects(daemon.scenes({ signal: AbortSignal.abort(new Error("enough")) }), { message: "enough" });
    const busy = await startFake(says(503, "{}", { "Retry-After": "30" })), waits = new AbortController();
    const waiting = connect(busy.address).scenes({ signal: waits.signal });
    while (busy.asked.length === 0) await new Promise(setImmediate);
    setTimeout(() => waits.abort(), 50);
    await assert.rejects(waiting, { name: "AbortError" });
});

test("answers that are none are errors", async () => {
    const html = await startFake(says(502, "<html>Bad gateway</html>", { "Content-Type": "text/html" }));
    await assert.rejects(connect(html.address).scenes(), { status: 502, detail: "<html>Bad gateway</html>" });
    const empty = await startFake(says(500, ""));
    await assert.rejects(connect(empty.address).scenes(), { status: 500, detail: "the answer has no body" });
    assert.equal(await connect("http://127.0.0.1:9").health(), false);
});

test("a request says its time limit and its token", async () => {
    const fake = await startFake(says(200, '{"azimuth":[],"altitude":[]}'));
    await connect(fake.address, { token: "secret", timeout: 7 }).sun({}, []);
    await connect(`${fake.address}/light/`, { timeout: null }).sun({}, []);
    const [first, second] = fake.asked;
    assert.ok(Math.abs(Number(first.headers["lambert-timeout"]) - 7) < 1);
    assert.deepEqual([first.headers.authorization, first.url], ["Bearer secret", "/v1/sun"]);
    assert.deepEqual([second.headers["lambert-timeout"], second.headers.authorization, second.url], [undefined, undefined, "/light/v1/sun"]);
});

test("a daemon that is killed in a loop", async () => {
    const daemon = await startDaemon(join(FOLDER, "a.h5")), scene = await open(`${daemon.address}/a`);
    const one = await scene.radiosity({ groups: { [scene.names[0]]: 1 } });
    await daemon.end("SIGKILL");
    await assert.rejects(scene.radiosity(one), { name: "LambertError", kind: "disconnected", status: null, route: "POST /v1/scenes/a/radiosity" });
});

test("a store that is replaced is noticed before its numbers are used", async () => {
    const place = (name) => {
        copyFileSync(join(FOLDER, `${name}.h5`), join(FOLDER, "new"));
        renameSync(join(FOLDER, "new"), join(FOLDER, "room.h5"));
    };
    place("a");
    const daemon = await startDaemon(join(FOLDER, "room.h5"));
    let times = 0;
    const replace = async (name) => {
        place(name);
        daemon.signal("SIGHUP");
        await daemon.said("reloaded: 1 scene", ++times); // which is said once requests get it
    };
    const scene = await open(`${daemon.address}/room`), seldom = await open(`${daemon.address}/room`, { check: 3600 });
    const before = await scene.radiosity(new Float32Array(scene.n).fill(1)), { reflectance } = await scene.elements("reflectance");
    await replace("c"); // other reflectances: indices and areas mean what they did
    const after = await scene.radiosity(new Float32Array(scene.n).fill(1));
    assert.deepEqual(after.shape, before.shape);
    assert.notDeepEqual(after.values, before.values);
    assert.notDeepEqual((await scene.elements("reflectance")).reflectance, reflectance);
    const corners = await seldom.corners();
    await replace("b");
    const group = { [scene.names[0]]: 1 }, n = (await daemonOf(daemon).scene("room")).n;
    assert.notEqual(n, scene.n);
    for (const ask of [() => scene.irradiance(group, { select: { elements: [0] } }), () => scene.elements("area"), () => scene.jacobian({ elements: [0] }, { by: "groups" })])
        await assert.rejects(ask(), { kind: "scene-changed", message: new RegExp(`room (was replaced by one of another geometry|has ${n} elements instead of ${scene.n})`) });
    await assert.rejects(seldom.radiosity(group), { kind: "scene-changed", message: `the scene room answers the shape [${n}] instead of [${scene.n}]: it was replaced; open it again` });
    await assert.rejects(seldom.radiosity(group, { at: "corners" }), { kind: "scene-changed", message: new RegExp(`corners instead of ${corners.count}:|of another geometry: ${n} elements`) });
    await assert.rejects(seldom.adjoint(group), { kind: "scene-changed", message: /answers a gradient of \[|of another geometry: / });
    const again = await open(`${daemon.address}/room`);
    assert.deepEqual((await again.radiosity(group)).shape, [n]);
});

test("an answer that has its scene's tag needs no question more", async () => {
    const about = { elements: 2, channels: 1, groups: [{ name: "wall", elements: 2 }] };
    let tag = "1", hash = "h", asked = [];
    const fake = await startFake((request, response) => {
        asked.push(request.method);
        for (const [name, value] of [["Lambert-Scene", tag], ["ETag", `"${tag}"`]]) if (value !== null) response.setHeader(name, value);
        if (request.method !== "POST") return response.end(JSON.stringify({ ...about, provenance: { geometry_hash: hash } }));
        response.writeHead(200, { "Content-Type": "application/x-npy" }).end(writeNpy(Float32Array.of(1, 2)));
    });
    const scene = await open(`${fake.address}/room`), ask = async () => {
        asked = [];
        assert.deepEqual((await scene.radiosity({ wall: 1 })).values, Float32Array.of(1, 2));
        return asked;
    };
    assert.deepEqual(await ask(), ["POST"]);
    tag = "2"; // other materials or light
    assert.deepEqual([await ask(), await ask()], [["POST", "GET"], ["POST"]]);
    assert.deepEqual(await scene.radiosity({ wall: 1 }, { variant: "red" }).then(() => asked), ["POST", "POST", "HEAD"]);
    [tag, hash] = ["3", "another"];
    await assert.rejects(ask(), { kind: "scene-changed" });
    await assert.rejects(ask(), { kind: "scene-changed" });
    scene.check = -1;
    assert.deepEqual(await ask(), ["POST"]);
});

test("checks of a loop take no connections", async () => {
    const daemon = await startDaemon(join(FOLDER, "a.h5")), scene = await open(`${daemon.address}/a`);
    for (let i = 0; i < 20; i++) await scene.radiosity({ [scene.names[0]]: i });
    const text = new TextDecoder().decode((await scene.daemon.ask("GET", "metrics", { accept: "text/plain" })).body);
    const count = Number(/^lambertd_connections (\d+)/m.exec(text)[1]);
    assert.ok(count >= 1 && count <= 2, `${count} connections`);
});

const daemonOf = ({ address }) => connect(address);
