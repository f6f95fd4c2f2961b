// Asks lambertd from Node.js 18 or later and from browsers: scenes, light, gradients; NPY both ways, halves as numbers.
// It depends on nothing. The manual is deploy/docs/javascript.md, its types stand in lambert.d.ts.
//
//     const scene = await open("http://127.0.0.1:8317/office", { token: "secret" });
//     const { values, shape, unit } = await scene.radiosity({ lamp: 17 });

const NPY = "application/x-npy", JSON_TYPE = "application/json";
const QUANTITIES = ["radiosity", "irradiance", "indirect"], PLACES = ["elements", "faces", "corners"];
const FIELDS = ["area", "normal", "centre", "group", "face", "reflectance"];
const EMISSION_MEMBERS = ["elements", "values", "groups", "sky", "sun", "luminaires", "emitters"];
const COTANGENT_MEMBERS = [...EMISSION_MEMBERS, "sensors"];
/** Vectors and bytes of a request; longer batches are several of them. */
const BATCH = 64, BATCH_BYTES = 2 ** 26;
/** What Node.js calls a connection that was closed while nobody used it. */
const CLOSED = ["UND_ERR_SOCKET", "ECONNRESET", "EPIPE"];

/** Any error of this module. Of an answer it has the members of its problem document (RFC 9457). */
export class LambertError extends Error {
    constructor(detail,
        { status = null, type = null, title = null, pointer = null, kind = null, route = null, retryAfter = null,
            cause } = {})
    {
        const before = route === null ? "" : status === null ? `${route}: ` : `${route}: ${status} `;
        super(`${before}${detail}${pointer === null ? "" : ` (${pointer})`}`, cause === undefined ? {} : { cause });
        this.name = "LambertError";
        Object.assign(this, { detail, status, type, title, pointer, route, retryAfter,
            kind: kind ?? type?.split("#")[1] ?? null });
    }
}

const refuse = (detail, kind = "refused") => {
    throw new LambertError(detail, { kind });
};
const listed = (value) => (Array.isArray(value) ? value : ArrayBuffer.isView(value) ? [...value] : [value]);
const isTyped = (value) => ArrayBuffer.isView(value) && !(value instanceof DataView);
const isArray = (value) => isTyped(value) || (isTyped(value?.values) && Array.isArray(value.shape));
const shapeText = (shape) => `[${shape.join(", ")}]`;
const product = (shape) => shape.reduce((all, size) => all * size, 1);

// Halves: IEEE 754 binary16.

let halves = null;

function table() {
    if (halves !== null) return halves;
    halves = new Float32Array(1 << 16);
    for (let bits = 0; bits < 1 << 16; bits++) {
        const sign = bits & 0x8000 ? -1 : 1, exponent = (bits >> 10) & 31, fraction = bits & 1023;
        halves[bits] = exponent === 0
            ? sign * fraction * 2 ** -24
            : exponent === 31
            ? (fraction === 0 ? sign * Infinity : NaN)
            : sign * (1 + fraction / 1024) * 2 ** (exponent - 15);
    }
    return halves;
}

export function halfToNumber(bits) {
    return table()[bits];
}

/** `count` values from `first` on, times `scale`. */
export function halvesToFloats(bits, first = 0, count = bits.length - first, scale = 1) {
    const values = new Float32Array(count), numbers = table();
    for (let i = 0; i < count; i++) values[i] = numbers[bits[first + i]] * scale;
    return values;
}

const word = new Float32Array(1), wordBits = new Uint32Array(word.buffer);

/** The nearest half, ties to even; from 65,520 on infinity. */
export function numberToHalf(value) {
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

export function floatsToHalves(values) {
    return Uint16Array.from(values, numberToHalf);
}

// NPY, in C order and little-endian, as all that runs JavaScript is.

const KINDS = { "<f2": Uint16Array, "<f4": Float32Array, "<f8": Float64Array, "<u4": Uint32Array, "<i4": Int32Array };

/** The array of an NPY file: its shape and its numbers in one row; halves are their bits. It shares the bytes where
 * it can. */
export function readNpy(buffer) {
    const fail = (detail) => refuse(`the answer is no NPY array: ${detail}`, "not-npy");
    const bytes = new Uint8Array(buffer), view = new DataView(buffer);
    if (bytes.length < 12 || bytes[0] !== 0x93 || String.fromCharCode(...bytes.subarray(1, 6)) !== "NUMPY")
        fail("it does not begin as one");
    const start = bytes[6] > 1 ? 12 : 10, length = bytes[6] > 1 ? view.getUint32(8, true) : view.getUint16(8, true);
    const head = new TextDecoder("latin1").decode(bytes.subarray(start, start + length));
    const type = /'descr': *'([^']*)'/.exec(head)?.[1], sizes = /'shape': *\(([^)]*)\)/.exec(head)?.[1];
    if (KINDS[type] === undefined || sizes === undefined || /'fortran_order': *True/.test(head))
        fail(`its head is ${head.slice(0, 80).trim()}`);
    const shape = sizes.split(",").map((size) => size.trim()).filter((size) => size !== "").map(Number);
    const from = start + length, kind = KINDS[type], size = kind.BYTES_PER_ELEMENT, count = product(shape);
    if (bytes.length !== from + count * size)
        fail(`it has ${bytes.length - from} bytes of numbers, must have ${count * size}`);
    return { shape, data: from % size === 0 ? new kind(buffer, from, count) : new kind(buffer.slice(from), 0, count) };
}

