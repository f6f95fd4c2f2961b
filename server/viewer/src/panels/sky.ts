// The sky of a store that has one: its model, place and time, a day that goes by, and the weather file.
import { Newest } from "lambert-light";
import type { Page } from "../app/page.ts";
import { button, choice, fill, make, tick } from "../base/dom.ts";
import { count, numberText } from "../base/numbers.ts";
import type { Gaps } from "../daemon/daylight.ts";
import { dateOf, dayOf } from "../daylight/dates.ts";
import { placeOf } from "../daylight/sky_request.ts";
import type { Sky } from "../daylight/made_sky.ts";
import { clockOf, windOf, type SkySource } from "../daylight/source.ts";
import { SunPath } from "../daylight/sun_path.ts";
import { skyOff, type SkyLight } from "../state/state.ts";
import { makeDome } from "./dome.ts";
import type { Panel } from "./panel.ts";
import { player } from "./player.ts";
import { slider } from "./slider.ts";

/** A year has 1.6 MB; the daemon takes 16 MiB. */
const FILE_MOST = 16 * 2 ** 20;

const MONTHS = ["January", "February", "March", "April", "May", "June", "July", "August", "September", "October",
    "November", "December"];

export function dateText(day: number): string {
    const date = dateOf(day);
    return `${date.day} ${MONTHS[date.month - 1]}`;
}

const MODELS = [
    ["off", "None"],
    ["overcast", "Overcast (CIE)"],
    ["clear", "Clear (CIE)"],
    ["turbid", "Clear, by turbidity (Linke)"],
    ["given", "By direct and diffuse light (Perez)"],
    ["even", "Even"],
    ["perez", "Of a weather file (Perez)"],
] as const;

type Change = (to: Partial<SkyLight>, tag?: string | null) => void;

/** The sun by night: below the horizon by more than this, degrees. */
const NIGHT = -6;

/** The hour that is so many hours later, and by day where the sun rises at all. */
export function goOn(light: SkyLight, hours: number, path: Pick<SunPath, "at">): number {
    const wrap = (hour: number): number => ((hour % 24) + 24) % 24;
    const isNight = (hour: number): boolean => (path.at(light, hour)?.altitude ?? 0) < NIGHT;
    const next = wrap(light.hour + hours);
    for (let skipped = 0; skipped < 24; skipped += 0.25) {
        const hour = wrap(next + Math.sign(hours) * skipped);
        if (!isNight(hour)) return hour;
    }
    return next;
}

export function skyPanel(page: Page): Panel {
    const { store, scene, ask, tell } = page, { source } = scene.sky;
    const path = new SunPath(ask.api, () => update(), (reason) => tell.fail(reason));
    const change: Change = (to, tag = null) => {
        const { now } = store;
        store.change({ ...now, lighting: { ...now.lighting, sky: { ...now.lighting.sky, ...to } } }, tag);
    };
    const controls = makeControls(page, change);
    const weather = makeWeather(page, change, () => update());
    const dome = makeDome(), figures = make("table", { class: "figures" }),
        moment = make("p", { class: "moment", "aria-live": "off" });
    const day = player({
        what: "the day",
        speeds: [
            ["0.5", "½ hour a second"],
            ["1", "1 hour a second"],
            ["2", "2 hours a second"],
            ["4", "4 hours a second"],
        ],
        speed: "1",
        step: 0.5,
        stepLabel: "Half an hour",
        advance: (hours) =>
            change({ hour: Number(goOn(store.now.lighting.sky, hours, path).toFixed(3)) }, "hour of the sky"),
    });
    const note = make("p", { class: "hint", role: "status" });
    // The sky is also shown where the picture is without it, by solo.
    const asker = new Newest(
        (light: SkyLight) => source.sky(scene.now?.description.name ?? "", light, scene.sky.isPhotometric),
        () => update(),
        () => undefined,
        1,
    );
    const drawSky = (light: SkyLight): void => {
        const { now: open, sky: { isPhotometric } } = scene, { tiles } = source;
        const sky = open === null || tiles === null ? null : source.known(open.description.name, light, isPhotometric);
        if (open !== null && tiles !== null) path.want(light);
        // Until it has come, with the picture that needs it or alone, the one before it stays.
        if (sky === undefined) {
            if (store.now.lighting.solo !== null) asker.want(light);
            return;
        }
        const sun = sky?.made.sun ?? path.at(light);
        dome.draw(tiles, sky, sun);
        drawFigures(figures, dome.element, sky, sun, isPhotometric ? "lx" : "W/m²");
    };
    const update = (): void => {
        const light = store.now.lighting.sky;
        controls.update(light);
        weather.update(light);
        moment.textContent = `${dateText(light.day)}, ${clockOf(light.hour)}`;
        drawSky(light);
        note.textContent = noteOf(light, source, store.now.lighting.solo);
        note.hidden = note.textContent === "";
    };
    scene.on("scene", () => {
        day.stop();
        update();
    });
    scene.on("theme", update);
    scene.on("field", () => drawSky(store.now.lighting.sky));
    store.listen((now, before) => {
        if (now.lighting.sky !== before.lighting.sky || now.view.unit !== before.view.unit
            || now.view.sharpSun !== before.view.sharpSun) update();
    });
    return {
        id: "sky",
        title: "Sky",
        isUseful: () => scene.now?.description.sky !== null && scene.now !== null,
        isFirst: () => scene.now?.mesh.groups.every((group) => group.emission === null) ?? false,
        element: make("div", {}, controls.model, note, controls.strength, moment, controls.time, day.element,
            dome.element, figures, weather.element, controls.place),
    };
}

