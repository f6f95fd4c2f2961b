// The all-weather sky of Perez, Seals and Michalsky 1993 (Solar Energy 50(3):235-245, eq. 1 to 8, table 1) and the
// luminous efficacies of Perez et al. 1990 (Solar Energy 44(5):271-289, eq. 3, 7, 8, table 4), as solver/daylight has
// them.
import type { Sun } from "./sun.ts";

/** Relative luminance (1 + a exp(b / cos zeta)) (1 + c exp(d gamma) + e cos² gamma) of a sky. */
export interface Shape {
    a: number;
    b: number;
    c: number;
    d: number;
    e: number;
}

export interface PerezSky extends Shape {
    /** Of the sun, radians, at most pi/2. */
    zenith: number;
    /** epsilon, and Delta held to .01 … .6, where the model was made. */
    clearness: number;
    brightness: number;
    /** Of clearness, 0 to 7. */
    bin: number;
}

/** Normal irradiance outside the atmosphere at one astronomical unit, W/m². */
export const SOLAR_CONSTANT = 1367;

/** Precipitable water, cm, that is assumed where the dew point is unknown. */
const WATER = 2;

const BIN_FROM = [1.065, 1.23, 1.5, 1.95, 2.8, 4.5, 6.2];

// dprint-ignore
const SHAPE: readonly (readonly (readonly number[])[])[] = [
    [[1.3525, -0.2576, -0.269, -1.4366], [-0.767, 0.0007, 1.2734, -0.1233], [2.8, 0.6004, 1.2375, 1.0],
        [1.8734, 0.6297, 0.9738, 0.2809], [0.0356, -0.1246, -0.5718, 0.9938]],
    [[-1.2219, -0.773, 1.4148, 1.1016], [-0.2054, 0.0367, -3.9128, 0.9156], [6.975, 0.1774, 6.4477, -0.1239],
        [-1.5798, -0.5081, -1.7812, 0.108], [0.2624, 0.0672, -0.219, -0.4285]],
    [[-1.1, -0.2515, 0.8952, 0.0156], [0.2782, -0.1812, -4.5, 1.1766], [24.7219, -13.0812, -37.7, 34.8438],
        [-5.0, 1.5218, 3.9229, -2.6204], [-0.0156, 0.1597, 0.4199, -0.5562]],
    [[-0.5484, -0.6654, -0.2672, 0.7117], [0.7234, -0.6219, -5.6812, 2.6297], [33.3389, -18.3, -62.25, 52.0781],
        [-3.5, 0.0016, 1.1477, 0.1062], [0.4659, -0.3296, -0.0876, -0.0329]],
    [[-0.6, -0.3566, -2.5, 2.325], [0.2937, 0.0496, -5.6812, 1.8415], [21.0, -4.7656, -21.5906, 7.2492],
        [-3.5, -0.1554, 1.4062, 0.3988], [0.0032, 0.0766, -0.0656, -0.1294]],
    [[-1.0156, -0.367, 1.0078, 1.4051], [0.2875, -0.5328, -3.85, 3.375], [14.0, -0.9999, -7.1406, 7.5469],
        [-3.4, -0.1078, -1.075, 1.5702], [-0.0672, 0.4016, 0.3017, -0.4844]],
    [[-1.0, 0.0211, 0.5025, -0.5119], [-0.3, 0.1922, 0.7023, -1.6317], [19.0, -5.0, 1.2438, -1.9094],
        [-4.0, 0.025, 0.3844, 0.2656], [1.0468, -0.3788, -2.4517, 1.4656]],
    [[-1.05, 0.0289, 0.426, 0.359], [-0.325, 0.1156, 0.7781, 0.0025], [31.0625, -14.5, -46.1148, 55.375],
        [-7.2312, 0.405, 13.35, 0.6234], [1.5, -0.6426, 1.8564, 0.5636]],
];

