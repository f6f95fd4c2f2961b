// The frame of the page: the bar above, the panels beside or below the picture, the line of figures, the banner.
import { button, choice, fill, make } from "../base/dom.ts";
import { count, percent, numberText } from "../base/numbers.ts";
import { headlineOf } from "../daemon/headline.ts";
import type { OpenScene, Page, Scene } from "../app/page.ts";
import { unitShown } from "../state/state.ts";
import type { Panel } from "./panel.ts";

/** What takes less is not told of. */
const LOADING_MS = 300;

export function makeBar({ store, scene, ask, tell }: Page): HTMLElement {
    const scenes = make("div", { class: "scenes" });
    const undo = button("↶", "Undo (Ctrl+Z)", () => store.undo());
    const redo = button("↷", "Redo (Ctrl+Y)", () => store.redo());
    const share = button("Link", "Copy a link to this state", () => {
        void navigator.clipboard?.writeText(location.href).then(() => {
            share.textContent = "Copied";
            setTimeout(() => {
                share.textContent = "Link";
            }, 1500);
        }, () => undefined);
    });
    const theme = button("◐", "Dark or light page", () => {
        const root = document.documentElement;
        const isDark = root.dataset.theme === undefined
            ? matchMedia("(prefers-color-scheme: dark)").matches
            : root.dataset.theme === "dark";
        root.dataset.theme = isDark ? "light" : "dark";
        setBackground(scene);
    });
    const update = (): void => {
        undo.disabled = !store.canUndo;
        redo.disabled = !store.canRedo;
    };
    store.listen(update);
    update();
    const list = (): void => {
        update();
        // The scene that is shown may be served no more.
        const own = store.now.scene, names = scene.all.map((one) => one.name);
        fill(scenes,
            choice("Scene",
                (names.includes(own) || own === "" ? names : [own, ...names]).map((name) => [name, name] as const),
                store.now.scene, (name) => {
                tell.notice = null;
                void ask.open(name, null).catch((reason: unknown) => tell.fail(reason));
            }));
    };
    scene.on("scene", list);
    scene.on("scenes", list);
    document.addEventListener("keydown", (event) => {
        if (!(event.ctrlKey || event.metaKey) || event.altKey) return;
        // Fields of text take their own changes back.
        if (event.target instanceof HTMLInputElement && /^(text|number|password|search)$/.test(event.target.type))
            return;
        const key = event.key.toLowerCase();
        if (key === "z" && !event.shiftKey) store.undo();
        else if (key === "y" || (key === "z" && event.shiftKey)) store.redo();
        else return;
        event.preventDefault();
    });
    return make("header", {}, make("h1", {}, "Lambert"), scenes,
        make("div", { class: "row", role: "group", "aria-label": "State" }, undo, redo, share, theme));
}

/** Takes over the colours of a page that became dark or light. */
export function setBackground(scene: Scene): void {
    scene.setBackground(getComputedStyle(document.documentElement).getPropertyValue("--stage").trim());
}

/** Tabs after the pattern of WAI-ARIA: arrows move between them. */
export function makeDrawer({ scene }: Page, panels: readonly Panel[]): HTMLElement {
    let current = panels[0].id, isChosen = false;
    const tabs = new Map(panels.map((panel) => [panel.id, make("button", {
        type: "button",
        role: "tab",
        id: `tab-${panel.id}`,
        "aria-controls": `panel-${panel.id}`,
        onclick: () => choose(panel.id),
        onkeydown: (event: KeyboardEvent) => move(event, panel.id),
    }, panel.title)]));
    const bodies = new Map(panels.map((panel) => [panel.id, make("div", {
        role: "tabpanel",
        id: `panel-${panel.id}`,
        "aria-labelledby": `tab-${panel.id}`,
        tabindex: 0,
    }, panel.element)]));
    const useful = (): Panel[] => panels.filter((panel) => panel.isUseful?.() ?? true);
    const show = (id: string): void => {
        current = id;
        for (const panel of panels) {
            const tab = tabs.get(panel.id) as HTMLElement, isOn = panel.id === id;
            tab.setAttribute("aria-selected", String(isOn));
            tab.tabIndex = isOn ? 0 : -1;
            (bodies.get(panel.id) as HTMLElement).hidden = !isOn;
        }
    };
    const choose = (id: string): void => {
        isChosen = true;
        show(id);
    };
    const move = (event: KeyboardEvent, id: string): void => {
        const way = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
        if (way === 0) return;
        event.preventDefault();
        const all = useful(), at = all.findIndex((panel) => panel.id === id);
        const next = all[(at + way + all.length) % all.length];
        choose(next.id);
        tabs.get(next.id)?.focus();
    };
    const update = (): void => {
        const all = useful();
        for (const panel of panels) (tabs.get(panel.id) as HTMLElement).hidden = !all.includes(panel);
        const first = all.find((panel) => panel.isFirst?.()) ?? all[0];
        if (!isChosen || !all.some((panel) => panel.id === current)) show(first.id);
    };
    scene.on("scene", update);
    update();
    const drawer = make("aside", { "aria-label": "Panels" },
        make("div", { role: "tablist", "aria-label": "Panels" }, ...tabs.values()),
        make("div", { class: "bodies" }, ...bodies.values()));
    const fold = button("▾", "Fold the panels", () => {
        const folded = document.body.classList.toggle("folded");
        fold.setAttribute("aria-expanded", String(!folded));
        fold.textContent = folded ? "▴" : "▾";
    }, { class: "fold", "aria-expanded": "true" });
    drawer.prepend(fold);
    return drawer;
}

