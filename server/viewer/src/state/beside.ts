// The scenes that can be compared with the open one. Nothing is asked of any other.
import { Problem, type Description } from "../daemon/api.ts";
import { whyUnlike } from "./alike.ts";

export class Beside {
    private open: Description | null = null;
    private readonly alike = new Map<string, Description>();
    private taken: string | null = null;

    constructor(private readonly describe: (name: string) => Promise<Description>,
        /** Fetches what the lighting of a scene needs. */
        private readonly prepare: (description: Description) => Promise<void>)
    {}

    /** Another scene is open. */
    reset(open: Description): void {
        this.open = open;
        this.alike.clear();
        this.taken = null;
    }

    /** A scene that was admitted. */
    get(name: string): Description | undefined {
        return this.alike.get(name);
    }

    /** True once for each scene that a comparison names: it is to be admitted. */
    isNew(name: string | null): boolean {
        if (this.open === null || name === this.taken) return false;
        this.taken = name;
        return name !== null;
    }

    /** Why a scene cannot be compared with the open one, as a sentence; null: it is admitted. */
    async admit(name: string): Promise<string | null> {
        const { open } = this;
        if (open === null || this.alike.has(name)) return null;
        try {
            const there = await this.describe(name), why = whyUnlike(open, there);
            if (why !== null) return why;
            await this.prepare(there);
            if (open === this.open) this.alike.set(name, there);
            return null;
        } catch (reason) {
            if (!(reason instanceof Problem) || reason.status === 401 || reason.status === 503) throw reason;
            return `${name} cannot be compared: ${reason.message}.`;
        }
    }
}