function noteOf(light: SkyLight, source: SkySource, solo: string | null): string {
    if (source.tiles === null) return "The tiles of this sky are not known yet.";
    if (solo !== null) return `Only ${solo} shines now (Lights, Solo), not the sky.`;
    if (light.model === "perez" && source.weather === null && source.weatherFor(light) === null)
        return light.moment === null
            ? "Pick a weather file below; until then this sky is dark."
            : `The link holds the weather of ${dateText(light.moment.day)}, ${
                clockOf(light.moment.hour)
            }, alone. Pick its file below; until then the sky of other times is dark.`;
    if (light.model === "perez" && source.request(light, false) === null)
        return "The weather file has nothing at this time.";
    return "";
}

/** Other skies are ten times as bright: an exposure that the page chose is found anew, that of a person stays. */
function changeModel({ store, scene }: Page, model: SkyLight["model"]): void {
    const { now } = store, exposure = scene.exposure.anew(now.view);
    store.change({ ...now, lighting: { ...now.lighting, sky: { ...now.lighting.sky, model } },
        view: { ...now.view, exposure } });
}

interface Controls {
    model: HTMLElement;
    strength: HTMLElement;
    time: HTMLElement;
    place: HTMLElement;
    update(light: SkyLight): void;
}

function makeControls(page: Page, change: Change): Controls {
    const { store, scene } = page;
    const first = skyOff;
    const model = choice("Sky", MODELS, first.model, (to) => changeModel(page, to));
    const sun = choice("Sun", [["spread", "Spread over tiles near it"], ["tile", "In one tile"], ["exact",
        "Itself, with its shadows"], ["off", "Left out"]], first.sun, (to) => change({ sun: to }));
    const sharp = tick("Sharp sun (drawn)", store.now.view.sharpSun, (on) => {
        const { now } = store;
        store.change({ ...now, view: { ...now.view, sharpSun: on } });
    });
    const drawn = make("p", { class: "hint" });
    const tellDrawn = (): void => {
        drawn.textContent = scene.isSunSharp
            ? `The picture has the sun in its true place, with the half-shadows of its disc once the view rests; all numbers have it ${
                store.now.lighting.sky.sun === "exact" ? "as a mean over each element" : "in tiles of the sky"
            }.`
            : "Not now: no sun shines, or the picture shows numbers (false colour, a threshold, a comparison).";
    };
    store.listen(tellDrawn);
    scene.on("field", tellDrawn);
    const tinted = tick("Blue sky, warm sun", first.tinted, (on) => change({ tinted: on }));
    const unit = (): string => (store.now.view.unit === "lx" ? "lx" : "W/m²");
    const strength = slider({ label: "On the ground", unit: unit(), least: 0, most: 1000, log: true,
        change: (value) => change({ strength: value }, "strength of the sky") }, first.strength);
    const turbidity = slider({ label: "Turbidity", least: 1.5, most: 8, step: 0.1,
        change: (value) => change({ turbidity: Math.min(20, Math.max(1, value)) }, "turbidity of the sky") },
        first.turbidity);
    const haze = make("p", { class: "hint" }, "2: very clean, cold air; 3: clear; 5: hazy; 7: polluted.");
    const direct = slider({ label: "Facing the sun", unit: "W/m²", least: 0, most: 1100, step: 5,
        change: (value) => change({ direct: Math.min(3000, value) }, "direct light") }, first.direct);
    const diffuse = slider({ label: "Sky on the ground", unit: "W/m²", least: 0, most: 600, step: 5,
        change: (value) => change({ diffuse: Math.min(3000, value) }, "diffuse light") }, first.diffuse);
    const factor = slider({ label: "Times", unit: "×", least: 0, most: 3, step: 0.01,
        change: (value) => change({ factor: value }, "factor of the sky") }, first.factor);
    const day = slider({ label: "Day", unit: "of 365", least: 1, most: 365, step: 1,
        change: (value) => change({ day: Math.min(365, Math.round(value)) }, "day of the sky") }, first.day);
    const hour = slider({ label: "Hour", unit: "h", least: 0, most: 24, step: 0.05,
        change: (value) => change({ hour: Math.min(24, value) }, "hour of the sky") }, first.hour);
    const latitude = slider({ label: "Latitude", unit: "° N", least: -90, most: 90, step: 0.1,
        change: (value) => change({ latitude: Math.min(90, value) }, "latitude") }, first.latitude);
    const longitude = slider({ label: "Longitude", unit: "° E", least: -180, most: 180, step: 0.1,
        change: (value) => change({ longitude: Math.min(180, value) }, "longitude") }, first.longitude);
    const zone = slider({ label: "Clock", unit: "h UTC", least: -12, most: 14, step: 0.25,
        change: (value) => change({ zone: Math.min(14, value) }, "zone") }, first.zone);
    const jumps = make("div", { class: "row" },
        ...([[3, 21], [6, 21], [9, 23], [12, 21]] as const).map(([month, d]) => {
            const name = MONTHS[month - 1], go = (): void => change({ day: dayOf(month, d) });
            return button(`${d} ${name.slice(0, 3)}`, `${d} ${name}`, go);
        }));
    const update = (light: SkyLight): void => {
        (model.querySelector("select") as HTMLSelectElement).value = light.model;
        (sun.querySelector("select") as HTMLSelectElement).value = light.sun;
        (tinted.querySelector("input") as HTMLInputElement).checked = light.tinted;
        const isPlain = light.model === "even" || light.model === "overcast";
        strength.element.hidden = !isPlain;
        factor.element.hidden = isPlain || light.model === "off";
        sun.hidden = factor.element.hidden;
        sharp.hidden = sun.hidden || light.sun === "off";
        (sharp.querySelector("input") as HTMLInputElement).checked = store.now.view.sharpSun;
        drawn.hidden = sharp.hidden || !store.now.view.sharpSun;
        turbidity.element.hidden = haze.hidden = light.model !== "turbid";
        direct.element.hidden = diffuse.element.hidden = light.model !== "given";
        tinted.hidden = scene.now?.description.channels !== 3 || light.model === "off";
        strength.setMost(Math.max(store.now.view.unit === "lx" ? 1e5 : 1000, light.strength));
        (strength.element.querySelector(".unit") as HTMLElement).textContent = unit();
        const sliders = { strength, factor, turbidity, direct, diffuse, day, hour, latitude, longitude, zone };
        for (const [name, one] of Object.entries(sliders)) one.set(light[name as keyof typeof sliders]);
    };
    return {
        model,
        strength: make("div", {}, strength.element, turbidity.element, haze, direct.element, diffuse.element,
            factor.element, sun, sharp, drawn, tinted),
        time: make("div", {}, day.element, jumps, hour.element),
        place: make("div", {}, make("h2", {}, "Place"), latitude.element, longitude.element, zone.element),
        update,
    };
}

