// Which scenes can stand beside the open one in a comparison: those that take the same lighting on as many elements.
import type { Description } from "../daemon/api.ts";
import { count } from "../base/numbers.ts";

const namesOf = (list: readonly { name: string }[]): string => JSON.stringify(list.map((group) => group.name).sort());

/** Why b cannot be compared with a, as a sentence; null: it can. Skies may have other tiles, for which they are made
 * anew. */
export function whyUnlike(a: Description, b: Description): string | null {
    if (b.elements !== a.elements)
        return `${b.name} has ${count(b.elements)} elements and ${a.name} ${
            count(a.elements)
        }: another mesh, whose elements are no pairs.`;
    if (b.channels !== a.channels)
        return `${b.name} has ${b.channels} channels and ${a.name} ${a.channels}, so there is no difference to show.`;
    if (namesOf(b.groups) !== namesOf(a.groups))
        return `${b.name} has other groups than ${a.name}, so it cannot be lit alike.`;
    if ((b.sky === null) !== (a.sky === null))
        return `Only one of ${a.name} and ${b.name} has a sky, so they cannot be lit alike.`;
    const hasTiles = (of: Description): boolean => of.sky !== null && of.emitters?.length === of.sky.tiles;
    const emitters = (of: Description): string => (hasTiles(of) ? "tiles" : JSON.stringify(of.emitters ?? []));
    if (emitters(b) !== emitters(a)) return `${b.name} has other emitters than ${a.name}, so it cannot be lit alike.`;
    return null;
}
