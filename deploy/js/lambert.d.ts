// Types of lambert.js. Those of what the daemon sends and takes stand in openapi.d.ts, which is made from its
// description.
import type { JacobianAnswer, JacobianRequest, Luminaires, PerChannel, Quantity, RadiosityAnswer, RadiosityRequest,
    Refused, Scene as About, SceneLine, Select, Sensors, SkiesAnswer, SkiesRequest, Sky, Statistic, SunAnswer,
    SunRequest, Weather, WeatherRequest } from "./openapi.js";

export type * as Api from "./openapi.js";
export type { About, Luminaires, Quantity, SceneLine, Sensors, Sky, Weather };

type Named<T> = { [name: string]: T };
export type Numbers = Float32Array | Float64Array;
/** Numbers in one row, with their shape. An Answer is one. */
export interface Shaped {
    values: Numbers;
    shape: number[];
}

/** An emission as requests have it (api.md), whose lists may be typed arrays. */
export interface EmissionObject {
    elements?: ArrayLike<number>;
    values?: ArrayLike<number> | number[][];
    groups?: Named<PerChannel | string>;
    sky?: ArrayLike<number> | number[][];
    sun?: { azimuth: number; altitude: number; direct: PerChannel; north?: number };
    luminaires?: Named<PerChannel>;
    emitters?: ArrayLike<number> | number[][] | Named<PerChannel>;
}

/** Exitances of all elements: [n], alike in all channels, or [C, n], as a typed array of n or C n numbers in one
 * row, as lists, or as an array with its shape. Groups by name: { lamp: 17 }, { lamp: [17, 12, 4] }, { lamp:
 * "3600lm" }. Or an object as requests have it: { luminaires: { row: 0.4 } }, { sky: [...], groups: { ... } }. */
export type Emission = Numbers | Shaped | number[] | number[][] | Named<PerChannel | string> | EmissionObject;
/** A batch: a list with an array or an object in it, or an array of one more axis; its answer has one axis more. */
export type Emissions = Emission | (Numbers | Shaped | Named<PerChannel | string> | EmissionObject)[];
/** An emission of either sign; means and sums of groups; weights of sets of sensors. */
export type Cotangent = Emission | { groups: Named<PerChannel | { mean: PerChannel } | { sum: PerChannel }> } | {
    sensors: Named<PerChannel | Numbers | { values: ArrayLike<number> }>;
};
export type Cotangents = Cotangent | Exclude<Cotangent, number[] | number[][]>[];

/** Of one question. */
export interface Asking {
    /** It ends the question: the promise is rejected with its reason. */
    signal?: AbortSignal | undefined;
    /** Seconds for all attempts; null: no limit. */
    timeout?: number | null | undefined;
}

interface LightOptions extends Asking {
    tolerance?: number | undefined;
    /** That of the answer. */
    unit?: "lx" | "klx" | "fc" | "W/m2" | undefined;
    /** The radiances of a sky are in cd/m². */
    photometric?: boolean | undefined;
    /** False: the linear map, whose light may be below zero. */
    limit?: boolean | undefined;
    quantity?: Quantity | undefined;
    /** The name of a variant, which is asked in place of the scene. */
    variant?: string | undefined;
}

export interface RadiosityOptions extends LightOptions {
    at?: "elements" | "faces" | "corners" | undefined;
    /** Some of them: elements, groups, faces, sensors or probes; a single name needs no list. */
    select?: {
        [of in "elements" | "groups" | "faces" | "sensors" | "probes"]?: string | number | ArrayLike<string>
            | ArrayLike<number>;
    } | undefined;
    /** Precision of the answer: f4 unless it is refined; f2 takes half of the bytes. */
    format?: "f2" | "f4" | "f8" | undefined;
    /** The answer has the stated `error`, by JSON: true where `select` is given without a `format`. */
    stated?: boolean | undefined;
}

export interface ReduceOptions extends LightOptions {
    /** Of groups or of sensors. */
    groups?: string | string[] | undefined;
    sensors?: string | string[] | undefined;
    figures?: Statistic | Statistic[] | undefined;
    /** Adds the figure `share`: the part of the area, or of the sensors, that has so much. */
    atLeast?: number | number[] | undefined;
}

export type GradientName = "emission" | "reflectance" | "sky" | "luminaires" | "groups" | "emitters";
export interface AdjointOptions<G> extends Asking {
    gradient?: G | undefined;
    quantity?: Quantity | undefined;
    /** That of the light, which the gradient by reflectances needs. */
    emission?: Emission | undefined;
    format?: "f2" | "f4" | "f8" | undefined;
    variant?: string | undefined;
}

/** Said of an answer: unit, the stated error where it was asked for, elements below zero, factors of units, and
 * milliseconds by part. Of a refined answer the `certificate` bounds the error of each value. */
export interface Facts {
    unit: string | null;
    error: NonNullable<RadiosityAnswer["error"]> | null;
    limited: number | number[] | null;
    convertedBy: string | null;
    times: { parse?: number; solve?: number; encode?: number };
}

