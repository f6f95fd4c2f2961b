// Asks the daemon, by Lambert's client of deploy/js. Knows the routes and their JSON, and nothing of pictures.
import { connect, LambertError, type Daemon, type Npy, type Request, type SceneLine } from "lambert-light";
import type { Gaps, Place, SkyMade, SkyRequest, SkyTiles, SunPositions, WeatherRows } from "./daylight.ts";

export type ErrorFigures = { [name: string]: number };

/** Errors of what a group receives, as shares of what it reflects: of light of all groups, of near and of far ones. */
export type GroupErrors = { name: string; uniform?: number; near?: number; far?: number };

/** An answer in single precision as it came, with what its headers say. */
export interface Floats {
    file: ArrayBuffer;
    certificate: number | null;
    iterations: number | null;
    solveMs: number | null;
}

export type Vector = [number, number, number];

export interface Description {
    name: string;
    elements: number;
    channels: number;
    /** The light that numbers of the store count: W/m², or lm/m² and lx. */
    lights: "W" | "lm";
    kind: string;
    method: string;
    reason: string;
    bytes: number;
    groups: { name: string; elements: number }[];
    emitters: string[] | null;
    /** In the axes of the store, metres; the field of view is that of the height, in degrees. */
    cameras?: { name: string; eye: Vector; direction: Vector; up: Vector; fov: number }[];
    sky: { tiling: string; tiles: number; ground_albedo: number } | null;
    /** Null: the store has none. */
    luminaires: { count: number; lumens: number } | null;
    sensors: { sets: number; receivers: number } | null;
    error: { [light: string]: ErrorFigures | GroupErrors[] | number | string | boolean } & {
        [light in "single" | "lights" | "random" | "sky"]?: ErrorFigures;
    } | null;
    provenance?: { [name: string]: unknown };
    /** What the method reported; paths and reuse are of a lamp in many positions. */
    report?: { [name: string]: unknown };
}

/** The names of the emitters of a store of few but for its luminaires, which are the last of them. */
export function emittersOf({ emitters, luminaires }: Pick<Description, "emitters" | "luminaires">): readonly string[] {
    return emitters?.slice(0, emitters.length - (luminaires?.count ?? 0)) ?? [];
}

/** In the axes of the store, metres; directions are unit vectors. */
export interface Luminaire {
    name: string;
    /** Those that are dimmed together have one. */
    group: string | null;
    /** The middle of its opening. */
    at: Vector;
    /** Direction of gamma 0. */
    aim: Vector;
    c0: Vector;
    /** The dimmer that its list gives it. */
    dim: number;
    /** At dimmer 1. */
    lumens: number;
    /** Red, green and blue, of luminance 1. */
    colour: Vector;
    /** The size is along C0, along C90 and against the aim. */
    opening: { shape: string; size: Vector };
}

/** Places at which light is read, in the axes of the store, metres; directions are unit vectors. */
export interface SensorSet {
    name: string;
    /** points, grids, eyes, cylinders, semicylinders, spheres, cubes or probes; a number of a later daemon. */
    kind: string | number;
    at: Vector[];
    /** The normals of planes and the axes of cylinders, one for all or one each; null: of spheres. */
    axis: Vector | Vector[] | null;
    /** The way that semi-cylinders look; null of others. */
    look: Vector | Vector[] | null;
    /** Of a grid alone: the number of columns, row times columns plus column of each, and metres between them. */
    columns?: number;
    cells?: number[];
    spacing?: number[];
    /** Those that have no value, from 0. */
    in_walls: number[];
    in_luminaires: number[];
}

/** A body for POST …/radiosity; EMISSION of the contract. */
export type Emission = { [member: string]: unknown };

export const QUANTITIES = ["radiosity", "irradiance", "indirect"] as const;
export type Quantity = (typeof QUANTITIES)[number];

const TOKEN_KEY = "lambert-token";

export class Api {
    /** The page waits for what it asks, and goes on by itself after a daemon that is busy. */
    private readonly connected = connect(new URL(".", document.baseURI), { timeout: null, retries: 0 });

    /** With the token of now. */
    private get daemon(): Daemon {
        this.connected.token = this.token;
        return this.connected;
    }

    /** Requests so far, for the tests and the curious. */
    get asked(): number {
        return this.connected.asked;
    }

    get token(): string | null {
        return sessionStorage.getItem(TOKEN_KEY);
    }

    set token(value: string | null) {
        if (value === null) sessionStorage.removeItem(TOKEN_KEY);
        else sessionStorage.setItem(TOKEN_KEY, value);
    }

    /** The JSON of an answer. */
    private async get(path: string): Promise<unknown> {
        return (await this.daemon.ask("GET", path)).json();
    }

    private async post(path: string, body: object, signal?: AbortSignal): Promise<unknown> {
        return (await this.daemon.post(path, body, signalled(signal))).json();
    }

    /** Relative to the page, which may stand below any path of a proxy. */
    static path(scene: string, what = ""): string {
        return `v1/scenes/${encodeURIComponent(scene)}${what}`;
    }

    isReady(): Promise<boolean> {
        return this.daemon.health();
    }

