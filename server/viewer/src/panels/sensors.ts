// The sensors of a store: a row for each set with the figures of its values, which follow the light, and whether it is
// drawn.
import { button, fill, make, tick } from "../base/dom.ts";
import { count, percent, numberText } from "../base/numbers.ts";
import type { Page } from "../app/page.ts";
import { figuresOfSet, nounOf, type PlacedSet } from "../state/sensors.ts";
import { quantityShown, unitOf, type View } from "../state/state.ts";
import type { Panel } from "./panel.ts";
import { sensorCard } from "./sensor_card.ts";

/** So many rows are drawn; a filter, which is there from so many sets on, finds the others. */
const ROWS_MOST = 40, FILTER_FROM = 8;

export function sensorsPanel(page: Page): Panel {
    const { store, scene } = page;
    const change = (to: Partial<View>): void => {
        const { now } = store;
        store.change({ ...now, view: { ...now.view, ...to } });
    };
    const drawn = tick("Draw sensors", true, (on) => change({ sensors: on }));
    const colours = makeColours(page, change), level = makeLevel(page, change);
    const filter = make("input", { type: "text", placeholder: "Part of a name",
        "aria-label": "Show sets whose names have", oninput: () => table.draw() });
    const turn = (on: boolean): void => {
        const names = table.found().map(({ set }) => set.name),
            others = store.now.view.hiddenSets.filter((name) => !names.includes(name));
        change({ hiddenSets: on ? others : [...others, ...names] });
    };
    const several = make("div", { class: "row" }, button("Show all", "Draw all sets listed", () => turn(true)),
        button("Hide all", "Draw none of the sets listed", () => turn(false)), filter);
    const table = new SetTable(page, filter, change);
    const refused = make("p", { class: "bad", role: "status", hidden: true });
    const element = make("div", { class: "sensors" }, drawn, colours.element, level.element, refused, several,
        table.element, sensorCard(page));
    let isSeen = false;
    const update = (): void => {
        if (!isSeen) return;
        (drawn.querySelector("input") as HTMLInputElement).checked = store.now.view.sensors;
        colours.update();
        level.update();
        const line = scene.sensed.refused;
        refused.hidden = line === null;
        if (refused.textContent !== (line ?? "")) refused.textContent = line;
        table.update();
    };
    scene.on("scene", () => {
        const sets = scene.now?.sensors?.sets.length ?? 0;
        filter.value = "";
        filter.hidden = sets < FILTER_FROM;
        several.hidden = sets < 2;
        table.draw();
        update();
    });
    scene.on("sensed", update);
    store.listen((now, before) => {
        if (now.view !== before.view || now.compare !== before.compare) update();
    });
    new IntersectionObserver((entries) => {
        isSeen = entries[entries.length - 1].isIntersecting;
        page.ask.sense(isSeen);
        update();
    }).observe(element);
    return { id: "sensors", title: "Sensors", element, isUseful: () => (scene.now?.sensors ?? null) !== null };
}

interface Part {
    element: HTMLElement;
    update(): void;
}

/** Says what colours of sensors mean, and makes the picture one that has them. */
function makeColours({ store, scene }: Page, change: (to: Partial<View>) => void): Part {
    const text = make("p", { class: "hint" });
    const paint = button("False colour of irradiance", null,
        () => change({ picture: "false", quantity: "irradiance", range: null }));
    return { element: make("div", {}, text, paint), update: () => {
        const { view, compare } = store.now, isColoured = quantityShown(view) === "irradiance";
        paint.hidden = isColoured;
        text.hidden = scene.sensed.refused !== null;
        text.textContent = compare !== null
            ? "Sensors have no colours while scenes are compared; figures are those of A."
            : isColoured
            ? "Sensors have the colours of the legend; hollow grey ones have no value."
            : "Sensors have colours where the picture shows irradiance in false colour; hollow grey ones have no value.";
    } };
}

