// The luminaires of a store under a lighting: as a person set them, alone or by groups, else as their list says.
import type { Rgb } from "../base/colour.ts";
import type { Luminaire } from "../daemon/api.ts";
import type { Lighting, LuminaireLight } from "./state.ts";

/** Luminaires that have one dimmer: those of a group, by its name, or one without a group, by its own. */
export interface LuminaireRow {
    name: string;
    isGroup: boolean;
    members: readonly Luminaire[];
}

export interface SceneLuminaires {
    /** In the order of their gradients. */
    list: readonly Luminaire[];
    rows: readonly LuminaireRow[];
    /** Of all elements, m². */
    area: number;
}

/** Null of none. */
export function luminairesOf(list: readonly Luminaire[], areas: Float64Array): SceneLuminaires | null {
    if (list.length === 0) return null;
    const groups = new Map<string, Luminaire[]>(), rows: LuminaireRow[] = [];
    for (const one of list) {
        const members = one.group === null ? undefined : groups.get(one.group);
        if (members !== undefined) {
            members.push(one);
            continue;
        }
        const first = [one];
        if (one.group !== null) groups.set(one.group, first);
        rows.push({ name: one.group ?? one.name, isGroup: one.group !== null, members: first });
    }
    return { list, rows, area: areas.reduce((sum, area) => sum + area, 0) };
}

/** True of names of luminaires and of groups of them. */
export function isRow(luminaires: SceneLuminaires | null, name: string | null): boolean {
    return luminaires?.list.some((one) => one.name === name || (one.group !== null && one.group === name)) ?? false;
}

/** The light of a luminaire: its own in the lighting, or that of its group, or the one of its list. */
export function lightOf({ name, group, dim }: Luminaire, { luminaires }: Lighting): LuminaireLight {
    // Names may be those of members that every object has.
    if (Object.hasOwn(luminaires, name)) return luminaires[name];
    if (group !== null && Object.hasOwn(luminaires, group)) return luminaires[group];
    return { on: true, dim, tint: [1, 1, 1], kelvin: null };
}

const areEqual = (a: unknown, b: unknown): boolean => JSON.stringify(a) === JSON.stringify(b);

/** The light that all luminaires of a row have; null: they differ. */
export function commonLightOf({ members }: LuminaireRow, lighting: Lighting): LuminaireLight | null {
    const [first, ...others] = members.map((one) => lightOf(one, lighting));
    return others.every((light) => areEqual(light, first)) ? first : null;
}

/** The luminaires of a lighting after a change of all in some rows. */
export function withRows(rows: readonly LuminaireRow[], lighting: Lighting,
    to: Partial<LuminaireLight>): Lighting["luminaires"]
{
    const changed = rows.flatMap(({ name, members }) => {
        const lights = members.map((one) => [one.name, { ...lightOf(one, lighting), ...to }] as const),
            [[, first]] = lights;
        return lights.every(([, light]) => areEqual(light, first)) ? [[name, first] as const] : lights;
    });
    const names = new Set(rows.flatMap(({ name, members }) => [name, ...members.map((one) => one.name)]));
    const others = Object.entries(lighting.luminaires).filter(([name]) => !names.has(name));
    return Object.fromEntries([...others, ...changed]);
}

/** What a request says of a luminaire: 0 where it is dark, else one number or one for each channel. */
export function dimmerOf(luminaire: Luminaire, lighting: Lighting, channels: number): number | number[] {
    const { on, dim, tint } = lightOf(luminaire, lighting), { solo, soloLuminaire } = lighting,
        value = dim * lighting.dim;
    const isAlone = soloLuminaire === luminaire.name || (luminaire.group !== null && soloLuminaire === luminaire.group);
    if (!on || value <= 0 || solo !== null || (soloLuminaire !== null && !isAlone)) return 0;
    return channels === 3 && tint.some((v) => v !== 1) ? tint.map((v) => v * value) : value;
}

/** Dimmers of those that shine, by the names of groups whose luminaires are alike, else by their own. */
export function dimmersOf(rows: readonly LuminaireRow[], lighting: Lighting,
    channels: number): { [name: string]: number | number[] }
{
    const dimmers = rows.flatMap((row): (readonly [string, number | number[]])[] => {
        const all = row.members.map((one) => [one.name, dimmerOf(one, lighting, channels)] as const), [[, first]] = all;
        return all.every(([, dimmer]) => areEqual(dimmer, first)) ? [[row.name, first]] : all;
    });
    return Object.fromEntries(dimmers.filter(([, dimmer]) => dimmer !== 0));
}

/** Lumens that a row gives under a lighting; a tint leaves the luminance as it is. */
export function lumensOf({ members }: Pick<LuminaireRow, "members">, lighting: Lighting): number {
    return members.reduce((sum, one) => sum + one.lumens * (dimmerOf(one, lighting, 1) as number), 0);
}

/** Their direct light on all elements on average, were it to end on these, lx. */
export function meanLightOf({ list, area }: SceneLuminaires, lighting: Lighting): number {
    return lumensOf({ members: list }, lighting) / area;
}

/** The colour that all luminaires of a row have in their list; null: they differ. */
export function ownColourOf({ members }: LuminaireRow): Rgb | null {
    return members.every((one) => areEqual(one.colour, members[0].colour)) ? members[0].colour : null;
}
