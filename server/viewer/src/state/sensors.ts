// The sensors of a store: sets of places at which light is read, and figures of their values. Knows no picture and no
// request.
import type { SensorSet, Vector } from "../daemon/api.ts";
import { channelWeights } from "../picture/field.ts";

/** A set among all places of the scene, which are counted through. */
export interface PlacedSet {
    readonly set: SensorSet;
    /** The number of its first place. */
    readonly first: number;
    readonly count: number;
    /** Probes have coefficients of radiance in place of a value. */
    readonly isProbes: boolean;
    /** Places in walls and in luminaires, from 0, which have no value. */
    readonly lacking: ReadonlySet<number>;
}

export interface SceneSensors {
    readonly sets: readonly PlacedSet[];
    readonly places: number;
    /** The sets whose values the daemon answers, by name; of probes alone it is empty. */
    readonly names: readonly string[];
}

/** One of a set, from 0. */
export interface SensorChoice {
    set: string;
    index: number;
}

/** Figures of the places of a set that have a value; NaN where none has. */
export interface SensorFigures {
    /** Places that have a value. */
    valued: number;
    mean: number;
    min: number;
    /** Least value over mean. */
    uniformity: number;
    /** Share of the places that have at least the required value; NaN without one. */
    reached: number;
}

/** Null of none. */
export function sensorsOf(sets: readonly SensorSet[]): SceneSensors | null {
    let places = 0;
    const placed = sets.map((set): PlacedSet => {
        const first = places, count = set.at.length;
        places += count;
        return { set, first, count, isProbes: set.kind === "probes",
            lacking: new Set([...set.in_walls, ...set.in_luminaires]) };
    });
    if (places === 0) return null;
    return { sets: placed, places, names: placed.filter((one) => !one.isProbes).map(({ set }) => set.name) };
}

/** The values of an answer, [C][m] or [m] of the sets that are named, set by set, times a scale: one number for each
 * place of the scene, of several channels the luminance or their mean. NaN: it has none. */
export function valuesOf({ sets, places }: SceneSensors, data: ArrayLike<number>, channels: number,
    scale: number): Float32Array
{
    const out = new Float32Array(places).fill(NaN), weights = channelWeights(channels), width = data.length / channels;
    let next = 0;
    for (const { first, count, isProbes } of sets) {
        if (isProbes) continue;
        for (let k = 0; k < count; k++, next++) {
            let sum = 0;
            for (let c = 0; c < channels; c++) sum += weights[c] * data[c * width + next];
            out[first + k] = sum * scale;
        }
    }
    return out;
}

/** In the dark all that have a value have 0. */
export function darkValuesOf({ sets, places }: SceneSensors): Float32Array {
    const out = new Float32Array(places).fill(NaN);
    for (const { first, count, isProbes, lacking } of sets)
        for (let k = 0; k < count; k++) if (!isProbes && !lacking.has(k)) out[first + k] = 0;
    return out;
}

/** O(places of the set). */
export function figuresOfSet({ first, count }: PlacedSet, values: Float32Array,
    required: number | null): SensorFigures
{
    let valued = 0, sum = 0, min = Infinity, reached = 0;
    for (let k = first; k < first + count; k++) {
        const value = values[k];
        if (Number.isNaN(value)) continue;
        valued += 1;
        sum += value;
        if (value < min) min = value;
        if (required !== null && value >= required) reached += 1;
    }
    if (valued === 0) return { valued, mean: NaN, min: NaN, uniformity: NaN, reached: NaN };
    const mean = sum / valued;
    return { valued, mean, min, uniformity: mean > 0 ? min / mean : NaN,
        reached: required === null ? NaN : reached / valued };
}

/** The vector of place k of a set that has one for all, or one each; null: it has none. */
export function vectorOf(vectors: SensorSet["axis"], k: number): Vector | null {
    if (vectors === null) return null;
    return typeof vectors[0] === "number" ? vectors as Vector : (vectors as Vector[])[k];
}

/** The number of a place among all of the scene; null: there is no such place. */
export function placeOfChoice(sensors: SceneSensors | null, choice: SensorChoice | null): number | null {
    const found = sensors?.sets.find(({ set }) => set.name === choice?.set);
    return found !== undefined && choice !== null && choice.index < found.count ? found.first + choice.index : null;
}

/** The set that a place is of, and its number there, from 0. O(log sets). */
export function choiceOfPlace({ sets }: SceneSensors, place: number): { of: PlacedSet; index: number } {
    let [low, high] = [0, sets.length - 1];
    while (low < high) {
        const middle = (low + high + 1) >> 1;
        if (sets[middle].first <= place) low = middle;
        else high = middle - 1;
    }
    return { of: sets[low], index: place - sets[low].first };
}

const NOUNS: { [kind: string]: string } = { cylinders: "cylinder", semicylinders: "semi-cylinder", spheres: "sphere",
    eyes: "eye", probes: "probe" };

/** A word for one of a set. */
export function nounOf({ set: { kind } }: PlacedSet): string {
    return NOUNS[String(kind)] ?? "sensor";
}

/** The reason why a place has no value; null: it has one, or none is known of. */
export function whyNone({ set, lacking, isProbes }: PlacedSet, index: number): string | null {
    if (!lacking.has(index)) return isProbes ? "nine coefficients of radiance" : null;
    return set.in_walls.includes(index) ? "no value: in a wall" : "no value: in a luminaire";
}
