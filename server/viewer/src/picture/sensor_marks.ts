// The sensors of a scene as marks in the picture: planes are discs, whose front is the side that they face, eyes have
// an arrow, cylinders are bars, spheres and probes balls. All are one object of instances. Knows their places and
// values, and nothing of requests.
import { BufferAttribute, DoubleSide, GLSL3, InstancedBufferAttribute, InstancedBufferGeometry, Matrix4, Mesh,
    RawShaderMaterial, Vector3, type PerspectiveCamera } from "three";
import { vectorOf, type PlacedSet, type SceneSensors } from "../state/sensors.ts";
import { turned, type SceneMesh } from "./glb.ts";
import type { Uniforms } from "./material.ts";

/** The radius of a mark, as shares of the distance between places, and of the scene's diagonal where there is no
 * distance, and at most. */
const OF_SPACING = 0.25, OF_DIAGONAL = 0.006, DIAGONAL_MOST = 0.01;

/** In a picture a radius is at least this share of the height, unless marks of a set would meet. */
const LEAST_SHARE = 0.007, SPACING_MOST = 0.46;

/** Around a mark a pointer still meets it, as a share of the height. */
const NEAR_SHARE = 0.004;

/** A mark lies nearer to the eye by this share, before the surface that it may be on. */
const NEARER = 0.003;

/** Discs that are seen from their edge are turned to the eye until they are this wide, as a share of their length. */
const WIDTH_LEAST = 0.35;

/** Shapes of marks. */
const DISC = 0, BALL = 1, ARROW = 2, BAR = 3;

/** In place of a value: none is known or asked for, and there is none. */
const UNKNOWN = -1, NONE = -2;

const vertexShader = `
precision highp float;
precision highp int;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform float least;          // of the radius over the depth
uniform int marked;           // an instance; -1: none
in vec3 position, at, axis;
in float value, shape, sensor;
in vec3 sizes;                // the radius, the most that it grows to, and its share that lifts the middle along the axis
out vec2 place;
flat out float light;
flat out int form, is_marked;

void main() {
    vec4 middle = modelViewMatrix * vec4(at, 1.0);
    float r = max(sizes.x, min(least * -middle.z, sizes.y));
    is_marked = int(sensor) == marked ? 1 : 0;
    if (is_marked == 1) r *= 1.5;
    place = position.xy;
    light = value;
    form = int(shape);
    vec3 along = mat3(modelViewMatrix) * axis, offset;
    middle.xyz += sizes.z * r * along;
    vec3 across = cross(along, middle.xyz);
    across = length(across) > 1e-6 * length(middle.xyz) ? normalize(across) : vec3(1.0, 0.0, 0.0);
    if (form == ${BALL}) offset = vec3(position.xy, 0.0);
    else if (form == ${ARROW}) offset = 2.0 * (1.0 + position.y) * along - 0.9 * position.x * across;
    else if (form == ${BAR}) offset = 1.2 * position.y * along - 0.45 * position.x * across;
    else {
        vec3 eye = -normalize(middle.xyz);
        float facing = dot(along, eye);
        if (abs(facing) < ${WIDTH_LEAST}) along = (facing < 0.0 ? -1.0 : 1.0) * ${WIDTH_LEAST} * eye
            + ${Math.sqrt(1 - WIDTH_LEAST ** 2)} * normalize(along - facing * eye);
        vec3 one = normalize(abs(along.x) < 0.8 ? cross(along, vec3(1.0, 0.0, 0.0)) : cross(along, vec3(0.0, 1.0, 0.0)));
        offset = position.x * one + position.y * cross(along, one);
    }
    // Of a set that is hidden nothing is left.
    gl_Position = sizes.x > 0.0 ? projectionMatrix * vec4((middle.xyz + r * offset) * ${1 - NEARER}, 1.0)
        : vec4(2.0, 2.0, 2.0, 1.0);
}
`;

