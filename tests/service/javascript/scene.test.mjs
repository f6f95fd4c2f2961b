// Lambert's client beside plain requests to the same daemon: scenes, light, gradients and derivatives, variants, skies, weather.
// ADDRESS and TOKEN are of the daemon, which serves box and paint (three channels), office (luminaires, sensors) and yard (a sky).
import assert from "node:assert/strict";
import { test } from "node:test";
import { connect, floatsToHalves, halvesToFloats, LambertError, open } from "../../../deploy/js/lambert.js";

const { ADDRESS, TOKEN } = process.env, daemon = connect(ADDRESS, { token: TOKEN });
const [box, office, yard] = await Promise.all(["box", "office", "yard"].map((name) => daemon.scene(name)));

/** The JSON of a route, by a request that has nothing of the client. */
async function plain(path, body) {
    const how = body === undefined ? {} : { method: "POST", body: JSON.stringify(body) };
    const response = await fetch(`${ADDRESS}/v1/${path}`, { ...how, headers: { Authorization: `Bearer ${TOKEN}`, "Content-Type": "application/json" } });
    assert.equal(response.status, 200);
    return response.json();
}

const floats = (nested) => Float32Array.from(nested.flat(Infinity));
const same = (answer, nested, shape) => assert.deepEqual([answer.values, answer.shape], [floats(nested), shape]);
/** Numbers of either sign that are the same at each run. */
const some = (count, k = 1) => Float32Array.from({ length: count }, (_, i) => Math.sin(k + 7 * i));

test("what a scene consists of", async () => {
    const about = await plain("scenes/box"), lines = (await plain("scenes/box/groups")).groups, elements = await plain("scenes/box/elements");
    assert.deepEqual([box.name, box.n, box.channels, box.shape, box.units, box.about], ["box", about.elements, 3, [3, about.elements], "W", about]);
    assert.deepEqual([office.shape, office.units], [[office.n], "lm"]);
    assert.deepEqual(box.names, lines.map((line) => line.name));
    const { area, normal, centre, group, face, reflectance } = await box.elements();
    assert.deepEqual([area, group, face], [Float64Array.from(elements.area), Uint32Array.from(elements.group), Int32Array.from(elements.face)]);
    assert.deepEqual([normal.map((x) => x || 0), centre, reflectance], [floats(elements.normal), floats(elements.centre), floats(elements.reflectance)]);
    const asked = daemon.asked, groups = await box.groups();
    assert.deepEqual((await box.elements("area")).area, area);
    assert.deepEqual([...groups.keys()], box.names);
    for (const [g, line] of lines.entries()) {
        const { indices, ...rest } = groups.get(line.name);
        assert.deepEqual([rest, [...indices]], [line, elements.group.flatMap((of, i) => (of === g ? [i] : []))]);
    }
    await box.groups();
    assert.equal(daemon.asked, asked + 1); // what is known is not asked for again
    assert.deepEqual([...(await office.luminaires()).values()], (await plain("scenes/office/luminaires")).luminaires);
    assert.deepEqual([...(await office.sensors()).values()], (await plain("scenes/office/sensors")).sets);
    assert.deepEqual(await yard.sky(), await plain("scenes/yard/sky"));
    assert.deepEqual([await box.sky(), (await box.luminaires()).size, (await box.sensors()).size], [null, 0, 0]);
    assert.equal(Buffer.from(await box.mesh()).toString("latin1", 0, 4), "glTF");
});

test("a daemon and its scenes by their addresses", async () => {
    assert.deepEqual((await daemon.scenes()).map((line) => line.name), ["box", "office", "paint", "yard"]);
    assert.deepEqual([await daemon.refused(), await daemon.health(), (await daemon.openapi()).openapi], [[], true, "3.1.0"]);
    for (const [address, more] of [[`${ADDRESS}/box`, {}], [`${ADDRESS}/v1/scenes/box`, {}], [ADDRESS, { scene: "box" }], [`${ADDRESS}/`, { scene: "box" }]])
        assert.deepEqual((await open(address, { token: TOKEN, ...more })).about, box.about);
    await assert.rejects(open(ADDRESS, { token: TOKEN }), /has 4 scenes, so that one is named: box, office, paint, yard/);
    await assert.rejects(open(`${ADDRESS}/bax`, { token: TOKEN }), { status: 404, kind: "not-found", route: "GET /v1/scenes/bax" });
    await assert.rejects(open(`${ADDRESS}/box`), { status: 401, kind: "no-token" });
});

