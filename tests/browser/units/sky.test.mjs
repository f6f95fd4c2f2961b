// Skies and weather files: those of `lambert sky`, and by the formulas of their models.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, test } from "node:test";
import { sourceOf } from "../source.mjs";
import { epw, HOURS, LATITUDE, LONGITUDE, rowsOf, wea, ZONE } from "../weather.mjs";
import { tilings } from "./tilings.mjs";

const daylight = { ...await sourceOf("daylight/source"), ...await sourceOf("daylight/skies"), ...await sourceOf("daylight/tiles"), ...await sourceOf("daylight/sun") };
const state = await sourceOf("state/state");
const folder = mkdtempSync(join(tmpdir(), "lambert-units-")), inFolder = (name) => join(folder, name);
after(() => rmSync(folder, { recursive: true, force: true }));
const lambert = (...args) => execFileSync(process.env.LAMBERT ?? "lambert", args, { encoding: "utf8", stdio: ["ignore", "pipe", "pipe"] });

const lightOf = (to) => ({ ...state.skyOff, latitude: LATITUDE, longitude: LONGITUDE, zone: ZONE, ...to });

test("skies of weather are those of `lambert sky`", () => {
    for (const [tiling, answer] of Object.entries(tilings)) {
        const source = new daylight.SkySource();
        source.take(answer);
        for (const [file, text] of [["a.wea", wea()], ["flat.wea", wea(2)], ["a.epw", epw()]])
            for (const photometric of [false, true]) {
                writeFileSync(inFolder(file), text);
                lambert("sky", inFolder(file), "--tiles", tiling, "-o", inFolder("sky.npy"), ...(photometric ? ["--photometric"] : []));
                assert.ok(source.read(text, false), source.problem);
                const rows = rowsOf(inFolder("sky.npy"), source.tiles.count);
                assert.equal(rows.length, HOURS.length);
                let lit = 0;
                rows.forEach((row, k) => {
                    const [month, day, hour] = HOURS[k];
                    const got = source.radiances(lightOf({ model: "perez", sun: "tile", day: daylight.dayOf(month, day), hour }), photometric, 1);
                    lit += row.some((v) => v > 0) ? 1 : 0;
                    const off = row.findIndex((v, t) => !(Math.abs(got[t] - v) <= 1e-4 * v));
                    assert.equal(off, -1, `${file} ${HOURS[k]} tile ${off}: ${got[off]}, lambert sky has ${row[off]}`);
                });
                assert.ok(lit > 40, `${lit} hours are lit`);
            }
    }
});

/** Days of weather by middles of rows, 1/n hours each. */
const rowsBy = (n, dates, from = 0, to = 24) => dates.flatMap(([month, day]) => Array.from({ length: (to - from) * n }, (_, k) => [month, day, from + (k + 0.5) / n, 300, 90]));
const headed = (rows) => wea().split("\n").slice(0, 6).concat(rows.map(([m, d, h, ...light]) => [m, d, h.toFixed(3), ...light].join(" ")), "").join("\n");
const epwOf = (n, periods, rows) => epw().split("\n").slice(0, 7).concat(periods, rows.map(([m, d, h, direct, diffuse]) =>
    `1997,${m},${d},${Math.floor(h) + 1},${Math.round(60 * (h % 1 + 0.5 / n))},?,15.0,9,60,101300,0,0,300,0,${direct},${diffuse},0,0,0,0`), "").join("\n");

