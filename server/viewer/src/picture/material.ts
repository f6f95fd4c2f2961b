// The shaders. One texel per element and channel, half precision as the daemon sent it; a vertex looks up the texel of
// its element (flat) or of its node (smooth, whose light a pass over the nodes makes). Tone curve, exposure, palette,
// iso-lines, threshold and the comparison are in the fragment shader: none of them costs a request.
import { CustomBlending, GLSL3, Matrix4, OneFactor, OneMinusSrcAlphaFactor, RawShaderMaterial, ShaderChunk, Vector2,
    Vector3, Vector4, type IUniform, type Texture } from "three";
import type { MeshPane } from "./glb.ts";
import { glassPasses, glassVector, sunSeen } from "./sun_shadow.ts";

const fetchElement = `
uniform highp sampler2D values_a, values_b;
uniform int elements, channels;
uniform vec3 weights;
uniform bool is_textured;                // light on images is shown by what falls on them
uniform highp sampler2D reflectance;     // of elements with an image, by channel; else 1

float texel(highp sampler2D values, int i) {
    int width = textureSize(values, 0).x;
    return texelFetch(values, ivec2(i % width, i / width), 0).r;
}

// The colour of an element; other numbers of channels than three are shown as their mean.
vec3 element_colour(highp sampler2D values, int i) {
    if (channels == 3) {
        vec3 value = vec3(texel(values, i), texel(values, elements + i), texel(values, 2 * elements + i));
        if (!is_textured) return value;
        // B / rho = H: the image at each pixel takes the place of its mean.
        return value / max(vec3(texel(reflectance, i), texel(reflectance, elements + i),
            texel(reflectance, 2 * elements + i)), 0.004);
    }
    float sum = 0.0;
    for (int c = 0; c < channels; c++) sum += texel(values, c * elements + i);
    // One channel has grey images.
    if (is_textured) sum /= max(texel(reflectance, i), 0.004);
    return vec3(sum / float(channels));
}
`;

/** Fills the texture of nodes: each is the sum of its parts, and each of these the sum of elements by weights, nowhere
 * below 0 and its share of the least of them. */
const nodesFragment = `
precision highp float;
precision highp int;
precision highp usampler2D;
${fetchElement}
uniform usampler2D node_parts, node_first, node_elements;
uniform highp sampler2D node_weights;
uniform int node_count;
layout(location = 0) out vec4 sum_a;
layout(location = 1) out vec4 sum_b;

uint entry(usampler2D list, int i) {
    int width = textureSize(list, 0).x;
    return texelFetch(list, ivec2(i % width, i / width), 0).r;
}

void main() {
    int width = textureSize(node_parts, 0).x;
    int node = int(gl_FragCoord.y) * width + int(gl_FragCoord.x);
    if (node >= node_count) discard;
    int part = int(entry(node_parts, node)), last = int(entry(node_parts, node + 1));
    sum_a = sum_b = vec4(0.0, 0.0, 0.0, 1.0);
    for (; part < last; part++) {
        int first = int(entry(node_first, part)), end = int(entry(node_first, part + 1));
        vec3 a = vec3(0.0), b = vec3(0.0), least_a = vec3(0.0), least_b = vec3(0.0);
        float share = 0.0;
        for (int k = first; k < end; k++) {
            int element = int(entry(node_elements, k));
            float weight = texel(node_weights, k);
            vec3 own_a = element_colour(values_a, element), own_b = element_colour(values_b, element);
            a += weight * own_a;
            b += weight * own_b;
            share += weight;
            least_a = min(least_a, own_a);
            least_b = min(least_b, own_b);
        }
        sum_a.rgb += max(a, share * least_a);
        sum_b.rgb += max(b, share * least_b);
    }
}
`;

const nodesVertex = `
precision highp float;
in vec3 position;
void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }
`;

const sceneVertex = `
precision highp float;
precision highp int;
precision highp sampler2D;
${fetchElement}
uniform mat4 modelViewMatrix, projectionMatrix;
uniform sampler2D nodes_a, nodes_b;
uniform bool is_smooth;
in vec3 position;
in vec2 uv;
in uvec2 ids; // element, node
centroid out vec3 place; // beyond a wall's edge the sun shines
// Where a pixel's middle is outside a triangle, light is taken inside: a narrow one would have it far off its corners'
// there.
centroid out vec3 colour_a, colour_b;
centroid out vec2 place_in_image;
flat out int element;

vec3 node_colour(sampler2D nodes, int i) {
    int width = textureSize(nodes, 0).x;
    return texelFetch(nodes, ivec2(i % width, i / width), 0).rgb;
}

void main() {
    element = int(ids.x);
    if (is_smooth) {
        colour_a = node_colour(nodes_a, int(ids.y));
        colour_b = node_colour(nodes_b, int(ids.y));
    } else {
        colour_a = element_colour(values_a, element);
        colour_b = element_colour(values_b, element);
    }
    place_in_image = uv;
    place = position;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}
`;

