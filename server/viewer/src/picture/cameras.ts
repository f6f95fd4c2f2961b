// Moves the camera: around the scene, or on foot through it.
import { Box3, Matrix4, PerspectiveCamera, Quaternion, Raycaster, Sphere, Spherical, Vector2, Vector3,
    Vector4 } from "three";
import CameraControls from "camera-controls";
import type { Place } from "../state/state.ts";

CameraControls.install({
    THREE: { Vector2, Vector3, Vector4, Quaternion, Matrix4, Spherical, Box3, Sphere, Raycaster } as never,
});

/** Angle of view of the page's own camera, of the height, in degrees. */
const ANGLE = 50;

/** That of a camera of the scene file, whose up is at right angles to its direction. One that is not tilted sideways
 * turns about the vertical, as that of the page does. The target stands at an arm's length, which turning goes
 * around. */
export function placeOf(eye: readonly number[], direction: readonly number[], up: readonly number[],
    angle: number): Place
{
    const target = eye.map((v, k) => v + direction[k]);
    const upright = [0, 1, 0].map((v, k) => v - direction[1] * direction[k]), length = Math.hypot(...upright);
    const isUpright = length > 0.01 && upright.every((v, k) => Math.abs(v / length - up[k]) < 1e-3);
    return [...eye, ...target, angle, ...(isUpright ? [0, 1, 0] : up)] as Place;
}

/** Metres a second on foot. */
const PACE = 1.4;

/** Of a walker, above the floor, m. */
const EYE = 1.6;

/** In a model lower than this, m, a walker is small: the eye is at this share of its height. */
const LOW = 2, EYE_SHARE = 0.6;

export class Cameras {
    readonly camera = new PerspectiveCamera(ANGLE, 1, 0.01, 1000);
    private readonly controls: CameraControls;
    private readonly held = new Set<string>();
    private box = new Box3();
    /** The nearest that is drawn from inside, m. */
    private nearest = 0.01;
    private isWalk = false;
    /** The lowest place to stand on at x and z, m; null: nothing is there. */
    floorAt: (x: number, z: number) => number | null = () => null;

    constructor(canvas: HTMLCanvasElement, private readonly moved: () => void, private readonly rested: () => void) {
        this.controls = new CameraControls(this.camera, canvas);
        this.controls.smoothTime = matchMedia("(prefers-reduced-motion: reduce)").matches ? 0 : 0.12;
        this.controls.draggingSmoothTime = 0.03;
        this.controls.dollyToCursor = true;
        for (const event of ["control", "controlstart", "wake"] as const) this.controls.addEventListener(event, moved);
        for (const event of ["rest", "controlend"] as const) this.controls.addEventListener(event, rested);
        canvas.addEventListener("blur", () => this.held.clear());
        canvas.addEventListener("keyup", (event) => this.held.delete(event.key.toLowerCase()));
        canvas.addEventListener("keydown", (event) => this.press(event));
    }

    /** Sets what is seen whole by fit(), and how near and far things are. */
    setBounds(box: Box3): void {
        this.box = box;
        const size = Math.max(1e-3, box.getSize(new Vector3()).length());
        this.nearest = size / 5000;
        this.camera.far = size * 20;
        this.camera.updateProjectionMatrix();
        this.controls.maxDistance = size * 8;
    }

    /** Looks at the whole scene from the front and a little above. */
    fit(animated: boolean): void {
        const centre = this.box.getCenter(new Vector3()), size = this.box.getSize(new Vector3());
        const half = (ANGLE * Math.PI) / 360;
        const fits = Math.max(size.y / 2, size.x / 2 / Math.max(0.2, this.camera.aspect)) / Math.tan(half);
        // Flat scenes are seen from above, rooms from in front.
        const lift = size.y < 0.4 * Math.max(size.x, size.z) ? 0.6 : 0.08;
        const distance = (fits + size.z / 2) * 1.05;
        const eye = centre.clone().add(new Vector3(0, Math.sin(lift), Math.cos(lift)).multiplyScalar(distance));
        this.place([eye.x, eye.y, eye.z, centre.x, centre.y, centre.z], animated);
    }

    /** A camera of another up is there at once: on the way it would turn over. */
    place(place: Place, animated: boolean): void {
        const [x, y, z, tx, ty, tz, angle = ANGLE, ...up] = place, { camera } = this, before = camera.up.clone();
        camera.fov = angle;
        camera.updateProjectionMatrix();
        if (up.length === 3) camera.up.set(up[0], up[1], up[2]).normalize();
        else camera.up.set(0, 1, 0);
        const isTurned = before.distanceTo(camera.up) > 1e-6, goes = animated && !isTurned;
        if (isTurned) this.controls.updateCameraUp();
        void this.controls.setLookAt(x, y, z, tx, ty, tz, goes);
        this.moved();
        if (!goes) this.rested();
    }

