// The sun drawn sharp: from its true direction, with shadows by the mesh, in place of the tiles that the store's
// numbers have for it. The light that the sun's own light casts further, and all other light, stay the daemon's.
import { floatsToHalves, halfToNumber } from "../base/half.ts";
import { Newest } from "../daemon/newest.ts";
import type { SunParts } from "../daylight/source.ts";
import { Field } from "../picture/field.ts";
import { turned } from "../picture/glb.ts";
import { wantedFor, type Wanted } from "../state/request.ts";
import type { Store } from "../state/store.ts";
import { abilitiesOf } from "./asking.ts";
import type { Shown } from "./shown.ts";

interface WantedSharp {
    /** Radiosity without the sun, and what the sun's light gives further. */
    rest: Wanted;
    further: Wanted;
    parts: SunParts;
}

export class SharpSun {
    private key = "";
    private readonly asker = new Newest<WantedSharp, Field>(
        (wanted) => this.sum(wanted),
        (field, wanted) => this.show(field, wanted),
        (reason) => {
            this.end();
            this.fail(reason);
        },
        1,
    );

    /** `solve` asks for the values of a request. */
    constructor(private readonly store: Store,
        private readonly scene: Pick<Shown, "now" | "stage" | "fields" | "sky" | "isSunSharp">,
        private readonly solve: (wanted: Wanted) => Promise<Field>, private readonly fail: (reason: unknown) => void)
    {}

    get isIdle(): boolean {
        return this.asker.isIdle;
    }

    /** Asks for what is to be drawn, if that has changed. */
    ask(again: boolean): void {
        const wanted = this.wanted();
        if (wanted === null) {
            if (this.scene.isSunSharp) this.end();
            return;
        }
        const key = JSON.stringify(wanted);
        if (key === this.key && !again) return;
        this.set(key);
        this.asker.want(wanted);
    }

    /** Of another scene nothing is drawn yet. */
    forget(): void {
        this.set("");
        this.asker.forget();
        this.scene.stage.setSun(null);
    }

    private set(key: string): void {
        this.key = key;
        this.scene.isSunSharp = key !== "";
    }

    private end(): void {
        this.forget();
        const { fields: [field], stage } = this.scene;
        if (field !== null) stage.setField(0, field);
    }

    /** Null where it is off, or the picture shows numbers: in false colour, comparisons and by a threshold. */
    private wanted(): WantedSharp | null {
        const { scene: { now: scene, sky }, store: { now: { view, lighting, compare } } } = this;
        if (scene === null || !view.sharpSun || view.picture !== "light" || view.threshold !== null || compare !== null)
            return null;
        const { description } = scene,
            parts = (description.emitters?.length ?? 0) > 0 ? null : sky.parts(lighting, description);
        if (parts === null) return null;
        const can = { ...abilitiesOf(description), emitters: 0 }, exact = sky.exactSun(lighting, description);
        return {
            rest: wantedFor(description.name, "radiosity", lighting, { ...can, sky: parts.sky }),
            further: wantedFor(description.name, "indirect", { ...lighting, groups: {} }, { ...can,
                ...(exact === null ? { sky: parts.sun } : { sky: null, sun: exact.sun }) }),
            parts,
        };
    }

    private async sum({ rest, further }: WantedSharp): Promise<Field> {
        const [one, other] = await Promise.all([this.solve(rest), this.solve(further)]);
        const scale = Math.max(one.scale, other.scale), sum = new Float32Array(one.bits.length);
        for (let i = 0; i < sum.length; i++)
            sum[i] = halfToNumber(one.bits[i]) * (one.scale / scale)
                + halfToNumber(other.bits[i]) * (other.scale / scale);
        return new Field(floatsToHalves(sum), [one.channels, one.elements], scale);
    }

    private show(field: Field, { parts: { direction: [east, north, up], light } }: WantedSharp): void {
        const { stage, now: scene, isSunSharp } = this.scene;
        if (!isSunSharp || scene === null || field.elements !== scene.mesh.elements) return;
        stage.setField(0, field);
        // The axes of stores, as solver/daylight/sky_tiles.h has them.
        const axes = { x: [up, east, north], y: [east, up, -north], z: [east, north, up] } as const;
        stage.setSun({ direction: turned(scene.mesh.up, axes[scene.mesh.up]), light });
    }
}
