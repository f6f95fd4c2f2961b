// Ties the state, the daemon and the picture together. Panels listen to it and change the state; they hold none.
import { Box3, BufferAttribute } from "three";
import { Api, Lost, Problem, type Description, type SceneLine } from "./daemon/api.ts";
import { Watch } from "./daemon/watch.ts";
import { Newest } from "./daemon/newest.ts";
import { Cameras } from "./picture/cameras.ts";
import { Field, spreadOf, type Spread } from "./picture/field.ts";
import { readMesh, type SceneMesh } from "./picture/glb.ts";
import { Picker } from "./picture/pick.ts";
import type { Axis } from "./picture/scale.ts";
import { Stage } from "./picture/stage.ts";
import { SharpSun, type SunParts } from "./sharp_sun.ts";
import { Beside } from "./state/beside.ts";
import { lightingOf } from "./state/own_lighting.ts";
import { wantedFor, type Abilities, type Wanted } from "./state/request.ts";
import { firstState, type Lighting, type Moment, type SkyLight, type State } from "./state/state.ts";
import { Store } from "./state/store.ts";

export interface OpenScene {
    description: Description;
    mesh: SceneMesh;
    picker: Picker;
    /** Lighting that the scene comes with. */
    ownLighting: Lighting;
}

export interface Timing {
    /** From the request to the picture's textures, and in the daemon, ms. */
    roundTrip: number;
    solve: number | null;
}

type Event = "scene" | "scenes" | "field" | "pick" | "hover" | "timing" | "unlike" | "lost" | "found" | "problem" | "token" | "theme" | "loading";
type Side = 0 | 1;

/** The store was replaced by one of another mesh. */
class Replaced extends Error {}

/** Statuses of requests that fitted the store that was there before. */
const UNFIT = [400, 404, 422];

/** After the last answer, and after the last look, the page looks if the store is still the same, ms. */
const LOOK_MS = 1000, LOOKED_MS = 5000;

/** The mean of the logarithm of what is seen becomes this before the tone curve. */
const MIDDLE_GREY = 0.2;

export class App {
    readonly api = new Api();
    readonly store = new Store(firstState);
    readonly stage: Stage;
    readonly cameras: Cameras;
    scenes: SceneLine[] = [];
    scene: OpenScene | null = null;
    fields: [Field | null, Field | null] = [null, null];
    spread: Spread = { low: 0, high: 1, most: 1, logMean: 0 };
    timing: Timing = { roundTrip: 0, solve: null };
    /** The bound on the error of every number shown, where the daemon has certified one. */
    certificate: { bound: number; iterations: number; solve: number | null } | null = null;
    hovered: number | null = null;
    problem: string | null = null;
    /** The scene that is on its way, until its first picture; "" while it has no name yet, null: none is. */
    loading: string | null = "";
    /** A scene that was chosen while the daemon was away. */
    private missed: string | null = null;
    private looked = -LOOKED_MS;
    private lookTimer = 0;
    /** What a link asks for and this daemon does not have; until another scene is opened. */
    notice: string | null = null;
    readonly watch = new Watch(() => this.api.isReady(), () => this.tell("lost"), () => this.goOn());
    /** Answers shown so far. */
    answers = 0;
    /** The exposure that the page chose last, log2. */
    ownExposure = 0;
    /** Radiances of the sky's tiles for a lighting; set by the panel of skies. */
    skyOf: (lighting: Lighting, of: Description) => readonly (number | number[])[] | null = () => null;
    /** The sky and its sun apart, of the scene that is open; set by the panel of skies. Null: no sun shines. */
    sunOf: (lighting: Lighting, of: Description) => SunParts | null = () => null;
    /** The sun in the picture, where it is drawn sharp. */
    readonly sharp = new SharpSun(this, async (wanted) => (await this.solve(wanted))[0]);
    /** The weather that a link has to hold for a light; set by the panel of skies. */
    momentOf: (light: SkyLight) => Moment | null = () => null;
    /** Fetches what the first picture of a scene needs beside its mesh; the function that it returns takes that in. */
    prepare: (description: Description) => Promise<(scene: OpenScene) => void> = () => Promise.resolve(() => undefined);
    /** Fetches what the lighting of another scene needs, before it is compared. */
    prepareOther: (description: Description) => Promise<void> = () => Promise.resolve();
    /** Why the last scene that was to be compared is not. */
    unlike: string | null = null;
    private readonly beside = new Beside((name) => this.api.describe(name), (description) => this.prepareOther(description));
    private readonly listeners = new Map<Event, Set<() => void>>();
    private readonly askers: [Newest<Wanted, [Field, number | null]>, Newest<Wanted, [Field, number | null]>];
    private asked = ["", ""];
    private opening = 0;

