// The openings of luminaires as thin outlines, each with an arrow along its aim. Knows their places and shapes, and
// nothing of their light.
import { BufferAttribute, BufferGeometry, Group, LineBasicMaterial, LineSegments, Matrix4, Raycaster, Vector2, Vector3,
    type PerspectiveCamera } from "three";
import type { Luminaire } from "../daemon/api.ts";
import { turned, type SceneMesh } from "./glb.ts";

type Point = readonly [number, number, number];
type Curve = readonly Point[];

/** So many segments make a round outline. */
const ROUND = 32;

/** Of an arrow, as shares of the scene's diagonal; it is half as long as the opening in between. */
const ARROW_LEAST = 0.01, ARROW_MOST = 0.03;

/** Around an outline a pointer still meets it, in pixels. */
const NEAR_PX = 5;

/** A housing or a ceiling may stand this far before an opening that a pointer meets, m and as a share of the scene's
 * diagonal. */
const HIDDEN_M = 0.3, HIDDEN_SHARE = 0.03;

const COLOUR = 0x00b4ff;

/** An outline lies nearer to the eye by this share, before the plane that its opening is in. */
const NEARER = 0.002;

/** An ellipse across the axis k, at the given place along it. */
function ellipse(size: Point, k: number, along: number): Curve {
    const [i, j] = [(k + 1) % 3, (k + 2) % 3];
    return Array.from({ length: ROUND + 1 }, (_, step) => {
        const angle = (2 * Math.PI * step) / ROUND, point: [number, number, number] = [0, 0, 0];
        [point[i], point[j], point[k]] = [0.5 * size[i] * Math.cos(angle), 0.5 * size[j] * Math.sin(angle), along];
        return point;
    });
}

/** A rectangle across the axis k, at the given place along it. */
function rectangle(size: Point, k: number, along: number): Curve {
    const [i, j] = [(k + 1) % 3, (k + 2) % 3];
    return [[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]].map(([a, b]) => {
        const point: [number, number, number] = [0, 0, 0];
        [point[i], point[j], point[k]] = [0.5 * a * size[i], 0.5 * b * size[j], along];
        return point;
    });
}

/** The axis that a flat opening stands across: that of the aim, unless it is thinner along another. */
function acrossOf(size: Point): number {
    return [0, 1].reduce((across, k) => (size[k] < size[across] ? k : across), 2);
}

/** Two equal curves across the axis k at both ends of a body, and lines between some of their points. */
function body(size: Point, k: number, across: (along: number) => Curve, every: number): Curve[] {
    const [low, high] = [across(-0.5 * size[k]), across(0.5 * size[k])];
    return [low, high, ...low.flatMap((point, at) => (at % every === 0 ? [[point, high[at]]] : []))];
}

/** Curves in the frame of the luminaire: x is C0, y is C90, z is against the aim. */
function outlineOf({ shape, size }: Luminaire["opening"], least: number): Curve[] {
    const round = (k: number): Curve[] => body(size, k, (along) => ellipse(size, k, along), ROUND / 4);
    switch (shape) {
        case "rectangle":
            return [rectangle(size, acrossOf(size), 0)];
        case "box":
            return body(size, 2, (along) => rectangle(size, 2, along), 1);
        case "disc":
        case "ellipse":
        case "upright disc":
            return [ellipse(size, acrossOf(size), 0)];
        case "upright cylinder":
            return round(2);
        case "cylinder along x":
            return round(0);
        case "cylinder along y":
            return round(1);
        case "sphere":
        case "ellipsoid":
            return [0, 1, 2].map((k) => ellipse(size, k, 0));
        default:
            return [[[-least, 0, 0], [least, 0, 0]], [[0, -least, 0], [0, least, 0]], [[0, 0, -least], [0, 0, least]]];
    }
}

function arrow(length: number): Curve[] {
    const [back, side] = [-0.7 * length, 0.15 * length];
    return [[[0, 0, 0], [0, 0, -length]], [[-side, 0, back], [0, 0, -length], [side, 0, back]]];
}

