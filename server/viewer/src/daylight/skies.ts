// Skies for the tiles of a store: even, overcast, clear, and of a weather file, in the unit of the store.
import { efficacies, gradation, perezOf, scattering, airMass, SOLAR_CONSTANT, type PerezSky,
    type Shape } from "./perez.ts";
import { dateOf, sunAt, type Sun } from "./sun.ts";
import { addSun, horizontalOf, meansOver, type Tiles } from "./tiles.ts";
import { weatherAt, type Weather } from "./weather.ts";
import type { SkyLight } from "../state/state.ts";

export interface Sky {
    /** Where the sun stands, whether it shines or not. */
    sun: Sun;
    /** Radiance of each tile by the sky and by its sun: W/(m² sr), or cd/m². */
    diffuse: Float64Array;
    direct: Float64Array;
    /** Irradiance of a horizontal plane by both. */
    diffuseHorizontal: number;
    directHorizontal: number;
    /** The model of Perez, where that made it. */
    perez: PerezSky | null;
}

/** W/m²: light that faces the sun, and diffuse light on a horizontal plane. */
interface Day {
    direct: number;
    diffuse: number;
}

/** CIE standard clear sky, low turbidity: type 12 of CIE S 011 (ISO 15469), over 1 - 10 exp(-3 pi / 2), as luminances
 * are relative. */
const CIE_BASE = 1 - 10 * Math.exp((-3 * Math.PI) / 2);
const CIE_CLEAR: Shape = { a: -1, b: -0.32, c: 10 / CIE_BASE, d: -3, e: 0.45 / CIE_BASE };

const ZENITH = [0, 0, 1] as const;

/** Times a factor, so that a horizontal plane receives `horizontal`; even where the model has no light. */
function scaled(tiles: Tiles, relative: Float64Array, horizontal: number): Float64Array {
    const now = horizontalOf(tiles, relative);
    return relative.map((value) => (now > 0 ? (value * horizontal) / now : horizontal / Math.PI));
}

function shaped(tiles: Tiles, shape: Shape, sun: Sun, horizontal: number): Float64Array {
    const relative = meansOver(tiles, sun.direction, (cosZeta) => gradation(shape, cosZeta),
        (cosGamma) => scattering(shape, cosGamma));
    return scaled(tiles, relative, horizontal);
}

/** Normal irradiance by a sun in a clear sky, W/m²: of what is outside the atmosphere, .7 to the power of m^.678 is
 * left after an air mass m (Meinel and Meinel 1976); the sky has a tenth of that, on a horizontal plane. */
function clearDay(sun: Sun): Day {
    if (sun.altitude <= 0) return { direct: 0, diffuse: 0 };
    const direct = (SOLAR_CONSTANT / sun.distance ** 2) * 0.7 ** (airMass(Math.PI / 2 - sun.altitude) ** 0.678);
    return { direct, diffuse: 0.1 * direct };
}

/** A clear day at sea level by the turbidity T of Linke, for an air mass of 2: the model of the European Solar
 * Radiation Atlas (Rigollier, Bauer and Wald 2000, Solar Energy 68(1):33-48) with the optical thickness of Kasten 1996,
 * made for T from 2 to 7. */
export function turbidDay(sun: Sun, T: number): Day {
    if (sun.altitude <= 0) return { direct: 0, diffuse: 0 };
    const up = Math.sin(sun.altitude), outside = SOLAR_CONSTANT / sun.distance ** 2;
    // Kasten and Young 1989.
    const m = 1 / (up + 0.50572 * ((sun.altitude * 180) / Math.PI + 6.07995) ** -1.6364);
    const thickness = m <= 20
        ? 1 / (6.6296 + m * (1.7513 + m * (-0.1202 + m * (0.0065 - m * 0.00013))))
        : 1 / (10.4 + 0.718 * m);
    // The diffuse light of a sun in the zenith, and its share at this altitude.
    const zenith = -0.015843 + T * (0.030543 + T * 0.0003797);
    const a = [0.26463 + T * (-0.061581 + T * 0.0031408), 2.0402 + T * (0.018945 - T * 0.011161),
        -1.3025 + T * (0.039231 + T * 0.0085079)];
    const share = Math.max(a[0], 0.002 / zenith) + up * (a[1] + up * a[2]);
    return { direct: outside * Math.exp(-0.8662 * T * m * thickness), diffuse: outside * zenith * share };
}