/** The level that is required, of which the table has the share of points. */
function makeLevel({ store }: Page, change: (to: Partial<View>) => void): Part {
    const field = make("input", { type: "number", min: 0, step: "any", placeholder: "500",
        "aria-label": "Required irradiance", onchange: () => {
            const value = Number(field.value);
            if (field.value === "") change({ required: null });
            else if (value >= 0) change({ required: value });
            else update();
        } });
    const unit = make("span", {});
    const update = (): void => {
        const { view } = store.now;
        if (document.activeElement !== field || Number(field.value) !== view.required)
            field.value = view.required === null ? "" : String(view.required);
        unit.textContent = unitOf(view, "irradiance");
    };
    return { element: make("div", { class: "row" }, make("span", {}, "Required: at least"), field, unit), update };
}

class SetTable {
    readonly element: HTMLElement;
    private readonly body = make("tbody", {});
    private readonly share = make("th", { scope: "col" });
    private readonly unit = make("small", {});
    private readonly more = make("p", { class: "hint", hidden: true });
    private rows = new Map<string, { row: HTMLTableRowElement; box: HTMLInputElement; note: HTMLElement }>();

    constructor(private readonly page: Page, private readonly filter: HTMLInputElement,
        private readonly change: (to: Partial<View>) => void)
    {
        const head = make("tr", {}, make("th", { scope: "col" }, "Set ", this.unit),
            ...["Mean", "Min"].map((name) => make("th", { scope: "col" }, name)),
            make("th", { scope: "col", title: "Uniformity: the least value over the mean" }, "U0"), this.share);
        this.element = make("section", { class: "groups", "aria-label": "Sets of sensors" },
            make("div", { class: "wide" }, make("table", {}, make("thead", {}, head), this.body)), this.more);
    }

    /** The sets whose names have what the filter asks for. */
    found(): readonly PlacedSet[] {
        const part = this.filter.value.trim().toLowerCase();
        return (this.page.scene.now?.sensors?.sets ?? []).filter(({ set }) => set.name.toLowerCase().includes(part));
    }

    draw(): void {
        const all = this.found(), left = all.length - ROWS_MOST;
        this.rows.clear();
        fill(this.body, ...all.slice(0, ROWS_MOST).map((of) => this.makeRow(of)));
        this.more.hidden = left <= 0;
        this.more.textContent = `${count(left)} more: name a part of theirs above.`;
        this.update();
    }

    private makeRow(of: PlacedSet): HTMLElement {
        const { store } = this.page, { name } = of.set;
        const shown = tick(name, true, (on) => {
            const { hiddenSets } = store.now.view;
            this.change({ hiddenSets: on ? hiddenSets.filter((one) => one !== name) : [...hiddenSets, name] });
        });
        const note = make("small", {}), cells = [0, 1, 2, 3].map(() => make("td", {}));
        const row = make("tr", { "data-set": name }, make("th", { scope: "row" }, shown, note), ...cells);
        shown.title = `Draw ${name}`;
        this.rows.set(name, { row, box: shown.querySelector("input") as HTMLInputElement, note });
        return row;
    }

    update(): void {
        const { scene: { sensed: { values } }, store: { now: { view } } } = this.page, { required } = view;
        this.unit.textContent = unitOf(view, "irradiance");
        this.share.textContent = required === null ? "" : `≥ ${numberText(required)}`;
        this.share.hidden = required === null;
        for (const of of this.found()) {
            const shown = this.rows.get(of.set.name);
            if (shown === undefined) continue;
            const figures = values === null || of.isProbes ? null : figuresOfSet(of, values, required), { row } = shown;
            shown.box.checked = !view.hiddenSets.includes(of.set.name);
            shown.note.textContent = noteOf(of, figures?.valued ?? null);
            [numberText(figures?.mean ?? NaN), numberText(figures?.min ?? NaN),
                Number.isFinite(figures?.uniformity) ? (figures?.uniformity as number).toFixed(2) : "–",
                Number.isFinite(figures?.reached) ? percent(figures?.reached as number) : "–"].forEach((text, k) => {
                    row.cells[k + 1].textContent = text;
                });
            row.cells[4].hidden = required === null;
        }
    }
}

/** The number of places of a set, and of those without a value. */
function noteOf(of: PlacedSet, valued: number | null): string {
    const noun = nounOf(of), lacking = of.isProbes || valued === null ? of.lacking.size : of.count - valued;
    return `${count(of.count)} ${noun}${of.count === 1 ? "" : "s"}${
        lacking > 0 ? `, ${count(lacking)} without a value` : ""
    }`;
}
