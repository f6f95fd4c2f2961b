// The sun that is drawn. A picture is there at once, by the middle of the sun's disc; while it stands still, points all
// over the disc are looked from, some at each frame, and their mean is shown, in which shadows have half-shadows. Each
// point has a map of depths; places and elements of the pixels are drawn once for all of them.
import { FloatType, GLSL3, Matrix4, Mesh, NearestFilter, OrthographicCamera, PlaneGeometry, RawShaderMaterial,
    RedFormat, RGBAFormat, Scene, Vector2, Vector3, WebGLRenderTarget, type BufferGeometry, type Camera, type Texture,
    type WebGLRenderer } from "three";
import { normalsOf, reflectancesOf } from "./elements.ts";
import type { SceneMesh } from "./glb.ts";
import { opaqueMaterials, SunShadow, sunSeen, type Parts } from "./sun_shadow.ts";
import { floatTexture } from "./textures.ts";
import type { Uniforms } from "./material.ts";

/** Of the sun's disc as the earth sees it: .53 degrees across. */
const RADIUS = 0.00465;

/** Points of the disc: a half-shadow has as many steps, which the maps' own filter smooths. */
export const POINTS = 64;

/** Points next to each other in the order of looking are far apart, so that the mean of the first is near that of all.
 * It has no divisor in common with POINTS. */
const STRIDE = 19;

/** Where nothing changed for so long, more points are looked from, ms: drags and days that go by have the machine for
 * themselves. */
const REST_MS = 200;

/** Unit vectors to points of the disc, by equal areas: the spiral of Vogel (1979), eq. 1. The first is the nearest to
 * the middle. */
export function towardsDisc(sun: Vector3): Vector3[] {
    const across = new Vector3(0, 1, 0);
    if (Math.abs(sun.y) > 0.99) across.set(0, 0, 1);
    const x = across.clone().cross(sun).normalize(), y = sun.clone().cross(x), golden = Math.PI * (3 - Math.sqrt(5));
    return Array.from({ length: POINTS }, (_, k) => {
        const i = (k * STRIDE) % POINTS, r = RADIUS * Math.sqrt((i + 0.5) / POINTS);
        return sun.clone().addScaledVector(x, r * Math.cos(i * golden)).addScaledVector(y, r * Math.sin(i * golden))
            .normalize();
    });
}

const placesVertex = `
precision highp float;
precision highp int;
uniform mat4 modelViewMatrix, projectionMatrix;
in vec3 position;
in uvec2 ids; // element, node
out vec3 place;
flat out float number;
void main() {
    place = position;
    number = float(ids.x) + 1.0;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}
`;

/** The place of each pixel, and the number of its element, from 1; 0: nothing is there. */
const placesFragment = `
precision highp float;
in vec3 place;
flat in float number;
layout(location = 0) out vec4 pixel;
void main() { pixel = vec4(place, number); }
`;

const sumVertex = `
precision highp float;
in vec3 position;
void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }
`;

/** Adds the share of the sun that is seen by the map of one point. */
const sumFragment = `
precision highp float;
precision highp int;
${sunSeen}
uniform highp sampler2D sun_places, sum_before;
uniform bool is_first;
uniform vec3 sun_point;
layout(location = 0) out vec4 sum;
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 there = texelFetch(sun_places, at, 0);
    sum = vec4(is_first ? 0.0 : texelFetch(sum_before, at, 0).r);
    if (there.w < 0.5) return;
    vec3 normal = three(normals, int(there.w + 0.5) - 1);
    if (dot(normal, sun_point) > 0.0) sum += sun_seen(there.xyz, normal);
}
`;

function viewOf(camera: Camera): Matrix4 {
    camera.updateMatrixWorld();
    return new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
}

function target(format: typeof RGBAFormat | typeof RedFormat, depthBuffer: boolean): WebGLRenderTarget {
    return new WebGLRenderTarget(1, 1, { format, type: FloatType, minFilter: NearestFilter, magFilter: NearestFilter,
        depthBuffer, generateMipmaps: false });
}

export class Sunlight {
    private readonly shadow: SunShadow;
    private readonly places = target(RGBAFormat, true);
    private readonly sums = [target(RedFormat, false), target(RedFormat, false)] as const;
    private readonly placesMaterial = new RawShaderMaterial({ glslVersion: GLSL3, vertexShader: placesVertex,
        fragmentShader: placesFragment });
    private readonly body: Mesh;
    private readonly bodyScene = new Scene();
    private readonly sumScene = new Scene();
    private readonly sumCamera = new OrthographicCamera();
    private readonly plane: Mesh<PlaneGeometry, RawShaderMaterial>;
    private points: Vector3[] = [];
    /** Points that are summed, of the view below; they are kept while neither it nor the sun changes. */
    private count = 0;
    private readonly view = new Matrix4();
    private readonly size = new Vector2();
    /** When something changed last, ms. */
    private changed = 0;
    /** The direction that the map is of; null: of none any more. */
    private mapped: Vector3 | null = null;