/** The bytes of an NPY file: <f8 of doubles, else <f4. */
export function writeNpy(values, shape = [values.length]) {
    const numbers = values instanceof Float32Array || values instanceof Float64Array
        ? values
        : Float32Array.from(values);
    if (product(shape) !== numbers.length) refuse(`${numbers.length} numbers have not the shape ${shapeText(shape)}`);
    const type = numbers instanceof Float64Array ? "<f8" : "<f4";
    let head = `{'descr': '${type}', 'fortran_order': False, 'shape': (${shape.join(", ")}${
        shape.length === 1 ? "," : ""
    }), }`;
    head = head.padEnd(Math.ceil((10 + head.length + 1) / 64) * 64 - 11) + "\n";
    const out = new Uint8Array(10 + head.length + numbers.byteLength);
    out.set([0x93, 0x4e, 0x55, 0x4d, 0x50, 0x59, 1, 0, head.length & 255, head.length >> 8]);
    out.set(new TextEncoder().encode(head), 10);
    out.set(new Uint8Array(numbers.buffer, numbers.byteOffset, numbers.byteLength), 10 + head.length);
    return out;
}

/** JSON, which takes typed arrays for lists; a number that is not finite is refused with its place. */
function toJson(value, path = "") {
    if (typeof value === "number" && !Number.isFinite(value)) refuse(`${path} = ${value}, must be finite`, "bad-value");
    if (typeof value !== "object" || value === null) return JSON.stringify(value);
    if (isTyped(value)) {
        const wrong = value.findIndex((number) => !Number.isFinite(number));
        return wrong < 0 ? `[${value.join(",")}]` : toJson(value[wrong], `${path}/${wrong}`);
    }
    if (Array.isArray(value)) return `[${value.map((member, i) => toJson(member, `${path}/${i}`)).join(",")}]`;
    return `{${
        Object.entries(value).filter(([, member]) => member !== undefined)
            .map(([name, member]) => `${JSON.stringify(name)}:${toJson(member, `${path}/${name}`)}`).join(",")
    }}`;
}

/** The numbers of lists of lists in one row, and their shape; null, which has no value, is NaN. */
function flat(nested, kind) {
    const shape = [];
    for (let at = nested; Array.isArray(at); at = at[0]) shape.push(at.length);
    return { shape, data: kind.from(nested.flat(shape.length - 1), (value) => value ?? NaN) };
}

/** The primitives of a binary glTF one after the other, as a mesh: GET …/mesh?corners has a corner for each vertex. */
function readCorners(file) {
    const length = new DataView(file).getUint32(12, true), start = 28 + length;
    const { meshes, accessors, bufferViews } = JSON.parse(new TextDecoder().decode(new Uint8Array(file, 20, length)));
    const primitives = meshes.flatMap((mesh) => mesh.primitives);
    const read = (which) => {
        const { bufferView, byteOffset = 0, componentType, count, type } = accessors[which];
        const from = start + (bufferViews[bufferView].byteOffset ?? 0) + byteOffset,
            kind = componentType === 5125 ? Uint32Array : Float32Array;
        return new kind(file.slice(from, from + 4 * count * { SCALAR: 1, VEC2: 2, VEC3: 3 }[type]));
    };
    const joined = (kind, parts) => {
        const all = new kind(parts.reduce((sum, part) => sum + part.length, 0));
        let at = 0;
        for (const part of parts) {
            all.set(part, at);
            at += part.length;
        }
        return all;
    };
    const of = (name) => primitives.map((primitive) => read(primitive.attributes[name]));
    let first = 0;
    const index = primitives.map((primitive) => {
        const before = first;
        first += accessors[primitive.attributes.POSITION].count;
        return read(primitive.indices).map((vertex) => vertex + before);
    });
    return { count: first, positions: joined(Float32Array, of("POSITION")), normals: joined(Float32Array, of("NORMAL")),
        element: joined(Uint32Array, of("_ELEMENT")), index: joined(Uint32Array, index) };
}

// Requests.

/** An answer of the daemon, whole. */
export class Reply {
    constructor(status, headers, body) {
        Object.assign(this, { status, headers, body });
    }

    json() {
        return JSON.parse(new TextDecoder().decode(this.body));
    }

    npy() {
        return readNpy(this.body);
    }

    get isNpy() {
        return this.header("Content-Type")?.startsWith(NPY) ?? false;
    }

    header(name) {
        return this.headers.get(name);
    }

    number(name) {
        return this.headers.has(name) ? Number(this.headers.get(name)) : null;
    }

    /** Milliseconds by the names of Server-Timing. */
    get times() {
        const all = (this.header("Server-Timing") ?? "").matchAll(/(\w+);dur=([\d.]+)/g);
        return Object.fromEntries([...all].map(([, name, ms]) => [name, Number(ms)]));
    }