    constructor(canvas: HTMLCanvasElement) {
        this.cameras = new Cameras(canvas, () => this.stage.invalidate(), () => this.keepCamera());
        this.stage = new Stage(canvas, this.cameras.camera, (seconds) => this.cameras.advance(seconds));
        const asker = (side: Side): Newest<Wanted, [Field, number | null]> => new Newest(
            (wanted) => this.solve(wanted), (answer, wanted) => this.take(side, answer, wanted), (reason) => this.fail(reason));
        this.askers = [asker(0), asker(1)];
        this.store.listen((now, before) => this.changed(now, before));
        document.addEventListener("visibilitychange", () => { if (!document.hidden) this.look(0); });
    }

    on(event: Event, listener: () => void): void {
        if (!this.listeners.has(event)) this.listeners.set(event, new Set());
        this.listeners.get(event)?.add(listener);
    }

    tell(event: Event): void {
        for (const listener of this.listeners.get(event) ?? []) listener();
    }

    /** Opens a scene; the rest of the state is given (a link), or that of the scene as it comes. */
    async open(name: string, given: State | null): Promise<void> {
        const turn = ++this.opening;
        this.load(name);
        const described = this.api.describe(name);
        const [description, file, takeIn] = await Promise.all([described, this.api.mesh(name), described.then((d) => this.prepare(d))]);
        if (turn !== this.opening) return;
        const mesh = readMesh(file);
        this.stage.show(mesh, description.channels);
        const picker = new Picker(this.stage.geometry as never, this.stage.drawn ?? mesh);
        const scene = { description, mesh, picker, ownLighting: lightingOf(mesh, description) };
        this.cameras.floorAt = (x, z) => picker.floorAt(x, z);
        takeIn(scene);
        this.scene = scene;
        this.beside.reset(description);
        const { ownLighting } = scene;
        this.cameras.setBounds(new Box3().setFromBufferAttribute(new BufferAttribute(mesh.positions, 3)));
        this.fields = [null, null];
        this.askers.forEach((asker) => asker.forget());
        this.sharp.forget();
        this.asked = ["", ""];
        const base = given ?? { ...firstState, view: { ...this.store.now.view, camera: null, exposure: null, range: null } };
        const lighting = { ...base.lighting, groups: { ...ownLighting.groups, ...base.lighting.groups } };
        if (base.lighting === firstState.lighting) Object.assign(lighting, ownLighting);
        this.store.restart({ ...base, scene: name, lighting, pins: base.pins.filter((pin) => pin < mesh.elements) });
        this.judge(this.store.now);
        document.title = `${name} · Lambert`;
        this.stage.resize();
        if (base.view.camera === null) {
            // From outside, and in from there.
            this.cameras.setWalk(false);
            this.cameras.fit(false);
        }
        this.cameras.setWalk(base.view.walk);
        if (base.view.camera !== null) this.cameras.place(base.view.camera, false);
        this.tell("scene");
        this.ask();
    }

    private load(name: string | null): void {
        if (this.loading === name) return;
        this.loading = name;
        this.tell("loading");
    }

    /** What is shown now, as a request. */
    wanted(side: Side = 0): Wanted | null {
        const { scene, store: { now } } = this;
        if (scene === null || (side === 1 && now.compare === null)) return null;
        const quantity = now.view.picture === "light" ? "radiosity" : now.view.quantity;
        const lighting = (side === 1 ? now.compare?.lighting : null) ?? now.lighting;
        const other = side === 1 ? now.compare?.scene ?? null : null, of = other === null ? scene.description : this.beside.get(other);
        return of === undefined ? null : wantedFor(of.name, quantity, lighting, this.abilities(of, lighting));
    }

    private abilities(of: Description, lighting: Lighting): Abilities {
        return {
            channels: of.channels, groups: of.groups.map((group) => group.name), emitters: of.emitters?.length ?? 0, sky: this.skyOf(lighting, of),
        };
    }

    /** Finds out if a scene can be compared with the open one; `unlike` says why not. */
    async admit(name: string): Promise<boolean> {
        this.unlike = await this.beside.admit(name);
        if (this.unlike !== null) this.tell("unlike");
        return this.unlike === null;
    }

    /** Takes in the scene of a comparison that came with a link or by undoing; ends one that cannot be. */
    private async takeOther(name: string): Promise<void> {
        if (await this.admit(name)) this.ask();
        else if (this.store.now.compare?.scene === name) this.store.settle({ ...this.store.now, compare: null });
    }