function put(tiles: Tiles, sun: Sun, light: SkyLight, diffuse: Float64Array, horizontal: number,
    perez: PerezSky | null = null): Sky
{
    const direct = new Float64Array(tiles.count);
    if (horizontal > 0 && light.sun !== "off") addSun(tiles, sun.direction, horizontal, light.sun === "spread", direct);
    return {
        sun,
        diffuse,
        direct,
        diffuseHorizontal: horizontalOf(tiles, diffuse),
        directHorizontal: horizontalOf(tiles, direct),
        perez,
    };
}

/** The day that positions of the sun are of: the file's own year where there is weather, 2001 without. */
function sunOf(light: SkyLight, year: number): Sun {
    return sunAt(light.latitude, light.longitude, light.zone, { year, ...dateOf(light.day) }, light.hour);
}

/** The sky of a model at its time and place; null without light, or where the weather that it needs is not there. */
export function skyFor(tiles: Tiles, light: SkyLight, photometric: boolean, weather: Weather | null): Sky | null {
    if (light.model === "off") return null;
    const sun = sunOf(light, 2001);
    if (light.model === "even")
        return put(tiles, sun, light, new Float64Array(tiles.count).fill(light.strength / Math.PI), 0);
    if (light.model === "overcast") {
        // Moon and Spencer 1942: (1 + 2 cos zeta)/3 of the zenith's.
        const relative = meansOver(tiles, ZENITH, (cosZeta) => 1 + 2 * cosZeta, () => 1);
        return put(tiles, sun, light, scaled(tiles, relative, light.strength), 0);
    }
    if (light.model === "clear") {
        const { direct, diffuse } = clearDay(sun);
        const by = photometric ? efficacies(perezOf(sun, direct, diffuse), NaN) : { direct: 1, diffuse: 1 };
        return put(tiles, sun, light, shaped(tiles, CIE_CLEAR, sun, light.factor * diffuse * by.diffuse),
            light.factor * direct * by.direct * Math.max(0, sun.direction[2]));
    }
    if (light.model === "turbid") return perezSky(tiles, sun, light, photometric, turbidDay(sun, light.turbidity));
    if (light.model === "given") return perezSky(tiles, sun, light, photometric, light);
    return weather === null ? null : weatherSky(tiles, light, photometric, weather);
}

/** As solver/daylight/year.c makes an hour: the diffuse light by the sky of Perez, the direct light by the sun. */
function perezSky(tiles: Tiles, sun: Sun, light: SkyLight, photometric: boolean, day: Day, dewPoint = NaN): Sky {
    const up = Math.max(0, sun.direction[2]), normal = up > 0 ? day.direct : 0;
    if (day.diffuse <= 0 && normal <= 0) return put(tiles, sun, light, new Float64Array(tiles.count), 0);
    const perez = perezOf(sun, normal, day.diffuse);
    const by = photometric ? efficacies(perez, dewPoint) : { direct: 1, diffuse: 1 };
    const diffuse = light.factor * day.diffuse * by.diffuse;
    return put(tiles, sun, light, diffuse > 0 ? shaped(tiles, perez, sun, diffuse) : new Float64Array(tiles.count),
        light.factor * normal * up * by.direct, perez);
}

function weatherSky(tiles: Tiles, light: SkyLight, photometric: boolean, weather: Weather): Sky | null {
    const hour = weatherAt(weather, light.day, light.hour);
    if (hour === null) return null;
    const sun = sunAt(light.latitude, light.longitude, light.zone, { year: hour.year, ...dateOf(light.day) },
            light.hour), up = sun.direction[2];
    const direct = up <= 0 ? 0 : weather.directIsHorizontal ? hour.direct / up : hour.direct;
    return perezSky(tiles, sun, light, photometric, { direct, diffuse: hour.diffuse }, hour.dewPoint);
}