    error(route) {
        const text = new TextDecoder().decode(this.body).trim(), { status } = this;
        let problem = null;
        try {
            problem = JSON.parse(text);
        } catch {
            // A proxy may have answered in words of its own.
        }
        if (typeof problem !== "object" || problem === null)
            problem = { detail: text.slice(0, 200) || "the answer has no body" };
        const { type, title, detail, pointer } = problem;
        return new LambertError(detail ?? title ?? "the answer says no more", { status, type, title, pointer, route,
            retryAfter: this.number("Retry-After") });
    }
}

function pause(ms, signal) {
    return new Promise((resolve, reject) => {
        const end = () => {
            clearTimeout(timer);
            reject(signal.reason);
        };
        const timer = setTimeout(() => {
            signal?.removeEventListener("abort", end);
            resolve();
        }, ms);
        signal?.addEventListener("abort", end, { once: true });
    });
}

/** A daemon, of which nothing is asked before it has to be. */
export class Daemon {
    constructor(address, { token = null, timeout = 60, retries = 4 } = {}) {
        let url;
        try {
            url = new URL(address, globalThis.document?.baseURI);
        } catch (cause) {
            throw new LambertError(`${address} is no address such as http://127.0.0.1:8317/NAME`, { kind: "refused",
                cause });
        }
        if (!/^https?:$/.test(url.protocol)) refuse(`${address} is no address such as http://127.0.0.1:8317/NAME`);
        this.address = `${url.origin}${url.pathname.replace(/\/*$/, "")}`;
        Object.assign(this, { token, timeout, retries, asked: 0 });
    }

    /** The answer to a request; one of another status than those accepted is an error. Those that only read or
     * compute are asked again where the daemon is busy. */
    async ask(method, path,
        { body, type, accept = JSON_TYPE, headers = {}, accepted = [200], signal, timeout = this.timeout } = {})
    {
        const url = new URL(path, `${this.address}/`), route = `${method} ${url.pathname}`;
        const until = timeout === null ? Infinity : performance.now() + 1000 * timeout;
        const isRepeatable = ["GET", "HEAD", "POST"].includes(method);
        let { retries } = this, mayBeClosed = isRepeatable && this.asked > 0;
        const all = { ...headers, Accept: accept };
        if (type !== undefined) all["Content-Type"] = type;
        if (this.token !== null) all.Authorization = `Bearer ${this.token}`;
        for (;;) {
            const left = until - performance.now();
            if (method === "POST" && timeout !== null) all["Lambert-Timeout"] = Math.max(left / 1000, 0.001).toFixed(3);
            let reply;
            try {
                reply = await this.#once(url, route, { method, body, headers: all }, left, timeout, signal);
            } catch (reason) {
                if (!mayBeClosed || !CLOSED.includes(reason?.cause?.cause?.code)) throw reason;
                mayBeClosed = false;
                continue;
            }
            if (accepted.includes(reply.status)) return reply;
            const wait = 1000 * Math.max(reply.number("Retry-After") || 1, 0.05);
            const isBusy = (reply.status === 429 || reply.status === 503) && isRepeatable && retries-- > 0;
            if (!isBusy || performance.now() + wait >= until) throw reply.error(route);
            await pause(wait, signal);
        }
    }

    async #once(url, route, request, left, timeout, signal) {
        signal?.throwIfAborted();
        const end = new AbortController(), stop = () => end.abort(signal.reason);
        const over = () => end.abort(new LambertError(`no answer within ${timeout} s`, { kind: "timed-out", route }));
        signal?.addEventListener("abort", stop, { once: true });
        const timer = left === Infinity ? 0 : setTimeout(over, Math.max(left, 0));
        this.asked += 1;
        try {
            const response = await fetch(url, { ...request, credentials: "omit", signal: end.signal });
            return new Reply(response.status, response.headers, await response.arrayBuffer());
        } catch (cause) {
            if (end.signal.aborted) throw end.signal.reason;
            const why = cause?.cause?.code ?? cause?.cause?.message ?? cause?.message ?? cause;
            throw new LambertError(`${this.address} does not answer: ${why}`, { kind: "disconnected", route, cause });
        } finally {
            clearTimeout(timer);
            signal?.removeEventListener("abort", stop);
        }
    }

    /** A request whose body is JSON. */
    post(path, body, { method = "POST", ...options } = {}) {
        return this.ask(method, path, { body: toJson(body), type: JSON_TYPE, ...options });
    }

    async scenes(options) {
        return (await this.ask("GET", "v1/scenes", options)).json().scenes;
    }

    /** The stores that could not be read, with the reason. */
    async refused(options) {
        return (await this.ask("GET", "v1/scenes", options)).json().refused ?? [];
    }

    /** One of its scenes; without a name the one that it has. */
    async scene(name, { check = 0, ...options } = {}) {
        if (name === undefined || name === null) {
            const names = (await this.scenes(options)).map((line) => line.name);
            if (names.length !== 1)
                refuse(
                    `${this.address} has ${names.length} scenes, so that one is named: ${names.join(", ") || "none"}`,
                );
            name = names[0];
        }
        const scene = new Scene(this, name, check);
        await scene.describe(options);
        return scene;
    }

    /** True where it is ready, false where it loads, drains or is gone. */
    async health({ timeout = 5, signal } = {}) {
        try {
            return (await this.ask("GET", "readyz", { timeout, signal })).status === 200;
        } catch (reason) {
            if (reason instanceof LambertError) return false;
            throw reason;
        }
    }

    async openapi(options) {
        return (await this.ask("GET", "v1/openapi.json", options)).json();
    }

    /** Azimuth and altitude of the sun at hours of a year of 365 days. */
    async sun(place, hours, { year, ...options } = {}) {
        return (await this.post("v1/sun", { place, hours, year }, options)).json();
    }

    /** The rows of a weather file. */
    async weather(text, { gaps, ...options } = {}) {
        return (await this.post("v1/weather", { text, gaps }, options)).json();
    }
}

