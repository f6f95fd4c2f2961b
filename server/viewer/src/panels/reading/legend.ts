// The legend of false colour, on the picture: the palette with round numbers, or with the values of the iso-lines.
import { fill, make } from "../../base/dom.ts";
import { numberText } from "../../base/numbers.ts";
import type { Page } from "../../app/page.ts";
import { paletteBytes } from "../../picture/palettes.ts";
import { placeOf, ticksOf, valueAt } from "../../picture/scale.ts";
import { unitShown, type Palette } from "../../state/state.ts";

const QUANTITIES = { radiosity: "Radiosity B", irradiance: "Irradiance H", indirect: "Indirect" };

export function addLegend({ store, scene }: Page): void {
    const ramp = make("canvas", { width: 1, height: 256, "aria-hidden": "true" });
    const head = make("div", {}), ticks = make("div", { class: "ticks", "aria-hidden": "true" });
    const legend = make("figure", { class: "legend", hidden: true, role: "img" }, head,
        make("div", { class: "scale" }, ramp, ticks));
    scene.stage.canvas.parentElement?.append(legend);
    let palette: Palette | null = null, drawn = "";
    const draw = (): void => {
        const { view, compare } = store.now, axis = scene.exposure.axis(view);
        legend.hidden = view.picture !== "false" || scene.now === null || scene.fields[0] === null
            || compare?.how === "difference";
        if (legend.hidden) return;
        if (palette !== view.palette) {
            palette = view.palette;
            const bytes = paletteBytes(palette), picture = new ImageData(1, 256);
            for (let i = 0; i < 256; i++) picture.data.set(bytes.subarray(4 * i, 4 * i + 4), 4 * (255 - i));
            ramp.getContext("2d")?.putImageData(picture, 0, 0);
        }
        const text = `${QUANTITIES[view.quantity]}, ${unitShown(view)}`;
        const rows = Math.max(3, Math.floor(ramp.clientHeight / 18));
        const key = JSON.stringify([axis, view.isoLines, text, rows]);
        if (key === drawn) return;
        drawn = key;
        // Iso-lines stand at equal parts of the palette; of many every second or third has its number.
        const every = Math.ceil(view.isoLines / rows);
        const values = view.isoLines > 0
            ? Array.from({ length: view.isoLines }, (_, k) => k + 1).filter((k) => k % every === 0)
                .map((k) => valueAt(k / view.isoLines, axis))
            : ticksOf(axis, Math.min(6, rows - 1));
        head.textContent = text;
        legend.setAttribute("aria-label",
            `False colour: ${text}, from ${numberText(axis.low)} to ${numberText(axis.high)}${
                axis.log ? ", logarithmic" : ""
            }`
                + (view.isoLines > 0 ? `; iso-lines at ${values.map((v) => numberText(v)).join(", ")}` : ""));
        fill(ticks, ...values.map((value) => {
            const tick = make("span", {}, numberText(value));
            tick.style.bottom = `${100 * placeOf(value, axis)}%`;
            return tick;
        }));
    };
    scene.on("field", draw);
    scene.on("scene", draw);
    store.listen((now, before) => {
        if (now.view !== before.view || now.compare !== before.compare) draw();
    });
}