test("rows of any step are read, and the same rows refused, as by `lambert sky`", () => {
    const source = new daylight.SkySource(), [june20, june21, june22] = [20, 21, 22].map((day) => [6, day]);
    source.take(tilings.tregenza);
    const hours = (dates) => rowsBy(1, dates), stated = "DATA PERIODS,1,1,Data,Sunday,6/20,6/22", all = [june20, june21, june22];
    const year = Array.from({ length: 365 }, (_, k) => Object.values(daylight.dateOf(k + 1)));
    const files = [
        ["half.wea", headed(rowsBy(2, [june21]))], ["few.wea", headed(rowsBy(12, [june21]))], ["half.epw", epwOf(2, "DATA PERIODS,1,1,Data,Sunday,6/21,6/21", rowsBy(2, [june21]))],
        ["minutes.epw", epwOf(60, "DATA PERIODS,1,60,Data,Sunday,6/21,6/21", rowsBy(60, [june21]))], ["year.wea", headed(hours(year))],
        ["july.epw", epwOf(1, "DATA PERIODS,1,1,Data,Sunday,7/1,6/30", hours([...year.slice(181), ...year.slice(0, 181)]))], ["long.wea", headed([1.5, 4.5, 7.5, 10.5, 13.5, 16.5, 19.5, 22.5].map((h) => [6, 21, h, 300, 90]))],
        ["months.wea", headed(Array.from({ length: 12 }, (_, k) => [k + 1, 21]).flatMap((date) => hours([date])))], ["window.wea", headed(rowsBy(4, all, 8, 18))],
        ["missing.epw", epwOf(1, stated, hours([june20, june22]))], ["missing.wea", headed(hours([june20, june22]))], ["end.epw", epwOf(1, stated, hours([june20, june21]))],
        ["twice.epw", epwOf(1, stated, hours([june20, june20, june21, june22]))], ["order.wea", headed(hours([june21, june20, june22]))], ["mixed.wea", headed([...hours([june20]), ...rowsBy(2, [june21])])],
        ["odd.wea", headed(Array.from({ length: 40 }, (_, k) => [6, 21, 0.2 + 0.4 * k, 300, 90]))], ["march.wea", headed(hours(year.filter(([m, d]) => m !== 3 || d !== 5)))],
        ["hole.wea", headed(hours([june21]).filter((row) => row[2] !== 12.5))], ["short.wea", headed([...rowsBy(1, [june20], 8, 18), ...rowsBy(1, [june21], 8, 17), ...rowsBy(1, [june22], 8, 18)])],
        ["half.hour.epw", epwOf(2, stated, rowsBy(2, all).filter((_, k) => k !== 50))], ["years.wea", headed(hours([...year, ...year]))], ["date.epw", epwOf(1, "DATA PERIODS,1,1,Data,Sunday,6/31,7/1", hours([june21]))],
    ];
    const steps = {};
    let refused = 0;
    for (const [name, text] of files) {
        writeFileSync(inFolder(name), text);
        let problem = null;
        try {
            lambert("sky", inFolder(name), "--tiles", "grid:2x2", "-o", inFolder("sky.npy"));
        } catch (fault) {
            const said = fault.stderr.trim().replace(/^.*?: .*?: /, "");
            const advice = ", or give --gaps fill or --gaps skip";
            problem = `The weather file, ${said.replace(`fill the gap${advice}`, "fill the gap or take another file").replace(advice, "")}.`;
            refused += 1;
        }
        assert.equal(source.read(text, false), problem === null, `${name}: ${source.problem}, wanted ${problem}`);
        if (name !== "date.epw") assert.equal(source.problem, problem, name);
        if (problem === null) steps[name] = source.weather.step;
    }
    for (const [name, step] of [["half.wea", 1 / 2], ["few.wea", 1 / 12], ["half.epw", 1 / 2], ["minutes.epw", 1 / 60], ["year.wea", 1], ["long.wea", 3], ["window.wea", 1 / 4]])
        assert.equal(steps[name], step, name);
    assert.equal(refused, 13);
    // Values by night cannot matter; four days of a year are chosen, and a dew point that is missing passes.
    const dark = (rows, value) => rows.map(([m, d, h, direct, diffuse]) => [m, d, h, h < 2 ? value : direct, h < 2 ? value : diffuse]);
    const seasons = [3, 6, 9, 12].map((month) => year.find(([m, d]) => m === month && d === 21));
    for (const text of [headed(dark(hours([june21]), 9999)), headed(dark(hours([june21]), -1)), epwOf(1, "DATA PERIODS,1,1,Data,Sunday,3/21,12/21", hours(seasons))])
        assert.ok(source.read(text, false), source.problem);
    assert.ok(!source.read(headed(hours([june21]).map(([m, d, h, direct, diffuse]) => [m, d, h, h === 12.5 ? 9999 : direct, diffuse])), false));
    assert.match(source.problem, /line 19: radiation is missing by day, in this row; fill the gap or take another WEA/);
    // Between the middles of two rows there is a mixture of both, half an hour apart as an hour apart.
    const ramp = rowsBy(2, [june21]).map(([m, d, h]) => [m, d, h, 10 * h, 5 * h]);
    for (const text of [headed(ramp), epwOf(2, "DATA PERIODS,1,2,Data,Sunday,6/21,6/21", ramp)]) {
        assert.ok(source.read(text, false), source.problem);
        assert.equal(source.weather.step, 0.5);
        for (const hour of [9.25, 9.4, 9.75]) assert.ok(Math.abs(source.momentOf(lightOf({ model: "perez", day: 172, hour })).direct - 10 * hour) < 0.01);
    }
});