    /** Asks for what is to be shown, if that has changed. */
    ask(again = false): void {
        for (const side of [0, 1] as const) {
            const wanted = this.wanted(side);
            const key = wanted === null ? "" : JSON.stringify(wanted);
            if (wanted === null || (key === this.asked[side] && !again)) continue;
            this.asked[side] = key;
            this.askers[side].want(wanted);
        }
        this.sharp.ask(again);
    }

    /** Shows refined values in place of those of the same request. */
    certify(field: Field, certificate: NonNullable<App["certificate"]>): void {
        this.certificate = certificate;
        this.fields[0] = field;
        if (!this.sharp.isOn) this.stage.setField(0, field);
        this.tell("field");
    }

    /** Asks which scenes there are, after variants came or went. */
    async listScenes(): Promise<void> {
        this.scenes = await this.api.scenes();
        this.tell("scenes");
    }

    get isIdle(): boolean {
        return this.askers.every((asker) => asker.isIdle) && this.sharp.isIdle;
    }

    hover(element: number | null): void {
        if (element === this.hovered) return;
        this.hovered = element;
        this.stage.mark(element ?? -1, this.store.now.pins);
        this.tell("hover");
    }

    fail(reason: unknown): void {
        if (reason instanceof DOMException && reason.name === "AbortError") return;
        const { loading } = this;
        this.load(null);
        if (reason instanceof Lost) {
            if (loading !== null && loading !== "" && this.scene !== null) this.missed = loading;
            this.watch.lose("The daemon does not answer. This page asks again each second and goes on by itself.");
            return;
        }
        if (reason instanceof Problem && reason.status === 401) {
            this.tell("token");
            return;
        }
        if (reason instanceof Problem && reason.status === 503) {
            this.watch.lose(`The daemon is busy: ${reason.message}. This page goes on by itself.`);
            return;
        }
        if (reason instanceof Replaced || (reason instanceof Problem && UNFIT.includes(reason.status) && loading === null)) {
            this.renew().then((is) => { if (!is) this.complain(reason); }, (why: unknown) => this.complain(why));
            return;
        }
        this.complain(reason, loading === null);
    }

    /** `isShown`: the request was for the scene that is shown. */
    private complain(reason: unknown, isShown = true): void {
        if (reason instanceof Lost) return this.fail(reason);
        const name = this.scene?.description.name ?? "";
        if (reason instanceof Problem && reason.status === 404 && isShown && name !== "") {
            this.problem = `The daemon serves ${name} no more; the picture is its last. Choose another scene above.`;
            void this.listScenes().catch(() => undefined);
            return this.tell("problem");
        }
        this.problem = reason instanceof Problem ? `The daemon did not do what this page asked for (${reason.status}): ${reason.message}`
            : reason instanceof Error ? reason.message : String(reason);
        this.tell("problem");
        this.tell("scenes");
    }

    /** Opens the scene anew if its store is another one by now: as it comes, or in its present state where the mesh is the same. */
    private async renew(): Promise<boolean> {
        const { scene } = this, name = scene?.description.name ?? "";
        if (scene === null) return false;
        const description = await this.api.describe(name), same = (of: Description): string => JSON.stringify([of.provenance?.geometry_hash, of.groups, of.channels]);
        if (scene !== this.scene) return true;
        if (JSON.stringify(description) === JSON.stringify(scene.description)) return false;
        this.notice = `The store of ${name} was replaced; this is the new one.`;
        const { now } = this.store, exposure = now.view.exposure === this.ownExposure ? null : now.view.exposure;
        await this.open(name, same(description) === same(scene.description) ? { ...now, view: { ...now.view, exposure } } : null);
        return true;
    }

    /** Looks, once nothing is asked for, if the store is still the one that is shown: its answers alone do not tell. */
    private look(after: number): void {
        clearTimeout(this.lookTimer);
        this.lookTimer = window.setTimeout(() => {
            if (this.scene === null || this.loading !== null || this.watch.isLost || !this.isIdle || document.hidden) return;
            this.looked = performance.now();
            this.renew().catch((reason: unknown) => { if (this.loading === null) this.complain(reason); else this.fail(reason); });
        }, Math.max(after, this.looked + LOOKED_MS - performance.now()));
    }

    private async solve(wanted: Wanted): Promise<[Field, number | null]> {
        const { scene } = this;
        if (scene === null) throw new Error("no scene is open");
        if (wanted.emission === null) {
            const { channels } = scene.description;
            return [new Field(new Uint16Array(channels * scene.mesh.elements), [channels, scene.mesh.elements], 1), null];
        }
        const start = performance.now();
        const { values, solveMs } = await this.api.radiosity(wanted.scene,
            { emission: wanted.emission, quantity: wanted.quantity });
        this.timing = { roundTrip: performance.now() - start, solve: solveMs };
        const field = Field.of(values, wanted.scale);
        if (field.elements !== scene.mesh.elements)
            throw new Replaced(`${wanted.scene} has ${field.elements} elements, the mesh shown has ${scene.mesh.elements}`);
        return [field, solveMs];
    }

