// The panel of readings: what the light is at a point, in a group, over an area.
import { choice, make } from "../../base/dom.ts";
import type { App } from "../../app/app.ts";
import type { Panel } from "../panel.ts";
import { Groups } from "./groups.ts";
import { Histogram } from "./histogram.ts";
import { Judge } from "./judge.ts";
import { addLegend } from "./legend.ts";
import { Pins } from "./pins.ts";
import { Pointer } from "./pointer.ts";
import { Shares } from "./shares.ts";

export function readingPanel(app: App): Panel {
    const element = make("div", { class: "reading" });
    let isSeen = false;
    const seen = (): boolean => isSeen;
    const pointer = new Pointer(app, seen);
    const pins = new Pins(app, seen), shares = new Shares(app, seen), groups = new Groups(app, seen);
    const histogram = new Histogram(app, seen), judge = new Judge(app, seen);
    addLegend(app);
    const shown = choice("Shows", [["light", "Radiosity, as the eye sees it"], ["radiosity",
        "Radiosity B, false colour"], ["irradiance", "Irradiance H, false colour"], ["indirect",
        "Indirect, false colour"]], "light", (what) => {
        const { now } = app.store;
        app.store.change({ ...now, view: what === "light"
            ? { ...now.view, picture: "light" }
            : { ...now.view, picture: "false", quantity: what, range: null } });
    });
    const update = (): void => {
        const { view } = app.store.now;
        (shown.querySelector("select") as HTMLSelectElement).value = view.picture === "light" ? "light" : view.quantity;
    };
    app.on("scene", update);
    app.store.listen((now, before) => {
        if (now.view !== before.view) update();
    });
    element.append(shown, make("div", { class: "row" }, pointer.keys), pins.element, shares.element, judge.element,
        histogram.element, groups.element);
    new IntersectionObserver((entries) => {
        isSeen = entries[entries.length - 1].isIntersecting;
        if (!isSeen) {
            app.hover(null);
            return;
        }
        for (const part of [pins, shares, judge, histogram, groups]) part.draw();
        pins.want();
        groups.want();
    }).observe(element);
    return { id: "reading", title: "Reading", element };
}
