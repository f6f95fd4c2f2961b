// The state as the fragment of a link: #1.BASE64URL of JSON, only what differs from the first state.
import { QUANTITIES } from "../daemon/api.ts";
import type { Rgb } from "../base/colour.ts";
import { firstLighting, firstState, firstView, PALETTES, SKY_MODELS, skyOff, TONES, UNITS, type Lighting,
    type LuminaireLight, type Moment, type Place, type SkyLight, type State, type View } from "./state.ts";

/** Of powers and weights: products of two of them are still numbers of single precision. */
const LIGHT_MOST = 1e12;

type Plain = { [name: string]: unknown };

function isPlain(value: unknown): value is Plain {
    return typeof value === "object" && value !== null && !Array.isArray(value);
}

/** The members of `now` that are not those of `first`. */
function difference(now: Plain, first: Plain): Plain {
    const out: Plain = {};
    for (const [name, value] of Object.entries(now))
        if (JSON.stringify(value) !== JSON.stringify(first[name])) out[name] = value;
    return out;
}

/** Members of the right type replace those of the first state; others come from links of strangers and are dropped. */
function restore<T extends object>(first: T, given: unknown, loose: readonly string[]): T {
    if (!isPlain(given)) return first;
    const out: Plain = { ...(first as Plain) };
    for (const [name, value] of Object.entries(given)) {
        if (!(name in out)) continue;
        const kind = typeof out[name];
        if (loose.includes(name) || (typeof value === kind && Array.isArray(value) === Array.isArray(out[name])))
            out[name] = value;
    }
    return out as T;
}

/** One of the names that there are, or the first state's. */
const oneOf = <T extends string>(names: readonly T[], value: unknown, otherwise: T): T =>
    names.find((name) => name === value) ?? otherwise;

const number = (value: unknown, otherwise: number): number =>
    typeof value === "number" && Number.isFinite(value) ? value : otherwise;

/** A number of a link within its range. */
const held = (value: number, otherwise: number, low: number, high: number): number =>
    Math.min(high, Math.max(low, number(value, otherwise)));

function restoreMoment(given: unknown): Moment | null {
    if (!isPlain(given)) return null;
    const { dewPoint } = given,
        of = (name: string, low: number, high: number): number => held(given[name] as number, low, low, high);
    return {
        day: Math.round(of("day", 1, 365)),
        hour: of("hour", 0, 24),
        year: Math.round(of("year", 1900, 2100)),
        direct: of("direct", 0, 3000),
        isHorizontal: given.isHorizontal === true,
        diffuse: of("diffuse", 0, 3000),
        dewPoint: typeof dewPoint === "number" ? held(dewPoint, 0, -100, 100) : null,
    };
}

function restoreSky(given: unknown): SkyLight {
    const out = restore(skyOff, given, ["moment"]);
    return {
        model: oneOf(SKY_MODELS, out.model, "off"),
        strength: held(out.strength, skyOff.strength, 0, 1e6),
        factor: held(out.factor, 1, 0, 1e3),
        turbidity: held(out.turbidity, skyOff.turbidity, 1, 20),
        direct: held(out.direct, skyOff.direct, 0, 3000),
        diffuse: held(out.diffuse, skyOff.diffuse, 0, 3000),
        sun: oneOf(["spread", "tile", "exact", "off"], out.sun, "spread"),
        tinted: out.tinted,
        latitude: held(out.latitude, skyOff.latitude, -90, 90),
        longitude: held(out.longitude, skyOff.longitude, -180, 180),
        zone: held(out.zone, skyOff.zone, -14, 14),
        day: Math.round(held(out.day, skyOff.day, 1, 365)),
        hour: held(out.hour, skyOff.hour, 0, 24),
        moment: restoreMoment(out.moment),
    };
}

function restoreLighting(given: unknown): Lighting {
    // A link without lights asks for those that the scene comes with.
    if (given === undefined) return firstLighting;
    const out = restore(firstLighting, given, ["solo", "soloLuminaire"]);
    const groups: Lighting["groups"] = {};
    for (const [name, light] of Object.entries(out.groups)) {
        if (!isPlain(light)) continue;
        groups[name] = {
            on: light.on !== false,
            power: held(light.power as number, 0, 0, LIGHT_MOST),
            colour: restoreColour(light.colour),
            kelvin: typeof light.kelvin === "number" ? light.kelvin : null,
        };
    }
    const emitters: Lighting["emitters"] = {};
    for (const [index, weight] of Object.entries(out.emitters)) emitters[index] = held(weight, 0, 0, LIGHT_MOST);
    const solo = typeof out.solo === "string" ? out.solo : null;
    return {
        groups,
        emitters,
        luminaires: restoreLuminaires(out.luminaires),
        dim: held(out.dim, 1, 0, LIGHT_MOST),
        sky: restoreSky(out.sky),
        solo,
        soloLuminaire: solo === null && typeof out.soloLuminaire === "string" ? out.soloLuminaire : null,
    };
}

function restoreLuminaires(given: { readonly [name: string]: unknown }): Lighting["luminaires"] {
    const lights = Object.entries(given).flatMap(([name, light]): [string, LuminaireLight][] =>
        isPlain(light)
            ? [[name, {
                on: light.on !== false,
                dim: held(light.dim as number, 0, 0, LIGHT_MOST),
                tint: restoreColour(light.tint),
                kelvin: typeof light.kelvin === "number" ? light.kelvin : null,
            }]]
            : []
    );
    return Object.fromEntries(lights);
}