const DIFFUSE_EFFICACY = [
    [97.24, -0.46, 12.0, -8.91],
    [107.22, 1.15, 0.59, -3.95],
    [104.97, 2.96, -5.53, -8.77],
    [102.39, 5.59, -13.95, -13.9],
    [100.71, 5.94, -22.75, -23.74],
    [106.42, 3.83, -36.15, -28.83],
    [141.88, 1.9, -53.24, -14.03],
    [152.23, 0.35, -45.27, -7.98],
];
const DIRECT_EFFICACY = [
    [57.2, -4.55, -2.98, 117.12],
    [98.99, -3.46, -1.21, 12.38],
    [109.83, -4.9, -1.71, -8.81],
    [110.34, -5.84, -1.99, -4.56],
    [106.36, -3.97, -1.75, -6.16],
    [107.19, -1.25, -1.51, -26.73],
    [105.75, 0.77, -1.26, -34.44],
    [101.18, 1.58, -1.1, -8.29],
];

/** Relative optical air mass (Kasten 1966). */
export function airMass(zenith: number): number {
    return 1 / (Math.cos(zenith) + 0.15 * (93.885 - (zenith * 180) / Math.PI) ** -1.253);
}

/** The sky for a direct normal and a diffuse horizontal irradiance, W/m². A sun below the horizon is moved to it. */
export function perezOf(sun: Sun, direct: number, diffuse: number): PerezSky {
    const z = Math.min(Math.PI / 2 - sun.altitude, Math.PI / 2), cube = 1.041 * z ** 3;
    const extraterrestrial = SOLAR_CONSTANT / sun.distance ** 2;
    const clearness = diffuse > 0 ? ((diffuse + direct) / diffuse + cube) / (1 + cube) : Infinity;
    const brightness = Math.min(Math.max((diffuse * airMass(z)) / extraterrestrial, 0.01), 0.6);
    let bin = 0;
    while (bin < 7 && clearness >= BIN_FROM[bin]) bin++;
    // In bins 2 to 5 the luminance of the horizon is unbounded below a brightness of .2, which is taken there.
    const Delta = bin >= 1 && bin <= 4 ? Math.max(brightness, 0.2) : brightness;
    const k = SHAPE[bin];
    const x = k.map((row) => row[0] + row[1] * z + Delta * (row[2] + row[3] * z));
    if (bin === 0) { // eq. 7 and 8
        x[2] = Math.exp((Delta * (k[2][0] + k[2][1] * z)) ** k[2][2]) - k[2][3];
        x[3] = -Math.exp(Delta * (k[3][0] + k[3][1] * z)) + k[3][2] + Delta * k[3][3];
    }
    // b > 0, of bright clear skies, would make the horizon unbounded too.
    return { zenith: z, clearness, brightness, bin, a: x[0], b: Math.min(x[1], 0), c: x[2], d: x[3], e: x[4] };
}

export function gradation(shape: Shape, cosZeta: number): number {
    return Math.max(1 + shape.a * Math.exp(shape.b / cosZeta), 0);
}

export function scattering(shape: Shape, cosGamma: number): number {
    const held = Math.min(Math.max(cosGamma, -1), 1), gamma = Math.acos(held);
    return Math.max(1 + shape.c * Math.exp(shape.d * gamma) + shape.e * cosGamma * cosGamma, 0);
}

/** Precipitable water, cm, from the dew point in degrees Celsius; NaN: unknown. */
function waterOf(dewPoint: number): number {
    return Number.isNaN(dewPoint) ? WATER : Math.exp(0.07 * dewPoint - 0.075);
}

/** Luminous efficacy, lm/W, of diffuse and of direct light. */
export function efficacies(sky: PerezSky, dewPoint: number): { diffuse: number; direct: number } {
    const water = waterOf(dewPoint), k = DIFFUSE_EFFICACY[sky.bin], q = DIRECT_EFFICACY[sky.bin];
    return {
        diffuse: Math.max(k[0] + k[1] * water + k[2] * Math.cos(sky.zenith) + k[3] * Math.log(sky.brightness), 0),
        direct: Math.max(q[0] + q[1] * water + q[2] * Math.exp(5.73 * sky.zenith - 5) + q[3] * sky.brightness, 0),
    };
}
