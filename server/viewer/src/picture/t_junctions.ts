// T-junctions, or hanging nodes: where elements of different sizes meet, the corner of a small one stands inside an
// edge of a large one. Along that edge the large one is drawn linear; so the node has that value, or the picture has
// steps and cracks there.
import type { SceneMesh } from "./glb.ts";

/** Nodes of smooth shading, of which those at T-junctions hang on others. */
export interface Nodes {
    count: number;
    /** Of each vertex, its node. */
    nodeOf: Uint32Array;
    /** The elements at node i stand in elements[first[i]] to elements[first[i + 1] − 1]. */
    first: Uint32Array;
    elements: Uint32Array;
    /** Of each of `elements` its weight; null: nodes are plain means. */
    weights: Float32Array | null;
    /** Of the edges that begin at these vertices, vertices of other elements inside them, where (0 to 1), and the node
     * there. */
    inner: Map<number, { vertex: number; along: number; node: number }[]>;
}

/** Cosine of 30 degrees, at which the daemon parts surfaces. */
const SURFACE_COS = 0.866;

/** Math.hypot takes many times as long, to be right for squares beyond a float's range. */
const size = (x: number, y: number, z: number): number => Math.sqrt(x * x + y * y + z * z);

/** Nodes inside edges: the value of node[i] is 1 − at[i] of that of from[i] and at[i] of that of to[i]. */
interface Ties {
    node: number[];
    from: number[];
    to: number[];
    at: number[];
    /** Of the edge, m. */
    length: number[];
    /** Nodes that are added for corners of other surfaces. */
    extra: number;
}

/** Gives hanging nodes the elements of their edge's ends, with weights. O(vertices), where edges meet few parts of
 * others. */
export function tieTJunctions(mesh: SceneMesh, nodes: Nodes): Nodes {
    const edges = loneEdges(mesh, nodes);
    const ties = findTies(mesh, nodes, edges);
    return ties.node.length === 0 ? nodes : withWeights(nodes, ties);
}

/** The edges that belong to one element alone, as pairs of vertices. Only these have hanging nodes, and only their ends
 * hang. */
function loneEdges(mesh: SceneMesh, { nodeOf, first, elements }: Nodes): number[] {
    const out: number[] = [], { elementOf } = mesh, vertices = elementOf.length;
    for (let begin = 0, end = 0; begin < vertices; begin = end) {
        const own = elementOf[begin];
        while (end < vertices && elementOf[end] === own) end++;
        for (let v = begin; v < end; v++) {
            const w = v + 1 < end ? v + 1 : begin, a = nodeOf[v], b = nodeOf[w], endOfA = first[a + 1],
                endOfB = first[b + 1];
            let isShared = false;
            for (let i = first[a]; i < endOfA && !isShared; i++) {
                const other = elements[i];
                if (other === own) continue;
                for (let k = first[b]; k < endOfB && !isShared; k++) isShared = elements[k] === other;
            }
            if (!isShared && a !== b) out.push(v, w);
        }
    }
    return out;
}

/** The candidates by cubic cells; each cell is a chain. */
class Grid {
    private readonly heads: Int32Array;
    private readonly next: Int32Array;

    constructor(mesh: SceneMesh, private readonly candidates: readonly number[], private readonly cell: number) {
        let slots = 16;
        while (slots < candidates.length) slots *= 2;
        this.heads = new Int32Array(slots).fill(-1);
        this.next = new Int32Array(candidates.length);
        candidates.forEach((v, i) => {
            const p = mesh.positions,
                slot = this.slot(this.cellOf(p[3 * v]), this.cellOf(p[3 * v + 1]), this.cellOf(p[3 * v + 2]));
            this.next[i] = this.heads[slot];
            this.heads[slot] = i;
        });
    }

    private cellOf(x: number): number {
        return Math.floor(x / this.cell);
    }

    private slot(x: number, y: number, z: number): number {
        let hash = Math.imul(x, 0x9e3779b1);
        hash = Math.imul(hash ^ (hash >>> 15) ^ y, 0x85ebca6b);
        hash = Math.imul(hash ^ (hash >>> 13) ^ z, 0xc2b2ae35);
        return (hash ^ (hash >>> 16)) & (this.heads.length - 1);
    }