    /** The geometry stays the stage's; `nothing` takes the place of textures that are gone. */
    constructor(private readonly renderer: WebGLRenderer, private readonly uniforms: Uniforms, geometry: BufferGeometry,
        mesh: SceneMesh, parts: Parts, private readonly nothing: Texture)
    {
        this.shadow = new SunShadow(renderer, geometry, parts);
        uniforms.sun_depth.value = this.shadow.depth;
        uniforms.sun_glass.value = this.shadow.glass;
        uniforms.normals.value = floatTexture(normalsOf(mesh));
        uniforms.reflectances.value = floatTexture(reflectancesOf(mesh));
        uniforms.sun_places.value = this.places.texture;
        this.body = new Mesh(geometry, opaqueMaterials(this.placesMaterial, parts.opaque, parts.panes.length));
        this.body.frustumCulled = false;
        this.bodyScene.add(this.body);
        this.plane = new Mesh(new PlaneGeometry(2, 2), new RawShaderMaterial({
            glslVersion: GLSL3,
            vertexShader: sumVertex,
            fragmentShader: sumFragment,
            depthTest: false,
            depthWrite: false,
            uniforms: { ...uniforms, sum_before: { value: null }, is_first: { value: true },
                sun_point: { value: new Vector3() } },
        }));
        this.plane.frustumCulled = false;
        this.sumScene.add(this.plane);
    }

    /** The sun is there from now on; `direction` is a unit vector, y up, `light` what faces it receives. */
    set(direction: Vector3, light: readonly [number, number, number]): void {
        const u = this.uniforms;
        (u.sun_light.value as Vector3).set(...light);
        if (this.points.length > 0 && (u.sun_direction.value as Vector3).equals(direction)) return;
        (u.sun_direction.value as Vector3).copy(direction);
        this.points = towardsDisc(direction);
        this.begin();
    }

    /** The sun is not there for a while; what is as large as the picture is given back. */
    rest(): void {
        this.count = 0;
        for (const one of [this.places, ...this.sums]) one.setSize(1, 1);
    }

    /** Gives back all that the graphics card has; the next picture makes it anew. */
    release(): void {
        this.shadow.dispose();
        for (const name of ["normals", "reflectances"]) (this.uniforms[name].value as Texture).dispose();
        for (const one of [this.places, ...this.sums, this.plane.geometry, this.plane.material, this.placesMaterial])
            one.dispose();
    }

    /** The graphics card has lost all that was drawn. */
    lose(): void {
        this.mapped = null;
        this.count = 0;
    }

    private begin(): void {
        this.count = 0;
        this.hold();
    }

    /** Something changes, if only the colour of a mark: more points wait. */
    hold(): void {
        this.changed = performance.now();
    }

    /** More points are worth their time from now on in so long, ms. */
    get restLeft(): number {
        return Math.max(0, this.changed + REST_MS - performance.now());
    }

    /** Makes ready for a picture of this camera, of so many pixels: of all points so far, or by the middle of the
     * disc. */
    prepare(camera: Camera, size: Vector2): void {
        const u = this.uniforms;
        if (!this.isOf(camera, size)) {
            this.begin();
            this.view.copy(viewOf(camera));
            this.size.copy(size);
        }
        if (this.count === 0) this.map(u.sun_direction.value as Vector3);
        u.is_soft.value = this.count > 0;
        if (this.count === 0) return;
        u.sun_sum.value = this.sums[this.count % 2].texture;
        u.sun_part.value = 1 / this.count;
    }

    /** True if more points would make the picture better. */
    get hasMore(): boolean {
        // Sums need textures of single precision that can be drawn into.
        return this.count < POINTS && this.renderer.extensions.has("EXT_color_buffer_float");
    }

    /** Looks from one more point, for the camera that the last picture was prepared for. */
    refine(camera: Camera): void {
        if (this.count === 0) this.drawPlaces(camera);
        const point = this.points[this.count], { uniforms } = this.plane.material;
        this.map(point);
        uniforms.sum_before.value = this.sums[this.count % 2].texture;
        uniforms.is_first.value = this.count === 0;
        (uniforms.sun_point.value as Vector3).copy(point);
        this.count += 1;
        const to = this.sums[this.count % 2];
        to.setSize(this.size.x, this.size.y);
        this.drawInto(to, this.sumScene, this.sumCamera);
    }

    /** True where the view and its size are those that were prepared for. */
    isOf(camera: Camera, size: Vector2): boolean {
        return viewOf(camera).equals(this.view) && size.equals(this.size);
    }

    private map(point: Vector3): void {
        if (this.mapped?.equals(point) === true) return;
        this.mapped = point.clone();
        const { shadow, uniforms: u } = this;
        shadow.draw(point);
        (u.sun_matrix.value as Matrix4).copy(shadow.matrix);
        (u.sun_step.value as Vector2).set(shadow.texel, shadow.texel / shadow.range);
    }

    private drawPlaces(camera: Camera): void {
        const { renderer, places } = this, alpha = renderer.getClearAlpha();
        places.setSize(this.size.x, this.size.y);
        renderer.setClearAlpha(0);
        this.drawInto(places, this.bodyScene, camera);
        renderer.setClearAlpha(alpha);
    }

    private drawInto(to: WebGLRenderTarget, scene: Scene, camera: Camera): void {
        this.renderer.setRenderTarget(to);
        this.renderer.render(scene, camera);
        this.renderer.setRenderTarget(null);
    }

    dispose(): void {
        this.release();
        // Textures that uniforms still name would be made anew by the next picture.
        for (const name of ["sun_depth", "sun_glass", "sun_places", "sun_sum", "normals", "reflectances"])
            this.uniforms[name].value = this.nothing;
    }
}
