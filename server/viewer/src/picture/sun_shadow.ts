// Shadows of the sun: depths of the scene seen from the sun, from both sides of faces, as light meets them.
import { Box3, BufferAttribute, Color, CustomBlending, DepthTexture, DoubleSide, FloatType, GLSL3, Matrix4, Mesh,
    NearestFilter, OrthographicCamera, RawShaderMaterial, RedFormat, Scene, SrcColorFactor, Vector3, WebGLRenderTarget,
    ZeroFactor, type BufferGeometry, type Texture, type WebGLRenderer } from "three";
import type { Glass } from "./glb.ts";

/** Texels of a side: a room of 10 m has some of 3 mm. */
const SIDE = 4096;

/** The part of the light that a face of a pane passes, by the cosine of its angle to the normal: the law of stores
 * (store/FORMAT.md, glass_law). */
export const glassPasses = `
uniform vec3 glass;           // part of all its faces (0: opaque), their number, 1 where less passes aslant

float glass_passes(float cosine) {
    float sine = sqrt(max(1.0 - cosine * cosine, 0.0));
    float whole = glass.x * mix(1.0, min(1.0, 1.018 * cosine * (1.0 + sine * sine * sine)), glass.z);
    return pow(whole, 1.0 / glass.y);
}
`;

export function glassVector({ transmittance, faces }: Glass, isByAngle: boolean): Vector3 {
    return new Vector3(transmittance, faces, isByAngle ? 1 : 0);
}

/** Reads the map. */
export const sunSeen = `
uniform mat4 sun_matrix;      // of places to those in the map of depths
uniform vec2 sun_step;        // a texel: m, and as a part of the range of depths
uniform highp sampler2D sun_depth;
uniform sampler2D sun_glass;  // the part that panes before it pass
uniform highp sampler2D normals;          // [3][elements], as reflectances are
uniform int elements;

vec3 three(highp sampler2D values, int i) {
    int width = textureSize(values, 0).x;
    ivec3 at = i + ivec3(0, elements, 2 * elements);
    return vec3(texelFetch(values, ivec2(at.x % width, at.x / width), 0).r,
        texelFetch(values, ivec2(at.y % width, at.y / width), 0).r,
        texelFetch(values, ivec2(at.z % width, at.z / width), 0).r);
}

// The share of the sun that is seen: a mean over three texels by three, linear between places. The place is lifted by
// as much as a plane's own depths reach into these, which also keeps the end of a wall from letting light in at a
// corner.
float sun_seen(vec3 place, vec3 normal) {
    vec3 at = (sun_matrix * vec4(place + 2.5 * sun_step.x * normal, 1.0)).xyz;
    float depth = at.z - 0.25 * sun_step.y, seen = 0.0;
    vec2 texels = at.xy * vec2(textureSize(sun_depth, 0)) - 0.5, part = fract(texels);
    ivec2 low = ivec2(floor(texels)) - 1, most = textureSize(sun_depth, 0) - 1;
    vec4 across = vec4(1.0 - part.x, 1.0, 1.0, part.x), up = vec4(1.0 - part.y, 1.0, 1.0, part.y);
    for (int j = 0; j < 4; j++)
        for (int i = 0; i < 4; i++) {
            ivec2 near = clamp(low + ivec2(i, j), ivec2(0), most);
            seen += across[i] * up[j] * step(depth, texelFetch(sun_depth, near, 0).r);
        }
    return seen / 9.0 * texture(sun_glass, at.xy).r;
}
`;

const vertexShader = `
precision highp float;
uniform mat4 modelViewMatrix, projectionMatrix;
in vec3 position;
void main() { gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }
`;

const fragmentShader = `
precision highp float;
layout(location = 0) out vec4 nothing;
void main() { nothing = vec4(0.0); }
`;

const paneVertex = `
precision highp float;
uniform mat4 modelViewMatrix, projectionMatrix;
in vec3 position;
out vec3 place;
void main() {
    place = (modelViewMatrix * vec4(position, 1.0)).xyz;
    gl_Position = projectionMatrix * vec4(place, 1.0);
}
`;

/** The sun looks along -z. */
const paneFragment = `
precision highp float;
${glassPasses}
in vec3 place;
layout(location = 0) out vec4 passes;
void main() {
    float cosine = abs(normalize(cross(dFdx(place), dFdy(place))).z);
    passes = vec4(glass_passes(cosine));
}
`;

/** The light that panes pass is multiplied, one behind the other, as far as the first opaque face. Of the two sides of
 * a pane one looks to the sun. */