/** The weather file: picked or dropped, and read by the daemon. */
function makeWeather({ scene, ask, tell }: Page, change: Change,
    done: () => void): { element: HTMLElement; update(light: SkyLight): void }
{
    const { source } = scene.sky;
    const about = make("p", { class: "hint" }), problem = make("p", { class: "bad", role: "alert" });
    const place = (): void => {
        const { weather } = source;
        if (weather === null) return;
        change({ model: "perez", ...placeOf(weather) });
    };
    // A file that was picked, until another scene is opened; null: that beside the store.
    let picked: File | null = null, gaps: Gaps = "refuse";
    const take = async (file: File | null): Promise<void> => {
        picked = file;
        if (file !== null) about.textContent = `Reading ${file.name} …`;
        try {
            if (file !== null && file.size > FILE_MOST)
                source.problem = `${file.name} has ${count(file.size)} bytes, a weather file at most ${
                    count(FILE_MOST)
                }.`;
            else if (await scene.sky.read(file, gaps)) place();
        } finally {
            done();
            ask.shown();
        }
    };
    const picker = make("input", {
        type: "file",
        accept: ".epw,.wea,.EPW,.WEA",
        "aria-label": "Weather file (EPW or WEA)",
        onchange: () => {
            const file = picker.files?.[0];
            if (file !== undefined) take(file).catch((reason: unknown) => tell.fail(reason));
            picker.value = "";
        },
    });
    const missing = choice("Missing rows (--gaps)", [["refuse", "Refused"], ["fill", "Filled"], ["skip", "Left out"]],
        gaps, (to) => {
        gaps = to;
        take(picked).catch((reason: unknown) => tell.fail(reason));
    });
    scene.on("scene", () => {
        picked = null;
        gaps = "refuse";
        (missing.querySelector("select") as HTMLSelectElement).value = gaps;
    });
    const element = make("div", { class: "drop" }, make("h2", {}, "Weather file"), about, problem, picker, missing,
        button("Its place", "Latitude, longitude and clock of the weather file", place));
    // Anywhere on the page, as a file that is dropped beside would replace the page.
    document.addEventListener("dragover", (event) => {
        if (event.dataTransfer?.types.includes("Files")) event.preventDefault();
    });
    document.addEventListener("drop", (event) => {
        const file = event.dataTransfer?.files[0];
        if (file === undefined) return;
        event.preventDefault();
        if (scene.now?.description.sky !== null && /\.(epw|wea)$/i.test(file.name))
            take(file).catch((reason: unknown) => tell.fail(reason));
    });
    const update = (light: SkyLight): void => {
        const { weather } = source;
        element.hidden = light.model === "off";
        (element.querySelector("button") as HTMLButtonElement).hidden = weather === null;
        missing.hidden = picked === null && (source.tiles?.weather ?? null) === null;
        problem.textContent = source.problem ?? "";
        problem.hidden = source.problem === null;
        about.textContent = weather === null
            ? "EPW or WEA. Pick it, or drop it on the page. The daemon reads it and keeps nothing of it."
            : `${weather.place}: ${count(Math.round(weather.hours.length * weather.step))} hours${
                weather.step === 1 ? "" : ` in ${count(weather.hours.length)} rows`
            }${
                source.isBeside
                    ? ", from beside the store."
                    : ". A link holds the weather of the time that is shown, not the file."
            }`;
    };
    return { element, update };
}

