// The sensor that is marked in the picture: its set, number and place, and the light there.
import { button, fill, make } from "../base/dom.ts";
import { count, numberText } from "../base/numbers.ts";
import type { Page } from "../app/page.ts";
import { choiceOfPlace, nounOf, placeOfChoice, vectorOf, whyNone, type SceneSensors } from "../state/sensors.ts";
import { unitOf } from "../state/state.ts";

/** The name of a place, as "desks, sensor 12". */
export function nameOfPlace(sensors: SceneSensors, place: number): string {
    const { of, index } = choiceOfPlace(sensors, place);
    return `${of.set.name}, ${nounOf(of)} ${count(index)}`;
}

/** The light at a place, with its unit, or why there is none. */
export function lightAtPlace({ store, scene: { sensed } }: Page, sensors: SceneSensors, place: number): string {
    const { of, index } = choiceOfPlace(sensors, place), why = whyNone(of, index), value = sensed.values?.[place];
    if (why !== null) return why;
    if (value === undefined) return "no value is known";
    return Number.isNaN(value) ? "no value" : `${numberText(value)} ${unitOf(store.now.view, "irradiance")}`;
}

export function sensorCard(page: Page): HTMLElement {
    const { store, scene } = page;
    const head = make("h2", { class: "sub grow" }), figures = make("dl", {});
    const forget = button("×", "Forget this sensor", () => store.change({ ...store.now, sensor: null }));
    const card = make("section", { class: "pin", "aria-label": "Marked sensor", "data-figure": "sensor", hidden: true },
        make("div", { class: "row" }, head, forget), figures);
    const triple = (v: readonly number[]): string => v.map((x) => numberText(x)).join(", ");
    const draw = (): void => {
        const sensors = scene.now?.sensors ?? null, place = placeOfChoice(sensors, store.now.sensor);
        card.hidden = sensors === null || place === null;
        if (sensors === null || place === null) return;
        const { of: { set }, index } = choiceOfPlace(sensors, place), { cells, columns } = set;
        const way = vectorOf(set.look, index) ?? vectorOf(set.axis, index),
            cell = cells === undefined || columns === undefined ? null : cells[index];
        head.textContent = nameOfPlace(sensors, place);
        const lines: (readonly [string, string] | false)[] = [["Irradiance H", lightAtPlace(page, sensors, place)], [
            "Place",
            `${triple(set.at[index])} m`,
        ], way !== null && set.kind !== "probes" && [set.kind === "cylinders" ? "Axis" : "Faces", triple(way)],
            cell !== null && columns !== undefined
            && ["Of the grid", `row ${Math.floor(cell / columns) + 1}, column ${(cell % columns) + 1}`]];
        fill(figures,
            ...lines.flatMap((line) => (line === false ? [] : [make("dt", {}, line[0]), make("dd", {}, line[1])])));
    };
    for (const event of ["scene", "sensed"] as const) scene.on(event, draw);
    store.listen((now, before) => {
        if (now.sensor !== before.sensor || now.view.unit !== before.view.unit) draw();
    });
    return card;
}
