// Goes on after what went wrong: a daemon that is away or busy, a token that is missing, a store that was replaced or
// is gone.
import { Events } from "../base/events.ts";
import { isLost, isProblem, wordsOf, type Description } from "../daemon/api.ts";
import { Watch } from "../daemon/watch.ts";
import type { Store } from "../state/store.ts";
import { Replaced } from "./asking.ts";
import type { Ask, News, Tell } from "./page.ts";
import type { Shown } from "./shown.ts";

/** Statuses of requests that fitted the store that was there before. */
const UNFIT = [400, 404, 422];

/** After the last answer, and after the last look, the page looks if the store is still the same, ms. */
const LOOK_MS = 1000, LOOKED_MS = 5000;

export class Recovery extends Events<News> implements Tell {
    notice: string | null = null;
    /** What the daemon did not do, as a sentence, until its next answer. */
    problem: string | null = null;
    private readonly watch: Watch;
    /** A scene that was chosen while the daemon was away. */
    private missed: string | null = null;
    private looked = -LOOKED_MS;
    private lookTimer = 0;

    constructor(private readonly store: Store,
        private readonly scene: Pick<Shown, "now" | "loading" | "exposure" | "load" | "tell">,
        private readonly ask: Ask)
    {
        super();
        this.watch = new Watch(() => ask.api.isReady(), () => this.tell("lost", this.watch.why), () => this.goOn());
        document.addEventListener("visibilitychange", () => {
            if (!document.hidden) this.look(0);
        });
    }

    get isLost(): boolean {
        return this.watch.isLost;
    }

    /** An answer has come, and the picture shows it. */
    answered(): void {
        this.watch.find();
        this.problem = null;
        this.look();
    }

    /** Does what helps after a request that failed, and tells of it. */
    fail(reason: unknown): void {
        if (reason instanceof DOMException && reason.name === "AbortError") return;
        const { scene, scene: { loading } } = this;
        scene.load(null);
        if (isLost(reason)) {
            if (loading !== null && loading !== "" && scene.now !== null) this.missed = loading;
            this.watch.lose("The daemon does not answer. This page asks again each second and goes on by itself.");
            return;
        }
        if (isProblem(reason) && reason.status === 401) {
            this.tell("token");
            return;
        }
        if (isProblem(reason) && reason.status === 503) {
            this.watch.lose(`The daemon is busy: ${reason.detail}. This page goes on by itself.`);
            return;
        }
        if (reason instanceof Replaced
            || (isProblem(reason) && UNFIT.includes(reason.status) && loading === null))
        {
            this.renew().then((is) => {
                if (!is) this.complain(reason);
            }, (why: unknown) => this.complain(why));
            return;
        }
        this.complain(reason, loading === null);
    }

    /** Looks a while after the last call, once nothing is asked for, if the store is still the one that is shown: its
     * answers alone do not tell. */
    private look(after = LOOK_MS): void {
        clearTimeout(this.lookTimer);
        this.lookTimer = window.setTimeout(() => {
            const { scene, ask } = this;
            if (scene.now === null || scene.loading !== null || this.isLost || !ask.isIdle || document.hidden) return;
            this.looked = performance.now();
            this.renew().catch((reason: unknown) => {
                if (scene.loading === null) this.complain(reason);
                else this.fail(reason);
            });
        }, Math.max(after, this.looked + LOOKED_MS - performance.now()));
    }

    /** `isShown`: the request was for the scene that is shown. */
    private complain(reason: unknown, isShown = true): void {
        if (isLost(reason)) return this.fail(reason);
        const name = this.scene.now?.description.name ?? "";
        if (isProblem(reason) && reason.status === 404 && isShown && name !== "") {
            this.problem = `The daemon serves ${name} no more; the picture is its last. Choose another scene above.`;
            void this.ask.scenes().catch(() => undefined);
            return this.tell("problem", this.problem);
        }
        this.problem = isProblem(reason)
            ? `The daemon did not do what this page asked for (${reason.status}): ${reason.detail}`
            : wordsOf(reason);
        this.tell("problem", this.problem);
        this.scene.tell("scenes");
    }

    /** Opens the scene anew if its store is another one by now: as it comes, or in its present state where the mesh is
     * the same. */
    private async renew(): Promise<boolean> {
        const { ask, scene: { now: scene, exposure } } = this, name = scene?.description.name ?? "";
        if (scene === null) return false;
        const description = await ask.api.describe(name);
        if (scene !== this.scene.now) return true;
        if (JSON.stringify(description) === JSON.stringify(scene.description)) return false;
        this.notice = `The store of ${name} was replaced; this is the new one.`;
        const { now } = this.store;
        await ask.open(name, haveOneMesh(description, scene.description)
            ? { ...now, view: { ...now.view, exposure: exposure.anew(now.view) } }
            : null);
        return true;
    }

    /** After the daemon was away. */
    private goOn(): void {
        const { ask, missed } = this;
        this.tell("found");
        if (this.scene.now === null) return;
        this.missed = null;
        void ask.scenes().catch(() => undefined);
        if (missed !== null) void ask.open(missed, null).catch((reason: unknown) => this.fail(reason));
        else this.renew().then((is) => {
                if (!is) ask.shown(true);
            }, (reason: unknown) => this.complain(reason));
    }
}

function haveOneMesh(a: Description, b: Description): boolean {
    const mesh = (of: Description): string => JSON.stringify([of.provenance?.geometry_hash, of.groups, of.channels]);
    return mesh(a) === mesh(b);
}
