// Reads the irradiances of a weather file, row by row: EPW of EnergyPlus, or WEA of Radiance's gendaymtx. The page
// keeps it to itself: nothing is sent anywhere.
import { dateOf, dayOf, sunAt } from "./sun.ts";
import { readTimes, type Periods, type Row, type StatedDate, type WeatherHour } from "./times.ts";
import type { Moment } from "../state/state.ts";

export interface Weather {
    place: string;
    latitude: number;
    longitude: number;
    zone: number;
    directIsHorizontal: boolean;
    /** Of the rows, h. */
    step: number;
    /** By the time of a year of 365 days. */
    hours: WeatherHour[];
    times: Float64Array;
}

/** Beyond the solar constant: a sensor under broken clouds can briefly show more. */
const RADIATION_MOST = 3000;
const MISSING_RADIATION = 9999;
const MISSING_DEW_POINT = 99.9;
/** By night a pyranometer shows up to this much less than nothing. */
const OFFSET_MOST = 10;

const EPW_HEAD = ["LOCATION", "DESIGN CONDITIONS", "TYPICAL/EXTREME PERIODS", "GROUND TEMPERATURES",
    "HOLIDAYS/DAYLIGHT SAVINGS", "COMMENTS 1", "COMMENTS 2", "DATA PERIODS"];
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

/** NaN where it is missing, 0 where it is an offset below 0. */
function readRadiation(line: number, what: string, text: string | undefined): number {
    const value = text === undefined || text.trim() === "" ? NaN : Number(text);
    if (value >= MISSING_RADIATION || value === -999 || value === -MISSING_RADIATION) return NaN;
    return value < 0 && value >= -OFFSET_MOST ? 0 : read(line, what, text, 0, RADIATION_MOST);
}

type Place = Pick<Weather, "latitude" | "longitude" | "zone">;

/** What is read before the times are looked at. */
interface Draft extends Omit<Weather, "times" | "step" | "hours"> {
    rows: Row[];
    /** Of an EPW; null: a WEA states none. */
    periods: Periods | null;
}

