// The luminaires of a store: a row for each group of them, which opens to its members, and for each of the others.
import { fromHex, luminance, ofTemperature, toHex, type Rgb } from "../base/colour.ts";
import { button, fill, make, tick, unique } from "../base/dom.ts";
import { count, numberText } from "../base/numbers.ts";
import type { Page } from "../app/page.ts";
import { commonLightOf, lightOf, lumensOf, ownColourOf, withRows, type LuminaireRow } from "../state/luminaires.ts";
import type { Lighting, LuminaireLight } from "../state/state.ts";
import { slider } from "./slider.ts";

interface Row {
    element: HTMLElement;
    update(lighting: Lighting): void;
    /** Shows the members of a group. */
    open(): void;
}

/** So many rows are drawn, and members of a group; a filter, which is there from so many luminaires on, finds the
 * others. */
const ROWS_MOST = 40, FILTER_FROM = 8;

const WHITE: Rgb = [1, 1, 1];

export function luminaireList(page: Page): HTMLElement {
    const { store, scene } = page;
    let rows = new Map<string, Row>();
    const list = make("div", { class: "lights" }), sum = make("p", { class: "hint", "data-figure": "lumens" });
    const filter = make("input", { type: "text", placeholder: "Part of a name",
        "aria-label": "Show luminaires whose names have", oninput: () => draw() });
    const turn = (on: boolean): void => {
        const { now } = store;
        store.change({ ...now, lighting: { ...now.lighting, luminaires: withRows(found(), now.lighting, { on }) } });
    };
    const several = make("div", { class: "row" }, button("All on", "Turn on all luminaires listed", () => turn(true)),
        button("All off", "Turn off all luminaires listed", () => turn(false)), filter);
    const openings = tick("Draw openings", true, (on) => {
        const { now } = store;
        store.change({ ...now, view: { ...now.view, openings: on } });
    });
    const section = make("section", { "aria-label": "Luminaires", hidden: true },
        make("h2", { class: "sub" }, "Luminaires"), sum, openings, several, list);
    /** Groups and luminaires by a part of their names; of a group that has not got it, the luminaires that have. */
    const found = (): LuminaireRow[] => {
        const part = filter.value.trim().toLowerCase(),
            has = ({ name }: { name: string }): boolean => name.toLowerCase().includes(part);
        return (scene.now?.luminaires?.rows ?? []).flatMap((row) =>
            has(row) || !row.isGroup ? (has(row) ? [row] : []) : row.members.filter(has).map(rowOf)
        );
    };
    const draw = (): void => {
        const { luminaires } = scene.now ?? {}, all = found();
        section.hidden = luminaires === undefined || luminaires === null;
        filter.hidden = (luminaires?.list.length ?? 0) < FILTER_FROM;
        several.hidden = (luminaires?.rows.length ?? 0) < 2;
        rows = new Map();
        fill(list, ...drawRows(page, all, rows));
        update();
    };
    const update = (): void => {
        const { lighting, view } = store.now, { luminaires } = scene.now ?? {};
        for (const row of rows.values()) row.update(lighting);
        (openings.querySelector("input") as HTMLInputElement).checked = view.openings;
        if (luminaires === undefined || luminaires === null) return;
        const { length } = luminaires.list;
        sum.textContent = `${count(length)} luminaire${length === 1 ? "" : "s"}, together ${
            numberText(lumensOf({ members: luminaires.list }, lighting))
        } lm`;
    };
    /** Shows the row of a luminaire that was picked in the picture. */
    const show = (name: string): void => {
        const group = scene.now?.luminaires?.list.find((one) => one.name === name)?.group ?? null;
        if (section.offsetParent === null) return;
        if (group !== null) rows.get(group)?.open();
        const row = rows.get(name) ?? (group === null ? undefined : rows.get(group));
        row?.element.scrollIntoView({ block: "nearest" });
        row?.element.querySelector<HTMLElement>("input[type=range]")?.focus();
    };
    scene.on("scene", () => {
        filter.value = "";
        draw();
    });
    scene.on("picked", show);
    store.listen((now, before) => {
        if (now.lighting !== before.lighting || now.view.openings !== before.view.openings) update();
    });
    return section;
}

function rowOf(one: LuminaireRow["members"][number]): LuminaireRow {
    return { name: one.name, isGroup: false, members: [one] };
}

/** Draws the first rows, and adds them to `rows` by their names. */
function drawRows(page: Page, all: readonly LuminaireRow[], rows: Map<string, Row>): (HTMLElement | false)[] {
    const left = all.length - ROWS_MOST;
    return [...all.slice(0, ROWS_MOST).map((of) => {
        const row = luminaireRow(page, of, rows);
        rows.set(of.name, row);
        return row.element;
    }), left > 0 && make("p", { class: "hint" }, `${count(left)} more: name a part of theirs above.`)];
}

