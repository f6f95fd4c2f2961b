// Reads the hourly irradiances of a weather file: EPW of EnergyPlus, or WEA of Radiance's gendaymtx. The page keeps it to
// itself: nothing is sent anywhere.
import { dateOf, dayOf } from "./sun.ts";
import type { Moment } from "../state/state.ts";

export interface WeatherHour {
    year: number;
    month: number;
    day: number;
    /** Of standard time: the middle of what the row covers. */
    hour: number;
    /** W/m², normal to the sun, or on a horizontal plane: see directIsHorizontal. */
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
    /** By the time of a year of 365 days. */
    hours: WeatherHour[];
    times: Float64Array;
}

/** Beyond the solar constant: a sensor under broken clouds can briefly show more. */
const RADIATION_MOST = 3000;
const MISSING_RADIATION = 9999;
const MISSING_DEW_POINT = 99.9;

const EPW_HEAD = ["LOCATION", "DESIGN CONDITIONS", "TYPICAL/EXTREME PERIODS", "GROUND TEMPERATURES", "HOLIDAYS/DAYLIGHT SAVINGS",
    "COMMENTS 1", "COMMENTS 2", "DATA PERIODS"];
const WEA_HEAD = ["place", "latitude", "longitude", "time_zone", "site_elevation", "weather_data_file_units"];

/** A line of the file, counted from 1, with what is wrong. */
function wrong(line: number, what: string): Error {
    return new Error(`The weather file, line ${line}: ${what}.`);
}

function read(line: number, what: string, text: string | undefined, low: number, high: number): number {
    const value = Number(text);
    if (text === undefined || text.trim() === "" || !(value >= low && value <= high))
        throw wrong(line, `${what} is "${(text ?? "").trim().slice(0, 40)}", must be a number from ${low} to ${high}`);
    return value;
}

function readRadiation(line: number, what: string, text: string | undefined): number {
    if (Number(text) === MISSING_RADIATION) throw wrong(line, `${what} is missing (${MISSING_RADIATION}); fill the gap or take another file`);
    return read(line, what, text, 0, RADIATION_MOST);
}

function readEpw(lines: string[]): Omit<Weather, "times"> {
    EPW_HEAD.forEach((word, k) => {
        if (lines[k]?.split(",", 1)[0].trim().toUpperCase() !== word) throw wrong(k + 1, `an EPW has ${word} there`);
    });
    const head = lines[0].split(",");
    if (read(8, "records an hour", lines[7].split(",")[2], 1, Infinity) !== 1) throw wrong(8, "more than one record an hour; take hourly means");
    const hours = lines.slice(8).flatMap((text, k): WeatherHour[] => {
        if (text.trim() === "") return [];
        const fields = text.split(","), line = k + 9;
        const dew = read(line, "dew point (field 8)", fields[7], -100, 100);
        return [{
            year: read(line, "year (field 1)", fields[0], 1900, 2100), month: read(line, "month", fields[1], 1, 12),
            day: read(line, "day", fields[2], 1, 31), hour: read(line, "hour (field 4)", fields[3], 1, 24) - 0.5,
            dewPoint: dew >= MISSING_DEW_POINT ? NaN : dew,
            direct: readRadiation(line, "direct normal radiation (field 15)", fields[14]),
            diffuse: readRadiation(line, "diffuse horizontal radiation (field 16)", fields[15]),
        }];
    });
    return {
        place: head[1]?.trim() ?? "", latitude: read(1, "latitude (field 7)", head[6], -90, 90),
        longitude: read(1, "longitude (field 8)", head[7], -180, 180), zone: read(1, "time zone (field 9)", head[8], -14, 14),
        directIsHorizontal: false, hours,
    };
}

