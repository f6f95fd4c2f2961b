// Reads and writes the NPY files that the daemon sends: little-endian <f2, <f4, <f8, in C order.

export interface Npy {
    shape: number[];
    /** <f2 as its bits. */
    data: Uint16Array | Float32Array | Float64Array;
}

export function readNpy(buffer: ArrayBuffer): Npy {
    const bytes = new Uint8Array(buffer);
    const view = new DataView(buffer);
    if (bytes.length < 12 || bytes[0] !== 0x93 || String.fromCharCode(...bytes.subarray(1, 6)) !== "NUMPY")
        throw new Error("the answer is no NPY file");
    const wide = bytes[6] > 1;
    const start = wide ? 12 : 10;
    const length = wide ? view.getUint32(8, true) : view.getUint16(8, true);
    const head = new TextDecoder("latin1").decode(bytes.subarray(start, start + length));
    const type = /'descr': *'(<f[248])'/.exec(head)?.[1];
    const shape = /'shape': *\(([^)]*)\)/.exec(head)?.[1];
    if (type === undefined || shape === undefined || /'fortran_order': *True/.test(head))
        throw new Error(`the head of the NPY answer is not understood: ${head.slice(0, 80)}`);
    const sizes = shape.split(",").map((s) => s.trim()).filter((s) => s !== "").map(Number);
    const count = sizes.reduce((product, size) => product * size, 1);
    const from = start + length;
    const size = Number(type[2]);
    if (bytes.length !== from + count * size)
        throw new Error(`the NPY answer has ${bytes.length - from} bytes, must have ${count * size}`);
    const aligned = from % size === 0 ? buffer : buffer.slice(from);
    const offset = from % size === 0 ? from : 0;
    const data = size === 2
        ? new Uint16Array(aligned, offset, count)
        : size === 4
        ? new Float32Array(aligned, offset, count)
        : new Float64Array(aligned, offset, count);
    return { shape: sizes, data };
}

export function writeNpy(values: Float32Array, shape: readonly number[]): Uint8Array<ArrayBuffer> {
    const shapeText = shape.length === 1 ? `(${shape[0]},)` : `(${shape.join(", ")})`;
    let head = `{'descr': '<f4', 'fortran_order': False, 'shape': ${shapeText}, }`;
    head = head.padEnd(Math.ceil((10 + head.length + 1) / 64) * 64 - 11) + "\n";
    const out = new Uint8Array(10 + head.length + values.byteLength);
    out.set([0x93, 0x4e, 0x55, 0x4d, 0x50, 0x59, 1, 0, head.length & 255, head.length >> 8]);
    out.set(new TextEncoder().encode(head), 10);
    out.set(new Uint8Array(values.buffer, values.byteOffset, values.byteLength), 10 + head.length);
    return out;
}
