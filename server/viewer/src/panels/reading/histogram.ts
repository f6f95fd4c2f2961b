// How the values shown spread over the area. Dragging over a part of it makes that part the range of the palette.
import uPlot from "uplot";
import { make } from "../../base/dom.ts";
import { percent, numberText } from "../../base/numbers.ts";
import type { Page } from "../../app/page.ts";
import { areaByValue, ticksOf, valueAt, type Axis } from "../../picture/scale.ts";
import { unitShown } from "../../state/state.ts";

const BINS = 60;
const HEIGHT = 140;

export class Histogram {
    readonly element = make("section", { class: "histogram" });
    private readonly place = make("div", {});
    private readonly head = make("h2", { class: "sub" }, "Spread over the area");
    private readonly low = make("input", { type: "number", step: "any", "aria-label": "Low end of the palette" });
    private readonly high = make("input", { type: "number", step: "any", "aria-label": "High end of the palette" });
    private plot: uPlot | null = null;
    private axis: Axis = { low: 0, high: 1, log: false };

    constructor(private readonly page: Page, private readonly isSeen: () => boolean) {
        const { store, scene } = page;
        const set = (): void =>
            this.setRange(this.low.value === "" ? NaN : Number(this.low.value),
                this.high.value === "" ? NaN : Number(this.high.value));
        this.low.addEventListener("change", set);
        this.high.addEventListener("change", set);
        this.place.setAttribute("role", "img");
        this.element.append(this.head, this.place,
            make("div", { class: "row" }, make("span", {}, "Palette"), this.low, make("span", {}, "to"), this.high,
                make("button", { type: "button", title: "Ends of the palette from the values",
                    onclick: () => this.setRange(NaN, NaN) }, "Auto")));
        scene.on("field", () => this.draw());
        scene.on("theme", () => this.draw());
        store.listen((now, before) => {
            if (now.view !== before.view) this.draw();
        });
        new MutationObserver(() => this.plot?.redraw()).observe(document.documentElement, { attributes: true,
            attributeFilter: ["data-theme"] });
        new ResizeObserver(() => {
            if (this.plot !== null && this.place.clientWidth > 0)
                this.plot.setSize({ width: this.place.clientWidth, height: HEIGHT });
        }).observe(this.place);
    }

    private setRange(low: number, high: number): void {
        const { store } = this.page;
        store.change({ ...store.now,
            view: { ...store.now.view,
                range: high > low ? [Number(low.toPrecision(3)), Number(high.toPrecision(3))] : null } });
    }

    draw(): void {
        const { store: { now: { view } }, scene: { now: scene, fields: [field], exposure } } = this.page,
            { spread } = exposure;
        if (!this.isSeen() || scene === null || field === null || this.place.clientWidth === 0) return;
        const group = view.judged === null ? undefined : scene.mesh.groups.find((g) => g.name === view.judged);
        const counts = group === undefined
            ? (i: number): boolean => !scene.mesh.buried.has(i)
            : (i: number): boolean => scene.mesh.groups[scene.mesh.groupOf[i]] === group && !scene.mesh.buried.has(i);
        // The ends of the palette are in sight, and all but the last hundredth of the area; in log four decades at
        // most.
        const palette = exposure.axis(view);
        const high = Math.max(spread.high * 1.15, view.range?.[1] ?? 0) || 1;
        this.axis = view.log
            ? { low: Math.min(Math.max(spread.low / 1.5, high / 1e4), palette.low > 0 ? palette.low : Infinity), high,
                log: true }
            : { low: Math.min(0, view.range?.[0] ?? 0), high, log: false };
        const { axis } = this;
        const areas = areaByValue(field.values, scene.mesh.area, counts, axis, BINS);
        const total = areas.reduce((sum, a) => sum + a, 0) || 1;
        this.head.textContent = `Spread over the area of ${view.judged ?? "all groups"}, ${unitShown(view)}${
            spread.most > high ? "; the last bar has all above" : ""
        }`;
        if (document.activeElement !== this.low) this.low.value = String(Number(palette.low.toPrecision(4)));
        if (document.activeElement !== this.high) this.high.value = String(Number(palette.high.toPrecision(4)));
        const at = Array.from(areas, (_, k) => (k + 0.5) / BINS);
        const largest = areas.indexOf(Math.max(...areas));
        this.place.setAttribute("aria-label",
            `Histogram of values from ${numberText(axis.low)} to ${numberText(axis.high)} ${
                unitShown(view)
            }; most area, ${percent(areas[largest] / total)}, `
                + `has ${numberText(valueAt(largest / BINS, axis))} to ${
                    numberText(valueAt((largest + 1) / BINS, axis))
                } ${unitShown(view)}.`);
        this.plot ??= this.makePlot();
        this.plot.setData([at, Array.from(areas, (a) => (100 * a) / total)]);
    }

    /** The plot's own axis is the place on ours, 0 to 1, so that equal bars are equal parts of a logarithmic axis
     * too. */
    private makePlot(): uPlot {
        const colour = (name: string) => (): string =>
            getComputedStyle(document.documentElement).getPropertyValue(name).trim();
        const toPlace = (value: number): number => {
            const { low, high, log } = this.axis;
            return log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
        };
        const line = { stroke: colour("--soft"), grid: { stroke: colour("--line"), width: 0.5 },
            ticks: { stroke: colour("--line"), width: 1 }, font: "12px system-ui, sans-serif" };
        return new uPlot({
            width: this.place.clientWidth,
            height: HEIGHT,
            legend: { show: false },
            padding: [6, 10, 0, 0],
            cursor: { y: false, points: { show: false }, drag: { x: true, y: false, setScale: false } },
            scales: { x: { time: false, range: () => [0, 1] }, y: { range: (_, __, most) => [0, most || 1] } },
            series: [{}, { fill: colour("--soft"), stroke: colour("--soft"), width: 0, points: { show: false },
                paths: uPlot.paths.bars?.({ size: [0.9], align: 0 }) ?? (() => null) }],
            axes: [
                { ...line, size: 28, splits: () => ticksOf(this.axis, 5).map(toPlace),
                    values: (_, places) => places.map((place) => numberText(valueAt(place, this.axis))) },
                { ...line, size: 50, values: (_, shares) => shares.map((share) => `${numberText(share, 2)} %`) },
            ],
            hooks: {
                setSelect: [(plot) => {
                    if (plot.select.width < 3) return;
                    const ends = [plot.select.left, plot.select.left + plot.select.width].map((px) =>
                        valueAt(plot.posToVal(px, "x"), this.axis)
                    );
                    plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
                    this.setRange(ends[0], ends[1]);
                }],
                draw: [(plot) => this.drawEnds(plot, toPlace, colour("--accent")())],
            },
        }, [[], []], this.place);
    }

    private drawEnds(plot: uPlot, toPlace: (value: number) => number, colour: string): void {
        const { store: { now: { view } }, scene: { exposure } } = this.page, axis = exposure.axis(view),
            { ctx, bbox } = plot;
        if (view.picture !== "false") return;
        ctx.save();
        ctx.strokeStyle = colour;
        ctx.lineWidth = 2 * devicePixelRatio;
        for (const value of [axis.low, axis.high]) {
            const place = toPlace(value);
            if (!(place >= 0 && place <= 1)) continue;
            ctx.beginPath();
            ctx.moveTo(bbox.left + place * bbox.width, bbox.top);
            ctx.lineTo(bbox.left + place * bbox.width, bbox.top + bbox.height);
            ctx.stroke();
        }
        ctx.restore();
    }
}