    /** Visits the candidates in the cells that a box meets, and others that share their place in the table. */
    visit(low: readonly number[], high: readonly number[], visitor: (vertex: number) => void): void {
        for (let x = this.cellOf(low[0]); x <= this.cellOf(high[0]); x++)
            for (let y = this.cellOf(low[1]); y <= this.cellOf(high[1]); y++)
                for (let z = this.cellOf(low[2]); z <= this.cellOf(high[2]); z++)
                    for (let i = this.heads[this.slot(x, y, z)]; i >= 0; i = this.next[i]) visitor(this.candidates[i]);
    }
}

function findTies(mesh: SceneMesh, { nodeOf, count, inner }: Nodes, edges: readonly number[]): Ties {
    const { positions: p, normals: n } = mesh,
        ties: Ties = { node: [], from: [], to: [], at: [], length: [], extra: 0 };
    const tieOf = new Int32Array(count).fill(-1), isCandidate = new Uint8Array(count), candidates: number[] = [];
    let total = 0, longest = 0, most = 0;
    for (let e = 0; e < edges.length; e += 2) {
        const a = 3 * edges[e], b = 3 * edges[e + 1],
            length = size(p[b] - p[a], p[b + 1] - p[a + 1], p[b + 2] - p[a + 2]);
        total += length;
        longest = Math.max(longest, length);
        for (let d = 0; d < 3; d++) most = Math.max(most, Math.abs(p[a + d]));
        for (const v of [edges[e], edges[e + 1]]) {
            if (isCandidate[nodeOf[v]] === 0) candidates.push(v);
            isCandidate[nodeOf[v]] = 1;
        }
    }
    // Positions are floats, and many scene files have six digits.
    const tolerance = Math.max(1e-6 * most, 1e-30);
    // Some cells for an edge, as small objects have many nodes, and no edge through more than some thousand cells.
    const cell = Math.max(total / (edges.length + 1), longest / 4096, 4 * tolerance),
        grid = new Grid(mesh, candidates, cell);
    const groupOf = (vertex: number): number => mesh.groupOf[mesh.elementOf[vertex]];
    const low = [0, 0, 0], high = [0, 0, 0], way = [0, 0, 0];
    for (let e = 0; e < edges.length; e += 2) {
        const v = edges[e], w = edges[e + 1], a = 3 * v, b = 3 * w;
        for (let d = 0; d < 3; d++) way[d] = p[b + d] - p[a + d];
        const length = size(way[0], way[1], way[2]), pieces = Math.ceil(length / cell);
        const add = (at: number, node: number, t: number, length: number): void => {
            [ties.node[at], ties.from[at], ties.to[at], ties.at[at], ties.length[at]] = [node, nodeOf[v], nodeOf[w], t,
                length];
        };
        const tie = (u: number): void => {
            const node = nodeOf[u], q = 3 * u, known = tieOf[node];
            if (node === nodeOf[v] || node === nodeOf[w]) return;
            const x = p[q] - p[a], y = p[q + 1] - p[a + 1], z = p[q + 2] - p[a + 2];
            const t = (x * way[0] + y * way[1] + z * way[2]) / (length * length);
            if (!(t * length > tolerance && (1 - t) * length > tolerance)) return;
            if (size(x - t * way[0], y - t * way[1], z - t * way[2]) > tolerance) return;
            const mx = n[a] + n[b], my = n[a + 1] + n[b + 1], mz = n[a + 2] + n[b + 2];
            const isOwn = mx * n[q] + my * n[q + 1] + mz * n[q + 2] >= SURFACE_COS * size(mx, my, mz)
                && groupOf(u) === groupOf(v);
            // An edge is drawn with all corners inside it; one of another surface has a node of its own there.
            const within = inner.get(v) ?? [], same = within.find((other) =>
                Math.abs(other.along - t) * length <= tolerance
            );
            if (same === undefined) {
                inner.set(v, [...within, { vertex: u, along: t, node: isOwn ? node : count + ties.extra }]);
                if (!isOwn) add(ties.node.length, count + ties.extra++, t, length);
            } else if (isOwn) {
                same.node = node;
            }
            if (!isOwn) return;
            // The longest of several such edges wins.
            if (known >= 0 && ties.length[known] >= length) return;
            const at = known >= 0 ? known : ties.node.length;
            tieOf[node] = at;
            add(at, node, t, length);
        };
        for (let k = 0; k < pieces; k++) {
            for (let d = 0; d < 3; d++) {
                const one = p[a + d] + (way[d] * k) / pieces, other = p[a + d] + (way[d] * (k + 1)) / pieces;
                low[d] = Math.min(one, other) - tolerance;
                high[d] = Math.max(one, other) + tolerance;
            }
            grid.visit(low, high, tie);
        }
    }
    return ties;
}

