// The lighting that a scene comes with: its lamps, or what shines first where it has none.
import { luminance, type Rgb } from "../base/colour.ts";
import { emittersOf, type Description } from "../daemon/api.ts";
import type { SceneMesh } from "../picture/glb.ts";
import { firstState, type GroupLight, type Lighting } from "./state.ts";

/** Light of an overcast sky on the ground, lx, as the daemon's named skies have it. */
const LUX_OUTSIDE = 10000;

/** Lights as the scene has them: each group that emits, with its power and colour. */
export function defaultLightingOf(mesh: SceneMesh, description: Description): Lighting {
    const groups: { [name: string]: GroupLight } = {};
    for (const group of mesh.groups) if (group.emission !== null) groups[group.name] = lightOf(group.emission);
    const isDark = Object.keys(groups).length === 0 && description.sky === null && description.luminaires === null
        && (description.emitters ?? []).length === 0;
    if (isDark) groups[ceilingOf(mesh)] = lightOf([1, 1, 1]);
    const emitters: { [index: string]: number } = {};
    // A lamp begins at its first position; tiles of a sky shine as the panel of skies says.
    const shine = description.sky !== null ? 0 : description.report?.paths !== undefined ? 1 : Infinity;
    emittersOf(description).forEach((_, index) => {
        if (index < shine) emitters[index] = 1;
    });
    const sky = description.sky === null
        ? firstState.lighting.sky
        : { ...firstState.lighting.sky, model: "overcast" as const,
            strength: description.lights === "lm" ? LUX_OUTSIDE : firstState.lighting.sky.strength };
    return { ...firstState.lighting, groups, emitters, sky };
}

/** The group that looks down most, from above: what shines first in a scene without lamps, which would be black. */
function ceilingOf(mesh: SceneMesh): string {
    const low = new Array<number>(mesh.groups.length).fill(0);
    let floor = Infinity;
    for (let v = 1; v < mesh.positions.length; v += 3) floor = Math.min(floor, mesh.positions[v]);
    for (let i = 0; i < mesh.index.length; i += 3) {
        const v = mesh.index[i], element = mesh.elementOf[v];
        low[mesh.groupOf[element]] += Math.max(0, -mesh.normals[3 * v + 1]) * (mesh.positions[3 * v + 1] - floor)
            * mesh.area[element];
    }
    return mesh.groups[low.indexOf(Math.max(...low))].name;
}

function lightOf(emission: Rgb): GroupLight {
    const power = luminance(emission);
    return {
        on: true,
        power: Number(power.toPrecision(6)),
        kelvin: null,
        colour: power > 0 ? emission.map((v) => Number((v / power).toPrecision(6))) as Rgb : [1, 1, 1],
    };
}
