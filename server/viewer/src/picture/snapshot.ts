// The picture at any size: drawn in parts that every graphics card can hold, put together on a canvas, with a legend.
import { Vector2 } from "three";
import { changeColour } from "./changes.ts";
import { toHex } from "../base/colour.ts";
import { numberText } from "../base/numbers.ts";
import { paletteBytes } from "./palettes.ts";
import { placeOf, ticksOf, type Axis } from "./scale.ts";
import type { Stage } from "./stage.ts";
import type { Palette } from "../state/state.ts";

export const SIDE_MOST = 8192;

/** The width and height of one part, in pixels. */
const PART = 2048;

/** The axis of a difference has its middle at 0. */
export interface Legend extends Axis {
    title: string;
    palette: Palette | "change";
}

/** After so many steps a part waits for the graphics card. */
const STEPS = 8;

/** Draws what the stage shows at this size, while the page goes on. `split` is the share of the width that is left of
 * the line of a comparison. `step` is told now and then how much is drawn, from 0 to 1; what it throws ends the
 * drawing. */
export async function snapshot(stage: Stage, width: number, height: number, split: number,
    step: (share: number) => void): Promise<HTMLCanvasElement>
{
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [width, height];
    const context = canvas.getContext("2d");
    if (context === null) throw new Error(`the browser makes no picture of ${width} × ${height} pixels`);
    const camera = stage.camera.clone(), release = stage.hold();
    try {
        for (let y = 0; y < height; y += PART)
            for (let x = 0; x < width; x += PART) {
                const size = new Vector2(Math.min(PART, width - x), Math.min(PART, height - y));
                // This sets the camera's aspect, too.
                camera.setViewOffset(width, height, x, y, size.x, size.y);
                for (let k = 1; stage.improve(camera, size); k++) {
                    if (k % STEPS > 0) continue;
                    await stage.caughtUp();
                    step((y * width + Math.min(height - y, PART) * x) / (width * height));
                }
                stage.drawOther(camera, size, split * width - x, (drawn) => context.drawImage(drawn, x, y));
            }
    } finally {
        release();
    }
    return canvas;
}

/** Draws a ramp with its ticks into the lower left corner. */
export function drawLegend(canvas: HTMLCanvasElement, legend: Legend): void {
    const context = canvas.getContext("2d") as CanvasRenderingContext2D;
    const unit = Math.max(8, Math.min(canvas.width / 40, canvas.height / 28)),
        [width, height] = [unit * 18, unit * 4.2];
    const left = unit, top = canvas.height - height - unit, ramp = width - 2 * unit;
    context.fillStyle = "rgb(0 0 0 / .75)";
    context.fillRect(left, top, width, height);
    const bytes = legend.palette === "change" ? null : paletteBytes(legend.palette);
    for (let k = 0; k < 256; k++) {
        context.fillStyle = bytes === null
            ? toHex(changeColour((2 * k) / 255 - 1))
            : `rgb(${bytes[4 * k]} ${bytes[4 * k + 1]} ${bytes[4 * k + 2]})`;
        const from = Math.floor(left + unit + (ramp * k) / 256);
        context.fillRect(from, top + unit * 1.4, Math.ceil(left + unit + (ramp * (k + 1)) / 256) - from, unit);
    }
    context.fillStyle = "#fff";
    context.font = `${Math.round(unit * 0.9)}px sans-serif`;
    context.textBaseline = "middle";
    context.fillText(legend.title, left + unit, top + unit * 0.8, ramp);
    context.textAlign = "center";
    let free = -Infinity;
    for (const value of ticksOf(legend, 5)) {
        const x = left + unit + ramp * placeOf(value, legend), text = numberText(value),
            half = context.measureText(text).width / 2;
        context.fillRect(x - Math.max(1, unit / 16), top + unit * 2.4, Math.max(2, unit / 8), unit * 0.3);
        // A number that would touch the one before it is left out.
        if (x - half < free) continue;
        context.fillText(text, x, top + unit * 3.4);
        free = x + half + unit * 0.4;
    }
    context.textAlign = "start";
}
