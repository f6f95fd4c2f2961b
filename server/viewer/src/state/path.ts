// A lamp in many positions: between two of them the light is the mixture of both, which is exact for weights.

export type Weights = { readonly [index: string]: number };

/** The weights of a position between 0 and the last one. */
export function alongOf(position: number, power: number): Weights {
    const low = Math.floor(position), share = position - low;
    return share === 0 ? { [low]: power } : { [low]: power * (1 - share), [low + 1]: power * share };
}

/** The position whose weights these are, whatever their sum; null where they are of no single one. */
export function positionOf(weights: Weights): number | null {
    const lit = Object.entries(weights).filter(([, weight]) => weight > 0)
        .map(([index, weight]) => [Number(index), weight]);
    if (lit.length === 1) return lit[0][0];
    if (lit.length !== 2) return null;
    lit.sort(([one], [other]) => one - other);
    const [[low, first], [high, second]] = lit;
    return high === low + 1 ? low + second / (first + second) : null;
}
