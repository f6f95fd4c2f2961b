// Reads the mesh of a scene: the binary glTF of GET /v1/scenes/NAME/mesh?corners=elements, in the layout that the
// daemon writes (one node per group, POSITION, NORMAL, _ELEMENT, _CORNER, indices; an element's vertices are its own).
import type { Rgb } from "../base/colour.ts";

/** The light that a pane lets pass: its part at normal incidence, by all faces that a ray crosses together. */
export interface Glass {
    transmittance: number;
    faces: number;
}

export interface MeshGroup {
    name: string;
    /** Its elements, ascending. */
    elements: Uint32Array;
    /** Those of them that figures take in: not those below a body that stands on them. */
    counted: Uint32Array;
    /** Mean reflectance. */
    reflectance: Rgb;
    /** Emission of its own, in the store's unit; null: it is dark. */
    emission: Rgb | null;
    area: number;
    /** Null: it is opaque. */
    glass: Glass | null;
}

/** "pane, T = 0.78", for people. */
export function glassText({ transmittance, faces }: Glass): string {
    return `pane, T = ${Number(transmittance.toPrecision(3))}${faces > 1 ? ` of ${faces} faces together` : ""}`;
}

/** A group of panes. */
export interface MeshPane {
    /** Its part of the index. */
    first: number;
    count: number;
    glass: Glass;
}

/** An image on all elements of a group. */
export interface MeshImage {
    group: number;
    /** Its part of the index. */
    first: number;
    count: number;
    jpeg: Uint8Array<ArrayBuffer>;
    /** Linear light of the image times this is the reflectance. */
    factor: Rgb;
    /** Continuations in u and v, as glTF numbers them. */
    wrap: [number, number];
}

/** Corners that elements share, at which smooth light is the sum of parts p from parts[i] to parts[i + 1] − 1, each of
 * weights[k] times that of elements[k] for k from first[p] to first[p + 1] − 1, or 0 where that is below 0. */
export interface MeshCorners {
    count: number;
    parts: Uint32Array;
    first: Uint32Array;
    elements: Uint32Array;
    weights: Float32Array;
}

export interface SceneMesh {
    elements: number;
    positions: Float32Array;
    normals: Float32Array;
    /** Of each vertex, its element and its corner. */
    elementOf: Uint32Array;
    cornerOf: Uint32Array;
    corners: MeshCorners;
    index: Uint32Array;
    /** Of each element, its group and its area in m². */
    groupOf: Uint32Array;
    area: Float64Array;
    groups: MeshGroup[];
    /** Elements below a body that stands on them, which figures leave out. */
    buried: ReadonlySet<number>;
    /** The axis of the store that became y. */
    up: "x" | "y" | "z";
    images: MeshImage[];
    panes: MeshPane[];
    /** Panes pass less of the light that comes aslant. */
    glassByAngle: boolean;
    /** Of each vertex its place in the image; null without images. */
    uv: Float32Array | null;
    /** [3][elements], 1 without an image; null without images. */
    reflectance: Float32Array | null;
}

interface Accessor {
    bufferView: number;
    byteOffset?: number;
    componentType: number;
    count: number;
    type: string;
}
interface Gltf {
    nodes: { name?: string; mesh?: number; children?: number[]; extras?: { buried?: number[]; glass?: Glass } }[];
    meshes: { primitives: { attributes: { [name: string]: number }; indices: number; material?: number }[] }[];
    accessors: Accessor[];
    bufferViews: { byteOffset?: number; byteLength: number }[];
    materials?: {
        pbrMetallicRoughness?: { baseColorFactor?: number[]; baseColorTexture?: { index: number } };
        emissiveFactor?: number[];
        extensions?: { KHR_materials_emissive_strength?: { emissiveStrength?: number } };
    }[];
    textures?: { sampler?: number; source: number }[];
    samplers?: { wrapS?: number; wrapT?: number }[];
    images?: { bufferView?: number }[];
    extras?: {
        lambert?: {
            up?: string;
            glass_law?: string;
            corners?: { count: number; parts: number; first: number; elements: number; weights: number };
        };
    };
}

const WIDTHS: { [type: string]: number } = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4 };

function chunks(file: ArrayBuffer): { gltf: Gltf; start: number } {
    const view = new DataView(file);
    if (file.byteLength < 20 || view.getUint32(0, true) !== 0x46546c67) throw new Error("the mesh is no binary glTF");
    const length = view.getUint32(12, true);
    const text = new TextDecoder().decode(new Uint8Array(file, 20, length));
    return { gltf: JSON.parse(text) as Gltf, start: 20 + length + 8 };
}

