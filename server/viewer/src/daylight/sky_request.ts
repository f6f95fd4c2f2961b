// The sky that a lighting asks the daemon for. What is linear in it, a strength, a factor or a colour, is no part of
// the request, so that it can be changed without another one.
import type { Place, SkyRequest } from "../daemon/daylight.ts";
import type { SkyLight } from "../state/state.ts";
import { hourOfYear } from "./dates.ts";
import { weatherAt, type Weather } from "./weather.ts";

export const placeOf = ({ latitude, longitude, zone }: Place): Place => ({ latitude, longitude, zone });

/** Null: it is dark, or the weather that it needs is not there. */
export function skyRequest(light: SkyLight, photometric: boolean, weather: Weather | null): SkyRequest | null {
    const { model, day, hour } = light;
    if (model === "off") return null;
    if (model === "even" || model === "overcast") return { name: model };
    const common = { place: placeOf(light), hour: hourOfYear(day, hour), photometric, sun_in_tiles: false,
        sun_spread: light.sun === "spread", dark: true };
    if (model === "clear") return { name: "clear", ...common };
    if (model === "turbid") return { name: `turbidity:${light.turbidity}`, ...common };
    if (model === "given") return { direct: light.direct, diffuse: light.diffuse, ...common };
    const at = weather === null ? null : weatherAt(weather, day, hour);
    if (weather === null || at === null) return null;
    return {
        [weather.directIsHorizontal ? "direct_horizontal" : "direct"]: at.direct,
        diffuse: at.diffuse,
        ...(Number.isNaN(at.dewPoint) ? {} : { dew_point: Math.min(100, Math.max(-100, at.dewPoint)) }),
        year: at.year,
        ...common,
    };
}
