// Points at elements: the mouse hovers and clicks, a finger taps, and keys move a cross over the picture.
import { button, make } from "../../base/dom.ts";
import { clamp, numberText } from "../../base/numbers.ts";
import type { Page } from "../../app/page.ts";
import type { Luminaire } from "../../daemon/api.ts";
import { lumensOf } from "../../state/luminaires.ts";
import { choiceOfPlace } from "../../state/sensors.ts";
import { pinsAfter } from "../../state/shares.ts";
import { unitShown } from "../../state/state.ts";
import { lightAtPlace, nameOfPlace } from "../sensor_card.ts";

/** A pointer that moved less than this, in pixels, between down and up has clicked. */
const CLICK_PX = 5;
const STEP_PX = 6;

export class Pointer {
    readonly keys: HTMLButtonElement;
    /** The cross is there: arrow keys move it in place of the camera. */
    isByKeys = false;
    private readonly tip = make("div", { class: "tip", hidden: true });
    private readonly cross = make("div", { class: "cross", hidden: true, "aria-hidden": "true" });
    /** Tells readers of the screen what stands under the cross. */
    private readonly told = make("div", { class: "unseen", role: "status", "aria-live": "polite" });
    private readonly canvas: HTMLCanvasElement;
    private readonly frame: HTMLElement;
    /** In pixels of the picture; null: the pointer is elsewhere. */
    private place: [number, number] | null = null;
    private down: [number, number, number] | null = null;
    private isWaiting = false;
    private element: number | null = null;
    private luminaire: Luminaire | null = null;
    /** The place of a sensor. */
    private sensor: number | null = null;

    constructor(private readonly page: Page, /** True while the panel is seen: then elements are marked and pinned. */
        private readonly isReading: () => boolean)
    {
        const { store, scene } = page;
        this.canvas = scene.stage.canvas;
        this.frame = this.canvas.parentElement as HTMLElement;
        this.frame.append(this.tip, this.cross, this.told);
        this.keys = button("Read by keys (R)", "A cross on the picture that arrow keys move; Enter pins, Escape ends",
            () => this.setKeys(!this.isByKeys), { "aria-pressed": "false" });
        this.canvas.addEventListener("pointermove", (event) => {
            if (this.isByKeys) return;
            // What was read belongs to the picture before it was turned.
            if (event.buttons !== 0 || event.pointerType === "touch") this.leave();
            else this.moveTo(event.offsetX, event.offsetY);
        });
        this.canvas.addEventListener("wheel", () => {
            if (!this.isByKeys) this.leave();
        }, { passive: true });
        this.canvas.addEventListener("pointerleave", () => {
            if (!this.isByKeys) this.leave();
        });
        this.canvas.addEventListener("pointerdown", (event) => {
            this.down = event.isPrimary && event.button === 0 ? [event.clientX, event.clientY, event.pointerId] : null;
        });
        window.addEventListener("pointerup", (event) => this.release(event));
        // Before the camera, which listens to the canvas itself.
        this.frame.addEventListener("keydown", (event) => this.press(event), true);
        for (const event of ["field", "sensed"] as const) scene.on(event, () => this.showNumber());
        // After the camera moved by itself or by keys, another element is under the cross or the pointer.
        store.listen((now, before) => {
            if (now.view.camera !== before.view.camera && this.place !== null) this.moveTo(...this.place);
        });
        scene.on("scene", () => {
            this.leave();
            const prepare = (): void => scene.now?.picker.prepare();
            if ("requestIdleCallback" in window) requestIdleCallback(prepare, { timeout: 4000 });
            else setTimeout(prepare, 2000);
        });
    }

    setKeys(on: boolean): void {
        this.isByKeys = on;
        this.keys.setAttribute("aria-pressed", String(on));
        this.cross.hidden = !on;
        if (!on) {
            this.leave();
            return;
        }
        this.canvas.focus();
        this.moveTo(this.canvas.clientWidth / 2, this.canvas.clientHeight / 2);
    }

    private press(event: KeyboardEvent): void {
        if (event.target !== this.canvas || event.ctrlKey || event.metaKey || event.altKey) return;
        const key = event.key.toLowerCase();
        if (key === "r") this.setKeys(!this.isByKeys);
        else if (!this.isByKeys) return;
        else if (key === "escape") this.setKeys(false);
        else if (key === "enter" || key === " ") {
            this.look();
            this.pin(event.shiftKey);
        } else if (key.startsWith("arrow") && this.place !== null) {
            const step = STEP_PX * (event.shiftKey ? 5 : 1);
            const [x, y] = this.place;
            this.moveTo(
                clamp(x + (key === "arrowright" ? step : key === "arrowleft" ? -step : 0), 0,
                    this.canvas.clientWidth - 1),
                clamp(y + (key === "arrowdown" ? step : key === "arrowup" ? -step : 0), 0,
                    this.canvas.clientHeight - 1),
            );
        } else return;
        event.preventDefault();
        event.stopPropagation();
    }

