// Asks for the light at sensors, after each answer that the picture shows: one request at a time, and of those that
// wait the newest.
import { Newest, readNpy } from "lambert-light";
import { isProblem, type Api } from "../daemon/api.ts";
import { darkValuesOf, valuesOf, type SceneSensors } from "../state/sensors.ts";
import type { Wanted } from "../state/request.ts";
import type { Store } from "../state/store.ts";
import type { Shown } from "./shown.ts";

interface WantedSensors {
    wanted: Wanted;
    sensors: SceneSensors;
    channels: number;
}

export class Sensing {
    private key = "";
    private isSeen = false;
    private readonly asker: Newest<WantedSensors, Float32Array>;

    /** `wanted` is the request for what is shown. */
    constructor(private readonly api: Pick<Api, "floats">, private readonly store: Store,
        private readonly scene: Pick<Shown, "now" | "sense" | "on">, private readonly wanted: () => Wanted | null,
        fail: (reason: unknown) => void)
    {
        this.asker = new Newest((wanted) => this.solve(wanted), (values) => scene.sense({ values, refused: null }),
            (reason) => {
                this.key = "";
                // The store may have no values at sensors, or none under such light; the picture goes on.
                const isRefused = isProblem(reason) && reason.status === 422;
                scene.sense({ values: null, refused: isRefused ? reason.detail : null });
                if (!isRefused) fail(reason);
            }, 1);
        scene.on("field", () => this.ask());
        store.listen((now, before) => {
            if (now.view.sensors !== before.view.sensors) this.ask();
        });
    }

    get isIdle(): boolean {
        return this.asker.isIdle;
    }

    /** They are looked at, or no more. */
    look(isSeen: boolean): void {
        this.isSeen = isSeen;
        if (isSeen) this.ask();
    }

    /** Of another scene nothing is known yet. */
    forget(): void {
        this.key = "";
        this.asker.forget();
        this.scene.sense({ values: null, refused: null });
    }

    private ask(): void {
        const { scene: { now: scene }, store: { now } } = this, sensors = scene?.sensors ?? null;
        if (scene === null || sensors === null || sensors.names.length === 0) return;
        const wanted = this.wanted();
        if (wanted === null) return;
        const key = JSON.stringify([wanted.emission, wanted.scale]);
        if (key === this.key) return;
        if (!now.view.sensors && !this.isSeen) return this.forget();
        this.key = key;
        this.asker.want({ wanted, sensors, channels: scene.description.channels });
    }

    private async solve({ wanted: { scene, emission, scale }, sensors, channels }: WantedSensors): Promise<
        Float32Array
    > {
        if (emission === null) return darkValuesOf(sensors);
        const { file } = await this.api.floats(scene, { emission, quantity: "irradiance",
            select: { sensors: sensors.names } });
        return valuesOf(sensors, readNpy(file).data, channels, scale);
    }
}
