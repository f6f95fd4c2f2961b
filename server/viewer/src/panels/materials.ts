// Reflectances of groups, which make a variant of the scene where the daemon allows it; and the variants that there
// are.
import type { LambertError } from "lambert-light";
import { fromHex, toHex } from "../base/colour.ts";
import { button, fill, make } from "../base/dom.ts";
import { isProblem, type Api } from "../daemon/api.ts";
import type { OpenScene, Page } from "../app/page.ts";
import type { MeshGroup } from "../picture/glb.ts";
import { baseOf, checkReflectances, type Reflectances } from "../state/variants.ts";
import type { Panel } from "./panel.ts";

/** A variant that is not ready after this time is left to itself. */
const PATIENCE_MS = 120_000;

const pause = (ms: number): Promise<void> =>
    new Promise((resolve) => {
        setTimeout(resolve, ms);
    });

function reflectancesOf({ mesh: { groups }, description: { channels } }: OpenScene): Reflectances {
    const values = ({ reflectance }: MeshGroup): number[] => (channels === 3 ? [...reflectance] : [reflectance[0]]);
    return Object.fromEntries(groups.map((group) => [group.name, values(group)]));
}

/** As the daemon takes them: one number where there is one. */
function plain(all: Reflectances): { [group: string]: number | number[] } {
    return Object.fromEntries(Object.entries(all).map(([name, of]) => [name, of.length === 1 ? of[0] : of]));
}

/** Waits for a variant that is being made; false: it takes too long. */
async function isServed(api: Api, path: string): Promise<boolean> {
    const start = performance.now();
    for (let wait = 100;; wait = Math.min(2000, 1.5 * wait)) {
        if (await api.isServed(path)) return true;
        if (performance.now() - start > PATIENCE_MS) return false;
        await pause(wait);
    }
}

export function materialsPanel({ store, scene, ask, tell }: Page): Panel {
    const rows = make("div", {}), variants = make("div", {}),
        said = make("p", { role: "status", "aria-live": "polite" });
    const name = make("input", { type: "text", value: "variant-1", maxlength: 60,
        "aria-label": "Name of the variant" });
    let draft: Reflectances = {}, isBusy = false;
    const base = (): string => baseOf(store.now.scene, scene.all.map((one) => one.name));
    const draw = (): void => {
        const loaded = scene.now;
        if (loaded === null) return;
        draft = {};
        const { channels } = loaded.description;
        fill(rows, ...loaded.mesh.groups.map((group) =>
            groupRow(group, channels, (to) => {
                draft[group.name] = to;
            })
        ));
    };
    const tries = async (what: () => Promise<void>): Promise<void> => {
        if (isBusy) return;
        isBusy = true;
        try {
            await what();
        } catch (reason) {
            said.textContent = isProblem(reason) ? inWords(reason) : "";
            if (!isProblem(reason) || reason.status === 401) tell.fail(reason);
        } finally {
            isBusy = false;
        }
    };
    const build = async (): Promise<void> => {
        const { now } = store, loaded = scene.now, variant = name.value.trim();
        if (loaded === null) return;
        // A variant begins from its store, so one of a variant has all of its own reflectances.
        const own = now.scene === base() ? {} : reflectancesOf(loaded);
        const groups = { ...own, ...draft }, wrong = checkReflectances(variant, groups);
        if (wrong !== null) {
            said.textContent = wrong;
            return;
        }
        said.textContent = `${variant} is being built …`;
        const from = base(), path = await ask.api.vary(from, variant, plain(groups));
        if (path !== null && !(await isServed(ask.api, path))) {
            said.textContent = `${variant} is not ready after two minutes. `
                + "It is listed here once it is, when the page is opened again.";
            return;
        }
        await ask.scenes();
        said.textContent = `${from}@${variant} is ready.`;
    };
    const open = (to: string): Promise<void> => tries(() => ask.open(to, { ...store.now, scene: to, compare: null }));
    const compare = (to: string): void => {
        const { now } = store;
        store.change({ ...now, compare: { how: "split", split: 0.5, lighting: null, ...now.compare, scene: to } });
    };
    const remove = (variant: string): Promise<void> =>
        tries(async () => {
            const from = base(), { now } = store;
            await ask.api.vary(from, variant.slice(from.length + 1), null);
            if (now.compare?.scene === variant) store.change({ ...now, compare: null });
            await ask.scenes();
            if (store.now.scene === variant) await ask.open(from, { ...store.now, scene: from });
            said.textContent = `${variant} is gone.`;
        });
    const drawVariants = (): void => {
        const from = base(), now = store.now.scene, known = scene.all.filter((one) => one.name.startsWith(`${from}@`));
        fill(variants, known.length > 0 && make("h2", {}, `Variants of ${from}`),
            now !== from && make("div", { class: "row" }, button(`Back to ${from}`, null, () => void open(from))),
            ...known.map(({ name }) => {
                const disabled = name === now;
                return make("div", { class: "row", role: "group", "aria-label": name },
                    make("span", { class: "grow" }, name.slice(from.length + 1)),
                    button("Open", null, () => void open(name), { disabled }),
                    button("Compare", null, () => compare(name), { disabled }),
                    button("Delete", null, () => void remove(name)));
            }));
    };
    scene.on("scene", () => {
        draw();
        drawVariants();
    });
    scene.on("scenes", drawVariants);
    const submit = (event: Event): void => {
        event.preventDefault();
        void tries(build);
    };
    const form = make("form", { onsubmit: submit },
        make("div", { class: "row" }, name, make("button", { type: "submit" }, "Make variant"),
            button("Reset", "The reflectances of the open scene", draw)));
    return {
        id: "materials",
        title: "Materials",
        element: make("div", {},
            make("p", { class: "hint" },
                "Mean reflectance of each group. Changes make a variant beside the scene; groups that stay as they are keep their own."),
            rows, form, said, variants),
    };
}