    private take(side: Side, [field]: [Field, number | null], wanted: Wanted): void {
        this.watch.find();
        this.problem = null;
        if (side === 0) this.certificate = null;
        this.fields[side] = field;
        this.answers += 1;
        if (side === 1 || !this.sharp.isOn) this.stage.setField(side, field);
        if (side === 0) this.measure(wanted);
        this.setLook();
        this.load(null);
        this.tell("field");
        this.tell("timing");
        this.look(LOOK_MS);
    }

    /** Finds the ends of the palette and the exposure, where the person left them to the page. */
    private measure(wanted: Wanted): void {
        const { scene, fields: [field], store: { now } } = this;
        if (scene === null || field === null) return;
        const mustMeasure = now.view.picture === "false" ? now.view.range === null : now.view.exposure === null || now.view.follow;
        if (!mustMeasure || wanted.emission === null) return;
        const lit = now.lighting.groups;
        const isDark = scene.mesh.groups.map((group) => !(lit[group.name]?.on && lit[group.name].power > 0));
        const dark = isDark.some((d) => d) ? (i: number): boolean => isDark[scene.mesh.groupOf[i]] : (): boolean => true;
        this.spread = spreadOf(field.values, scene.mesh.area, dark);
        if (now.view.picture === "light" && this.spread.most > 0) {
            const exposure = Number((Math.log2(MIDDLE_GREY) - this.spread.logMean).toFixed(2));
            this.ownExposure = exposure;
            this.store.settle({ ...now, view: { ...now.view, exposure } });
        }
    }

    /** The ends of the palette, as the person or the values set them. */
    get axis(): Axis {
        const { view } = this.store.now, { low, high } = this.spread;
        const [from, to] = view.range ?? [view.log ? Math.max(low, high / 1e4) : 0, high];
        return { low: from, high: Math.max(to, from + 1e-12), log: view.log && from > 0 };
    }

    /** Hands all that shapes the picture, but the values, to the stage. */
    setLook(): void {
        const { view, compare } = this.store.now;
        const { low, high } = this.axis;
        this.stage.setLook({
            picture: view.picture, smooth: view.smooth, textured: view.textured, tone: view.tone, exposure: 2 ** (view.exposure ?? this.ownExposure), palette: view.palette,
            range: [low, high], log: view.log, isoLines: view.isoLines, threshold: view.threshold, marked: view.judged !== null,
            compare: compare === null || this.fields[1] === null ? "none" : compare.how, split: compare?.split ?? 0.5,
        });
    }

    private changed(now: State, before: State): void {
        if (now.view.walk !== before.view.walk) this.cameras.setWalk(now.view.walk);
        if (now.pins !== before.pins) this.stage.mark(this.hovered ?? -1, now.pins);
        if (now.view.judged !== before.view.judged || now.scene !== before.scene) this.judge(now);
        if (now.compare === null && before.compare !== null) {
            this.fields[1] = null;
            this.asked[1] = "";
            this.askers[1].forget();
        }
        if (now.view !== before.view || now.compare !== before.compare) this.setLook();
        const other = now.compare?.scene ?? null;
        if (this.beside.isNew(other) && other !== null) this.takeOther(other).catch((reason: unknown) => this.fail(reason));
        this.ask();
    }

    private judge(now: State): void {
        const { scene } = this;
        if (scene === null) return;
        const group = scene.mesh.groups.findIndex((g) => g.name === now.view.judged);
        this.stage.judge((element) => group < 0 || scene.mesh.groupOf[element] === group);
    }

    private keepCamera(): void {
        const { store: { now } } = this;
        if (this.scene === null) return;
        const camera = this.cameras.now;
        if (JSON.stringify(camera) !== JSON.stringify(now.view.camera))
            this.store.settle({ ...now, view: { ...now.view, camera } });
    }

    /** After the daemon was away. */
    private goOn(): void {
        this.tell("found");
        if (this.scene === null) return;
        const { missed } = this;
        this.missed = null;
        void this.listScenes().catch(() => undefined);
        if (missed !== null) void this.open(missed, null).catch((reason: unknown) => this.fail(reason));
        else this.renew().then((is) => { if (!is) this.ask(true); }, (reason: unknown) => this.complain(reason));
    }
}
