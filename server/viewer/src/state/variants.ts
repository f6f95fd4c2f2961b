// Variants of a scene: their names and reflectances.

/** Of groups, one number or one for each channel. */
export type Reflectances = { [group: string]: number[] };

/** The store that a scene is a variant of (NAME@variant), or the scene itself. */
export function baseOf(scene: string, all: readonly string[]): string {
    const bases = all.filter((name) => scene.startsWith(`${name}@`));
    return bases.reduce((longest, name) => (name.length > longest.length ? name : longest), "") || scene;
}

/** What is wrong with a variant before it is asked for; null: nothing. */
export function checkReflectances(name: string, groups: Reflectances): string | null {
    if (name === "" || /[\s/@]/.test(name)) return "A variant needs a name, without spaces, / and @.";
    if (Object.keys(groups).length === 0) return "Change a reflectance first.";
    for (const [group, values] of Object.entries(groups))
        for (const value of values)
            if (!(value >= 0 && value < 1))
                return `A reflectance is at least 0 and below 1; ${group} has ${Number.isNaN(value) ? "none" : value}.`;
    return null;
}
