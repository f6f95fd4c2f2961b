// How two answers differ, b − a: the figures, and the colours of the picture of differences. Knows no page.
import { channelWeights, spreadOf } from "./field.ts";

export interface Changes {
    /** Of luminance (of the mean of channels that are not three): the root of the area-weighted mean square. */
    rms: number;
    /** The largest change with its sign, and the element where it is. */
    most: number;
    mostAt: number;
    /** |b − a| / |a| in area-weighted norms, channels stacked; NaN where a is dark. */
    relative: number;
    /** Changes of luminance stay below it on 99 % of the area. */
    high: number;
}

/** a, b: [C][n]; area: [n]. O(C n). */
export function changesOf(a: Float32Array, b: Float32Array, channels: number, area: Float64Array): Changes {
    const n = area.length, weights = channelWeights(channels), size = new Float32Array(n);
    let square = 0, total = 0, most = 0, mostAt = 0, apart = 0, whole = 0;
    for (let i = 0; i < n; i++) {
        let change = 0;
        for (let c = 0; c < channels; c++) {
            const before = a[c * n + i], by = b[c * n + i] - before;
            change += weights[c] * by;
            apart += area[i] * by * by;
            whole += area[i] * before * before;
        }
        square += area[i] * change * change;
        total += area[i];
        size[i] = Math.abs(change);
        if (size[i] > Math.abs(most)) [most, mostAt] = [change, i];
    }
    return {
        rms: total > 0 ? Math.sqrt(square / total) : 0,
        most,
        mostAt,
        relative: whole > 0 ? Math.sqrt(apart / whole) : NaN,
        high: spreadOf(size, area, () => true).high,
    };
}

/** The least of 1, 2 and 5 times a power of ten that is at least this: an end of a scale that seldom moves. */
export function roundUp(value: number): number {
    if (!(value > 0)) return 1;
    const ten = 10 ** Math.floor(Math.log10(value));
    return Number(([1, 2, 5, 10].find((m) => m * ten >= value * 0.9999) as number * ten).toPrecision(12));
}

const LESS = [0.02, 0.13, 0.65], EVEN = [0.8, 0.8, 0.8], MORE = [0.62, 0.02, 0.05];

/** Linear colour of a change from −1 to 1, as the shader has it. */
export function changeColour(t: number): number[] {
    const end = t < 0 ? LESS : MORE;
    return EVEN.map((v, k) => v + Math.min(1, Math.abs(t)) * (end[k] - v));
}
