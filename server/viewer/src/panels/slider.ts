// A slider with the number beside it: either changes the value.
import { make, unique } from "../base/dom.ts";
import { numberText } from "../base/numbers.ts";

export interface SliderOptions {
    label: string;
    unit?: string;
    least: number;
    most: number;
    step?: number;
    /** Equal ways on the slider are equal factors. */
    log?: boolean;
    change: (value: number) => void;
}

export interface Slider {
    element: HTMLElement;
    set(value: number): void;
    /** There is no value; the field has this word in its place. */
    unset(word: string): void;
    setMost(most: number): void;
}

const STEPS = 1000;

export function slider(options: SliderOptions, now: number): Slider {
    const { least, log = false } = options;
    let { most } = options;
    // Places on a logarithmic slider: 0 is 0, then three decades up to the most.
    const toPlace = (value: number): number => {
        if (!log) return value;
        return value <= 0 ? 0 : Math.max(1, Math.round(STEPS * (1 + Math.log10(value / most) / 3)));
    };
    const toValue = (place: number): number => (!log ? place : place <= 0 ? 0 : most * 10 ** (3 * (place / STEPS - 1)));
    const id = unique("slider");
    const range = make("input", {
        type: "range",
        id,
        min: log ? 0 : least,
        max: log ? STEPS : most,
        step: log ? 1 : options.step ?? "any",
        oninput: () => {
            const value = Number(toValue(Number(range.value)).toPrecision(4));
            box.value = numberText(value).replaceAll(",", "");
            options.change(value);
        },
    });
    const box = make("input", {
        type: "number",
        min: least,
        step: "any",
        "aria-label": `${options.label}${options.unit === undefined ? "" : ` in ${options.unit}`}`,
        onchange: () => {
            const value = Number(box.value);
            if (box.value === "" && box.placeholder !== "") return;
            if (box.value === "" || !Number.isFinite(value) || value < least) {
                set(current);
                return;
            }
            current = value;
            range.value = String(toPlace(value));
            options.change(value);
        },
    });
    let current = now;
    const set = (value: number): void => {
        current = value;
        box.placeholder = "";
        if (document.activeElement !== box) box.value = numberText(value).replaceAll(",", "");
        if (document.activeElement !== range || Math.abs(toValue(Number(range.value)) - value) > 1e-3 * Math.abs(value))
            range.value = String(toPlace(value));
    };
    set(now);
    const element = make("div", { class: "slider" }, make("label", { for: id }, options.label), range, box,
        options.unit !== undefined && make("span", { class: "unit" }, options.unit));
    return {
        element,
        set,
        unset: (word) => {
            if (document.activeElement === box) return;
            box.value = "";
            box.placeholder = word;
        },
        setMost: (value) => {
            most = value;
            if (!log) range.max = String(value);
            set(current);
        },
    };
}