function rgb(values: readonly number[] | undefined, otherwise: number): Rgb {
    return [0, 1, 2].map((i) => values?.[i] ?? otherwise) as Rgb;
}

function materialOf(gltf: Gltf, index: number | undefined): { reflectance: Rgb; emission: Rgb | null } {
    const material = index === undefined ? undefined : gltf.materials?.[index];
    const luminance = material?.extensions?.KHR_materials_emissive_strength?.emissiveStrength ?? 1;
    const emission = rgb(material?.emissiveFactor, 0).map((v) => v * luminance * Math.PI) as Rgb;
    const colour = material?.pbrMetallicRoughness?.baseColorFactor;
    return {
        // Of a pane, which is blended, this share of its colour is diffuse.
        reflectance: rgb(colour, 1).map((v) => v * (colour?.[3] ?? 1)) as Rgb,
        emission: emission.some((v) => v > 0) ? emission : null,
    };
}

export function readMesh(file: ArrayBuffer): SceneMesh {
    const { gltf, start } = chunks(file);
    const floats = (accessor: Accessor): Float32Array =>
        new Float32Array(file,
            start + (gltf.bufferViews[accessor.bufferView].byteOffset ?? 0) + (accessor.byteOffset ?? 0),
            accessor.count * WIDTHS[accessor.type]);
    const parts = gltf.nodes.filter((node) => node.mesh !== undefined).flatMap((node) =>
        gltf.meshes[node.mesh as number].primitives.map((primitive) => ({ name: node.name ?? "",
            hidden: node.extras?.buried ?? [], glass: node.extras?.glass ?? null, primitive })
        )
    );
    let vertices = 0, indices = 0;
    for (const { primitive } of parts) {
        vertices += gltf.accessors[primitive.attributes.POSITION].count;
        indices += gltf.accessors[primitive.indices].count;
    }
    const positions = new Float32Array(3 * vertices), normals = new Float32Array(3 * vertices),
        elementOf = new Uint32Array(vertices), cornerOf = new Uint32Array(vertices), index = new Uint32Array(indices);
    const ranges: { name: string; vertices: [number, number]; material: number | undefined; glass: Glass | null }[] =
        [];
    const panes: MeshPane[] = [];
    const buried = new Set<number>();
    let atVertex = 0, atIndex = 0, elements = 0;
    for (const { name, hidden, glass, primitive } of parts) {
        for (const element of hidden) buried.add(element);
        positions.set(floats(gltf.accessors[primitive.attributes.POSITION]), 3 * atVertex);
        normals.set(floats(gltf.accessors[primitive.attributes.NORMAL]), 3 * atVertex);
        cornerOf.set(floats(gltf.accessors[primitive.attributes._CORNER]), atVertex);
        const ids = floats(gltf.accessors[primitive.attributes._ELEMENT]);
        for (let v = 0; v < ids.length; v++) {
            elementOf[atVertex + v] = ids[v];
            if (ids[v] >= elements) elements = ids[v] + 1;
        }
        const accessor = gltf.accessors[primitive.indices];
        const from = start + (gltf.bufferViews[accessor.bufferView].byteOffset ?? 0) + (accessor.byteOffset ?? 0);
        const own = accessor.componentType === 5125
            ? new Uint32Array(file, from, accessor.count)
            : new Uint16Array(file, from, accessor.count);
        for (let i = 0; i < own.length; i++) index[atIndex + i] = own[i] + atVertex;
        ranges.push({ name, vertices: [atVertex, atVertex + ids.length], material: primitive.material, glass });
        if (glass !== null) panes.push({ first: atIndex, count: own.length, glass });
        atVertex += ids.length;
        atIndex += own.length;
    }
    const area = new Float64Array(elements), groupOf = new Uint32Array(elements);
    addAreas(positions, elementOf, index, area);
    const groups = ranges.map(({ name, vertices: [first, end], material, glass }, g) => {
        const own = new Set<number>();
        for (let v = first; v < end; v++) own.add(elementOf[v]);
        const ascending = Uint32Array.from(own).sort();
        let total = 0;
        for (const element of ascending) {
            groupOf[element] = g;
            total += area[element];
        }
        return {
            name,
            elements: ascending,
            counted: ascending.filter((element) => !buried.has(element)),
            area: total,
            glass,
            ...materialOf(gltf, material),
        };
    });
    const { up, glass_law: law } = gltf.extras?.lambert ?? {};
    const mesh: SceneMesh = {
        elements,
        positions,
        normals,
        elementOf,
        cornerOf,
        corners: cornersOf(gltf, file, start),
        index,
        groupOf,
        area,
        groups,
        buried,
        up: up === "x" || up === "z" ? up : "y",
        images: [],
        panes,
        glassByAngle: law !== "none",
        uv: null,
        reflectance: null,
    };
    addImages(mesh, file, start, gltf, parts.map(({ primitive }) => primitive));
    return mesh;
}

