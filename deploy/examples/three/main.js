// A scene of lambertd in three.js, lit smoothly at its corners; a slider dims its lamps. In this folder run npm install three deploy/js
// and a server of files, and lambertd STORE.h5 --allow-origin ADDRESS-OF-THAT-SERVER. ?scene=http://HOST:PORT/NAME is another scene.
import { Newest, open } from "lambert-light";
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

const address = new URLSearchParams(location.search).get("scene") ?? "http://127.0.0.1:8317";
const scene = await open(address, { check: 1 }), { count, positions, normals, index } = await scene.corners();
const lamps = [...(await scene.groups()).values()].filter((group) => group.emission.some((e) => e > 0));

const colours = new THREE.BufferAttribute(new Float32Array(3 * count), 3), geometry = new THREE.BufferGeometry();
geometry.setAttribute("position", new THREE.BufferAttribute(positions, 3));
geometry.setAttribute("normal", new THREE.BufferAttribute(normals, 3));
geometry.setAttribute("color", colours);
geometry.setIndex(new THREE.BufferAttribute(index, 1));
const mesh = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ vertexColors: true }));
const world = new THREE.Scene().add(mesh), { center, radius } = new THREE.Box3().setFromObject(mesh).getBoundingSphere(new THREE.Sphere());

const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
renderer.setSize(innerWidth, innerHeight);
renderer.toneMapping = THREE.LinearToneMapping;
document.body.append(renderer.domElement);
const camera = new THREE.PerspectiveCamera(50, innerWidth / innerHeight, radius / 100, 10 * radius);
camera.position.set(center.x, center.y, center.z + 2.2 * radius);
const controls = new OrbitControls(camera, renderer.domElement);
controls.target.copy(center);
renderer.setAnimationLoop(() => {
    controls.update();
    renderer.render(world, camera);
});

const light = new Newest((dim) => {
    const groups = Object.fromEntries(lamps.map(({ name, emission }) => [name, emission.map((e) => dim * e)]));
    return scene.radiosity({ groups }, { at: "corners", format: "f2" });
}, ({ values, shape }, dim) => {
    const stride = shape.length > 1 && shape[0] === 3 ? count : 0; // other numbers of channels are grey
    for (let v = 0; v < count; v++)
        for (let c = 0; c < 3; c++) colours.array[3 * v + c] = values[c * stride + v];
    if (window.shown === undefined) renderer.toneMappingExposure = 0.5 * values.length / values.reduce((sum, value) => sum + value, 0);
    colours.needsUpdate = true;
    Object.assign(window, { shown: { dim, scene, mesh, camera, renderer, light } });
}, console.error);
const slider = document.querySelector("input");
slider.oninput = () => light.want(slider.valueAsNumber);
slider.oninput();
