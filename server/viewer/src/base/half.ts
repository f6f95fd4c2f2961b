// Half precision (IEEE 754 binary16) as numbers: all 65,536 values in a table.

const table = new Float32Array(1 << 16);
for (let bits = 0; bits < 1 << 16; bits++) {
    const sign = bits & 0x8000 ? -1 : 1;
    const exponent = (bits >> 10) & 31;
    const fraction = bits & 1023;
    if (exponent === 0) table[bits] = sign * fraction * 2 ** -24;
    else if (exponent === 31) table[bits] = fraction === 0 ? sign * Infinity : NaN;
    else table[bits] = sign * (1 + fraction / 1024) * 2 ** (exponent - 15);
}

export function halfToNumber(bits: number): number {
    return table[bits];
}

/** count values from `first` on, times `scale`. */
export function halvesToFloats(bits: Uint16Array, first: number, count: number, scale: number): Float32Array {
    const values = new Float32Array(count);
    for (let i = 0; i < count; i++) values[i] = table[bits[first + i]] * scale;
    return values;
}