function cornersOf(gltf: Gltf, file: ArrayBuffer, start: number): MeshCorners {
    const about = gltf.extras?.lambert?.corners;
    if (about === undefined) throw new Error("the mesh has no corners");
    const part = (view: number): [ArrayBuffer, number, number] => {
        const { byteOffset, byteLength } = gltf.bufferViews[view];
        return [file, start + (byteOffset ?? 0), byteLength / 4];
    };
    return { count: about.count, parts: new Uint32Array(...part(about.parts)),
        first: new Uint32Array(...part(about.first)), elements: new Uint32Array(...part(about.elements)),
        weights: new Float32Array(...part(about.weights)) };
}

type Primitive = Gltf["meshes"][number]["primitives"][number];

/** Takes in images, the places of vertices in them, and the reflectances that their groups' elements have. */
function addImages(mesh: SceneMesh, file: ArrayBuffer, start: number, gltf: Gltf,
    primitives: readonly Primitive[]): void
{
    const floats = (index: number): Float32Array => {
        const accessor = gltf.accessors[index], view = gltf.bufferViews[accessor.bufferView];
        return new Float32Array(file, start + (view.byteOffset ?? 0) + (accessor.byteOffset ?? 0),
            accessor.count * WIDTHS[accessor.type]);
    };
    let vertex = 0, first = 0;
    primitives.forEach((primitive, group) => {
        const vertices = gltf.accessors[primitive.attributes.POSITION].count,
            { count } = gltf.accessors[primitive.indices];
        const material = primitive.material === undefined
            ? undefined
            : gltf.materials?.[primitive.material]?.pbrMetallicRoughness;
        const texture = material?.baseColorTexture === undefined
            ? undefined
            : gltf.textures?.[material.baseColorTexture.index];
        const view = texture === undefined
            ? undefined
            : gltf.bufferViews[gltf.images?.[texture.source].bufferView ?? -1];
        if (texture !== undefined && view !== undefined) {
            mesh.uv ??= new Float32Array(2 * mesh.elementOf.length);
            mesh.reflectance ??= new Float32Array(3 * mesh.elements).fill(1);
            mesh.uv.set(floats(primitive.attributes.TEXCOORD_0), 2 * vertex);
            const own = floats(primitive.attributes._REFLECTANCE);
            for (let v = 0; v < vertices; v++)
                for (let c = 0; c < 3; c++)
                    mesh.reflectance[c * mesh.elements + mesh.elementOf[vertex + v]] = own[3 * v + c];
            const sampler = gltf.samplers?.[texture.sampler ?? -1];
            mesh.images.push({
                group,
                first,
                count,
                factor: rgb(material?.baseColorFactor, 1),
                wrap: [sampler?.wrapS ?? 10497, sampler?.wrapT ?? 10497],
                jpeg: new Uint8Array(file, start + (view.byteOffset ?? 0), view.byteLength),
            });
            mesh.groups[group].reflectance = meanOf(mesh, mesh.groups[group]);
        }
        vertex += vertices;
        first += count;
    });
}

/** The mean by area of a group's reflectance. */
function meanOf(mesh: SceneMesh, group: MeshGroup): Rgb {
    const sum: Rgb = [0, 0, 0];
    for (const element of group.elements)
        for (let c = 0; c < 3; c++)
            sum[c] += (mesh.reflectance?.[c * mesh.elements + element] ?? 1) * mesh.area[element];
    return sum.map((v) => v / Math.max(group.area, 1e-30)) as Rgb;
}

/** A direction or place of the store's axes in those of the picture, as the daemon turns the mesh. */
export function turned(up: SceneMesh["up"], [x, y, z]: readonly [number, number, number]): [number, number, number] {
    return up === "x" ? [-y, x, z] : up === "z" ? [x, z, -y] : [x, y, z];
}

function addAreas(p: Float32Array, elementOf: Uint32Array, index: Uint32Array, area: Float64Array): void {
    for (let t = 0; t < index.length; t += 3) {
        const [a, b, c] = [3 * index[t], 3 * index[t + 1], 3 * index[t + 2]];
        const [ux, uy, uz] = [p[b] - p[a], p[b + 1] - p[a + 1], p[b + 2] - p[a + 2]];
        const [vx, vy, vz] = [p[c] - p[a], p[c + 1] - p[a + 1], p[c + 2] - p[a + 2]];
        area[elementOf[index[t]]] += 0.5 * Math.hypot(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx);
    }
}
