// Elements with hanging corners in their edges are drawn as polygons that have these, too: triangles that meet only
// half of an edge leave single pixels between them free, as their edges are rounded apart.
import type { MeshImage, MeshPane, SceneMesh } from "./glb.ts";
import type { Nodes } from "./t_junctions.ts";

/** What is drawn of a mesh; vertices of its own stand behind those of the mesh. */
export interface Drawn {
    positions: Float32Array;
    elementOf: Uint32Array;
    nodeOf: Uint32Array;
    index: Uint32Array;
    uv: Float32Array | null;
    images: MeshImage[];
    panes: MeshPane[];
}

/** Triangles of a convex polygon, of which some corners lie in an edge (`isFlat`): each triangle has an area. */
export function trianglesOf(corners: readonly number[], isFlat: readonly boolean[]): number[] {
    const left = [...corners], flat = [...isFlat], out: number[] = [];
    while (left.length > 3) {
        const before = (k: number): number => (k + left.length - 1) % left.length, after = (k: number): number =>
            (k + 1) % left.length;
        // A corner beside a flat one is cut off first, which is flat no more then.
        let k = left.findIndex((_, i) => !flat[i] && (flat[before(i)] || flat[after(i)]));
        if (k < 0) k = flat.indexOf(false);
        out.push(left[before(k)], left[k], left[after(k)]);
        flat[before(k)] = flat[after(k)] = false;
        left.splice(k, 1);
        flat.splice(k, 1);
    }
    return [...out, ...left];
}

/** O(vertices). */
export function splitEdges(mesh: SceneMesh, nodes: Nodes): Drawn {
    const { positions, elementOf, index, uv, images, panes } = mesh, { nodeOf, inner } = nodes;
    if (inner.size === 0) return { positions, elementOf, nodeOf, index, uv, images, panes };
    const vertices = elementOf.length,
        own: { like: number; node: number; element: number; uv: [number, number] }[] = [],
        all: number[] = [];
    // Of each place in the index, what it became.
    const moved = new Map<number, number>(
        [...images, ...panes].flatMap(({ first, count }) => [[first, 0], [first + count, 0]]),
    );
    let at = 0;
    for (let begin = 0, end = 0; begin < vertices; begin = end) {
        while (end < vertices && elementOf[end] === elementOf[begin]) end++;
        const indices = 3 * (end - begin - 2);
        if (moved.has(at)) moved.set(at, all.length);
        const corners: number[] = [], flat: boolean[] = [];
        for (let v = begin; v < end; v++) {
            corners.push(v);
            flat.push(false);
            const w = v + 1 < end ? v + 1 : begin;
            for (const { vertex, along, node } of (inner.get(v) ?? []).sort((one, other) => one.along - other.along)) {
                corners.push(vertices + own.length);
                flat.push(true);
                const mix = (
                    d: number,
                ): number => (uv === null ? 0 : uv[2 * v + d] + along * (uv[2 * w + d] - uv[2 * v + d]));
                own.push({ like: vertex, node, element: elementOf[v], uv: [mix(0), mix(1)] });
            }
        }
        if (corners.length === end - begin) { for (let k = 0; k < indices; k++) all.push(index[at + k]); }
        else all.push(...trianglesOf(corners, flat));
        at += indices;
    }
    if (moved.has(at)) moved.set(at, all.length);
    const longer = <T extends Float32Array | Uint32Array>(to: T, from: T): T => {
        to.set(from);
        return to;
    };
    const place = <T extends { first: number; count: number }>(part: T): T => {
        const first = moved.get(part.first) as number;
        return { ...part, first, count: (moved.get(part.first + part.count) as number) - first };
    };
    const drawn: Drawn = {
        positions: longer(new Float32Array(3 * (vertices + own.length)), positions),
        elementOf: longer(new Uint32Array(vertices + own.length), elementOf),
        nodeOf: longer(new Uint32Array(vertices + own.length), nodeOf),
        index: Uint32Array.from(all),
        uv: uv === null ? null : longer(new Float32Array(2 * (vertices + own.length)), uv),
        images: images.map(place),
        panes: panes.map(place),
    };
    own.forEach((one, k) => {
        drawn.positions.set(positions.subarray(3 * one.like, 3 * one.like + 3), 3 * (vertices + k));
        drawn.elementOf[vertices + k] = one.element;
        drawn.nodeOf[vertices + k] = one.node;
        drawn.uv?.set(one.uv, 2 * (vertices + k));
    });
    return drawn;
}
