// The lights: every group that emits, and any other that a person lets shine.
import { fromHex, luminance, ofTemperature, toHex, type Rgb } from "../base/colour.ts";
import { button, choice, fill, make, tick, unique } from "../base/dom.ts";
import type { Page } from "../app/page.ts";
import { emittersOf } from "../daemon/api.ts";
import { isSolo, unitOf, type GroupLight, type Lighting, type Preset } from "../state/state.ts";
import { luminaireList } from "./luminaires.ts";
import type { Panel } from "./panel.ts";
import { slider, type Slider } from "./slider.ts";

interface Row {
    element: HTMLElement;
    update(light: GroupLight, lighting: Lighting): void;
}

/** So many rows are drawn; a filter, which is there from so many lamps on, finds the others. */
const ROWS_MOST = 40, FILTER_FROM = 8;

export function lightsPanel(page: Page): Panel {
    const { store, scene } = page;
    const rows = new Map<string, Row>();
    const list = make("div", { class: "lights" });
    const presets = make("div", { class: "presets" });
    const change = (to: Partial<Lighting>, tag: string | null): void => {
        const { now } = store;
        store.change({ ...now, lighting: { ...now.lighting, ...to } }, tag);
    };
    const changeGroup = (name: string, to: Partial<GroupLight>, tag: string | null): void => {
        const { groups } = store.now.lighting;
        change({ groups: { ...groups, [name]: { ...groups[name], ...to } } }, tag);
    };
    const dim = slider({ label: "All", unit: "×", least: 0, most: 2, step: 0.01,
        change: (value) => change({ dim: value }, "dim") }, 1);
    const more = make("div", {});
    const hasEmitters = (): boolean => (scene.now?.description.emitters?.length ?? 0) > 0;
    // Stores of few emitters answer these alone.
    const shining = (): string[] => (hasEmitters()
        ? []
        : Object.keys(store.now.lighting.groups).filter((name) => scene.now?.mesh.groups.some((g) => g.name === name)));
    const filter = make("input", { type: "text", placeholder: "Part of a name",
        "aria-label": "Show lamps whose names have", oninput: () => draw() });
    const found = (): string[] => {
        const part = filter.value.trim().toLowerCase();
        return shining().filter((name) => name.toLowerCase().includes(part));
    };
    /** Of the lamps that the filter finds. */
    const turn = (on: boolean): void => {
        const { groups } = store.now.lighting;
        change({ groups: { ...groups, ...Object.fromEntries(found().map((name) => [name, { ...groups[name], on }])) } },
            null);
    };
    const several = make("div", { class: "row" }, button("All on", "Turn on all lamps listed", () => turn(true)),
        button("All off", "Turn off all lamps listed", () => turn(false)), filter);
    several.hidden = true;
    const draw = (): void => {
        const { lighting } = store.now, all = found(), names = all.slice(0, ROWS_MOST);
        several.hidden = shining().length < 2;
        filter.hidden = shining().length < FILTER_FROM;
        rows.clear();
        fill(list, ...names.map((name) => {
            const row = lightRow(page, name, lighting.groups[name], changeGroup,
                (solo) => change({ solo, soloLuminaire: null }, null));
            rows.set(name, row);
            return row.element;
        }));
        if (all.length > names.length)
            list.append(
                make("p", { class: "hint" }, `${all.length - names.length} more: name a part of theirs above.`),
            );
        if (scene.now?.mesh.groups.every((group) => group.emission === null) && scene.now.description.sky === null
            && scene.now.luminaires === null && names.length > 0)
            list.append(make("p", { class: "hint" }, "No group of this scene emits light: these do it in its place."));
        if (scene.now !== null && emittersOf(scene.now.description).length > 0)
            list.append(
                make("p", { class: "hint" }, "This store answers its own emitters alone: see the panel Emitters."),
            );
        drawMore();
    };
    const drawMore = (): void => {
        const { groups } = store.now.lighting;
        const others = scene.now?.mesh.groups.filter((g) => !(g.name in groups)).map((g) => g.name) ?? [];
        fill(more, others.length > 0 && !hasEmitters()
            && choice("Let another group shine", [["", "…"], ...others.map((n) => [n, n] as const)], "", (name) => {
                if (name !== "") changeGroup(name, { on: true, power: 1, colour: [1, 1, 1], kelvin: null }, null);
            }));
    };
    const update = (): void => {
        const { lighting } = store.now;
        dim.set(lighting.dim);
        const known = found().slice(0, ROWS_MOST);
        if (known.length !== rows.size || known.some((name) => !rows.has(name))) draw();
        for (const [name, row] of rows) row.update(lighting.groups[name], lighting);
    };
    scene.on("scene", () => {
        filter.value = "";
        draw();
        drawPresets(page, presets);
    });
    store.listen((now, before) => {
        if (now.lighting !== before.lighting) update();
        if (now.presets !== before.presets) drawPresets(page, presets);
    });
    const reset = button("As the scene comes", null, () => {
        if (scene.now !== null) store.change({ ...store.now, lighting: scene.now.defaultLighting });
    });
    return { id: "lights", title: "Lights",
        element: make("div", {}, dim.element, several, list, more, luminaireList(page), reset, presets) };
}

