// Asks the daemon. Knows its routes and their JSON, and nothing of pictures.
import { readNpy, type Npy } from "../base/npy.ts";
import type { Gaps, Place, SkyMade, SkyRequest, SkyTiles, SunPositions, WeatherRows } from "./daylight.ts";

export interface SceneLine {
    name: string;
    elements: number;
    channels: number;
    kind: string;
    bytes: number;
}

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

/** An answer that is no success: what the problem document says. */
export class Problem extends Error {
    constructor(readonly status: number, detail: string, readonly retryAfter: number) {
        super(detail);
    }
}

/** The daemon did not answer. */
export class Lost extends Error {}

const TOKEN_KEY = "lambert-token";

export class Api {
    /** Requests so far, for the tests and the curious. */
    asked = 0;

    get token(): string | null {
        return sessionStorage.getItem(TOKEN_KEY);
    }

    set token(value: string | null) {
        if (value === null) sessionStorage.removeItem(TOKEN_KEY);
        else sessionStorage.setItem(TOKEN_KEY, value);
    }

    async ask(path: string, init: RequestInit = {}, accept = "application/json"): Promise<Response> {
        const headers = new Headers(init.headers);
        headers.set("Accept", accept);
        if (this.token !== null) headers.set("Authorization", `Bearer ${this.token}`);
        this.asked += 1;
        let response: Response;
        try {
            response = await fetch(path, { ...init, headers, credentials: "omit" });
        } catch (reason) {
            if (reason instanceof DOMException && reason.name === "AbortError") throw reason;
            throw new Lost("the daemon does not answer");
        }
        if (response.ok) return response;
        const text = await response.text();
        let detail = `${response.status} ${response.statusText}`;
        try {
            detail = (JSON.parse(text) as { detail?: string }).detail ?? detail;
        } catch {
            // A proxy may have answered in words of its own.
        }
        throw new Problem(response.status, detail, Number(response.headers.get("Retry-After") ?? 0));
    }

    private post(path: string, body: unknown, accept: string, signal?: AbortSignal): Promise<Response> {
        return this.ask(path, {
            method: "POST",
            body: JSON.stringify(body),
            headers: { "Content-Type": "application/json" },
            ...(signal === undefined ? {} : { signal }),
        }, accept);
    }

    /** Relative to the page, which may stand below any path of a proxy. */
    static path(scene: string, what = ""): string {
        return `v1/scenes/${encodeURIComponent(scene)}${what}`;
    }

    async isReady(): Promise<boolean> {
        try {
            return (await fetch("readyz", { cache: "no-store" })).ok;
        } catch {
            return false;
        }
    }

    async scenes(): Promise<SceneLine[]> {
        return ((await (await this.ask("v1/scenes")).json()) as { scenes: SceneLine[] }).scenes;
    }

    async describe(scene: string): Promise<Description> {
        const answer = await this.ask(Api.path(scene));
        if (answer.status === 202) throw new Problem(202, `${scene} is being built; open it again in a while.`, 1);
        return (await answer.json()) as Description;
    }

    async sky(scene: string): Promise<SkyTiles> {
        return (await (await this.ask(Api.path(scene, "/sky"))).json()) as SkyTiles;
    }

    /** In the order of their gradients. */
    async luminaires(scene: string): Promise<Luminaire[]> {
        return ((await (await this.ask(Api.path(scene, "/luminaires"))).json()) as { luminaires: Luminaire[] })
            .luminaires;
    }

    /** In the order of their values. */
    async sensors(scene: string): Promise<SensorSet[]> {
        return ((await (await this.ask(Api.path(scene, "/sensors"))).json()) as { sets: SensorSet[] }).sets;
    }

    /** Radiances of the tiles of a scene. */
    async makeSky(scene: string, sky: SkyRequest): Promise<SkyMade> {
        const answer = await this.post(Api.path(scene, "/skies"), { sky }, "application/json");
        return ((await answer.json()) as { skies: SkyMade[] }).skies[0];
    }

    /** At hours of a year of 365 days. */
    async sunPositions(place: Place, hours: readonly number[]): Promise<SunPositions> {
        return (await (await this.post("v1/sun", { place, hours }, "application/json")).json()) as SunPositions;
    }

    /** The rows of a weather file, of which the daemon keeps nothing. */
    async readWeather(text: string, gaps: Gaps): Promise<WeatherRows> {
        return (await (await this.post("v1/weather", { text, gaps }, "application/json")).json()) as WeatherRows;
    }

    /** Those of the weather file beside the store. */
    async weatherBeside(scene: string, gaps: Gaps): Promise<WeatherRows> {
        return (await (await this.post(Api.path(scene, "/weather"), { gaps }, "application/json"))
            .json()) as WeatherRows;
    }

    async mesh(scene: string): Promise<ArrayBuffer> {
        return (await this.ask(Api.path(scene, "/mesh"), {}, "model/gltf-binary")).arrayBuffer();
    }

    /** [C][n] values, or [n] of one channel, in half precision; `request` has the emission and the quantity. */
    async radiosity(scene: string, request: object,
        signal?: AbortSignal): Promise<{ values: Npy; solveMs: number | null }>
    {
        const response = await this.post(Api.path(scene, "/radiosity"), request, "application/x-npy; dtype=f2", signal);
        return { values: readNpy(await response.arrayBuffer()), solveMs: Api.solveMs(response) };
    }

    /** The same in single precision, as an NPY file. A request with a tolerance has a certificate. */
    async floats(scene: string, request: object, signal?: AbortSignal): Promise<Floats> {
        const response = await this.post(Api.path(scene, "/radiosity"), request, "application/x-npy; dtype=f4", signal);
        const number = (
            name: string,
        ): number | null => (response.headers.has(name) ? Number(response.headers.get(name)) : null);
        return {
            file: await response.arrayBuffer(),
            certificate: number("Lambert-Certificate"),
            iterations: number("Lambert-Iterations"),
            solveMs: Api.solveMs(response),
        };
    }

    private static solveMs(response: Response): number | null {
        const solve = /solve;dur=([\d.]+)/.exec(response.headers.get("Server-Timing") ?? "");
        return solve === null ? null : Number(solve[1]);
    }

    /** The same as JSON, with its error, for selected elements, reductions and refinements. */
    async answer(scene: string, request: object, signal?: AbortSignal): Promise<{ [member: string]: unknown }> {
        return (await (await this.post(Api.path(scene, "/radiosity"), request, "application/json", signal)).json()) as {
            [member: string]: unknown;
        };
    }

    async adjoint(scene: string, request: object, signal?: AbortSignal): Promise<{ [member: string]: unknown }> {
        return (await (await this.post(Api.path(scene, "/adjoint"), request, "application/json", signal)).json()) as {
            [member: string]: unknown;
        };
    }

    /** Makes a variant of reflectances, or removes it (groups null); its name is NAME@variant. The path of one that is
     * made answers 202 until it is served. */
    async vary(scene: string, variant: string,
        groups: { [name: string]: number | readonly number[] } | null): Promise<string | null>
    {
        const response = await this.ask(Api.path(scene, "/reflectance"), {
            method: groups === null ? "DELETE" : "PUT",
            headers: { "Content-Type": "application/json" },
            body: JSON.stringify(groups === null ? { variant } : { variant, groups }),
        });
        const location = response.headers.get("Location");
        return location === null ? null : new URL(location, response.url).href;
    }
}
