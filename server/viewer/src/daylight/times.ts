// The times of the rows of a weather file, by the rules of solver/daylight/weather_times.h, which lambert has: the step
// between rows, and rows that are missing, repeated or out of order.

export interface WeatherHour {
    year: number;
    month: number;
    day: number;
    /** Of standard time: the middle of what the row covers. */
    hour: number;
    /** W/m², normal to the sun, or on a horizontal plane: see Weather.directIsHorizontal. */
    direct: number;
    /** W/m², on a horizontal plane. */
    diffuse: number;
    /** Degrees Celsius; NaN: unknown. */
    dewPoint: number;
}

/** A row with the line that it stands in; `minute` is of an EPW, NaN: no whole number from 0 to 60. */
export interface Row extends WeatherHour {
    line: number;
    minute: number;
}

/** A day of the header of an EPW; year 0: not stated. */
export interface StatedDate {
    year: number;
    month: number;
    day: number;
}

export type Periods = { from: StatedDate; to: StatedDate }[];

const PER_HOUR = [1, 2, 3, 4, 5, 6, 10, 12, 15, 20, 30, 60];
/** Hours of two decimals are off by .005, distances by twice that. */
const ROUNDED = 0.0101, LONGEST = 6, DAYS = 366, LEAP = 59;
const BEFORE = [0, 31, 60, 91, 121, 152, 182, 213, 244, 274, 305, 335];

const tolerance = (step: number): number => Math.min(ROUNDED, step / 4);
const dayIn = ({ month, day }: { month: number; day: number }): number => BEFORE[month - 1] + day - 1;
const sameDay = (a: WeatherHour, b: WeatherHour): boolean => a.month === b.month && a.day === b.day;
const atMidnight = (row: WeatherHour): WeatherHour => ({ ...row, hour: 0 });
const round4 = (value: number): string => String(Number(value.toPrecision(4)));
const hoursAre = (value: number): string => `${Number(value.toPrecision(6))} ${value === 1 ? "hour is" : "hours are"}`;

/** Hours from one row to the next, forward by the clock; 29 February counts where one of them is in it. A file turns
 * the year by at most half of one. */
function ahead(from: WeatherHour, to: WeatherHour): { hours: number; isBack: boolean } {
    const first = dayIn(from), last = dayIn(to);
    const plain = 24 * (last - first) + to.hour - from.hour, turns = plain < 0,
        hours = turns ? plain + 24 * DAYS : plain;
    const passesLeap = turns ? first < LEAP || last > LEAP : first < LEAP && last > LEAP;
    return { hours: hours - (passesLeap ? 24 : 0), isBack: turns && hours > 12 * DAYS };
}

function nameOf(row: Row, earlier: number): string {
    const minutes = Math.round(60 * Math.max(0, row.hour - earlier)),
        two = (value: number): string => String(value).padStart(2, "0");
    return `line ${row.line} (${row.year}-${two(row.month)}-${two(row.day)} ${two(Math.floor(minutes / 60))}:${
        two(minutes % 60)
    })`;
}

const fail = (what: string): never => {
    throw new Error(`The weather file, ${what}.`);
};

function longStep(rows: Row[]): number {
    const { hours: step, isBack } = ahead(rows[0], rows[1]), perDay = Math.round(24 / step);
    if (isBack || step > LONGEST || Math.abs(24 / step - perDay) > 1e-3 || rows.length % perDay !== 0) return 0;
    const fills = rows.every((row, i) => {
        if (i === 0) return true;
        const way = ahead(rows[i - 1], row), isNew = i % perDay === 0;
        return !way.isBack && (isNew || Math.abs(way.hours - step) <= tolerance(1))
            && sameDay(rows[i - 1], row) !== isNew;
    });
    return fills ? 24 / perDay : 0;
}

function checkSteps(rows: Row[], step: number): void {
    const near = tolerance(step), ways = rows.slice(1).map((row, i) => ahead(rows[i], row));
    ways.forEach(({ hours, isBack }, i) => {
        const isOff = Math.abs(hours - step * Math.round(hours / step)) > near;
        const isLonger = hours > step + near && hours <= 1 + near && i + 1 < ways.length
            && Math.abs(ways[i + 1].hours - hours) <= near;
        if (!isBack && (isOff || isLonger))
            fail(
                `${nameOf(rows[i + 1], 0)} is ${round4(hours)} h after the row before it, but most rows are ${
                    round4(step)
                } h apart; a file must keep to one step`,
            );
    });
}

/** Middles of the parts of hours that rows of an EPW cover: a minute is the end of its part where any is 60, or all are
 * whole parts and none is 0; else it is in the part. */
function takeParts(rows: Row[], step: number): void {
    const parts = rows.map((row) => row.minute / 60 / step);
    const isEnd = rows.some((row) => row.minute === 60)
        || (parts.every((part) => part === Math.round(part)) && rows.every((row) => row.minute !== 0));
    rows.forEach((row, i) => {
        const part = isEnd ? Math.max(Math.ceil(parts[i] - 1e-6) - 1, 0) : Math.floor(parts[i] + 1e-6);
        row.hour = Math.round(row.hour - row.minute / 60) + (part + 0.5) * step;
    });
}

