// What the parts of the page know of each other: each is given a Page, and takes of it what it needs. Only app.ts knows
// who does it.
import type { SceneLine } from "lambert-light";
import type { Observable } from "../base/events.ts";
import type { Api, Description } from "../daemon/api.ts";
import type { SceneSky } from "../daylight/scene_sky.ts";
import type { Cameras } from "../picture/cameras.ts";
import type { Field } from "../picture/field.ts";
import type { SceneMesh } from "../picture/glb.ts";
import type { Openings } from "../picture/openings.ts";
import type { Picker } from "../picture/pick.ts";
import type { SensorMarks } from "../picture/sensor_marks.ts";
import type { Stage } from "../picture/stage.ts";
import type { SceneLuminaires } from "../state/luminaires.ts";
import type { SceneSensors } from "../state/sensors.ts";
import type { Wanted } from "../state/request.ts";
import type { Lighting, State } from "../state/state.ts";
import type { Store } from "../state/store.ts";
import type { Exposure } from "./exposure.ts";

export interface Page {
    /** The state, all of which a link restores. */
    readonly store: Store;
    readonly scene: Scene;
    readonly ask: Ask;
    readonly tell: Tell;
}

/** The scene that is open, and what it is compared with. */
export type Side = 0 | 1;

export interface OpenScene {
    readonly description: Description;
    readonly mesh: SceneMesh;
    readonly picker: Picker;
    /** Of its luminaires; null: the store has none. */
    readonly openings: Openings | null;
    readonly luminaires: SceneLuminaires | null;
    /** The same of its sensors. */
    readonly sensors: SceneSensors | null;
    readonly marks: SensorMarks | null;
    /** Lighting that the scene comes with. */
    readonly defaultLighting: Lighting;
}

export interface Timing {
    /** From the request to the picture's textures, and in the daemon, ms. */
    roundTrip: number;
    solve: number | null;
}

/** A bound on the error of every number shown, and what it took, ms. */
export interface Certificate {
    bound: number;
    iterations: number;
    solve: number | null;
}

/** The light at sensors, in the unit of irradiance: a value for each place, NaN where it has none. */
export interface Sensed {
    /** Null: none are known. */
    values: Float32Array | null;
    /** The line of the daemon that says why there are none; null: it has not refused them. */
    refused: string | null;
}

export type SceneEvents = {
    /** Another scene is open. */
    scene: [];
    /** Scenes came or went. */
    scenes: [];
    /** An answer is shown. */
    field: [];
    timing: [Timing];
    hover: [];
    /** Values of sensors came, or are known no more. */
    sensed: [];
    /** A luminaire was picked in the picture. */
    picked: [string];
    /** The page around the picture became dark or light. */
    theme: [];
    /** The name of the scene that is on its way; null: none is any more. */
    loading: [string | null];
};

/** What is loaded of the scene, and the picture of it. */
export interface Scene extends Observable<SceneEvents> {
    /** The scene that is open; null: none is yet. */
    readonly now: OpenScene | null;
    /** Those that the daemon serves. */
    readonly all: readonly SceneLine[];
    /** What is shown of each side. */
    readonly fields: readonly [Field | null, Field | null];
    /** Where the daemon has certified what is shown. */
    readonly certificate: Certificate | null;
    readonly sensed: Sensed;
    /** The element under the pointer. */
    readonly hovered: number | null;
    /** The picture has the sun drawn sharp, or will have. */
    readonly isSunSharp: boolean;
    readonly sky: SceneSky;
    readonly stage: Stage;
    readonly cameras: Cameras;
    readonly exposure: Exposure;
    hover(element: number | null): void;
    pick(luminaire: string): void;
    /** Shows refined values in place of those of the same request. */
    certify(field: Field, certificate: Certificate): void;
    setBackground(colour: string): void;
}

/** Asks the daemon. */
export interface Ask {
    /** For answers that are a panel's alone. */
    readonly api: Api;
    /** Nothing that the picture shows is on its way. */
    readonly isIdle: boolean;
    /** What is shown now, as a request; null: there is no scene, nothing to compare it with, or no knowledge of that
     * yet. */
    wanted(side?: Side): Wanted | null;
    /** Asks for what is to be shown, if that has changed, or `again`. */
    shown(again?: boolean): void;
    /** The values of sensors are looked at, or no more: those that are drawn are asked for anyway. */
    sense(isSeen: boolean): void;
    /** Opens a scene; the rest of the state is given (a link), or that of the scene as it comes. */
    open(name: string, given: State | null): Promise<void>;
    /** Asks which scenes there are. */
    scenes(): Promise<void>;
    /** Finds out if a scene can be compared with the open one; it is told why not. */
    admit(name: string): Promise<boolean>;
}

export type News = {
    /** The daemon does not answer or is busy: why, as a sentence. */
    lost: [string];
    found: [];
    /** What the daemon did not do, as a sentence. */
    problem: [string];
    token: [];
    /** Why a scene cannot be compared with the open one, as a sentence. */
    incomparable: [string];
};

/** Tells the person how it goes. */
export interface Tell extends Observable<News> {
    /** The daemon does not answer or is busy. */
    readonly isLost: boolean;
    /** What a link asks for and this daemon does not have; until another scene is opened. */
    notice: string | null;
    /** Does what helps after something failed, and tells of it. */
    fail(reason: unknown): void;
}
