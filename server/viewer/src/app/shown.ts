// What is loaded of the scene and shown: the picture follows the state and the answers.
import type { SceneLine } from "lambert-light";
import { Events } from "../base/events.ts";
import type { SceneSky } from "../daylight/scene_sky.ts";
import { Cameras } from "../picture/cameras.ts";
import type { Field } from "../picture/field.ts";
import { Stage } from "../picture/stage.ts";
import { placeOfChoice } from "../state/sensors.ts";
import { quantityShown, type State } from "../state/state.ts";
import type { Store } from "../state/store.ts";
import { Exposure } from "./exposure.ts";
import type { Certificate, OpenScene, Scene, SceneEvents, Sensed, Side } from "./page.ts";

export class Shown extends Events<SceneEvents> implements Scene {
    now: OpenScene | null = null;
    all: readonly SceneLine[] = [];
    readonly fields: [Field | null, Field | null] = [null, null];
    certificate: Certificate | null = null;
    sensed: Sensed = { values: null, refused: null };
    hovered: number | null = null;
    isSunSharp = false;
    readonly stage: Stage;
    readonly cameras: Cameras;
    readonly exposure = new Exposure();
    /** The scene that is on its way, until its first picture; "" while it has no name yet, null: none is. */
    loading: string | null = "";
    /** Answers shown so far, for tests. */
    answers = 0;

    constructor(canvas: HTMLCanvasElement, private readonly store: Store, readonly sky: SceneSky) {
        super();
        this.cameras = new Cameras(canvas, () => this.stage.invalidate(), () => this.keepCamera());
        this.stage = new Stage(canvas, this.cameras.camera, (seconds) => this.cameras.advance(seconds));
        store.listen((now, before) => this.follow(now, before));
    }

    load(name: string | null): void {
        if (this.loading === name) return;
        this.loading = name;
        this.tell("loading", name);
    }

    /** The state is that of the scene by now. */
    opened(): void {
        this.judge(this.store.now);
        this.tell("scene");
    }

    list(scenes: readonly SceneLine[]): void {
        this.all = scenes;
        this.tell("scenes");
    }

    /** Takes an answer in. In the dark there is nothing to expose for. */
    show(side: Side, field: Field, isDark: boolean): void {
        if (side === 0) this.certificate = null;
        this.fields[side] = field;
        this.answers += 1;
        if (side === 1 || !this.isSunSharp) this.stage.setField(side, field);
        if (side === 0 && !isDark) this.expose(field);
        this.display();
        this.load(null);
        this.tell("field");
    }

    certify(field: Field, certificate: Certificate): void {
        this.certificate = certificate;
        this.fields[0] = field;
        if (!this.isSunSharp) this.stage.setField(0, field);
        this.tell("field");
    }

    sense(sensed: Sensed): void {
        if (sensed.values === null && sensed.refused === this.sensed.refused && this.sensed.values === null) return;
        this.sensed = sensed;
        this.stage.setSensors(sensed.values);
        this.tell("sensed");
    }

    hover(element: number | null): void {
        if (element === this.hovered) return;
        this.hovered = element;
        this.stage.mark(element ?? -1, this.store.now.pins);
        this.tell("hover");
    }

    pick(luminaire: string): void {
        this.tell("picked", luminaire);
    }

    setBackground(colour: string): void {
        this.stage.background = colour;
        this.tell("theme");
    }

    private follow(now: State, before: State): void {
        if (now.view.walk !== before.view.walk) this.cameras.setWalk(now.view.walk);
        if (now.pins !== before.pins) this.stage.mark(this.hovered ?? -1, now.pins);
        if (now.view.judged !== before.view.judged || now.scene !== before.scene) this.judge(now);
        if (now.view !== before.view || now.compare !== before.compare || now.sensor !== before.sensor) this.display();
    }

    /** Hands all that shapes the picture, but the values, to the stage. */
    private display(): void {
        const { view, compare, sensor } = this.store.now;
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
            openings: view.openings,
            sensors: view.sensors,
            hiddenSets: view.hiddenSets,
            // The palette is that of other numbers elsewhere.
            areSensorsColoured: quantityShown(view) === "irradiance" && compare === null,
            required: view.required,
            sensor: placeOfChoice(this.now?.sensors ?? null, sensor),
            marked: view.judged !== null,
            compare: compare === null || this.fields[1] === null ? "none" : compare.how,
            split: compare?.split ?? 0.5,
        });
    }

    private expose(field: Field): void {
        const { now: scene, store: { now } } = this;
        const exposure = scene === null ? null : this.exposure.measure(field, scene.mesh, now.view, now.lighting);
        if (exposure !== null) this.store.settle({ ...now, view: { ...now.view, exposure } });
    }

    private judge({ view: { judged } }: State): void {
        if (this.now === null) return;
        const { groups, groupOf } = this.now.mesh, group = groups.findIndex((g) => g.name === judged);
        this.stage.judge((element) => group < 0 || groupOf[element] === group);
    }

    private keepCamera(): void {
        const { store: { now } } = this;
        if (this.now === null) return;
        const camera = this.cameras.now;
        if (JSON.stringify(camera) !== JSON.stringify(now.view.camera))
            this.store.settle({ ...now, view: { ...now.view, camera } });
    }
}
