// Shadows of the sun: depths of the scene seen from the sun, from both sides of faces, as light meets them.
import {
    Box3, BufferAttribute, DepthTexture, DoubleSide, FloatType, GLSL3, Matrix4, Mesh, NearestFilter, OrthographicCamera, RawShaderMaterial, RedFormat, Scene, Vector3,
    WebGLRenderTarget, type BufferGeometry, type WebGLRenderer,
} from "three";

/** Texels of a side: a room of 10 m has some of 3 mm. */
const SIDE = 4096;

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
    private readonly material = new RawShaderMaterial({ glslVersion: GLSL3, vertexShader, fragmentShader, side: DoubleSide });
    private readonly box: Box3;

    constructor(private readonly renderer: WebGLRenderer, geometry: BufferGeometry) {
        const side = Math.min(SIDE, renderer.capabilities.maxTextureSize);
        this.depth = new DepthTexture(side, side, FloatType);
        this.depth.minFilter = this.depth.magFilter = NearestFilter;
        this.target = new WebGLRenderTarget(side, side, { format: RedFormat, depthTexture: this.depth, generateMipmaps: false });
        this.box = new Box3().setFromBufferAttribute(geometry.getAttribute("position") as BufferAttribute);
        const body = new Mesh(geometry, this.material);
        body.frustumCulled = false;
        this.scene.add(body);
    }

    /** Draws the depths for a unit vector to the sun. */
    draw(sun: Vector3): void {
        const { camera, box } = this, centre = box.getCenter(new Vector3()), size = Math.max(1e-3, box.getSize(new Vector3()).length());
        camera.position.copy(centre).addScaledVector(sun, size);
        camera.up.set(0, 1, 0);
        if (Math.abs(sun.y) > 0.99) camera.up.set(0, 0, 1);
        camera.lookAt(centre);
        camera.updateMatrixWorld();
        // The box as the sun sees it, and a little around it.
        const seen = box.clone().applyMatrix4(camera.matrixWorldInverse), edge = 1e-3 * size;
        [camera.left, camera.right, camera.bottom, camera.top] = [seen.min.x - edge, seen.max.x + edge, seen.min.y - edge, seen.max.y + edge];
        [camera.near, camera.far] = [-seen.max.z - edge, -seen.min.z + edge];
        camera.updateProjectionMatrix();
        this.texel = Math.max(camera.right - camera.left, camera.top - camera.bottom) / this.target.width;
        this.range = camera.far - camera.near;
        this.matrix.set(0.5, 0, 0, 0.5, 0, 0.5, 0, 0.5, 0, 0, 0.5, 0.5, 0, 0, 0, 1).multiply(camera.projectionMatrix).multiply(camera.matrixWorldInverse);
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