// Emissions and answers.

/** An array as { data, shape }; a shape that the scene does not have is refused. */
function dense({ n, channels, name }, given, what) {
    const values = isTyped(given) ? given : given.values, shape = isTyped(given) ? [given.length] : given.shape;
    if (typeof values[0] === "bigint") refuse(`${what} holds large integers, must hold numbers`);
    const isOne = channels > 1 && isTyped(given) && values.length === channels * n ? [channels, n] : shape;
    if (String(isOne) !== String([n]) && String(isOne) !== String([channels, n])) {
        const many = channels > 1 ? ` or ${shapeText([channels, n])}` : "";
        refuse(
            `${what} has the shape ${shapeText(shape)}, must have ${shapeText([n])}${many} as the scene ${name} has, `
                + "or one level more for a batch",
            "wrong-length",
        );
    }
    const data = values instanceof Float32Array || values instanceof Float64Array ? values : Float64Array.from(values);
    return { data, shape: channels === 1 ? [n] : isOne };
}

/** One emission: { data, shape } of an array, or the object that requests have. */
function oneEmission(scene, given, what, members) {
    if (isArray(given)) return dense(scene, given, what);
    if (Array.isArray(given)) {
        const { shape, data } = flat(given, Float64Array);
        if (given.flat(Infinity).some((value) => typeof value !== "number") || data.length !== product(shape))
            refuse(`${what} must be a list of numbers, or of lists of numbers of one length`);
        return dense(scene, { values: data, shape }, what);
    }
    if (typeof given !== "object" || given === null)
        refuse(`${what} is ${given}, must be an object, a list or an array`);
    const known = Object.keys(given).filter((key) => members.includes(key));
    if (known.length === 0) return { groups: given };
    const others = Object.keys(given).filter((key) => !members.includes(key));
    if (others.length > 0)
        refuse(`${what} has ${known[0]} beside ${others.join(", ")}; put groups into { groups: { … } }`);
    return given;
}

/** The emissions of a question, and whether it is a batch: a list with an object or an array in it, or an array of
 * one more axis. */
function emissionsOf(scene, given, what = "emission", members = EMISSION_MEMBERS) {
    const { n, channels } = scene, one = channels * n;
    if (isArray(given) && !isTyped(given) && given.shape.length === (channels === 1 ? 2 : 3)) {
        const [m, ...rest] = given.shape;
        if (m > 0 && product(rest) === one && rest.at(-1) === n)
            given = Array.from({ length: m }, (_, i) => given.values.subarray(i * one, (i + 1) * one));
        else {
            refuse(
                `${what} has the shape ${shapeText(given.shape)}, must have ${
                    shapeText(channels === 1 ? [n] : [channels, n])
                } `
                    + "behind the number of a batch, m",
                "wrong-length",
            );
        }
    }
    if (!Array.isArray(given) || (given.length > 0 && given.every((e) => typeof e === "number" || Array.isArray(e))))
        return { isBatch: false, emissions: [oneEmission(scene, given, what, members)] };
    if (given.length === 0) refuse(`${what} is an empty batch`);
    return { isBatch: true,
        emissions: given.map((e, i) => oneEmission(scene, e, `${what} ${i} of the batch`, members)) };
}

const isDense = (emission) => emission.data !== undefined;

/** As JSON has it: lists, one for each channel. */
function plain(emission) {
    if (!isDense(emission)) return emission;
    const { data, shape } = emission;
    return shape.length === 1
        ? data
        : Array.from({ length: shape[0] }, (_, c) => data.subarray(c * shape[1], (c + 1) * shape[1]));
}

/** The NPY file of dense emissions, with an axis more of a batch. */
function stacked({ n, channels }, emissions, isBatch) {
    if (!isBatch) return writeNpy(emissions[0].data, emissions[0].shape);
    const one = channels * n,
        kind = emissions.every(({ data }) => data instanceof Float32Array) ? Float32Array : Float64Array;
    const all = new kind(emissions.length * one);
    emissions.forEach(({ data }, i) => {
        for (let at = i * one; at < (i + 1) * one; at += data.length) all.set(data, at);
    });
    return writeNpy(all, channels === 1 ? [emissions.length, n] : [emissions.length, channels, n]);
}

/** Numbers in one row with their shape, [n] or [C, n], one level deeper of a batch, and what is said of them. */
export class Answer {
    #values = null;

    constructor({ data, shape }, facts = {}) {
        const { unit = null, error = null, limited = null, convertedBy = null, certificate = null, iterations = null,
            times = {} } = facts;
        Object.assign(this, { data, shape, unit, error, limited, convertedBy, certificate, iterations, times });
    }