const sceneFragment = `
precision highp float;
precision highp int;
#define saturate(a) clamp(a, 0.0, 1.0)
${ShaderChunk.tonemapping_pars_fragment}
uniform vec3 weights;
uniform int picture;          // 0: as the eye sees it, 1: false colour
uniform int tone;             // 0: linear, 1: AgX, 2: ACES
uniform vec2 scale;           // of the values of a and b to the unit shown
uniform float exposure;
uniform sampler2D palette;
uniform vec2 range;
uniform bool is_log;
uniform float iso_lines;
uniform float threshold;      // below 0: none
uniform bool is_marked;       // stripes on the judged elements where there is no threshold
uniform int compare;          // 0: a alone, 1: a left and b right of the split, 2: b − a
uniform float change;         // of b − a: at this it is all blue or all red
uniform float split;          // in pixels
uniform int hovered;
uniform ivec4 pins;
uniform sampler2D judged;     // 1 where the threshold judges an element
uniform bool is_textured;
uniform sampler2D image;
uniform vec3 factor;
centroid in vec3 colour_a, colour_b;
centroid in vec2 place_in_image;
flat in int element;
centroid in vec3 place;
uniform bool is_sunny;        // the sun is drawn
uniform vec3 sun_direction;
uniform vec3 sun_light;       // what faces it receives
${sunSeen}
${glassPasses}
uniform bool is_soft;         // several points of its disc were looked from
uniform highp sampler2D sun_places;       // of the pixels: place, and number of the element from 1
uniform highp sampler2D sun_sum;          // of what was seen from the points
uniform float sun_part;                   // of one point
uniform highp sampler2D reflectances;     // of all elements
uniform highp sampler2D reflectance;      // of elements with an image; else 1
layout(location = 0) out vec4 pixel;

// True where a pixel was looked at on the face that this one shows.
bool is_same_face(vec4 there, vec3 normal) {
    int other = int(there.w + 0.5) - 1;
    if (other < 0 || other == element) return other == element;
    return dot(three(normals, other), normal) > 0.95 && abs(dot(there.xyz - place, normal)) < 2.0 * sun_step.x;
}

// A pixel and its neighbours, the nearest first.
const ivec2 AROUND[9] = ivec2[9](ivec2(0, 0), ivec2(-1, 0), ivec2(1, 0), ivec2(0, -1), ivec2(0, 1), ivec2(-1, -1),
    ivec2(1, -1), ivec2(-1, 1), ivec2(1, 1));

// The share of the sun that is seen. A pixel at an edge has several faces, and was looked at on one of them: a
// neighbour may have been on this one; else the last map tells.
float sun_share(vec3 normal) {
    if (is_soft) {
        ivec2 most = textureSize(sun_places, 0) - 1;
        for (int k = 0; k < 9; k++) {
            ivec2 at = clamp(ivec2(gl_FragCoord.xy) + AROUND[k], ivec2(0), most);
            if (is_same_face(texelFetch(sun_places, at, 0), normal)) return texelFetch(sun_sum, at, 0).r * sun_part;
        }
    }
    return sun_seen(place, normal);
}

vec3 sunshine() {
    vec3 normal = three(normals, element);
    float cosine = dot(normal, sun_direction);
    if (cosine <= 0.0) return vec3(0.0);
    vec3 reflected = three(reflectances, element);
    if (is_textured) reflected /= max(three(reflectance, element), 0.004);
    // The light that passes a pane is not yet dimmed where the pane itself reflects it.
    if (glass.x > 0.0) reflected /= max(glass_passes(cosine), 0.004);
    return reflected * sun_light * cosine * sun_share(normal);
}

float in_range(float value) {
    return is_log ? log2(max(value, 1e-30) / range.x) / log2(range.y / range.x)
        : (value - range.x) / (range.y - range.x);
}

vec3 to_srgb(vec3 c) {
    return mix(12.92 * c, 1.055 * pow(max(c, 0.0), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}

bool is_judged(int i) {
    int width = textureSize(judged, 0).x;
    return texelFetch(judged, ivec2(i % width, i / width), 0).r > 0.5;
}

void main() {
    bool right = compare == 1 && gl_FragCoord.x > split;
    vec3 colour = right ? colour_b * scale.y : colour_a * scale.x;
    if (is_sunny && compare == 0) colour += sunshine();
    if (is_textured) colour *= texture(image, place_in_image).rgb * factor;
    float value = dot(colour, weights);
    vec3 shown;
    if (compare == 2) {
        // Blue where b is darker, red where it is brighter; the colours stand in changes.ts, too.
        float t = clamp((dot(colour_b, weights) * scale.y - value) / change, -1.0, 1.0);
        shown = to_srgb(mix(vec3(0.8), t < 0.0 ? vec3(0.02, 0.13, 0.65) : vec3(0.62, 0.02, 0.05), abs(t)));
    } else if (picture == 1) {
        float t = clamp(in_range(value), 0.0, 1.0);
        shown = texture(palette, vec2((t * 255.0 + 0.5) / 256.0, 0.5)).rgb;
        if (iso_lines > 0.0) {
            float level = in_range(value) * iso_lines, width = fwidth(level);
            if (width > 1e-9 && abs(level - round(level)) < 0.75 * width && round(level) > 0.5
                && round(level) < iso_lines + 0.5) shown *= 0.25;
        }
    } else {
        vec3 exposed = colour * exposure;
        vec3 toned = tone == 1 ? AgXToneMapping(exposed) : tone == 2 ? ACESFilmicToneMapping(exposed)
            : saturate(exposed * toneMappingExposure);
        shown = to_srgb(saturate(toned));
    }
    if (threshold >= 0.0 && is_judged(element)) {
        // Red has stripes, for those who see red and green alike.
        bool is_dark = value < threshold;
        shown = mix(shown, is_dark ? vec3(0.9, 0.15, 0.15) : vec3(0.1, 0.75, 0.3), 0.55);
        if (is_dark && mod(gl_FragCoord.x - gl_FragCoord.y, 12.0) < 3.0) shown *= 0.55;
    } else if (is_marked && is_judged(element) && mod(gl_FragCoord.x + gl_FragCoord.y, 14.0) < 2.0)
        shown = mix(shown, vec3(1.0, 0.85, 0.2), 0.7);
    bool is_picked = element == hovered || any(equal(pins, ivec4(element)));
    if (is_picked) shown = mix(shown, vec3(1.0, 0.85, 0.2), 0.5);
    if (right && gl_FragCoord.x < split + 1.5 || compare == 1 && abs(gl_FragCoord.x - split) < 1.0) shown = vec3(1.0);
    if (glass.x > 0.0) {
        // What lies behind a pane is dimmed, in the light of the screen, and the pane's own light comes on top of it; a
        // colour that stands for a number is mixed with it.
        float passes = glass_passes(1.0), alpha = 1.0 - passes;
        bool is_light = picture == 0 && compare != 2 && !is_picked;
        if (is_light) alpha = 1.0 - pow(passes, 1.0 / 2.2);
        if (is_picked) alpha = max(alpha, 0.5);
        pixel = vec4(is_light ? shown : shown * alpha, alpha);
        return;
    }
    pixel = vec4(shown, 1.0);
}
`;