export class Answer implements Shaped, Facts {
    constructor(array: { data: Uint16Array | Numbers; shape: number[] }, facts?: Partial<Facts>);
    /** [n] or [C, n], one level deeper of a batch. */
    readonly shape: number[];
    /** The numbers in one row; NaN: a face without an element, a sensor without a value. */
    get values(): Numbers;
    /** The same as they came: of the format f2 the bits of halves. */
    readonly data: Uint16Array | Numbers;
    readonly unit: string | null;
    readonly error: Facts["error"];
    readonly limited: number | number[] | null;
    readonly convertedBy: string | null;
    readonly certificate: number | number[] | null;
    readonly iterations: number | number[] | null;
    readonly times: Facts["times"];
    /** The last axis in pieces: a channel each, of a batch one vector after the other. They share the memory. */
    rows(): Numbers[];
}

export interface Figures extends Facts {
    /** By name of group or set of sensors, then by figure: a number, or one for each channel, or a list of these for
     * a batch. */
    figures: Named<Named<any>>;
}

export interface Jacobian {
    /** [rows, columns], or [C, rows, columns], by what they derive by. */
    matrices: { [by in NonNullable<JacobianRequest["by"]>[number]]?: Answer };
    columns: JacobianAnswer["columns"];
    /** Those of each name of `of`. */
    rows: Named<{ first: number; count: number }>;
}

export interface Elements {
    /** [n], m². */
    area: Float64Array;
    /** [n, 3]. */
    normal: Float32Array;
    /** [n, 3], m. */
    centre: Float32Array;
    /** [n], numbers in the order of `names`. */
    group: Uint32Array;
    /** [n], of the scene file; -1: none, or several. */
    face: Int32Array;
    /** [C, n]. */
    reflectance: Float32Array;
}

/** Metres, y up, front faces counter-clockwise, as three.js has them. */
export interface Corners {
    count: number;
    /** [count, 3]. */
    positions: Float32Array;
    normals: Float32Array;
    /** [count], the first element that has the corner. */
    element: Uint32Array;
    /** Three corners for each triangle. */
    index: Uint32Array;
}

export interface Group {
    name: string;
    /** m², without buried elements, as the means by it. */
    area: number;
    elements: number;
    /** Those of them that figures leave out. */
    buried: number;
    /** For each channel; null where it has no area. */
    reflectance: (number | null)[];
    emission: (number | null)[];
    indices: Uint32Array;
}

export type SkyMade = SkiesAnswer["skies"][number];
export type SkyWanted = SkiesRequest extends { skies?: (infer S)[] } ? S : never;

export class Scene {
    private constructor();
    readonly daemon: Daemon;
    readonly name: string;
    /** Seconds between two looks whether it is still the scene that was opened: 0 after each answer of elements, -1
     * never. */
    check: number;
    /** All that GET …/NAME says. */
    readonly about: About;
    get n(): number;
    get channels(): number;
    /** That of a vector in answers: [n] of one channel, [C, n] of more. */
    get shape(): number[];
    /** "W", so that light is in W/m², or "lm". */
    get units(): "W" | "lm";
    /** Of its groups. */
    get names(): string[];
    /** Relative to the daemon's address. */
    path(what?: string, variant?: string): string;
    /** Reads `about` again. Rejects by "scene-changed" where its geometry is another one now. */
    describe(options?: Asking): Promise<void>;
    elements<F extends keyof Elements = keyof Elements>(fields?: F | readonly F[],
        options?: Asking): Promise<Pick<Elements, F>>;
    groups(options?: Asking): Promise<Map<string, Group>>;
    luminaires(options?: Asking): Promise<Map<string, Luminaires["luminaires"][number]>>;
    sensors(options?: Asking): Promise<Map<string, Sensors["sets"][number]>>;
    sky(options?: Asking): Promise<Sky | null>;
    /** Its elements as a GLB file (api.md). */
    mesh(options?: Asking): Promise<ArrayBuffer>;
    /** The mesh of an answer `at: "corners"`: vertex v has value v. */
    corners(options?: Asking): Promise<Corners>;
    /** B = E + rho H of all surfaces, with all bounces. */
    radiosity(emission: Emissions, options?: RadiosityOptions): Promise<Answer>;
    irradiance(emission: Emissions, options?: Omit<RadiosityOptions, "quantity">): Promise<Answer>;
    indirect(emission: Emissions, options?: Omit<RadiosityOptions, "quantity">): Promise<Answer>;
    /** Figures of groups or of sets of sensors; the quantity is irradiance, unless it is given. */
    reduce(emission: Emissions, options: ReduceOptions): Promise<Figures>;
    /** Gradients of J = sum g q by what `gradient` names. */
    adjoint(cotangent: Cotangents, options?: AdjointOptions<GradientName>): Promise<Answer>;
    adjoint<G extends GradientName>(cotangent: Cotangents,
        options: AdjointOptions<readonly G[]>): Promise<{ [name in G]: Answer }>;
    jacobian(
        of: { [of in "sensors" | "groups" | "elements"]?: string | number | ArrayLike<string> | ArrayLike<number> },
        options?: Asking & { by?: keyof Jacobian["matrices"] | (keyof Jacobian["matrices"])[]; quantity?: Quantity;
            variant?: string },
    ): Promise<Jacobian>;
    skies(sky: SkyWanted, options?: Asking): Promise<SkyMade>;
    skies(skies: SkyWanted[], options?: Asking): Promise<SkyMade[]>;
    weather(options?: Asking & { gaps?: "refuse" | "fill" | "skip" }): Promise<Weather>;
    /** The same scene under other reflectances, when it is built. */
    variant(name: string, reflectances: Named<PerChannel>, options?: Asking): Promise<Scene>;
    delete(options?: Asking): Promise<void>;
}