    /** As numbers: those of halves are decoded once. `data` has them as they came, halves as their bits. */
    get values() {
        this.#values ??= this.data instanceof Uint16Array ? halvesToFloats(this.data) : this.data;
        return this.#values;
    }

    /** The last axis in pieces: a channel each, of a batch one vector after the other. They share the memory. */
    rows() {
        const length = this.shape.at(-1) ?? 0;
        return Array.from({ length: length > 0 ? this.data.length / length : 0 },
            (_, i) => this.values.subarray(i * length, (i + 1) * length));
    }

    static of(reply, name, kind) {
        const { times } = reply;
        if (reply.isNpy) {
            return new Answer(reply.npy(), { times, unit: reply.header("Lambert-Unit"),
                convertedBy: reply.header("Lambert-Converted-By"), limited: reply.number("Lambert-Limited"),
                certificate: reply.number("Lambert-Certificate"), iterations: reply.number("Lambert-Iterations") });
        }
        const read = reply.json();
        return new Answer(flat(read[name ?? read.quantity], kind), { ...read, times, convertedBy: read.converted_by });
    }

    /** The answer to a batch of answers to its parts; its error is the worst one. */
    static joined(parts) {
        if (parts.length === 1) return parts[0];
        const data = new parts[0].data.constructor(parts.reduce((all, part) => all + part.data.length, 0)), times = {};
        let at = 0;
        for (const part of parts) {
            data.set(part.data, at);
            at += part.data.length;
            for (const [name, ms] of Object.entries(part.times)) times[name] = (times[name] ?? 0) + ms;
        }
        const all = (name) => (parts.some((part) => part[name] === null) ? null : parts.flatMap((part) => part[name]));
        const worst = parts.map((part) => part.error).sort((a, b) => (b?.stated ?? -1) - (a?.stated ?? -1))[0];
        const shape = [parts.reduce((m, part) => m + part.shape[0], 0), ...parts[0].shape.slice(1)];
        return new Answer({ data, shape }, { ...parts[0], times, error: worst, limited: all("limited"),
            certificate: all("certificate"), iterations: all("iterations") });
    }
}

/** A scene of a daemon; `open` or Daemon.scene give it. */
export class Scene {
    #tag = null;
    /** That of all answers of this store, where the daemon sends it. */
    #ownTag = null;
    #checked = 0;
    #known = new Map();

    constructor(daemon, name, check) {
        Object.assign(this, { daemon, name, check, about: null });
    }

    get n() {
        return this.about.elements;
    }

    get channels() {
        return this.about.channels;
    }

    /** That of a vector in answers: [n] of one channel, [C, n] of more. */
    get shape() {
        return this.channels === 1 ? [this.n] : [this.channels, this.n];
    }

    /** "W", so that light is in W/m², or "lm". */
    get units() {
        return this.about.lights ?? "W";
    }

    /** Of its groups. */
    get names() {
        return this.about.groups.map((group) => group.name);
    }

    path(what = "", variant) {
        return `v1/scenes/${encodeURIComponent(variant === undefined ? this.name : `${this.name}@${variant}`)}${what}`;
    }

