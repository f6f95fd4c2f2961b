// Holds the state, tells of its changes, and takes them back.
import type { State } from "./state.ts";

type Listener = (now: State, before: State) => void;

/** Changes with one tag that follow each other within this time are one step of undo: keys that are pressed again and
 * again. */
const ONE_STEP_MS = 1500;
const STEPS_MOST = 200;

export class Store {
    private readonly listeners = new Set<Listener>();
    private past: State[] = [];
    private future: State[] = [];
    private lastTag: string | null = null;
    private lastTime = 0;
    private held = false;

    constructor(private state: State) {}

    get now(): State {
        return this.state;
    }

    /** Calls a listener after each change; the function that is returned ends that. */
    listen(listener: Listener): () => void {
        this.listeners.add(listener);
        return () => this.listeners.delete(listener);
    }

    /** Makes a change that undo takes back. Changes of one tag in a row are one step. */
    change(to: State, tag: string | null = null): void {
        const time = performance.now();
        const joins = tag !== null && tag === this.lastTag && (this.held || time - this.lastTime < ONE_STEP_MS);
        if (!joins) this.past.push(this.state);
        if (this.past.length > STEPS_MOST) this.past.shift();
        this.future = [];
        this.lastTag = tag;
        this.lastTime = time;
        this.set(to);
    }

    /** A pointer is down, or up again: what it drags meanwhile is one step, however slowly, and another drag another
     * one. */
    hold(is: boolean): void {
        if (this.held !== is) this.lastTag = null;
        this.held = is;
    }

    /** Makes a change that is no step of undo: the camera, what the page finds out by itself. */
    settle(to: State): void {
        this.set(to);
    }

    get canUndo(): boolean {
        return this.past.length > 0;
    }

    get canRedo(): boolean {
        return this.future.length > 0;
    }

    undo(): void {
        const to = this.past.pop();
        if (to === undefined) return;
        this.future.push(this.state);
        this.jump(to);
    }

    redo(): void {
        const to = this.future.pop();
        if (to === undefined) return;
        this.past.push(this.state);
        this.jump(to);
    }

    /** Another scene begins without steps to take back. */
    restart(to: State): void {
        this.past = [];
        this.future = [];
        this.lastTag = null;
        this.set(to);
    }

    private jump(to: State): void {
        this.lastTag = null;
        // Steps do not move the camera.
        this.set({ ...to, view: { ...to.view, camera: this.state.view.camera } });
    }

    private set(to: State): void {
        const before = this.state;
        if (to === before) return;
        this.state = to;
        for (const listener of [...this.listeners]) listener(to, before);
    }
}
