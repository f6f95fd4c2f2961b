#include "solver/formfactor/pairs/plane_joins.h"

#include "solver/base/array_grow.h"
#include "solver/base/vector3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Corners of a polygon while pieces are joined, at most: those on a straight side stay until its neighbours
 * across the side are joined too. */
enum { OUTLINE_MOST = 512 };

/* A polygon by the places of its corners, pool[first] ... pool[first + n - 1]. */
typedef struct outline {
    size_t first;
    int n;
    uint32_t facet; /* MESH_NO_VERTEX: of several */
    bool gone, changed;
} outline;

/* A side of an outline, by its places in ascending order. */
typedef struct outline_side {
    uint32_t low, high, outline, corner;
    bool forward;
} outline_side;

typedef struct shared_side {
    double length2;
    uint32_t one, two; /* sides */
} shared_side;

typedef struct joiner {
    const mesh *m;
    double slack;
    uint32_t *place; /* [n_vertices], the first vertex at the same point */
    const facets *f;
    outline *outlines;
    uint32_t *pool;
    size_t n, n_pool, pool_capacity;
    outline_side *sides;
    shared_side *shared;
} joiner;

typedef struct placed {
    const double *at;
    uint32_t vertex;
} placed;

static int by_place(const void *left, const void *right) {
    const placed *a = left, *b = right;
    for (int d = 0; d < 3; d++)
        if (a->at[d] < b->at[d] || a->at[d] > b->at[d]) return a->at[d] < b->at[d] ? -1 : 1;
    return (a->vertex > b->vertex) - (a->vertex < b->vertex);
}

static bool same_place(const double *a, const double *b) {
    return !(a[0] < b[0] || a[0] > b[0] || a[1] < b[1] || a[1] > b[1] || a[2] < b[2] || a[2] > b[2]);
}

static lam_status find_places(joiner *j, lam_error *error) {
    const size_t n = j->m->n_vertices;
    placed *points = memory_allocate(n, sizeof *points, "occluders", error);
    if (points == NULL) return LAM_ERR_MEMORY;
    for (size_t v = 0; v < n; v++) points[v] = (placed){j->m->vertices[v], (uint32_t)v};
    qsort(points, n, sizeof *points, by_place);
    for (size_t k = 0, first = 0; k < n; k++) {
        if (!same_place(points[k].at, points[first].at)) first = k;
        j->place[points[k].vertex] = points[first].vertex;
    }
    free(points);
    return LAM_OK;
}

/* The height of b above the line from a to c, in the plane with that normal; positive where a, b, c turn
 * counter-clockwise. */
static double bulge(const mesh *m, const double normal[3], uint32_t a, uint32_t b, uint32_t c) {
    double along[3], to[3], across[3];
    subtract3(m->vertices[c], m->vertices[a], along);
    subtract3(m->vertices[b], m->vertices[a], to);
    const double length = sqrt(dot3(along, along));
    if (!(length > 0)) return 0;
    cross3(to, along, across);
    return dot3(across, normal) / length;
}

/* Removes x, y, x: two sides that run along each other. Returns how many corners are left. */
static int remove_spikes(uint32_t *corner, int n) {
    for (int k = 0; k < n && n > 2;) {
        const int next = (k + 1) % n, last = (k + 2) % n;
        const int from = corner[k] == corner[next] ? 1 : corner[k] == corner[last] ? 2 : 0;
        if (from == 0) {
            k++;
            continue;
        }
        uint32_t kept[OUTLINE_MOST];
        for (int c = 0; c < n - from; c++) kept[c] = corner[(k + from + c) % n];
        n -= from;
        memcpy(corner, kept, (size_t)n * sizeof *kept);
        k = 0;
    }
    return n;
}

/* The corners without those on a straight side; 0 where the outline is not convex. */
static int strict_corners(const joiner *j, const uint32_t *corner, int n, const double normal[3],
                          uint32_t out[OUTLINE_MOST]) {
    memcpy(out, corner, (size_t)n * sizeof *out);
    for (int k = 0; k < n && n >= 3;) {
        const uint32_t before = out[(k + n - 1) % n], after = out[(k + 1) % n];
        if (fabs(bulge(j->m, normal, before, out[k], after)) > j->slack) {
            k++;
            continue;
        }
        memmove(out + k, out + k + 1, (size_t)(n - k - 1) * sizeof *out);
        n--;
        k = k > 0 ? k - 1 : 0;
    }
    if (n < 3) return 0;
    double turned = 0, previous[3], along[3], turn[3];
    subtract3(j->m->vertices[out[0]], j->m->vertices[out[n - 1]], previous);
    for (int k = 0; k < n; k++) {
        subtract3(j->m->vertices[out[(k + 1) % n]], j->m->vertices[out[k]], along);
        cross3(previous, along, turn);
        const double sine = dot3(turn, normal);
        if (!(sine > 0)) return 0;
        turned += atan2(sine, dot3(previous, along));
        memcpy(previous, along, sizeof along);
    }
    /* Once around, not twice. */
    return turned < 3 * M_PI ? n : 0;
}