/** From the frame of a luminaire to the axes of the picture. */
function frameOf({ at, aim, c0 }: Luminaire, up: SceneMesh["up"]): Matrix4 {
    const [o, x, z] = [at, c0, aim.map((v) => -v) as unknown as Point].map((v) => new Vector3(...turned(up, v)));
    return new Matrix4().makeBasis(x, new Vector3().crossVectors(z, x), z).setPosition(o);
}

interface Placed {
    luminaire: Luminaire;
    /** From the axes of the picture to its frame. */
    inverse: Matrix4;
}

export class Openings {
    readonly lines = new Group();
    private readonly placed: Placed[];
    private readonly caster = new Raycaster();

    /** `diagonal` is that of the scene's bounds, m. */
    constructor(list: readonly Luminaire[], up: SceneMesh["up"], private readonly diagonal: number) {
        const points: number[] = [], corner = new Vector3();
        this.placed = list.map((luminaire) => {
            const frame = frameOf(luminaire, up), longest = Math.max(...luminaire.opening.size);
            const length = Math.min(ARROW_MOST * diagonal, Math.max(ARROW_LEAST * diagonal, longest / 2));
            for (const curve of [...outlineOf(luminaire.opening, ARROW_LEAST * diagonal), ...arrow(length)])
                for (let k = 1; k < curve.length; k++)
                    for (const point of [curve[k - 1], curve[k]])
                        points.push(...corner.set(...point).applyMatrix4(frame).toArray());
            return { luminaire, inverse: frame.invert() };
        });
        const geometry = new BufferGeometry();
        geometry.setAttribute("position", new BufferAttribute(new Float32Array(points), 3));
        // What the scene hides of an outline is drawn faintly.
        this.lines.add(new LineSegments(geometry, lineMaterial(true, 1)),
            new LineSegments(geometry, lineMaterial(false, 0.3)));
        for (const line of this.lines.children) line.renderOrder = 1;
    }

    /** The luminaire whose opening is met at (x, y), each from −1 to 1, in a picture of that many pixels in height;
     * `reach` is the distance of the surface there. O(k). */
    at(x: number, y: number, camera: PerspectiveCamera, height: number, reach: number | null): Luminaire | null {
        const pixel = (2 * Math.tan((camera.fov * Math.PI) / 360)) / height;
        const most = (reach ?? Infinity) + Math.min(HIDDEN_M, HIDDEN_SHARE * this.diagonal);
        let found: Luminaire | null = null, nearest = most;
        this.caster.setFromCamera(new Vector2(x, y), camera);
        for (const { luminaire, inverse } of this.placed) {
            const ray = this.caster.ray.clone().applyMatrix4(inverse);
            const around = NEAR_PX * pixel * ray.origin.length();
            const distance = distanceTo(ray.origin.toArray(), ray.direction.toArray(), luminaire.opening.size.map((s) =>
                s / 2 + around
            ));
            if (distance !== null && distance < nearest) [found, nearest] = [luminaire, distance];
        }
        return found;
    }

    dispose(): void {
        for (const line of this.lines.children as LineSegments[]) {
            line.geometry.dispose();
            (line.material as LineBasicMaterial).dispose();
        }
    }
}

/** Where a ray enters the box around 0 of these half sides; null: it misses it. */
function distanceTo(origin: readonly number[], direction: readonly number[], half: readonly number[]): number | null {
    let [from, to] = [0, Infinity];
    for (let k = 0; k < 3; k++) {
        if (direction[k] === 0) {
            if (Math.abs(origin[k]) > half[k]) return null;
            continue;
        }
        const [a, b] = [-half[k], half[k]].map((side) => (side - origin[k]) / direction[k]);
        from = Math.max(from, Math.min(a, b));
        to = Math.min(to, Math.max(a, b));
    }
    return from <= to ? from : null;
}

function lineMaterial(depthTest: boolean, opacity: number): LineBasicMaterial {
    const material = new LineBasicMaterial({ color: COLOUR, depthTest, depthWrite: false, transparent: true, opacity });
    material.onBeforeCompile = (shader): void => {
        shader.vertexShader = shader.vertexShader.replace("#include <project_vertex>", `#include <project_vertex>
            mvPosition.xyz *= ${1 - NEARER};
            gl_Position = projectionMatrix * mvPosition;`);
    };
    return material;
}