test("skies without weather have the light that they are given", () => {
    const tiles = daylight.tilesOf(tilings["reinhart:2"]), last = tiles.count - 1;
    for (const model of ["even", "overcast"]) {
        const { diffuse } = daylight.skyFor(tiles, lightOf({ model, strength: 250 }), false, null);
        assert.ok(Math.abs(daylight.horizontalOf(tiles, diffuse) - 250) < 1e-9);
        // (1 + 2 sin a) / 3 of Moon and Spencer, with the mean of sin a over the lowest band, cosine over solid angle.
        const wanted = model === "even" ? 1 : (1 + 2 * tiles.cosine[0] / tiles.solidAngle[0]) / (1 + 2 * tiles.cosine[last] / tiles.solidAngle[last]);
        assert.ok(Math.abs(diffuse[0] / diffuse[last] - wanted) < 1e-3 * wanted, `${model}: ${diffuse[0] / diffuse[last]}, not ${wanted}`);
    }
    for (const hour of [6, 8.3, 12, 15, 17.7]) {
        const [spread, tile] = ["spread", "tile"].map((sun) => daylight.skyFor(tiles, lightOf({ model: "clear", sun, hour }), false, null));
        assert.ok(Math.abs(spread.directHorizontal - tile.directHorizontal) < 1e-9 * tile.directHorizontal);
        // CIE S 011, type 12: the same ratios whatever the scale. The sun is in no tile of this one.
        const sun = tile.sun.direction, angle = (t) => Math.acos([0, 1, 2].reduce((sum, d) => sum + tiles.centre[3 * t + d] * sun[d], 0));
        const relative = (t) => (1 - Math.exp(-0.32 / tiles.centre[3 * t + 2])) * (1 + 10 * (Math.exp(-3 * angle(t)) - Math.exp(-1.5 * Math.PI)) + 0.45 * Math.cos(angle(t)) ** 2);
        const far = Array.from({ length: last }, (_, t) => t).filter((t) => angle(t) > 1 && tiles.centre[3 * t + 2] > 0.3 && tiles.centre[3 * t + 2] < 0.95);
        assert.ok(far.length > 50);
        // Means over tiles of 6 degrees differ from middles by their curvature, some (6 degrees / 2)² of it.
        for (const t of far) assert.ok(Math.abs(tile.diffuse[t] / tile.diffuse[far[0]] / (relative(t) / relative(far[0])) - 1) < 0.01);
    }
    const night = daylight.skyFor(tiles, lightOf({ model: "clear", hour: 0 }), true, null);
    assert.ok(night.sun.altitude < 0 && night.diffuse.every((v) => v === 0) && night.direct.every((v) => v === 0));
});

/** Rigollier, Bauer and Wald 2000 by hand, at one astronomical unit: altitude, turbidity; light facing the sun and diffuse light, W/m². */
const TURBID = [[90, 3, 998.3622, 107.8924], [60, 2, 1080.5055, 65.3644], [60, 7, 600.1684, 283.9284], [30, 3, 800.9181, 89.7986], [10, 5, 232.8363, 66.1409],
    [2, 3, 173.0286, 19.1081], [0.5, 7, 4.239, 6.9207], [-1, 3, 0, 0]];

test("a clear sky has the light of its turbidity, and a given one that which it is given", () => {
    for (const [degrees, turbidity, direct, diffuse] of TURBID) {
        const day = daylight.turbidDay({ altitude: (degrees * Math.PI) / 180, distance: 1 }, turbidity);
        assert.ok(Math.abs(day.direct - direct) < 1e-4 && Math.abs(day.diffuse - diffuse) < 1e-4, `${degrees} degrees, ${turbidity}: ${JSON.stringify(day)}`);
    }
    const source = new daylight.SkySource();
    source.take(tilings["reinhart:2"]);
    const close = (a, b) => assert.ok(Math.abs(a - b) <= 1e-9 * Math.abs(b), `${a} must be ${b}`);
    for (const hour of [6.5, 9, 12, 17]) {
        const { sun, ...sky } = source.sky(lightOf({ model: "turbid", turbidity: 4, hour }), false), day = daylight.turbidDay(sun, 4);
        close(sky.diffuseHorizontal, day.diffuse);
        close(sky.directHorizontal, day.direct * sun.direction[2]);
        const given = source.sky(lightOf({ model: "given", ...day, hour }), false);
        close(given.perez.clearness, sky.perez.clearness);
        given.diffuse.forEach((v, t) => close(v, sky.diffuse[t]));
    }
    // Skies of the same two irradiances are one sky, whether these come from a weather file or not; the sun of its year stands elsewhere by some .1 degrees.
    assert.ok(source.read(wea(), false));
    for (const photometric of [false, true]) {
        const [hour, direct, diffuse] = [12.5, ...HOURS.find(([m, d, h]) => m === 6 && d === 21 && h === 12.5).slice(3)];
        const at = { day: 172, hour, sun: "tile" }, [one, other] = [{ model: "perez" }, { model: "given", direct, diffuse }].map((sky) => source.radiances(lightOf({ ...at, ...sky }), photometric, 1));
        one.forEach((v, t) => assert.ok(Math.abs(other[t] - v) <= 2e-3 * v, `tile ${t}: ${other[t]}, not ${v}`));
    }
});
