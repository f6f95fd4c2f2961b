// Takes what is shown out of the page: a picture, the numbers, the request as a command or a program.
import { readNpy } from "lambert-light";
import { button, make, tick } from "../base/dom.ts";
import { csvOf, sensorLinesOf } from "../base/csv.ts";
import type { Page } from "../app/page.ts";
import { drawLegend, SIDE_MOST, snapshot, type Legend } from "../picture/snapshot.ts";
import { vectorOf, valuesOf } from "../state/sensors.ts";
import { curlCommand, plainRequest, pythonProgram, type PlainRequest } from "../state/snippets.ts";
import { quantityShown, unitOf, unitShown } from "../state/state.ts";
import type { Store } from "../state/store.ts";
import type { Panel } from "./panel.ts";

const QUANTITIES = { radiosity: "Radiosity B", irradiance: "Irradiance H", indirect: "Indirect light" };

/** What was to be saved is not shown any more. */
class Changed extends Error {}

export function exportPanel(page: Page): Panel {
    const { tell, scene } = page;
    const said = make("p", { role: "status", "aria-live": "polite" });
    const tries = (what: () => Promise<string>): void => {
        said.textContent = "Working …";
        what().then((text) => {
            said.textContent = text;
        }, (reason: unknown) => {
            said.textContent = reason instanceof Changed ? reason.message : "";
            if (!(reason instanceof Changed)) tell.fail(reason);
        });
    };
    const numbers = make("div", {}, make("h2", {}, "Numbers"),
        make("p", { class: "hint" }, "Of every element, asked for again in single precision."),
        make("div", { class: "row" }, button("Save CSV", null, () => tries(() => saveCsv(page))),
            button("Save NPY", null, () => tries(() => saveNpy(page)))));
    const sensors = make("div", { hidden: true },
        make("p", { class: "hint" }, "Of every sensor: its set, place, the way that it faces, and the light there."),
        make("div", { class: "row" }, button("Save sensors as CSV", null, () => tries(() => saveSensors(page)))));
    scene.on("scene", () => {
        sensors.hidden = (scene.now?.sensors?.names.length ?? 0) === 0;
    });
    return {
        id: "export",
        title: "Export",
        element: make("div", {}, picturePart(page, tries, said), numbers, sensors, said, requestPart(page)),
    };
}

function picturePart(page: Page, tries: (what: () => Promise<string>) => void, said: HTMLElement): HTMLElement {
    const { store, scene } = page;
    const size = (label: string, value: number): HTMLInputElement =>
        make("input", { type: "number", class: "narrow", min: 16, max: SIDE_MOST, step: 1, value: String(value),
            "aria-label": label });
    const width = size("Width in pixels", 1920), height = size("Height in pixels", 1080);
    const legend = tick("With a legend of colours", true, () => undefined);
    const save = async (): Promise<string> => {
        const [w, h] = [width, height].map((field) => Math.round(Number(field.value)));
        for (const side of [w, h])
            if (!(side >= 16 && side <= SIDE_MOST)) return `A side of the picture has 16 to ${SIDE_MOST} pixels.`;
        // A large picture takes seconds without a graphics card; the word on it is to be seen before.
        await new Promise((resolve) => {
            setTimeout(resolve, 50);
        });
        const { now } = store, [a, b] = scene.fields;
        const canvas = await snapshot(scene.stage, w, h, now.compare?.split ?? 0.5, (share) => {
            if (store.now !== now || scene.fields[0] !== a || scene.fields[1] !== b)
                throw new Changed("The picture was changed while it was drawn; save it again.");
            said.textContent = `Drawing, ${Math.round(100 * share)} % …`;
        });
        const colours = legendOf(page);
        if (colours !== null && (legend.querySelector("input") as HTMLInputElement).checked)
            drawLegend(canvas, colours);
        const blob = await new Promise<Blob | null>((resolve) => canvas.toBlob(resolve, "image/png"));
        if (blob === null) throw new Error(`the browser makes no picture of ${w} × ${h} pixels`);
        download(blob, `${fileName(page.store)}.png`);
        return `Saved ${w} × ${h} pixels.`;
    };
    const update = (): void => {
        legend.hidden = legendOf(page) === null;
    };
    store.listen(update);
    update();
    return make("section", { "aria-label": "PNG" }, make("h2", {}, "Picture"),
        make("div", { class: "row" }, width, make("span", { "aria-hidden": "true" }, "×"), height,
            make("span", { class: "hint" }, "pixels"),
            button("Window", "The size of the picture on this screen", () => {
                width.value = String(scene.stage.canvas.width);
                height.value = String(scene.stage.canvas.height);
            })), legend, make("div", { class: "row" }, button("Save PNG", null, () => tries(save))));
}

/** Null where the picture is that of the eye. */
function legendOf({ store, scene }: Page): Legend | null {
    const { view, compare } = store.now, title = `${QUANTITIES[view.quantity]}, ${unitShown(view)}`;
    if (compare !== null && compare.how === "difference" && scene.fields[1] !== null) {
        const most = scene.stage.uniforms.change.value as number;
        return { title: `B − A, ${unitShown(view)}`, low: -most, high: most, log: false, palette: "change" };
    }
    if (view.picture !== "false") return null;
    const range = scene.stage.uniforms.range.value as { x: number; y: number };
    return { title, low: range.x, high: range.y, log: scene.stage.uniforms.is_log.value === true,
        palette: view.palette };
}

