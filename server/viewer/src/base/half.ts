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

const word = new Float32Array(1), wordBits = new Uint32Array(word.buffer);

/** The nearest half, ties to even; beyond 65,504 infinity. */
export function numberToHalf(value: number): number {
    word[0] = value;
    const bits = wordBits[0], sign = (bits >>> 16) & 0x8000, size = bits & 0x7fffffff;
    if (size > 0x7f800000) return sign | 0x7e00;
    if (size >= 0x477ff000) return sign | 0x7c00;
    // Below 2^-14 halves are multiples of 2^-24, which scaling makes integers.
    if (size < 0x38800000) {
        const exact = Math.abs(word[0]) * 2 ** 24, floor = Math.floor(exact), rest = exact - floor;
        return sign | (floor + (rest > 0.5 || (rest === 0.5 && (floor & 1) === 1) ? 1 : 0));
    }
    return sign | ((size - 0x38000000 + 0xfff + ((size >>> 13) & 1)) >>> 13);
}

export function floatsToHalves(values: Float32Array): Uint16Array {
    const out = new Uint16Array(values.length);
    for (let i = 0; i < values.length; i++) out[i] = numberToHalf(values[i]);
    return out;
}
