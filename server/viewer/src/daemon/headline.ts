// The error in one line: of operator, form factors and mesh together, for the kind of light that shines.
import type { Description, Emission, ErrorFigures } from "./api.ts";

export interface Headline {
    /** Shares of the reflected light and of all light. */
    indirect: number;
    relative: number;
    /** The parts of `indirect`: all but the mesh, and the mesh; 0: the store does not state it. */
    rest: number;
    mesh: number;
}

/** The root of the sum of the squares of the parts, which are independent. Both figures are of the reflected light,
 * over another size, so that they grow alike. As lambert solve has it: solver/codec/stated_errors.c. */
export function headlineOf(error: Description["error"], emission: Emission | null): Headline | null {
    const isSky = emission !== null && Object.keys(emission).join() === "sky";
    const figures = (isSky ? error?.sky : undefined) ?? error?.lights ?? error?.random ?? error?.single;
    if (error === null || figures?.total_indirect_mean === undefined) return null;
    const of = (Array.isArray(error.mesh) ? {} : error.mesh ?? {}) as ErrorFigures,
        { total_indirect_mean: rest, total_relative_mean: part } = figures;
    const skies = Math.max(of.sky_even ?? 0, of.sky_cloudy ?? 0),
        mesh = (isSky && skies > 0 ? skies : of.lights) ?? of.even ?? 0;
    const indirect = Math.hypot(rest, mesh);
    return { indirect, relative: rest > 0 ? part * (indirect / rest) : Math.hypot(part, mesh), rest, mesh };
}