/* Sides between the same two places that a side is compared with at most. */
enum { MEETING_MOST = 8 };

static int by_key(const void *left, const void *right) {
    const outline_side *a = left, *b = right;
    if (a->low != b->low) return a->low < b->low ? -1 : 1;
    if (a->high != b->high) return a->high < b->high ? -1 : 1;
    if (a->outline != b->outline) return a->outline < b->outline ? -1 : 1;
    return (a->corner > b->corner) - (a->corner < b->corner);
}

static int by_length(const void *left, const void *right) {
    const shared_side *a = left, *b = right;
    if (a->length2 > b->length2 || a->length2 < b->length2) return a->length2 > b->length2 ? -1 : 1;
    return (a->one > b->one) - (a->one < b->one);
}

static void normal_of(const joiner *j, const outline *o, double normal[3]) {
    const uint32_t facet = j->f->piece_facet[o - j->outlines];
    for (int d = 0; d < 3; d++) normal[d] = (double)j->f->normal[facet][d];
}

/* True where all corners of an outline lie within slack of the plane of the other. */
static bool in_plane_of(const joiner *j, const outline *o, const outline *plane) {
    double normal[3];
    normal_of(j, plane, normal);
    const double level = dot3(normal, j->m->vertices[j->pool[plane->first]]);
    for (int c = 0; c < o->n; c++)
        if (fabs(dot3(normal, j->m->vertices[j->pool[o->first + (size_t)c]]) - level) > j->slack)
            return false;
    return true;
}

/* Joins two outlines at the side that follows a corner of each, where the union is plane and convex. */
static lam_status join_two(joiner *j, outline *a, uint32_t at_a, outline *b, uint32_t at_b, size_t *joined,
                           lam_error *error) {
    uint32_t made[OUTLINE_MOST], strict[OUTLINE_MOST];
    double normal[2][3];
    int n = 0;
    normal_of(j, a, normal[0]);
    normal_of(j, b, normal[1]);
    if (a->n + b->n > OUTLINE_MOST || dot3(normal[0], normal[1]) < 1 - 1e-6) return LAM_OK;
    if (!in_plane_of(j, a, b) || !in_plane_of(j, b, a)) return LAM_OK;
    for (int k = 0; k < a->n; k++) made[n++] = j->pool[a->first + (size_t)(((int)at_a + 1 + k) % a->n)];
    for (int k = 0; k + 2 < b->n; k++) made[n++] = j->pool[b->first + (size_t)(((int)at_b + 2 + k) % b->n)];
    n = remove_spikes(made, n);
    const int n_strict = strict_corners(j, made, n, normal[0], strict);
    if (n_strict < 3 || n_strict > JOINED_CORNERS) return LAM_OK;
    if (n > a->n) {
        const lam_status status = array_grow(&j->pool, &j->pool_capacity, j->n_pool + (size_t)n,
                                             sizeof *j->pool, "occluders", error);
        if (status != LAM_OK) return status;
        a->first = j->n_pool;
        j->n_pool += (size_t)n;
    }
    memcpy(j->pool + a->first, made, (size_t)n * sizeof *made);
    a->n = n;
    a->changed = b->gone = true;
    if (a->facet != b->facet) a->facet = MESH_NO_VERTEX;
    ++*joined;
    return LAM_OK;
}

/* One round of joins, in which an outline takes part once; *joined: how many there were. */
static lam_status join_round(joiner *j, size_t *joined, lam_error *error) {
    lam_status status = LAM_OK;
    size_t n_sides = 0, n_shared = 0;
    *joined = 0;
    for (size_t o = 0; o < j->n; o++) {
        outline *one = &j->outlines[o];
        one->changed = false;
        for (int c = 0; c < one->n && !one->gone; c++) {
            const uint32_t from = j->pool[one->first + (size_t)c],
                           to = j->pool[one->first + (size_t)((c + 1) % one->n)];
            j->sides[n_sides++] = (outline_side){from < to ? from : to, from < to ? to : from, (uint32_t)o,
                                                 (uint32_t)c, from < to};
        }
    }
    if (n_sides > 0) qsort(j->sides, n_sides, sizeof *j->sides, by_key);
    for (size_t k = 0; k + 1 < n_sides; k++) {
        const outline_side *a = &j->sides[k];
        for (size_t l = k + 1; l < n_sides && l <= k + MEETING_MOST; l++) {
            const outline_side *b = &j->sides[l];
            double along[3];
            if (a->low != b->low || a->high != b->high) break;
            if (a->forward == b->forward || n_shared == n_sides) continue;
            subtract3(j->m->vertices[a->high], j->m->vertices[a->low], along);
            j->shared[n_shared++] = (shared_side){dot3(along, along), (uint32_t)k, (uint32_t)l};
        }
    }
    if (n_shared > 0) qsort(j->shared, n_shared, sizeof *j->shared, by_length);
    for (size_t k = 0; k < n_shared; k++) {
        const outline_side *a = &j->sides[j->shared[k].one], *b = &j->sides[j->shared[k].two];
        outline *one = &j->outlines[a->outline], *two = &j->outlines[b->outline];
        if (one == two || one->gone || two->gone || one->changed || two->changed) continue;
        TRY(join_two(j, one, a->corner, two, b->corner, joined, error));
    }
done:
    return status;
}