function paneShadow(glass: Glass, isByAngle: boolean): RawShaderMaterial {
    return new RawShaderMaterial({ glslVersion: GLSL3, vertexShader: paneVertex, fragmentShader: paneFragment,
        uniforms: { glass: { value: glassVector(glass, isByAngle) } }, transparent: true, depthWrite: false,
        blending: CustomBlending, blendSrc: ZeroFactor, blendDst: SrcColorFactor });
}

/** What is drawn of a body whose parts have materials: all parts but panes, which stand last, have this one. */
export function opaqueMaterials(material: RawShaderMaterial, opaque: number, panes: number): RawShaderMaterial[] {
    const hidden = new RawShaderMaterial({ visible: false });
    return Array.from({ length: opaque + panes }, (_, k) => (k < opaque ? material : hidden));
}

/** The parts of a body, by their materials: opaque ones, then panes. */
export interface Parts {
    opaque: number;
    panes: Glass[];
    isByAngle: boolean;
}

export class SunShadow {
    readonly depth: DepthTexture;
    /** Of places in the scene to [0, 1]³. */
    readonly matrix = new Matrix4();
    /** The larger side of a texel, and the range of depths, m. */
    texel = 0;
    range = 1;
    private readonly target: WebGLRenderTarget;
    private readonly camera = new OrthographicCamera();
    private readonly scene = new Scene();
    private readonly material = new RawShaderMaterial({ glslVersion: GLSL3, vertexShader, fragmentShader,
        side: DoubleSide, colorWrite: false });
    private readonly box: Box3;

    private readonly paneMaterials: RawShaderMaterial[];

    constructor(private readonly renderer: WebGLRenderer, geometry: BufferGeometry, parts: Parts) {
        const side = Math.min(SIDE, renderer.capabilities.maxTextureSize);
        this.depth = new DepthTexture(side, side, FloatType);
        this.depth.minFilter = this.depth.magFilter = NearestFilter;
        this.target = new WebGLRenderTarget(side, side, { format: RedFormat, depthTexture: this.depth,
            generateMipmaps: false });
        this.box = new Box3().setFromBufferAttribute(geometry.getAttribute("position") as BufferAttribute);
        this.paneMaterials = parts.panes.map((glass) => paneShadow(glass, parts.isByAngle));
        const opaque = Array.from({ length: parts.opaque }, () => this.material);
        const body = new Mesh(geometry, [...opaque, ...this.paneMaterials]);
        body.frustumCulled = false;
        this.scene.add(body);
    }

    /** The light that panes let pass, at each texel. */
    get glass(): Texture {
        return this.target.texture;
    }

    /** Draws the depths for a unit vector to the sun. */
    draw(sun: Vector3): void {
        const { camera, box } = this, centre = box.getCenter(new Vector3()),
            size = Math.max(1e-3, box.getSize(new Vector3()).length());
        camera.position.copy(centre).addScaledVector(sun, size);
        camera.up.set(0, 1, 0);
        if (Math.abs(sun.y) > 0.99) camera.up.set(0, 0, 1);
        camera.lookAt(centre);
        camera.updateMatrixWorld();
        // The box as the sun sees it, and a little around it.
        const seen = box.clone().applyMatrix4(camera.matrixWorldInverse), edge = 1e-3 * size;
        [camera.left, camera.right, camera.bottom, camera.top] = [seen.min.x - edge, seen.max.x + edge,
            seen.min.y - edge, seen.max.y + edge];
        [camera.near, camera.far] = [-seen.max.z - edge, -seen.min.z + edge];
        camera.updateProjectionMatrix();
        this.texel = Math.max(camera.right - camera.left, camera.top - camera.bottom) / this.target.width;
        this.range = camera.far - camera.near;
        this.matrix.set(0.5, 0, 0, 0.5, 0, 0.5, 0, 0.5, 0, 0, 0.5, 0.5, 0, 0, 0, 1).multiply(camera.projectionMatrix)
            .multiply(camera.matrixWorldInverse);
        const { renderer } = this, before = renderer.getRenderTarget(), alpha = renderer.getClearAlpha(),
            colour = renderer.getClearColor(new Color());
        renderer.setRenderTarget(this.target);
        // Where there is no pane, all of the light passes.
        renderer.setClearColor(0xffffff, 1);
        renderer.clear();
        renderer.render(this.scene, camera);
        renderer.setClearColor(colour, alpha);
        renderer.setRenderTarget(before);
    }

    dispose(): void {
        this.target.dispose();
        this.depth.dispose();
        this.material.dispose();
        for (const material of this.paneMaterials) material.dispose();
    }
}