test("light of every form of emission", async () => {
    const { radiosity: whole } = await plain("scenes/box/radiosity", { emission: { groups: { lamp: [17, 12, 4] } } });
    const B = await box.radiosity({ lamp: [17, 12, 4] });
    same(B, whole, [3, box.n]);
    assert.deepEqual([B.unit, B.convertedBy, B.rows()[2]], ["W/m2", null, floats(whole[2])]);
    assert.ok(B.limited >= 0 && B.times.solve >= 0);
    same(await box.radiosity({ groups: { lamp: [17, 12, 4] } }), whole, [3, box.n]);
    const E = some(3 * box.n), rows = [0, 1, 2].map((c) => [...E.subarray(c * box.n, (c + 1) * box.n)]);
    const { radiosity: dense } = await plain("scenes/box/radiosity", { emission: rows });
    for (const emission of [E, Float64Array.from(E), rows, { values: E, shape: [3, box.n] }]) same(await box.radiosity(emission), dense, [3, box.n]);
    const { radiosity: grey } = await plain("scenes/box/radiosity", { emission: rows[0] });
    for (const emission of [E.subarray(0, box.n), rows[0]]) same(await box.radiosity(emission), grey, [3, box.n]);
    const linear = await plain("scenes/box/radiosity", { emission: rows, limit: false });
    same(await box.radiosity(E, { limit: false }), linear.radiosity, [3, box.n]);
    const elements = Uint32Array.of(5, 9), values = Float32Array.of(1, 2);
    same(await box.radiosity({ elements, values }), (await plain("scenes/box/radiosity", { emission: { elements: [5, 9], values: [1, 2] } })).radiosity, [3, box.n]);
    const lit = { luminaires: { row: 0.4 }, groups: { floor: "100lm" } };
    same(await office.irradiance(lit), (await plain("scenes/office/radiosity", { emission: lit, quantity: "irradiance" })).irradiance, [office.n]);
    same(await office.indirect(lit), (await plain("scenes/office/radiosity", { emission: lit, quantity: "indirect" })).indirect, [office.n]);
});

test("batches have an axis more, whatever their length", async () => {
    const E = some(box.n), many = [E, { lamp: 1 }, some(3 * box.n, 2)];
    const both = await box.radiosity(many), each = await Promise.all(many.map((one) => box.radiosity(one)));
    assert.deepEqual([both.shape, both.values], [[3, 3, box.n], floats(each.map((one) => [...one.values]))]);
    assert.deepEqual(both.limited.length ?? both.limited, both.limited.length === undefined ? each.reduce((sum, one) => sum + one.limited, 0) : 3);
    const office130 = Array.from({ length: 130 }, (_, i) => some(office.n, i)); // three requests, of 64, 64 and 2
    const asked = daemon.asked, long = await office.radiosity(office130);
    assert.deepEqual(long.shape, [130, office.n]);
    assert.ok([3, 4].includes(daemon.asked - asked)); // one more where answers have no tag of their scene
    assert.deepEqual(long.rows()[129], (await office.radiosity(office130[129])).values);
    same(await office.radiosity({ values: floats(office130.slice(0, 2).map((one) => [...one])), shape: [2, office.n] }), [...long.values.subarray(0, 2 * office.n)], [2, office.n]);
});

