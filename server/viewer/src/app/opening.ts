// Opens scenes: fetches what their first picture needs, and begins with the state of a link or with the scene as it
// comes.
import { Box3, BufferAttribute, Vector3 } from "three";
import type { Api } from "../daemon/api.ts";
import { readMesh } from "../picture/glb.ts";
import { Openings } from "../picture/openings.ts";
import { Picker } from "../picture/pick.ts";
import { SensorMarks } from "../picture/sensor_marks.ts";
import { defaultLightingOf } from "../state/default_lighting.ts";
import { isRow, luminairesOf } from "../state/luminaires.ts";
import { placeOfChoice, sensorsOf } from "../state/sensors.ts";
import { firstState, type State, type View } from "../state/state.ts";
import type { Store } from "../state/store.ts";
import type { OpenScene } from "./page.ts";
import type { Shown } from "./shown.ts";

export class Opening {
    private turn = 0;

    /** `take` makes a scene the open one, of which nothing is asked yet. */
    constructor(private readonly api: Pick<Api, "describe" | "mesh" | "luminaires" | "sensors">,
        private readonly store: Store, private readonly scene: Pick<Shown, "stage" | "cameras" | "sky" | "load">,
        private readonly take: (scene: OpenScene) => void)
    {}

    /** Opens a scene; false: another one was asked for meanwhile. `given` is the rest of the state, null: as the scene
     * comes. */
    async open(name: string, given: State | null): Promise<boolean> {
        const { api, store, scene: { stage, cameras, sky } } = this, turn = ++this.turn;
        this.scene.load(name);
        const described = api.describe(name);
        const [description, file, takeIn, luminaires, sets] = await Promise.all([described, api.mesh(name),
            described.then((d) => sky.prepare(d)),
            described.then((d) => (d.luminaires === null ? [] : api.luminaires(name))),
            described.then((d) => (d.sensors === null ? [] : api.sensors(name)))]);
        if (turn !== this.turn) return false;
        const mesh = readMesh(file);
        const box = new Box3().setFromBufferAttribute(new BufferAttribute(mesh.positions, 3));
        const diagonal = box.getSize(new Vector3()).length(), sensors = sensorsOf(sets),
            openings = luminaires.length === 0 ? null : new Openings(luminaires, mesh.up, diagonal),
            marks = sensors === null ? null : new SensorMarks(sensors, mesh.up, diagonal, stage.uniforms);
        stage.show(mesh, description.channels, openings, marks);
        const picker = new Picker(stage.geometry as never, mesh);
        const scene = { description, mesh, picker, defaultLighting: takeIn(defaultLightingOf(mesh, description)),
            openings, luminaires: luminairesOf(luminaires, mesh.area), sensors, marks };
        this.take(scene);
        cameras.floorAt = (x, z) => picker.floorAt(x, z);
        cameras.setBounds(box);
        const state = stateOf(scene, given, store.now);
        store.restart({ ...state, scene: name });
        document.title = `${name} · Lambert`;
        stage.resize();
        this.placeCamera(state.view);
        return true;
    }

    private placeCamera({ camera, walk }: View): void {
        const { cameras } = this.scene;
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
 * the page as it is, in the scene's own light, seen whole. Its unit is that of the store. */
function stateOf({ description, mesh, defaultLighting, luminaires, sensors }: OpenScene, given: State | null,
    before: State): State
{
    const base = given ?? { ...firstState, view: { ...before.view, camera: null, exposure: null, range: null } };
    const lighting = { ...base.lighting, groups: { ...defaultLighting.groups, ...base.lighting.groups } };
    if (base.lighting === firstState.lighting) Object.assign(lighting, defaultLighting);
    if (!isRow(luminaires, lighting.soloLuminaire)) lighting.soloLuminaire = null;
    const view: View = { ...base.view, unit: description.lights === "lm" ? "lx" : "W/m²" };
    return { ...base, view, lighting, pins: base.pins.filter((pin) => pin < mesh.elements),
        sensor: placeOfChoice(sensors, base.sensor) === null ? null : base.sensor };
}
