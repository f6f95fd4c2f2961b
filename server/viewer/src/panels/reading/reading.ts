// The panel of readings: what the light is at a point, in a group, over an area.
import { choice, make } from "../../base/dom.ts";
import type { Page } from "../../app/page.ts";
import type { Panel } from "../panel.ts";
import { sensorCard } from "../sensor_card.ts";
import { Groups } from "./groups.ts";
import { Histogram } from "./histogram.ts";
import { Judge } from "./judge.ts";
import { addLegend } from "./legend.ts";
import { Pins } from "./pins.ts";
import { Pointer } from "./pointer.ts";
import { Shares } from "./shares.ts";

const SHOWN = [
    ["light", "Radiosity, as the eye sees it"],
    ["radiosity", "Radiosity B, false colour"],
    ["irradiance", "Irradiance H, false colour"],
    ["indirect", "Indirect, false colour"],
] as const;

export function readingPanel(page: Page): Panel {
    const element = make("div", { class: "reading" });
    const { store, scene } = page;
    let isSeen = false;
    const seen = (): boolean => isSeen;
    const pointer = new Pointer(page, seen);
    const pins = new Pins(page, seen), shares = new Shares(page, seen), groups = new Groups(page, seen);
    const histogram = new Histogram(page, seen), judge = new Judge(page, seen);
    addLegend(page);
    const shown = choice("Shows", SHOWN, "light", (what) => {
        const { now } = store;
        store.change({ ...now, view: what === "light"
            ? { ...now.view, picture: "light" }
            : { ...now.view, picture: "false", quantity: what, range: null } });
    });
    const update = (): void => {
        const { view } = store.now;
        (shown.querySelector("select") as HTMLSelectElement).value = view.picture === "light" ? "light" : view.quantity;
    };
    scene.on("scene", update);
    store.listen((now, before) => {
        if (now.view !== before.view) update();
    });
    element.append(shown, make("div", { class: "row" }, pointer.keys), sensorCard(page), pins.element, shares.element,
        judge.element, histogram.element, groups.element);
    new IntersectionObserver((entries) => {
        isSeen = entries[entries.length - 1].isIntersecting;
        if (!isSeen) {
            scene.hover(null);
            return;
        }
        for (const part of [pins, shares, judge, histogram, groups]) part.draw();
        pins.want();
        groups.want();
    }).observe(element);
    return { id: "reading", title: "Reading", element };
}