test("precision, places and units", async () => {
    const half = await box.radiosity({ lamp: 17 }, { format: "f2" }), single = await box.radiosity({ lamp: 17 }), double = await box.radiosity({ lamp: 17 }, { format: "f8" });
    assert.ok(half.data instanceof Uint16Array && double.values instanceof Float64Array);
    assert.deepEqual([half.data, half.values], [floatsToHalves(single.values), halvesToFloats(floatsToHalves(single.values))]);
    assert.deepEqual(Float32Array.from(double.values), single.values);
    const select = { groups: "floor" }, floor = await box.irradiance({ lamp: 17 }, { select });
    const wanted = await plain("scenes/box/radiosity", { emission: { groups: { lamp: 17 } }, select: { groups: ["floor"] }, quantity: "irradiance" });
    same(floor, wanted.irradiance, [3, (await box.groups()).get("floor").elements]);
    assert.deepEqual(floor.error, wanted.error);
    assert.equal((await box.radiosity({ lamp: 17 }, { select, format: "f4" })).error, null);
    assert.deepEqual((await box.radiosity({ lamp: 17 }, { stated: true })).error.light, "own");
    const refined = await box.radiosity({ lamp: 17 }, { tolerance: 1e-6 });
    assert.ok(refined.values instanceof Float64Array && refined.certificate > 0 && refined.iterations > 0);
    const lux = await box.irradiance({ lamp: 17 }, { unit: "lx" }), at = await box.radiosity({ lamp: 17 }, { at: "faces" });
    assert.deepEqual([lux.shape, lux.unit, at.shape], [[box.n], "lx", [3, box.about.faces]]);
    assert.match(lux.convertedBy, /179 lm\/W/);
    const sensors = await office.radiosity({ luminaires: { row: 1 } }, { select: { sensors: "desks" } });
    same(sensors, (await plain("scenes/office/radiosity", { emission: { luminaires: { row: 1 } }, select: { sensors: ["desks"] } })).irradiance, [(await office.sensors()).get("desks").count]);
});

test("light at corners has a mesh that fits", async () => {
    const { count, positions, normals, index, element } = await box.corners(), light = { groups: { lamp: 17 } };
    const B = await box.radiosity({ lamp: 17 }, { at: "corners" }), H = await box.irradiance(some(box.n), { at: "corners", limit: false });
    same(B, (await plain("scenes/box/radiosity", { emission: light, at: "corners" })).radiosity, [3, count]);
    assert.deepEqual([H.shape, positions.length, normals.length, element.length], [[3, count], 3 * count, 3 * count, count]);
    assert.equal(new Set(index).size, count);
    // Corners of an element are nearer to its centre than its perimeter is long; y of a mesh is z of the scene, z is -y.
    const { centre, normal, area } = await box.elements(["centre", "normal", "area"]);
    element.forEach((e, v) => {
        const at = [positions[3 * v], -positions[3 * v + 2], positions[3 * v + 1]], n = [normals[3 * v], -normals[3 * v + 2], normals[3 * v + 1]];
        assert.ok(at.reduce((sum, x, d) => sum + (x - centre[3 * e + d]) * normal[3 * e + d], 0) ** 2 < 1e-9, "it is in the plane of its element");
        assert.ok(n.reduce((sum, x, d) => sum + x * normal[3 * e + d], 0) > 0.8, "its normal is that of a surface of less than 30 degrees");
    });
    let total = 0; // front faces run counter-clockwise
    for (let t = 0; t < index.length; t += 3) {
        const [a, b, c] = [0, 1, 2].map((k) => positions.subarray(3 * index[t + k], 3 * index[t + k] + 3)), ab = b.map((x, d) => x - a[d]), ac = c.map((x, d) => x - a[d]);
        const cross = [ab[1] * ac[2] - ab[2] * ac[1], ab[2] * ac[0] - ab[0] * ac[2], ab[0] * ac[1] - ab[1] * ac[0]];
        total += Math.hypot(...cross) / 2;
        assert.ok(cross.reduce((sum, x, d) => sum + x * normals[3 * index[t] + d], 0) > -1e-9);
    }
    assert.ok(Math.abs(total - area.reduce((sum, m2) => sum + m2, 0)) < 1e-5 * total);
});

