// Skies and emitters: skies are those of `lambert sky`, and the page shows what they give.
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { before, test } from "node:test";
import { Daemon, elementAt, inFolder, lambert, makeStore, near, openPage, pixel, settled, toSrgb, violations } from "./page.mjs";
import { sourceOf } from "./source.mjs";
import { epw, HOURS, LATITUDE, LONGITUDE, rowsOf, wea, ZONE } from "./weather.mjs";

let daemon, dayOf;
before(async () => {
    ({ dayOf } = await sourceOf("daylight/dates"));
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
    const turned = makeStore("turned", "patio", { generate: ["--elements", 300], precompute: ["--probes", 0, "--rays", 128, "--sky", "tregenza", "--north", 40] });
    daemon = await Daemon.start([patio, yard, dome, way, turned]);
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
        const k = HOURS.findIndex(([m, d, h]) => dayOf(m, d) === day && h === hour);
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

test("a link restores a sky", async () => {
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
    for (const one of [page, other]) {
        assert.deepEqual(one.faults, []);
        await one.context().close();
    }
});

test("the sun itself is the daemon's, by rays", async () => {
    const page = await openScene("yard");
    await skyTo(page, { model: "given", direct: 700, diffuse: 100, factor: 1, latitude: 40, longitude: 0, zone: 0, day: 80, hour: 10, sun: "exact" });
    await settled(page);
    const { emission: { sun, groups }, scale } = await page.evaluate(() => window.lambert.ask.wanted());
    // The daemon's own sky of this light, and its sun.
    const place = { latitude: 40, longitude: 0, zone: 0 };
    const { skies: [own] } = await daemon.json("/v1/scenes/yard/skies", { sky: { diffuse: 100, direct: 700, place, date: "21 Mar 10:00", sun_in_tiles: false } });
    assert.ok(Math.abs(sun.azimuth - own.sun.azimuth) < 1e-3 && Math.abs(sun.altitude - own.sun.altitude) < 1e-3, JSON.stringify([sun, own.sun]));
    const channels = await page.evaluate(() => window.lambert.scene.now.description.channels);
    assert.ok([sun.direct].flat().every((v) => Math.abs(v * scale - 700) < 1e-6 * 700));
    const emission = { sky: own.sky, sun: { azimuth: own.sun.azimuth, altitude: own.sun.altitude, direct: own.sun.normal } };
    if (groups !== undefined) emission.groups = Object.fromEntries(Object.entries(groups).map(([name, v]) => [name, Array.isArray(v) ? v.map((x) => x * scale) : v * scale]));
    const { radiosity } = await daemon.json("/v1/scenes/yard/radiosity", { emission });
    const wanted = channels === 1 ? [radiosity] : radiosity;
    const shown = await page.evaluate(() => {
        const [field] = window.lambert.scene.fields;
        return Array.from({ length: field.elements }, (_, i) => field.at(i)[0]);
    });
    const most = Math.max(...wanted[0]);
    assert.ok(most > 100 && shown.every((v, i) => Math.abs(v - wanted[0][i]) <= 2e-3 * most), JSON.stringify([most, shown.slice(0, 5), wanted[0].slice(0, 5)]));
    // A store of few emitters has it in its tile.
    await page.evaluate(() => window.lambert.ask.open("dome", null));
    await settled(page);
    await skyTo(page, { model: "clear", hour: 10, sun: "exact" });
    await settled(page);
    assert.deepEqual(Object.keys((await page.evaluate(() => window.lambert.ask.wanted())).emission), ["sky"]);
    assert.deepEqual(page.faults, []);
    await page.context().close();
});

test("a sky and its sun are turned as their store is", async () => {
    const page = await openScene("turned"), place = { latitude: 40, longitude: 0, zone: 0 }, asked = { name: "clear", place, date: "21 Mar 10:00", dark: true };
    await skyTo(page, { model: "clear", ...place, day: 80, hour: 10, sun: "tile" });
    await settled(page);
    const { emission, scale } = await page.evaluate(() => window.lambert.ask.wanted());
    const { skies: [turned, plain] } = await daemon.json("/v1/scenes/turned/skies", { skies: [asked, { ...asked, north: 0 }] });
    emission.sky.forEach((v, t) => assert.ok(Math.abs(v * scale - turned.sky[t]) <= 1e-6 * turned.sky[t]));
    assert.ok(plain.sky.some((v, t) => Math.abs(v - turned.sky[t]) > 0.1 * v));
    // The sun itself is at its own azimuth, which the daemon turns.
    await skyTo(page, { sun: "exact" });
    await settled(page);
    const { sun } = (await page.evaluate(() => window.lambert.ask.wanted())).emission;
    assert.ok(Math.abs(sun.azimuth - plain.sun.azimuth) < 1e-9 && !("north" in sun));
    assert.deepEqual(page.faults, []);
    await page.context().close();
});

test("a sky that the daemon refuses is told of once, and the next one is shown", async () => {
    const page = await openScene("yard");
    await skyTo(page, { model: "clear", hour: 10 });
    await settled(page);
    let refused = 0;
    const detail = "sky/dark is not a member that can stand here";
    await page.route("**/skies", (route) => {
        refused += 1;
        return route.fulfill({ status: 422, contentType: "application/problem+json", body: JSON.stringify({ status: 422, detail }) });
    });
    await skyTo(page, { hour: 11 });
    await page.getByText(`The daemon did not do what this page asked for (422): ${detail}`).waitFor();
    const shown = await page.evaluate(() => window.lambert.scene.answers);
    await page.waitForTimeout(1000);
    assert.ok(refused >= 1 && refused <= 4, `${refused} requests`);
    assert.equal(await page.evaluate(() => window.lambert.scene.answers), shown);
    await page.unroute("**/skies");
    await skyTo(page, { hour: 12 });
    await page.waitForFunction((before) => window.lambert.scene.answers > before, shown);
    await settled(page);
    assert.ok((await page.evaluate(() => window.lambert.ask.wanted())).emission.sky.length > 0);
    assert.deepEqual(page.faults, []);
    await page.context().close();
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

test("a weather file that is picked is read by the daemon, once, and its hours are skies", async () => {
    const page = await openScene("yard", { width: 360, height: 740 });
    await page.getByRole("tab", { name: "Sky" }).click();
    const sent = [], before = await skyNow(page);
    page.on("request", (request) => sent.push([request.method(), new URL(request.url()).pathname, request.postData() ?? ""]));
    writeFileSync(inFolder("bad.wea"), wea().replace("latitude 37.5", "latitude 375"));
    await page.getByLabel("Weather file (EPW or WEA)").setInputFiles(inFolder("bad.wea"));
    await page.getByText("bad.wea is not taken: weather.wea: line 2: latitude = 375, must be from -90 to 90.").waitFor();
    writeFileSync(inFolder("photo.wea"), Buffer.from([0xff, 0xd8, 0, 1, 2]));
    await page.getByLabel("Weather file (EPW or WEA)").setInputFiles(inFolder("photo.wea"));
    await page.getByText("photo.wea is not taken: text is neither an EPW nor a WEA").waitFor();
    assert.deepEqual(await skyNow(page), before);
    writeFileSync(inFolder("good.wea"), wea());
    await page.getByLabel("Weather file (EPW or WEA)").setInputFiles(inFolder("good.wea"));
    await page.getByText("Somewhere_XX: 120 hours. A link holds the weather of the time that is shown, not the file.").waitFor();
    await settled(page);
    const sky = await skyNow(page);
    assert.deepEqual([sky.model, sky.latitude, sky.longitude, sky.zone], ["perez", LATITUDE, LONGITUDE, ZONE]);
    // The text is sent to that route alone; an hour is sent as a sky of its light.
    const [read, rest] = [true, false].map((is) => sent.filter(([, path]) => (path === "/v1/weather") === is));
    assert.equal(read.length, 3);
    assert.deepEqual(JSON.parse(read[2][2]), { text: wea(), gaps: "refuse" });
    for (const [method, path, body] of rest) {
        assert.ok(method === "GET" ? body === "" : path.startsWith("/v1/scenes/yard/") || path === "/v1/sun", `${method} ${path}`);
        assert.ok(!body.includes("Somewhere") && !body.includes("time_zone"));
    }
    // Rows that are missing are refused, unless a person says otherwise.
    const hole = wea().split("\n").filter((_, k) => k !== 20).join("\n"), missing = page.getByLabel("Missing rows (--gaps)");
    writeFileSync(inFolder("hole.wea"), hole);
    await page.getByLabel("Weather file (EPW or WEA)").setInputFiles(inFolder("hole.wea"));
    await page.getByText("hole.wea is not taken: weather.wea: line 21 (2001-03-21 15:30): before it 1 hour is missing").waitFor();
    await missing.selectOption("skip");
    await page.getByText("Somewhere_XX: 119 hours.").waitFor();
    await missing.selectOption("fill");
    await page.getByText("Somewhere_XX: 120 hours.").waitFor();
    await page.getByText("hole.wea is not taken").waitFor({ state: "hidden" });
    await missing.selectOption("refuse");
    await page.getByText("hole.wea is not taken").waitFor();
    await page.getByLabel("Weather file (EPW or WEA)").setInputFiles(inFolder("good.wea"));
    await page.getByText("hole.wea is not taken").waitFor({ state: "hidden" });
    await settled(page);
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
