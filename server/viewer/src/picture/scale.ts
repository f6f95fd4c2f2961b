// Values on an axis: ticks, places, how values spread over the area. Knows no picture and no page.

/** An axis from low to high; a logarithmic one has low above 0. */
export interface Axis {
    low: number;
    high: number;
    log: boolean;
}

/** Where a value stands on the axis: 0 at its low end, 1 at its high one, and beyond. */
export function placeOf(value: number, { low, high, log }: Axis): number {
    if (log) return value > 0 ? Math.log(value / low) / Math.log(high / low) : -Infinity;
    return (value - low) / (high - low);
}

export function valueAt(place: number, { low, high, log }: Axis): number {
    return log ? low * (high / low) ** place : low + place * (high - low);
}

/** Round numbers (1, 2, 5 times a power of ten) on the axis, about `wanted` of them. */
export function ticksOf(axis: Axis, wanted: number): number[] {
    const { low, high, log } = axis;
    if (!(high > low) || (log && low <= 0)) return [];
    if (log) {
        for (const  of of[[1, 2, 5], [1, 3], [1]]) {
            const all = decades(low, high, of);
            if (all.length >= 2 && all.length <= 1.5 * wanted) return all;
        }
        const all = decades(low, high, [1]);
        if (all.length >= 2) {
            const every = Math.ceil(all.length / wanted);
            return all.filter((_, i) => i % every === 0);
        }
        // Less than a decade: equal steps are nearly equal factors.
    }
    const rough = (high - low) / wanted, ten = 10 ** Math.floor(Math.log10(rough));
    const step = ten * ([1, 2, 5, 10].find((m) => m * ten >= rough * 0.999) ?? 10);
    const out: number[] = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++)
        out.push(Number((k * step).toPrecision(12)));
    return out;
}

function decades(low: number, high: number, of: readonly number[]): number[] {
    const out: number[] = [];
    for (let ten = Math.floor(Math.log10(low)); 10 ** ten <= high; ten++)
        for (const m of of) {
            const value = Number(`${m}e${ten}`);
            if (value >= low * (1 - 1e-9) && value <= high * (1 + 1e-9)) out.push(value);
        }
    return out;
}

/** Area of the elements in each of `bins` equal parts of the axis. Values beyond its ends count in the parts there. */
export function areaByValue(values: Float32Array, area: Float64Array, counts: (element: number) => boolean, axis: Axis,
    bins: number): Float64Array
{
    const out = new Float64Array(bins);
    for (let i = 0; i < values.length; i++)
        if (counts(i)) out[Math.min(bins - 1, Math.max(0, Math.floor(placeOf(values[i], axis) * bins)))] += area[i];
    return out;
}

export interface Figures {
    area: number;
    mean: number;
    min: number;
    max: number;
    /** U0 of EN 12464-1: the least value over the mean. */
    uniformity: number;
    /** Share of the area whose value is at least the threshold. */
    reached: number;
}

/** Figures of the elements of a list; NaN where it has no area. */
export function figuresOf(values: Float32Array, area: Float64Array, elements: Iterable<number>,
    threshold = 0): Figures
{
    let total = 0, sum = 0, above = 0, min = Infinity, max = -Infinity;
    for (const i of elements) {
        const value = values[i];
        total += area[i];
        sum += area[i] * value;
        if (value >= threshold) above += area[i];
        if (value < min) min = value;
        if (value > max) max = value;
    }
    if (!(total > 0)) return { area: 0, mean: NaN, min: NaN, max: NaN, uniformity: NaN, reached: NaN };
    const mean = sum / total;
    return { area: total, mean, min, max, uniformity: mean > 0 ? min / mean : NaN, reached: above / total };
}