const fragmentShader = `
precision highp float;
precision highp int;
uniform sampler2D palette;
uniform vec2 range;
uniform bool is_log;
uniform bool is_coloured;     // by value
uniform float required;       // below 0: nothing is
in vec2 place;
flat in float light;
flat in int form, is_marked;
layout(location = 0) out vec4 pixel;

const vec3 DARK = vec3(0.08), NEUTRAL = vec3(0.93), GREY = vec3(0.62), SHORT = vec3(0.9, 0.15, 0.15);
const vec3 MARKED = vec3(1.0, 0.85, 0.2);

// From 0 in the middle to 1 at the outline.
float outward() {
    if (form == ${BAR}) return max(abs(place.x), abs(place.y));
    if (form != ${ARROW}) return length(place);
    // A shaft, and a head over its last part.
    return place.y < 0.2 ? max(abs(place.x) / 0.35, -place.y) : 0.8 * abs(place.x) / max(1.0 - place.y, 1e-3);
}

vec3 colour_of(float value) {
    float t = is_log ? log2(max(value, 1e-30) / range.x) / log2(range.y / range.x)
        : (value - range.x) / (range.y - range.x);
    return texture(palette, vec2((clamp(t, 0.0, 1.0) * 255.0 + 0.5) / 256.0, 0.5)).rgb;
}

void main() {
    float out_of = outward(), smooth_by = clamp(fwidth(out_of), 1e-4, 0.5);
    float cover = clamp(0.5 + (1.0 - out_of) / smooth_by, 0.0, 1.0);
    bool is_valued = light > -0.5, is_none = light < -1.5, is_short = is_valued && light < required;
    vec3 fill = is_coloured && is_valued ? colour_of(light) : NEUTRAL;
    // Below what is required the rim is red and wide.
    float rim = 1.0 - (is_short || is_marked == 1 ? clamp(3.0 * smooth_by, 0.2, 0.45) : min(1.4 * smooth_by, 0.3));
    vec3 edge = is_marked == 1 ? MARKED : is_short ? SHORT : DARK;
    if (is_none) {
        // Hollow: a grey ring with a bar across it.
        fill = edge = GREY;
        bool is_bar = abs(place.x - place.y) < 0.25 && form != ${ARROW};
        if (out_of < 0.68 && !is_bar) cover = 0.0;
        if (is_marked == 1 && out_of > 0.68) edge = MARKED;
    } else if (form == ${DISC} && !gl_FrontFacing) {
        // From behind a disc is dark, with its value around.
        edge = is_marked == 1 ? MARKED : is_short ? SHORT : mix(DARK, fill, 0.75);
        rim = min(rim, 0.6);
        fill = DARK;
    } else if (form == ${BALL}) fill *= 1.0 - 0.45 * dot(place, place) + 0.25 * dot(place, vec2(-0.5, 0.5));
    float at_rim = clamp(0.5 + (out_of - rim) / smooth_by, 0.0, 1.0);
    // Marks of a few pixels have no dark rim: of a dense grid little else would be seen.
    float pixel_size = min(length(vec2(dFdx(place.x), dFdy(place.x))), length(vec2(dFdx(place.y), dFdy(place.y))));
    if (edge == DARK) at_rim *= clamp(2.0 - 5.0 * pixel_size, 0.0, 1.0);
    if (cover < 0.02) discard;
    pixel = vec4(mix(fill, edge, at_rim), cover);
}
`;

/** The distance between places that follow each other, or of a grid, m; null: there is none. */
function spacingOf({ at, spacing }: PlacedSet["set"]): number | null {
    if (spacing !== undefined) return Math.min(...spacing.filter((d) => d > 0));
    let least = Infinity;
    for (let k = 1; k < at.length; k++) {
        const distance = Math.hypot(...at[k].map((v, d) => v - at[k - 1][d]));
        if (distance > 0 && distance < least) least = distance;
    }
    return Number.isFinite(least) ? least : null;
}

function shapeOf(kind: PlacedSet["set"]["kind"], hasAxis: boolean): number {
    if (kind === "spheres" || kind === "probes" || !hasAxis) return BALL;
    return kind === "cylinders" ? BAR : DISC;
}