/** The step of rows, h. Hours of an EPW come as their beginning and become the middle of what rows cover. */
function findStep(rows: Row[], isEpw: boolean): { step: number; isApart: boolean } {
    const hasParts = isEpw
        && rows.some((row, i) => i > 0 && sameDay(rows[i - 1], row) && rows[i - 1].hour === row.hour);
    for (const row of rows) {
        if (!hasParts) continue;
        if (Number.isNaN(row.minute))
            fail(`line ${row.line}: minute (field 5) must be a whole number from 0 to 60, as hours have several rows`);
        row.hour += row.minute / 60;
    }
    const counts = new Array<number>(PER_HOUR.length).fill(0);
    let odd = 0, firstOdd = 0;
    for (let i = 1; i < rows.length; i++) {
        const { hours, isBack } = ahead(rows[i - 1], rows[i]);
        if (isBack || hours <= 0 || hours > 1 + ROUNDED) continue;
        const off = PER_HOUR.map((n) => {
            const away = Math.abs(hours - 1 / n);
            return away < Math.min(ROUNDED, 0.25 / n) ? away : Infinity;
        });
        const best = off.indexOf(Math.min(...off));
        if (off[best] < Infinity) counts[best] += 1;
        else if (odd++ === 0) firstOdd = i;
    }
    const most = Math.max(...counts);
    if (odd > most) {
        const { hours } = ahead(rows[firstOdd - 1], rows[firstOdd]);
        fail(
            `${nameOf(rows[firstOdd], 0)} is ${
                round4(hours)
            } h after the row before it; a step must be an hour over a divisor of 60`,
        );
    }
    const long = !isEpw && most === 0 && rows.length > 1 ? longStep(rows) : 0;
    const step = long > 0 ? long : 1 / PER_HOUR[counts.indexOf(most)], isApart = !isEpw && most === 0 && long === 0;
    if (!isApart && (hasParts || !isEpw)) checkSteps(rows, step);
    if (hasParts) takeParts(rows, step);
    else if (isEpw) { for (const row of rows) row.hour += 0.5; }
    return { step, isApart };
}

const isCalendar = (rows: Row[]): boolean =>
    rows.every((row, i) => i === 0 || row.year === rows[i - 1].year + (dayIn(row) < dayIn(rows[i - 1]) ? 1 : 0));

function checkOrder(rows: Row[], step: number, earlier: number): void {
    const year = 24 * (rows.some((row) => row.month === 2 && row.day === 29) ? DAYS : DAYS - 1),
        isReal = isCalendar(rows),
        near = tolerance(step);
    let passed = 0, front = rows[0], behind = 0, first = rows[0];
    for (const row of rows.slice(1)) {
        const { hours, isBack } = ahead(front, row);
        if (isBack || hours <= near || (!isReal && passed + hours > year - near)) {
            if (behind++ === 0) first = row;
            continue;
        }
        passed += hours;
        front = row;
    }
    if (behind === 0) return;
    const twin = rows.slice(0, rows.indexOf(first)).find((row) =>
            sameDay(row, first) && Math.abs(row.hour - first.hour) <= near
        ), hours = hoursAre(behind * step);
    if (twin !== undefined)
        fail(
            `${
                nameOf(first, earlier)
            } has the time of line ${twin.line}: ${hours} there twice or out of order; each time must be there once`,
        );
    fail(`${nameOf(first, earlier)} is before the row above it: ${hours} out of order`);
}

/** The gaps of a WEA that are chosen, by the rules of solver/daylight/weather_gaps.c. */
function chosenGaps(rows: Row[], step: number, isApart: boolean): (a: Row, b: Row) => boolean {
    const days: Row[][] = [], near = tolerance(step), most = Math.max(step, 0.25) + near;
    for (const row of rows) {
        const last = days.at(-1);
        if (last !== undefined && sameDay(last[0], row)) last.push(row);
        else days.push([row]);
    }
    const apart = (
        k: number,
    ): number => (k + 1 < days.length ? ahead(atMidnight(days[k][0]), atMidnight(days[k + 1][0])).hours : Infinity);
    const isSame = days.every((day) =>
        day.length === days[0].length && day.every((row, i) => Math.abs(row.hour - days[0][i].hour) <= near)
    );
    const slots = days.reduce((sum, day) => sum + 1 + Math.round(((day.at(-1) as Row).hour - day[0].hour) / step), 0);
    const span = days.slice(1).reduce((sum, _, k) => sum + apart(k), 24);
    const passesNight = days.some((day, k) => k > 0 && ahead(days[k - 1].at(-1) as Row, day[0]).hours <= step + near);
    const edge = (k: number, isLast: boolean): number => (isLast ? -(days[k].at(-1) as Row).hour : days[k][0].hour);
    const isEven = days.every((_, k) =>
        apart(k) !== 24 || [false, true].every((isLast) => {
            const one = edge(k, isLast), next = edge(k + 1, isLast);
            return Math.abs(one - next) <= most
                && !(apart(k + 1) === 24 && next > Math.max(one, edge(k + 2, isLast)) + near);
        })
    );
    const inDays = (isSame && days.length > 1) || 2 * rows.length <= slots,
        byNight = !passesNight && (isSame || isEven),
        wholeDays = 48 * days.length <= span;
    return (a, b) =>
        isApart || (sameDay(a, b) ? inDays : ahead(atMidnight(a), atMidnight(b)).hours > 24 ? wholeDays : byNight);
}

