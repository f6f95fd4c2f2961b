// Where the sun stands, by the formulas of solver/daylight/sun.c: the low-precision ones of the Astronomical Almanac,
// as in Michalsky 1988, Solar Energy 40(3):227-235. Good to .01 degrees from 1950 to 2050, without refraction.

export interface Sun {
    /** Radians; below 0 it is night. */
    altitude: number;
    /** Radians from north by east, -pi to pi. */
    azimuth: number;
    /** Unit vector: east, north, up. */
    direction: readonly [number, number, number];
    /** From the earth, astronomical units. */
    distance: number;
}

export interface Day {
    year: number;
    month: number;
    day: number;
}

const DEGREE = Math.PI / 180;

/** Days from noon of 1 January 2000 to the midnight at which a day begins. */
function daysSince2000({ year, month, day }: Day): number {
    return (Date.UTC(year, month - 1, day) - Date.UTC(2000, 0, 1)) / 86400000 - 0.5;
}

/** At an hour of a clock that is `zone` hours ahead of UTC; north and east are positive degrees. */
export function sunAt(latitude: number, longitude: number, zone: number, date: Day, hour: number): Sun {
    const ut = hour - zone;
    const n = daysSince2000(date) + ut / 24;
    // Mean longitude L, mean anomaly g, ecliptic longitude l, obliquity of the ecliptic e.
    const L = 280.46 + 0.9856474 * n, g = (357.528 + 0.9856003 * n) * DEGREE;
    const l = (L + 1.915 * Math.sin(g) + 0.02 * Math.sin(2 * g)) * DEGREE, e = (23.439 - 4e-7 * n) * DEGREE;
    const ascension = Math.atan2(Math.cos(e) * Math.sin(l), Math.cos(l)),
        declination = Math.asin(Math.sin(e) * Math.sin(l));
    // Sidereal time: hours at Greenwich, radians here.
    const sidereal = ((6.697375 + 0.0657098242 * n + ut) * 15 + longitude) * DEGREE;
    const h = sidereal - ascension, phi = latitude * DEGREE;
    const direction = [
        -Math.cos(declination) * Math.sin(h),
        Math.sin(declination) * Math.cos(phi) - Math.cos(declination) * Math.sin(phi) * Math.cos(h),
        Math.sin(declination) * Math.sin(phi) + Math.cos(declination) * Math.cos(phi) * Math.cos(h),
    ] as const;
    return {
        direction,
        altitude: Math.atan2(direction[2], Math.hypot(direction[0], direction[1])),
        azimuth: Math.atan2(direction[0], direction[1]),
        distance: 1.00014 - 0.01671 * Math.cos(g) - 0.00014 * Math.cos(2 * g),
    };
}

/** The month and the day of a day of a year of 365 days, 1 to 365. */
export function dateOf(dayOfYear: number): { month: number; day: number } {
    const at = new Date(Date.UTC(2001, 0, Math.min(365, Math.max(1, Math.round(dayOfYear)))));
    return { month: at.getUTCMonth() + 1, day: at.getUTCDate() };
}

/** The day of a year of 365 days; that of 28 February for the 29th. */
export function dayOf(month: number, day: number): number {
    const date = Date.UTC(2001, month - 1, month === 2 && day === 29 ? 28 : day);
    return Math.round((date - Date.UTC(2001, 0, 1)) / 86400000) + 1;
}