    /** Reads what it is; `open` has done so. SceneChanged where it was known and its geometry is another one now. */
    async describe(options = {}) {
        const reply = await this.daemon.ask("GET", this.path(), { ...options, accepted: [200, 202] });
        if (reply.status === 202) {
            throw new LambertError(`${this.name} is being built; open it again in a while`, { status: 202,
                kind: "building" });
        }
        const now = reply.json(), before = this.about;
        if (before !== null && geometryOf(now) !== geometryOf(before)) {
            refuse(`the scene ${this.name} was replaced by one of another geometry: ${now.elements} elements, `
                + `${now.channels} channels, in place of ${before.elements} and ${before.channels}; open it again`,
                "scene-changed");
        }
        // The same geometry under other light or materials: indices and areas mean what they did.
        [this.about, this.#tag, this.#checked] = [now, reply.header("ETag"), performance.now()];
        this.#ownTag = reply.header("Lambert-Scene");
        this.#known.clear();
    }

    /** After answers, before they are used: they are of the scene that was opened, by the tag that they have, or of
     * one that is still there. By HEAD, as Node.js keeps a connection waiting after an answer 304 that states its
     * length. */
    async #stillThere(replies, { signal, timeout, variant }) {
        if (this.check < 0) return;
        const tags = replies.map((reply) => reply.header("Lambert-Scene"));
        if (variant === undefined && this.#ownTag !== null && !tags.includes(null)) {
            if (tags.some((tag) => tag !== this.#ownTag)) await this.describe({ signal, timeout });
            return;
        }
        if (performance.now() - this.#checked < 1000 * this.check || this.#tag === null) return;
        const reply = await this.daemon.ask("HEAD", this.path(), { signal, timeout, accepted: [200, 202, 404, 422] });
        if (reply.header("ETag") === this.#tag) this.#checked = performance.now();
        else await this.describe({ signal, timeout });
    }

    /** What was asked for once and is kept while the store is the same. */
    async #kept(name, ask) {
        if (this.#known.has(name)) return this.#known.get(name);
        const { about } = this, answer = await ask();
        if (about === this.about) this.#known.set(name, answer);
        return answer;
    }

    #document(name, options) {
        return this.#kept(name, async () => {
            if (this.about[name] === null) return null;
            return (await this.daemon.ask("GET", this.path(`/${name}`), options)).json();
        });
    }

    /** Arrays of its elements, of the fields that are asked for: area [n] (m²), normal and centre [n, 3], group and
     * face [n], reflectance [C, n]. */
    async elements(fields = FIELDS, options = {}) {
        const names = listed(fields), seen = [];
        const one = (field) =>
            this.#kept(`elements ${field}`, async () => {
                const reply = await this.daemon.ask("GET", this.path(`/elements?fields=${field}`), { ...options,
                    accept: NPY });
                seen.push(reply);
                const { shape, data } = reply.npy();
                const count = field === "reflectance" ? shape.at(-1) : shape[0];
                if (count !== this.n)
                    refuse(
                        `the scene ${this.name} has ${count} elements instead of ${this.n}: it was replaced; open it again`,
                        "scene-changed",
                    );
                return data;
            });
        const all = await Promise.all(names.map(async (field) => [field, await one(field)]));
        if (seen.length > 0) await this.#stillThere(seen, options);
        return Object.fromEntries(all);
    }

    /** Its groups by name, with area (m²), elements, buried, reflectance and emission [C] and the `indices` of their
     * elements. */
    groups(options = {}) {
        return this.#kept("groups", async () => {
            const [reply, { group }] = await Promise.all([this.daemon.ask("GET", this.path("/groups"), options),
                this.elements("group", options)]);
            const lines = reply.json().groups, indices = lines.map((line) => new Uint32Array(line.elements)),
                filled = new Uint32Array(lines.length);
            group.forEach((g, i) => (indices[g][filled[g]++] = i));
            return new Map(lines.map((line, g) => [line.name, { ...line, indices: indices[g] }]));
        });
    }

    /** Its luminaires by name; empty without any. */
    async luminaires(options) {
        return new Map((await this.#document("luminaires", options))?.luminaires.map((one) => [one.name, one]));
    }

    /** Its sets of sensors by name; empty without any. */
    async sensors(options) {
        return new Map((await this.#document("sensors", options))?.sets.map((set) => [set.name, set]));
    }

    /** The tiles of its sky; null without one. */
    sky(options) {
        return this.#document("sky", options);
    }

    /** Its elements as a GLB file. */
    async mesh(options = {}) {
        return (await this.daemon.ask("GET", this.path("/mesh"), { ...options, accept: "model/gltf-binary" })).body;
    }

    /** The mesh of an answer `at: "corners"`: vertex v has value v. */
    async corners(options = {}) {
        const seen = [];
        const made = await this.#kept("corners", async () => {
            seen.push(
                await this.daemon.ask("GET", this.path("/mesh?corners"), { ...options, accept: "model/gltf-binary" }),
            );
            return readCorners(seen[0].body);
        });
        if (seen.length > 0) await this.#stillThere(seen, options);
        return made;
    }

    /** B = E + rho H of all surfaces, with all bounces, or of a batch of emissions: see lambert.d.ts for what an
     * emission may be. */
    async radiosity(emission, { format, stated, variant, signal, timeout, ...members } = {}) {
        const { tolerance, select, at } = members, { isBatch, emissions } = emissionsOf(this, emission);
        if (select?.sensors !== undefined) members.quantity ??= "irradiance";
        if (oneOf(members.quantity ?? "radiosity", QUANTITIES, "quantity") === "radiosity") delete members.quantity;
        oneOf(at ?? "elements", PLACES, "at");
        oneOf(format ?? "f4", ["f2", "f4", "f8"], "format");
        if (select !== undefined)
            members.select = Object.fromEntries(Object.entries(select).map(([name, of]) => [name, listed(of)]));
        const path = this.path("/radiosity", variant),
            asJson = stated ?? (select !== undefined && format === undefined);
        const accept = asJson ? JSON_TYPE : format === undefined ? NPY : `${NPY}; dtype=${format}`;
        const kind = (format ?? (tolerance === undefined ? "f4" : "f8")) === "f8" ? Float64Array : Float32Array;
        const isBare = emissions.every(isDense) && Object.values(members).every((value) => value === undefined)
            && !asJson;
        const parts = [], seen = [];
        for (const some of this.#parts(emissions)) {
            const reply = await (isBare
                ? this.daemon.ask("POST", path, { body: stacked(this, some, isBatch), type: NPY, accept, signal,
                    timeout })
                : this.daemon.post(path, { ...members, ...several("emission", some, isBatch) }, { accept, signal,
                    timeout }));
            seen.push(reply);
            parts.push(Answer.of(reply, null, kind));
        }
        const answer = Answer.joined(parts), isWhole = select === undefined && (at ?? "elements") === "elements";
        if (isWhole) this.#fits(answer.shape, isBatch ? [emissions.length] : [], "");
        const count = at === "corners" ? this.#known.get("corners")?.count ?? answer.shape.at(-1) : answer.shape.at(-1);
        if (count !== answer.shape.at(-1)) {
            refuse(
                `the scene ${this.name} answers ${answer.shape.at(-1)} corners instead of ${count}: it was replaced; `
                    + "open it again",
                "scene-changed",
            );
        }
        if (select?.sensors === undefined && select?.probes === undefined)
            await this.#stillThere(seen, { signal, timeout, variant });
        return answer;
    }

    irradiance(emission, options) {
        return this.radiosity(emission, { ...options, quantity: "irradiance" });
    }

    indirect(emission, options) {
        return this.radiosity(emission, { ...options, quantity: "indirect" });
    }

    /** Figures of groups or of sets of sensors: mean, sum, min, max, uniformity, variance, share (with `atLeast`)
     * and ugr. */
    async reduce(emission,
        { groups, sensors, figures = ["mean"], atLeast, quantity = "irradiance", variant, signal, timeout,
            ...members } = {})
    {
        if ((groups === undefined) === (sensors === undefined))
            refuse("figures are of groups or of sensors: one of the two is given");
        oneOf(quantity, QUANTITIES, "quantity");
        const { isBatch, emissions } = emissionsOf(this, emission),
            of = groups === undefined ? { sensors: listed(sensors) } : { groups: listed(groups) };
        const words = [...new Set([...listed(figures), ...(atLeast === undefined ? [] : ["share"])])];
        const reduce = { ...of, with: words, at_least: atLeast === undefined ? undefined : listed(atLeast) };
        const reply = await this.daemon.post(this.path("/radiosity", variant), { ...members, quantity, reduce,
            ...several("emission", emissions, isBatch) }, { signal, timeout });
        const read = reply.json(), { error = null, unit, limited = null, converted_by: convertedBy = null } = read;
        if (emissions.some(isDense)) await this.#stillThere([reply], { signal, timeout, variant });
        return { figures: groups === undefined ? read.sensors : read.groups, error, unit, limited, convertedBy,
            times: reply.times };
    }

    /** Gradients of J = sum g q: an answer of one name, an object of answers by name of several. */
    async adjoint(cotangent, { gradient = "emission", quantity, emission, format, variant, signal, timeout } = {}) {
        const { isBatch, emissions } = emissionsOf(this, cotangent, "cotangent", COTANGENT_MEMBERS),
            names = listed(gradient);
        if (oneOf(quantity ?? "radiosity", QUANTITIES, "quantity") === "radiosity") quantity = undefined;
        if (names.length === 0)
            refuse("gradient names nothing; it is of emission, reflectance, sky, emitters, groups or luminaires");
        const light = emission === undefined
            ? undefined
            : plain(oneEmission(this, emission, "emission", EMISSION_MEMBERS));
        const accept = names.length > 1 ? JSON_TYPE : format === undefined ? NPY : `${NPY}; dtype=${format}`;
        const isBare = String(names) === "emission" && quantity === undefined && light === undefined
            && emissions.every(isDense);
        const path = this.path("/adjoint", variant), kind = format === "f8" ? Float64Array : Float32Array, parts = [],
            seen = [];
        for (const some of this.#parts(emissions)) {
            const reply = await (isBare
                ? this.daemon.ask("POST", path, { body: stacked(this, some, isBatch), type: NPY, accept, signal,
                    timeout })
                : this.daemon.post(path, { ...several("cotangent", some.map(weighed), isBatch), gradient: names,
                    quantity, emission: light }, { accept, signal, timeout }));
            seen.push(reply);
            const read = reply.isNpy ? null : reply.json().gradient;
            parts.push(
                names.map((
                    name,
                ) => (read === null ? Answer.of(reply) : new Answer(flat(read[name], kind), { times: reply.times }))),
            );
        }
        const found = names.map((_, i) => Answer.joined(parts.map((part) => part[i])));
        names.forEach((name, i) => {
            if (name === "emission" || name === "reflectance")
                this.#fits(found[i].shape, isBatch ? [emissions.length] : [], "a gradient of ");
        });
        await this.#stillThere(seen, { signal, timeout, variant });
        return Array.isArray(gradient) ? Object.fromEntries(names.map((name, i) => [name, found[i]])) : found[0];
    }

    /** Matrices of derivatives of light at { sensors }, of means of { groups } or values of { elements }, by what
     * `by` names. */
    async jacobian(of, { by, quantity, variant, signal, timeout } = {}) {
        const what = Object.fromEntries(Object.entries(of).map(([name, value]) => [name, listed(value)]));
        const body = { of: what, by: by === undefined ? undefined : listed(by), quantity };
        const reply = await this.daemon.post(this.path("/jacobian", variant), body, { signal, timeout }),
            read = reply.json(),
            rows = {};
        let first = 0;
        for (const [name, count] of read.sensors === undefined
            ? (read.groups ?? []).map((name) => [name, 1])
            : Object.entries(read.sensors))
        {
            rows[name] = { first, count };
            first += count;
        }
        if (of.elements !== undefined) await this.#stillThere([reply], { signal, timeout, variant });
        const matrices = Object.entries(read.jacobian).map((
            [name, matrix],
        ) => [name, new Answer(flat(matrix, Float32Array), { times: reply.times })]);
        return { matrices: Object.fromEntries(matrices), columns: read.columns, rows };
    }

    /** Radiances of the tiles of one sky, or of each of a list of them. */
    async skies(skies, options) {
        const found = (await this.daemon.post(this.path("/skies"), { skies: listed(skies) }, options)).json().skies;
        return Array.isArray(skies) ? found : found[0];
    }

    /** The rows of the weather file beside the store. */
    async weather({ gaps, ...options } = {}) {
        return (await this.daemon.post(this.path("/weather"), { gaps }, options)).json();
    }

    /** The same scene under other reflectances, when it is built. */
    async variant(name, reflectances, { signal, timeout = this.daemon.timeout } = {}) {
        const until = timeout === null ? Infinity : performance.now() + 1000 * timeout,
            body = { variant: name, groups: reflectances };
        await this.daemon.post(this.path("/reflectance"), body, { method: "PUT", accepted: [202], signal, timeout });
        const made = new Scene(this.daemon, `${this.name}@${name}`, this.check);
        for (let wait = 5;; wait = Math.min(2 * wait, 200)) {
            try {
                await made.describe({ signal, timeout });
                return made;
            } catch (reason) {
                if (reason.kind !== "building") throw reason;
            }
            if (performance.now() > until)
                throw new LambertError(`the variant is not built within ${timeout} s`, { kind: "timed-out",
                    route: `GET /${made.path()}` });
            await pause(wait, signal);
        }
    }

    /** Removes a variant. */
    async delete(options = {}) {
        await this.daemon.ask("DELETE", this.path(), { ...options, accepted: [204] });
    }

    #parts(emissions) {
        const step = Math.max(1, Math.min(BATCH, Math.floor(BATCH_BYTES / (8 * this.n * this.channels))));
        return Array.from({ length: Math.ceil(emissions.length / step) },
            (_, i) => emissions.slice(i * step, (i + 1) * step));
    }

    /** A scene that was replaced by one of another size is noticed by its answer. */
    #fits(shape, before, what) {
        const wanted = [...before, ...this.shape], luminance = [...before, this.n];
        if (String(shape) === String(wanted) || String(shape) === String(luminance)) return;
        refuse(
            `the scene ${this.name} answers ${what || "the shape "}${shapeText(shape)} instead of ${
                shapeText(wanted)
            }: it was replaced; `
                + "open it again",
            "scene-changed",
        );
    }
}

