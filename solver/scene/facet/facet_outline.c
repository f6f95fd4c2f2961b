/* An outline of joined elements is followed side by side, vertices on a straight line are dropped (Douglas
 * and Peucker 1973), bridges join its holes to it, and it is cut into triangles and parallelograms. A part is
 * left alone if its pieces leave out a corner, differ in area, or have few elements each. */
#include "solver/scene/facet/facet_outline.h"

#include "solver/base/array_grow.h"
#include "solver/scene/plane.h"
#include "solver/scene/polygon_split.h"
#include "solver/scene/tables.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The most sides of a part: each is compared with all its corners. */
enum { SIDES_MOST = 8192 };

typedef struct on_side {
    double along;
    uint32_t vertex;
} on_side;

typedef struct cuts {
    on_side *at;
    size_t n, capacity;
} cuts;

/* The distance of vertex v from the segment from a to b, metres; infinity where it is not between them. */
static double vertex_off_way(const mesh *m, uint32_t a, uint32_t v, uint32_t b) {
    const double *p = m->vertices[a], *q = m->vertices[b], *x = m->vertices[v];
    double along = 0, length = 0, off = 0;
    for (int d = 0; d < 3; d++) {
        along += (x[d] - p[d]) * (q[d] - p[d]);
        length += (q[d] - p[d]) * (q[d] - p[d]);
    }
    if (!(along > 0 && along < length)) return INFINITY;
    for (int d = 0; d < 3; d++) {
        const double e = x[d] - p[d] - along / length * (q[d] - p[d]);
        off += e * e;
    }
    return sqrt(off);
}

static int on_side_order(const void *a, const void *b) {
    const on_side *p = a, *q = b;
    return (p->along > q->along) - (p->along < q->along);
}

static int between_order(const void *a, const void *b) {
    const side *p = a, *q = b;
    const uint32_t p_low = p->from < p->to ? p->from : p->to, p_high = p->from < p->to ? p->to : p->from;
    const uint32_t q_low = q->from < q->to ? q->from : q->to, q_high = q->from < q->to ? q->to : q->from;
    if (p_low != q_low) return p_low < q_low ? -1 : 1;
    if (p_high != q_high) return p_high < q_high ? -1 : 1;
    return (p->from > q->from) - (p->from < q->from);
}

static lam_status append(side_list *list, side s, lam_error *error) {
    if (array_grow(&list->sides, &list->capacity, list->n + 1, sizeof *list->sides, "facets", error) !=
        LAM_OK)
        return LAM_ERR_MEMORY;
    list->sides[list->n++] = s;
    return LAM_OK;
}

/* Appends the side s, cut at the corners of all sides that lie on it. */
static lam_status cut_side(const mesh *m, double flat, const side *all, size_t n, side s, cuts *c,
                           side_list *out, lam_error *error) {
    lam_status status = LAM_OK;
    c->n = 0;
    for (size_t k = 0; k < n; k++) {
        const uint32_t v = all[k].from;
        if (v == s.from || v == s.to || vertex_off_way(m, s.from, v, s.to) > flat) continue;
        if (array_grow(&c->at, &c->capacity, c->n + 1, sizeof *c->at, "facets", error) != LAM_OK)
            return LAM_ERR_MEMORY;
        const double *p = m->vertices[s.from], *x = m->vertices[v];
        c->at[c->n++] = (on_side){hypot(hypot(x[0] - p[0], x[1] - p[1]), x[2] - p[2]), v};
    }
    if (c->n > 1) qsort(c->at, c->n, sizeof *c->at, on_side_order);
    uint32_t from = s.from;
    for (size_t k = 0; k < c->n; k++) {
        if (c->at[k].vertex == from) continue;
        TRY(append(out, (side){from, c->at[k].vertex, s.part}, error));
        from = c->at[k].vertex;
    }
    TRY(append(out, (side){from, s.to, s.part}, error));
done:
    return status;
}

/* Removes pairs of opposite sides from sides[0] ... sides[n-1]; returns how many are left. */
static size_t cancel(side *sides, size_t n) {
    size_t left = 0;
    qsort(sides, n, sizeof *sides, between_order);
    for (size_t first = 0, last; first < n; first = last) {
        const side s = sides[first];
        size_t forward = 0;
        for (last = first; last < n && ((sides[last].from == s.from && sides[last].to == s.to) ||
                                        (sides[last].from == s.to && sides[last].to == s.from));
             last++)
            forward += sides[last].from == s.from;
        const size_t backward = last - first - forward;
        const side turned = {s.to, s.from, s.part};
        for (size_t k = backward; k < forward; k++) sides[left++] = s;
        for (size_t k = forward; k < backward; k++) sides[left++] = turned;
    }
    return left;
}

