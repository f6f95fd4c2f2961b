// Skies and emitters: skies are those of `lambert sky`, and the page shows what they give.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { before, test } from "node:test";
import { Daemon, elementAt, inFolder, lambert, makeStore, near, openPage, pixel, settled, sourceOf, toSrgb, violations } from "./page.mjs";

/** Hours of clear, broken and overcast weather: every bin of clearness, a low sun, night, and a sun below the horizon. */
const HOURS = [];
for (const [month, day, cloud] of [[3, 21, 0], [6, 21, 0.15], [6, 22, 0.5], [12, 21, 0.3], [12, 22, 1]])
    for (let hour = 0; hour < 24; hour++) {
        const up = Math.max(0, Math.sin((Math.PI * (hour + 0.5 - 6)) / 12)) * (month === 12 ? 0.5 : 1);
        HOURS.push([month, day, hour + 0.5, Math.round(950 * Math.sqrt(up) * Math.max(0, 1 - 1.6 * cloud)), Math.round(up * (60 + 350 * cloud))]);
    }
const [LATITUDE, LONGITUDE, ZONE] = [37.5, -122.25, -8];

const wea = (units = 1) => `place Somewhere_XX\nlatitude ${LATITUDE}\nlongitude ${-LONGITUDE}\ntime_zone ${-15 * ZONE}\nsite_elevation 2.0\n`
    + `weather_data_file_units ${units}\n${HOURS.map((h) => h.join(" ")).join("\n")}\n`;
const epw = () => `LOCATION,Somewhere,XX,USA,TMY3,0,${LATITUDE},${LONGITUDE},${ZONE},2.0\nDESIGN CONDITIONS,0\nTYPICAL/EXTREME PERIODS,0\n`
    + "GROUND TEMPERATURES,0\nHOLIDAYS/DAYLIGHT SAVINGS,No,0,0,0\nCOMMENTS 1,\nCOMMENTS 2,\nDATA PERIODS,3,1,A,Sunday,3/21,3/21,B,Sunday, 6/21, 6/22,C,Sunday,12/21,12/22\n"
    + HOURS.map(([m, d, h, direct, diffuse]) => `1997,${m},${d},${h + 0.5},0,?,15.0,${m},60,101300,0,0,300,0,${direct},${diffuse},0,0,0,0\n`).join("");

let daemon, daylight, state, paths;
before(async () => {
    daylight = { ...await sourceOf("daylight/source"), ...await sourceOf("daylight/skies"), ...await sourceOf("daylight/tiles"), ...await sourceOf("daylight/sun") };
    state = await sourceOf("state/state");
    paths = await sourceOf("state/path");
    const patio = makeStore("patio", "patio", { generate: ["--elements", 300], precompute: ["--probes", 0, "--rays", 128, "--sky", "reinhart:2"] });
    writeFileSync(inFolder("patio.epw"), epw());
    const yard = makeStore("yard", "patio", { generate: ["--elements", 300], precompute: ["--probes", 0, "--rays", 128, "--sky", "tregenza"] });
    const dome = makeStore("dome", "patio", {
        generate: ["--elements", 300], precompute: ["--probes", 0, "--rays", 128, "--sky", "grid:12x5", "--emitters", "sky"],
    });
    const pose = (x, y) => ({ move: [x, y, 0.5], turn: { axis: [1, 0, 0], degrees: 180 } });
    writeFileSync(inFolder("lamp.json"), JSON.stringify({
        light: { polygon: [[-0.05, -0.05, 0], [0.05, -0.05, 0], [0.05, 0.05, 0], [-0.05, 0.05, 0]], emission: [10, 9, 7] },
        path: [pose(0.1, 0.1), pose(0.3, 0.45), pose(0.45, 0.1)],
    }));
    const way = makeStore("way", "cornell", {
        generate: ["--elements", 300], precompute: ["--path", inFolder("lamp.json"), "--frames", 5, "--paths", 500],
    });
    daemon = await Daemon.start([patio, yard, dome, way]);
});

/** Single-precision rows of an NPY file. */
function rowsOf(file, length) {
    const bytes = readFileSync(file), start = 10 + bytes.readUInt16LE(8);
    const values = new Float32Array(bytes.buffer.slice(bytes.byteOffset + start, bytes.byteOffset + bytes.length));
    return Array.from({ length: values.length / length }, (_, k) => values.subarray(k * length, (k + 1) * length));
}

