// How far the numbers can be trusted: the error of this lighting and of the store, how it was made, a certificate on
// request.
import { floatsToHalves, Newest, readNpy } from "lambert-light";
import { fill, make, button } from "../base/dom.ts";
import { count, percent, numberText } from "../base/numbers.ts";
import { isProblem, wordsOf, type Description, type ErrorFigures, type GroupErrors } from "../daemon/api.ts";
import type { OpenScene, Page } from "../app/page.ts";
import { Field } from "../picture/field.ts";
import type { Wanted } from "../state/request.ts";
import { unitShown } from "../state/state.ts";
import type { Panel } from "./panel.ts";

/** Errors and certificates are asked for this long after the last answer, so that a drag costs neither. */
const REST_MS = 400;

/** Groups whose errors are asked for; a scene of more has those of the first. */
const GROUPS_MOST = 100;

const LIGHTS: { [name: string]: string } = {
    lights: "The scene's own lamps",
    single: "One bright element",
    random: "All elements at random",
    whole: "One group, evenly",
    sky: "A sky alone",
};

interface OwnError {
    stated?: number | null;
    coarse?: boolean;
    advice?: string;
    relative_mean?: number | null;
    indirect_mean?: number | null;
    light?: string;
    from?: string;
    mesh?: number;
    groups?: { [name: string]: { mean: number | null; elements: number | null } };
}

export function trustPanel(page: Page): Panel {
    const { scene, ask } = page;
    const own = make("div", {}), ofAll = make("div", {});
    const certificate = certifier(page);
    const asker = new Newest<Wanted, OwnError | null>(
        async (wanted) => {
            const names = scene.now?.mesh.groups.slice(0, GROUPS_MOST).map((group) => group.name) ?? [];
            if (wanted.emission === null || names.length === 0) return null;
            const answer = await ask.api.answer(wanted.scene, {
                emission: wanted.emission,
                quantity: wanted.quantity,
                reduce: { groups: names, with: ["mean", "max"] },
            });
            return (answer.error ?? null) as OwnError | null;
        },
        (error) => fill(own, ...ownError(error)),
        (reason) => {
            asked = "";
            fill(own, make("p", { class: "hint" }, wordsOf(reason)));
        },
        1,
    );
    // Nobody is asked for figures that nobody sees.
    let timer = 0, asked = "", isSeen = false;
    const rest = (): void => {
        clearTimeout(timer);
        timer = window.setTimeout(() => {
            const wanted = ask.wanted();
            if (wanted === null || !ask.isIdle) return;
            if (isSeen && asked !== JSON.stringify(wanted)) {
                asked = JSON.stringify(wanted);
                asker.want(wanted);
            }
            certificate.rested(wanted);
        }, REST_MS);
    };
    scene.on("field", rest);
    const figures = make("section", { "aria-label": "Error of this lighting" },
        make("h2", {}, "Error of this lighting"), own);
    new IntersectionObserver((entries) => {
        isSeen = entries.some((entry) => entry.isIntersecting);
        if (isSeen) rest();
    }).observe(figures);
    scene.on("scene", () => {
        asked = "";
        asker.forget();
        fill(own);
        fill(ofAll, ...ofStore((scene.now as OpenScene).description));
    });
    return {
        id: "trust",
        title: "Trust",
        element: make("div", {}, figures, certificate.element, ofAll),
    };
}

function share(value: number | null | undefined): string {
    return value === null || value === undefined || !Number.isFinite(value) ? "–" : percent(value);
}

function table(label: string, head: readonly string[], rows: readonly (readonly string[])[]): HTMLElement {
    return make("div", { class: "wide", tabindex: 0, role: "region", "aria-label": label },
        make("table", { "aria-label": label },
            make("thead", {}, make("tr", {}, ...head.map((text) => make("th", { scope: "col" }, text)))),
            make("tbody", {},
                ...rows.map(([name, ...cells]) =>
                    make("tr", {}, make("th", { scope: "row" }, name), ...cells.map((text) => make("td", {}, text)))
                ))));
}

/** The error of the lighting that is shown, as the daemon states it. */
function ownError(error: OwnError | null): Node[] {
    if (error === null) return [make("p", { class: "hint" }, "This store states no error for this lighting.")];
    if (error.from === "others")
        return [
            make("p", { class: "hint" },
                "This store was built for light from some groups alone; others shine, too, and no error is known for these."),
        ];
    if (error.relative_mean === undefined)
        return [make("p", { class: "hint" }, `This store states no error for this lighting: ${error.advice ?? ""}.`)];
    const of = error.light === "own"
        ? ""
        : error.light === "lights"
        ? " (measured for the scene's own lamps)"
        : " (measured for single elements)";
    const out: Node[] = [
        make("p", { "data-figure": "own-error" },
            `Means of groups are off by up to ${share(error.indirect_mean)} of the reflected light, ${
                share(error.relative_mean)
            } of all light${of}.`),
    ];
    if (error.mesh !== undefined)
        out.push(
            make("p", {},
                `One value for each element leaves ${
                    share(error.mesh)
                } of the reflected light; a finer mesh alone lowers that.`),
        );
    const rows = Object.entries(error.groups ?? {}).map(([name, group]) =>
        [name, share(group.mean), share(group.elements)] as const
    );
    if (rows.length > 0) {
        out.push(table("Error of this lighting by group", ["Group", "Its mean", "Its elements"], rows),
            make("p", { class: "hint" }, "Shares of the light that each group reflects."));
    }
    return out;
}

