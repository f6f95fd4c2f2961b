// Puts the parts of the page together.
import { Api } from "../daemon/api.ts";
import { SceneSky } from "../daylight/scene_sky.ts";
import { firstState } from "../state/state.ts";
import { Store } from "../state/store.ts";
import type { Page } from "./page.ts";
import { Recovery } from "./recovery.ts";
import { Requests } from "./requests.ts";
import { Shown } from "./shown.ts";

export class App implements Page {
    readonly store = new Store(firstState);
    readonly scene: Shown;
    readonly ask: Requests;
    readonly tell: Recovery;

    constructor(canvas: HTMLCanvasElement) {
        const { store } = this, api = new Api(), fail = (reason: unknown): void => this.tell.fail(reason);
        this.scene = new Shown(canvas, store, new SceneSky(api, store, fail));
        this.ask = new Requests(api, store, this.scene, { fail, answered: () => this.tell.answered() },
            (why) => this.tell.tell("incomparable", why));
        this.tell = new Recovery(store, this.scene, this.ask);
    }
}