lam_status sides_cancel(const mesh *m, double flat, side_list *list, lam_error *error) {
    lam_status status = LAM_OK;
    side_list out = {.n = 0};
    cuts c = {.n = 0};
    for (size_t first = 0, last; first < list->n; first = last) {
        const side *all = list->sides + first;
        const size_t begin = out.n;
        for (last = first; last < list->n && list->sides[last].part == all->part; last++) {
        }
        const bool many = last - first > SIDES_MOST;
        for (size_t k = first; k < last; k++)
            if (many)
                TRY(append(&out, list->sides[k], error));
            else
                TRY(cut_side(m, flat, all, last - first, list->sides[k], &c, &out, error));
        if (!many) out.n = begin + cancel(out.sides + begin, out.n - begin);
    }
    free(list->sides);
    *list = out;
    out.sides = NULL;
done:
    free(c.at);
    free(out.sides);
    return status;
}

/* The most corners of an outline, because cutting takes their square, and the most rounds in which parts are
 * found to stay alone, before all do. */
enum { OUTLINE_MOST = 4096, ROUNDS_MOST = 64 };

/* The least number of elements per piece. Below it casting is slower than against elements: pieces are
 * longer, and the element must be found in the grid. */
enum { ELEMENTS_EACH = 16 };

typedef struct loop {
    size_t first, count; /* in vertices */
    uint32_t part;
} loop;

/* The outline of one part: one closed walk, to which the loops of holes are joined by bridges. */
typedef struct walk {
    size_t n;
    uint32_t vertex[OUTLINE_MOST];
    double at[OUTLINE_MOST][2];
    bool tried[OUTLINE_MOST];
} walk;

typedef struct cutter {
    outlines *o;
    loop *loops;
    size_t n_loops;
    uint32_t *vertices; /* of the loops, one after the other */
    size_t n_vertices;
    bool *corner;       /* [n_vertices of the mesh]: must stay where it is met */
    uint32_t *next;     /* [n_vertices of the mesh]: the side that leaves a place */
    uint32_t *stamp;    /* [n_vertices of the mesh]: part + 1 that next is of */
    bool *walked;       /* [n_sides] */
    walk *outer, *hole; /* of one part */
    polygon_split_scratch scratch;
} cutter;

/* Follows the sides first ... last-1 of a part around; false when they branch or end. */
static bool follow(cutter *c, size_t first, size_t last) {
    const outlines *o = c->o;
    const uint32_t part = o->sides[first].part, mark = part + 1;
    for (size_t s = first; s < last; s++) {
        const uint32_t from = o->sides[s].from;
        if (c->stamp[from] == mark) return false;
        c->stamp[from] = mark;
        c->next[from] = (uint32_t)s;
    }
    for (size_t s = first; s < last; s++) {
        if (c->walked[s]) continue;
        loop l = {.first = c->n_vertices, .part = part};
        size_t t = s;
        while (!c->walked[t]) {
            c->walked[t] = true;
            c->vertices[c->n_vertices++] = o->sides[t].from;
            if (c->stamp[o->sides[t].to] != mark) return false;
            t = c->next[o->sides[t].to];
        }
        if (t != s) return false;
        l.count = c->n_vertices - l.first;
        c->loops[c->n_loops++] = l;
    }
    return true;
}

static void follow_all(cutter *c) {
    const outlines *o = c->o;
    for (size_t first = 0, last; first < o->n_sides; first = last) {
        const uint32_t part = o->sides[first].part;
        const size_t loops = c->n_loops, vertices = c->n_vertices;
        for (last = first; last < o->n_sides && o->sides[last].part == part; last++) {
        }
        if (o->alone[part] || follow(c, first, last)) continue;
        o->alone[part] = true;
        c->n_loops = loops;
        c->n_vertices = vertices;
    }
}

/* Vertices between two corners are dropped only if all of them lie on the segment: otherwise the farthest
 * becomes a corner (Douglas and Peucker 1973). Returns true where one did. */