export class SensorMarks {
    readonly mesh: Mesh<InstancedBufferGeometry, RawShaderMaterial>;
    private readonly points: Float32Array;
    private readonly axes: Float32Array;
    private readonly sizes: Float32Array;
    /** Of each instance the place that it is of. */
    private readonly places: Float32Array;
    private readonly lights: Float32Array;
    /** In place of the values of places that never have one; NaN: values come. */
    private readonly fixed: Float32Array;
    /** The radius of each place, also while it is hidden. */
    private readonly radii: Float32Array;

    /** `diagonal` is that of the scene's bounds, m; the palette and its range are those of `uniforms`. */
    constructor(readonly sensors: SceneSensors, up: SceneMesh["up"], diagonal: number, uniforms: Uniforms) {
        const eyes = sensors.sets.filter(({ set }) => set.kind === "eyes"),
            n = sensors.places + eyes.reduce((sum, { count }) => sum + count, 0);
        [this.points, this.axes, this.sizes] = [0, 0, 0].map(() => new Float32Array(3 * n));
        [this.places, this.lights, this.radii] = [0, 0, 0].map(() => new Float32Array(n));
        this.fixed = new Float32Array(sensors.places).fill(NaN);
        for (const { first, count, isProbes, lacking } of sensors.sets) {
            if (isProbes) this.fixed.fill(UNKNOWN, first, first + count);
            for (const k of lacking) this.fixed[first + k] = NONE;
        }
        const shapes = new Float32Array(n);
        let next = 0;
        const add = (of: PlacedSet, k: number, shape: number | null, radius: number, most: number): void => {
            const { set, first } = of, own = vectorOf(set.look, k) ?? vectorOf(set.axis, k);
            this.points.set(turned(up, set.at[k]), 3 * next);
            this.axes.set(turned(up, own ?? [0, 0, 1]), 3 * next);
            this.sizes.set([radius, most, set.kind === "cubes" ? 1 : 0], 3 * next);
            this.radii[next] = radius;
            this.places[next] = first + k;
            shapes[next] = shape ?? shapeOf(set.kind, own !== null);
            next += 1;
        };
        for (const of of sensors.sets) {
            const spacing = spacingOf(of.set), radius = Math.min(DIAGONAL_MOST * diagonal, spacing === null
                ? OF_DIAGONAL * diagonal
                : OF_SPACING * spacing);
            for (let k = 0; k < of.count; k++)
                add(of, k, null, radius, spacing === null ? Infinity : SPACING_MOST * spacing);
        }
        // Arrows come last, so that a place is the instance of its number.
        for (const of of eyes) for (let k = 0; k < of.count; k++) add(of, k, ARROW, OF_DIAGONAL * diagonal, Infinity);
        this.mesh = new Mesh(this.makeGeometry(n, shapes), makeMaterial(uniforms));
        this.mesh.name = "sensors";
        this.mesh.frustumCulled = false;
        this.mesh.onBeforeRender = (_, __, camera): void => {
            const { material } = this.mesh;
            material.uniforms.least.value = leastOf(camera as PerspectiveCamera);
            material.uniformsNeedUpdate = true;
        };
        this.setValues(null);
    }

    private makeGeometry(n: number, shapes: Float32Array): InstancedBufferGeometry {
        const geometry = new InstancedBufferGeometry();
        geometry.instanceCount = n;
        geometry.setAttribute("position",
            new BufferAttribute(new Float32Array([-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0]), 3));
        geometry.setIndex([0, 1, 2, 0, 2, 3]);
        const parts = [["at", this.points, 3], ["axis", this.axes, 3], ["sizes", this.sizes, 3], ["value", this.lights,
            1], ["shape", shapes, 1], ["sensor", this.places, 1]] as const;
        for (const [name, numbers, size] of parts)
            geometry.setAttribute(name, new InstancedBufferAttribute(numbers, size));
        return geometry;
    }

