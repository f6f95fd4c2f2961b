// All that the page asks the daemon for: scenes, the values that are shown, the sharp sun, and what is compared.
import type { Api } from "../daemon/api.ts";
import { Comparable } from "../state/comparable.ts";
import type { Wanted } from "../state/request.ts";
import type { State } from "../state/state.ts";
import type { Store } from "../state/store.ts";
import { Asking, type Outcome } from "./asking.ts";
import { Opening } from "./opening.ts";
import type { Ask, OpenScene, Side } from "./page.ts";
import { Sensing } from "./sensing.ts";
import { SharpSun } from "./sharp_sun.ts";
import type { Shown } from "./shown.ts";

export class Requests implements Ask {
    private readonly comparable: Comparable;
    private readonly asking: Asking;
    private readonly sharp: SharpSun;
    private readonly sensing: Sensing;
    private readonly opening: Opening;

    /** `incomparable` is told why a scene cannot be compared. */
    constructor(readonly api: Api, private readonly store: Store, private readonly scene: Shown,
        private readonly outcome: Outcome, private readonly incomparable: (why: string) => void)
    {
        const fail = (reason: unknown): void => outcome.fail(reason);
        this.comparable = new Comparable((name) => api.describe(name),
            (description) => scene.sky.prepareOther(description), (name) => api.luminaires(name));
        this.asking = new Asking(api, store, scene, this.comparable, outcome);
        this.sharp = new SharpSun(store, scene, (wanted) => this.asking.solve(wanted), fail);
        this.sensing = new Sensing(api, store, scene, () => this.wanted(), fail);
        this.opening = new Opening(api, store, scene, (opened) => this.take(opened));
        store.listen((now, before) => this.follow(now, before));
    }

    get isIdle(): boolean {
        return this.asking.isIdle && this.sharp.isIdle && this.sensing.isIdle;
    }

    wanted(side: Side = 0): Wanted | null {
        return this.asking.wanted(side);
    }

    shown(again = false): void {
        this.asking.ask(again);
        this.sharp.ask(again);
    }

    sense(isSeen: boolean): void {
        this.sensing.look(isSeen);
    }

    async open(name: string, given: State | null): Promise<void> {
        if (!(await this.opening.open(name, given))) return;
        this.scene.opened();
        this.shown();
    }

    async scenes(): Promise<void> {
        this.scene.list(await this.api.scenes());
    }

    async admit(name: string): Promise<boolean> {
        const why = await this.comparable.admit(name);
        if (why !== null) this.incomparable(why);
        return why === null;
    }

    private take(opened: OpenScene): void {
        this.scene.now = opened;
        this.comparable.reset(opened.description);
        this.asking.forget(0);
        this.asking.forget(1);
        this.sharp.forget();
        this.sensing.forget();
    }

    private follow(now: State, before: State): void {
        if (now.compare === null && before.compare !== null) this.asking.forget(1);
        const other = now.compare?.scene ?? null;
        if (this.comparable.isNew(other) && other !== null)
            this.takeOther(other).catch((reason: unknown) => this.outcome.fail(reason));
        this.shown();
    }

    /** Takes in the scene of a comparison that came with a link or by undoing; ends one that cannot be. */
    private async takeOther(name: string): Promise<void> {
        const { store } = this;
        if (await this.admit(name)) this.shown();
        else if (store.now.compare?.scene === name) store.settle({ ...store.now, compare: null });
    }
}
