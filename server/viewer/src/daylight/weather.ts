// The rows of a weather file, as the daemon reads them, by the time of the year.
import type { WeatherRows } from "../daemon/daylight.ts";
import type { Moment } from "../state/state.ts";
import { dayOf } from "./dates.ts";

/** What a row says. */
export interface WeatherHour {
    year: number;
    /** W/m², normal to the sun, or on a horizontal plane: see Weather.directIsHorizontal. */
    direct: number;
    /** W/m², on a horizontal plane. */
    diffuse: number;
    /** Degrees Celsius; NaN: unknown. */
    dewPoint: number;
}

export interface Weather {
    place: string;
    latitude: number;
    longitude: number;
    zone: number;
    directIsHorizontal: boolean;
    /** Of the rows, h. */
    step: number;
    /** By the time of a year of 365 days, h, which is that of the middle of what a row covers. */
    hours: WeatherHour[];
    times: Float64Array;
}

/** Months of a typical year are often of several years: what counts is the time of the year. */
export function weatherFrom(rows: WeatherRows): Weather {
    const direct = rows.direct ?? rows.direct_horizontal ?? [];
    const all = rows.hour.map((hour, i) => ({
        time: 24 * (dayOf(rows.month[i], rows.day[i]) - 1) + hour,
        row: { year: rows.year[i], direct: direct[i], diffuse: rows.diffuse[i], dewPoint: rows.dew_point[i] ?? NaN },
    })).sort((one, other) => one.time - other.time);
    const { place, latitude, longitude, zone, step } = rows;
    return { place, latitude, longitude, zone, step, directIsHorizontal: rows.direct === undefined,
        hours: all.map(({ row }) => row), times: Float64Array.from(all, ({ time }) => time) };
}

/** The weather of one hour, as a link holds it. */
export function weatherOf({ day, hour, year, direct, isHorizontal, diffuse, dewPoint }: Moment): Weather {
    return { place: "", latitude: 0, longitude: 0, zone: 0, directIsHorizontal: isHorizontal, step: 1,
        hours: [{ year, direct, diffuse, dewPoint: dewPoint ?? NaN }], times: Float64Array.of(24 * (day - 1) + hour) };
}

/** The weather at a time of the year: that of a row at its middle, between two by their distance; `year` is that of the
 * nearer one. Null where the file has nothing within an hour, or within its step where that is longer. */
export function weatherAt(weather: Weather, day: number, hour: number): WeatherHour | null {
    const { hours, times } = weather, time = 24 * (day - 1) + hour, near = Math.max(1, weather.step);
    let low = 0, high = times.length;
    while (low < high) {
        const middle = (low + high) >> 1;
        if (times[middle] <= time) low = middle + 1;
        else high = middle;
    }
    const before = low > 0 && time - times[low - 1] <= near ? hours[low - 1] : null;
    const after = low < times.length && times[low] - time <= near ? hours[low] : null;
    if (before === null || after === null) return before ?? after;
    const share = (time - times[low - 1]) / (times[low] - times[low - 1]);
    const mix = (one: number, other: number): number => (share === 0 ? one : one + share * (other - one));
    return {
        year: (share > 0.5 ? after : before).year,
        direct: mix(before.direct, after.direct),
        diffuse: mix(before.diffuse, after.diffuse),
        dewPoint: mix(before.dewPoint, after.dewPoint),
    };
}
