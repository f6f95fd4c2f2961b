// Shadows of the sun: depths of the scene seen from the sun, from both sides of faces, as light meets them.
import { Box3, BufferAttribute, DepthTexture, DoubleSide, FloatType, GLSL3, Matrix4, Mesh, NearestFilter,
    OrthographicCamera, RawShaderMaterial, RedFormat, Scene, Vector3, WebGLRenderTarget, type BufferGeometry,
    type WebGLRenderer } from "three";

/** Texels of a side: a room of 10 m has some of 3 mm. */
const SIDE = 4096;

/** Reads the map. */
export const sunSeen = `
uniform mat4 sun_matrix;      // of places to those in the map of depths
uniform vec2 sun_step;        // a texel: m, and as a part of the range of depths
uniform highp sampler2D sun_depth;
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
    return seen / 9.0;
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

    constructor(private readonly renderer: WebGLRenderer, geometry: BufferGeometry) {
        const side = Math.min(SIDE, renderer.capabilities.maxTextureSize);
        this.depth = new DepthTexture(side, side, FloatType);
        this.depth.minFilter = this.depth.magFilter = NearestFilter;
        this.target = new WebGLRenderTarget(side, side, { format: RedFormat, depthTexture: this.depth,
            generateMipmaps: false });
        this.box = new Box3().setFromBufferAttribute(geometry.getAttribute("position") as BufferAttribute);
        const body = new Mesh(geometry, this.material);
        body.frustumCulled = false;
        this.scene.add(body);
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
        const before = this.renderer.getRenderTarget();
        this.renderer.setRenderTarget(this.target);
        this.renderer.clear();
        this.renderer.render(this.scene, camera);
        this.renderer.setRenderTarget(before);
    }

    dispose(): void {
        this.target.dispose();
        this.depth.dispose();
        this.material.dispose();
    }
}
