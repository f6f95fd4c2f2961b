// Palettes of false colour, as 256 colours of sRGB.
import { interpolateInferno, interpolateTurbo, interpolateViridis } from "d3-scale-chromatic";
import type { Palette } from "../state/state.ts";

const ramps: { [name in Palette]: (t: number) => string } = {
    viridis: interpolateViridis,
    inferno: interpolateInferno,
    turbo: interpolateTurbo,
};

/** #rrggbb or rgb(r, g, b), as the ramps write them. */
function channels(text: string): number[] {
    if (text.startsWith("#")) return [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16));
    return (text.match(/[\d.]+/g) ?? []).slice(0, 3).map(Number);
}

export function paletteBytes(name: Palette): Uint8Array {
    const bytes = new Uint8Array(4 * 256);
    for (let i = 0; i < 256; i++) {
        const [r, g, b] = channels(ramps[name](i / 255));
        bytes.set([r, g, b, 255], 4 * i);
    }
    return bytes;
}