/** The things that have to stay for an index to mean the same. */
function geometryOf({ elements, channels, groups, provenance }) {
    return JSON.stringify([elements, channels, groups.map((line) => [line.name, line.elements]),
        provenance?.geometry_hash]);
}

function oneOf(value, among, what) {
    if (!among.includes(value)) refuse(`${what} ${value} is none of ${among.join(", ")}`, "unknown-word");
    return value;
}

const several = (name, all, isBatch) => (isBatch ? { [`${name}s`]: all.map(plain) } : { [name]: plain(all[0]) });

/** A cotangent of sensors, one weight for all of a set or a list of them. */
function weighed(cotangent) {
    if (cotangent.sensors === undefined) return cotangent;
    const of = Object.entries(cotangent.sensors).map((
        [name, weight],
    ) => [name, isTyped(weight) ? { values: weight } : weight]);
    return { ...cotangent, sensors: Object.fromEntries(of) };
}

/** Keeps a few questions on their way and of those that wait only the newest: a slider that is dragged asks as often
 * as the daemon answers, and never for what nobody will see. */
export class Newest {
    #waiting = null;
    #onTheirWay = 0;
    #sent = 0;
    #shown = 0;

    constructor(ask, show, fail, most = 2) {
        Object.assign(this, { ask, show, fail, most });
    }

