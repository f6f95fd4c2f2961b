// Draws the scene: buffers, textures of values, the pass over the nodes, the loop that draws when something changed.
// Knows no daemon and no panel; what it shows is set by its methods.
import { BufferAttribute, BufferGeometry, Color, HalfFloatType, Mesh, NearestFilter, OrthographicCamera, PlaneGeometry,
    RGBAFormat, Scene, Vector2, Vector3, Vector4, WebGLRenderer, WebGLRenderTarget, type PerspectiveCamera,
    type RawShaderMaterial, type Texture } from "three";
import type { Palette, Tone } from "../state/state.ts";
import type { Field } from "./field.ts";
import { channelWeights } from "./field.ts";
import type { SceneMesh } from "./glb.ts";
import type { Openings } from "./openings.ts";
import type { SensorMarks } from "./sensor_marks.ts";
import { Sunlight } from "./sunlight.ts";
import { makeUniforms, nodesMaterial, paneMaterial, sceneMaterial, type Uniforms } from "./material.ts";
import { emptyTexture, floatTexture, HalfTexture, imageTexture, integerTexture, maskTexture, paletteTexture, rowsFor,
    whiteTexture } from "./textures.ts";

export interface Display {
    picture: "light" | "false";
    smooth: boolean;
    tone: Tone;
    /** Factor before the tone curve. */
    exposure: number;
    palette: Palette;
    range: [number, number];
    log: boolean;
    isoLines: number;
    /** Images of materials are drawn where there are any. */
    textured: boolean;
    /** In the unit of the values; null: no marks. */
    threshold: number | null;
    /** Openings of luminaires are drawn where there are any. */
    openings: boolean;
    /** The same of sensors, but for those of the hidden sets; they are coloured by their values, or alike. */
    sensors: boolean;
    hiddenSets: readonly string[];
    areSensorsColoured: boolean;
    /** In the unit of their values; null: none is required. */
    required: number | null;
    /** The place of a sensor that stands out. */
    sensor: number | null;
    /** The judged elements are shown as such without a threshold, too. */
    marked: boolean;
    compare: "none" | "split" | "difference";
    /** Share of the width that is left of the split. */
    split: number;
}

/** Points of the sun's disc that a frame takes in: a map of depths takes graphics cards some milliseconds. */
const POINTS_AT_ONCE = 2;

const TONES: { [name in Tone]: number } = { linear: 0, agx: 1, aces: 2 };

export class Stage {
    readonly renderer: WebGLRenderer;
    readonly uniforms: Uniforms;
    mesh: SceneMesh | null = null;
    geometry: BufferGeometry | null = null;
    /** Pictures drawn so far. */
    frames = 0;
    private readonly nothing = emptyTexture();
    private readonly white = whiteTexture();
    private readonly scene = new Scene();
    private readonly nodesScene = new Scene();
    private readonly nodesCamera = new OrthographicCamera();
    private readonly nodesPlane: Mesh<PlaneGeometry, RawShaderMaterial>;
    private values: [HalfTexture, HalfTexture] | null = null;
    private nodes: WebGLRenderTarget | null = null;
    private nodesAreOld = false;
    private body: Mesh | null = null;
    private openings: Openings | null = null;
    private marks: SensorMarks | null = null;
    private hasImages = false;
    private images: Texture[] = [];
    private paletteName: Palette | null = null;
    private wanted = false;
    private display: Display | null = null;
    private sunlight: Sunlight | null = null;
    private restTimer = 0;
    private isHeld = false;