/** The members of a group are added to `rows` once it is opened. */
function luminaireRow(page: Page, row: LuminaireRow, rows: Map<string, Row>): Row {
    const { store, scene } = page, { name } = row, id = unique("luminaire");
    const change = (to: Partial<LuminaireLight>, tag: string | null): void => {
        const { now } = store;
        store.change({ ...now, lighting: { ...now.lighting, luminaires: withRows([row], now.lighting, to) } }, tag);
    };
    const on = tick(name, true, (is) => change({ on: is }, null)), box = on.querySelector("input") as HTMLInputElement;
    on.querySelector("span")?.setAttribute("id", id);
    const dim = slider({ label: "Dimmer", unit: "×", least: 0, most: 1, step: 0.01,
        change: (value) => change({ dim: value }, `dimmer ${name}`) }, 1);
    const colour = colourOf(row, change);
    const alone = button("Solo", `Only ${name}`, () => {
        const { now } = store, { soloLuminaire } = now.lighting;
        store.change({ ...now,
            lighting: { ...now.lighting, solo: null, soloLuminaire: soloLuminaire === name ? null : name } });
    }, { "aria-pressed": "false", "aria-label": `Solo ${name}` });
    const lumens = make("span", { class: "lumens" });
    const isColoured = scene.now?.description.channels === 3;
    const inner = make("div", { class: "lights" }), members = make("details", { ontoggle: () => {
        if (members.open && inner.childElementCount === 0) fillMembers();
    } }, make("summary", {}, `${count(row.members.length)} luminaire${row.members.length === 1 ? "" : "s"}`), inner);
    const fillMembers = (): void => {
        fill(inner, ...drawRows(page, row.members.map(rowOf), rows));
        for (const { name: member } of row.members) rows.get(member)?.update(store.now.lighting);
    };
    const element = make("section", { class: "light", "aria-labelledby": id, "data-luminaire": name },
        make("div", { class: "row" }, on, lumens, isColoured && colour.swatch, alone), dim.element,
        isColoured && colour.temperature, row.isGroup && members);
    return {
        element,
        update: (lighting) => {
            const light = commonLightOf(row, lighting), given = lumensOf(row, lighting);
            const isOn = row.members.map((one) => lightOf(one, lighting).on);
            box.checked = isOn.some((is) => is);
            box.indeterminate = box.checked && isOn.some((is) => !is);
            const dims = new Set(row.members.map((one) => lightOf(one, lighting).dim));
            if (dims.size === 1) dim.set([...dims][0]);
            else dim.unset("several");
            colour.update(light);
            lumens.textContent = `${numberText(given)} lm`;
            alone.setAttribute("aria-pressed", String(lighting.soloLuminaire === name));
            element.classList.toggle("dark", given <= 0);
        },
        open: () => {
            members.open = true;
            if (inner.childElementCount === 0) fillMembers();
        },
    };
}

/** A field and a slider for the colour of the light, of luminance 1: that of the list times a tint. */
function colourOf(row: LuminaireRow,
    change: (to: Partial<LuminaireLight>, tag: string | null) => void
): { swatch: HTMLElement; temperature: HTMLElement; update(light: LuminaireLight | null): void } {
    const { name } = row, own = ownColourOf(row);
    const tintTo = (rgb: Rgb): Rgb => rgb.map((v, c) => ((own ?? WHITE)[c] > 0 ? v / (own ?? WHITE)[c] : 1)) as Rgb;
    const swatch = make("input", {
        type: "color",
        "aria-label": own === null ? `Tint of ${name}` : `Colour of ${name}`,
        oninput: () => {
            const rgb = fromHex(swatch.value), L = luminance(rgb);
            change({ tint: L > 0 ? tintTo(rgb.map((v) => v / L) as Rgb) : WHITE, kelvin: null }, `colour ${name}`);
        },
    });
    const kelvin = slider({
        label: "Temperature",
        unit: "K",
        least: 1800,
        most: 12000,
        step: 50,
        change: (value) => change({ kelvin: value, tint: tintTo(ofTemperature(value)) }, `kelvin ${name}`),
    }, 4000);
    // Where the colours of the list differ no tint gives all of them one temperature.
    kelvin.element.hidden = own === null;
    return {
        swatch,
        temperature: kelvin.element,
        update: (light) => {
            const rgb = (light?.tint ?? WHITE).map((v, c) => v * (own ?? WHITE)[c]), largest = Math.max(...rgb, 1e-9);
            if (document.activeElement !== swatch) swatch.value = toHex(rgb.map((v) => v / largest));
            if (light === null) kelvin.unset("several");
            else if (light.kelvin === null) kelvin.unset("own");
            else kelvin.set(light.kelvin);
        },
    };
}
