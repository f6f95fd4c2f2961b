// Colours of lights: colour temperature to linear RGB, linear RGB to and from the #rrggbb of a page.

export type Rgb = [number, number, number];

/** The weights of luminance in linear sRGB (IEC 61966-2-1). */
export const LUMINANCE: readonly number[] = [0.2126, 0.7152, 0.0722];

export function luminance(c: readonly number[]): number {
    return LUMINANCE[0] * c[0] + LUMINANCE[1] * c[1] + LUMINANCE[2] * c[2];
}

/** Linear sRGB of a black body of this temperature in K, luminance 1; the chromaticity is the cubic of Kim et al.
 * (US patent 7,024,034), good to about .001 from 1,667 to 25,000 K. */
export function ofTemperature(kelvin: number): Rgb {
    const t = 1000 / Math.min(25000, Math.max(1667, kelvin));
    const x = kelvin <= 4000
        ? ((-0.2661239 * t - 0.234358) * t + 0.8776956) * t + 0.17991
        : ((-3.0258469 * t + 2.1070379) * t + 0.2226347) * t + 0.24039;
    const y = kelvin <= 2222
        ? ((-1.1063814 * x - 1.3481102) * x + 2.18555832) * x - 0.20219683
        : kelvin <= 4000
        ? ((-0.9549476 * x - 1.37418593) * x + 2.09137015) * x - 0.16748867
        : ((3.081758 * x - 5.8733867) * x + 3.75112997) * x - 0.37001483;
    const [X, Z] = [x / y, (1 - x - y) / y];
    const rgb = [3.2406 * X - 1.5372 - 0.4986 * Z, -0.9689 * X + 1.8758 + 0.0415 * Z, 0.0557 * X - 0.204 + 1.057 * Z]
        .map((v) => Math.max(0, v));
    const L = luminance(rgb);
    return [rgb[0] / L, rgb[1] / L, rgb[2] / L];
}

const encode = (v: number): number => (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);
const decode = (v: number): number => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);

/** #rrggbb of a linear colour whose components are at most 1. */
export function toHex(c: readonly number[]): string {
    return "#"
        + c.map((v) => Math.round(255 * encode(Math.min(1, Math.max(0, v)))).toString(16).padStart(2, "0")).join("");
}

export function fromHex(hex: string): Rgb {
    return [1, 3, 5].map((i) => decode(parseInt(hex.slice(i, i + 2), 16) / 255)) as Rgb;
}
