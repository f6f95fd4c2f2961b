// Days of a year of 365 days.

/** The month and the day of a day of the year, 1 to 365. */
export function dateOf(dayOfYear: number): { month: number; day: number } {
    const at = new Date(Date.UTC(2001, 0, Math.min(365, Math.max(1, Math.round(dayOfYear)))));
    return { month: at.getUTCMonth() + 1, day: at.getUTCDate() };
}

/** The day of the year; that of 28 February for the 29th. */
export function dayOf(month: number, day: number): number {
    const date = Date.UTC(2001, month - 1, month === 2 && day === 29 ? 28 : day);
    return Math.round((date - Date.UTC(2001, 0, 1)) / 86400000) + 1;
}

/** Hours from the beginning of the year, of which the daemon takes less than 8760. */
export function hourOfYear(day: number, hour: number): number {
    return Math.min(24 * (day - 1) + hour, 8759.9999);
}
