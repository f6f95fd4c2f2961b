// The elements that are pinned, and the one under the pointer, with all that is known of them. What the picture shows
// follows each answer at once; radiosity and irradiance come exactly, by JSON of these elements alone.
import { Newest } from "lambert-light";
import { button, fill, make } from "../../base/dom.ts";
import { count, numberText } from "../../base/numbers.ts";
import type { Page } from "../../app/page.ts";
import type { Quantity } from "../../daemon/api.ts";
import { channelWeights } from "../../picture/field.ts";
import { glassText } from "../../picture/glb.ts";
import { emissionOf, quantityShown, unitOf } from "../../state/state.ts";
import type { Wanted } from "../../state/request.ts";

/** By element, a number for each channel. */
interface Exact {
    elements: number[];
    B: number[][];
    H: number[][];
}

/** Exact numbers are asked for this often while a slider is dragged. */
const PACE_MS = 200;

/** [C][m], or [m] of one channel, as m rows of C numbers times a scale. */
function rowsOf(answer: unknown, count: number, scale: number): number[][] {
    const all = answer as number[] | number[][];
    const channels = Array.isArray(all[0]) ? all as number[][] : [all as number[]];
    return Array.from({ length: count }, (_, k) => channels.map((row) => row[k] * scale));
}

export class Pins {
    readonly element = make("div", { class: "pins" });
    private exact = new Map<number, { B: number[]; H: number[] }>();
    private timer = 0;
    private last = 0;
    private readonly asker: Newest<{ wanted: Wanted; elements: number[] }, Exact>;

    constructor(private readonly page: Page, private readonly isSeen: () => boolean) {
        const { store, scene, tell } = page;
        this.asker = new Newest(
            async ({ wanted, elements }) => this.ask(wanted, elements),
            (answer) => {
                this.exact = new Map(
                    answer.elements.map((element, k) => [element, { B: answer.B[k], H: answer.H[k] }]),
                );
                this.draw();
            },
            (reason) => tell.fail(reason),
            1,
        );
        const again = (): void => {
            this.draw();
            this.want();
        };
        for (const event of ["field", "hover"] as const) scene.on(event, again);
        scene.on("scene", () => {
            this.asker.forget();
            this.exact.clear();
            again();
        });
        store.listen((now, before) => {
            if (now.pins !== before.pins || now.view.unit !== before.view.unit) again();
        });
    }

    /** The pins, and the element under the pointer where it is none of them. */
    private get listed(): number[] {
        const { scene: { hovered }, store: { now: { pins } } } = this.page;
        return hovered === null || pins.includes(hovered) ? [...pins] : [...pins, hovered];
    }

    /** Asks for exact numbers, now and then while much changes and always after the last change. */
    want(): void {
        if (this.timer !== 0) return;
        this.timer = window.setTimeout(() => {
            this.timer = 0;
            this.last = performance.now();
            const wanted = this.page.ask.wanted(), elements = this.listed;
            if (wanted !== null && elements.length > 0 && this.isSeen()) this.asker.want({ wanted, elements });
        }, Math.max(40, this.last + PACE_MS - performance.now()));
    }

    private async ask({ scene, emission, scale }: Wanted, elements: number[]): Promise<Exact> {
        const dark = (): number[][] =>
            elements.map(() => new Array<number>(this.page.scene.now?.description.channels ?? 1).fill(0));
        if (emission === null) return { elements, B: dark(), H: dark() };
        const [B, H] = await Promise.all(
            (["radiosity", "irradiance"] as const).map(async (quantity) =>
                rowsOf((await this.page.ask.api.answer(scene, { emission, quantity, select: { elements } }))[quantity],
                    elements.length, scale)
            ),
        );
        return { elements, B, H };
    }

    draw(): void {
        if (!this.isSeen()) return;
        const { store, scene } = this.page;
        const { pins } = store.now;
        const forget = (pin: number): void =>
            store.change({ ...store.now, pins: store.now.pins.filter((other) => other !== pin) });
        const hovered = scene.hovered !== null && !pins.includes(scene.hovered) ? scene.hovered : null;
        // Buttons stay where they are while numbers change, so that a click meets them.
        const cards = [...this.element.querySelectorAll<HTMLElement>(".pin")];
        const wanted = [...pins.map(String), ...(hovered === null ? [] : ["hover"])];
        if (this.element.childElementCount === 0 || cards.map((card) => card.dataset.pin).join() !== wanted.join()) {
            fill(this.element, pins.length === 0 && hovered === null
                && make("p", { class: "hint" },
                    "Click or tap the picture to pin an element; Shift adds another, a second click removes it."),
                ...wanted.map((pin) =>
                    make("section", { class: "pin", "data-pin": pin },
                        make("div", { class: "row" }, make("h2", { class: "sub grow" }),
                            pin !== "hover" && button("×", `Forget element ${pin}`, () => forget(Number(pin)))),
                        make("table", {}))
                ));
        }
        this.element.querySelectorAll<HTMLElement>(".pin").forEach((card) => {
            this.fillCard(card, card.dataset.pin === "hover" ? hovered as number : Number(card.dataset.pin),
                card.dataset.pin === "hover");
        });
    }

    private fillCard(card: HTMLElement, element: number, isHovered: boolean): void {
        const { scene: { now: scene, fields: [field] }, store: { now } } = this.page;
        if (scene === null || element >= scene.mesh.elements) return;
        const { mesh, description: { channels, emitters } } = scene;
        const { name: group = "", glass = null } = mesh.groups[mesh.groupOf[element]] ?? {};
        (card.querySelector("h2") as HTMLElement).textContent = `${
            isHovered ? "Under the pointer: " : ""
        }${group}, element ${count(element)}, ${numberText(mesh.area[element])} m²${
            glass === null ? "" : `, ${glassText(glass)}`
        }`;
        const exact = this.exact.get(element), emission = emissionOf(now.lighting, channels)[group] ?? 0;
        const E = (emitters?.length ?? 0) > 0
            ? null
            : typeof emission === "number"
            ? new Array<number>(channels).fill(emission)
            : emission;
        const shown = quantityShown(now.view), live = field?.at(element);
        const rows: [string, string, Quantity, number[] | null | undefined][] = [
            ["B", "Radiosity", "radiosity", exact?.B ?? (shown === "radiosity" ? live : undefined)],
            ["H", "Irradiance", "irradiance", exact?.H ?? (shown === "irradiance" ? live : undefined)],
            ["E", "Emission", "radiosity", E],
        ];
        const weights = channelWeights(channels),
            names = channels === 3 ? ["red", "green", "blue"] : Array.from({ length: channels }, (_, c) => `${c + 1}`);
        fill(card.querySelector("table") as HTMLElement,
            make("thead", {},
                make("tr", {}, make("td", {}),
                    ...(channels > 1 ? [...names, channels === 3 ? "lum." : "mean"] : ["value"]).map((name) =>
                        make("th", { scope: "col", title: name === "lum." ? "luminance" : null }, name)
                    ))),
            make("tbody", {},
                ...rows.map(([letter, name, of, values]) =>
                    make("tr", { "data-row": letter },
                        make("th", { scope: "row", title: name }, `${name} ${letter} `,
                            make("small", {}, unitOf(now.view, of))), ...(channels > 1
                            ? [...(values ?? new Array<number>(channels).fill(NaN)), values?.reduce((sum, v, c) =>
                                sum + v * weights[c], 0) ?? NaN]
                            : [values?.[0] ?? NaN]).map((value) => make("td", {}, numberText(value))))
                )));
    }
}