/** A refusal in plain words; the daemon's own say which option it lacks. */
function inWords(problem: LambertError & { status: number }): string {
    const lead: { [status: number]: string } = {
        403: "This daemon does not allow that",
        404: "It is not there any more",
        409: "This store cannot have variants",
        422: "That is no variant",
        429: "There are as many variants as the daemon keeps",
        501: "This daemon cannot do that yet",
    };
    const start = lead[problem.status];
    return start === undefined ? problem.detail : `${start}: ${problem.detail}.`;
}

/** One number for stores of one channel, red, green and blue with a swatch for three. */
function groupRow(group: MeshGroup, channels: number, change: (to: number[]) => void): HTMLElement {
    const count = channels === 3 ? 3 : 1, letters = count === 3 ? ["red", "green", "blue"] : ["reflectance"];
    const now = group.reflectance.slice(0, count).map((v) => Number(v.toPrecision(4)));
    const fields = letters.map((letter, c) =>
        make("input", {
            type: "number",
            min: 0,
            max: 0.999,
            step: "any",
            value: String(now[c]),
            "aria-label": `${group.name}: ${letter}`,
            class: "narrow",
            onchange: () => {
                now[c] = fields[c].value === "" ? NaN : Number(fields[c].value);
                paint();
                change([...now]);
            },
        })
    );
    const swatch = make("input", {
        type: "color",
        "aria-label": `${group.name}: colour`,
        oninput: () => {
            // The brightest colour of a screen is 1, which no material reaches.
            fromHex(swatch.value).forEach((v, c) => {
                now[c] = Math.min(0.98, Number(v.toPrecision(4)));
            });
            fields.forEach((field, c) => {
                field.value = String(now[c]);
            });
            change([...now]);
        },
    });
    const paint = (): void => {
        if (now.every(Number.isFinite)) swatch.value = toHex(now);
    };
    paint();
    return make("fieldset", { class: "material" }, make("legend", {}, group.name),
        make("div", { class: "row" }, count === 3 && swatch, ...fields));
}
