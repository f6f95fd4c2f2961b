// What the page asks the daemon for a sky by, what it makes of the answer, and the rows of weather between which it mixes.
import assert from "node:assert/strict";
import { test } from "node:test";
import { sourceOf } from "../source.mjs";
import { HOURS, LATITUDE, LONGITUDE, ZONE } from "../weather.mjs";

const daylight = { ...await sourceOf("daylight/source"), ...await sourceOf("daylight/made_sky"), ...await sourceOf("daylight/sky_request"), ...await sourceOf("daylight/weather"),
    ...await sourceOf("daylight/dates"), ...await sourceOf("daylight/sun_path") };
const state = await sourceOf("state/state"), { goOn } = await sourceOf("panels/sky"), { ofTemperature } = await sourceOf("base/colour");

const PLACE = { latitude: LATITUDE, longitude: LONGITUDE, zone: ZONE };
const lightOf = (to) => ({ ...state.skyOff, ...PLACE, day: 172, hour: 10.25, ...to });
const close = (a, b, by = 1e-9) => assert.ok(Math.abs(a - b) <= by * Math.abs(b), `${a} must be ${b}`);

/** Rows as POST /v1/weather answers them. */
const rowsOf = (hours, direct = "direct") => ({ place: "Somewhere", ...PLACE, step: 1, year: hours.map(([m]) => 1990 + m), month: hours.map(([m]) => m), day: hours.map(([, d]) => d),
    hour: hours.map(([, , h]) => h), [direct]: hours.map((row) => row[3]), diffuse: hours.map((row) => row[4]), dew_point: hours.map(([m]) => (m === 12 ? null : m)) });

/** Three tiles, the first two with the sun. */
const MADE = { sky: [1, 2, 3], diffuse: 5, direct: 40, clearness: 4, brightness: 0.2, north: 0,
    sun: { azimuth: 100, altitude: 30, direction: [0, 0, 1], normal: 80, tiles: [0, 1], radiance: [10, 20] } };

test("a sky is asked for by its own members, and by nothing that it is linear in", () => {
    const { skyRequest } = daylight, common = { place: PLACE, hour: 171 * 24 + 10.25, photometric: true, sun_in_tiles: false, sun_spread: false, dark: true };
    const asked = (to, weather = null) => skyRequest(lightOf({ sun: "tile", ...to }), true, weather);
    assert.equal(asked({ model: "off" }), null);
    for (const model of ["even", "overcast"]) assert.deepEqual(asked({ model, strength: 7 }), { name: model });
    assert.deepEqual(asked({ model: "clear" }), { name: "clear", ...common });
    assert.deepEqual(asked({ model: "turbid", turbidity: 2.5, sun: "spread" }), { name: "turbidity:2.5", ...common, sun_spread: true });
    assert.deepEqual(asked({ model: "given", direct: 700, diffuse: 120 }), { direct: 700, diffuse: 120, ...common });
    for (const [to, or] of [[{ factor: 2 }, {}], [{ tinted: true }, {}], [{ sun: "off" }, {}], [{ sun: "exact" }, {}]])
        assert.deepEqual(asked({ model: "clear", ...to }), asked({ model: "clear", ...or }));
    // The last hour of the year is below 8760.
    assert.ok(asked({ model: "clear", day: 365, hour: 24 }).hour < 8760);
    assert.equal(asked({ model: "perez" }), null);
    const weather = daylight.weatherFrom(rowsOf(HOURS)), row = HOURS.find(([m, d, h]) => m === 6 && d === 21 && h === 12.5);
    assert.deepEqual(asked({ model: "perez", hour: 12.5 }, weather), { direct: row[3], diffuse: row[4], dew_point: 6, year: 1996, ...common, hour: 171 * 24 + 12.5 });
    const flat = asked({ model: "perez", day: 355, hour: 12.5 }, daylight.weatherFrom(rowsOf(HOURS, "direct_horizontal")));
    assert.ok(flat.direct_horizontal > 0 && !("direct" in flat) && !("dew_point" in flat));
    assert.equal(asked({ model: "perez", day: 10 }, weather), null);
});

test("between the middles of two rows there is a mixture of both, whatever their order and step", () => {
    const half = Array.from({ length: 48 }, (_, k) => [6, 21, 0.25 + k / 2, 10 * (0.25 + k / 2), 5]), weather = { ...rowsOf(half), step: 0.5 };
    for (const rows of [weather, Object.fromEntries(Object.entries(weather).map(([name, value]) => [name, Array.isArray(value) ? value.toReversed() : value]))])
        for (const hour of [9.25, 9.4, 9.75, 10]) close(daylight.weatherAt(daylight.weatherFrom(rows), 172, hour).direct, 10 * hour);
    const made = daylight.weatherFrom(weather);
    // At the ends that of the nearest row, an hour away at most.
    assert.equal(daylight.weatherAt(made, 172, 0).direct, 2.5);
    assert.equal(daylight.weatherAt(made, 173, 0.7).direct, 237.5);
    assert.equal(daylight.weatherAt(made, 173, 0.8), null);
    // 29 February is at the time of the 28th.
    assert.equal(daylight.dayOf(2, 29), daylight.dayOf(2, 28));
    for (let day = 1; day <= 365; day++) assert.equal(daylight.dayOf(...Object.values(daylight.dateOf(day))), day);
});

