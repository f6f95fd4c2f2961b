// The tiles of a store's sky, as GET /v1/scenes/NAME/sky gives them: means over tiles, and the tile of a direction.

/** The daemon's answer; arrays have a member a tile, angles are degrees, azimuths run from north by east. */
export interface SkyAnswer {
    tiling: string;
    tiles: number;
    ground_albedo: number;
    centre: [number, number][];
    azimuth: [number, number][];
    altitude: [number, number][];
    solid_angle: number[];
    cosine: number[];
    weather: "epw" | "wea" | null;
}

/** The same in radians, with tiles of one altitude together. */
export interface Tiles {
    count: number;
    /** East, north, up of each middle. */
    centre: Float64Array;
    altitude: Float64Array;
    azimuth: Float64Array;
    solidAngle: Float64Array;
    /** Integral of the cosine to the zenith, sr. */
    cosine: Float64Array;
    bands: { first: number; count: number }[];
}

const DEGREE = Math.PI / 180;

/** Directions in a tile are about this far apart, as in solver/daylight/year.c: scattering around the sun falls to 1/e
 * in 8 degrees at its steepest. */
const SPACING = 3 * DEGREE;

export function tilesOf(answer: SkyAnswer): Tiles {
    const count = answer.centre.length;
    const tiles: Tiles = {
        count,
        centre: new Float64Array(3 * count),
        altitude: new Float64Array(2 * count),
        azimuth: new Float64Array(2 * count),
        solidAngle: Float64Array.from(answer.solid_angle),
        cosine: Float64Array.from(answer.cosine),
        bands: [],
    };
    for (let t = 0; t < count; t++) {
        const [azimuth, altitude] = answer.centre[t].map((angle) => angle * DEGREE);
        tiles.centre.set([Math.cos(altitude) * Math.sin(azimuth), Math.cos(altitude) * Math.cos(azimuth),
            Math.sin(altitude)], 3 * t);
        tiles.altitude.set(answer.altitude[t].map((angle) => angle * DEGREE), 2 * t);
        tiles.azimuth.set(answer.azimuth[t].map((angle) => angle * DEGREE), 2 * t);
        const band = tiles.bands.at(-1);
        if (band !== undefined && answer.altitude[band.first][0] === answer.altitude[t][0]) band.count += 1;
        else tiles.bands.push({ first: t, count: 1 });
    }
    return tiles;
}

const stepsAcross = (angle: number): number => Math.max(Math.ceil(angle / SPACING - 1e-9), 1);

/** Means over each tile of gradation(cos zeta) scattering(cos gamma), weighted by solid angle; gamma is the angle to
 * `to`. */
export function meansOver(tiles: Tiles, to: readonly [number, number, number], gradation: (cosZeta: number) => number,
    scattering: (cosGamma: number) => number): Float64Array
{
    const means = new Float64Array(tiles.count);
    const flat = Math.hypot(to[0], to[1]), towards = Math.atan2(to[0], to[1]);
    for (const { first, count } of tiles.bands) {
        const low = tiles.altitude[2 * first], high = tiles.altitude[2 * first + 1], height = high - low;
        const width = tiles.azimuth[2 * first + 1] - tiles.azimuth[2 * first];
        const rings = stepsAcross(height), sectors = stepsAcross(width * Math.cos(low + 0.5 * height));
        const all = (Math.sin(high) - Math.sin(low)) * sectors;
        for (let r = 0; r < rings; r++) {
            // The solid angle of a ring is proportional to the difference of the sines.
            const under = Math.sin(low + (height * r) / rings), over = Math.sin(low + (height * (r + 1)) / rings);
            const up = 0.5 * (under + over), weight = (gradation(up) * (over - under)) / all;
            const across = Math.sqrt(1 - up * up) * flat, along = up * to[2];
            for (let t = first; t < first + count; t++)
                for (let q = 0; q < sectors; q++) {
                    const azimuth = tiles.azimuth[2 * t] + (width * (q + 0.5)) / sectors;
                    means[t] += weight * scattering(along + across * Math.cos(azimuth - towards));
                }
        }
    }
    return means;
}

/** Irradiance of a horizontal plane under these radiances. */
export function horizontalOf(tiles: Tiles, L: ArrayLike<number>): number {
    let sum = 0;
    for (let t = 0; t < tiles.count; t++) sum += L[t] * tiles.cosine[t];
    return sum;
}

/** The tile in a direction above the horizon: east, north, up. */
export function tileOf(tiles: Tiles, direction: readonly [number, number, number]): number {
    const altitude = Math.atan2(direction[2], Math.hypot(direction[0], direction[1]));
    const azimuth = Math.atan2(direction[0], direction[1]);
    let band = 0;
    while (band + 1 < tiles.bands.length && altitude >= tiles.altitude[2 * tiles.bands[band].first + 1]) band++;
    const { first, count } = tiles.bands[band];
    const width = tiles.azimuth[2 * first + 1] - tiles.azimuth[2 * first];
    const place = Math.floor((azimuth - tiles.azimuth[2 * first]) / width);
    return first + (((place % count) + count) % count);
}

/** Adds a sun that gives a horizontal plane the irradiance `horizontal`: to its tile, as `lambert sky` does, or to the
 * tiles within a tile and a half of it, by their distance, so that it moves without steps. */
export function addSun(tiles: Tiles, sun: readonly [number, number, number], horizontal: number, spread: boolean,
    L: Float64Array): void
{
    const own = tileOf(tiles, sun);
    if (!spread) {
        L[own] += horizontal / tiles.cosine[own];
        return;
    }
    const reach = 1.5 * Math.sqrt(tiles.solidAngle[own]);
    const weights: [number, number][] = [];
    let received = 0;
    for (let t = 0; t < tiles.count; t++) {
        const cos = tiles.centre[3 * t] * sun[0] + tiles.centre[3 * t + 1] * sun[1] + tiles.centre[3 * t + 2] * sun[2];
        const weight = 1 - Math.acos(Math.min(Math.max(cos, -1), 1)) / reach;
        if (weight <= 0) continue;
        weights.push([t, weight]);
        received += weight * tiles.cosine[t];
    }
    if (received <= 0) weights.push([own, 1]);
    for (const [t, weight] of weights) L[t] += (weight * horizontal) / (received > 0 ? received : tiles.cosine[own]);
}
