// The state of the page: all that a link restores. Plain data; changes make new objects.
import type { Rgb } from "../base/colour.ts";
import type { Quantity } from "../daemon/api.ts";
import type { SensorChoice } from "./sensors.ts";

/** Emission of a group: `power` is its luminance-weighted exitance in the store's unit, the colour has luminance 1. */
export interface GroupLight {
    on: boolean;
    power: number;
    colour: Rgb;
    /** The colour temperature that the colour was chosen by, or null. */
    kelvin: number | null;
}

/** What a person made of a luminaire, or of a group of them. */
export interface LuminaireLight {
    on: boolean;
    /** 1 is the full light. */
    dim: number;
    /** Factors of red, green and blue. */
    tint: Rgb;
    /** The colour temperature that the tint was chosen by, or null. */
    kelvin: number | null;
}

/** The weather of one hour of a file that was picked, which a link holds in place of the file. */
export interface Moment {
    /** The time that it is of: those of SkyLight. */
    day: number;
    hour: number;
    /** The year of the sun's position. */
    year: number;
    /** W/m²: direct light, facing the sun or on a horizontal plane, and diffuse light on a horizontal plane. */
    direct: number;
    isHorizontal: boolean;
    diffuse: number;
    /** Degrees Celsius; null: unknown. */
    dewPoint: number | null;
}

export const SKY_MODELS = ["off", "overcast", "clear", "turbid", "given", "even", "perez"] as const;
export type SkyModel = (typeof SKY_MODELS)[number];

export interface SkyLight {
    /** "turbid" is a clear day of a turbidity, "given" has the two irradiances below, "perez" is that of a weather
     * file. */
    model: SkyModel;
    /** Horizontal irradiance of an even or overcast sky, in the store's unit. */
    strength: number;
    /** Of the light of a clear sky, or of the weather file. */
    factor: number;
    /** Of Linke: as many clean and dry atmospheres dim the sun as much. */
    turbidity: number;
    /** W/m² of a given sky: direct light facing the sun, and diffuse light on the ground. */
    direct: number;
    diffuse: number;
    /** The sun is itself, by rays that the daemon casts, in one tile, spread over those near it, or left out. */
    sun: "exact" | "tile" | "spread" | "off";
    /** Where the store has channels, the sky is bluish and the sun warm. */
    tinted: boolean;
    latitude: number;
    longitude: number;
    /** Hours from UTC of the clock that `hour` is read from. */
    zone: number;
    /** Day of the year, 1 to 365, and local time in hours. */
    day: number;
    hour: number;
    /** Of a link; it holds at its own day and hour, until a file is picked. */
    moment: Moment | null;
}

export interface Lighting {
    groups: { [name: string]: GroupLight };
    /** Of all lamps, luminaires and emitters. */
    dim: number;
    /** The group, and the luminaire or group of luminaires, that shines alone: at most one of the two. */
    solo: string | null;
    soloLuminaire: string | null;
    sky: SkyLight;
    /** Weights of precomputed emitters; those that are absent are 0. */
    emitters: { [index: string]: number };
    /** By names of luminaires or of groups of them; those that are absent are as their list says. */
    luminaires: { [name: string]: LuminaireLight };
}

/** Eye and target in metres, y up; and, where they are not those of the page, the angle of view (of the height, in
 * degrees) and the direction that is up in the picture. */
export type Place = [number, number, number, number, number, number] | [number, number, number, number, number, number,
    number, number, number, number];

export const TONES = ["agx", "aces", "linear"] as const;
export const PALETTES = ["viridis", "inferno", "turbo"] as const;
export const UNITS = ["W/m²", "lx"] as const;
export type Tone = (typeof TONES)[number];
export type Palette = (typeof PALETTES)[number];
export type Unit = (typeof UNITS)[number];