static bool keep_bent(cutter *c, const loop *l) {
    const outlines *o = c->o;
    const uint32_t *v = c->vertices + l->first;
    bool changed = false;
    size_t start = 0;
    while (start < l->count && !c->corner[v[start]]) start++;
    if (start == l->count) return false;
    for (size_t k = 0, last = start; k < l->count;) {
        size_t end = last + 1, farthest = 0;
        double most = o->flat;
        while (!c->corner[v[end % l->count]]) end++;
        for (size_t i = last + 1; i < end; i++) {
            const double off = vertex_off_way(o->m, v[last % l->count], v[i % l->count], v[end % l->count]);
            if (off > most) most = off, farthest = i;
        }
        if (farthest > 0) changed = c->corner[v[farthest % l->count]] = true;
        k += end - last;
        last = end;
    }
    return changed;
}

/* Marks the places that are corners: of elements that are alone, and where an outline turns. */
static void find_corners(cutter *c) {
    const outlines *o = c->o;
    memset(c->corner, 0, o->m->n_vertices * sizeof *c->corner);
    for (size_t i = 0; i < o->n_elements; i++)
        for (size_t k = 0; k < mesh_corners(o->m, i) && o->alone[o->part[i]]; k++)
            c->corner[o->place[o->m->elements[i][k]]] = true;
    for (size_t l = 0; l < c->n_loops; l++) {
        const uint32_t *v = c->vertices + c->loops[l].first;
        const size_t count = c->loops[l].count;
        if (o->alone[c->loops[l].part]) continue;
        for (size_t i = 0; i < count; i++)
            if (vertex_off_way(o->m, v[(i + count - 1) % count], v[i], v[(i + 1) % count]) > o->flat)
                c->corner[v[i]] = true;
    }
    for (bool changed = true; changed;) {
        changed = false;
        for (size_t l = 0; l < c->n_loops; l++)
            if (!o->alone[c->loops[l].part] && keep_bent(c, &c->loops[l])) changed = true;
    }
}

/* The corners of a loop in the plane of its part; false when they are too many. */
static bool set_walk(const cutter *c, const loop *l, walk *w) {
    double x[3], y[3];
    plane_axes(c->o->normal[l->part], x, y);
    w->n = 0;
    for (size_t i = 0; i < l->count; i++) {
        const uint32_t v = c->vertices[l->first + i];
        if (!c->corner[v]) continue;
        if (w->n == OUTLINE_MOST) return false;
        const double *p = c->o->m->vertices[v];
        w->vertex[w->n] = v;
        w->at[w->n][0] = p[0] * x[0] + p[1] * x[1] + p[2] * x[2];
        w->at[w->n++][1] = p[0] * y[0] + p[1] * y[1] + p[2] * y[2];
    }
    return w->n >= 3;
}

static double doubled_area(const walk *w) {
    double sum = 0;
    for (size_t i = 1; i + 1 < w->n; i++) sum += plane_turn(w->at[0], w->at[i], w->at[i + 1]);
    return sum;
}

/* True where the segment from corner a of one walk to corner b of another intersects a side of w. */
static bool crosses(const walk *w, uint32_t from, const double a[2], uint32_t to, const double b[2]) {
    for (size_t i = 0; i < w->n; i++) {
        const size_t j = (i + 1) % w->n;
        const double *p = w->at[i], *q = w->at[j];
        if (w->vertex[i] == from || w->vertex[i] == to || w->vertex[j] == from || w->vertex[j] == to)
            continue;
        const double s = plane_turn(a, b, p), t = plane_turn(a, b, q), u = plane_turn(p, q, a),
                     v = plane_turn(p, q, b);
        if (((s <= 0 && t >= 0) || (s >= 0 && t <= 0)) && ((u <= 0 && v >= 0) || (u >= 0 && v <= 0)))
            return true;
    }
    return false;
}

/* True where a segment from corner i of a walk to b starts on the walk's inner side. */
static bool leaves_inwards(const walk *w, size_t i, const double b[2]) {
    const double *a = w->at[i], *before = w->at[(i + w->n - 1) % w->n], *after = w->at[(i + 1) % w->n];
    if (plane_turn(before, a, after) >= 0) return plane_turn(a, b, before) > 0 && plane_turn(b, a, after) > 0;
    return !(plane_turn(a, b, after) >= 0 && plane_turn(b, a, before) >= 0);
}

