// Skies for the tiles of a store: even, overcast, clear, and of a weather file, in the unit of the store.
import { efficacies, gradation, perezOf, scattering, airMass, SOLAR_CONSTANT, type Shape } from "./perez.ts";
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
}

/** CIE standard clear sky, low turbidity: type 12 of CIE S 011 (ISO 15469). */
const CIE_CLEAR: Shape = { a: -1, b: -0.32, c: 10, d: -3, e: 0.45 };

const ZENITH = [0, 0, 1] as const;

/** Times a factor, so that a horizontal plane receives `horizontal`; even where the model has no light. */
function scaled(tiles: Tiles, relative: Float64Array, horizontal: number): Float64Array {
    const now = horizontalOf(tiles, relative);
    return relative.map((value) => (now > 0 ? (value * horizontal) / now : horizontal / Math.PI));
}

function shaped(tiles: Tiles, shape: Shape, sun: Sun, horizontal: number): Float64Array {
    const relative = meansOver(tiles, sun.direction, (cosZeta) => gradation(shape, cosZeta), (cosGamma) => scattering(shape, cosGamma));
    return scaled(tiles, relative, horizontal);
}

/** Normal irradiance by a sun in a clear sky, W/m²: of what is outside the atmosphere, .7 to the power of m^.678 is left
 * after an air mass m (Meinel and Meinel 1976); the sky has a tenth of that, on a horizontal plane. */
function clearDay(sun: Sun): { direct: number; diffuse: number } {
    if (sun.altitude <= 0) return { direct: 0, diffuse: 0 };
    const direct = (SOLAR_CONSTANT / sun.distance ** 2) * 0.7 ** (airMass(Math.PI / 2 - sun.altitude) ** 0.678);
    return { direct, diffuse: 0.1 * direct };
}

function put(tiles: Tiles, sun: Sun, light: SkyLight, diffuse: Float64Array, horizontal: number): Sky {
    const direct = new Float64Array(tiles.count);
    if (horizontal > 0 && light.sun !== "off") addSun(tiles, sun.direction, horizontal, light.sun === "spread", direct);
    return {
        sun, diffuse, direct, diffuseHorizontal: horizontalOf(tiles, diffuse), directHorizontal: horizontalOf(tiles, direct),
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
    if (light.model === "even") return put(tiles, sun, light, new Float64Array(tiles.count).fill(light.strength / Math.PI), 0);
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
    return weather === null ? null : weatherSky(tiles, light, photometric, weather);
}

/** As solver/daylight/year.c makes an hour: the diffuse light of the file by the sky of Perez, the direct light by the sun. */
function weatherSky(tiles: Tiles, light: SkyLight, photometric: boolean, weather: Weather): Sky | null {
    const hour = weatherAt(weather, light.day, light.hour);
    if (hour === null) return null;
    const sun = sunAt(light.latitude, light.longitude, light.zone, { year: hour.year, ...dateOf(light.day) }, light.hour);
    const up = Math.max(0, sun.direction[2]), isUp = up > 0;
    const horizontal = !isUp ? 0 : weather.directIsHorizontal ? hour.direct : hour.direct * up;
    const normal = !isUp ? 0 : weather.directIsHorizontal ? hour.direct / up : hour.direct;
    if (hour.diffuse <= 0 && horizontal <= 0) return put(tiles, sun, light, new Float64Array(tiles.count), 0);
    const perez = perezOf(sun, normal, hour.diffuse);
    const by = photometric ? efficacies(perez, hour.dewPoint) : { direct: 1, diffuse: 1 };
    const diffuse = light.factor * hour.diffuse * by.diffuse;
    return put(tiles, sun, light, diffuse > 0 ? shaped(tiles, perez, sun, diffuse) : new Float64Array(tiles.count),
        light.factor * horizontal * by.direct);
}
