// Two scenes or two lightings of one scene, side by side or as their difference, with the numbers of that.
import { halvesToFloats, readNpy } from "lambert-light";
import { button, choice, fill, make } from "../base/dom.ts";
import { count, percent, numberText } from "../base/numbers.ts";
import type { Page } from "../app/page.ts";
import { changesOf, roundUp, type Changes } from "../picture/changes.ts";
import type { Field } from "../picture/field.ts";
import type { Wanted } from "../state/request.ts";
import type { Compare } from "../state/state.ts";
import type { Store } from "../state/store.ts";
import { changeLegend, splitLine } from "./split.ts";
import type { Panel } from "./panel.ts";

/** The numbers are asked for in single precision this long after the last answer. */
const REST_MS = 400;

/** Names of scenes that are not offered, at most. */
const UNFIT_MOST = 8;

export function comparePanel(page: Page): Panel {
    const { store, scene, ask, tell } = page;
    const line = splitLine(page), legend = changeLegend(page);
    scene.stage.canvas.parentElement?.append(line.element, legend.element);
    const choices = make("div", {}), numbers = make("div", { "data-figure": "compared", "aria-live": "polite" }),
        said = make("p", { role: "status" });
    const unfit = make("p", { class: "hint" });
    const how = choice("Shown as", [["split", "A left, B right of a line"], ["difference", "Difference B − A"]],
        "split", (way) => set({ how: way }));
    const set = (to: Partial<Compare> | null): void => {
        const { now } = store;
        const first: Compare = { how: (how.querySelector("select") as HTMLSelectElement).value as Compare["how"],
            scene: null, lighting: null, split: 0.5 };
        said.textContent = "";
        store.change({ ...now, compare: to === null ? null : { ...first, ...now.compare, ...to } });
    };
    const pick = async (value: string): Promise<void> => {
        const { now } = store, name = value.slice(2);
        if (value === "") set(null);
        else if (value.startsWith("p:"))
            set({ scene: null, lighting: now.presets.find((preset) => preset.name === name)?.lighting ?? null });
        else if (value.startsWith("s:")) {
            said.textContent = "";
            if (await ask.admit(name)) set({ scene: name, lighting: null });
        }
    };
    const draw = (): void => {
        const { now } = store, scenes = scene.all;
        const here = scenes.find((scene) => scene.name === now.scene);
        const others = scenes.filter((scene) =>
            scene.name !== now.scene && scene.elements === here?.elements && scene.channels === here.channels
        );
        const left = scenes.filter((scene) => scene.name !== now.scene && !others.includes(scene)).map((scene) =>
            scene.name
        );
        unfit.hidden = left.length === 0;
        unfit.textContent = `Not offered, as their elements or channels are other ones: ${
            left.slice(0, UNFIT_MOST).join(", ")
        }${left.length > UNFIT_MOST ? " …" : "."}`;
        const chosen = chosenOf(store);
        fill(choices,
            choice("B is", [["", "nothing: no comparison"],
                ...(chosen === "kept" ? [["kept", "the lighting that was kept"] as const] : []),
                ...others.map((scene) => [`s:${scene.name}`, `scene ${scene.name}`] as const),
                ...now.presets.map((preset) => [`p:${preset.name}`, `lighting ${preset.name}`] as const)], chosen,
                (value) => {
                    pick(value).catch((reason: unknown) => tell.fail(reason));
                }));
        how.hidden = now.compare === null;
        (how.querySelector("select") as HTMLSelectElement).value = now.compare?.how ?? "split";
        line.name(now.scene, nameOf(now.compare, chosen));
        if (now.compare === null) fill(numbers);
    };
    scene.on("scene", draw);
    scene.on("scenes", draw);
    tell.on("incomparable", (why) => {
        draw();
        said.textContent = why;
    });
    store.listen((now, before) => {
        if (now.compare !== before.compare || now.presets !== before.presets) draw();
    });
    measure(page, numbers, (changes) => {
        const most = roundUp(changes.high);
        scene.stage.setChange(most);
        legend.set(most);
    });
    const keep = button("Keep this lighting as B", "Keep the lighting that is shown now as B, then change A",
        () => set({ scene: null, lighting: store.now.lighting }));
    return {
        id: "compare",
        title: "Compare",
        element: make("div", {},
            make("p", { class: "hint" },
                "A is what the other panels show. B is another scene with as many elements, or another lighting."),
            choices, said, unfit, make("div", { class: "row" }, keep), how, numbers),
    };
}