/* Joins a hole to the outer walk by a bridge from its rightmost corner to the nearest corner that is visible
 * from there and not behind the other holes. */
static bool bridge(cutter *c, const loop *holes, size_t n_holes, size_t now) {
    walk *outer = c->outer, *hole = c->hole;
    size_t right = 0, best = 0;
    if (!set_walk(c, &holes[now], hole) || outer->n + hole->n + 2 > OUTLINE_MOST) return false;
    for (size_t i = 1; i < hole->n; i++)
        if (hole->at[i][0] > hole->at[right][0]) right = i;
    const uint32_t from = hole->vertex[right];
    const double a[2] = {hole->at[right][0], hole->at[right][1]};
    memset(outer->tried, 0, outer->n * sizeof *outer->tried);
    for (size_t tries = 0;; tries++) {
        double nearest = INFINITY;
        if (tries == outer->n) return false;
        for (size_t i = 0; i < outer->n; i++) {
            const double distance = plane_distance(a, outer->at[i]);
            if (outer->tried[i] || distance >= nearest) continue;
            nearest = distance;
            best = i;
        }
        outer->tried[best] = true;
        const uint32_t to = outer->vertex[best];
        const double *b = outer->at[best];
        bool free = from != to && leaves_inwards(outer, best, a) && !crosses(outer, from, a, to, b);
        for (size_t h = now; h < n_holes && free; h++)
            free = set_walk(c, &holes[h], hole) && !crosses(hole, from, a, to, b);
        if (free) break;
    }
    if (!set_walk(c, &holes[now], hole)) return false;
    /* ... best, right, right+1, ..., right, best, ... */
    const size_t more = hole->n + 2;
    memmove(outer->vertex + best + more, outer->vertex + best, (outer->n - best) * sizeof *outer->vertex);
    memmove(outer->at + best + more, outer->at + best, (outer->n - best) * sizeof *outer->at);
    for (size_t i = 0; i <= hole->n; i++) {
        outer->vertex[best + 1 + i] = hole->vertex[(right + i) % hole->n];
        memcpy(outer->at[best + 1 + i], hole->at[(right + i) % hole->n], sizeof *outer->at);
    }
    outer->vertex[best] = outer->vertex[best + more];
    memcpy(outer->at[best], outer->at[best + more], sizeof *outer->at);
    outer->n += more;
    return true;
}

/* The one walk around a part of the loops first ... last-1. */
static bool outline(cutter *c, size_t first, size_t last) {
    size_t around = last;
    for (size_t l = first; l < last; l++) {
        if (!set_walk(c, &c->loops[l], c->outer)) return false;
        if (!(doubled_area(c->outer) > 0)) continue;
        if (around != last) return false;
        around = l;
    }
    if (around == last) return false;
    const loop swap = c->loops[first];
    c->loops[first] = c->loops[around];
    c->loops[around] = swap;
    if (!set_walk(c, &c->loops[first], c->outer)) return false;
    for (size_t h = 1; h < last - first; h++)
        if (!bridge(c, c->loops + first, last - first, h)) return false;
    return true;
}

/* A piece of four corners stays one if it is a parallelogram. */
static bool is_parallelogram(const outlines *o, const uint32_t piece[4]) {
    double off = 0;
    for (int d = 0; d < 3; d++) {
        const double e = o->m->vertices[piece[0]][d] - o->m->vertices[piece[1]][d] +
                         o->m->vertices[piece[2]][d] - o->m->vertices[piece[3]][d];
        off += e * e;
    }
    return off <= o->flat * o->flat;
}

static lam_status add_piece(outlines *o, const uint32_t corners[4], uint32_t part, lam_error *error) {
    if (array_grow(&o->pieces, &o->piece_capacity, o->n_pieces + 1, sizeof *o->pieces, "facets", error) !=
        LAM_OK)
        return LAM_ERR_MEMORY;
    if (array_grow(&o->piece_part, &o->owner_capacity, o->n_pieces + 1, sizeof *o->piece_part, "facets",
                   error) != LAM_OK)
        return LAM_ERR_MEMORY;
    memcpy(o->pieces[o->n_pieces], corners, sizeof *o->pieces);
    o->piece_part[o->n_pieces++] = part;
    return LAM_OK;
}

