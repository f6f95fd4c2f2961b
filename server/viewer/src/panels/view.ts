// How the picture is drawn: tone, exposure, false colour, cameras. Nothing here costs a request but the quantity.
import { button, choice, fill, make, tick } from "../base/dom.ts";
import { numberText } from "../base/numbers.ts";
import type { Page } from "../app/page.ts";
import type { Description } from "../daemon/api.ts";
import { placeOf } from "../picture/cameras.ts";
import { turned } from "../picture/glb.ts";
import type { KeptView, View } from "../state/state.ts";
import type { Panel } from "./panel.ts";
import { slider } from "./slider.ts";

const QUANTITIES = [["radiosity", "Radiosity B"], ["irradiance", "Irradiance H"], ["indirect", "Indirect"]] as const;

type Camera = NonNullable<Description["cameras"]>[number];

export function viewPanel(page: Page): Panel {
    const { store, scene, ask } = page;
    const change = (to: Partial<View>, tag: string | null = null): void => {
        const { now } = store;
        store.change({ ...now, view: { ...now.view, ...to } }, tag);
    };
    const { view } = store.now;
    const exposure = slider({ label: "Exposure", unit: "EV", least: -16, most: 16, step: 0.1,
        change: (value) => change({ exposure: value, follow: false }, "exposure") }, 0);
    const iso = slider({ label: "Iso-lines", least: 0, most: 20, step: 1,
        change: (value) => change({ isoLines: Math.round(value) }, "iso") }, 0);
    const follow = tick("Exposure follows the light", view.follow,
        (on) => change({ follow: on, exposure: on ? null : store.now.view.exposure }));
    const smooth = tick("Smooth", view.smooth, (on) => change({ smooth: on }));
    const textured = tick("Images of materials", view.textured, (on) => change({ textured: on }));
    const log = tick("Logarithmic", view.log, (on) => change({ log: on }));
    const fields = {
        picture: choice("Picture", [["light", "As the eye sees it"], ["false", "False colour"]], view.picture,
            (picture) => change({ picture, range: null })),
        quantity: choice("Quantity", QUANTITIES, view.quantity, (quantity) => change({ quantity, range: null })),
        tone: choice("Tone curve", [["agx", "AgX"], ["aces", "ACES"], ["linear", "Linear"]], view.tone,
            (tone) => change({ tone })),
        palette: choice("Palette", [["viridis", "Viridis"], ["inferno", "Inferno"], ["turbo", "Turbo"]], view.palette,
            (palette) => change({ palette })),
        walk: choice("Camera", [["orbit", "Around the scene"], ["walk", "On foot (W A S D)"]],
            view.walk ? "walk" : "orbit", (way) => change({ walk: way === "walk" })),
    };
    const least = make("input", { type: "number", step: "any", "aria-label": "Least value of the palette" });
    const most = make("input", { type: "number", step: "any", "aria-label": "Largest value of the palette" });
    const setRange = (): void => {
        // An end that is left open is that of the values.
        const low = least.value === "" ? 0 : Number(least.value),
            high = most.value === "" ? scene.exposure.spread.high : Number(most.value);
        change({ range: (least.value !== "" || most.value !== "") && high > low ? [low, high] : null });
    };
    least.addEventListener("change", setRange);
    most.addEventListener("change", setRange);
    const unit = make("p", { class: "hint" });
    const tellUnit = (): void => {
        const isPhotometric = scene.now?.description.lights === "lm";
        unit.textContent = isPhotometric
            ? "The store counts in lm: emission and radiosity are in lm/m², irradiance in lx, skies in cd/m²."
            : "The store counts in W; lambert precompute --lights lm makes one in lm, for lx.";
    };
    const light = make("div", {}, exposure.element, follow,
        button("Expose for this light", null, () => change({ exposure: null })), fields.tone);
    const colour = make("div", {}, fields.quantity, fields.palette, log, iso.element,
        make("div", { class: "row" }, make("span", {}, "Range"), least, most,
            button("Auto", "Range from the values", () => change({ range: null }))));
    const update = (): void => {
        const now = store.now.view;
        exposure.set(now.exposure ?? 0);
        iso.set(now.isoLines);
        for (const [name, field] of Object.entries(fields))
            (field.querySelector("select") as HTMLSelectElement).value = name === "walk"
                ? (now.walk ? "walk" : "orbit")
                : String(now[name as keyof View]);
        const boxes = [[follow, now.follow], [smooth, now.smooth], [textured, now.textured], [log, now.log]] as const;
        for (const [box, on] of boxes)
            (box.querySelector("input") as HTMLInputElement).checked = on;
        if (document.activeElement !== least) least.value = now.range === null ? "" : String(now.range[0]);
        if (document.activeElement !== most) most.value = now.range === null ? "" : String(now.range[1]);
        textured.hidden = (scene.now?.mesh.images.length ?? 0) === 0;
        light.hidden = now.picture !== "light";
        colour.hidden = now.picture !== "false";
    };
    store.listen((now, before) => {
        if (now.view !== before.view) update();
    });
    scene.on("scene", () => {
        update();
        tellUnit();
    });
    scene.on("field", () => {
        least.placeholder = "0";
        most.placeholder = numberText(scene.exposure.spread.high).replaceAll(",", "");
    });
    store.listen((now, before) => {
        // An exposure that was left to the page is found from the next answer.
        if (now.view.exposure === null && before.view.exposure !== null) ask.shown(true);
        else if (now.view.range === null && before.view.range !== null) ask.shown(true);
    });
    update();
    return {
        id: "view",
        title: "View",
        element: make("div", {}, fields.picture, light, colour, smooth, textured, fields.walk, unit,
            button("Fit (F)", "Show the whole scene", () => scene.cameras.fit(true)), keptViews(page)),
    };
}