export type Uniforms = { [name: string]: IUniform };

export function makeUniforms(nothing: Texture): Uniforms {
    const of = (value: unknown): IUniform => ({ value });
    return {
        values_a: of(nothing),
        values_b: of(nothing),
        nodes_a: of(nothing),
        nodes_b: of(nothing),
        judged: of(nothing),
        node_parts: of(null),
        node_first: of(null),
        node_elements: of(null),
        node_weights: of(nothing),
        node_count: of(0),
        elements: of(1),
        channels: of(1),
        weights: of(new Vector3(1, 0, 0)),
        is_smooth: of(false),
        picture: of(0),
        tone: of(1),
        scale: of(new Vector2(1, 1)),
        exposure: of(1),
        toneMappingExposure: of(1),
        is_textured: of(false),
        reflectance: of(nothing),
        palette: of(nothing),
        range: of(new Vector2(0, 1)),
        is_log: of(false),
        iso_lines: of(0),
        threshold: of(-1),
        is_marked: of(false),
        is_sunny: of(false),
        sun_direction: of(new Vector3(0, 1, 0)),
        sun_light: of(new Vector3()),
        sun_matrix: of(new Matrix4()),
        sun_step: of(new Vector2()),
        sun_depth: of(nothing),
        sun_glass: of(nothing),
        normals: of(nothing),
        reflectances: of(nothing),
        is_soft: of(false),
        sun_places: of(nothing),
        sun_sum: of(nothing),
        sun_part: of(1),
        compare: of(0),
        change: of(1),
        split: of(0),
        hovered: of(-1),
        pins: of(new Vector4(-1, -1, -1, -1)),
    };
}

/** The material of what has this image; all others of its uniforms are shared. */
export function sceneMaterial(uniforms: Uniforms, image: Texture,
    factor: readonly [number, number, number]): RawShaderMaterial
{
    return new RawShaderMaterial({
        glslVersion: GLSL3,
        uniforms: { ...uniforms, image: { value: image }, factor: { value: new Vector3(...factor) },
            glass: { value: new Vector3() } },
        vertexShader: sceneVertex,
        fragmentShader: sceneFragment,
    });
}

/** The material of a group of panes, which are drawn after all else and hide nothing. */
export function paneMaterial(uniforms: Uniforms, white: Texture, { glass }: MeshPane,
    isByAngle: boolean): RawShaderMaterial
{
    const material = sceneMaterial(uniforms, white, [1, 1, 1]);
    material.uniforms.glass = { value: glassVector(glass, isByAngle) };
    material.transparent = true;
    material.depthWrite = false;
    material.blending = CustomBlending;
    material.blendSrc = OneFactor;
    material.blendDst = OneMinusSrcAlphaFactor;
    return material;
}

export function nodesMaterial(uniforms: Uniforms): RawShaderMaterial {
    return new RawShaderMaterial({
        glslVersion: GLSL3,
        uniforms,
        vertexShader: nodesVertex,
        fragmentShader: nodesFragment,
        depthTest: false,
        depthWrite: false,
    });
}