test("strength, factor, sun and colours are those of the lighting", () => {
    const of = (to, made = MADE) => new daylight.Sky(made, lightOf(to));
    const plain = of({ model: "clear", factor: 2 });
    assert.deepEqual(plain.radiances(1), [22, 44, 6]);
    assert.deepEqual([plain.diffuseHorizontal, plain.directHorizontal], [10, 80]);
    assert.deepEqual(plain.parts(1), { sky: [2, 4, 6], sun: [20, 40, 0], direction: [0, 0, 1], light: [160, 160, 160] });
    assert.deepEqual(plain.exact(1), { sky: [2, 4, 6], sun: { azimuth: 100, altitude: 30, direct: 160 } });
    assert.deepEqual(plain.exact(3).sun.direct, [160, 160, 160]);
    for (const to of [{ sun: "off" }, { factor: 0 }]) {
        const without = of({ model: "clear", factor: 2, ...to });
        assert.deepEqual([without.parts(1), without.exact(1), without.directHorizontal], [null, null, 0]);
        assert.deepEqual(without.radiances(1), without.diffuse);
    }
    const [blue, warm, grey] = [12000, 5200, 6500].map(ofTemperature), tinted = of({ model: "clear", tinted: true });
    tinted.radiances(3).forEach((tile, t) => tile.forEach((v, c) => close(v, MADE.sky[t] * blue[c] + ([10, 20][t] ?? 0) * warm[c])));
    tinted.parts(3).light.forEach((v, c) => close(v, 80 * warm[c]));
    assert.deepEqual(tinted.radiances(1), [11, 22, 3]);
    of({ model: "clear", tinted: true, sun: "off" }).radiances(3)[0].forEach((v, c) => close(v, grey[c]));
    // Even and overcast skies are as strong as they are asked to be, whatever the daemon's unit.
    const even = of({ model: "even", strength: 250 }, { ...MADE, diffuse: 10000, direct: 0, sun: null });
    close(even.diffuseHorizontal, 250);
    close(even.diffuse[2], 0.075);
    assert.equal(even.parts(3), null);
});

test("a sky is asked for once, again after it failed, and of each scene", async () => {
    const asked = [];
    let fails = false;
    const source = new daylight.SkySource({ makeSky: async (scene, sky) => {
        asked.push([scene, sky]);
        if (fails) throw new Error("gone");
        return MADE;
    } });
    const clear = lightOf({ model: "clear" });
    assert.equal(source.known("a", lightOf({ model: "off" }), false), null);
    assert.equal(await source.sky("a", lightOf({ model: "perez" }), false), null);
    assert.equal(source.known("a", clear, false), undefined);
    const both = await Promise.all([source.sky("a", clear, false), source.sky("a", lightOf({ model: "clear", factor: 3 }), false)]);
    assert.deepEqual(both.map((sky) => sky.diffuseHorizontal), [5, 15]);
    assert.equal(source.known("a", clear, false).diffuseHorizontal, 5);
    assert.equal(asked.length, 1);
    await source.sky("b", clear, false);
    await source.sky("a", clear, true);
    assert.deepEqual(asked.map(([scene, { photometric }]) => [scene, photometric]), [["a", false], ["b", false], ["a", true]]);
    fails = true;
    const other = lightOf({ model: "clear", hour: 11 });
    await assert.rejects(source.sky("a", other, false), /gone/);
    assert.equal(source.known("a", other, false), undefined);
    fails = false;
    await source.sky("a", other, false);
    assert.equal(asked.length, 5);
    // Few are kept; those of a store that was replaced are not.
    for (let k = 0; k < 100; k++) await source.sky("a", lightOf({ model: "clear", hour: k / 10 }), false);
    assert.equal(source.known("a", other, false), undefined);
    assert.ok(source.known("a", lightOf({ model: "clear", hour: 9.9 }), false) !== undefined);
    source.take(null);
    assert.equal(source.known("a", lightOf({ model: "clear", hour: 9.9 }), false), undefined);
});

test("a link holds the weather of its hour, until a file is picked", () => {
    const source = new daylight.SkySource({}), light = lightOf({ model: "perez", hour: 12.75 });
    source.takeWeather(rowsOf(HOURS), false);
    const moment = source.momentOf(light), request = source.request(light, false);
    assert.deepEqual([moment.day, moment.hour, moment.year, moment.isHorizontal, moment.dewPoint], [172, 12.75, 1996, false, 6]);
    const elsewhere = new daylight.SkySource({});
    assert.deepEqual(elsewhere.request({ ...light, moment }, false), request);
    assert.equal(elsewhere.request({ ...light, moment, hour: 13 }, false), null);
    // That beside a store is on both sides.
    source.takeWeather(rowsOf(HOURS), true);
    assert.equal(source.momentOf(light), null);
});

test("the sun of a day is asked for once, and nights are left out of it", async () => {
    const asked = [], light = lightOf({ model: "clear" });
    // Up from 6 to 18 h; the azimuth turns past south.
    const path = new daylight.SunPath({ sunPositions: async (place, hours) => {
        asked.push([place, hours.length]);
        return { altitude: hours.map((h) => 90 * Math.sin((Math.PI * ((h % 24) - 6)) / 12)), azimuth: hours.map((h) => ((15 * (h % 24) + 180) % 360) - 180) };
    } }, () => undefined, assert.fail);
    assert.equal(path.at(light), null);
    assert.equal(goOn(light, 12, path), 22.25);
    path.want(light);
    path.want({ ...light, hour: 3 });
    await new Promise(setImmediate);
    assert.deepEqual(asked, [[PLACE, 97]]);
    const { altitude, azimuth } = path.at(light, 7.1);
    close(altitude, 90 * Math.sin((Math.PI * 1.1) / 12), 0.01);
    close(azimuth, 106.5, 0.01);
    for (const hour of [0, 12, 24]) assert.ok(Number.isFinite(path.at(light, hour).altitude));
    assert.ok(goOn(light, 12, path) > 5 && goOn(light, 12, path) < 6);
    assert.equal(goOn(light, 1, path), 11.25);
    assert.equal(path.at({ ...light, day: 173 }), null);
});
