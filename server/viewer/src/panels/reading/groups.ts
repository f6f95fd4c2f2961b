// The quantity shown, by group. The mean is the daemon's, by `reduce`: linear, so that its adjoint rows answer it
// whatever the number of elements. Least, largest and uniformity are of the luminance of each element, which the
// picture has.
import { Newest } from "lambert-light";
import { button, fill, make } from "../../base/dom.ts";
import { numberText } from "../../base/numbers.ts";
import type { Page } from "../../app/page.ts";
import { channelWeights } from "../../picture/field.ts";
import { glassText } from "../../picture/glb.ts";
import { figuresOf, type Figures } from "../../picture/scale.ts";
import type { Wanted } from "../../state/request.ts";
import { quantityShown, unitShown } from "../../state/state.ts";

type Column = "name" | "mean" | "min" | "max" | "uniformity";
const COLUMNS: readonly (readonly [Column, string, string])[] = [
    ["name", "Group", "By name"],
    ["mean", "Mean", "By the mean over the area"],
    ["min", "Min", "By the least value"],
    ["max", "Max", "By the largest value"],
    ["uniformity", "U0", "By the uniformity, least over mean"],
];
/** The daemon keeps adjoint rows for so many groups of a request; more cost whole solves, and are taken from the
 * picture. */
const REDUCED_MOST = 64;

interface Line extends Figures {
    name: string;
}

export class Groups {
    readonly element = make("section", { class: "groups" });
    private readonly head = make("h2", { class: "sub" });
    private readonly body = make("tbody", {});
    private readonly heads: HTMLElement[];
    private column: Column = "mean";
    private isUp = false;
    private means = new Map<string, number>();
    private readonly asker: Newest<Wanted, Map<string, number>>;

    constructor(private readonly page: Page, private readonly isSeen: () => boolean) {
        const { store, scene, tell } = page;
        this.asker = new Newest((wanted) => this.ask(wanted), (means) => {
            this.means = means;
            this.draw();
        }, (reason) => tell.fail(reason), 1);
        this.heads = COLUMNS.map(([column, text, label]) =>
            make("th", { scope: "col" }, button(text, label, () => {
                this.isUp = this.column === column ? !this.isUp : column === "name";
                this.column = column;
                this.draw();
            }, { class: "plain" }))
        );
        this.element.append(this.head,
            make("div", { class: "wide" },
                make("table", {}, make("thead", {}, make("tr", {}, ...this.heads)), this.body)));
        scene.on("scene", () => {
            this.asker.forget();
            this.means.clear();
            this.body.replaceChildren();
        });
        scene.on("field", () => {
            this.means.clear();
            this.draw();
            this.want();
        });
        store.listen((now, before) => {
            if (now.view.judged !== before.view.judged || now.view.unit !== before.view.unit) this.draw();
        });
    }

    want(): void {
        const wanted = this.page.ask.wanted();
        if (this.isSeen() && wanted !== null && wanted.emission !== null
            && (this.page.scene.now?.mesh.groups.length ?? 0) <= REDUCED_MOST) this.asker.want(wanted);
    }

    private async ask({ scene, emission, quantity, scale }: Wanted): Promise<Map<string, number>> {
        const groups = this.page.scene.now?.mesh.groups.map((group) => group.name) ?? [];
        const answer = await this.page.ask.api.answer(scene, { emission, quantity,
            reduce: { groups, with: ["mean"] } });
        return new Map(
            Object.entries(answer.groups as { [name: string]: { mean: number | number[] | null } }).map(
                ([name, { mean }]) => {
                    const values = [mean ?? NaN].flat(), weights = channelWeights(values.length);
                    return [name, scale * values.reduce((sum, value, c) => sum + value * weights[c], 0)];
                },
            ),
        );
    }

    private get lines(): Line[] {
        const { now: scene, fields: [field] } = this.page.scene;
        if (scene === null || field === null) return [];
        const lines = scene.mesh.groups.map((group): Line => {
            const figures = figuresOf(field.values, scene.mesh.area, group.counted);
            const mean = this.means.get(group.name) ?? figures.mean;
            return { ...figures, name: group.name, mean, uniformity: mean > 0 ? Math.min(1, figures.min / mean) : NaN };
        });
        const order = (a: Line, b: Line): number => {
            const by = this.column;
            if (by === "name") return a.name.localeCompare(b.name);
            return (Number.isFinite(a[by]) ? a[by] : -Infinity) - (Number.isFinite(b[by]) ? b[by] : -Infinity);
        };
        return lines.sort((a, b) => (this.isUp ? order(a, b) : order(b, a)));
    }

    draw(): void {
        if (!this.isSeen() || this.page.scene.now === null) return;
        const { view } = this.page.store.now, { lines } = this;
        this.head.textContent = `Groups: ${quantityShown(view)}, ${unitShown(view)}`;
        this.heads.forEach((head, i) => {
            if (COLUMNS[i][0] === this.column) head.setAttribute("aria-sort", this.isUp ? "ascending" : "descending");
            else head.removeAttribute("aria-sort");
        });
        // Rows keep their elements, and so the focus, while numbers change and change places.
        const rows = new Map([...this.body.rows].map((row) => [row.dataset.group ?? "", row]));
        const ordered = lines.map((line) => {
            const row = rows.get(line.name) ?? this.makeRow(line.name);
            [line.mean, line.min, line.max].forEach((value, i) => {
                row.cells[i + 1].textContent = numberText(value);
            });
            row.cells[4].textContent = Number.isFinite(line.uniformity) ? line.uniformity.toFixed(2) : "–";
            row.cells[0].querySelector("button")?.setAttribute("aria-pressed", String(line.name === view.judged));
            return row;
        });
        if (ordered.length !== this.body.rows.length || ordered.some((row, i) => row !== this.body.rows[i])) {
            const focused = document.activeElement;
            fill(this.body, ...ordered);
            if (focused instanceof HTMLElement && this.body.contains(focused)) focused.focus();
        }
    }

    private makeRow(name: string): HTMLTableRowElement {
        const mark = button(name, `Mark ${name} in the picture`, () => {
            const { store } = this.page, { view } = store.now;
            store.change({ ...store.now, view: { ...view, judged: view.judged === name ? null : name } });
        }, { class: "plain" });
        const glass = this.page.scene.now?.mesh.groups.find((group) => group.name === name)?.glass ?? null;
        return make("tr", { "data-group": name },
            make("th", { scope: "row" }, mark, glass !== null && make("small", {}, glassText(glass))), make("td", {}),
            make("td", {}), make("td", {}), make("td", {}));
    }
}