test("figures of groups and of sensors", async () => {
    const emission = { luminaires: { row: 0.4, desk: 1 } };
    const found = await office.reduce(emission, { sensors: "desks", figures: ["mean", "min"], atLeast: [10, 100] });
    const wanted = await plain("scenes/office/radiosity", { emission, reduce: { sensors: ["desks"], with: ["mean", "min", "share"], at_least: [10, 100] } });
    assert.deepEqual([found.figures, found.unit, found.error], [wanted.sensors, "lx", wanted.error]);
    const { figures: { floor } } = await box.reduce([{ lamp: 1 }, some(box.n).map(Math.abs)], { groups: ["floor"], quantity: "radiosity", limit: false });
    assert.deepEqual([floor.mean.length, floor.mean[0].length], [2, 3]);
    await assert.rejects(box.reduce({ lamp: 1 }, {}), /figures are of groups or of sensors/);
});

test("gradients and derivatives", async () => {
    const g = some(3 * box.n, 3), rows = [0, 1, 2].map((c) => [...g.subarray(c * box.n, (c + 1) * box.n)]);
    const { gradient } = await plain("scenes/box/adjoint", { cotangent: rows });
    const w = await box.adjoint(g);
    same(w, gradient.emission, [3, box.n]);
    // <g, M E> = <w, E>; both sides are sums of 3 n products in single precision, of which each factor is rounded.
    const E = some(3 * box.n, 4), B = await box.radiosity(E, { limit: false }), dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
    const size = dot(g.map(Math.abs), B.values.map(Math.abs));
    assert.ok(Math.abs(dot(g, B.values) - dot(w.values, E)) < 2 ** -20 * size);
    const both = await box.adjoint([g, { floor: 1 }]);
    assert.deepEqual([both.shape, both.values.subarray(0, 3 * box.n)], [[2, 3, box.n], w.values]);
    assert.ok((await box.adjoint(g, { format: "f8" })).values instanceof Float64Array);
    const light = { emission: { groups: { lamp: 17 } } }, gradients = ["groups", "reflectance"];
    const found = await box.adjoint({ groups: { floor: { mean: 1 } } }, { gradient: gradients, quantity: "irradiance", emission: { lamp: 17 } });
    const wanted = await plain("scenes/box/adjoint", { cotangent: { groups: { floor: { mean: 1 } } }, gradient: gradients, quantity: "irradiance", ...light });
    same(found.reflectance, wanted.gradient.reflectance, [3, box.n]);
    same(found.groups, wanted.gradient.groups, [3, box.names.length]);
    const desks = (await office.sensors()).get("desks").count, weights = some(desks);
    same(await office.adjoint({ sensors: { desks: weights } }, { gradient: "luminaires" }),
        (await plain("scenes/office/adjoint", { cotangent: { sensors: { desks: { values: [...weights] } } }, gradient: ["luminaires"] })).gradient.luminaires, [3]);
    const J = await office.jacobian({ sensors: "desks" }, { by: "luminaires" }), read = await plain("scenes/office/jacobian", { of: { sensors: ["desks"] }, by: ["luminaires"] });
    same(J.matrices.luminaires, read.jacobian.luminaires, [desks, 3]);
    assert.deepEqual([J.rows, J.columns], [{ desks: { first: 0, count: desks } }, read.columns]);
    assert.deepEqual((await box.jacobian({ groups: ["floor", "ceiling"] }, { by: ["groups"] })).rows, { floor: { first: 0, count: 1 }, ceiling: { first: 1, count: 1 } });
    same((await box.jacobian({ elements: [0, 17] }, { by: "groups" })).matrices.groups, (await plain("scenes/box/jacobian", { of: { elements: [0, 17] }, by: ["groups"] })).jacobian.groups, [3, 2, box.names.length]);
});