    get now(): Place {
        const eye = this.controls.getPosition(new Vector3()), target = this.controls.getTarget(new Vector3());
        const { fov, up } = this.camera, isOwn = fov === ANGLE && up.y === 1;
        return [...[eye.x, eye.y, eye.z, target.x, target.y, target.z].map((v) => Number(v.toFixed(4))),
            ...(isOwn ? [] : [fov, up.x, up.y, up.z].map((v) => Number(v.toFixed(6))))] as Place;
    }

    /** On foot the target is at arm's length: turning looks around, and keys walk. */
    setWalk(on: boolean): void {
        if (on === this.isWalk) return;
        this.isWalk = on;
        const eye = this.controls.getPosition(new Vector3()), target = this.controls.getTarget(new Vector3());
        const size = this.box.getSize(new Vector3()).length();
        const ahead = target.sub(eye).normalize(), inside = on && !this.box.containsPoint(eye);
        if (inside) {
            // From outside one looks down, on foot ahead.
            ahead.y = 0;
            if (ahead.length() < 1e-3) ahead.set(0, 0, -1);
            ahead.normalize();
            this.box.getCenter(eye);
            const floor = this.floorAt(eye.x, eye.z) ?? this.box.min.y;
            const height = this.box.max.y - floor;
            eye.y = floor + (height < LOW ? EYE_SHARE * height : EYE);
        }
        ahead.multiplyScalar(on ? size / 2000 : size / 4);
        this.controls.minDistance = on ? ahead.length() : 0;
        this.controls.maxDistance = on ? ahead.length() : size * 8;
        this.controls.azimuthRotateSpeed = this.controls.polarRotateSpeed = on ? -0.4 : 1;
        void this.controls.setLookAt(eye.x, eye.y, eye.z, eye.x + ahead.x, eye.y + ahead.y, eye.z + ahead.z, false);
        this.moved();
        // Not within the change of the state that this is a part of.
        queueMicrotask(() => this.rested());
    }

    /** True if the camera goes on moving. */
    advance(seconds: number): boolean {
        if (this.held.size > 0) this.step(seconds);
        const moves = this.controls.update(seconds);
        this.setNear();
        return moves || this.held.size > 0;
    }

    /** Depths z are parted by z² / (near · 2^24): from outside the nearest plane stands between eye and scene, far from
     * the eye. An eighth of the way is before all that even a wide picture sees at its corners. */
    private setNear(): void {
        const { camera } = this, near = Math.max(this.nearest, this.box.distanceToPoint(camera.position) / 8);
        if (Math.abs(near - camera.near) <= 0.01 * near) return;
        camera.near = near;
        camera.updateProjectionMatrix();
    }

    private step(seconds: number): void {
        const has = (...keys: string[]): boolean => keys.some((key) => this.held.has(key));
        if (this.isWalk) {
            const way = PACE * seconds * (this.held.has("shift") ? 3 : 1);
            if (has("w", "arrowup")) void this.controls.forward(way, false);
            if (has("s", "arrowdown")) void this.controls.forward(-way, false);
            if (has("a")) void this.controls.truck(-way, 0, false);
            if (has("d")) void this.controls.truck(way, 0, false);
            if (has("q")) void this.controls.elevate(-way, false);
            if (has("e")) void this.controls.elevate(way, false);
            if (has("arrowleft")) void this.controls.rotate(seconds, 0, false);
            if (has("arrowright")) void this.controls.rotate(-seconds, 0, false);
        } else {
            if (has("arrowleft", "a")) void this.controls.rotate(-seconds, 0, false);
            if (has("arrowright", "d")) void this.controls.rotate(seconds, 0, false);
            if (has("arrowup", "w")) void this.controls.rotate(0, -seconds, false);
            if (has("arrowdown", "s")) void this.controls.rotate(0, seconds, false);
            if (has("+", "=", "e")) void this.controls.dolly(this.controls.distance * seconds, false);
            if (has("-", "q")) void this.controls.dolly(-this.controls.distance * seconds, false);
        }
    }

    private press(event: KeyboardEvent): void {
        if (event.ctrlKey || event.metaKey || event.altKey) return;
        const key = event.key.toLowerCase();
        if (key === "f") {
            this.fit(true);
        } else if (/^(arrow(up|down|left|right)|[wasdqe+=-]|shift)$/.test(key)) {
            this.held.add(key);
            if (key.startsWith("arrow")) event.preventDefault();
            this.moved();
        }
    }
}
