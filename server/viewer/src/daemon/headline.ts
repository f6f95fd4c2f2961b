// The error in one number: of operator, form factors and mesh together, for the kind of light that shines.
import type { Description, Emission, ErrorFigures } from "./api.ts";

export interface Headline {
    /** The share of the light that surfaces reflect, the first light of a sky with it. */
    stated: number;
    /** Its parts: all but the mesh, and the mesh; 0: the store does not state it. */
    rest: number;
    mesh: number;
    coarse: boolean;
}

/** The root of the sum of the squares of the parts, which are independent. As the daemon states it of a store:
 * solver/codec/stated_notes.c; of an answer it is `error.stated`. */
export function headlineOf(error: Description["error"], emission: Emission | null): Headline | null {
    const hasLuminaires = emission !== null && "luminaires" in emission;
    const isSky = emission !== null && Object.keys(emission).join() === "sky" && error?.sky !== undefined;
    const figures = isSky ? error.sky : error?.lights ?? error?.random ?? error?.single;
    if (error === null || figures?.total_indirect_mean === undefined) return null;
    const of = (Array.isArray(error.mesh) ? {} : error.mesh ?? {}) as ErrorFigures;
    const skies = Math.max(of.sky_even ?? 0, of.sky_cloudy ?? 0),
        lights = of.lights ?? of.even ?? 0,
        mesh = isSky && skies > 0
            ? skies
            : hasLuminaires && of.luminaires !== undefined
            ? Math.max(of.lights ?? 0, of.luminaires)
            : lights,
        rest = isSky ? figures.total_relative_mean : figures.total_indirect_mean;
    const stated = Math.hypot(rest, mesh);
    return { stated, rest, mesh, coarse: stated > 0.1 };
}
