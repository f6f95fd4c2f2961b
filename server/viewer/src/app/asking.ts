// Asks the daemon for what the state wants, for both sides of a comparison, and holds the answers that are shown.
import type { Description } from "../daemon/api.ts";
import { Newest } from "../daemon/newest.ts";
import { Field } from "../picture/field.ts";
import { wantedFor, type Wanted } from "../state/request.ts";
import type { App } from "./app.ts";

/** The scene that is open, and what it is compared with. */
export type Side = 0 | 1;

export interface Timing {
    /** From the request to the picture's textures, and in the daemon, ms. */
    roundTrip: number;
    solve: number | null;
}

/** A bound on the error of every number shown, and what it took, ms. */
export interface Certificate {
    bound: number;
    iterations: number;
    solve: number | null;
}

/** An answer was of another mesh than the one that is shown. */
export class Replaced extends Error {}

export class Asking {
    fields: [Field | null, Field | null] = [null, null];
    timing: Timing = { roundTrip: 0, solve: null };
    /** Where the daemon has certified what is shown. */
    certificate: Certificate | null = null;
    /** Answers shown so far. */
    answers = 0;
    private readonly askers: readonly [Newest<Wanted, Field>, Newest<Wanted, Field>];
    private asked = ["", ""];

    /** `took` shows an answer, which is in the fields by then. */
    constructor(private readonly app: Pick<App, "api" | "scene" | "store" | "comparable" | "skyOf">,
        private readonly took: (side: Side, field: Field, wanted: Wanted) => void, fail: (reason: unknown) => void)
    {
        const asker = (side: Side): Newest<Wanted, Field> =>
            new Newest((wanted) => this.solve(wanted), (field, wanted) => this.take(side, field, wanted), fail);
        this.askers = [asker(0), asker(1)];
    }

    get isIdle(): boolean {
        return this.askers.every((asker) => asker.isIdle);
    }

    /** What is shown now, as a request; null: there is no scene, nothing to compare it with, or no knowledge of that
     * yet. */
    wanted(side: Side): Wanted | null {
        const { scene, store: { now }, comparable } = this.app;
        if (scene === null || (side === 1 && now.compare === null)) return null;
        const quantity = now.view.picture === "light" ? "radiosity" : now.view.quantity;
        const lighting = (side === 1 ? now.compare?.lighting : null) ?? now.lighting;
        const other = side === 1 ? now.compare?.scene ?? null : null,
            of = other === null ? scene.description : comparable.get(other);
        if (of === undefined) return null;
        return wantedFor(of.name, quantity, lighting, { ...abilitiesOf(of), emitters: of.emitters?.length ?? 0,
            sky: this.app.skyOf(lighting, of) });
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
        this.fields[side] = null;
        this.asked[side] = "";
        this.askers[side].forget();
    }

    async solve(wanted: Wanted): Promise<Field> {
        const { scene, api } = this.app;
        if (scene === null) throw new Error("no scene is open");
        const { mesh: { elements }, description: { channels } } = scene;
        if (wanted.emission === null) return new Field(new Uint16Array(channels * elements), [channels, elements], 1);
        const start = performance.now();
        const { values, solveMs } = await api.radiosity(wanted.scene, { emission: wanted.emission,
            quantity: wanted.quantity });
        this.timing = { roundTrip: performance.now() - start, solve: solveMs };
        const field = Field.of(values, wanted.scale);
        if (field.elements !== elements)
            throw new Replaced(`${wanted.scene} has ${field.elements} elements, the mesh shown has ${elements}`);
        return field;
    }

    private take(side: Side, field: Field, wanted: Wanted): void {
        if (side === 0) this.certificate = null;
        this.fields[side] = field;
        this.answers += 1;
        this.took(side, field, wanted);
    }
}

/** The channels and groups that a store takes emission of. */
export function abilitiesOf({ channels, groups }: Description): { channels: number; groups: string[] } {
    return { channels, groups: groups.map((group) => group.name) };
}
