// Values of elements and of sensors as text, for spreadsheets (RFC 4180).

/** The shortest text that reads as this number of single precision. */
export function floatText(value: number): string {
    for (let digits = 6; digits < 9; digits++) {
        const text = value.toPrecision(digits);
        if (Math.fround(Number(text)) === value) return String(Number(text));
    }
    return String(Number(value.toPrecision(9)));
}

export function csvCell(text: string): string {
    return /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}

/** A line for each element: number, group, area in m², values; values is [C][n] in single precision. */
export function csvOf(values: Float32Array, names: readonly string[], groupOf: Uint32Array, groups: readonly string[],
    area: Float64Array): string
{
    const n = area.length, cells = groups.map(csvCell),
        lines = [["element", "group", "area_m2", ...names.map(csvCell)].join(",")];
    for (let i = 0; i < n; i++) {
        let line = `${i},${cells[groupOf[i]]},${Number(area[i].toPrecision(7))}`;
        for (let c = 0; c < names.length; c++) line += `,${floatText(values[c * n + i])}`;
        lines.push(line);
    }
    return `${lines.join("\r\n")}\r\n`;
}

/** A line for each sensor; one without a value has an empty cell. */
export function sensorLinesOf(
    sensors: readonly { set: string; at: readonly number[]; axis: readonly number[]; value: number }[],
    unit: string,
): string {
    const lines = sensors.map(({ set, at, axis, value }) =>
        [csvCell(set), ...[...at, ...axis].map((x) => String(Number(x.toPrecision(9)))),
            Number.isNaN(value) ? "" : floatText(value)].join(",")
    );
    return `${[`sensors,x [m],y [m],z [m],nx,ny,nz,irradiance (${unit})`, ...lines].join("\r\n")}\r\n`;
}
