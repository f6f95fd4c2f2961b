// Starts the page.
import { App } from "./app/app.ts";
import type { Page } from "./app/page.ts";
import { make } from "./base/dom.ts";
import { withPoint } from "./base/numbers.ts";
import { makeBanner, makeBar, makeDrawer, makeLoading, makeStatus, makeTokenDialog,
    setBackground } from "./panels/frame.ts";
import { comparePanel } from "./panels/compare.ts";
import { exportPanel } from "./panels/export.ts";
import { lightsPanel } from "./panels/lights.ts";
import { emittersPanel } from "./panels/emitters.ts";
import { viewPanel } from "./panels/view.ts";
import { materialsPanel } from "./panels/materials.ts";
import { trustPanel } from "./panels/trust.ts";
import type { PanelMaker } from "./panels/panel.ts";
import { sensorsPanel } from "./panels/sensors.ts";
import { readingPanel } from "./panels/reading/reading.ts";
import { skyPanel } from "./panels/sky.ts";
import { fromFragment, toFragment } from "./state/link.ts";
import "./style.css";

/** The panels, in the order of their tabs. */
const panelMakers: readonly PanelMaker[] = [
    lightsPanel,
    skyPanel,
    emittersPanel,
    viewPanel,
    readingPanel,
    sensorsPanel,
    trustPanel,
    comparePanel,
    materialsPanel,
    exportPanel,
];

/** The fragment is written this long after the last change. */
const LINK_MS = 300;

/** Browsers drop a comma of a number: 12,5 would be 125 without a word. */
function takeCommas(): void {
    document.addEventListener("beforeinput", (event) => {
        const { target, data } = event;
        if (!(target instanceof HTMLInputElement) || target.type !== "number" || !data?.includes(",")) return;
        event.preventDefault();
        document.execCommand("insertText", false, withPoint(data));
    });
}

function start(): void {
    takeCommas();
    const canvas = make("canvas", { tabindex: 0,
        "aria-label":
            "The scene. Arrow keys turn it, plus and minus move, F shows all of it, R reads values at a cross." });
    const frame = make("main", {}, canvas);
    // The canvas needs a place before its size is asked for.
    document.body.append(frame);
    let app: App;
    try {
        app = new App(canvas);
    } catch (reason) {
        frame.replaceChildren(
            make("p", { class: "banner", role: "alert" },
                `This browser cannot draw the scene, which needs WebGL 2 (${
                    reason instanceof Error ? reason.message : String(reason)
                }).`),
        );
        return;
    }
    frame.append(makeBanner(app), makeLoading(app));
    document.body.prepend(makeBar(app));
    document.body.append(makeDrawer(app, panelMakers.map((makePanel) => makePanel(app))), makeStatus(app),
        makeTokenDialog(app, () => void begin(app)));
    setBackground(app.scene);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => setBackground(app.scene));
    holdSteps(app);
    keepLink(app);
    // For tests, and for those who look into the page by the browser's console.
    if (new URLSearchParams(location.search).has("inspect")) Object.assign(window, { lambert: app });
    void begin(app);
}

/** A slider may tell of its last value after its pointer is up. */
function holdSteps({ store }: Page): void {
    const release = (): void => void setTimeout(() => store.hold(false));
    window.addEventListener("pointerdown", () => store.hold(true), true);
    for (const end of ["pointerup", "pointercancel", "blur"]) window.addEventListener(end, release, true);
}

async function begin(app: App): Promise<void> {
    try {
        app.scene.all = await app.ask.api.scenes();
        const { all } = app.scene, given = fromFragment(location.hash);
        const name = all.find((scene) => scene.name === given?.scene)?.name ?? all[0]?.name;
        if (name === undefined) throw new Error("The daemon serves no scene.");
        app.tell.notice = given === null && location.hash.length > 1
            ? `This link cannot be read; this is ${name} as it comes.`
            : given !== null && given.scene !== "" && given.scene !== name
            ? `The link asks for the scene ${given.scene}, which this daemon does not serve; this is ${name}.`
            : null;
        await app.ask.open(name, given !== null && given.scene === name ? given : null);
    } catch (reason) {
        app.tell.fail(reason);
        if (app.tell.isLost)
            app.tell.on("found", () => {
                if (app.scene.now === null) void begin(app);
            });
    }
}

function keepLink(app: App): void {
    let timer = 0, written = "";
    app.store.listen(() => {
        clearTimeout(timer);
        timer = window.setTimeout(() => {
            if (app.scene.now === null) return;
            written = toFragment(app.store.now, (light) => app.scene.sky.source.momentOf(light));
            history.replaceState(null, "", written);
        }, LINK_MS);
    });
    window.addEventListener("hashchange", () => {
        if (location.hash !== written) void begin(app);
    });
}

start();