/** Takes the ties in, long edges first; one by which a node would hang on itself is left out: parts of 1/3 and of 1/4
 * of one edge have such, and agree only where both have a node. */
function withWeights(nodes: Nodes, ties: Ties): Nodes {
    const count = nodes.count + ties.extra, tieOf = new Int32Array(count).fill(-1),
        order = ties.node.map((_, i) => i).sort((i, k) => ties.length[k] - ties.length[i]);
    const hangsOn = (from: number, on: number): boolean => {
        if (from === on) return true;
        if (tieOf[from] < 0) return false;
        const stack = [from], seen = new Set<number>();
        for (let node = stack.pop(); node !== undefined; node = stack.pop()) {
            if (node === on) return true;
            const i = tieOf[node];
            if (i < 0 || seen.has(node)) continue;
            seen.add(node);
            stack.push(ties.from[i], ties.to[i]);
        }
        return false;
    };
    for (const i of order)
        if (!hangsOn(ties.from[i], ties.node[i]) && !hangsOn(ties.to[i], ties.node[i])) tieOf[ties.node[i]] = i;
    const lists = new Map<number, Map<number, number>>();
    /** Elements and weights of a node that hangs on others that hang. */
    const listOf = (node: number): Map<number, number> => {
        const known = lists.get(node), i = tieOf[node], out = new Map<number, number>();
        if (known !== undefined) return known;
        const add = (element: number, weight: number): void => {
            out.set(element, (out.get(element) ?? 0) + weight);
        };
        if (i < 0) {
            const { first, elements } = nodes, begin = first[node], end = first[node + 1];
            for (let k = begin; k < end; k++) add(elements[k], 1 / (end - begin));
            return out;
        }
        for (const [element, weight] of listOf(ties.from[i])) add(element, (1 - ties.at[i]) * weight);
        for (const [element, weight] of listOf(ties.to[i])) add(element, ties.at[i] * weight);
        lists.set(node, out);
        return out;
    };
    const countOf = (node: number): number => nodes.first[node + 1] - nodes.first[node],
        isFree = (node: number): boolean => tieOf[node] < 0;
    const isPlain = (i: number): boolean => isFree(ties.from[i]) && isFree(ties.to[i]);
    const first = new Uint32Array(count + 1);
    for (let node = 0; node < count; node++) {
        const i = tieOf[node];
        first[node + 1] = first[node]
            + (i < 0 ? countOf(node) : isPlain(i) ? countOf(ties.from[i]) + countOf(ties.to[i]) : listOf(node).size);
    }
    const elements = new Uint32Array(first[count]), weights = new Float32Array(first[count]);
    const put = (at: number, node: number, share: number): number => {
        const begin = nodes.first[node], count = countOf(node);
        elements.set(nodes.elements.subarray(begin, begin + count), at);
        weights.fill(share / count, at, at + count);
        return at + count;
    };
    for (let node = 0; node < count; node++) {
        const i = tieOf[node];
        let at = first[node];
        if (i < 0) put(at, node, 1);
        else if (isPlain(i)) put(put(at, ties.from[i], 1 - ties.at[i]), ties.to[i], ties.at[i]);
        else
            for (const [element, weight] of listOf(node)) {
                elements[at] = element;
                weights[at++] = weight;
            }
    }
    return { ...nodes, count, first, elements, weights };
}