/** Places of the camera with names: those of the scene file, and those that were kept on the page. */
function keptViews({ store, scene }: Page): HTMLElement {
    const place = make("div", {});
    const name = make("input", { type: "text", placeholder: "Name of this place", "aria-label": "Name of this place",
        maxlength: 60 });
    const keep = (): void => {
        const { now } = store, text = name.value.trim();
        if (text === "") return;
        name.value = "";
        store.change({ ...now,
            views: [...now.views.filter((view) => view.name !== text), { name: text, camera: scene.cameras.now }] });
    };
    const form = make("form", { class: "row", onsubmit: (event: Event) => {
        event.preventDefault();
        keep();
    } }, name, make("button", { type: "submit" }, "Keep"));
    const look = ({ eye, direction, up, fov }: Camera): void => {
        const axis = scene.now?.mesh.up ?? "y";
        scene.cameras.place(placeOf(turned(axis, eye), turned(axis, direction), turned(axis, up), fov), true);
    };
    const forget = (view: KeptView): void => {
        const { now } = store;
        store.change({ ...now, views: now.views.filter((other) => other !== view) });
    };
    const own = (camera: Camera): HTMLElement => {
        const go = (): void => look(camera);
        return make("div", { class: "row" }, button(camera.name, "A camera of the scene", go, { class: "grow" }));
    };
    const kept = (view: KeptView): HTMLElement => {
        const go = (): void => scene.cameras.place(view.camera, true);
        return make("div", { class: "row" }, button(view.name, null, go, { class: "grow" }),
            button("×", `Forget ${view.name}`, () => forget(view)));
    };
    const draw = (): void =>
        fill(place, make("h2", { class: "sub" }, "Places"), ...(scene.now?.description.cameras ?? []).map(own),
            ...store.now.views.map(kept), form);
    store.listen((now, before) => {
        if (now.views !== before.views) draw();
    });
    scene.on("scene", draw);
    draw();
    return place;
}