function checkGaps(rows: Row[], step: number, earlier: number, isChosen: (a: Row, b: Row) => boolean): void {
    let gaps = 0, missing = 0, first = rows[0], atFirst = 0;
    for (let i = 1; i < rows.length; i++) {
        const left = ahead(rows[i - 1], rows[i]).hours - step;
        if (left <= tolerance(step) || isChosen(rows[i - 1], rows[i])) continue;
        if (gaps++ === 0) [first, atFirst] = [rows[i], left];
        missing += left;
    }
    if (gaps === 0) return;
    const more = gaps > 1 ? `, ${Number(missing.toPrecision(6))} in ${gaps} gaps of the file` : "";
    fail(`${nameOf(first, earlier)}: before it ${hoursAre(atFirst)} missing${more}; fill the gap or take another file`);
}

/** The hours of a stated period of more than a year, without any 29 February; 0: it is no longer than that. */
function hoursOfYears({ from, to }: Periods[number]): number {
    if (from.year === 0 || to.year === 0) return 0;
    const years = to.year - from.year - (dayIn(to) < dayIn(from) ? 1 : 0),
        row = { hour: 0, direct: 0, diffuse: 0, dewPoint: 0 };
    return years > 0 ? ahead({ ...from, ...row }, { ...to, ...row }).hours + 24 + 24 * 365 * years : 0;
}

/** True where an EPW of one period holds whole days of it, at most half of those from the first to the last. */
function choosesDays(rows: Row[], step: number, periods: Periods | null): boolean {
    const aDay = Math.round(24 / step), count = Math.floor(rows.length / aDay);
    if (periods?.length !== 1 || rows.length % aDay !== 0 || count < 2) return false;
    const isWhole = rows.every((row, i) =>
        sameDay(row, rows[i - (i % aDay)]) && (i % aDay > 0 || i === 0 || !sameDay(row, rows[i - 1]))
    );
    return isWhole && 2 * count <= 1 + ahead(atMidnight(rows[0]), atMidnight(rows[rows.length - 1])).hours / 24;
}

function checkPeriods(rows: Row[], step: number, periods: Periods): void {
    const there = new Array<number>(DAYS).fill(0), isIn = new Array<boolean>(DAYS).fill(false);
    for (const row of rows) there[dayIn(row)] += step;
    for (const { from, to } of periods) {
        let day = dayIn(from);
        for (isIn[day] = true; day !== dayIn(to); isIn[day] = true) day = (day + 1) % DAYS;
    }
    let missing = there.reduce(
        (sum, hours, day) => sum + (isIn[day] && !(day === LEAP && hours === 0) ? Math.max(0, 24 - hours) : 0),
        0,
    );
    const wanted = periods.reduce((sum, period) => sum + hoursOfYears(period), 0);
    if (isCalendar(rows)) missing = Math.max(missing, wanted + there[LEAP] - rows.length * step);
    if (missing < 0.5 * step) return;
    const { from } = periods[0], { to } = periods[periods.length - 1];
    fail(
        `line 8 states ${from.month}/${from.day} to ${to.month}/${to.day}, but rows are from ${
            nameOf(rows[0], step / 2)
        } to `
            + `${nameOf(rows[rows.length - 1], step / 2)}: ${
                hoursAre(missing)
            } missing; fill the gap or state what the file holds`,
    );
}

/** Sets the hours of rows to the middles of what they cover, and tells the step between them, h; an Error names a row
 * that is missing, repeated or out of order. `periods` is what an EPW states, null for a WEA. */
export function readTimes(rows: Row[], periods: Periods | null): number {
    const { step, isApart } = findStep(rows, periods !== null), earlier = periods === null ? 0 : step / 2,
        near = tolerance(step);
    checkOrder(rows, step, earlier);
    const isChosen = choosesDays(rows, step, periods);
    const isDate = (date: StatedDate, row: Row): boolean => date.month === row.month && date.day === row.day;
    checkGaps(rows, step, earlier, periods === null
        ? chosenGaps(rows, step, isApart)
        : (a, b) =>
            isChosen || (a.hour + step > 24 - near && b.hour - step < near
                && periods.some(({ to }, k) =>
                    k + 1 < periods.length && isDate(to, a) && isDate(periods[k + 1].from, b)
                )));
    if (periods !== null && periods.length > 0 && !isChosen) checkPeriods(rows, step, periods);
    return step;
}
