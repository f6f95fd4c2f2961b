// Makes elements of the page.

export type Child = Node | string | null | undefined | false;
type Handlers = { [K in keyof HTMLElementEventMap as `on${K}`]?: (event: HTMLElementEventMap[K]) => void };
type Properties = { [name: string]: unknown } & Handlers;

/** An element with attributes, handlers of events (onclick …) and children; false and null attributes are left out. */
export function make<K extends keyof HTMLElementTagNameMap>(
    tag: K,
    properties: Properties = {},
    ...children: Child[]
): HTMLElementTagNameMap[K] {
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(properties)) {
        if (name.startsWith("on")) element.addEventListener(name.slice(2), value as EventListener);
        else if (name === "value" || name === "checked" || name === "disabled" || name === "indeterminate")
            Object.assign(element, { [name]: value });
        else if (value === true) element.setAttribute(name, "");
        else if (value !== false && value !== null && value !== undefined) element.setAttribute(name, String(value));
    }
    append(element, ...children);
    return element;
}

export function append(parent: Node, ...children: Child[]): void {
    for (const child of children)
        if (child !== null && child !== undefined && child !== false)
            parent.appendChild(typeof child === "string" ? document.createTextNode(child) : child);
}

/** Replaces what stands in an element. */
export function fill(parent: Element, ...children: Child[]): void {
    parent.replaceChildren();
    append(parent, ...children);
}

let counter = 0;
/** A name for aria-labelledby and the like, used once. */
export function unique(stem: string): string {
    counter += 1;
    return `${stem}-${counter}`;
}

/** A button with a text or a sign. A sign is called by its label; a text keeps its name, and the label is a hint. */
export function button(text: string, label: string | null, press: () => void,
    properties: Properties = {}): HTMLButtonElement
{
    const isSign = !/[a-z]/i.test(text);
    return make("button", { type: "button", "aria-label": isSign ? label : null, title: label, onclick: press,
        ...properties }, text);
}

/** A choice of one of several values. */
export function choice<T extends string>(
    label: string,
    values: readonly (readonly [T, string])[],
    now: T,
    pick: (value: T) => void,
): HTMLLabelElement {
    const select = make("select", { onchange: () => pick(select.value as T) },
        ...values.map(([value, text]) => make("option", { value, selected: value === now }, text)));
    return make("label", { class: "field" }, make("span", {}, label), select);
}

export function tick(label: string, now: boolean, change: (on: boolean) => void): HTMLLabelElement {
    const box = make("input", { type: "checkbox", checked: now, onchange: () => change(box.checked) });
    return make("label", { class: "tick" }, box, make("span", {}, label));
}

/** True while the person changes this element, which must not be drawn anew then. */
export function isBeingChanged(element: Element): boolean {
    return element.contains(document.activeElement);
}
