// Ties the state, the daemon and the picture together. Panels listen to it and change the state; they hold none.
import { Events } from "../base/events.ts";
import { Api, type Description, type SceneLine } from "../daemon/api.ts";
import type { SunParts } from "../daylight/source.ts";
import { Cameras } from "../picture/cameras.ts";
import type { Field } from "../picture/field.ts";
import { Stage } from "../picture/stage.ts";
import { Comparable } from "../state/comparable.ts";
import type { Wanted } from "../state/request.ts";
import { firstState, type Lighting, type Moment, type SkyLight, type State } from "../state/state.ts";
import { Store } from "../state/store.ts";
import { Asking, type Certificate, type Side } from "./asking.ts";
import { Exposure } from "./exposure.ts";
import { Opening, type OpenScene } from "./opening.ts";
import { Recovery } from "./recovery.ts";
import { SharpSun } from "./sharp_sun.ts";

type Event = "scene" | "scenes" | "field" | "hover" | "timing" | "unlike" | "lost" | "found" | "problem" | "token"
    | "theme" | "loading";

export class App extends Events<Event> {
    readonly api = new Api();
    readonly store = new Store(firstState);
    readonly stage: Stage;
    readonly cameras: Cameras;
    readonly exposure = new Exposure();
    readonly comparable = new Comparable((name) => this.api.describe(name),
        (description) => this.prepareOther(description));
    readonly asking = new Asking(this, (side, field, wanted) => this.show(side, field, wanted),
        (reason) => this.fail(reason));
    /** The sun in the picture, where it is drawn sharp. */
    readonly sharp = new SharpSun(this);
    readonly opening = new Opening(this, (scene) => this.take(scene));
    readonly recovery = new Recovery(this);
    scenes: SceneLine[] = [];
    scene: OpenScene | null = null;
    hovered: number | null = null;
    /** What a link asks for and this daemon does not have; until another scene is opened. */
    notice: string | null = null;
    /** Why the last scene that was to be compared is not. */
    unlike: string | null = null;
    /** Radiances of the sky's tiles for a lighting; set by the panel of skies. */
    skyOf: (lighting: Lighting, of: Description) => readonly (number | number[])[] | null = () => null;
    /** The sky and its sun apart, of the scene that is open; set by the panel of skies. Null: no sun shines. */
    sunOf: (lighting: Lighting, of: Description) => SunParts | null = () => null;
    /** The weather that a link has to hold for a light; set by the panel of skies. */
    momentOf: (light: SkyLight) => Moment | null = () => null;
    /** Fetches what the first picture of a scene needs beside its mesh; the function that it returns takes that in. */
    prepare: (description: Description) => Promise<(scene: OpenScene) => void> = () => Promise.resolve(() => undefined);
    /** Fetches what the lighting of another scene needs, before it is compared. */
    prepareOther: (description: Description) => Promise<void> = () => Promise.resolve();

    constructor(canvas: HTMLCanvasElement) {
        super();
        this.cameras = new Cameras(canvas, () => this.stage.invalidate(), () => this.keepCamera());
        this.stage = new Stage(canvas, this.cameras.camera, (seconds) => this.cameras.advance(seconds));
        this.store.listen((now, before) => this.changed(now, before));
    }

    /** What is shown of the scene, and of the one beside it. */
    get fields(): readonly [Field | null, Field | null] {
        return this.asking.fields;
    }

    /** Answers shown so far, for tests. */
    get answers(): number {
        return this.asking.answers;
    }

    get isIdle(): boolean {
        return this.asking.isIdle && this.sharp.isIdle;
    }

    /** Opens a scene; the rest of the state is given (a link), or that of the scene as it comes. */
    async open(name: string, given: State | null): Promise<void> {
        if (!(await this.opening.open(name, given))) return;
        this.judge(this.store.now);
        this.tell("scene");
        this.ask();
    }

    /** What is shown now, as a request. */
    wanted(side: Side = 0): Wanted | null {
        return this.asking.wanted(side);
    }

    /** Asks for what is to be shown, if that has changed. */
    ask(again = false): void {
        this.asking.ask(again);
        this.sharp.ask(again);
    }

    /** Asks which scenes there are, after variants came or went. */
    async listScenes(): Promise<void> {
        this.scenes = await this.api.scenes();
        this.tell("scenes");
    }

    /** Finds out if a scene can be compared with the open one; `unlike` says why not. */
    async admit(name: string): Promise<boolean> {
        this.unlike = await this.comparable.admit(name);
        if (this.unlike !== null) this.tell("unlike");
        return this.unlike === null;
    }

    /** Shows refined values in place of those of the same request. */
    certify(field: Field, certificate: Certificate): void {
        this.asking.certificate = certificate;
        this.asking.fields[0] = field;
        if (!this.sharp.isOn) this.stage.setField(0, field);
        this.tell("field");
    }

    hover(element: number | null): void {
        if (element === this.hovered) return;
        this.hovered = element;
        this.stage.mark(element ?? -1, this.store.now.pins);
        this.tell("hover");
    }

    fail(reason: unknown): void {
        this.recovery.fail(reason);
    }

    /** Hands all that shapes the picture, but the values, to the stage. */
    private setDisplay(): void {
        const { view, compare } = this.store.now;
        const { low, high } = this.exposure.axis(view);
        this.stage.setDisplay({
            picture: view.picture,
            smooth: view.smooth,
            textured: view.textured,
            tone: view.tone,
            exposure: this.exposure.factor(view),
            palette: view.palette,
            range: [low, high],
            log: view.log,
            isoLines: view.isoLines,
            threshold: view.threshold,
            marked: view.judged !== null,
            compare: compare === null || this.fields[1] === null ? "none" : compare.how,
            split: compare?.split ?? 0.5,
        });
    }

    private take(scene: OpenScene): void {
        this.scene = scene;
        this.comparable.reset(scene.description);
        this.asking.forget(0);
        this.asking.forget(1);
        this.sharp.forget();
    }

    private show(side: Side, field: Field, wanted: Wanted): void {
        this.recovery.answered();
        if (side === 1 || !this.sharp.isOn) this.stage.setField(side, field);
        if (side === 0 && wanted.emission !== null) this.expose(field);
        this.setDisplay();
        this.opening.load(null);
        this.tell("field");
        this.tell("timing");
        this.recovery.look();
    }

    private expose(field: Field): void {
        const { scene, store: { now } } = this;
        const exposure = scene === null ? null : this.exposure.measure(field, scene.mesh, now.view, now.lighting);
        if (exposure !== null) this.store.settle({ ...now, view: { ...now.view, exposure } });
    }

    private changed(now: State, before: State): void {
        if (now.view.walk !== before.view.walk) this.cameras.setWalk(now.view.walk);
        if (now.pins !== before.pins) this.stage.mark(this.hovered ?? -1, now.pins);
        if (now.view.judged !== before.view.judged || now.scene !== before.scene) this.judge(now);
        if (now.compare === null && before.compare !== null) this.asking.forget(1);
        if (now.view !== before.view || now.compare !== before.compare) this.setDisplay();
        const other = now.compare?.scene ?? null;
        if (this.comparable.isNew(other) && other !== null)
            this.takeOther(other).catch((reason: unknown) => this.fail(reason));
        this.ask();
    }

    /** Takes in the scene of a comparison that came with a link or by undoing; ends one that cannot be. */
    private async takeOther(name: string): Promise<void> {
        if (await this.admit(name)) this.ask();
        else if (this.store.now.compare?.scene === name) this.store.settle({ ...this.store.now, compare: null });
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
}
