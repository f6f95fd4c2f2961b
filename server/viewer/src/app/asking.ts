// Asks the daemon for the values that the state wants, for both sides of a comparison, and has the answers shown.
import type { Api, Description } from "../daemon/api.ts";
import { Newest } from "../daemon/newest.ts";
import { Field } from "../picture/field.ts";
import type { Comparable } from "../state/comparable.ts";
import { wantedFor, type Wanted } from "../state/request.ts";
import type { Store } from "../state/store.ts";
import type { Side, Timing } from "./page.ts";
import type { Shown } from "./shown.ts";

/** An answer was of another mesh than the one that is shown. */
export class Replaced extends Error {}

/** What becomes of requests. */
export interface Outcome {
    /** An answer has come, and is shown next. */
    answered(): void;
    fail(reason: unknown): void;
}

export class Asking {
    private timing: Timing = { roundTrip: 0, solve: null };
    private readonly askers: readonly [Newest<Wanted, Field>, Newest<Wanted, Field>];
    private asked = ["", ""];

    constructor(private readonly api: Pick<Api, "radiosity">, private readonly store: Store,
        private readonly scene: Pick<Shown, "now" | "fields" | "sky" | "show" | "tell">,
        private readonly comparable: Comparable, private readonly outcome: Outcome)
    {
        const asker = (side: Side): Newest<Wanted, Field> =>
            new Newest((wanted) => this.solve(wanted), (field, wanted) => this.take(side, field, wanted), (reason) =>
                outcome.fail(reason));
        this.askers = [asker(0), asker(1)];
    }

    get isIdle(): boolean {
        return this.askers.every((asker) => asker.isIdle);
    }

    wanted(side: Side): Wanted | null {
        const { scene: { now: scene, sky }, store: { now } } = this;
        if (scene === null || (side === 1 && now.compare === null)) return null;
        const quantity = now.view.picture === "light" ? "radiosity" : now.view.quantity;
        const lighting = (side === 1 ? now.compare?.lighting : null) ?? now.lighting;
        const other = side === 1 ? now.compare?.scene ?? null : null,
            of = other === null ? scene.description : this.comparable.get(other);
        if (of === undefined) return null;
        const sun = sky.exactSun(lighting, of);
        return wantedFor(of.name, quantity, lighting, {
            ...abilitiesOf(of),
            emitters: of.emitters?.length ?? 0,
            sky: sun === null ? sky.radiances(lighting, of) : sun.sky,
            sun: sun === null ? null : sun.sun,
        });
    }

    /** Asks for what is to be shown, if that has changed. */
    ask(again: boolean): void {
        for (const side of [0, 1] as const) {
            const wanted = this.wanted(side);
            const key = wanted === null ? "" : JSON.stringify(wanted);
            if (wanted === null || (key === this.asked[side] && !again)) continue;
            this.asked[side] = key;
            this.askers[side].want(wanted);
        }
    }

    /** Of another scene, or of a comparison that ended, nothing is shown yet. */
    forget(side: Side): void {
        this.scene.fields[side] = null;
        this.asked[side] = "";
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

    private take(side: Side, field: Field, wanted: Wanted): void {
        this.outcome.answered();
        this.scene.show(side, field, wanted.emission === null);
        this.scene.tell("timing", this.timing);
    }
}

/** The channels and groups that a store takes emission of. */
export function abilitiesOf({ channels, groups }: Description): { channels: number; groups: string[] } {
    return { channels, groups: groups.map((group) => group.name) };
}