/* True where four corners lie within slack of one plane. */
static bool is_flat(const mesh *m, const uint32_t corner[4], double slack) {
    double one[3], two[3], normal[3], to[3];
    subtract3(m->vertices[corner[2]], m->vertices[corner[0]], one);
    subtract3(m->vertices[corner[3]], m->vertices[corner[1]], two);
    cross3(one, two, normal);
    subtract3(m->vertices[corner[1]], m->vertices[corner[0]], to);
    return fabs(dot3(normal, to)) <= 2 * slack * sqrt(dot3(normal, normal));
}

/* The pieces of all facets as outlines. */
static void set_outlines(joiner *j) {
    for (size_t k = 0; k < j->f->n_pieces; k++) {
        const uint32_t *piece = j->f->pieces[k];
        outline *o = &j->outlines[j->n++];
        *o = (outline){
            .first = j->n_pool, .n = piece[3] == MESH_NO_VERTEX ? 3 : 4, .facet = j->f->piece_facet[k]};
        for (int c = 0; c < o->n; c++) j->pool[j->n_pool++] = j->place[piece[c]];
    }
}

static void add_polygon(const joiner *j, uint32_t facet, int n, const uint32_t *corner, plane_joins *out) {
    joined_polygon *made = &out->of[out->n++];
    *made = (joined_polygon){.n = n, .facet = facet};
    for (int c = 0; c < n; c++) memcpy(made->corner[c], j->m->vertices[corner[c]], sizeof made->corner[c]);
}

/* A quad that is not flat, or not convex, is two triangles. */
static void take_outlines(const joiner *j, plane_joins *out) {
    for (size_t k = 0; k < j->n; k++) {
        const outline *one = &j->outlines[k];
        const uint32_t *corner = j->pool + one->first;
        uint32_t strict[OUTLINE_MOST];
        double normal[3];
        if (one->gone) continue;
        normal_of(j, one, normal);
        const int n = strict_corners(j, corner, one->n, normal, strict);
        if (n >= 3 && (n != 4 || is_flat(j->m, strict, j->slack))) {
            add_polygon(j, one->facet, n, strict, out);
            continue;
        }
        for (int c = 1; c + 1 < one->n; c++) {
            const uint32_t triangle[3] = {corner[0], corner[c], corner[c + 1]};
            add_polygon(j, one->facet, 3, triangle, out);
        }
    }
}

lam_status plane_joins_make(const mesh *m, const facets *f, double slack, plane_joins *out,
                            lam_error *error) {
    lam_status status = LAM_OK;
    plane_joins made = {.n = 0};
    joiner j = {.m = m, .f = f, .slack = slack};
    size_t joined = 1;
    j.place = memory_allocate(m->n_vertices, sizeof *j.place, "occluders", error);
    j.outlines = memory_allocate(f->n_pieces, sizeof *j.outlines, "occluders", error);
    /* No join adds sides. */
    j.sides = memory_allocate(f->n_pieces, 4 * sizeof *j.sides, "occluders", error);
    j.shared = memory_allocate(f->n_pieces, 4 * sizeof *j.shared, "occluders", error);
    made.of = memory_allocate(f->n_pieces, 2 * sizeof *made.of, "occluders", error);
    if (j.place == NULL || j.outlines == NULL || j.sides == NULL || j.shared == NULL || made.of == NULL)
        TRY(LAM_ERR_MEMORY);
    TRY(array_grow(&j.pool, &j.pool_capacity, 4 * f->n_pieces, sizeof *j.pool, "occluders", error));
    TRY(find_places(&j, error));
    set_outlines(&j);
    while (joined > 0) TRY(join_round(&j, &joined, error));
    take_outlines(&j, &made);
    *out = made;
    made = (plane_joins){.n = 0};
done:
    free(j.place);
    free(j.outlines);
    free(j.pool);
    free(j.sides);
    free(j.shared);
    plane_joins_free(&made);
    return status;
}

void plane_joins_free(plane_joins *j) {
    free(j->of);
    *j = (plane_joins){.n = 0};
}
