// Which lamp lights this point: one adjoint request for an element, then every lighting is read off it without another.
import { Newest } from "lambert-light";
import { fill, make } from "../../base/dom.ts";
import { count, percent, numberText } from "../../base/numbers.ts";
import type { OpenScene, Page } from "../../app/page.ts";
import { emittersOf, type Quantity } from "../../daemon/api.ts";
import { channelWeights } from "../../picture/field.ts";
import { partsOf, type Gradient } from "../../state/shares.ts";
import { quantityShown, unitOf } from "../../state/state.ts";

interface Asked {
    scene: string;
    element: number;
    quantity: Quantity;
}

const LINES_MOST = 12;

/** Answers that are kept: one of a dense sky has some thousand numbers. */
const KNOWN_MOST = 100;

export class Shares {
    readonly element = make("section", { class: "shares" });
    private readonly head = make("h2", { class: "sub" }, "Which lamp lights this point");
    private readonly body = make("div", {});
    /** Answers by what was asked for, of this scene. */
    private known = new Map<string, Gradient>();
    private of: OpenScene | null = null;
    private readonly asker: Newest<Asked, Gradient>;
    /** What was asked for last: the picture may change before it is answered. */
    private wanted = "";

    constructor(private readonly page: Page, private readonly isSeen: () => boolean) {
        const { store, scene, tell } = page;
        this.element.append(this.head, this.body);
        this.asker = new Newest((asked) => this.ask(asked), () => this.draw(), (reason) => {
            this.wanted = "";
            tell.fail(reason);
        }, 1);
        scene.on("scene", () => this.draw());
        scene.on("field", () => this.draw());
        store.listen((now, before) => {
            if (now.pins !== before.pins || now.view !== before.view || now.lighting !== before.lighting) this.draw();
        });
    }

    /** The last pin, of the quantity shown. */
    private get asked(): Asked | null {
        const { pins, scene, view } = this.page.store.now, element = pins[pins.length - 1];
        return element === undefined
            ? null
            : { scene, element, quantity: quantityShown(view) };
    }

    private async ask(asked: Asked): Promise<Gradient> {
        const { known } = this, key = JSON.stringify(asked), there = known.get(key);
        // It may have been answered while this request waited.
        if (there !== undefined) return there;
        const { description } = this.page.scene.now as OpenScene, { channels } = description;
        const gradient = (description.emitters?.length ?? 0) > 0
            ? ["emitters", ...(description.luminaires === null ? [] : ["luminaires"])]
            : ["groups", ...(description.sky === null ? [] : ["sky"]),
                ...(description.luminaires === null ? [] : ["luminaires"])];
        const weights = channelWeights(channels);
        const answer = await this.page.ask.api.adjoint(asked.scene, {
            cotangent: { elements: [asked.element], values: [channels === 1 ? 1 : weights] },
            quantity: asked.quantity,
            gradient,
        });
        const [oldest] = known.keys();
        if (known.size >= KNOWN_MOST) known.delete(oldest);
        known.set(key, answer.gradient as Gradient);
        return answer.gradient as Gradient;
    }

    /** A scene that was opened anew may be of another store: nothing of it is known. */
    private take(scene: OpenScene | null): void {
        if (scene === this.of) return;
        this.of = scene;
        this.asker.forget();
        this.wanted = "";
        this.known = new Map();
    }

    draw(): void {
        const { page: { scene: { now: scene, sky }, store: { now } }, asked } = this;
        this.take(scene);
        this.element.hidden = asked === null || scene === null;
        if (!this.isSeen() || asked === null || scene === null) return;
        const key = JSON.stringify(asked), gradient = this.known.get(key);
        if (gradient === undefined) {
            this.body.replaceChildren();
            if (this.wanted !== key) this.asker.want(asked);
            this.wanted = key;
            return;
        }
        const { description, mesh, luminaires } = scene;
        // It is drawn with the picture of a sky that is on its way.
        if (sky.known(now.lighting, description) === undefined) return;
        const parts = partsOf(gradient, now.lighting, description.channels,
            description.groups.map((group) => group.name), emittersOf(description), luminaires?.list ?? [],
            description.sky === null ? null : sky.radiances(now.lighting, description));
        const total = parts.reduce((sum, part) => sum + part.value, 0);
        const group = mesh.groups[mesh.groupOf[asked.element]]?.name ?? "";
        const listed = parts.slice(0, LINES_MOST),
            rest = parts.slice(LINES_MOST).reduce((sum, part) => sum + part.value, 0);
        if (parts.length > LINES_MOST) listed.push({ name: `${parts.length - LINES_MOST} others`, value: rest });
        fill(this.body,
            make("p", {},
                `${group}, element ${count(asked.element)}: ${asked.quantity} ${numberText(total)} ${
                    unitOf(now.view, asked.quantity)
                }`), parts.length === 0 && make("p", { class: "hint" }, "Nothing shines."),
            make("ol", {}, ...listed.map(({ name, value }) => {
                const share = total > 0 ? value / total : 0;
                const bar = make("span", { class: "bar", "aria-hidden": "true" });
                bar.style.inlineSize = `${100 * Math.min(1, Math.max(0, share))}%`;
                return make("li", { "data-part": name },
                    make("span", { class: "row" }, make("span", { class: "grow" }, name),
                        make("span", { class: "figures" },
                            `${percent(share)} · ${numberText(value)} ${unitOf(now.view, asked.quantity)}`)),
                    make("span", { class: "track", "aria-hidden": "true" }, bar));
            })));
    }
}
