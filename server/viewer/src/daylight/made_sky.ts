// A sky that the daemon made, under what of a lighting is linear in it: its strength, its factor, its colours, and the
// part that its sun has.
import { ofTemperature, type Rgb } from "../base/colour.ts";
import type { SkyMade } from "../daemon/daylight.ts";
import type { ExactSun } from "../state/request.ts";
import type { SkyLight } from "../state/state.ts";

export type Radiances = readonly (number | number[])[];

/** The light of a sky and of its sun. */
export interface SunParts {
    /** Radiances of the tiles: of the sky without the sun, and of the sun alone. */
    sky: Radiances;
    sun: Radiances;
    /** To the sun, in the axes of the store. */
    direction: readonly [number, number, number];
    /** Irradiance that faces the sun, by red, green and blue. */
    light: Rgb;
}

/** Colour temperatures of a tinted sky, K: without a sun, beside a sun, and of the sun. */
const OVERCAST_K = 6500, BLUE_K = 12000, SUN_K = 5200;

export class Sky {
    /** Radiance of each tile by the sky and by its sun: W/(m² sr), or cd/m². */
    readonly diffuse: number[];
    readonly direct: number[];
    /** Irradiance of a horizontal plane by both. */
    readonly diffuseHorizontal: number;
    readonly directHorizontal: number;
    private readonly factor: number;
    private readonly hasSun: boolean;

    constructor(readonly made: SkyMade, private readonly light: SkyLight) {
        const isPlain = light.model === "even" || light.model === "overcast", { sun } = made;
        const factor = this.factor = isPlain ? light.strength / made.diffuse : light.factor;
        this.hasSun = sun !== null && light.sun !== "off" && factor * made.direct > 0;
        this.diffuse = made.sky.map((value) => factor * value);
        this.direct = new Array<number>(made.sky.length).fill(0);
        if (sun !== null && this.hasSun) sun.tiles.forEach((t, i) => this.direct[t] = factor * sun.radiance[i]);
        this.diffuseHorizontal = factor * made.diffuse;
        this.directHorizontal = this.hasSun ? factor * made.direct : 0;
    }

    /** Of all the light: one radiance a tile, or three. */
    radiances(channels: number): Radiances {
        if (!this.isColoured(channels)) return this.diffuse.map((value, t) => value + this.direct[t]);
        const [blue, warm] = this.colours;
        return this.diffuse.map((value, t) => blue.map((c, k) => value * c + this.direct[t] * warm[k]));
    }

    /** The sun apart; null: none shines. */
    parts(channels: number): SunParts | null {
        const { made: { sun } } = this;
        if (sun === null || !this.hasSun) return null;
        const isColoured = this.isColoured(channels), [blue, warm] = this.colours, normal = this.factor * sun.normal;
        const times = (values: readonly number[], colour: Rgb): Radiances =>
            isColoured ? values.map((value) => colour.map((c) => value * c)) : values;
        return { sky: times(this.diffuse, blue), sun: times(this.direct, warm), direction: sun.direction,
            light: (isColoured ? warm : [1, 1, 1]).map((v) => v * normal) as Rgb };
    }

    /** The sky without its sun, and the sun itself; null: none shines. */
    exact(channels: number): { sky: Radiances; sun: ExactSun } | null {
        const parts = this.parts(channels), { made: { sun } } = this;
        return parts === null || sun === null
            ? null
            : { sky: parts.sky,
                sun: { azimuth: sun.azimuth, altitude: sun.altitude,
                    direct: channels === 3 ? parts.light : parts.light[0] } };
    }

    private isColoured(channels: number): boolean {
        return this.light.tinted && channels === 3;
    }

    /** Sky and sun with their luminances as they are. */
    private get colours(): [Rgb, Rgb] {
        return [ofTemperature(this.directHorizontal > 0 ? BLUE_K : OVERCAST_K), ofTemperature(SUN_K)];
    }
}