/* Cuts the part of the loops first ... last-1. The pieces are valid if they use every corner and have the
 * area of the elements; otherwise, or where they gain little, the elements stay alone. */
static lam_status cut_part(cutter *c, size_t first, size_t last, lam_error *error) {
    lam_status status = LAM_OK;
    outlines *o = c->o;
    const double(*v)[3] = (const double(*)[3])o->m->vertices;
    const uint32_t part = c->loops[first].part;
    const size_t before = o->n_pieces;
    double area = 0, round = 0;
    o->alone[part] = true;
    if (!outline(c, first, last)) return LAM_OK;
    const size_t n = c->outer->n;
    TRY(polygon_split(v, c->outer->vertex, n, 0, true, &c->scratch, error));
    for (size_t i = 0; i < n; i++) round += plane_distance(c->outer->at[i], c->outer->at[(i + 1) % n]);
    for (size_t p = 0; p < c->scratch.n_pieces; p++) {
        const uint32_t *piece = c->scratch.pieces[p];
        const uint32_t halves[2][4] = {{piece[0], piece[1], piece[2], MESH_NO_VERTEX},
                                       {piece[2], piece[3], piece[0], MESH_NO_VERTEX}};
        const bool quad = piece[3] != TABLE_NONE;
        area += triangle_area(v[piece[0]], v[piece[1]], v[piece[2]]) +
                (quad ? triangle_area(v[piece[2]], v[piece[3]], v[piece[0]]) : 0);
        if (quad && !is_parallelogram(o, piece)) {
            TRY(add_piece(o, halves[0], part, error));
            TRY(add_piece(o, halves[1], part, error));
        } else {
            TRY(add_piece(o, piece, part, error));
        }
    }
    const bool all = c->scratch.n_pieces == n - 2 || (n == 4 && c->scratch.n_pieces == 1);
    o->alone[part] = !all || (o->n_pieces - before) * ELEMENTS_EACH > o->size[part] ||
                     fabs(area - o->area[part]) > 1e-9 * o->area[part] + round * o->flat;
    if (o->alone[part]) o->n_pieces = before;
done:
    return status;
}

/* Cuts all parts; *failed is the number of parts that stay alone from now on. */
static lam_status cut_all(cutter *c, size_t *failed, lam_error *error) {
    lam_status status = LAM_OK;
    c->o->n_pieces = *failed = 0;
    find_corners(c);
    for (size_t first = 0, last; first < c->n_loops; first = last) {
        const uint32_t part = c->loops[first].part;
        for (last = first; last < c->n_loops && c->loops[last].part == part; last++) {
        }
        if (c->o->alone[part]) continue;
        TRY(cut_part(c, first, last, error));
        *failed += c->o->alone[part];
    }
done:
    return status;
}

lam_status outlines_cut(outlines *o, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = o->m->n_vertices;
    cutter c = {.o = o};
    c.loops = memory_allocate(o->n_sides, sizeof *c.loops, "facets", error);
    c.vertices = memory_allocate(o->n_sides, sizeof *c.vertices, "facets", error);
    c.walked = memory_allocate(o->n_sides, sizeof *c.walked, "facets", error);
    c.corner = memory_allocate(n, sizeof *c.corner, "facets", error);
    c.next = memory_allocate(n, sizeof *c.next, "facets", error);
    c.stamp = memory_allocate(n, sizeof *c.stamp, "facets", error);
    c.outer = memory_allocate(1, sizeof *c.outer, "facets", error);
    c.hole = memory_allocate(1, sizeof *c.hole, "facets", error);
    if (c.loops == NULL || c.vertices == NULL || c.walked == NULL || c.corner == NULL || c.next == NULL ||
        c.stamp == NULL || c.outer == NULL || c.hole == NULL)
        TRY(LAM_ERR_MEMORY);
    follow_all(&c);
    /* A part that is not joined restores corners that its neighbours had left out: they are cut again. */
    for (size_t round = 0, failed = 1; failed > 0; round++) {
        if (round == ROUNDS_MOST) memset(o->alone, true, o->n_parts * sizeof *o->alone);
        TRY(cut_all(&c, &failed, error));
    }
done:
    polygon_split_scratch_free(&c.scratch);
    free(c.loops);
    free(c.vertices);
    free(c.walked);
    free(c.corner);
    free(c.next);
    free(c.stamp);
    free(c.outer);
    free(c.hole);
    return status;
}
