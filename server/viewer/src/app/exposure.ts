// The exposure and the ends of the palette that the page chooses, where the person left them to it.
import { spreadOf, type Field, type Spread } from "../picture/field.ts";
import type { SceneMesh } from "../picture/glb.ts";
import type { Axis } from "../picture/scale.ts";
import type { Lighting, View } from "../state/state.ts";

/** The mean of the logarithm of what is seen becomes this before the tone curve. */
const MIDDLE_GREY = 0.2;

export class Exposure {
    /** Of the field that was measured last. */
    spread: Spread = { low: 0, high: 1, most: 1, logMean: 0 };
    /** The exposure that was chosen last, log2. */
    own = 0;

    /** Measures a field where the view needs it; returns the exposure that is to be held, or null. Groups that shine
     * are left out. */
    measure(field: Field, mesh: SceneMesh, view: View, lighting: Lighting): number | null {
        const mustMeasure = view.picture === "false" ? view.range === null : view.exposure === null || view.follow;
        if (!mustMeasure) return null;
        const lit = lighting.groups;
        const isDark = mesh.groups.map((group) => !(lit[group.name]?.on && lit[group.name].power > 0));
        const dark = isDark.some((d) => d) ? (i: number): boolean => isDark[mesh.groupOf[i]] : (): boolean => true;
        this.spread = spreadOf(field.values, mesh.area, dark);
        if (view.picture !== "light" || this.spread.most <= 0) return null;
        this.own = Number((Math.log2(MIDDLE_GREY) - this.spread.logMean).toFixed(2));
        return this.own;
    }

    /** The exposure of a view that has other light: one that the page chose is chosen anew, that of a person stays. */
    anew(view: View): number | null {
        return view.exposure === this.own ? null : view.exposure;
    }

    /** Factor before the tone curve. */
    factor(view: View): number {
        return 2 ** (view.exposure ?? this.own);
    }

    /** The ends of the palette, as the person or the values set them. */
    axis(view: View): Axis {
        const { low, high } = this.spread;
        const [from, to] = view.range ?? [view.log ? Math.max(low, high / 1e4) : 0, high];
        return { low: from, high: Math.max(to, from + 1e-12), log: view.log && from > 0 };
    }
}