/** Size, error and time: always in sight. */
export function makeStatus({ store, scene, ask }: Page): HTMLElement {
    const size = make("span", {}), error = make("span", {}), time = make("span", { "data-figure": "time" }),
        sun = make("span", {});
    const drawSun = (): void => {
        sun.textContent = scene.isSunSharp ? "sun drawn sharp, numbers have it in tiles" : "";
    };
    scene.on("field", drawSun);
    store.listen(drawSun);
    const drawError = (): void => {
        const { description } = scene.now as OpenScene;
        if (scene.certificate !== null) {
            error.textContent = `certified: no number is off by more than ${numberText(scene.certificate.bound, 2)} ${
                unitShown(store.now.view)
            }`;
            return;
        }
        const headline = headlineOf(description.error, ask.wanted()?.emission ?? null);
        error.textContent = headline === null
            ? "error not measured"
            : `error ${percent(headline.stated)}${headline.coarse ? ", coarse" : ""}`;
        error.title = headline === null
            ? description.reason
            : `Of the light that surfaces reflect: ${percent(headline.rest)} by operator and form factors, ${
                headline.mesh > 0 ? `${percent(headline.mesh)} by the mesh` : "that of the mesh is not known"
            }. ${
                headline.coarse
                    ? `precompute with ${
                        headline.mesh > headline.rest ? "--mesh-error .05" : "--quality high"
                    } lowers it. `
                    : ""
            }${description.reason}`;
    };
    scene.on("field", drawError);
    scene.on("scene", () => {
        const { description } = scene.now as OpenScene;
        drawError();
        size.textContent = `${count(description.elements)} elements · ${description.kind}`;
    });
    scene.on("timing", ({ roundTrip, solve }) => {
        time.textContent = solve === null
            ? `answer ${numberText(roundTrip, 2)} ms`
            : `solve ${numberText(solve, 2)} ms, answer ${numberText(roundTrip, 2)} ms`;
    });
    return make("footer", { "aria-label": "Figures" }, size, error, time, sun);
}

/** Tells that the daemon is gone, or of a request that failed. */
export function makeBanner({ scene, tell }: Page): HTMLElement {
    const banner = make("div", { class: "banner", role: "status", "aria-live": "polite", hidden: true });
    const close = button("×", "Close this note", () => {
        tell.notice = null;
        show(null);
    });
    const show = (text: string | null): void => {
        banner.hidden = text === null;
        // A note is no fault, and stays until it is closed.
        const isNote = text !== null && text === tell.notice;
        banner.classList.toggle("note", isNote);
        const now = banner.firstChild?.textContent ?? null;
        if (now !== text || isNote !== banner.contains(close))
            fill(banner, make("span", {}, text ?? ""), isNote && close);
    };
    tell.on("lost", show);
    tell.on("found", () => show(tell.notice));
    scene.on("scene", () => show(tell.notice));
    tell.on("problem", show);
    scene.on("field", () => {
        if (!tell.isLost) show(tell.notice);
    });
    return banner;
}

/** Tells that a scene is on its way, if that takes a while. */
export function makeLoading({ scene }: Page): HTMLElement {
    const note = make("p", { class: "loading", role: "status", hidden: true });
    let timer = 0;
    const update = (name: string | null): void => {
        clearTimeout(timer);
        if (name === null) note.hidden = true;
        else timer = window.setTimeout(() => {
                note.textContent = `Loading ${name || "the scene"} …`;
                note.hidden = false;
            }, LOADING_MS);
    };
    scene.on("loading", update);
    update("");
    return note;
}

/** Asks for a token, which is kept as long as this tab. */
export function makeTokenDialog({ ask, tell }: Page, again: () => void): HTMLDialogElement {
    const field = make("input", { type: "password", autocomplete: "off", required: true, "aria-label": "Token" });
    const dialog = make("dialog", { "aria-label": "A token is needed" }, make("form", {
        method: "dialog",
        onsubmit: () => {
            ask.api.token = field.value.trim();
            field.value = "";
            again();
        },
    }, make("p", {}, "This daemon asks for a token. It is kept until this tab is closed."), field,
        make("button", { type: "submit" }, "Go on")));
    tell.on("token", () => {
        if (!dialog.open) dialog.showModal();
    });
    return dialog;
}
