// The sun drawn sharp: from its true direction, with shadows by the mesh, in place of the tiles that the store's
// numbers have for it. The light that the sun's own light casts further, and all other light, stay the daemon's.
import { floatsToHalves, halfToNumber, Newest } from "lambert-light";
import type { Description } from "../daemon/api.ts";
import type { SunParts } from "../daylight/made_sky.ts";
import { Field } from "../picture/field.ts";
import { turned } from "../picture/glb.ts";
import type { SceneLuminaires } from "../state/luminaires.ts";
import { wantedFor, type Wanted } from "../state/request.ts";
import type { Lighting } from "../state/state.ts";
import type { Store } from "../state/store.ts";
import { abilitiesOf } from "./asking.ts";
import type { Shown } from "./shown.ts";

interface WantedSharp {
    of: Description;
    lighting: Lighting;
    luminaires: SceneLuminaires | null;
}

interface Sharp {
    field: Field;
    parts: SunParts;
}

export class SharpSun {
    private key = "";
    private readonly asker = new Newest<WantedSharp, Sharp | null>(
        (wanted) => this.sum(wanted),
        (sharp) => this.show(sharp),
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
        const { lighting, of } = wanted, key = JSON.stringify([lighting, this.scene.sky.keyOf(lighting, of)]);
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

    /** Null where it is off, or the picture shows numbers: in false colour, comparisons and by a threshold; and where
     * the sky has no sun, as far as that is known. */
    private wanted(): WantedSharp | null {
        const { scene: { now: scene, sky }, store: { now: { view, lighting, compare } } } = this;
        if (scene === null || !view.sharpSun || view.picture !== "light" || view.threshold !== null || compare !== null)
            return null;
        const { description: of } = scene;
        if ((of.emitters?.length ?? 0) > 0) return null;
        const known = sky.knownSky(lighting, of);
        return known === undefined || (known?.parts(of.channels) ?? null) !== null
            ? { of, lighting, luminaires: scene.luminaires }
            : null;
    }

    /** Null: no sun shines. */
    private async sum({ of, lighting, luminaires }: WantedSharp): Promise<Sharp | null> {
        const sky = await this.scene.sky.askSky(lighting, of), parts = sky?.parts(of.channels) ?? null;
        if (sky === null || parts === null) return null;
        const can = { ...abilitiesOf(of), emitters: 0, luminaires: null },
            exact = lighting.sky.sun === "exact" ? sky.exact(of.channels) : null;
        // Radiosity without the sun, and what the sun's light gives further.
        const rest = wantedFor(of.name, "radiosity", lighting, { ...can, luminaires, sky: parts.sky });
        const further = wantedFor(of.name, "indirect", { ...lighting, groups: {} }, { ...can,
            ...(exact === null ? { sky: parts.sun } : { sky: null, sun: exact.sun }) });
        const [one, other] = await Promise.all([this.solve(rest), this.solve(further)]);
        const scale = Math.max(one.scale, other.scale), sum = new Float32Array(one.bits.length);
        for (let i = 0; i < sum.length; i++)
            sum[i] = halfToNumber(one.bits[i]) * (one.scale / scale)
                + halfToNumber(other.bits[i]) * (other.scale / scale);
        return { field: new Field(floatsToHalves(sum), [one.channels, one.elements], scale), parts };
    }

    private show(sharp: Sharp | null): void {
        const { stage, now: scene, isSunSharp } = this.scene;
        if (sharp === null) return this.end();
        const { field, parts: { direction, light } } = sharp;
        if (!isSunSharp || scene === null || field.elements !== scene.mesh.elements) return;
        stage.setField(0, field);
        stage.setSun({ direction: turned(scene.mesh.up, [...direction]), light });
    }
}
