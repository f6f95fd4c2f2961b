// Asks the daemon for the values that the state wants, for both sides of a comparison, and has the answers shown.
import { Newest } from "lambert-light";
import type { Api, Description, Quantity } from "../daemon/api.ts";
import type { SkyShare } from "../daylight/scene_sky.ts";
import { Field } from "../picture/field.ts";
import type { Comparable } from "../state/comparable.ts";
import type { SceneLuminaires } from "../state/luminaires.ts";
import { wantedFor, type Wanted } from "../state/request.ts";
import { quantityShown, type Lighting } from "../state/state.ts";
import type { Store } from "../state/store.ts";
import type { Side, Timing } from "./page.ts";
import type { Shown } from "./shown.ts";

/** An answer was of another mesh than the one that is shown. */
export class Replaced extends Error {}

/** What is to be shown of a side. Its sky may have to be asked for before it is a request. */
interface Plan {
    of: Description;
    quantity: Quantity;
    lighting: Lighting;
    /** Scenes that are compared have the same ones. */
    luminaires: SceneLuminaires | null;
}

/** What becomes of requests. */
export interface Outcome {
    /** An answer has come, and is shown next. */
    answered(): void;
    fail(reason: unknown): void;
}

export class Asking {
    private timing: Timing = { roundTrip: 0, solve: null };
    /** Of each side first its sky, then its values: while the values of one moment are on their way, the sky of the
     * next one is asked for. */
    private readonly skies: readonly [Newest<Plan, Wanted>, Newest<Plan, Wanted>];
    private readonly askers: readonly [Newest<Wanted, Field>, Newest<Wanted, Field>];
    private asked = ["", ""];

    constructor(private readonly api: Pick<Api, "radiosity">, private readonly store: Store,
        private readonly scene: Pick<Shown, "now" | "fields" | "sky" | "show" | "tell">,
        private readonly comparable: Comparable, private readonly outcome: Outcome)
    {
        const fail = (reason: unknown): void => outcome.fail(reason);
        const asker = (side: Side): Newest<Wanted, Field> =>
            new Newest((wanted) => this.solve(wanted), (field, wanted) => this.take(side, field, wanted), fail);
        const skies = (side: Side): Newest<Plan, Wanted> =>
            new Newest(async (plan) => wantedOf(plan, await scene.sky.ask(plan.lighting, plan.of)), (wanted) =>
                this.askers[side].want(wanted), fail, 1);
        this.askers = [asker(0), asker(1)];
        this.skies = [skies(0), skies(1)];
    }

    get isIdle(): boolean {
        return [...this.skies, ...this.askers].every((asker) => asker.isIdle);
    }

    wanted(side: Side): Wanted | null {
        const plan = this.plan(side), sky = plan === null ? undefined : this.scene.sky.known(plan.lighting, plan.of);
        return plan === null || sky === undefined ? null : wantedOf(plan, sky);
    }

    private plan(side: Side): Plan | null {
        const { scene: { now: scene }, store: { now } } = this;
        if (scene === null || (side === 1 && now.compare === null)) return null;
        const lighting = (side === 1 ? now.compare?.lighting : null) ?? now.lighting;
        const other = side === 1 ? now.compare?.scene ?? null : null,
            of = other === null ? scene.description : this.comparable.get(other);
        return of === undefined
            ? null
            : { of, quantity: quantityShown(now.view), lighting, luminaires: scene.luminaires };
    }

    /** Asks for what is to be shown, if that has changed. */
    ask(again: boolean): void {
        for (const side of [0, 1] as const) {
            const plan = this.plan(side), key = plan === null ? "" : this.keyOf(plan);
            if (plan === null || (key === this.asked[side] && !again)) continue;
            this.asked[side] = key;
            const sky = this.scene.sky.known(plan.lighting, plan.of);
            if (sky === undefined) {
                this.skies[side].want(plan);
            } else {
                this.skies[side].forget();
                this.askers[side].want(wantedOf(plan, sky));
            }
        }
    }

    /** Of another scene, or of a comparison that ended, nothing is shown yet. */
    forget(side: Side): void {
        this.scene.fields[side] = null;
        this.asked[side] = "";
        this.skies[side].forget();
        this.askers[side].forget();
    }

    async solve(wanted: Wanted): Promise<Field> {
        const { now: scene } = this.scene;
        if (scene === null) throw new Error("no scene is open");
        const { mesh: { elements }, description: { channels } } = scene;
        if (wanted.emission === null)
            return new Field(new Uint16Array(channels * elements), [channels, elements], 1);
        const start = performance.now();
        const { values, solveMs } = await this.api.radiosity(wanted.scene, { emission: wanted.emission,
            quantity: wanted.quantity });
        this.timing = { roundTrip: performance.now() - start, solve: solveMs };
        const field = Field.of(values, wanted.scale);
        if (field.elements !== elements)
            throw new Replaced(`${wanted.scene} has ${field.elements} elements, the mesh shown has ${elements}`);
        return field;
    }

    /** Plans of one key have one answer. */
    private keyOf(plan: Plan): string {
        const { of, lighting } = plan, rest = wantedOf(plan, { sky: null, sun: null });
        return JSON.stringify([rest, this.scene.sky.keyOf(lighting, of)]);
    }

    private take(side: Side, field: Field, wanted: Wanted): void {
        this.outcome.answered();
        this.scene.show(side, field, wanted.emission === null);
        this.scene.tell("timing", this.timing);
    }
}

function wantedOf({ of, quantity, lighting, luminaires }: Plan, sky: SkyShare): Wanted {
    return wantedFor(of.name, quantity, lighting, { ...abilitiesOf(of), emitters: of.emitters?.length ?? 0, luminaires,
        ...sky });
}

/** The channels and groups that a store takes emission of. */
export function abilitiesOf({ channels, groups }: Description): { channels: number; groups: string[] } {
    return { channels, groups: groups.map((group) => group.name) };
}