    private release(event: PointerEvent): void {
        const { down } = this;
        this.down = null;
        if (down === null || event.pointerId !== down[2] || event.target !== this.canvas) return;
        if (Math.hypot(event.clientX - down[0], event.clientY - down[1]) > CLICK_PX) return;
        const { scene } = this.page;
        if (!this.isReading() && scene.now?.openings === null && scene.now.marks === null) return;
        const box = this.canvas.getBoundingClientRect();
        this.place = [event.clientX - box.left, event.clientY - box.top];
        this.look();
        if (this.isReading() || this.sensor !== null) this.pin(event.shiftKey);
        else if (this.luminaire !== null) scene.pick(this.luminaire.name);
    }

    /** Pins the element, or marks the sensor before it; a second time ends that. */
    private pin(isMore: boolean): void {
        const { store, scene } = this.page, sensors = scene.now?.sensors ?? null;
        if (this.sensor !== null && sensors !== null) {
            const { of: { set: { name } }, index } = choiceOfPlace(sensors, this.sensor), { sensor } = store.now;
            store.change({ ...store.now,
                sensor: sensor?.set === name && sensor.index === index ? null : { set: name, index } });
        } else if (this.element !== null)
            store.change({ ...store.now, pins: pinsAfter(store.now.pins, this.element, isMore) });
        else if (!isMore && store.now.pins.length > 0) store.change({ ...store.now, pins: [] });
    }

    private leave(): void {
        this.place = null;
        this.element = this.luminaire = this.sensor = null;
        this.tip.hidden = true;
        this.page.scene.hover(null);
    }

    private moveTo(x: number, y: number): void {
        this.place = [x, y];
        if (this.isWaiting) return;
        this.isWaiting = true;
        // One look for each picture at most.
        requestAnimationFrame(() => {
            this.isWaiting = false;
            if (this.place !== null) this.look();
        });
    }

    private look(): void {
        const { page: { scene: { now: scene, cameras: { camera } }, store: { now: { view } } }, place } = this;
        if (scene === null || place === null) return;
        camera.updateMatrixWorld();
        const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
        const [x, y] = [(2 * place[0]) / width - 1, 1 - (2 * place[1]) / height], met = scene.picker.meet(x, y, camera);
        this.element = met?.element ?? null;
        this.luminaire = view.openings ? scene.openings?.at(x, y, camera, height, met?.distance ?? null) ?? null : null;
        this.sensor = view.sensors ? scene.marks?.at(x, y, camera, met?.distance ?? null) ?? null : null;
        this.page.scene.hover(this.isReading() || this.isByKeys ? this.element : null);
        this.showNumber();
    }

    /** The number beside the pointer: what the picture shows there. */
    private showNumber(): void {
        const { page: { scene: { now: scene, fields: [field] }, store: { now: { view, lighting } } }, place, element,
            luminaire, sensor } = this;
        if (place === null) return;
        this.cross.style.left = `${place[0]}px`;
        this.cross.style.top = `${place[1]}px`;
        this.tip.hidden = (element === null && luminaire === null && sensor === null) || field === null
            || scene === null;
        if (this.tip.hidden || field === null || scene === null) {
            if (this.isByKeys) this.told.textContent = "nothing";
            return;
        }
        const lamp = luminaire === null
            ? ""
            : `${luminaire.name}, ${numberText(lumensOf({ members: [luminaire] }, lighting))} lm`;
        const surface = element === null
            ? ""
            : `${numberText(field.values[element])} ${unitShown(view)} · ${
                scene.mesh.groups[scene.mesh.groupOf[element]]?.name ?? ""
            }`;
        const sensors = scene.sensors;
        const read = sensor === null || sensors === null
            ? ""
            : `${nameOfPlace(sensors, sensor)}: ${lightAtPlace(this.page, sensors, sensor)}`;
        const text = [read, lamp, surface].filter((part) => part !== "").join(" · ");
        this.tip.textContent = text;
        if (this.isByKeys) this.told.textContent = element === null ? text : `${text}, element ${element}`;
        // It stays within the picture, and beside the pointer.
        const right = place[0] > this.frame.clientWidth - this.tip.offsetWidth - 24;
        const below = place[1] < this.tip.offsetHeight + 24;
        this.tip.style.left = `${Math.max(4, right ? place[0] - this.tip.offsetWidth - 14 : place[0] + 14)}px`;
        this.tip.style.top = `${below ? place[1] + 18 : place[1] - this.tip.offsetHeight - 12}px`;
    }
}