function lightRow({ store, scene }: Page, name: string, light: GroupLight,
    change: (name: string, to: Partial<GroupLight>, tag: string | null) => void,
    solo: (name: string | null) => void): Row
{
    const id = unique("light");
    const coloured = scene.now?.description.channels === 3;
    const on = tick(name, light.on, (is) => change(name, { on: is }, null));
    on.querySelector("span")?.setAttribute("id", id);
    const most = Math.max(1e-6, 4 * (light.power || 1));
    const power: Slider = slider({
        label: "Power",
        unit: unitOf(store.now.view, "radiosity"),
        least: 0,
        most,
        log: true,
        change: (value) => change(name, { power: value }, `power ${name}`),
    }, light.power);
    const swatch = make("input", {
        type: "color",
        "aria-label": `Colour of ${name}`,
        oninput: () => {
            const rgb = fromHex(swatch.value), L = luminance(rgb);
            change(name, { colour: L > 0 ? rgb.map((v) => v / L) as Rgb : [1, 1, 1], kelvin: null }, `colour ${name}`);
        },
    });
    const kelvin = slider({
        label: "Temperature",
        unit: "K",
        least: 1800,
        most: 12000,
        step: 50,
        change: (value) => change(name, { kelvin: value, colour: ofTemperature(value) }, `kelvin ${name}`),
    }, light.kelvin ?? 4000);
    const alone = button("Solo", `Only ${name}`, () => solo(store.now.lighting.solo === name ? null : name), {
        "aria-pressed": "false",
        "aria-label": `Solo ${name}`,
    });
    const element = make("section", { class: "light", "aria-labelledby": id },
        make("div", { class: "row" }, on, coloured && swatch, alone), power.element, coloured && kelvin.element);
    const update = (now: GroupLight, lighting: Lighting): void => {
        (on.querySelector("input") as HTMLInputElement).checked = now.on;
        power.set(now.power);
        const largest = Math.max(...now.colour, 1e-9);
        if (document.activeElement !== swatch) swatch.value = toHex(now.colour.map((v) => v / largest));
        if (now.kelvin === null) kelvin.unset("own");
        else kelvin.set(now.kelvin);
        alone.setAttribute("aria-pressed", String(lighting.solo === name));
        element.classList.toggle("dark", !now.on || (isSolo(lighting) && lighting.solo !== name));
    };
    update(light, store.now.lighting);
    return { element, update };
}

/** Lightings with names, which stand in the link. */
function drawPresets({ store }: Page, place: HTMLElement): void {
    const name = make("input", { type: "text", placeholder: "Name of this lighting",
        "aria-label": "Name of this lighting", maxlength: 60 });
    const keep = (): void => {
        const { now } = store, text = name.value.trim();
        if (text === "") return;
        const others = now.presets.filter((preset) => preset.name !== text);
        store.change({ ...now, presets: [...others, { name: text, lighting: now.lighting }] });
    };
    const shine = ({ lighting }: Preset): void => store.change({ ...store.now, lighting });
    const forget = (preset: Preset): void => {
        const { now } = store;
        store.change({ ...now, presets: now.presets.filter((other) => other !== preset) });
    };
    fill(place, make("h2", { class: "sub" }, "Presets"),
        ...store.now.presets.map((preset) =>
            make("div", { class: "row" }, button(preset.name, null, () => shine(preset), { class: "grow" }),
                button("×", `Forget ${preset.name}`, () => forget(preset)))
        ), make("form", { class: "row", onsubmit: (event: Event) => {
            event.preventDefault();
            keep();
        } }, name, make("button", { type: "submit" }, "Keep")));
}