    scenes(): Promise<SceneLine[]> {
        return this.daemon.scenes();
    }

    async describe(scene: string): Promise<Description> {
        const answer = await this.daemon.ask("GET", Api.path(scene), { accepted: [200, 202] });
        if (answer.status === 200) return answer.json() as Description;
        throw new LambertError(`${scene} is being built; open it again in a while.`, { status: 202, kind: "building" });
    }

    /** True when a variant that is being made is served. */
    async isServed(path: string): Promise<boolean> {
        return (await this.daemon.ask("GET", path, { accepted: [200, 202] })).status === 200;
    }

    async sky(scene: string): Promise<SkyTiles> {
        return (await this.get(Api.path(scene, "/sky"))) as SkyTiles;
    }

    /** In the order of their gradients. */
    async luminaires(scene: string): Promise<Luminaire[]> {
        return ((await this.get(Api.path(scene, "/luminaires"))) as { luminaires: Luminaire[] }).luminaires;
    }

    /** In the order of their values. */
    async sensors(scene: string): Promise<SensorSet[]> {
        return ((await this.get(Api.path(scene, "/sensors"))) as { sets: SensorSet[] }).sets;
    }

    /** Radiances of the tiles of a scene. */
    async makeSky(scene: string, sky: SkyRequest): Promise<SkyMade> {
        return ((await this.post(Api.path(scene, "/skies"), { sky })) as { skies: SkyMade[] }).skies[0];
    }

    /** At hours of a year of 365 days. */
    sunPositions(place: Place, hours: readonly number[]): Promise<SunPositions> {
        return this.daemon.sun(place, hours);
    }

    /** The rows of a weather file, of which the daemon keeps nothing. */
    async readWeather(text: string, gaps: Gaps): Promise<WeatherRows> {
        return (await this.post("v1/weather", { text, gaps })) as WeatherRows;
    }

    /** Those of the weather file beside the store. */
    async weatherBeside(scene: string, gaps: Gaps): Promise<WeatherRows> {
        return (await this.post(Api.path(scene, "/weather"), { gaps })) as WeatherRows;
    }

    /** With the corners that elements share. */
    async mesh(scene: string): Promise<ArrayBuffer> {
        const path = `${Api.path(scene, "/mesh")}?corners=elements`;
        return (await this.daemon.ask("GET", path, { accept: "model/gltf-binary" })).body;
    }

    /** [C][n] values, or [n] of one channel, in half precision; `request` has the emission and the quantity. */
    async radiosity(scene: string, request: object,
        signal?: AbortSignal): Promise<{ values: Npy; solveMs: number | null }>
    {
        const reply = await this.daemon.post(Api.path(scene, "/radiosity"), request, {
            accept: "application/x-npy; dtype=f2",
            ...signalled(signal),
        });
        return { values: reply.npy(), solveMs: reply.times.solve ?? null };
    }

    /** The same in single precision, as an NPY file. A request with a tolerance has a certificate. */
    async floats(scene: string, request: object, signal?: AbortSignal): Promise<Floats> {
        const reply = await this.daemon.post(Api.path(scene, "/radiosity"), request, {
            accept: "application/x-npy; dtype=f4",
            ...signalled(signal),
        });
        return { file: reply.body, certificate: reply.number("Lambert-Certificate"),
            iterations: reply.number("Lambert-Iterations"), solveMs: reply.times.solve ?? null };
    }

    /** The same as JSON, with its error, for selected elements, reductions and refinements. */
    async answer(scene: string, request: object, signal?: AbortSignal): Promise<{ [member: string]: unknown }> {
        return (await this.post(Api.path(scene, "/radiosity"), request, signal)) as { [member: string]: unknown };
    }

    async adjoint(scene: string, request: object, signal?: AbortSignal): Promise<{ [member: string]: unknown }> {
        return (await this.post(Api.path(scene, "/adjoint"), request, signal)) as { [member: string]: unknown };
    }

    /** Makes a variant of reflectances, or removes it (groups null); its name is NAME@variant. The path of one that is
     * made answers 202 until it is served. */
    async vary(scene: string, variant: string,
        groups: { [name: string]: number | readonly number[] } | null): Promise<string | null>
    {
        const path = Api.path(scene, "/reflectance"), isMade = groups !== null;
        const reply = await this.daemon.post(path, isMade ? { variant, groups } : { variant },
            isMade ? { method: "PUT", accepted: [202] } : { method: "DELETE", accepted: [204] });
        const location = reply.header("Location");
        return location === null ? null : new URL(location, new URL(path, document.baseURI)).href;
    }
}

const signalled = (signal: AbortSignal | undefined): Request => (signal === undefined ? {} : { signal });

/** The daemon answered that it does not do what it was asked for. */
export function isProblem(reason: unknown): reason is LambertError & { status: number } {
    return reason instanceof LambertError && reason.status !== null;
}

/** The daemon did not answer. */
export function isLost(reason: unknown): boolean {
    return reason instanceof LambertError && reason.kind === "disconnected";
}

/** What went wrong, without the request that it was about. */
export function wordsOf(reason: unknown): string {
    return reason instanceof LambertError ? reason.detail : reason instanceof Error ? reason.message : String(reason);
}
