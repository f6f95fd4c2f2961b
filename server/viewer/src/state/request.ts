// The body of the request for a lighting. Emission is sent scaled to at most 1, so that answers in half precision keep
// their digits whatever the unit; the field gets the scale back.
import type { Quantity } from "../daemon/api.ts";
import { dimmersOf, meanLightOf, type SceneLuminaires } from "./luminaires.ts";
import { emissionOf, type Lighting } from "./state.ts";

export interface Wanted {
    scene: string;
    quantity: Quantity;
    /** EMISSION of the contract, scaled; null: nothing shines. */
    emission: { [member: string]: unknown } | null;
    scale: number;
}

/** What of the lighting the store can take. */
export interface Abilities {
    channels: number;
    groups: readonly string[];
    emitters: number;
    /** Null: the store has none, or they are dark. */
    luminaires: SceneLuminaires | null;
    /** One radiance per tile of the sky in the store's unit; null: no sky, or dark. */
    sky: readonly (number | number[])[] | null;
    /** The sun itself beside that, which is then without it. */
    sun?: ExactSun | null;
}

/** Degrees from north by east and above the horizon; irradiance of a plane that faces the sun. */
export interface ExactSun {
    azimuth: number;
    altitude: number;
    direct: number | number[];
}

/** Close to a luminaire there is so much more light than on average: halves end at 65,504. */
const ABOVE_MEAN = 64;

export function wantedFor(scene: string, quantity: Quantity, lighting: Lighting, can: Abilities): Wanted {
    // Lamps of the scene are not in the answers of a store of few emitters, nor in what these are scaled by.
    const groups = can.emitters > 0
        ? []
        : Object.entries(emissionOf(lighting, can.channels)).filter(([name]) => can.groups.includes(name));
    const sky = can.sky !== null && can.sky.some((v) => [v].flat().some((x) => x > 0)) ? can.sky : null;
    const weights = Object.entries(lighting.emitters).filter(([index, weight]) =>
        weight > 0 && Number(index) < can.emitters
    );
    const dimmers = can.luminaires === null ? {} : dimmersOf(can.luminaires.rows, lighting, can.channels),
        meanLight = can.luminaires === null ? 0 : meanLightOf(can.luminaires, lighting);
    const largest = (values: Iterable<number>): number => {
        let most = 0;
        for (const value of values) if (value > most) most = value;
        return most;
    };
    const most = Math.max(largest(groups.flatMap(([, v]) => [v].flat())),
        largest((sky ?? []).flatMap((v) => [v].flat())), largest([can.sun?.direct ?? 0].flat()),
        lighting.dim * largest(weights.map(([, weight]) => weight)), ABOVE_MEAN * meanLight);
    if (most <= 0 || !Number.isFinite(most)) return { scene, quantity, emission: null, scale: 1 };
    const scaled = <T extends number | number[]>(value: T): T =>
        (typeof value === "number" ? value / most : value.map((v) => v / most)) as T;
    const emission: { [member: string]: unknown } = {};
    // A store of the tiles of a sky takes them as weights or as a sky, whichever shines.
    if (can.emitters > 0 && (weights.length > 0 || sky === null)) {
        const all = new Array<number>(can.emitters).fill(0);
        for (const [index, weight] of weights) all[Number(index)] = (weight * lighting.dim) / most;
        emission.emitters = all;
    } else if (groups.length > 0) {
        emission.groups = Object.fromEntries(groups.map(([name, value]) => [name, scaled(value)]));
    }
    if (meanLight > 0)
        emission.luminaires = Object.fromEntries(Object.entries(dimmers).map(([name, value]) => [name, scaled(value)]));
    if (sky !== null) emission.sky = sky.map(scaled);
    // Both are turned by the north of the store.
    if (can.sun !== undefined && can.sun !== null) emission.sun = { ...can.sun, direct: scaled(can.sun.direct) };
    return { scene, quantity, emission, scale: most };
}