/** What the choice shows: a scene, a preset of this very lighting, or what was kept. */
function chosenOf(store: Store): string {
    const { now } = store, { compare } = now;
    if (compare === null) return "";
    if (compare.scene !== null) return `s:${compare.scene}`;
    const preset = now.presets.find(({ lighting }) => JSON.stringify(lighting) === JSON.stringify(compare.lighting));
    return preset === undefined ? "kept" : `p:${preset.name}`;
}

function nameOf(compare: Compare | null, chosen: string): string {
    if (compare === null) return "";
    return chosen === "kept" ? "kept lighting" : chosen.slice(2);
}

const planar = (field: Field): Float32Array => halvesToFloats(field.bits, 0, field.bits.length, field.scale);

/** Finds the figures of what is shown at each answer, and again in single precision when it rests. */
function measure({ store, scene, ask, tell }: Page, place: HTMLElement, found: (changes: Changes) => void): void {
    let timer = 0, turn = 0;
    const show = (changes: Changes, isRough: boolean): void => {
        const { now } = store, loaded = scene.now;
        if (loaded === null) return;
        const { unit } = now.view, { groups, groupOf } = loaded.mesh, group = groups[groupOf[changes.mostAt]].name,
            about = isRough ? "≈ " : "";
        found(changes);
        fill(place,
            make("dl", { "data-rough": isRough ? "yes" : "no" }, make("dt", {}, "Root mean square of B − A"),
                make("dd", { "data-number": changes.rms }, `${about}${numberText(changes.rms)} ${unit}`),
                make("dt", {}, "Largest"),
                make("dd", { "data-number": changes.most },
                    `${about}${changes.most > 0 ? "+" : "−"}${numberText(Math.abs(changes.most))} ${unit} at element ${
                        count(changes.mostAt)
                    } of ${group}`), make("dt", {}, "|B − A| / |A|"),
                make("dd", { "data-number": changes.relative }, `${about}${percent(changes.relative)}`)),
            make("p", { class: "hint" },
                "Weighted by area. The first two are of luminance, the last of all channels."));
    };
    const exact = async (wanted: Wanted): Promise<Float32Array> => {
        const loaded = scene.now, { tolerance } = store.now;
        if (loaded === null || wanted.emission === null)
            return new Float32Array((loaded?.description.channels ?? 0) * (loaded?.mesh.elements ?? 0));
        // A certified A is compared as such.
        const certified = tolerance !== null && scene.certificate !== null && wanted === a;
        const { file } = await ask.api.floats(wanted.scene, { emission: wanted.emission, quantity: wanted.quantity,
            ...(certified ? { tolerance } : {}) });
        return (readNpy(file).data as Float32Array).map((v) => v * wanted.scale);
    };
    let a: Wanted | null = null;
    const rested = async (): Promise<void> => {
        const loaded = scene.now, b = ask.wanted(1), mine = ++turn;
        a = ask.wanted(0);
        if (loaded === null || a === null || b === null || !ask.isIdle) return;
        const [first, second] = await Promise.all([exact(a), exact(b)]);
        if (mine === turn && store.now.compare !== null)
            show(changesOf(first, second, loaded.description.channels, loaded.mesh.area), false);
    };
    scene.on("field", () => {
        const { now: loaded, fields: [first, second] } = scene, { now } = store;
        turn += 1;
        clearTimeout(timer);
        if (loaded === null || now.compare === null || first === null || second === null) return;
        show(changesOf(planar(first), planar(second), loaded.description.channels, loaded.mesh.area), true);
        timer = window.setTimeout(() => {
            rested().catch((reason: unknown) => tell.fail(reason));
        }, REST_MS);
    });
}