/** In a WEA western longitudes are positive, and the time zone is given as a meridian. */
function readWea(lines: string[]): Omit<Weather, "times"> {
    const values = WEA_HEAD.map((word, k) => {
        const [name, ...rest] = (lines[k] ?? "").trim().split(/\s+/);
        if (name !== word) throw wrong(k + 1, `a WEA has ${word} there`);
        return rest.join(" ");
    });
    const units = read(6, "weather_data_file_units", values[5], 1, 2);
    if (units !== 1 && units !== 2) throw wrong(6, "weather_data_file_units must be 1 (direct light facing the sun) or 2 (on a horizontal plane)");
    let isLeap = false;
    const hours = lines.slice(6).flatMap((text, k): WeatherHour[] => {
        const line = k + 7, fields = text.trim().split(/\s+/);
        if (fields[0] === "") return [];
        if (fields.length !== 5) throw wrong(line, "must hold five numbers: month day hour direct-normal diffuse-horizontal");
        const month = read(line, "month", fields[0], 1, 12), day = read(line, "day", fields[1], 1, 31);
        isLeap ||= month === 2 && day === 29;
        return [{
            year: 2001, month, day, hour: read(line, "hour", fields[2], 0, 24), dewPoint: NaN,
            direct: readRadiation(line, "direct radiation", fields[3]), diffuse: readRadiation(line, "diffuse radiation", fields[4]),
        }];
    });
    if (isLeap) for (const hour of hours) hour.year = 2000;
    const zone = read(4, "time_zone", values[3], -210, 210);
    return {
        place: values[0], latitude: read(2, "latitude", values[1], -90, 90), longitude: 0 - read(3, "longitude", values[2], -180, 180),
        zone: 0 - zone / 15, directIsHorizontal: units === 2, hours,
    };
}

/** Hours from the beginning of a year of 365 days. */
const timeOf = (hour: WeatherHour): number => 24 * (dayOf(hour.month, hour.day) - 1) + hour.hour;

/** Reads the text of a file; an Error says which line is wrong and why. */
export function readWeather(text: string): Weather {
    const lines = text.replace(/^\uFEFF/, "").split(/\r?\n/);
    const isEpw = /^LOCATION,/i.test(lines[0]);
    if (!isEpw && !/^place\s/.test(lines[0])) throw new Error("The file is neither an EPW nor a WEA: it begins with neither LOCATION nor place.");
    const weather = isEpw ? readEpw(lines) : readWea(lines);
    if (weather.hours.length === 0) throw new Error("The weather file has no hours after its head.");
    // Months of a typical year are often of several years: what counts is the time of the year.
    weather.hours.sort((one, other) => timeOf(one) - timeOf(other));
    return { ...weather, times: Float64Array.from(weather.hours, timeOf) };
}

/** The weather of one hour, as a link holds it. */
export function weatherOf({ day, hour, year, direct, isHorizontal, diffuse, dewPoint }: Moment): Weather {
    const one: WeatherHour = { year, ...dateOf(day), hour, direct, diffuse, dewPoint: dewPoint ?? NaN };
    return { place: "", latitude: 0, longitude: 0, zone: 0, directIsHorizontal: isHorizontal, hours: [one], times: Float64Array.of(24 * (day - 1) + hour) };
}

/** The weather at a time of the year: that of an hour at its middle, between two by their distance; `year` is that of the
 * nearer one. Null where the file has nothing within an hour. */
export function weatherAt(weather: Weather, day: number, hour: number): WeatherHour | null {
    const { hours, times } = weather, time = 24 * (day - 1) + hour;
    let low = 0, high = times.length;
    while (low < high) {
        const middle = (low + high) >> 1;
        if (times[middle] <= time) low = middle + 1;
        else high = middle;
    }
    const before = low > 0 && time - times[low - 1] <= 1 ? hours[low - 1] : null;
    const after = low < times.length && times[low] - time <= 1 ? hours[low] : null;
    if (before === null || after === null) return before ?? after;
    const share = (time - times[low - 1]) / (times[low] - times[low - 1]);
    const mix = (one: number, other: number): number => (share === 0 ? one : one + share * (other - one));
    return {
        ...(share > 0.5 ? after : before), direct: mix(before.direct, after.direct), diffuse: mix(before.diffuse, after.diffuse),
        dewPoint: mix(before.dewPoint, after.dewPoint),
    };
}