    /** A value for each place, NaN where it has none; null: none are known. */
    setValues(values: Float32Array | null): void {
        const { lights, places, fixed } = this;
        for (let k = 0; k < lights.length; k++) {
            const place = places[k], value = values?.[place] ?? NaN;
            if (!Number.isNaN(fixed[place])) lights[k] = fixed[place];
            else lights[k] = values === null ? UNKNOWN : Number.isNaN(value) ? NONE : Math.max(0, value);
        }
        this.mesh.geometry.attributes.value.needsUpdate = true;
    }

    /** Hides the sets of these names, and shows all others. */
    hide(names: readonly string[]): void {
        const hidden = new Uint8Array(this.sensors.places), all = new Set(names);
        for (const { set, first, count } of this.sensors.sets)
            if (all.has(set.name)) hidden.fill(1, first, first + count);
        for (let k = 0; k < this.places.length; k++)
            this.sizes[3 * k] = hidden[this.places[k]] === 1 ? 0 : this.radii[k];
        this.mesh.geometry.attributes.sizes.needsUpdate = true;
    }

    /** The way that marks are drawn: coloured by value, with what is required, and the one that stands out. */
    style(isColoured: boolean, required: number | null, marked: number | null): void {
        const { uniforms } = this.mesh.material;
        uniforms.is_coloured.value = isColoured;
        uniforms.required.value = required ?? -1;
        uniforms.marked.value = marked ?? -1;
    }

    /** The place whose mark is met at (x, y), each from −1 to 1, the nearest of several; `reach` is the distance of the
     * surface there. O(places). */
    at(x: number, y: number, camera: PerspectiveCamera, reach: number | null): number | null {
        const view = new Matrix4().copy(camera.matrixWorld).invert().elements,
            least = leastOf(camera),
            near = NEAR_SHARE * leastOf(camera) / LEAST_SHARE;
        // The ray in the frame of the camera, by its depth.
        const inverse = new Matrix4().copy(camera.projectionMatrix).invert(),
            ray = new Vector3(x, y, 0.5).applyMatrix4(inverse);
        const [rx, ry] = [ray.x / -ray.z, ray.y / -ray.z], longer = Math.hypot(rx, ry, 1);
        const { points, axes, sizes, sensors } = this;
        let found: number | null = null, nearest = (reach ?? Infinity) * (1 + 2 * NEARER);
        for (let o = 0; o < 3 * sensors.places; o += 3) {
            if (sizes[o] <= 0) continue;
            let [px, py, pz] = [points[o], points[o + 1], points[o + 2]],
                depth = -(view[2] * px + view[6] * py + view[10] * pz + view[14]);
            const radius = Math.max(sizes[o], Math.min(least * depth, sizes[o + 1])), lift = sizes[o + 2] * radius;
            [px, py, pz] = [px + lift * axes[o], py + lift * axes[o + 1], pz + lift * axes[o + 2]];
            depth = -(view[2] * px + view[6] * py + view[10] * pz + view[14]);
            if (depth <= 0 || depth * longer >= nearest) continue;
            const right = view[0] * px + view[4] * py + view[8] * pz + view[12] - rx * depth,
                above = view[1] * px + view[5] * py + view[9] * pz + view[13] - ry * depth;
            if (Math.hypot(right, above) > radius + near * depth) continue;
            [found, nearest] = [o / 3, depth * longer];
        }
        return found;
    }

    dispose(): void {
        this.mesh.geometry.dispose();
        this.mesh.material.dispose();
    }
}

/** The least radius over the depth. */
function leastOf(camera: PerspectiveCamera): number {
    return 2 * LEAST_SHARE * Math.tan((camera.fov * Math.PI) / 360);
}

function makeMaterial({ palette, range, is_log }: Uniforms): RawShaderMaterial {
    return new RawShaderMaterial({
        glslVersion: GLSL3,
        uniforms: { palette, range, is_log, least: { value: 0 }, is_coloured: { value: false }, required: { value: -1 },
            marked: { value: -1 } },
        vertexShader,
        fragmentShader,
        side: DoubleSide,
        alphaToCoverage: true,
    });
}