function restoreColour(given: unknown): Rgb {
    const colour: unknown[] = Array.isArray(given) && given.length === 3 ? given : [1, 1, 1];
    return colour.map((v) => Math.max(0, number(v, 1))) as Rgb;
}

function isPlace(value: unknown): value is Place {
    if (!Array.isArray(value) || !value.every((v) => Number.isFinite(v))) return false;
    return value.length === 6
        || (value.length === 10 && value[6] > 0 && value[6] < 180 && Math.hypot(value[7], value[8], value[9]) > 0.5);
}

function restoreView(given: unknown): View {
    const view = restore(firstView, given, ["exposure", "range", "threshold", "judged", "camera", "required"]);
    const orNull = (
        value: unknown,
    ): number | null => (typeof value === "number" && Number.isFinite(value) ? value : null);
    const range = Array.isArray(view.range) && view.range.length === 2 && view.range.every((v) => Number.isFinite(v))
        ? view.range
        : null;
    return {
        ...view,
        picture: oneOf(["light", "false"], view.picture, "light"),
        quantity: oneOf(QUANTITIES, view.quantity, firstView.quantity),
        tone: oneOf(TONES, view.tone, firstView.tone),
        palette: oneOf(PALETTES, view.palette, firstView.palette),
        unit: oneOf(UNITS, view.unit, firstView.unit),
        isoLines: Math.round(held(view.isoLines, 0, 0, 100)),
        uniformity: held(view.uniformity, firstView.uniformity, 0, 1),
        range,
        exposure: view.exposure === null ? null : held(view.exposure, 0, -60, 60),
        threshold: orNull(view.threshold),
        required: typeof view.required === "number" && view.required >= 0 ? orNull(view.required) : null,
        hiddenSets: (view.hiddenSets as unknown[]).filter((name) => typeof name === "string"),
        judged: typeof view.judged === "string" ? view.judged : null,
        camera: isPlace(view.camera) ? view.camera : null,
    };
}

function restoreSensor(given: unknown): State["sensor"] {
    if (!isPlain(given)) return null;
    const { set, index } = given;
    return typeof set === "string" && Number.isInteger(index) && (index as number) >= 0
        ? { set, index: index as number }
        : null;
}

function toBase64Url(text: string): string {
    const bytes = new TextEncoder().encode(text);
    let raw = "";
    for (const byte of bytes) raw += String.fromCharCode(byte);
    return btoa(raw).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

function fromBase64Url(text: string): string {
    const raw = atob(text.replaceAll("-", "+").replaceAll("_", "/"));
    return new TextDecoder().decode(Uint8Array.from(raw, (c) => c.charCodeAt(0)));
}

/** `momentOf` is the weather of a light, where a link has to hold that. */
export function toFragment(state: State, momentOf: (light: SkyLight) => Moment | null): string {
    const whole = (lighting: Lighting): Lighting => ({ ...lighting,
        sky: { ...lighting.sky, moment: momentOf(lighting.sky) } });
    const plain = difference(state as unknown as Plain, firstState as unknown as Plain), { compare } = state;
    plain.lighting = whole(state.lighting);
    if (state.presets.length > 0)
        plain.presets = state.presets.map((preset) => ({ ...preset, lighting: whole(preset.lighting) }));
    if (compare !== null && compare.lighting !== null)
        plain.compare = { ...compare, lighting: whole(compare.lighting) };
    plain.view = difference(state.view as unknown as Plain, firstView as unknown as Plain);
    return "#1." + toBase64Url(JSON.stringify(plain));
}

/** The state of a fragment; null where there is none or it is no state. */
export function fromFragment(fragment: string): State | null {
    if (!fragment.startsWith("#1.")) return null;
    let given: unknown;
    try {
        given = JSON.parse(fromBase64Url(fragment.slice(3)));
    } catch {
        return null;
    }
    if (!isPlain(given)) return null;
    const state = restore(firstState, given, ["compare", "tolerance", "sensor"]);
    const compare = isPlain(state.compare) ? state.compare as unknown as Plain : null;
    return {
        ...state,
        lighting: restoreLighting(given.lighting),
        view: restoreView(given.view),
        presets: (state.presets as unknown[]).filter(isPlain)
            .map((p) => ({ name: String(p.name), lighting: restoreLighting(p.lighting) })),
        views: (state.views as unknown[]).filter(isPlain)
            .flatMap((v) => (isPlace(v.camera) ? [{ name: String(v.name), camera: v.camera }] : [])),
        pins: state.pins.filter((pin) => Number.isInteger(pin) && pin >= 0),
        sensor: restoreSensor(state.sensor),
        tolerance: typeof state.tolerance === "number" ? state.tolerance : null,
        compare: compare === null ? null : {
            how: compare.how === "split" ? "split" : "difference",
            scene: typeof compare.scene === "string" ? compare.scene : null,
            lighting: compare.lighting === null ? null : restoreLighting(compare.lighting),
            split: number(compare.split, 0.5),
        },
    };
}