type Position = { azimuth: number; altitude: number } | null;

function drawFigures(table: HTMLTableElement, dome: HTMLElement, sky: Sky | null, sun: Position, unit: string): void {
    const altitude = sun === null ? "–" : `${sun.altitude.toFixed(1)}°`,
        wind = sun === null ? "–" : windOf(sun.azimuth);
    const rows: [string, string, string][] = [
        ["Sun's altitude", sun === null || sun.altitude > 0 ? altitude : `${altitude}, below the horizon`, "altitude"],
        ["Sun's azimuth", wind, "azimuth"],
        ["Sky on the ground", sky === null ? "–" : `${numberText(sky.diffuseHorizontal)} ${unit}`, "diffuse"],
        ["Sun on the ground", sky === null ? "–" : `${numberText(sky.directHorizontal)} ${unit}`, "direct"],
    ];
    if (sky !== null && sky.made.brightness !== null)
        rows.push(["Clearness ε", sky.made.clearness?.toFixed(2) ?? "no diffuse light", "clearness"], ["Brightness Δ",
            sky.made.brightness.toFixed(3), "brightness"]);
    fill(table,
        make("tbody", {},
            ...rows.map(([name, text, figure]) =>
                make("tr", {}, make("th", { scope: "row" }, name), make("td", { "data-sky": figure }, text))
            )));
    dome.setAttribute("aria-label", `Map of the sky, north above: sun at altitude ${altitude}, azimuth ${wind}.`);
}