export interface View {
    picture: "light" | "false";
    quantity: Quantity;
    smooth: boolean;
    textured: boolean;
    /** The sun is drawn from its true direction, in place of the tiles of the sky that numbers have for it. */
    sharpSun: boolean;
    tone: Tone;
    /** log2 of the factor before the tone curve; null: chosen from the first answer and then held. */
    exposure: number | null;
    /** The exposure follows each answer. */
    follow: boolean;
    palette: Palette;
    /** Ends of the palette; null: from the values. */
    range: [number, number] | null;
    log: boolean;
    isoLines: number;
    /** Of the store, by its irradiance: unitOf has that of other quantities. */
    unit: Unit;
    /** Elements below this value are marked; null: no marks. */
    threshold: number | null;
    /** Group whose elements are judged by the threshold; null: all. */
    judged: string | null;
    /** Targets of mean and uniformity for the judged group, as EN 12464-1 states them for a task. */
    uniformity: number;
    walk: boolean;
    /** Null: the whole scene. */
    camera: Place | null;
    /** The openings of luminaires are drawn. */
    openings: boolean;
    /** Sensors are drawn, but for those of these sets. */
    sensors: boolean;
    hiddenSets: string[];
    /** The irradiance that sensors should have; null: none is required. */
    required: number | null;
}

export interface Preset {
    name: string;
    lighting: Lighting;
}

/** A place of the camera that was kept. */
export interface KeptView {
    name: string;
    camera: Place;
}

export interface Compare {
    how: "split" | "difference";
    /** Another scene of as many elements, or null: this one. */
    scene: string | null;
    /** The other lighting, or null: this one. */
    lighting: Lighting | null;
    split: number;
}

export interface State {
    scene: string;
    lighting: Lighting;
    view: View;
    presets: Preset[];
    views: KeptView[];
    pins: number[];
    /** The sensor that is marked in the picture. */
    sensor: SensorChoice | null;
    compare: Compare | null;
    /** Certified bound that is asked for, or null. */
    tolerance: number | null;
}

export const skyOff: SkyLight = {
    model: "off",
    strength: 100,
    factor: 1,
    turbidity: 3,
    direct: 700,
    diffuse: 120,
    sun: "spread",
    tinted: false,
    latitude: 48,
    longitude: 11,
    zone: 1,
    day: 172,
    hour: 12,
    moment: null,
};

export const firstView: View = {
    picture: "light",
    quantity: "radiosity",
    smooth: true,
    textured: true,
    sharpSun: false,
    tone: "agx",
    exposure: null,
    follow: false,
    palette: "viridis",
    range: null,
    log: false,
    isoLines: 0,
    unit: "W/m²",
    threshold: null,
    judged: null,
    uniformity: 0.6,
    walk: false,
    camera: null,
    openings: true,
    sensors: true,
    hiddenSets: [],
    required: null,
};

export const firstLighting: Lighting = { groups: {}, dim: 1, solo: null, soloLuminaire: null, sky: skyOff, emitters: {},
    luminaires: {} };

export const firstState: State = {
    scene: "",
    lighting: firstLighting,
    view: firstView,
    presets: [],
    views: [],
    pins: [],
    sensor: null,
    compare: null,
    tolerance: null,
};

/** The quantity of the picture and of all readings. */
export function quantityShown({ picture, quantity }: View): Quantity {
    return picture === "light" ? "radiosity" : quantity;
}

/** The unit of a quantity: light in lx falls on a surface, and light that leaves one is in lm/m², as the answers of
 * the daemon say it. */
export function unitOf({ unit }: View, quantity: Quantity): string {
    return unit === "lx" && quantity !== "irradiance" ? "lm/m²" : unit;
}

/** The unit of the picture. */
export function unitShown(view: View): string {
    return unitOf(view, quantityShown(view));
}

/** A lamp or a luminaire shines alone, without the sky. */
export function isSolo({ solo, soloLuminaire }: Lighting): boolean {
    return solo !== null || soloLuminaire !== null;
}

/** Emission of each group under a lighting, per channel, in the store's unit; groups that are dark are absent. */
export function emissionOf(lighting: Lighting, channels: number): { [name: string]: number | number[] } {
    const out: { [name: string]: number | number[] } = {};
    for (const [name, light] of Object.entries(lighting.groups)) {
        const power = light.power * lighting.dim;
        if (!light.on || power <= 0 || (isSolo(lighting) && lighting.solo !== name)) continue;
        out[name] = channels === 3 ? light.colour.map((c) => c * power) : power;
    }
    return out;
}
