// A small picture of the sky as a map: north above, east to the right, the zenith in the middle, the horizon around.
import { make } from "../base/dom.ts";
import type { SkyTiles } from "../daemon/daylight.ts";
import type { Sky } from "../daylight/made_sky.ts";

export interface Dome {
    element: HTMLElement;
    /** The sun is drawn where it is above the horizon, whether it shines or not; degrees. */
    draw(tiles: SkyTiles | null, sky: Sky | null, sun: { azimuth: number; altitude: number } | null): void;
}

const SIZE = 220, MARGIN = 18;

const RADIANS = Math.PI / 180;

/** Colours from a tenth of the mean luminance to ten times of it. */
const RAMP = [[18, 30, 66], [52, 98, 172], [138, 186, 232], [228, 240, 252], [255, 250, 222]];

function colourOf(value: number, mean: number): string {
    if (!(value > 0) || !(mean > 0)) return "rgb(10, 14, 30)";
    const at = Math.min(1, Math.max(0, 0.5 + 0.5 * Math.log10(value / mean))) * (RAMP.length - 1);
    const low = Math.min(RAMP.length - 2, Math.floor(at)), share = at - low;
    return `rgb(${RAMP[low].map((v, c) => Math.round(v + share * (RAMP[low + 1][c] - v))).join(", ")})`;
}

export function makeDome(): Dome {
    const ratio = Math.min(3, Math.max(1, window.devicePixelRatio));
    const canvas = make("canvas", { class: "dome", width: SIZE * ratio, height: SIZE * ratio, role: "img",
        "aria-label": "The sky" });
    const pen = canvas.getContext("2d");
    const radius = SIZE / 2 - MARGIN, middle = SIZE / 2;
    const away = (altitude: number): number => radius * (1 - altitude / 90);
    /** Tiles are where the axes of the model say; its north is `north` degrees further by east. */
    const drawTile = (tiles: SkyTiles, t: number, north: number, colour: string): void => {
        if (pen === null) return;
        const [low, high] = tiles.altitude[t];
        // Azimuths run from north by east; angles of a canvas from east by south.
        const [from, to] = tiles.azimuth[t].map((azimuth) => (azimuth - north - 90) * RADIANS);
        pen.beginPath();
        pen.arc(middle, middle, away(low), from, to);
        if (away(high) > 0.5) pen.arc(middle, middle, away(high), to, from, true);
        else if (to - from < 6.28) pen.lineTo(middle, middle);
        pen.closePath();
        pen.fillStyle = colour;
        pen.strokeStyle = colour;
        pen.fill();
        pen.stroke();
    };
    const draw: Dome["draw"] = (tiles, sky, sun) => {
        if (pen === null) return;
        pen.setTransform(ratio, 0, 0, ratio, 0, 0);
        pen.clearRect(0, 0, SIZE, SIZE);
        pen.lineWidth = 0.5;
        const mean = sky === null ? 0 : sky.diffuseHorizontal / Math.PI;
        for (let t = 0; tiles !== null && t < tiles.tiles; t++)
            drawTile(tiles, t, sky?.made.north ?? 0, colourOf(sky === null ? 0 : sky.diffuse[t], mean));
        if (sky !== null && sun !== null && sun.altitude > 0) {
            const azimuth = sun.azimuth * RADIANS, { altitude } = sun;
            pen.beginPath();
            pen.arc(middle + away(altitude) * Math.sin(azimuth), middle - away(altitude) * Math.cos(azimuth), 5, 0,
                2 * Math.PI);
            pen.fillStyle = sky.directHorizontal > 0 ? "#ffd23f" : "transparent";
            pen.strokeStyle = "#5a3d00";
            pen.lineWidth = 1.5;
            pen.fill();
            pen.stroke();
        }
        pen.fillStyle = getComputedStyle(canvas).color;
        pen.font = "12px system-ui, sans-serif";
        pen.textAlign = "center";
        pen.textBaseline = "middle";
        for (const [name, x, y] of [["N", 0, -1], ["E", 1, 0], ["S", 0, 1], ["W", -1, 0]] as const)
            pen.fillText(name, middle + x * (radius + 9), middle + y * (radius + 9));
    };
    return { element: canvas, draw };
}
