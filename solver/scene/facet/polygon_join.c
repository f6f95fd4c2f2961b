#include "solver/scene/facet/polygon_join.h"

#include "solver/base/union_find.h"
#include "solver/base/vector3.h"
#include "solver/scene/tables.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Corners of a piece before the last step; and of a union before straight ones are dropped. */
enum { FEW_CORNERS = 4, UNION_MOST = 2 * JOINED_CORNERS - 2 };

typedef struct piece {
    joined_polygon shape;
    double normal[3], level;
} piece;

/* The edge from its piece's corner `at` to the next, which goes from `from` to `to`. */
typedef struct join_edge {
    uint32_t from, to, piece, at;
} join_edge;

typedef struct joining {
    const mesh *m;
    const polygon_join_options *options;
    uint32_t *place; /* [n_vertices], the first vertex at the same point */
    piece *of;
    size_t n;
    join_edge *edges; /* in order of (from, to) */
    size_t n_edges;
    bool *used;    /* [n], in this round */
    uint32_t *set; /* [options->n], of polygons that are joined; NULL: not wanted */
} joining;

static void cross_of(const mesh *m, uint32_t from, uint32_t at, uint32_t to, double out[3]) {
    double a[3], b[3];
    subtract3(m->vertices[at], m->vertices[from], a);
    subtract3(m->vertices[to], m->vertices[from], b);
    cross3(a, b, out);
}

static double distance(const mesh *m, uint32_t a, uint32_t b) {
    double along[3];
    subtract3(m->vertices[b], m->vertices[a], along);
    return sqrt(dot3(along, along));
}

/* Sets the plane of a piece, with a unit normal; false where it has no area. */
static bool set_plane(const mesh *m, piece *p) {
    double twice[3] = {0};
    for (uint32_t c = 1; c + 1 < p->shape.n; c++) {
        double part[3];
        cross_of(m, p->shape.corner[0], p->shape.corner[c], p->shape.corner[c + 1], part);
        for (int d = 0; d < 3; d++) twice[d] += part[d];
    }
    const double length = sqrt(dot3(twice, twice));
    if (!(length > 0)) return false;
    p->level = 0;
    for (int d = 0; d < 3; d++) p->normal[d] = twice[d] / length;
    for (uint32_t c = 0; c < p->shape.n; c++)
        p->level += dot3(p->normal, m->vertices[p->shape.corner[c]]) / p->shape.n;
    return true;
}

static bool lies_in_plane(const joining *j, const piece *plane, const piece *p) {
    if (!(dot3(plane->normal, p->normal) > 0)) return false;
    for (uint32_t c = 0; c < p->shape.n; c++)
        if (!(fabs(dot3(plane->normal, j->m->vertices[p->shape.corner[c]]) - plane->level) <=
              j->options->slack))
            return false;
    return true;
}

/* Drops straight corners of an outline in the plane of a normal and returns how many are left; 0 where it
 * is not convex. Once around, not twice: the angles between its sides sum to a full turn. */
static uint32_t make_convex(const joining *j, const double normal[3], uint32_t *corner, uint32_t n) {
    const mesh *m = j->m;
    for (uint32_t c = 0; c < n;) {
        const uint32_t before = corner[(c + n - 1) % n], after = corner[(c + 1) % n];
        double turn[3];
        cross_of(m, before, corner[c], after, turn);
        const double beyond = dot3(turn, normal) / distance(m, before, after);
        if (!(beyond >= -j->options->slack)) return 0;
        if (beyond > j->options->slack) {
            c++;
            continue;
        }
        memmove(corner + c, corner + c + 1, (--n - c) * sizeof *corner);
        if (n < 3) return 0;
        c = 0; /* its neighbours have new neighbours */
    }
    double turned = 0;
    for (uint32_t c = 0; n > FEW_CORNERS && c < n; c++) {
        double in[3], out[3], turn[3];
        subtract3(m->vertices[corner[c]], m->vertices[corner[(c + n - 1) % n]], in);
        subtract3(m->vertices[corner[(c + 1) % n]], m->vertices[corner[c]], out);
        cross3(in, out, turn);
        turned += atan2(dot3(turn, normal), dot3(in, out));
    }
    return turned < 3 * M_PI ? n : 0;
}

/* The union of p and q, which share the edge after p's corner i and q's corner k; false where it is none that
 * may be joined. */
static bool unite(const joining *j, const piece *p, uint32_t i, const piece *q, uint32_t k, uint32_t most,
                  piece *out) {
    uint32_t corner[UNION_MOST], n = 0;
    const polygon_join_options *of = j->options;
    if (of->within_labels && p->shape.label != q->shape.label) return false;
    if (of->kinds != NULL && of->kinds[of->label[p->shape.first]] != of->kinds[of->label[q->shape.first]])
        return false;
    if (!lies_in_plane(j, p, q) || !lies_in_plane(j, q, p)) return false;
    for (uint32_t c = 1; c <= p->shape.n; c++) corner[n++] = p->shape.corner[(i + c) % p->shape.n];
    for (uint32_t c = 2; c < q->shape.n; c++) corner[n++] = q->shape.corner[(k + c) % q->shape.n];
    n = make_convex(j, p->normal, corner, n);
    if (n == 0 || n > most) return false;
    *out = *p;
    out->shape.n = n;
    memcpy(out->shape.corner, corner, n * sizeof *corner);
    if (q->shape.label != p->shape.label) out->shape.label = MESH_NO_VERTEX;
    if (j->options->label_sets != NULL)
        union_find_join(j->options->label_sets, j->options->label[p->shape.first],
                        j->options->label[q->shape.first]);
    return true;
}

