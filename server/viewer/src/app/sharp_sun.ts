// The sun drawn sharp: from its true direction, with shadows by the mesh, in place of the tiles that the store's
// numbers have for it. The light that the sun's own light casts further, and all other light, stay the daemon's.
import { floatsToHalves, halfToNumber } from "../base/half.ts";
import { Newest } from "../daemon/newest.ts";
import type { SunParts } from "../daylight/source.ts";
import { Field } from "../picture/field.ts";
import { turned } from "../picture/glb.ts";
import { wantedFor, type Wanted } from "../state/request.ts";
import type { App } from "./app.ts";
import { abilitiesOf } from "./asking.ts";

interface WantedSharp {
    /** Radiosity without the sun, and what the sun's light gives further. */
    rest: Wanted;
    further: Wanted;
    parts: SunParts;
}

export class SharpSun {
    private key = "";
    private readonly asker = new Newest<WantedSharp, Field>(
        (wanted) => this.solve(wanted),
        (field, wanted) => this.show(field, wanted),
        (reason) => {
            this.end();
            this.app.fail(reason);
        },
        1,
    );

    constructor(
        private readonly app: Pick<App, "scene" | "store" | "stage" | "fields" | "asking" | "sunOf" | "fail">,
    ) {}

    /** True while the picture has the sun drawn, or will have. */
    get isOn(): boolean {
        return this.key !== "";
    }

    get isIdle(): boolean {
        return this.asker.isIdle;
    }

    /** Asks for what is to be drawn, if that has changed. */
    ask(again: boolean): void {
        const wanted = this.wanted();
        if (wanted === null) {
            if (this.isOn) this.end();
            return;
        }
        const key = JSON.stringify(wanted);
        if (key === this.key && !again) return;
        this.key = key;
        this.asker.want(wanted);
    }

    /** Of another scene nothing is drawn yet. */
    forget(): void {
        this.key = "";
        this.asker.forget();
        this.app.stage.setSun(null);
    }

    private end(): void {
        this.forget();
        const [field] = this.app.fields;
        if (field !== null) this.app.stage.setField(0, field);
    }

    /** Null where it is off, or the picture shows numbers: in false colour, comparisons and by a threshold. */
    private wanted(): WantedSharp | null {
        const { app, app: { scene, store: { now: { view, lighting, compare } } } } = this;
        if (scene === null || !view.sharpSun || view.picture !== "light" || view.threshold !== null || compare !== null)
            return null;
        const { description } = scene,
            parts = (description.emitters?.length ?? 0) > 0 ? null : app.sunOf(lighting, description);
        if (parts === null) return null;
        const can = { ...abilitiesOf(description), emitters: 0 };
        return {
            rest: wantedFor(description.name, "radiosity", lighting, { ...can, sky: parts.sky }),
            further: wantedFor(description.name, "indirect", { ...lighting, groups: {} }, { ...can, sky: parts.sun }),
            parts,
        };
    }

    private async solve({ rest, further }: WantedSharp): Promise<Field> {
        const [one, other] = await Promise.all([this.app.asking.solve(rest), this.app.asking.solve(further)]);
        const scale = Math.max(one.scale, other.scale), sum = new Float32Array(one.bits.length);
        for (let i = 0; i < sum.length; i++)
            sum[i] = halfToNumber(one.bits[i]) * (one.scale / scale)
                + halfToNumber(other.bits[i]) * (other.scale / scale);
        return new Field(floatsToHalves(sum), [one.channels, one.elements], scale);
    }

    private show(field: Field, { parts: { direction: [east, north, up], light } }: WantedSharp): void {
        const { stage, scene } = this.app;
        if (!this.isOn || scene === null || field.elements !== scene.mesh.elements) return;
        stage.setField(0, field);
        // The axes of stores, as solver/daylight/sky_tiles.h has them.
        const axes = { x: [up, east, north], y: [east, up, -north], z: [east, north, up] } as const;
        stage.setSun({ direction: turned(scene.mesh.up, axes[scene.mesh.up]), light });
    }
}
