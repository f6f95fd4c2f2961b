// Which lamp lights a point: J is a quantity at one element, by luminance, and linear in all that shines. The daemon's
// adjoint gives dJ/dv of every group, luminaire, tile and emitter once; every lighting then is a sum of products.
import type { Luminaire } from "../daemon/api.ts";
import { dimmerOf } from "./luminaires.ts";
import { emissionOf, type Lighting } from "./state.ts";

/** The gradient of an adjoint answer: [width], or [C][width] for more channels. */
export interface Gradient {
    groups?: number[] | number[][];
    sky?: number[] | number[][];
    emitters?: number[] | number[][];
    luminaires?: number[] | number[][];
}

export interface Part {
    name: string;
    /** In the unit of J. */
    value: number;
}

/** The product of row entries at k with a value, which is one number for all channels or one for each. */
function product(rows: number[] | number[][], k: number, value: number | readonly number[]): number {
    const channels = Array.isArray(rows[0]) ? rows as number[][] : [rows as number[]];
    let sum = 0;
    channels.forEach((row, c) => {
        sum += row[k] * (typeof value === "number" ? value : value[c] ?? 0);
    });
    return sum;
}

/** What each group that shines, each luminaire, the sky and each emitter give; the largest first. `groups` and
 * `emitters` are names in the order of the store, and luminaires are in that order. */
export function partsOf(gradient: Gradient, lighting: Lighting, channels: number, groups: readonly string[],
    emitters: readonly string[], luminaires: readonly Luminaire[],
    sky: readonly (number | readonly number[])[] | null): Part[]
{
    const parts: Part[] = [];
    if (gradient.groups !== undefined) {
        for (const [name, value] of Object.entries(emissionOf(lighting, channels))) {
            const k = groups.indexOf(name);
            if (k >= 0) parts.push({ name, value: product(gradient.groups, k, value) });
        }
    }
    if (gradient.emitters !== undefined) {
        for (const [index, weight] of Object.entries(lighting.emitters)) {
            const k = Number(index);
            if (weight > 0 && k < emitters.length)
                parts.push({ name: emitters[k], value: product(gradient.emitters, k, weight * lighting.dim) });
        }
    }
    const isWeighted = parts.length > 0, { luminaires: dimmed } = gradient;
    if (dimmed !== undefined) {
        luminaires.forEach((one, k) => {
            const dimmer = dimmerOf(one, lighting, channels);
            if (dimmer !== 0) parts.push({ name: one.name, value: product(dimmed, k, dimmer) });
        });
    }
    // A store of the tiles of a sky has these as its emitters.
    const rows = gradient.sky
        ?? (!isWeighted && sky !== null && sky.length === emitters.length ? gradient.emitters : undefined);
    if (rows !== undefined && sky !== null) {
        const value = sky.reduce((sum: number, radiance, tile) => sum + product(rows, tile, radiance), 0);
        if (value !== 0) parts.push({ name: "sky", value });
    }
    return parts.sort((a, b) => b.value - a.value);
}

/** The pins after a click at an element: it alone, or it beside the others; once more removes it. */
export function pinsAfter(pins: readonly number[], element: number, isMore: boolean): number[] {
    if (pins.includes(element)) return pins.filter((pin) => pin !== element);
    return isMore ? [...pins, element].slice(-PINS_MOST) : [element];
}

/** The shader marks four of them. */
export const PINS_MOST = 12;
