// The tiles of the open store and the weather that skies are made of; answers with radiances for a lighting.
import { ofTemperature } from "../base/colour.ts";
import type { Moment, SkyLight } from "../state/state.ts";
import { skyFor, type Sky } from "./skies.ts";
import { tilesOf, type SkyAnswer, type Tiles } from "./tiles.ts";
import { readWeather, weatherAt, weatherOf, type Weather } from "./weather.ts";

/** Skies that are kept, for two lightings beside each other that take turns. */
const KEPT = 4;

/** Colour temperatures of a tinted sky, K: without a sun, beside a sun, and of the sun. */
const OVERCAST_K = 6500, BLUE_K = 12000, SUN_K = 5200;

/** The light of a sky and of its sun. */
export interface SunParts {
    /** Radiances of the tiles: of the sky without the sun, and of the sun alone. */
    sky: readonly (number | number[])[];
    sun: readonly (number | number[])[];
    /** To the sun: east, north, up. */
    direction: readonly [number, number, number];
    /** Irradiance that faces the sun, by red, green and blue. */
    light: [number, number, number];
}

export class SkySource {
    /** Of the open scene. */
    tiles: Tiles | null = null;
    weather: Weather | null = null;
    /** True where the weather is that beside the store, so that a link restores it. */
    isBeside = false;
    /** What is wrong with the last file that was to be read. */
    problem: string | null = null;
    private readonly others = new Map<string, Tiles>();
    private kept = new Map<string, { sky: Sky | null; values: readonly (number | number[])[] | null }>();

    /** Takes in the tiles of the scene that is opened. */
    take(answer: SkyAnswer | null): void {
        this.tiles = answer === null ? null : tilesOf(answer);
        this.others.clear();
        this.kept.clear();
    }

    /** Takes in those of another scene, which the open one is compared with. */
    takeOther(name: string, answer: SkyAnswer): void {
        this.others.set(name, tilesOf(answer));
    }

    knows(other: string): boolean {
        return this.others.has(other);
    }

    /** Reads a weather file; one that is wrong is not taken, and `problem` says why. True if it is taken. */
    read(text: string, isBeside: boolean): boolean {
        this.problem = null;
        try {
            this.weather = readWeather(text);
            this.isBeside = isBeside;
        } catch (reason) {
            this.problem = (reason as Error).message;
        }
        this.kept.clear();
        return this.problem === null;
    }

    /** That of a link holds at its own time, until a file is picked. */
    weatherFor(light: SkyLight): Weather | null {
        const { moment } = light, isItsTime = moment !== null && moment.day === light.day && moment.hour === light.hour;
        return isItsTime && (this.weather === null || this.isBeside) ? weatherOf(moment) : this.weather;
    }

    /** The weather that a link has to hold: of a file that was picked, or of the link that brought it. */
    momentOf(light: SkyLight): Moment | null {
        if (light.model !== "perez") return null;
        if (this.weather === null || this.isBeside) return light.moment;
        const { day, hour } = light, at = weatherAt(this.weather, day, hour);
        return at === null ? null : {
            day,
            hour,
            year: at.year,
            direct: at.direct,
            isHorizontal: this.weather.directIsHorizontal,
            diffuse: at.diffuse,
            dewPoint: Number.isNaN(at.dewPoint) ? null : at.dewPoint,
        };
    }

    forget(): void {
        this.weather = null;
        this.problem = null;
        this.kept.clear();
    }

    sky(light: SkyLight, photometric: boolean): Sky | null {
        return this.find(light, photometric, 1, null).sky;
    }

    /** One radiance a tile of the open scene (other null) or of another one, or three; null without light. */
    radiances(light: SkyLight, photometric: boolean, channels: number, other: string | null = null):
        | readonly (number | number[])[]
        | null
    {
        return this.find(light, photometric, channels, other).values;
    }

    /** The same of the open scene or another one, with the sun apart; null without a sun. */
    parts(light: SkyLight, photometric: boolean, channels: number, scene: string | null = null): SunParts | null {
        const { sky } = this.find(light, photometric, channels, scene);
        if (sky === null || !(sky.directHorizontal > 0)) return null;
        const isColoured = light.tinted && channels === 3, normal = sky.directHorizontal / sky.sun.direction[2];
        const [one, other] = isColoured ? colouredParts(sky) : [Array.from(sky.diffuse), Array.from(sky.direct)];
        return { sky: one, sun: other, direction: sky.sun.direction,
            light: (isColoured ? ofTemperature(SUN_K) : [1, 1, 1]).map((v) => v * normal) as SunParts["light"] };
    }

    private find(light: SkyLight, photometric: boolean, channels: number,
        other: string | null): { sky: Sky | null; values: readonly (number | number[])[] | null }
    {
        const isColoured = light.tinted && channels === 3;
        const key = JSON.stringify([light, photometric, isColoured, other]);
        let found = this.kept.get(key);
        if (found === undefined) {
            const tiles = other === null ? this.tiles : this.others.get(other) ?? null,
                sky = tiles === null ? null : skyFor(tiles, light, photometric, this.weatherFor(light));
            found = { sky, values: sky === null
                ? null
                : isColoured
                ? coloured(sky)
                : Array.from(sky.diffuse, (value, t) => value + sky.direct[t]) };
            this.kept.set(key, found);
            if (this.kept.size > KEPT) this.kept.delete(this.kept.keys().next().value as string);
        }
        return found;
    }
}

/** Sky and sun with their luminances as they are. */
function colouredParts(sky: Sky): [number[][], number[][]] {
    const blue = ofTemperature(sky.directHorizontal > 0 ? BLUE_K : OVERCAST_K), warm = ofTemperature(SUN_K);
    const times = (values: Float64Array, colour: readonly number[]): number[][] =>
        Array.from(values, (value) => colour.map((c) => value * c));
    return [times(sky.diffuse, blue), times(sky.direct, warm)];
}

function coloured(sky: Sky): number[][] {
    const [one, other] = colouredParts(sky);
    return one.map((values, t) => values.map((value, c) => value + other[t][c]));
}

const WINDS = ["N", "NE", "E", "SE", "S", "SW", "W", "NW"];

/** Degrees from north by east, 0 to 360, and the wind's name. */
export function windOf(azimuth: number): string {
    const degrees = (((azimuth * 180) / Math.PI) % 360 + 360) % 360;
    return `${degrees.toFixed(0)}° (${WINDS[Math.round(degrees / 45) % 8]})`;
}

export function clockOf(hour: number): string {
    const minutes = Math.round(hour * 60);
    return `${String(Math.floor(minutes / 60)).padStart(2, "0")}:${String(minutes % 60).padStart(2, "0")}`;
}