function ofStore(description: Description): Node[] {
    const figures = Object.entries(description.error ?? {})
        .filter((entry): entry is [string, ErrorFigures] => LIGHTS[entry[0]] !== undefined && !Array.isArray(entry[1]));
    const groups = description.error?.by_group;
    const out: Node[] = [make("h2", {}, "Error of the store")];
    if (figures.length === 0)
        out.push(make("p", { class: "hint" }, description.name.includes("@")
            ? "Errors were measured under the reflectances of the store, not under those of this variant."
            : "No error was measured."));
    else out.push(
            table("Error of the store by kind of light", ["Light", "of reflected", "of all"],
                figures.map(([name, f]) => [LIGHTS[name], share(f.total_indirect_mean), share(f.total_relative_mean)])),
        );
    if (Array.isArray(groups) && groups.length > 0)
        out.push(
            make("details", {}, make("summary", {}, "By group that is lit"),
                table("Error of the store by group", ["Group", "All shine", "Near light", "Far light"],
                    (groups as GroupErrors[]).map((g) => [g.name, share(g.uniform), share(g.near), share(g.far)])),
                make("p", { class: "hint" }, "Error of the group's mean as a share of the light it reflects.")),
        );
    out.push(make("h2", {}, "How it was made"),
        make("p", {}, `${description.method ?? description.kind}: ${reasonOf(description)}`),
        list(description.provenance ?? {}));
    const report = Object.entries(description.report ?? {}).filter(([, value]) => value !== null);
    if (report.length > 0)
        out.push(make("details", {}, make("summary", {}, "Figures of the method"), list(Object.fromEntries(report))));
    return out;
}

/** The reason without the method's name before it. */
function reasonOf(description: Description): string {
    const reason = description.reason ?? "no reason is stated";
    return reason.startsWith(`${description.method}: `) ? reason.slice(description.method.length + 2) : reason;
}

function list(values: { [name: string]: unknown }): HTMLElement {
    return make("dl", {}, ...Object.entries(values).flatMap(([name, value]) => [
        make("dt", {}, name.replaceAll("_", " ")),
        make("dd", {},
            typeof value === "number" ? (Number.isInteger(value) ? count(value) : numberText(value)) : String(value)),
    ]));
}

/** Asks for a bound on the error of every number, and shows the refined values in place of the others. */
function certifier({ store, scene, ask, tell }: Page): { element: HTMLElement; rested(wanted: Wanted): void } {
    const tolerance = make("input", { type: "number", min: 0, step: "any", value: "0.001",
        "aria-label": "Tolerance, a share of the most reflected light" });
    const said = make("p", { role: "status", "aria-live": "polite", "data-figure": "certificate" });
    const wish = (value: number | null): void => store.change({ ...store.now, tolerance: value });
    const start = button("Certify", null, () => {
        const value = Number(tolerance.value);
        if (!(value > 0)) {
            said.textContent = "A tolerance is a number above 0, such as 0.001.";
            return;
        }
        certified = "";
        wish(value);
        const wanted = ask.wanted();
        if (wanted !== null) rested(wanted);
    });
    const stop = button("As stored", "Show the answer of the store again", () => {
        wish(null);
        ask.shown(true);
    }, { disabled: true });
    let certified = "", onItsWay: AbortController | null = null;
    const rested = (wanted: Wanted): void => {
        const wished = store.now.tolerance, key = JSON.stringify([wanted, wished]);
        if (wished === null || wanted.emission === null || (key === certified && scene.certificate !== null))
            return;
        if (key === certified && onItsWay !== null) return;
        certified = key;
        onItsWay?.abort();
        const mine = onItsWay = new AbortController();
        said.textContent = "Refining …";
        const start = performance.now();
        ask.api.floats(wanted.scene, { emission: wanted.emission, quantity: wanted.quantity, tolerance: wished },
            mine.signal).then((answer) => {
                // Another lighting may be shown meanwhile.
                if (mine.signal.aborted || JSON.stringify([ask.wanted(), store.now.tolerance]) !== key) return;
                const { data, shape } = readNpy(answer.file);
                const bound = (answer.certificate ?? NaN) * wanted.scale, iterations = answer.iterations ?? 0;
                scene.certify(new Field(floatsToHalves(data as Float32Array), shape, wanted.scale), { bound, iterations,
                    solve: answer.solveMs });
                said.textContent =
                    `Certified: no number of this answer is off by more than ${numberText(bound, 2)} ${
                        unitShown(store.now.view)
                    }. `
                    + `${iterations} multiplications by the form factors, ${
                        numberText(answer.solveMs ?? performance.now() - start, 2)
                    } ms. The picture rounds to 11 bits.`;
            }, (reason: unknown) => {
                if (mine.signal.aborted) return;
                store.settle({ ...store.now, tolerance: null });
                said.textContent = isProblem(reason) && reason.status === 422
                    ? `Not certified: ${reason.detail}.`
                    : wordsOf(reason);
                if (!isProblem(reason) || reason.status === 401) tell.fail(reason);
            }).finally(() => {
                if (onItsWay === mine) onItsWay = null;
            });
    };
    store.listen((now, before) => {
        if (now.tolerance === before.tolerance) return;
        stop.disabled = now.tolerance === null;
        if (now.tolerance !== null) tolerance.value = String(now.tolerance);
        else {
            onItsWay?.abort();
            onItsWay = null;
            certified = "";
            said.textContent = "";
        }
    });
    scene.on("field", () => {
        if (scene.certificate === null && onItsWay === null) said.textContent = "";
    });
    scene.on("scene", () => {
        certified = "";
        stop.disabled = store.now.tolerance === null;
    });
    return {
        rested,
        element: make("section", { "aria-label": "Certificate" }, make("h2", {}, "Certificate"),
            make("p", { class: "hint" },
                "Refines the answer until a bound on its error holds for every element. The store has to keep its form factors."),
            make("div", { class: "row" }, make("label", { class: "field" }, make("span", {}, "Tolerance"), tolerance),
                start, stop), said),
    };
}
