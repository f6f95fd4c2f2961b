// The values of all elements as one answer brought them: half precision as it came, planar by channel, times a scale.
import { halfToNumber, halvesToFloats, type Npy } from "lambert-light";
import { LUMINANCE } from "../base/colour.ts";

export class Field {
    readonly elements: number;
    readonly channels: number;
    private luminances: Float32Array | null = null;

    /** bits: [C][n] or [n]; the values are bits · scale. */
    constructor(readonly bits: Uint16Array, shape: readonly number[], readonly scale: number) {
        this.elements = shape[shape.length - 1];
        this.channels = shape.length > 1 ? shape[0] : 1;
    }

    static of(values: Npy, scale: number): Field {
        if (!(values.data instanceof Uint16Array)) throw new Error("the answer is not in half precision");
        return new Field(values.data, values.shape, scale);
    }

    at(element: number): number[] {
        return Array.from({ length: this.channels },
            (_, c) => halfToNumber(this.bits[c * this.elements + element]) * this.scale);
    }

    /** One number per element: luminance of three channels (linear sRGB), else their mean. Made once. */
    get values(): Float32Array {
        if (this.luminances !== null) return this.luminances;
        const n = this.elements;
        const weights = channelWeights(this.channels);
        const out = halvesToFloats(this.bits, 0, n, this.scale * weights[0]);
        for (let c = 1; c < this.channels; c++)
            for (let i = 0; i < n; i++) out[i] += halfToNumber(this.bits[c * n + i]) * this.scale * weights[c];
        return (this.luminances = out);
    }
}

export function channelWeights(channels: number): number[] {
    return channels === 3 ? [...LUMINANCE] : new Array<number>(channels).fill(1 / channels);
}

export interface Spread {
    /** Values that 1 % and 99 % of the area stay below, and the largest. */
    low: number;
    high: number;
    most: number;
    /** Area-weighted mean of log2 of the values above 0. */
    logMean: number;
}

const BINS = 1024;
/** Bins of log2 from 2^−40 to 2^40. */
const binOf = (value: number): number =>
    Math.min(BINS - 1, Math.max(0, Math.floor((Math.log2(value) + 40) * (BINS / 80))));
const valueOf = (bin: number): number => 2 ** (((bin + 0.5) * 80) / BINS - 40);

/** How the values of elements (those for which `counts` is true) spread over the area. O(n). */
export function spreadOf(values: Float32Array, area: Float64Array, counts: (element: number) => boolean): Spread {
    const bins = new Float64Array(BINS);
    let most = 0, total = 0, logs = 0, dark = 0;
    for (let i = 0; i < values.length; i++) {
        const value = values[i];
        if (!counts(i)) continue;
        if (!(value > 0)) {
            dark += area[i];
            continue;
        }
        if (value > most) most = value;
        bins[binOf(value)] += area[i];
        logs += area[i] * Math.log2(value);
        total += area[i];
    }
    const below = (share: number): number => {
        let sum = dark;
        for (let b = 0; b < BINS; b++) {
            sum += bins[b];
            if (sum >= share * (total + dark)) return sum === dark ? 0 : valueOf(b);
        }
        return most;
    };
    return { low: dark > 0.01 * (total + dark) ? 0 : below(0.01), high: Math.min(most, below(0.99)), most,
        logMean: total > 0 ? logs / total : 0 };
}