/** The request for what is shown; its numbers are the daemon's own, in the store's unit. */
function request({ store, ask }: Page): PlainRequest | null {
    const wanted = ask.wanted();
    return wanted === null ? null : plainRequest(wanted, store.now.tolerance);
}

/** A name that every system of files takes. */
function fileName(store: Store, what: string = quantityShown(store.now.view)): string {
    const { scene } = store.now;
    return `${scene.replace(/[^\p{L}\p{N}._@-]+/gu, "-").slice(0, 80) || "scene"}-${what}`;
}

async function values(page: Page): Promise<ArrayBuffer> {
    const what = request(page);
    if (what === null) throw new Error("Nothing shines, so there are no numbers to save.");
    return (await page.ask.api.floats(what.scene, what.body)).file;
}

async function saveNpy(page: Page): Promise<string> {
    const file = await values(page), { shape } = readNpy(file);
    download(new Blob([file]), `${fileName(page.store)}.npy`);
    return `Saved an array of ${shape.join(" × ")} numbers.`;
}

async function saveCsv(page: Page): Promise<string> {
    const loaded = page.scene.now, what = request(page);
    const { data } = readNpy(await values(page));
    if (loaded === null || what === null) return "";
    const { mesh, description: { channels } } = loaded, { quantity } = what.body,
        unit = unitOf(page.store.now.view, quantity);
    const channelNames = channels === 3
        ? ["red", "green", "blue"]
        : channels === 1
        ? [""]
        : Array.from({ length: channels }, (_, c) => String(c));
    const names = channelNames.map((name) => `${quantity}${name === "" ? "" : `_${name}`} (${unit})`);
    download(
        new Blob([csvOf(data as Float32Array, names, mesh.groupOf, mesh.groups.map((group) => group.name), mesh.area)],
            { type: "text/csv;charset=utf-8" }),
        `${fileName(page.store)}.csv`,
    );
    return `Saved ${mesh.elements} lines.`;
}

/** The same columns as those of `lambert solve --sensors -o FILE.csv`; of several channels the luminance or their
 * mean. */
async function saveSensors(page: Page): Promise<string> {
    const sensors = page.scene.now?.sensors ?? null, what = request(page);
    if (sensors === null) return "";
    if (what === null) throw new Error("Nothing shines, so there are no numbers to save.");
    const { emission } = what.body,
        { data, shape } = readNpy(
            (await page.ask.api.floats(what.scene, { emission, quantity: "irradiance",
                select: { sensors: sensors.names } })).file,
        );
    const values = valuesOf(sensors, data, shape.length > 1 ? shape[0] : 1, 1);
    const lines = sensors.sets.filter((of) => !of.isProbes).flatMap(({ set, first }) =>
        set.at.map((at, k) => ({ set: set.name, at, axis: vectorOf(set.axis, k) ?? [0, 0, 0],
            value: values[first + k] })
        )
    );
    download(
        new Blob([sensorLinesOf(lines, unitOf(page.store.now.view, "irradiance"))], { type: "text/csv;charset=utf-8" }),
        `${fileName(page.store, "sensors")}.csv`,
    );
    return `Saved ${lines.length} lines.`;
}

function download(blob: Blob, name: string): void {
    const address = URL.createObjectURL(blob), link = make("a", { href: address, download: name });
    document.body.append(link);
    link.click();
    link.remove();
    setTimeout(() => URL.revokeObjectURL(address), 60_000);
}

/** The texts are made when the panel is in sight: a dense sky makes long ones. */
function requestPart(page: Page): HTMLElement {
    const { store, scene, ask } = page;
    const curl = snippet("Command of curl"), python = snippet("Program in Python");
    const hint = make("p", { class: "hint" });
    const part = make("section", { "aria-label": "Request" }, make("h2", {}, "Request"), hint, curl.element,
        python.element);
    let isSeen = false;
    const update = (): void => {
        if (!isSeen || scene.now === null) return;
        const what = request(page), withToken = ask.api.token !== null;
        hint.textContent = what === null
            ? "Nothing shines, so there is nothing to ask for."
            : withToken
            ? "Asks the daemon for what is shown. The token is read from LAMBERT_TOKEN."
            : "Asks the daemon for what is shown.";
        curl.set(what === null ? "" : curlCommand(location.href, what, withToken));
        python.set(what === null ? "" : pythonProgram(location.href, what, withToken));
    };
    new IntersectionObserver((entries) => {
        isSeen = entries.some((entry) => entry.isIntersecting);
        update();
    }).observe(part);
    store.listen((now, before) => {
        if (now.lighting !== before.lighting || now.tolerance !== before.tolerance || now.view !== before.view)
            update();
    });
    scene.on("scene", update);
    // By then the sky of the request is known.
    scene.on("field", update);
    return part;
}

function snippet(label: string): { element: HTMLElement; set(text: string): void } {
    const text = make("textarea", { readonly: true, rows: 6, spellcheck: "false", wrap: "off", "aria-label": label });
    const copy = button("Copy", `Copy: ${label}`, () => {
        const done = (): void => {
            copy.textContent = "Copied";
            setTimeout(() => {
                copy.textContent = "Copy";
            }, 1500);
        };
        // Pages without TLS have no clipboard; the text is then marked, to be copied by hand.
        if (navigator.clipboard === undefined) text.select();
        else navigator.clipboard.writeText(text.value).then(done, () => text.select());
    });
    return {
        element: make("div", {}, make("div", { class: "row" }, make("span", { class: "grow" }, label), copy), text),
        set: (to) => {
            text.value = to;
            copy.disabled = to === "";
        },
    };
}