    want(request) {
        this.#waiting = { request };
        this.#send();
    }

    /** Answers to what was asked before are not shown any more. */
    forget() {
        this.#waiting = null;
        this.#shown = this.#sent;
    }

    get isIdle() {
        return this.#onTheirWay === 0 && this.#waiting === null;
    }

    #send() {
        if (this.#waiting === null || this.#onTheirWay >= this.most) return;
        const { request } = this.#waiting, turn = ++this.#sent;
        this.#waiting = null;
        this.#onTheirWay += 1;
        const end = (then) => (result) => {
            this.#onTheirWay -= 1;
            then(result);
        };
        this.ask(request).then(end((answer) => {
            this.#send();
            // An older answer that comes late is dropped.
            if (turn <= this.#shown) return;
            this.#shown = turn;
            this.show(answer, request);
        }), end((reason) => {
            if (turn > this.#shown) this.fail(reason);
            this.#send();
        }));
    }
}

/** The daemon at an address such as "http://127.0.0.1:8317"; in a page it may be relative. */
export function connect(address, options) {
    return new Daemon(address, options);
}

/** A scene by an address such as "http://127.0.0.1:8317/office", or `options.scene`; without a name the one that the
 * daemon has. */
export async function open(address, { scene, check, signal, ...options } = {}) {
    const daemon = new Daemon(address, options);
    if (scene === undefined && !/\/$/.test(String(address))) {
        const found = /^(https?:\/\/[^/]+)(?:(.*)\/(.+))?$/.exec(daemon.address);
        if (found?.[3] !== undefined) {
            scene = decodeURIComponent(found[3]);
            daemon.address = found[1] + found[2].replace(/\/v1\/scenes$/, "");
        }
    }
    return daemon.scene(scene, { check, signal });
}
