#include "solver/formfactor/blocks/occluder_join.h"

#include "solver/base/vector3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Corners of a union before straight ones are dropped. */
enum { CORNERS = 4, UNION_MOST = 2 * CORNERS - 2 };

typedef struct join_piece {
    uint32_t corner[CORNERS], n;
    double normal[3], level;
} join_piece;

/* The edge from its piece's corner `at` to the next, which goes from `from` to `to`. */
typedef struct join_edge {
    uint32_t from, to, piece, at;
} join_edge;

typedef struct joining {
    const mesh *m;
    double slack;
    join_piece *of;
    size_t n;
    join_edge *edges; /* in order of (from, to) */
    size_t n_edges;
    bool *used; /* [n], in this round */
} joining;

static void cross_of(const mesh *m, uint32_t from, uint32_t at, uint32_t to, double out[3]) {
    double a[3], b[3];
    for (int d = 0; d < 3; d++) {
        a[d] = m->vertices[at][d] - m->vertices[from][d];
        b[d] = m->vertices[to][d] - m->vertices[from][d];
    }
    for (int d = 0; d < 3; d++) out[d] = a[(d + 1) % 3] * b[(d + 2) % 3] - a[(d + 2) % 3] * b[(d + 1) % 3];
}

static double distance(const mesh *m, uint32_t a, uint32_t b) {
    double sum = 0;
    for (int d = 0; d < 3; d++)
        sum += (m->vertices[b][d] - m->vertices[a][d]) * (m->vertices[b][d] - m->vertices[a][d]);
    return sqrt(sum);
}

static void set_piece(const mesh *m, const uint32_t corner[CORNERS], join_piece *p) {
    *p = (join_piece){.n = (uint32_t)corner_count(corner)};
    memcpy(p->corner, corner, sizeof p->corner);
    cross_of(m, corner[0], corner[1], corner[2], p->normal);
    const double length = sqrt(dot3(p->normal, p->normal));
    for (int d = 0; d < 3; d++) p->normal[d] /= length;
    p->level = dot3(p->normal, m->vertices[corner[0]]);
}

static bool lies_in_plane(const joining *j, const join_piece *plane, const join_piece *p) {
    if (!(dot3(plane->normal, p->normal) > 0)) return false;
    for (uint32_t c = 0; c < p->n; c++)
        if (!(fabs(dot3(plane->normal, j->m->vertices[p->corner[c]]) - plane->level) <= j->slack))
            return false;
    return true;
}

/* The union of p and q, which share the edge after p's corner i and q's corner k; false where it is none that
 * may be joined. */
static bool unite(const joining *j, const join_piece *p, uint32_t i, const join_piece *q, uint32_t k,
                  join_piece *out) {
    const mesh *m = j->m;
    uint32_t corner[UNION_MOST], n = 0;
    if (!lies_in_plane(j, p, q) || !lies_in_plane(j, q, p)) return false;
    for (uint32_t c = 1; c <= p->n; c++) corner[n++] = p->corner[(i + c) % p->n];
    for (uint32_t c = 2; c < q->n; c++) corner[n++] = q->corner[(k + c) % q->n];
    for (uint32_t c = 0; c < n;) { /* straight corners */
        const uint32_t before = corner[(c + n - 1) % n], after = corner[(c + 1) % n];
        double turn[3];
        cross_of(m, before, corner[c], after, turn);
        const double beyond = dot3(turn, p->normal) / distance(m, before, after);
        if (!(beyond >= -j->slack)) return false;
        if (beyond > j->slack) {
            c++;
            continue;
        }
        memmove(corner + c, corner + c + 1, (--n - c) * sizeof *corner);
        if (n < 3) return false;
        c = 0; /* its neighbours have new neighbours */
    }
    if (n > CORNERS) return false;
    *out = *p;
    out->n = n;
    for (uint32_t c = 0; c < CORNERS; c++) out->corner[c] = c < n ? corner[c] : MESH_NO_VERTEX;
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
static bool is_along_rows(const joining *j, const join_piece *p, uint32_t at) {
    static const double turn[2] = {.28, .96};
    const double *from = j->m->vertices[p->corner[at]], *to = j->m->vertices[p->corner[(at + 1) % p->n]];
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

/* Steps of joining: triangles across the edge that is the longest of both, pieces of a row, all pieces. */
typedef enum join_step { JOIN_TRIANGLES, JOIN_ROWS, JOIN_ALL, JOIN_STEPS } join_step;

static bool is_longest(const joining *j, const join_piece *p, uint32_t at) {
    const double own = distance(j->m, p->corner[at], p->corner[(at + 1) % p->n]);
    for (uint32_t c = 0; c < p->n; c++)
        if (distance(j->m, p->corner[c], p->corner[(c + 1) % p->n]) > own) return false;
    return true;
}

/* True where a step joins pieces across this edge of one of them. */
static bool is_open_to(const joining *j, const join_piece *p, uint32_t at, join_step step) {
    if (step == JOIN_TRIANGLES) return p->n == 3 && is_longest(j, p, at);
    return step == JOIN_ALL || !is_along_rows(j, p, at);
}

static void sort_edges(joining *j) {
    j->n_edges = 0;
    for (size_t p = 0; p < j->n; p++) {
        j->used[p] = false;
        for (uint32_t c = 0; c < j->of[p].n; c++)
            j->edges[j->n_edges++] =
                (join_edge){j->of[p].corner[c], j->of[p].corner[(c + 1) % j->of[p].n], (uint32_t)p, c};
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
    for (uint32_t c = 0; c < j->of[p].n; c++) {
        const uint32_t from = j->of[p].corner[c], to = j->of[p].corner[(c + 1) % j->of[p].n];
        if (!is_open_to(j, &j->of[p], c, step)) continue;
        for (size_t e = find_edge(j, to, from);
             e < j->n_edges && j->edges[e].from == to && j->edges[e].to == from; e++) {
            const join_edge *other = &j->edges[e];
            join_piece joined;
            if (other->piece == p || j->used[other->piece]) continue;
            if (!is_open_to(j, &j->of[other->piece], other->at, step)) continue;
            if (!unite(j, &j->of[p], c, &j->of[other->piece], other->at, &joined)) continue;
            j->used[p] = j->used[other->piece] = true;
            j->of[p] = joined;
            j->of[other->piece].n = 0;
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
        if (j->of[p].n > 0) j->of[left++] = j->of[p];
    j->n = left;
    return n_joined > 0;
}

lam_status occluders_join(const mesh *m, double slack, uint32_t (*pieces)[4], size_t *count,
                          lam_error *error) {
    lam_status status = LAM_OK;
    joining j = {.m = m, .slack = slack, .n = *count};
    j.of = memory_allocate(j.n, sizeof *j.of, "occluders", error);
    j.edges = memory_allocate(j.n, CORNERS * sizeof *j.edges, "occluders", error);
    j.used = memory_allocate(j.n, sizeof *j.used, "occluders", error);
    if (j.of == NULL || j.edges == NULL || j.used == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t p = 0; p < j.n; p++) set_piece(m, (const uint32_t *)pieces[p], &j.of[p]);
    for (int step = 0; step < JOIN_STEPS; step++)
        while (join_pairs(&j, (join_step)step)) continue;
    for (size_t p = 0; p < j.n; p++) memcpy(pieces[p], j.of[p].corner, sizeof pieces[p]);
    *count = j.n;
done:
    free(j.of);
    free(j.edges);
    free(j.used);
    return status;
}
