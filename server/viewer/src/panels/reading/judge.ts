// Is there light enough, and evenly? The share of the area that reaches a value, mean, least value and uniformity
// beside the targets of a task, in words and in colour. The shader paints the elements.
import { choice, fill, make, tick } from "../../base/dom.ts";
import { percent, numberText } from "../../base/numbers.ts";
import type { Page } from "../../app/page.ts";
import { figuresOf } from "../../picture/scale.ts";
import { unitShown, type View } from "../../state/state.ts";

/** Maintained illuminance Em and uniformity U0 of task areas, after EN 12464-1. */
const TASKS: readonly (readonly [string, number, number])[] = [
    ["Office: writing, reading", 500, 0.6],
    ["Technical drawing", 750, 0.7],
    ["Classroom", 500, 0.6],
    ["Meeting room", 500, 0.6],
    ["Reception desk", 300, 0.6],
    ["Archive", 200, 0.4],
    ["Corridor", 100, 0.4],
    ["Stairs", 100, 0.4],
];

export class Judge {
    readonly element = make("section", { class: "judge" });
    private readonly on: HTMLLabelElement;
    private readonly fields = make("div", {});
    private readonly verdict = make("div", { role: "status" });
    private readonly level = make("input", { type: "number", min: 0, step: "any",
        "aria-label": "Threshold, target of the mean" });
    private readonly evenness = make("input", { type: "number", min: 0, max: 1, step: 0.05,
        "aria-label": "Target of the uniformity U0" });
    private readonly unit = make("span", {});
    private group: HTMLElement = make("div", {});

    constructor(private readonly page: Page, private readonly isSeen: () => boolean) {
        const { store, scene } = page;
        this.on = tick("Judge by a threshold", false, (on) =>
            this.change(on
                ? { threshold: 500, ...(store.now.view.picture === "false" ? {} : { picture: "false", range: null }),
                    quantity: "irradiance" }
                : { threshold: null }));
        const task = choice("Task", [["", "…"],
            ...TASKS.map(([name, level, even], i) =>
                [String(i), `${name}: ${level} lx, U0 ${even.toFixed(2)}`] as const
            )], "", (which) => {
            if (which !== "") this.change({ threshold: TASKS[Number(which)][1], uniformity: TASKS[Number(which)][2] });
        });
        this.level.addEventListener("change", () => {
            if (this.level.value !== "" && Number(this.level.value) >= 0)
                this.change({ threshold: Number(this.level.value) });
        });
        this.evenness.addEventListener("change", () => {
            const value = Number(this.evenness.value);
            if (this.evenness.value !== "" && value >= 0 && value <= 1) this.change({ uniformity: value });
        });
        this.fields.append(task, this.group,
            make("div", { class: "row" }, make("span", {}, "At least"), this.level, this.unit, make("span", {}, "U0"),
                this.evenness), this.verdict,
            make("p", { class: "hint" },
                "Tasks are examples after EN 12464-1; the tables of the standard, its maintenance factor and its grid of points have to be consulted."));
        this.element.append(make("h2", { class: "sub" }, "Enough light?"), this.on, this.fields);
        scene.on("scene", () => this.drawGroups());
        scene.on("field", () => this.draw());
        store.listen((now, before) => {
            if (now.view !== before.view) this.draw();
        });
    }

    private change(to: Partial<View>): void {
        const { store } = this.page;
        store.change({ ...store.now, view: { ...store.now.view, ...to } });
    }

    private drawGroups(): void {
        const names = this.page.scene.now?.mesh.groups.map((group) => group.name) ?? [];
        const group = choice("Of", [["", "all groups"], ...names.map((name) => [name, name] as const)],
            this.page.store.now.view.judged ?? "", (name) => this.change({ judged: name === "" ? null : name }));
        this.group.replaceWith(group);
        this.group = group;
        this.draw();
    }

    draw(): void {
        const { scene: { now: scene, fields: [field] }, store: { now: { view } } } = this.page;
        const unit = unitShown(view);
        (this.on.querySelector("input") as HTMLInputElement).checked = view.threshold !== null;
        this.fields.hidden = view.threshold === null;
        if (!this.isSeen() || view.threshold === null || scene === null || field === null) return;
        if (document.activeElement !== this.level) this.level.value = String(view.threshold);
        if (document.activeElement !== this.evenness) this.evenness.value = String(view.uniformity);
        this.unit.textContent = unit;
        const select = this.group.querySelector("select");
        if (select !== null) select.value = view.judged ?? "";
        const judged = scene.mesh.groups.find((group) => group.name === view.judged);
        const elements = judged?.counted ?? scene.mesh.groups.flatMap((group) => [...group.counted]);
        const figures = figuresOf(field.values, scene.mesh.area, elements, view.threshold);
        const line = (name: string, text: string, target: string, isMet: boolean): HTMLElement =>
            make("tr", {}, make("th", { scope: "row" }, name), make("td", {}, text), make("td", {}, target),
                make("td", { class: isMet ? "good" : "bad" }, isMet ? "✓ met" : "✗ not met"));
        const isIrradiance = view.picture === "false" && view.quantity === "irradiance";
        fill(this.verdict,
            make("p", { class: "reached" },
                `${percent(figures.reached)} of ${view.judged ?? "all"} (${
                    numberText(figures.area * figures.reached)
                } of ${numberText(figures.area)} m²) has at least ${numberText(view.threshold)} ${unit}.`),
            make("table", {},
                make("tbody", {},
                    line("Mean Em", `${numberText(figures.mean)} ${unit}`, `≥ ${numberText(view.threshold)}`,
                        figures.mean >= view.threshold),
                    line("U0 = min/mean", Number.isFinite(figures.uniformity) ? figures.uniformity.toFixed(2) : "–",
                        `≥ ${view.uniformity.toFixed(2)}`, figures.uniformity >= view.uniformity),
                    make("tr", {}, make("th", { scope: "row" }, "Min"),
                        make("td", {}, `${numberText(figures.min)} ${unit}`), make("td", {}), make("td", {})))),
            !isIrradiance
                && make("p", { class: "bad" }, "The picture does not show irradiance, which such targets are about."),
            view.unit !== "lx"
                && make("p", { class: "hint" },
                    "Targets of the standard are in lx, and this store counts in W. `lambert precompute` has --lights lm for that."));
    }
}
