// The scenes that can be compared with the open one: those that take the same lighting on as many elements. Nothing is
// asked of any other.
import { count } from "../base/numbers.ts";
import { isProblem, type Description, type Luminaire } from "../daemon/api.ts";

const namesOf = (list: readonly { name: string }[]): string => JSON.stringify(list.map((group) => group.name).sort());

const namesIn = (luminaires: readonly Luminaire[]): string =>
    JSON.stringify(luminaires.map(({ name, group }) => JSON.stringify([name, group])).sort());

/** Why b cannot be compared with a, as a sentence, as far as their descriptions tell; null: it can. Skies may have
 * other tiles, for which they are made anew. */
export function whyIncomparable(a: Description, b: Description): string | null {
    if (b.elements !== a.elements)
        return `${b.name} has ${count(b.elements)} elements and ${a.name} ${
            count(a.elements)
        }: another mesh, whose elements are no pairs.`;
    if (b.channels !== a.channels)
        return `${b.name} has ${b.channels} channels and ${a.name} ${a.channels}, so there is no difference to show.`;
    if (namesOf(b.groups) !== namesOf(a.groups))
        return `${b.name} has other groups than ${a.name}, so it cannot be lit alike.`;
    if ((b.sky === null) !== (a.sky === null))
        return `Only one of ${a.name} and ${b.name} has a sky, so they cannot be lit alike.`;
    const hasTiles = (of: Description): boolean => of.sky !== null && of.emitters?.length === of.sky.tiles;
    const emitters = (of: Description): string => (hasTiles(of) ? "tiles" : JSON.stringify(of.emitters ?? []));
    if ((b.luminaires?.count ?? 0) !== (a.luminaires?.count ?? 0))
        return `${b.name} has other luminaires than ${a.name}, so it cannot be lit alike.`;
    if (emitters(b) !== emitters(a)) return `${b.name} has other emitters than ${a.name}, so it cannot be lit alike.`;
    return null;
}

export class Comparable {
    private open: Description | null = null;
    private readonly admitted = new Map<string, Description>();
    private taken: string | null = null;

    constructor(private readonly describe: (name: string) => Promise<Description>,
        /** Fetches what the lighting of a scene needs. */
        private readonly prepare: (description: Description) => Promise<void>,
        private readonly luminairesOf: (name: string) => Promise<Luminaire[]>)
    {}

    /** Another scene is open. */
    reset(open: Description): void {
        this.open = open;
        this.admitted.clear();
        this.taken = null;
    }

    /** A scene that was admitted. */
    get(name: string): Description | undefined {
        return this.admitted.get(name);
    }

    /** True once for each scene that a comparison names: it is to be admitted. */
    isNew(name: string | null): boolean {
        if (this.open === null || name === this.taken) return false;
        this.taken = name;
        return name !== null;
    }

    private async haveSameLuminaires(a: Description, b: Description): Promise<boolean> {
        const [one, other] = await Promise.all([a, b].map(async (of) => namesIn(await this.luminairesOf(of.name))));
        return one === other;
    }

    /** Why a scene cannot be compared with the open one, as a sentence; null: it is admitted. */
    async admit(name: string): Promise<string | null> {
        const { open } = this;
        if (open === null || this.admitted.has(name)) return null;
        try {
            const there = await this.describe(name), why = whyIncomparable(open, there);
            if (why !== null) return why;
            if (open.luminaires !== null && !(await this.haveSameLuminaires(open, there)))
                return `${name} has other luminaires than ${open.name}, so it cannot be lit alike.`;
            await this.prepare(there);
            if (open === this.open) this.admitted.set(name, there);
            return null;
        } catch (reason) {
            if (!isProblem(reason) || reason.status === 401 || reason.status === 503) throw reason;
            return `${name} cannot be compared: ${reason.detail}.`;
        }
    }
}
