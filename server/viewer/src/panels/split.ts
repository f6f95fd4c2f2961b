// The line on the picture between A and B, and the legend of their difference.
import { make } from "../base/dom.ts";
import { clamp, numberText } from "../base/numbers.ts";
import { toHex } from "../base/colour.ts";
import type { Page } from "../app/page.ts";
import { changeColour } from "../picture/changes.ts";
import { unitShown } from "../state/state.ts";

/** Parts of the width that a key moves the line by. */
const STEP = 0.01, LEAP = 0.1;

/** A slider over the whole picture, with the names of its sides. */
export function splitLine({ store }: Page): { element: HTMLElement; name(a: string, b: string): void } {
    const left = make("span", { class: "side left" }), right = make("span", { class: "side right" });
    const line = make("div", {
        class: "split",
        role: "slider",
        tabindex: 0,
        "aria-label": "Line between A and B",
        "aria-orientation": "horizontal",
        "aria-valuemin": 0,
        "aria-valuemax": 100,
        onpointerdown: (event: PointerEvent) => {
            line.setPointerCapture(event.pointerId);
            line.focus();
            event.preventDefault();
        },
        onpointermove: (event: PointerEvent) => {
            if (!line.hasPointerCapture(event.pointerId)) return;
            const { left: from, width } = (element.parentElement as HTMLElement).getBoundingClientRect();
            move((event.clientX - from) / width);
        },
        onkeydown: (event: KeyboardEvent) => {
            const now = store.now.compare?.split ?? 0.5;
            const to: { [key: string]: number } = {
                ArrowLeft: now - STEP,
                ArrowDown: now - STEP,
                ArrowRight: now + STEP,
                ArrowUp: now + STEP,
                PageDown: now - LEAP,
                PageUp: now + LEAP,
                Home: 0,
                End: 1,
            };
            if (to[event.key] === undefined) return;
            event.preventDefault();
            move(to[event.key]);
        },
    });
    const element = make("div", { class: "compared", hidden: true }, left, right, line);
    const move = (to: number): void => {
        const { now } = store;
        if (now.compare === null) return;
        store.change({ ...now, compare: { ...now.compare, split: Number(clamp(to, 0, 1).toFixed(4)) } }, "split");
    };
    const update = (): void => {
        const { compare } = store.now;
        element.hidden = compare === null || compare.how !== "split";
        if (compare === null) return;
        const share = clamp(compare.split, 0, 1), percent = Math.round(100 * share);
        line.style.left = `${100 * share}%`;
        line.setAttribute("aria-valuenow", String(percent));
        line.setAttribute("aria-valuetext", `${percent} % of the width is A`);
    };
    store.listen((now, before) => {
        if (now.compare !== before.compare) update();
    });
    return {
        element,
        name: (a, b) => {
            left.textContent = `A: ${a}`;
            right.textContent = `B: ${b}`;
        },
    };
}

/** The ramp of differences, blue where B is darker and red where it is brighter. */
export function changeLegend({ store }: Page): { element: HTMLElement; set(most: number): void } {
    const ramp = make("canvas", { width: 256, height: 1, class: "ramp", "aria-hidden": "true" });
    const context = ramp.getContext("2d") as CanvasRenderingContext2D;
    for (let x = 0; x < 256; x++) {
        context.fillStyle = toHex(changeColour((2 * x) / 255 - 1));
        context.fillRect(x, 0, 1, 1);
    }
    const low = make("span", {}), high = make("span", {});
    const element = make("div", { class: "changes", hidden: true, "data-figure": "changes" }, make("div", {}, "B − A"),
        ramp, make("div", { class: "ends" }, low, make("span", {}, "0"), high));
    const update = (): void => {
        element.hidden = store.now.compare?.how !== "difference";
    };
    store.listen(update);
    return {
        element,
        set: (most) => {
            low.textContent = `−${numberText(most)}`;
            high.textContent = `+${numberText(most)} ${unitShown(store.now.view)}`;
        },
    };
}