export interface DaemonOptions {
    token?: string | null | undefined;
    /** Seconds for a request with all its attempts, 60; null: no limit. The daemon is told, and stops, too. */
    timeout?: number | null | undefined;
    /** How often a daemon that answers 429 or 503 is asked again after its Retry-After, 4. */
    retries?: number | undefined;
}

export interface Request extends Asking {
    body?: Uint8Array<ArrayBuffer> | string;
    /** Content-Type. */
    type?: string;
    accept?: string;
    headers?: Named<string>;
    /** Statuses that are no errors; [200]. */
    accepted?: readonly number[];
}

export class Daemon {
    constructor(address: string | URL, options?: DaemonOptions);
    readonly address: string;
    token: string | null;
    timeout: number | null;
    retries: number;
    /** Requests that were sent. */
    readonly asked: number;
    ask(method: string, path: string | URL, request?: Request): Promise<Reply>;
    /** With a body of JSON, which may hold typed arrays. */
    post(path: string | URL, body: object, request?: Request & { method?: string }): Promise<Reply>;
    scenes(options?: Asking): Promise<SceneLine[]>;
    refused(options?: Asking): Promise<Refused>;
    scene(name?: string | null, options?: Asking & { check?: number | undefined }): Promise<Scene>;
    /** True where it is ready. */
    health(options?: Asking): Promise<boolean>;
    openapi(options?: Asking): Promise<object>;
    sun(place: SunRequest["place"], hours: readonly number[], options?: Asking & { year?: number }): Promise<SunAnswer>;
    weather(text: string, options?: Asking & { gaps?: WeatherRequest["gaps"] }): Promise<Weather>;
}

/** An answer of the daemon, whole. */
export class Reply {
    private constructor();
    readonly status: number;
    readonly headers: Headers;
    readonly body: ArrayBuffer;
    json(): any;
    npy(): Npy;
    get isNpy(): boolean;
    header(name: string): string | null;
    /** A header that is a number. */
    number(name: string): number | null;
    get times(): Facts["times"];
    error(route: string): LambertError;
}

/** Any error of this module. `kind` is a section of api.md, such as "bad-index", of an answer of the daemon; else
 * "refused", "wrong-length", "bad-value", "unknown-word" (before anything is sent), "disconnected", "timed-out",
 * "scene-changed", "building" or "not-npy". */
export class LambertError extends Error {
    constructor(detail: string, members?: Partial<Omit<LambertError, "detail" | keyof Error>> & { cause?: unknown });
    readonly detail: string;
    readonly status: number | null;
    readonly type: string | null;
    readonly title: string | null;
    readonly pointer: string | null;
    readonly kind: string | null;
    /** The request, such as "POST /v1/scenes/box/radiosity". */
    readonly route: string | null;
    /** Seconds. */
    readonly retryAfter: number | null;
}

/** Keeps `most` questions on their way and of those that wait only the newest; answers that come late are dropped. */
export class Newest<Wanted, Found> {
    constructor(ask: (wanted: Wanted) => Promise<Found>, show: (found: Found, wanted: Wanted) => void,
        fail: (reason: unknown) => void, most?: number);
    want(wanted: Wanted): void;
    /** Answers to what was asked before are not shown any more. */
    forget(): void;
    get isIdle(): boolean;
}

export interface Npy {
    shape: number[];
    /** Of <f2 the bits of halves. */
    data: Uint16Array<ArrayBuffer> | Float32Array<ArrayBuffer> | Float64Array<ArrayBuffer> | Uint32Array<ArrayBuffer>
        | Int32Array<ArrayBuffer>;
}

export function connect(address: string | URL, options?: DaemonOptions): Daemon;
export function open(address: string | URL,
    options?: DaemonOptions & { scene?: string | undefined; check?: number | undefined;
        signal?: AbortSignal | undefined }): Promise<Scene>;

export function readNpy(buffer: ArrayBuffer): Npy;
/** <f8 of doubles, else <f4; without a shape [length]. */
export function writeNpy(values: ArrayLike<number>, shape?: readonly number[]): Uint8Array<ArrayBuffer>;
export function halfToNumber(bits: number): number;
/** `count` values from `first` on, times `scale`. */
export function halvesToFloats(bits: Uint16Array, first?: number, count?: number,
    scale?: number): Float32Array<ArrayBuffer>;
/** The nearest half, ties to even; from 65,520 on infinity. */
export function numberToHalf(value: number): number;
export function floatsToHalves(values: ArrayLike<number>): Uint16Array<ArrayBuffer>;
