// Skies of the daemon for lightings, each asked for once, and the weather that they are made of.
import type { Api } from "../daemon/api.ts";
import type { SkyMade, SkyRequest, SkyTiles, WeatherRows } from "../daemon/daylight.ts";
import type { Moment, SkyLight } from "../state/state.ts";
import { skyRequest } from "./sky_request.ts";
import { Sky } from "./made_sky.ts";
import { weatherAt, weatherFrom, weatherOf, type Weather } from "./weather.ts";

/** Answers that are kept: those of a slider that goes back and forth, at some 150 to 40,000 numbers each. */
const KEPT = 32;

export class SkySource {
    /** Of the open scene. */
    tiles: SkyTiles | null = null;
    weather: Weather | null = null;
    /** True where the weather is that beside the store, so that a link restores it. */
    isBeside = false;
    /** What is wrong with the last file that was to be read. */
    problem: string | null = null;
    private readonly others = new Set<string>();
    /** By scene and request; those on their way have no answer yet. */
    private kept = new Map<string, { made: SkyMade | null; answer: Promise<SkyMade> }>();

    constructor(private readonly api: Pick<Api, "makeSky">) {}

    /** Takes in the tiles of the scene that is opened. */
    take(tiles: SkyTiles | null): void {
        this.tiles = tiles;
        this.others.clear();
        this.kept.clear();
    }

    /** Another scene, which the open one is compared with, has tiles too. */
    takeOther(name: string): void {
        this.others.add(name);
    }

    knows(other: string): boolean {
        return this.others.has(other);
    }

    takeWeather(rows: WeatherRows, isBeside: boolean): void {
        this.problem = null;
        this.weather = weatherFrom(rows);
        this.isBeside = isBeside;
    }

    forget(): void {
        this.weather = null;
        this.problem = null;
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

    /** What a sky is asked for by; null: it is dark. */
    request(light: SkyLight, photometric: boolean): SkyRequest | null {
        return skyRequest(light, photometric, this.weatherFor(light));
    }

    /** The sky of a scene where it is known: null where it is dark, undefined where it is to be asked for. */
    known(scene: string, light: SkyLight, photometric: boolean): Sky | null | undefined {
        const request = this.request(light, photometric);
        if (request === null) return null;
        const made = this.kept.get(keyOf(scene, request))?.made;
        return made === undefined || made === null ? undefined : new Sky(made, light);
    }

    /** Asks for the sky of a scene, unless it is known; null: it is dark. */
    async sky(scene: string, light: SkyLight, photometric: boolean): Promise<Sky | null> {
        const request = this.request(light, photometric);
        return request === null ? null : new Sky(await this.made(scene, request), light);
    }

    private made(scene: string, request: SkyRequest): Promise<SkyMade> {
        const { kept } = this, key = keyOf(scene, request), there = kept.get(key);
        // The one that was needed last goes last.
        if (there !== undefined) {
            kept.delete(key);
            kept.set(key, there);
            return there.answer;
        }
        const entry: { made: SkyMade | null; answer: Promise<SkyMade> } = { made: null,
            answer: this.api.makeSky(scene, request).then((made) => entry.made = made, (reason: unknown) => {
                // It is asked for again when it is needed again.
                if (kept.get(key) === entry) kept.delete(key);
                throw reason;
            }) };
        kept.set(key, entry);
        if (kept.size > KEPT) kept.delete(kept.keys().next().value as string);
        return entry.answer;
    }
}

const keyOf = (scene: string, request: SkyRequest): string => JSON.stringify([scene, request]);

const WINDS = ["N", "NE", "E", "SE", "S", "SW", "W", "NW"];

/** Degrees from north by east, 0 to 360, and the wind's name. */
export function windOf(azimuth: number): string {
    const degrees = ((azimuth % 360) + 360) % 360;
    return `${degrees.toFixed(0)}° (${WINDS[Math.round(degrees / 45) % 8]})`;
}

export function clockOf(hour: number): string {
    const minutes = Math.round(hour * 60);
    return `${String(Math.floor(minutes / 60)).padStart(2, "0")}:${String(minutes % 60).padStart(2, "0")}`;
}