static int by_ends(const void *left, const void *right) {
    const join_edge *a = left, *b = right;
    if (a->from != b->from) return a->from < b->from ? -1 : 1;
    if (a->to != b->to) return a->to < b->to ? -1 : 1;
    return a->piece < b->piece ? -1 : a->piece > b->piece;
}

/* True where an edge runs along the rows of its plane, in one of two directions at a right angle that are the
 * same for all grids of the plane. They are turned so that no usual grid lies halfway between them. */
static bool is_along_rows(const joining *j, const piece *p, uint32_t at) {
    static const double turn[2] = {.28, .96};
    const double *from = j->m->vertices[p->shape.corner[at]],
                 *to = j->m->vertices[p->shape.corner[(at + 1) % p->shape.n]];
    int axis = 0;
    for (int d = 1; d < 3; d++)
        if (fabs(p->normal[d]) < fabs(p->normal[axis]) - .01) axis = d;
    /* b = axis less its part along the normal, and a = b x normal, as long. */
    double along[2] = {0, 0};
    for (int d = 0; d < 3; d++) {
        const double edge = to[d] - from[d], b = (d == axis) - p->normal[axis] * p->normal[d];
        const int e = (d + 1) % 3, g = (d + 2) % 3;
        const double a = (e == axis) * p->normal[g] - (g == axis) * p->normal[e];
        along[0] += edge * a;
        along[1] += edge * b;
    }
    return fabs(turn[1] * along[0] + turn[0] * along[1]) > fabs(turn[1] * along[1] - turn[0] * along[0]);
}

/* Steps of joining: triangles across the edge that is the longest of both, pieces of a row, all pieces, and
 * all into pieces of many corners. */
typedef enum join_step { JOIN_TRIANGLES, JOIN_ROWS, JOIN_ALL, JOIN_WIDE, JOIN_STEPS } join_step;

static bool is_longest(const joining *j, const piece *p, uint32_t at) {
    const double own = distance(j->m, p->shape.corner[at], p->shape.corner[(at + 1) % p->shape.n]);
    for (uint32_t c = 0; c < p->shape.n; c++)
        if (distance(j->m, p->shape.corner[c], p->shape.corner[(c + 1) % p->shape.n]) > own) return false;
    return true;
}

/* True where a step joins pieces across this edge of one of them. */
static bool is_open_to(const joining *j, const piece *p, uint32_t at, join_step step) {
    if (step == JOIN_TRIANGLES) return p->shape.n == 3 && is_longest(j, p, at);
    return step >= JOIN_ALL || !is_along_rows(j, p, at);
}

static void sort_edges(joining *j) {
    j->n_edges = 0;
    for (size_t p = 0; p < j->n; p++) {
        j->used[p] = false;
        for (uint32_t c = 0; c < j->of[p].shape.n; c++)
            j->edges[j->n_edges++] = (join_edge){
                j->of[p].shape.corner[c], j->of[p].shape.corner[(c + 1) % j->of[p].shape.n], (uint32_t)p, c};
    }
    qsort(j->edges, j->n_edges, sizeof *j->edges, by_ends);
}