const lightOf = (to) => ({ ...state.skyOff, latitude: LATITUDE, longitude: LONGITUDE, zone: ZONE, ...to });

test("skies of weather are those of `lambert sky`", async () => {
    for (const [name, tiling] of [["patio", "reinhart:2"], ["yard", "tregenza"], ["dome", "grid:12x5"]]) {
        const source = new daylight.SkySource();
        source.take(await daemon.json(`/v1/scenes/${name}/sky`));
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

test("rows of any step are read, and the same rows refused, as by `lambert sky`", async () => {
    const source = new daylight.SkySource(), [june20, june21, june22] = [20, 21, 22].map((day) => [6, day]);
    source.take(await daemon.json("/v1/scenes/yard/sky"));
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
    let refused = 0;
    for (const [name, text] of files) {
        writeFileSync(inFolder(name), text);
        let problem = null;
        try {
            lambert("sky", inFolder(name), "--tiles", "grid:2x2", "-o", inFolder("sky.npy"));
        } catch (fault) {
            problem = `The weather file, ${fault.stderr.trim().replace(/^.*?: .*?: /, "")}.`;
            refused += 1;
        }
        assert.equal(source.read(text, false), problem === null, `${name}: ${source.problem}, wanted ${problem}`);
        if (name !== "date.epw") assert.equal(source.problem, problem, name);
    }
    assert.equal(refused, 13);
    // Between the middles of two rows there is a mixture of both, half an hour apart as an hour apart.
    const ramp = rowsBy(2, [june21]).map(([m, d, h]) => [m, d, h, 10 * h, 5 * h]);
    for (const text of [headed(ramp), epwOf(2, "DATA PERIODS,1,2,Data,Sunday,6/21,6/21", ramp)]) {
        assert.ok(source.read(text, false), source.problem);
        assert.equal(source.weather.step, 0.5);
        for (const hour of [9.25, 9.4, 9.75]) assert.ok(Math.abs(source.momentOf(lightOf({ model: "perez", day: 172, hour })).direct - 10 * hour) < 0.01);
    }
});

test("skies without weather have the light that they are given", async () => {
    const tiles = daylight.tilesOf(await daemon.json("/v1/scenes/patio/sky")), last = tiles.count - 1;
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
        const relative = (t) => (1 - Math.exp(-0.32 / tiles.centre[3 * t + 2])) * (1 + 10 * Math.exp(-3 * angle(t)) + 0.45 * Math.cos(angle(t)) ** 2);
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

test("a clear sky has the light of its turbidity, and a given one that which it is given", async () => {
    for (const [degrees, turbidity, direct, diffuse] of TURBID) {
        const day = daylight.turbidDay({ altitude: (degrees * Math.PI) / 180, distance: 1 }, turbidity);
        assert.ok(Math.abs(day.direct - direct) < 1e-4 && Math.abs(day.diffuse - diffuse) < 1e-4, `${degrees} degrees, ${turbidity}: ${JSON.stringify(day)}`);
    }
    const source = new daylight.SkySource();
    source.take(await daemon.json("/v1/scenes/patio/sky"));
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

test("turbidity and irradiances are set on the page, and the figures say what they give", async () => {
    const page = await openScene("yard");
    await page.getByRole("tab", { name: "Sky" }).click();
    const panel = page.locator("#panel-sky"), figure = async (name) => Number((await panel.locator(`[data-sky=${name}]`).innerText()).replace(/[^0-9.].*$/, ""));
    const exposureNow = () => page.evaluate(() => window.lambert.store.now.view.exposure), before = await exposureNow();
    await panel.getByRole("combobox", { name: "Sky" }).selectOption("turbid");
    await settled(page);
    // A sky that is many times as bright is not all white; an exposure that a person chose stays.
    assert.ok(await exposureNow() < before - 2, `${before} EV, then ${await exposureNow()}`);
    const clear = [await figure("direct"), await figure("diffuse"), await figure("clearness")];
    await panel.getByRole("spinbutton", { name: "Turbidity" }).fill("6");
    await page.keyboard.press("Enter");
    await settled(page);
    const hazy = [await figure("direct"), await figure("diffuse"), await figure("clearness")];
    assert.ok(hazy[0] < 0.8 * clear[0] && hazy[1] > 1.5 * clear[1] && hazy[2] < clear[2], `${clear}; ${hazy}`);
    await page.evaluate(() => { const { store: s } = window.lambert; s.change({ ...s.now, view: { ...s.now.view, exposure: -3 } }); });
    await panel.getByRole("combobox", { name: "Sky" }).selectOption("given");
    await settled(page);
    assert.equal(await exposureNow(), -3);
    await panel.getByRole("spinbutton", { name: "Facing the sun in W/m²" }).fill("0");
    await panel.getByRole("spinbutton", { name: "Sky on the ground in W/m²" }).fill("250");
    await page.keyboard.press("Enter");
    await settled(page);
    assert.deepEqual([await figure("direct"), await figure("diffuse"), await figure("clearness")], [0, 250, 1]);
    assert.deepEqual(await violations(page), []);
    assert.deepEqual(page.faults, []);
    await page.context().close();
});

const skyTo = (page, to) => page.evaluate((sky) => {
    const { store } = window.lambert;
    store.change({ ...store.now, lighting: { ...store.now.lighting, sky: { ...store.now.lighting.sky, ...sky } } });
}, to);
const skyNow = (page) => page.evaluate(() => window.lambert.store.now.lighting.sky);

/** A page that shows a scene as the scene comes. */
async function openScene(name, options) {
    const page = await openPage(daemon.address, options);
    await page.evaluate((to) => window.lambert.ask.open(to, null), name);
    await settled(page);
    return page;
}

test("the weather beside the store is taken, and pixels are what its sky gives", async () => {
    const page = await openScene("patio");
    const sky = await skyNow(page);
    assert.deepEqual([sky.model, sky.latitude, sky.longitude, sky.zone], ["perez", LATITUDE, LONGITUDE, ZONE]);
    await page.getByRole("tab", { name: "Sky" }).click();
    lambert("sky", inFolder("patio.epw"), "--tiles", "reinhart:2", "-o", inFolder("patio.npy"));
    const rows = rowsOf(inFolder("patio.npy"), 577);
    await page.evaluate(() => {
        const { store } = window.lambert, { now } = store;
        const groups = Object.fromEntries(Object.entries(now.lighting.groups).map(([name, light]) => [name, { ...light, on: false }]));
        store.change({ ...now, lighting: { ...now.lighting, groups }, view: { ...now.view, smooth: false, tone: "linear", exposure: -9 } });
    });
    for (const [day, hour] of [[172, 12.5], [172, 17.5], [355, 10.5]]) {
        await skyTo(page, { sun: "tile", day, hour });
        await settled(page);
        const k = HOURS.findIndex(([m, d, h]) => daylight.dayOf(m, d) === day && h === hour);
        let seen = 0;
        for (const [x, y] of [[0.3, 0.55], [0.7, 0.55], [0.5, 0.8], [0.5, 0.5], [0.4, 0.75]]) {
            const element = await elementAt(page, x, y);
            if (element === null || element < 0) continue;
            const answer = await daemon.json("/v1/scenes/patio/radiosity", { emission: { sky: [...rows[k]] }, select: { elements: [element] } });
            near(await pixel(page, x, y), toSrgb(answer.radiosity.map((channel) => channel[0] * 2 ** -9)), 2);
            seen += 1;
        }
        assert.ok(seen >= 3, `${seen} points show the scene`);
        const horizontal = (await page.locator("[data-sky=diffuse]").innerText()).replace(/ W\/m²$/, "");
        assert.ok(Math.abs(Number(horizontal) - HOURS[k][4]) <= 0.005 * HOURS[k][4], `${horizontal} is shown, the file has ${HOURS[k][4]}`);
    }
    assert.deepEqual(page.faults, []);
    await page.context().close();
});

test("a link restores a sky, and one that is spoilt is held within its range", async () => {
    const page = await openScene("yard");
    assert.equal((await skyNow(page)).model, "overcast");
    await skyTo(page, { model: "clear", hour: 9.25, day: 80, latitude: -33, sun: "tile" });
    await settled(page);
    await page.waitForFunction(() => location.hash.length > 3);
    await page.waitForTimeout(500);
    const [hash, wanted, sky] = await page.evaluate(() => [location.hash, window.lambert.ask.wanted(), window.lambert.store.now.lighting.sky]);
    const other = await openPage(daemon.address, { hash });
    assert.deepEqual(await skyNow(other), sky);
    assert.deepEqual(await other.evaluate(() => window.lambert.ask.wanted()), wanted);
    assert.equal(wanted.emission.sky.length, 145);
    // What strangers put into a link is held within its range.
    const spoilt = (to) => `#1.${Buffer.from(JSON.stringify({ scene: "yard", lighting: { sky: to } })).toString("base64url")}`;
    const third = await openPage(daemon.address, { hash: spoilt({ model: "none", latitude: 1e9, day: "x", hour: -3 }) });
    assert.deepEqual(await skyNow(third), { ...state.skyOff, latitude: 90, hour: 0 });
    for (const one of [page, other, third]) {
        assert.deepEqual(one.faults, []);
        await one.context().close();
    }
});

test("a store of the tiles of a sky takes a sky, or their weights", async () => {
    const page = await openScene("dome");
    await page.getByRole("tab", { name: "Sky" }).click();
    await skyTo(page, { model: "clear", tinted: true, hour: 10 });
    await settled(page);
    const { emission, scale } = await page.evaluate(() => window.lambert.ask.wanted());
    assert.deepEqual(Object.keys(emission), ["sky"]);
    assert.ok(emission.sky.length === 60 && emission.sky.every((v) => v.length === 3));
    const shownNow = () => page.evaluate(() => {
        const [field] = window.lambert.scene.fields;
        return [0, 1, 2].flatMap((c) => Array.from({ length: field.elements }, (_, i) => field.at(i)[c]));
    });
    // Answers come in half precision of the emission scaled to at most 1: 11 digits, and steps of 2^-24 below 2^-14.
    const isNear = (got, wanted, unit) => got.forEach((v, i) => assert.ok(Math.abs(v - wanted[i]) <= 2 ** -11 * wanted[i] + 2 ** -24 * unit, `${v}, wanted ${wanted[i]} of ${i}`));
    const answer = await daemon.json("/v1/scenes/dome/radiosity", { emission: { emitters: emission.sky } });
    isNear(await shownNow(), answer.radiosity.flat().map((v) => v * scale), scale);
    await skyTo(page, { model: "off" });
    await page.getByRole("tab", { name: "Emitters" }).click();
    const part = page.getByLabel("Show emitters whose names have");
    await part.fill("tile 59");
    await page.getByTitle("Only tile 59").click();
    await settled(page);
    assert.deepEqual(await page.evaluate(() => window.lambert.store.now.lighting.emitters), { 59: 1 });
    const alone = await daemon.json("/v1/scenes/dome/radiosity", { emission: { emitters: { "tile 59": 1 } } });
    isNear(await shownNow(), alone.radiosity.flat(), 1);
    assert.deepEqual(page.faults, []);
    await page.context().close();
});

test("a day goes by, by keys too, and stands still for those who ask for it", async () => {
    const page = await openScene("yard");
    await skyTo(page, { model: "clear" });
    await page.getByRole("tab", { name: "Sky" }).click();
    const slider = page.locator("#panel-sky").getByLabel("Hour", { exact: true });
    await slider.focus();
    await page.keyboard.press("ArrowRight");
    assert.ok(Math.abs((await skyNow(page)).hour - 12.05) < 1e-9);
    const play = page.getByRole("button", { name: "Play the day" });
    await play.focus();
    await page.keyboard.press("Enter");
    await page.waitForFunction(() => window.lambert.store.now.lighting.sky.hour > 12.5);
    await page.getByRole("button", { name: "Pause the day" }).click();
    await settled(page);
    const { hour } = await skyNow(page);
    await page.waitForTimeout(300);
    assert.equal((await skyNow(page)).hour, hour);
    assert.deepEqual(await violations(page), []);
    await page.emulateMedia({ reducedMotion: "reduce" });
    await play.waitFor({ state: "hidden" });
    await page.getByRole("button", { name: "Half an hour on" }).click();
    assert.ok(Math.abs((await skyNow(page)).hour - hour - 0.5) < 1e-3);
    assert.deepEqual(page.faults, []);
    await page.context().close();
});

test("a weather file that is picked stays on the page", async () => {
    const page = await openScene("yard", { width: 360, height: 740 });
    await page.getByRole("tab", { name: "Sky" }).click();
    const sent = [];
    page.on("request", (request) => sent.push([request.method(), new URL(request.url()).pathname, request.postData() ?? ""]));
    writeFileSync(inFolder("bad.wea"), wea().replace("latitude 37.5", "latitude 375"));
    await page.getByLabel("Weather file (EPW or WEA)").setInputFiles(inFolder("bad.wea"));
    await page.getByText("line 2: latitude is \"375\", must be a number from -90 to 90").waitFor();
    writeFileSync(inFolder("good.wea"), wea());
    await page.getByLabel("Weather file (EPW or WEA)").setInputFiles(inFolder("good.wea"));
    await page.getByText("Somewhere_XX: 120 hours. A link holds the weather of the time that is shown, not the file.").waitFor();
    await settled(page);
    const sky = await skyNow(page);
    assert.deepEqual([sky.model, sky.latitude, sky.longitude, sky.zone], ["perez", LATITUDE, LONGITUDE, ZONE]);
    assert.ok(sent.length > 0);
    for (const [method, path, body] of sent) {
        // The browser may ask for the icon of the page meanwhile; nothing has the file, or any hour of it.
        assert.ok(method === "GET" ? body === "" : path.startsWith("/v1/scenes/yard/"), `${method} ${path}`);
        assert.ok(!body.includes("Somewhere") && !body.includes("time_zone"));
    }
    // A link has the weather of its hour, so that the picture is the same elsewhere; of other hours the page says that it is missing.
    await skyTo(page, { day: 172, hour: 10.25 });
    await settled(page);
    await page.waitForTimeout(500);
    const other = await openPage(daemon.address, { hash: await page.evaluate(() => location.hash), width: 360, height: 740 });
    const [one, two] = await Promise.all([page, other].map((p) => p.evaluate(() => ({ scale: window.lambert.scene.fields[0].scale, bits: [...window.lambert.scene.fields[0].bits] }))));
    assert.ok(Math.max(...one.bits) > 0);
    assert.deepEqual(two, one);
    assert.equal((await skyNow(other)).moment.hour, 10.25);
    await other.getByRole("tab", { name: "Sky" }).click();
    await skyTo(other, { hour: 11 });
    await other.getByText("The link holds the weather of 21 June, 10:15, alone.").waitFor();
    await other.getByLabel("Weather file (EPW or WEA)").setInputFiles(inFolder("good.wea"));
    await settled(other);
    assert.ok(Math.max(...await other.evaluate(() => [...window.lambert.scene.fields[0].bits])) > 0);
    assert.deepEqual(other.faults, []);
    await other.context().close();
    assert.deepEqual(await violations(page), []);
    await page.context().close();
});

test("a lamp on its way is the mixture of its neighbouring positions", async () => {
    assert.deepEqual([paths.positionOf({ 2: 3 }), paths.positionOf({ 1: 1, 2: 3 }), paths.positionOf({ 1: 1, 3: 1 }), paths.positionOf({})], [2, 1.75, null, null]);
    const page = await openScene("way");
    assert.deepEqual(await page.evaluate(() => window.lambert.store.now.lighting.emitters), { 0: 1 });
    await page.getByRole("tab", { name: "Emitters" }).click();
    await page.getByRole("spinbutton", { name: "Position", exact: true }).fill("1.25");
    await page.keyboard.press("Enter");
    await settled(page);
    assert.deepEqual(await page.evaluate(() => window.lambert.store.now.lighting.emitters), { 1: 0.75, 2: 0.25 });
    const values = await page.evaluate(() => {
        const [field] = window.lambert.scene.fields;
        return [0, 1, 2].flatMap((c) => Array.from({ length: field.elements }, (_, i) => field.at(i)[c]));
    });
    const answers = await daemon.json("/v1/scenes/way/radiosity", { emissions: [{ emitters: [0, 1, 0, 0, 0] }, { emitters: [0, 0, 1, 0, 0] }] });
    const [one, other] = answers.radiosity.map((channels) => channels.flat());
    const scale = Math.max(...one, ...other);
    assert.equal(values.length, one.length);
    // Half precision keeps 11 digits of each value.
    values.forEach((v, i) => assert.ok(Math.abs(v - 0.75 * one[i] - 0.25 * other[i]) <= 2 ** -11 * Math.abs(v) + 1e-6 * scale));
    await page.getByRole("button", { name: "One position on" }).click();
    assert.deepEqual(await page.evaluate(() => window.lambert.store.now.lighting.emitters), { 2: 0.75, 3: 0.25 });
    assert.deepEqual(await violations(page), []);
    assert.deepEqual(page.faults, []);
    await page.context().close();
});
