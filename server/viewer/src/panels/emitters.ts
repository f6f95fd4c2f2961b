// Stores of precomputed emitters: a weight for each, and for a lamp in many positions the way along them.
import type { Page } from "../app/page.ts";
import { button, fill, make } from "../base/dom.ts";
import { count, numberText } from "../base/numbers.ts";
import { emittersOf } from "../daemon/api.ts";
import { alongOf, positionOf, type Weights } from "../state/path.ts";
import type { Panel } from "./panel.ts";
import { player } from "./player.ts";
import { slider, type Slider } from "./slider.ts";

/** So many rows are drawn; a filter finds the others. */
const ROWS_MOST = 40;

export function emittersPanel({ store, scene }: Page): Panel {
    const names = (): readonly string[] => scene.now === null ? [] : emittersOf(scene.now.description);
    const isPath = (): boolean => scene.now?.description.report?.paths !== undefined;
    const change = (emitters: Weights, tag: string | null = null): void => {
        const { now } = store;
        store.change({ ...now, lighting: { ...now.lighting, emitters } }, tag);
    };
    const weights = (): Weights => store.now.lighting.emitters;
    const place = (): number | null => positionOf(weights());
    const go = (to: number): void => {
        const last = names().length - 1, all = Object.values(weights());
        const power = (place() === null ? Math.max(0, ...all) : all.reduce((sum, w) => sum + w, 0)) || 1;
        change(alongOf(Math.min(last, Math.max(0, to)), power), "position of the lamp");
    };
    const position = slider({ label: "Position", least: 0, most: 1, step: 0.01, change: go }, 0);
    const frame = make("p", { class: "moment" });
    // Back and forth, as a path need not be closed.
    let way = 1;
    const drive = player({
        what: "the lamp along its path",
        speeds: [["1", "1 position a second"], ["3", "3 a second"], ["8", "8 a second"]],
        speed: "3",
        step: 1,
        stepLabel: "One position",
        advance: (amount) => {
            const last = names().length - 1;
            let to = (place() ?? 0) + way * amount;
            if (to > last || to < 0) {
                way = to > last ? -1 : 1;
                to = to > last ? 2 * last - to : -to;
            }
            go(to);
        },
    });
    const path = make("div", {}, frame, position.element, drive.element);
    const rows = new Map<string, Slider>();
    const list = make("div", {}),
        filter = make("input", { type: "text", placeholder: "Part of a name",
            "aria-label": "Show emitters whose names have", oninput: () => draw() });
    const setAll = (weight: number) => (): void =>
        change(weight === 0 ? {} : Object.fromEntries(names().map((_, index) => [index, weight])));
    const draw = (): void => {
        const found = names().map((name, index) => ({ name, index })).filter(({ name }) =>
            name.includes(filter.value.trim())
        );
        rows.clear();
        fill(list, ...found.slice(0, ROWS_MOST).map(({ name, index }) => {
            const key = String(index), row = slider({
                label: name,
                unit: "×",
                least: 0,
                most: 2,
                step: 0.01,
                change: (value) => change({ ...weights(), [key]: value }, `weight ${key}`),
            }, weights()[key] ?? 0);
            rows.set(key, row);
            return make("div", { class: "weight" }, row.element,
                button("Solo", `Only ${name}`, () => change({ [key]: weights()[key] || 1 })));
        }), found.length > ROWS_MOST
            && make("p", { class: "hint" }, `${count(found.length - ROWS_MOST)} more: name a part of theirs above.`));
    };
    const update = (): void => {
        for (const [key, row] of rows) row.set(weights()[key] ?? 0);
        const at = positionOf(weights());
        if (at !== null) position.set(Number(at.toFixed(3)));
        const near = Math.round(at ?? 0);
        frame.textContent = at === null
            ? "Several positions shine."
            : `Position ${numberText(at, 3)} of ${names().length - 1}: ${names()[near] ?? ""}`;
    };
    scene.on("scene", () => {
        drive.stop();
        filter.value = "";
        filter.hidden = names().length <= ROWS_MOST;
        path.hidden = !isPath() || names().length < 2;
        position.setMost(Math.max(1, names().length - 1));
        draw();
        update();
    });
    store.listen((now, before) => {
        if (now.lighting.emitters !== before.lighting.emitters) update();
    });
    return {
        id: "emitters",
        title: "Emitters",
        isUseful: () => names().length > 0,
        isFirst: () => scene.now?.description.sky === null,
        element: make("div", {}, path, make("h2", {}, "Weights"),
            make("div", { class: "row" }, button("All off", null, setAll(0)),
                button("All 1", "All weights 1", setAll(1)), filter), list),
    };
}