/* The first edge from `from` to `to`, or where it would be. */
static size_t find_edge(const joining *j, uint32_t from, uint32_t to) {
    size_t low = 0, high = j->n_edges;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        const join_edge *e = &j->edges[middle];
        if (e->from < from || (e->from == from && e->to < to))
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* Joins a piece to another one that is not used in this round. */
static bool join_one(joining *j, size_t p, join_step step) {
    const uint32_t most = step == JOIN_WIDE ? JOINED_CORNERS : FEW_CORNERS;
    for (uint32_t c = 0; c < j->of[p].shape.n; c++) {
        const uint32_t from = j->of[p].shape.corner[c],
                       to = j->of[p].shape.corner[(c + 1) % j->of[p].shape.n];
        if (!is_open_to(j, &j->of[p], c, step)) continue;
        for (size_t e = find_edge(j, to, from);
             e < j->n_edges && j->edges[e].from == to && j->edges[e].to == from; e++) {
            const join_edge *other = &j->edges[e];
            piece joined;
            if (other->piece == p || j->used[other->piece]) continue;
            if (!is_open_to(j, &j->of[other->piece], other->at, step)) continue;
            if (!unite(j, &j->of[p], c, &j->of[other->piece], other->at, most, &joined)) continue;
            if (j->set != NULL)
                union_find_join(j->set, j->of[p].shape.first, j->of[other->piece].shape.first);
            j->used[p] = j->used[other->piece] = true;
            j->of[p] = joined;
            j->of[other->piece].shape.n = 0;
            return true;
        }
    }
    return false;
}

/* A round: pieces in pairs. False where there are none. */
static bool join_pairs(joining *j, join_step step) {
    size_t left = 0, n_joined = 0;
    sort_edges(j);
    for (size_t p = 0; p < j->n; p++)
        if (!j->used[p]) n_joined += join_one(j, p, step);
    for (size_t p = 0; p < j->n; p++)
        if (j->of[p].shape.n > 0) j->of[left++] = j->of[p];
    j->n = left;
    return n_joined > 0;
}

/* Adds the polygon of these corners, a part of polygon k; without area it is none. */
static void add_piece(joining *j, uint32_t n, const uint32_t *corner, size_t k) {
    piece *made = &j->of[j->n];
    *made = (piece){.shape = {.n = n, .label = j->options->label[k], .first = (uint32_t)k}};
    memcpy(made->shape.corner, corner, n * sizeof *corner);
    j->n += set_plane(j->m, made);
}

static void add_polygon(joining *j, size_t k) {
    const uint32_t *vertices = j->options->polygons[k];
    uint32_t corner[4], convex[4];
    const uint32_t n = (uint32_t)corner_count(vertices);
    for (uint32_t c = 0; c < n; c++) corner[c] = convex[c] = j->place[vertices[c]];
    if (n == 4) {
        piece whole = {.shape = {.n = n}};
        memcpy(whole.shape.corner, corner, sizeof corner);
        const bool plane = set_plane(j->m, &whole) && lies_in_plane(j, &whole, &whole);
        const uint32_t left = plane ? make_convex(j, whole.normal, convex, n) : 0;
        if (left > 0 || !j->options->split) {
            add_piece(j, left > 0 ? left : n, left > 0 ? convex : corner, k);
            return;
        }
    }
    for (uint32_t c = 1; c + 1 < n; c++)
        add_piece(j, 3, (uint32_t[]){corner[0], corner[c], corner[c + 1]}, k);
}

/* Fills the union of each polygon, by its set. */
static lam_status tell_unions(joining *j, lam_error *error) {
    uint32_t *const out = j->options->joined;
    uint32_t *of_root = memory_allocate(j->options->n, sizeof *of_root, "joined polygons", error);
    if (of_root == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < j->options->n; k++) of_root[k] = MESH_NO_VERTEX;
    for (size_t p = 0; p < j->n; p++) of_root[union_find_root(j->set, j->of[p].shape.first)] = (uint32_t)p;
    for (size_t k = 0; k < j->options->n; k++) out[k] = of_root[union_find_root(j->set, (uint32_t)k)];
    free(of_root);
    return LAM_OK;
}

lam_status polygons_join(const mesh *m, const polygon_join_options *options, joined_polygon **out,
                         size_t *count, lam_error *error) {
    enum { OF_POLYGON = 2 }; /* triangles */
    lam_status status = LAM_OK;
    const int steps = options->corners > FEW_CORNERS ? JOIN_STEPS : JOIN_WIDE;
    joining j = {.m = m, .options = options};
    joined_polygon *joined = NULL;
    j.place = memory_allocate(m->n_vertices, sizeof *j.place, "joined polygons", error);
    j.of = memory_allocate(options->n, OF_POLYGON * sizeof *j.of, "joined polygons", error);
    if (j.place == NULL || j.of == NULL) TRY(LAM_ERR_MEMORY);
    assert(options->joined == NULL || !options->split);
    if (options->joined != NULL) {
        j.set = memory_allocate(options->n, sizeof *j.set, "joined polygons", error);
        if (j.set == NULL) TRY(LAM_ERR_MEMORY);
        for (size_t k = 0; k < options->n; k++) j.set[k] = (uint32_t)k;
    }
    TRY(points_weld(m->n_vertices, (const double(*)[3])m->vertices, j.place, error));
    for (size_t k = 0; k < options->n; k++) add_polygon(&j, k);
    /* A union has no more corners than its two pieces less the two that both have. */
    j.edges = memory_allocate(j.n, FEW_CORNERS * sizeof *j.edges, "joined polygons", error);
    j.used = memory_allocate(j.n, sizeof *j.used, "joined polygons", error);
    if (j.edges == NULL || j.used == NULL) TRY(LAM_ERR_MEMORY);
    for (int step = 0; step < steps; step++)
        while (join_pairs(&j, (join_step)step)) continue;
    joined = memory_allocate(j.n, sizeof *joined, "joined polygons", error);
    if (joined == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t p = 0; p < j.n; p++) joined[p] = j.of[p].shape;
    if (j.set != NULL) TRY(tell_unions(&j, error));
    *out = joined;
    joined = NULL;
    *count = j.n;
done:
    free(joined);
    free(j.set);
    free(j.place);
    free(j.of);
    free(j.edges);
    free(j.used);
    return status;
}
