// Numbers as people read them.

/** Three digits that count, without an exponent where a plain number is short. */
export function numberText(value: number, digits = 3): string {
    if (!Number.isFinite(value)) return "–";
    if (value === 0) return "0";
    const size = Math.abs(value);
    if (size >= 1e6 || size < 1e-4) return value.toExponential(digits - 1);
    const places = Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
    return value.toLocaleString("en-US", { minimumFractionDigits: 0, maximumFractionDigits: Math.min(places, 7) });
}

/** A number as it was typed or pasted, with a point: a comma is one, unless it parts thousands. */
export function withPoint(text: string): string {
    const comma = text.lastIndexOf(",");
    if (comma < 0) return text;
    if (/^\s*-?[1-9]\d{0,2}(,\d{3})+(\.\d*)?\s*$/.test(text) || comma < text.lastIndexOf("."))
        return text.replaceAll(",", "");
    return text.replaceAll(".", "").replace(",", ".");
}

export function percent(share: number): string {
    return `${numberText(100 * share, 2)} %`;
}

export function count(n: number): string {
    return n.toLocaleString("en-US");
}

export function clamp(value: number, low: number, high: number): number {
    return Math.min(high, Math.max(low, value));
}