test("variants, skies, the sun and weather", async () => {
    const paint = await daemon.scene("paint"), red = await paint.variant("red", { floor: [0.6, 0.1, 0.1] });
    assert.equal(red.name, "paint@red");
    const own = await red.radiosity({ lamp: 17 });
    assert.deepEqual((await paint.radiosity({ lamp: 17 }, { variant: "red" })).values, own.values);
    assert.notDeepEqual((await paint.radiosity({ lamp: 17 })).values, own.values);
    await red.delete();
    await assert.rejects(red.radiosity({ lamp: 17 }), { status: 404 });
    await assert.rejects(paint.variant("red", { floor: 1.5 }), { status: 422, kind: "bad-value", pointer: "/groups/floor" });
    const sky = await yard.skies({ name: "overcast", lux_outside: 100 }), [other] = await yard.skies(["overcast"]);
    assert.deepEqual([sky.unit, sky.sky.length, other.sky[0] > sky.sky[0]], ["lx", (await yard.sky()).tiles, true]);
    const H = await yard.irradiance({ sky: Float64Array.from(sky.sky) }, { photometric: true });
    same(H, (await plain("scenes/yard/radiosity", { emission: { sky: sky.sky }, photometric: true, quantity: "irradiance" })).irradiance, H.shape);
    const place = { latitude: 52.5, longitude: 13.4, zone: 1 };
    assert.deepEqual(await daemon.sun(place, [4114, 4115.5], { year: 2026 }), await plain("sun", { place, hours: [4114, 4115.5], year: 2026 }));
    const text = "place Here\nlatitude 52.5\nlongitude -13.4\ntime_zone -15\nsite_elevation 30\nweather_data_file_units 1\n6 21 12.5 800 100\n";
    assert.deepEqual(await daemon.weather(text), await plain("weather", { text }));
    await assert.rejects(yard.weather(), { status: 422, kind: "not-in-store" });
});

test("what does not fit is refused before it is sent", async () => {
    const asked = daemon.asked, three = `[${box.n}] or [3, ${box.n}] as the scene box has, or one level more for a batch`;
    const wrong = async (ask, message, kind = "refused") => {
        const error = await ask.then(() => null, (reason) => reason);
        assert.ok(error instanceof LambertError, String(error));
        assert.deepEqual([error.message, error.kind, error.status], [message, kind, null]);
    };
    await wrong(box.radiosity(new Float32Array(399)), `emission has the shape [399], must have ${three}`, "wrong-length");
    await wrong(office.radiosity(new Float32Array(2)), `emission has the shape [2], must have [${office.n}] as the scene office has, or one level more for a batch`, "wrong-length");
    await wrong(box.radiosity([{ lamp: 1 }, new Float32Array(5)]), `emission 1 of the batch has the shape [5], must have ${three}`, "wrong-length");
    await wrong(box.radiosity({ values: new Float32Array(8), shape: [2, 2, 2] }), `emission has the shape [2, 2, 2], must have [3, ${box.n}] behind the number of a batch, m`, "wrong-length");
    await wrong(box.adjoint([1, 2]), `cotangent has the shape [2], must have ${three}`, "wrong-length");
    await wrong(box.radiosity([]), "emission is an empty batch");
    await wrong(box.radiosity([[1, 2], [3]]), "emission must be a list of numbers, or of lists of numbers of one length");
    await wrong(box.radiosity(7), "emission is 7, must be an object, a list or an array");
    await wrong(box.radiosity({ sky: [1], lamp: 2 }), "emission has sky beside lamp; put groups into { groups: { … } }");
    await wrong(box.radiosity({ lamp: NaN }), "/emission/groups/lamp = NaN, must be finite", "bad-value");
    await wrong(box.radiosity({ elements: [1], values: Float32Array.of(Infinity) }), "/emission/values/0 = Infinity, must be finite", "bad-value");
    await wrong(box.radiosity({ lamp: 1 }, { quantity: "light" }), "quantity light is none of radiosity, irradiance, indirect", "unknown-word");
    await wrong(box.radiosity({ lamp: 1 }, { format: "f3" }), "format f3 is none of f2, f4, f8", "unknown-word");
    await wrong(box.adjoint({ floor: 1 }, { gradient: [] }), "gradient names nothing; it is of emission, reflectance, sky, emitters, groups or luminaires");
    assert.equal(daemon.asked, asked);
    // The rest the daemon refuses, by the members of its problem.
    await assert.rejects(box.radiosity({ lmap: 1 }), { status: 422, kind: "unknown-group", pointer: "/emission/groups/lmap", route: "POST /v1/scenes/box/radiosity",
        type: "deploy/docs/api.md#unknown-group", message: /^POST \/v1\/scenes\/box\/radiosity: 422 .*did you mean "lamp"/ });
});