const DAYS = [31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
const PERIODS = 16;

function readDay(line: number, month: string, text: string): number {
    return read(line, "day", text, 1, DAYS[Number(month) - 1] + (Number(month) === 2 ? 1 : 0));
}

/** A date of the header: month/day, month/day/year, or the number of a day of 365. */
function readDate(field: number, text: string): StatedDate {
    const parts = text.split("/").map((part) => (/^\s*\d{1,4}\s*$/.test(part) ? Number(part) : NaN));
    const [month, day, year = 0] = parts.length === 1 && parts[0] >= 1 && parts[0] <= 366
        ? Object.values(dateOf(Math.min(parts[0], 365)))
        : parts;
    if (parts.length > 3 || Number.isNaN(year)
        || !(month >= 1 && month <= 12 && day >= 1 && day <= DAYS[month - 1] + (month === 2 ? 1 : 0)))
        throw wrong(8,
            `date of a data period (field ${field + 1}) is "${text.trim().slice(0, 40)}", must be MONTH/DAY`);
    return { month, day, year: year < 1900 ? 0 : year };
}

function readPeriods(line: string): Periods {
    const fields = line.split(","), periods: Periods = [];
    const count = read(8, "data periods (field 2)", fields[1], 1, PERIODS);
    read(8, "records an hour (field 3)", fields[2], 1, 60);
    for (let at = 5; periods.length < count && at + 1 < fields.length && fields[at].trim() !== ""; at += 4)
        periods.push({ from: readDate(at, fields[at]), to: readDate(at + 1, fields[at + 1]) });
    return periods;
}

function readEpw(lines: string[]): Draft {
    EPW_HEAD.forEach((word, k) => {
        if (lines[k]?.split(",", 1)[0].trim().toUpperCase() !== word) throw wrong(k + 1, `an EPW has ${word} there`);
    });
    const head = lines[0].split(","), periods = readPeriods(lines[7]);
    const rows = lines.slice(8).flatMap((text, k): Row[] => {
        if (text.trim() === "") return [];
        const fields = text.split(","), line = k + 9;
        const dew = read(line, "dew point (field 8)", fields[7], -MISSING_RADIATION, Number.MAX_VALUE),
            written = (fields[4] ?? "").trim(),
            minute = written === "" ? NaN : Number(written);
        return [{
            line,
            minute: Number.isInteger(minute) && minute >= 0 && minute <= 60 ? minute : NaN,
            year: read(line, "year (field 1)", fields[0], 1900, 2100),
            month: read(line, "month", fields[1], 1, 12),
            day: readDay(line, fields[1], fields[2]),
            hour: read(line, "hour (field 4)", fields[3], 1, 24) - 1,
            dewPoint: dew >= MISSING_DEW_POINT || dew < -MISSING_DEW_POINT ? NaN : dew,
            direct: readRadiation(line, "direct normal radiation (field 15)", fields[14]),
            diffuse: readRadiation(line, "diffuse horizontal radiation (field 16)", fields[15]),
        }];
    });
    return {
        place: head[1]?.trim() ?? "",
        latitude: read(1, "latitude (field 7)", head[6], -90, 90),
        longitude: read(1, "longitude (field 8)", head[7], -180, 180),
        zone: read(1, "time zone (field 9)", head[8], -14, 14),
        directIsHorizontal: false,
        rows,
        periods,
    };
}

/** In a WEA western longitudes are positive, and the time zone is given as a meridian. */
function readWea(lines: string[]): Draft {
    const values = WEA_HEAD.map((word, k) => {
        const [name, ...rest] = (lines[k] ?? "").trim().split(/\s+/);
        if (name !== word) throw wrong(k + 1, `a WEA has ${word} there`);
        return rest.join(" ");
    });
    const units = read(6, "weather_data_file_units", values[5], 1, 2);
    if (units !== 1 && units !== 2)
        throw wrong(6, "weather_data_file_units must be 1 (direct light facing the sun) or 2 (on a horizontal plane)");
    let isLeap = false;
    const rows = lines.slice(6).flatMap((text, k): Row[] => {
        const line = k + 7, fields = text.trim().split(/\s+/);
        if (fields[0] === "") return [];
        if (fields.length !== 5)
            throw wrong(line, "must hold five numbers: month day hour direct-normal diffuse-horizontal");
        const month = read(line, "month", fields[0], 1, 12), day = readDay(line, fields[0], fields[1]);
        isLeap ||= month === 2 && day === 29;
        return [{
            line,
            minute: NaN,
            year: 2001,
            month,
            day,
            hour: read(line, "hour", fields[2], 0, 24),
            dewPoint: NaN,
            direct: readRadiation(line, "direct radiation", fields[3]),
            diffuse: readRadiation(line, "diffuse radiation", fields[4]),
        }];
    });
    if (isLeap) { for (const row of rows) row.year = 2000; }
    const zone = read(4, "time_zone", values[3], -210, 210);
    return {
        place: values[0],
        latitude: read(2, "latitude", values[1], -90, 90),
        longitude: 0 - read(3, "longitude", values[2], -180, 180),
        zone: 0 - zone / 15,
        directIsHorizontal: units === 2,
        rows,
        periods: null,
    };
}

/** Hours from the beginning of a year of 365 days. */
const timeOf = (hour: WeatherHour): number => 24 * (dayOf(hour.month, hour.day) - 1) + hour.hour;

/** True where the sun is below the horizon during the whole step of a row. */
function isDark({ latitude, longitude, zone }: Place, row: Row, step: number): boolean {
    const looks = Math.max(1, Math.ceil(12 * step));
    for (let k = 0; k <= looks; k++) {
        const hour = row.hour + step * (k / looks - 0.5);
        if (sunAt(latitude, longitude, zone, row, hour).direction[2] > 0) return false;
    }
    return true;
}

/** Values that are missing by night count as 0; an Error names one by day. */
function settle(rows: Row[], step: number, place: Place, isEpw: boolean): void {
    const missing = rows.filter((row) => Number.isNaN(row.direct + row.diffuse));
    const byDay = missing.filter((row) => !isDark(place, row, step));
    for (const row of missing) {
        if (Number.isNaN(row.direct)) row.direct = 0;
        if (Number.isNaN(row.diffuse)) row.diffuse = 0;
    }
    if (byDay.length > 0)
        throw wrong(byDay[0].line,
            `radiation is missing by day, ${byDay.length > 1 ? `the first of ${byDay.length} rows` : "in this row"}; `
                + `fill the gap or take another ${isEpw ? "EPW" : "WEA"}`);
}

/** Reads the text of a file; an Error says which line is wrong and why. */
export function readWeather(text: string): Weather {
    const lines = text.replace(/^\uFEFF/, "").split(/\r?\n/);
    const isEpw = /^LOCATION,/i.test(lines[0]);
    if (!isEpw && !/^place\s/.test(lines[0]))
        throw new Error("The file is neither an EPW nor a WEA: it begins with neither LOCATION nor place.");
    const { rows, periods, ...weather } = isEpw ? readEpw(lines) : readWea(lines);
    if (rows.length === 0) throw new Error("The weather file has no hours after its head.");
    const step = readTimes(rows, periods);
    settle(rows, step, weather, isEpw);
    // Months of a typical year are often of several years: what counts is the time of the year.
    const hours: WeatherHour[] = rows.sort((one, other) => timeOf(one) - timeOf(other));
    return { ...weather, step, hours, times: Float64Array.from(hours, timeOf) };
}

/** The weather of one hour, as a link holds it. */
export function weatherOf({ day, hour, year, direct, isHorizontal, diffuse, dewPoint }: Moment): Weather {
    const one: WeatherHour = { year, ...dateOf(day), hour, direct, diffuse, dewPoint: dewPoint ?? NaN };
    return { place: "", latitude: 0, longitude: 0, zone: 0, directIsHorizontal: isHorizontal, step: 1, hours: [one],
        times: Float64Array.of(24 * (day - 1) + hour) };
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
        ...(share > 0.5 ? after : before),
        direct: mix(before.direct, after.direct),
        diffuse: mix(before.diffuse, after.diffuse),
        dewPoint: mix(before.dewPoint, after.dewPoint),
    };
}
