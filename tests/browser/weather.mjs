// Weather files for tests, WEA and EPW, and what `lambert sky` makes of them.
import { readFileSync } from "node:fs";

/** Hours of clear, broken and overcast weather: every bin of clearness, a low sun, night, and a sun below the horizon. */
export const HOURS = [];
for (const [month, day, cloud] of [[3, 21, 0], [6, 21, 0.15], [6, 22, 0.5], [12, 21, 0.3], [12, 22, 1]])
    for (let hour = 0; hour < 24; hour++) {
        const up = Math.max(0, Math.sin((Math.PI * (hour + 0.5 - 6)) / 12)) * (month === 12 ? 0.5 : 1);
        HOURS.push([month, day, hour + 0.5, Math.round(950 * Math.sqrt(up) * Math.max(0, 1 - 1.6 * cloud)), Math.round(up * (60 + 350 * cloud))]);
    }
export const [LATITUDE, LONGITUDE, ZONE] = [37.5, -122.25, -8];

export const wea = (units = 1) => `place Somewhere_XX\nlatitude ${LATITUDE}\nlongitude ${-LONGITUDE}\ntime_zone ${-15 * ZONE}\nsite_elevation 2.0\n`
    + `weather_data_file_units ${units}\n${HOURS.map((h) => h.join(" ")).join("\n")}\n`;
export const epw = () => `LOCATION,Somewhere,XX,USA,TMY3,0,${LATITUDE},${LONGITUDE},${ZONE},2.0\nDESIGN CONDITIONS,0\nTYPICAL/EXTREME PERIODS,0\n`
    + "GROUND TEMPERATURES,0\nHOLIDAYS/DAYLIGHT SAVINGS,No,0,0,0\nCOMMENTS 1,\nCOMMENTS 2,\nDATA PERIODS,3,1,A,Sunday,3/21,3/21,B,Sunday, 6/21, 6/22,C,Sunday,12/21,12/22\n"
    + HOURS.map(([m, d, h, direct, diffuse]) => `1997,${m},${d},${h + 0.5},0,?,15.0,${m},60,101300,0,0,300,0,${direct},${diffuse},0,0,0,0\n`).join("");

/** Single-precision rows of an NPY file. */
export function rowsOf(file, length) {
    const bytes = readFileSync(file), start = 10 + bytes.readUInt16LE(8);
    const values = new Float32Array(bytes.buffer.slice(bytes.byteOffset + start, bytes.byteOffset + bytes.length));
    return Array.from({ length: values.length / length }, (_, k) => values.subarray(k * length, (k + 1) * length));
}
