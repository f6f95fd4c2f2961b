// Opens scenes: fetches what their first picture needs, and begins with the state of a link or with the scene as it
// comes.
import { Box3, BufferAttribute } from "three";
import type { Description } from "../daemon/api.ts";
import { readMesh, type SceneMesh } from "../picture/glb.ts";
import { Picker } from "../picture/pick.ts";
import { defaultLightingOf } from "../state/default_lighting.ts";
import { firstState, type Lighting, type State, type View } from "../state/state.ts";
import type { App } from "./app.ts";

export interface OpenScene {
    description: Description;
    mesh: SceneMesh;
    picker: Picker;
    /** Lighting that the scene comes with. */
    defaultLighting: Lighting;
}

export class Opening {
    /** The scene that is on its way, until its first picture; "" while it has no name yet, null: none is. */
    loading: string | null = "";
    private turn = 0;

    /** `take` makes a scene the open one, of which nothing is asked yet. */
    constructor(private readonly app: Pick<App, "api" | "stage" | "cameras" | "store" | "tell" | "prepare">,
        private readonly take: (scene: OpenScene) => void)
    {}

    load(name: string | null): void {
        if (this.loading === name) return;
        this.loading = name;
        this.app.tell("loading");
    }

    /** Opens a scene; false: another one was asked for meanwhile. `given` is the rest of the state, null: as the scene
     * comes. */
    async open(name: string, given: State | null): Promise<boolean> {
        const { app } = this, turn = ++this.turn;
        this.load(name);
        const described = app.api.describe(name);
        const [description, file, takeIn] = await Promise.all([described, app.api.mesh(name),
            described.then((d) => app.prepare(d))]);
        if (turn !== this.turn) return false;
        const mesh = readMesh(file);
        app.stage.show(mesh, description.channels);
        const picker = new Picker(app.stage.geometry as never, app.stage.drawn ?? mesh);
        const scene = { description, mesh, picker, defaultLighting: defaultLightingOf(mesh, description) };
        takeIn(scene);
        this.take(scene);
        app.cameras.floorAt = (x, z) => picker.floorAt(x, z);
        app.cameras.setBounds(new Box3().setFromBufferAttribute(new BufferAttribute(mesh.positions, 3)));
        const state = stateOf(scene, given, app.store.now);
        app.store.restart({ ...state, scene: name });
        document.title = `${name} · Lambert`;
        app.stage.resize();
        this.placeCamera(state.view);
        return true;
    }

    private placeCamera({ camera, walk }: View): void {
        const { cameras } = this.app;
        if (camera === null) {
            // From outside, and in from there.
            cameras.setWalk(false);
            cameras.fit(false);
        }
        cameras.setWalk(walk);
        if (camera !== null) cameras.place(camera, false);
    }
}

/** The state that a scene begins with: a given one, whose lamps that it does not name are the scene's own, or that of
 * the page as it is, in the scene's own light, seen whole. */
function stateOf({ mesh, defaultLighting }: OpenScene, given: State | null, before: State): State {
    const base = given ?? { ...firstState, view: { ...before.view, camera: null, exposure: null, range: null } };
    const lighting = { ...base.lighting, groups: { ...defaultLighting.groups, ...base.lighting.groups } };
    if (base.lighting === firstState.lighting) Object.assign(lighting, defaultLighting);
    return { ...base, lighting, pins: base.pins.filter((pin) => pin < mesh.elements) };
}