    constructor(readonly canvas: HTMLCanvasElement, readonly camera: PerspectiveCamera,
        /** Moves the camera; true if it goes on moving. */
        private readonly advance: (seconds: number) => boolean)
    {
        this.renderer = new WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: false });
        this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
        this.uniforms = makeUniforms(this.nothing);
        this.nodesPlane = new Mesh(new PlaneGeometry(2, 2), nodesMaterial(this.uniforms));
        this.nodesPlane.frustumCulled = false;
        this.nodesScene.add(this.nodesPlane);
        canvas.addEventListener("webglcontextlost", () => this.release());
        canvas.addEventListener("webglcontextrestored", () => {
            this.nodesAreOld = true;
            this.sunlight?.lose();
            this.invalidate();
        });
        new ResizeObserver(() => this.resize()).observe(canvas.parentElement as HTMLElement);
    }

    set background(colour: string) {
        this.scene.background = new Color(colour);
        this.invalidate();
    }

    /** Smooth shading needs textures that can be drawn into. */
    get canSmooth(): boolean {
        return this.renderer.extensions.has("EXT_color_buffer_float")
            || this.renderer.extensions.has("EXT_color_buffer_half_float");
    }

    show(mesh: SceneMesh, channels: number, openings: Openings | null, marks: SensorMarks | null): void {
        this.clear();
        this.openings = openings;
        this.marks = marks;
        if (openings !== null) this.scene.add(openings.lines);
        if (marks !== null) this.scene.add(marks.mesh);
        const nodes = mesh.corners, vertices = mesh.elementOf.length, ids = new Uint32Array(2 * vertices);
        for (let v = 0; v < vertices; v++) {
            ids[2 * v] = mesh.elementOf[v];
            ids[2 * v + 1] = mesh.cornerOf[v];
        }
        const geometry = new BufferGeometry();
        geometry.setAttribute("position", new BufferAttribute(mesh.positions, 3));
        geometry.setAttribute("ids", new BufferAttribute(ids, 2));
        geometry.setIndex(new BufferAttribute(mesh.index, 1));
        this.geometry = geometry;
        this.mesh = mesh;
        const materials = this.addParts(geometry, mesh);
        const body = new Mesh(geometry, materials);
        body.name = "scene";
        // Until the first answer all of it is black.
        body.visible = false;
        this.body = body;
        this.scene.add(body);
        this.values = [new HalfTexture(channels * mesh.elements), new HalfTexture(channels * mesh.elements)];
        const { width, height } = rowsFor(nodes.count);
        this.nodes = new WebGLRenderTarget(width, height, {
            count: 2,
            format: RGBAFormat,
            type: HalfFloatType,
            minFilter: NearestFilter,
            magFilter: NearestFilter,
            depthBuffer: false,
            generateMipmaps: false,
        });
        const u = this.uniforms;
        u.values_a.value = this.values[0].texture;
        u.values_b.value = this.values[1].texture;
        u.node_parts.value = integerTexture(nodes.parts);
        u.node_first.value = integerTexture(nodes.first);
        u.node_elements.value = integerTexture(nodes.elements);
        u.node_weights.value = floatTexture(nodes.weights);
        u.node_count.value = nodes.count;
        u.nodes_a.value = this.nodes.textures[0];
        u.nodes_b.value = this.nodes.textures[1];
        u.elements.value = mesh.elements;
        u.channels.value = channels;
        const weights = channels === 3 ? channelWeights(3) : [1, 0, 0];
        (u.weights.value as Vector3).set(weights[0], weights[1], weights[2]);
        this.judge(() => true);
    }

    /** The materials of the parts of the geometry: the first is that of all opaque ones without an image, the last are
     * those of panes. */
    private addParts(geometry: BufferGeometry, mesh: SceneMesh): RawShaderMaterial[] {
        const { white, uniforms } = this;
        const materials = [sceneMaterial(uniforms, white, [1, 1, 1]),
            ...mesh.images.map(({ factor }) => sceneMaterial(uniforms, white, factor)),
            ...mesh.panes.map((pane) => paneMaterial(uniforms, white, pane, mesh.glassByAngle))];
        const parts = [...mesh.images, ...mesh.panes].map((part, k) => ({ ...part, material: k + 1 }))
            .sort((one, other) => one.first - other.first);
        this.hasImages = false;
        let first = 0;
        for (const part of parts) {
            if (part.first > first) geometry.addGroup(first, part.first - first, 0);
            geometry.addGroup(part.first, part.count, part.material);
            first = part.first + part.count;
        }
        if (first < mesh.index.length) geometry.addGroup(first, mesh.index.length - first, 0);
        if (mesh.uv === null || mesh.reflectance === null) return materials;
        geometry.setAttribute("uv", new BufferAttribute(mesh.uv, 2));
        this.uniforms.reflectance.value = floatTexture(mesh.reflectance);
        const anisotropy = Math.min(8, this.renderer.capabilities.getMaxAnisotropy());
        // Until all are decoded, groups have their means; images that no browser can decode leave it at that.
        void Promise.all(mesh.images.map((image) => imageTexture(image, anisotropy))).then((textures) => {
            if (this.mesh !== mesh) return;
            textures.forEach((texture, k) => {
                materials[k + 1].uniforms.image.value = texture;
            });
            this.images = textures;
            this.hasImages = true;
            this.nodesAreOld = true;
            if (this.display !== null) this.setDisplay(this.display);
        }, () => undefined);
        return materials;
    }

    /** Values of side a (0), or of b (1), which a comparison shows beside it. */
    setField(side: 0 | 1, field: Field): void {
        if (this.values === null) return;
        this.values[side].write(field.bits);
        if (side === 0 && this.body !== null) this.body.visible = true;
        const scale = this.uniforms.scale.value as Vector2;
        if (side === 0) scale.x = field.scale;
        else scale.y = field.scale;
        this.nodesAreOld = true;
        this.invalidate();
    }

    /** Draws the sun from this direction (a unit vector, y up), with shadows; null: values have it already. `light` is
     * what faces the sun receive, by red, green and blue. */
    setSun(
        sun: { direction: readonly [number, number, number]; light: readonly [number, number, number] } | null,
    ): void {
        const u = this.uniforms, { mesh, geometry } = this;
        u.is_sunny.value = sun !== null && mesh !== null;
        this.invalidate();
        if (sun === null || mesh === null || geometry === null) {
            this.sunlight?.rest();
            return;
        }
        this.sunlight ??= new Sunlight(this.renderer, u, geometry, mesh, { opaque: 1 + mesh.images.length,
            panes: mesh.panes.map((pane) => pane.glass), isByAngle: mesh.glassByAngle }, this.nothing);
        this.sunlight.set(new Vector3(...sun.direction), sun.light);
    }

    setDisplay(display: Display): void {
        const u = this.uniforms, before = this.display;
        this.display = display;
        u.picture.value = display.picture === "false" ? 1 : 0;
        u.is_smooth.value = display.smooth && this.canSmooth;
        u.tone.value = TONES[display.tone];
        u.exposure.value = display.exposure;
        (u.range.value as Vector2).set(display.range[0], Math.max(display.range[1], display.range[0] + 1e-12));
        u.is_log.value = display.log && display.range[0] > 0;
        u.iso_lines.value = display.isoLines;
        u.threshold.value = display.threshold ?? -1;
        u.is_marked.value = display.marked;
        const isTextured = display.textured && display.picture === "light" && display.compare !== "difference"
            && this.hasImages;
        if (isTextured !== u.is_textured.value) this.nodesAreOld = true;
        u.is_textured.value = isTextured;
        u.compare.value = display.compare === "split" ? 1 : display.compare === "difference" ? 2 : 0;
        if (this.paletteName !== display.palette) {
            this.paletteName = display.palette;
            u.palette.value = paletteTexture(display.palette);
        }
        if (this.openings !== null) this.openings.lines.visible = display.openings;
        if (this.marks !== null) this.styleMarks(this.marks, display, before);
        this.placeSplit();
        this.invalidate();
    }

    private styleMarks(marks: SensorMarks, display: Display, before: Display | null): void {
        marks.mesh.visible = display.sensors;
        if (display.hiddenSets !== before?.hiddenSets) marks.hide(display.hiddenSets);
        marks.style(display.areSensorsColoured, display.required, display.sensor);
    }

    /** A value for each sensor, NaN where it has none; null: none are known. */
    setSensors(values: Float32Array | null): void {
        this.marks?.setValues(values);
        this.invalidate();
    }

    /** The difference that is all blue or all red, in the unit of the values. */
    setChange(most: number): void {
        this.uniforms.change.value = Math.max(most, 1e-30);
        this.invalidate();
    }

    /** The elements that the threshold judges. */
    judge(isJudged: (element: number) => boolean): void {
        if (this.mesh === null) return;
        (this.uniforms.judged.value as { dispose?: () => void } | null)?.dispose?.();
        this.uniforms.judged.value = maskTexture(this.mesh.elements, isJudged);
        this.invalidate();
    }

    mark(hovered: number, pins: readonly number[]): void {
        this.uniforms.hovered.value = hovered;
        const [a, b, c, d] = [0, 1, 2, 3].map((i) => pins[i] ?? -1);
        (this.uniforms.pins.value as Vector4).set(a, b, c, d);
        this.invalidate();
    }

    /** Something changes: a picture is drawn, and better ones of the same view wait until nothing does. */
    invalidate(): void {
        this.sunlight?.hold();
        this.request();
    }

    private request(): void {
        if (this.wanted) return;
        this.wanted = true;
        requestAnimationFrame((time) => this.frame(time));
    }

    /** Draws at once. */
    draw(camera = this.camera): void {
        if (this.isLost) return;
        if (this.nodesAreOld && this.nodes !== null && this.uniforms.is_smooth.value === true) {
            this.nodesAreOld = false;
            this.renderer.setRenderTarget(this.nodes);
            this.renderer.render(this.nodesScene, this.nodesCamera);
            this.renderer.setRenderTarget(null);
        }
        this.sun?.prepare(camera, this.renderer.getDrawingBufferSize(new Vector2()));
        this.renderer.render(this.scene, camera);
        this.frames += 1;
    }

    /** Draws at once with all that pictures get while they stand still. */
    drawFinished(): void {
        while (this.improve(this.camera, this.renderer.getDrawingBufferSize(new Vector2())));
        this.draw();
    }

    /** Makes the next picture of this camera and size, in pixels, better; true while that can be done again. */
    improve(camera: PerspectiveCamera, size: Vector2): boolean {
        if (this.isLost) return false;
        const { sun } = this;
        sun?.prepare(camera, size);
        if (sun?.hasMore === true) sun.refine(camera);
        return sun?.hasMore === true;
    }

    /** Draws a picture of another camera and size, whose first pixel is that many pixels left of the split, and hands
     * it over; the page shows its own. */
    drawOther(camera: PerspectiveCamera, size: Vector2, split: number, take: (drawn: HTMLCanvasElement) => void): void {
        const { renderer, uniforms } = this, hovered: unknown = uniforms.hovered.value;
        uniforms.hovered.value = -1;
        renderer.setPixelRatio(1);
        renderer.setSize(size.x, size.y, false);
        uniforms.split.value = split;
        this.draw(camera);
        take(renderer.domElement);
        uniforms.hovered.value = hovered;
        this.resize();
        this.draw();
    }

    /** Frames wait until the function that it returns is called. */
    hold(): () => void {
        this.isHeld = true;
        return () => {
            this.isHeld = false;
            this.invalidate();
        };
    }

    /** Waits until the graphics card has done what it was told to. */
    async caughtUp(): Promise<void> {
        const gl = this.renderer.getContext() as WebGL2RenderingContext,
            fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
        gl.flush();
        do {
            if (fence === null || gl.isContextLost()) throw new Error("the graphics card has lost the picture");
            await new Promise((resolve) => {
                setTimeout(resolve, 5);
            });
        } while (gl.getSyncParameter(fence, gl.SYNC_STATUS) !== gl.SIGNALED);
        gl.deleteSync(fence);
    }

    /** True if the next picture is the same, where nothing changes. */
    get isFinished(): boolean {
        return !this.wanted && this.restTimer === 0;
    }

    /** The graphics card has lost the picture: until it is back nothing is made on it. */
    private get isLost(): boolean {
        return this.renderer.getContext().isContextLost();
    }

    /** The light of the sun, where it is mesh. */
    private get sun(): Sunlight | null {
        return this.uniforms.is_sunny.value === true ? this.sunlight : null;
    }

    resize(): void {
        const frame = this.canvas.parentElement as HTMLElement;
        const [width, height] = [Math.max(1, frame.clientWidth), Math.max(1, frame.clientHeight)];
        this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
        this.renderer.setSize(width, height, false);
        this.camera.aspect = width / height;
        this.camera.updateProjectionMatrix();
        this.placeSplit();
        this.invalidate();
    }

    private placeSplit(): void {
        this.uniforms.split.value = (this.display?.split ?? 0) * this.renderer.domElement.width;
    }

    private lastTime = 0;

    private frame(time: number): void {
        this.wanted = false;
        if (this.isHeld || this.isLost) return;
        const seconds = Math.min(0.1, (time - this.lastTime) / 1000);
        this.lastTime = time;
        const goesOn = this.advance(seconds);
        if (!goesOn) this.refine();
        this.draw();
        if (goesOn) this.request();
        else this.goOnRefining();
    }

    /** Makes the next picture of a view that stood still a better one. */
    private refine(): void {
        const { sun, camera } = this;
        if (sun === null || sun.restLeft > 0 || !sun.isOf(camera, this.renderer.getDrawingBufferSize(new Vector2())))
            return;
        for (let k = 0; k < POINTS_AT_ONCE && sun.hasMore; k++) sun.refine(camera);
    }

    private goOnRefining(): void {
        const { sun } = this;
        clearTimeout(this.restTimer);
        this.restTimer = 0;
        if (sun === null || !sun.hasMore) return;
        if (sun.restLeft === 0) this.request();
        else this.restTimer = window.setTimeout(() => {
                this.restTimer = 0;
                this.request();
            }, sun.restLeft);
    }

    /** Gives back all that the graphics card had, which has lost it: what is given back later is deleted from a context
     * that it is not of, an error. The next picture makes it anew. */
    private release(): void {
        const { body, geometry, nodes, nodesPlane, uniforms, white, images, sunlight } = this;
        const materials = (body?.material ?? []) as RawShaderMaterial[],
            textures = Object.values(uniforms).map(({ value }) => value as { dispose?: () => void } | null);
        for (const one of [...materials, ...textures, geometry, nodes, nodesPlane.geometry, nodesPlane.material, white,
            ...images]) one?.dispose?.();
        this.openings?.dispose();
        this.marks?.dispose();
        sunlight?.release();
    }

    private clear(): void {
        this.scene.clear();
        this.geometry?.dispose();
        this.openings?.dispose();
        this.marks?.dispose();
        // What was hidden of another scene says nothing of the next one.
        this.display = null;
        this.values?.forEach((texture) => texture.dispose());
        this.nodes?.dispose();
        this.images.forEach((texture) => texture.dispose());
        this.images = [];
        this.sunlight?.dispose();
        this.sunlight = null;
        this.uniforms.is_sunny.value = false;
        for (const name of ["node_parts", "node_first", "node_elements", "node_weights", "judged", "reflectance"])
            (this.uniforms[name].value as { dispose?: () => void } | null)?.dispose?.();
        this.uniforms.reflectance.value = this.nothing;
        this.geometry =
            this.mesh =
            this.values =
            this.nodes =
                null;
    }
}
