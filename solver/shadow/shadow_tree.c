/* shadow_build.c makes the tree; here is what it is asked. A ray o + t d meets a box where the stretches of t
 * in which it is between the ends of each axis have a part in common. */
#include "solver/shadow/shadow_tree.h"

#include "solver/base/cpu.h"
#include "solver/scene/plane.h"
#include "solver/shadow/shadow_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The share of a triangle by which it is wider, and the cosine below which it is seen edge-on. */
#define SHADOW_SLACK 1e-6f
#define SHADOW_EDGE_ON 1e-6f

/* A quad is a parallelogram up to this share of its diagonals. */
#define PARALLELOGRAM 1e-9

/* Pieces are numbered by 32 bits. */
#define MOST_FRONTS 0x7FFFFFFFu

/* Components below this have its inverse, as 0 times infinity is no number. */
#define LEAST_COMPONENT 1e-20f

/* A direction, and its inverse for boxes. */
typedef struct shadow_way {
    float direction[3], inverse[3];
} shadow_way;

void shadow_tree_free(shadow_tree *t) {
    if (t == NULL) return;
    free(t->corners);
    free(t->normal);
    free(t->shape);
    free(t->pieces);
    free(t->nodes);
    free(t->is_pane);
    shadow_panes_free(&t->panes);
    free(t);
}

size_t shadow_tree_elements(const shadow_tree *t) {
    return t->n;
}

size_t shadow_tree_bytes(const shadow_tree *t) {
    return sizeof *t + t->n * (sizeof *t->corners + sizeof *t->normal + sizeof *t->shape) +
           t->n_pieces * sizeof *t->pieces + t->n_nodes * sizeof *t->nodes +
           (t->is_pane != NULL ? t->n * sizeof *t->is_pane : 0) + shadow_panes_bytes(&t->panes);
}

const float (*shadow_tree_corners(const shadow_tree *t, size_t element, shadow_shape *shape))[3] {
    *shape = (shadow_shape)t->shape[element];
    return (const float(*)[3])t->corners[element];
}

const float *shadow_tree_normal(const shadow_tree *t, size_t element) {
    return t->normal[element];
}

/* The middle of all corners' box, and half its diagonal. */
static double find_middle(const shadow_faces *f, double middle[3]) {
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, radius = 0;
    for (size_t i = 0; i < f->n_vertices; i++)
        for (int d = 0; d < 3; d++) {
            low[d] = fmin(low[d], f->vertices[i][d]);
            high[d] = fmax(high[d], f->vertices[i][d]);
        }
    for (int d = 0; d < 3; d++) {
        middle[d] = .5 * (low[d] + high[d]);
        radius += .25 * (high[d] - low[d]) * (high[d] - low[d]);
    }
    return sqrt(radius);
}

static shadow_shape shape_of(const shadow_faces *f, size_t element) {
    const uint32_t *e = f->elements[element];
    double off = 0, size = 0;
    if (e[3] == SHADOW_NO_VERTEX) return SHADOW_TRIANGLE;
    for (int d = 0; d < 3; d++) {
        const double a = f->vertices[e[0]][d], b = f->vertices[e[1]][d], c = f->vertices[e[2]][d],
                     last = f->vertices[e[3]][d];
        off += fabs(a - b + c - last);
        size += fabs(c - a) + fabs(last - b);
    }
    return off <= PARALLELOGRAM * size ? SHADOW_PARALLELOGRAM : SHADOW_QUAD;
}

lam_status shadow_tree_create(const shadow_faces *faces, shadow_tree **out, lam_error *error) {
    lam_status status = LAM_OK;
    static const char what[] = "the shadows of a scene";
    shadow_tree *t = memory_allocate(1, sizeof *t, what, error);
    if (t == NULL) return LAM_ERR_MEMORY;
    if (faces->n_fronts > MOST_FRONTS)
        FAIL(error, LAM_ERR_ARGUMENT, "shadows of %zu elements: there can be %u", faces->n_fronts,
             MOST_FRONTS);
    t->n = faces->n;
    t->rounding = 4 * 0x1p-24f * (float)find_middle(faces, t->middle);
    t->corners = memory_allocate(t->n, sizeof *t->corners, what, error);
    t->normal = memory_allocate(t->n, sizeof *t->normal, what, error);
    t->shape = memory_allocate(t->n, sizeof *t->shape, what, error);
    t->pieces = memory_allocate(faces->n_fronts, 2 * sizeof *t->pieces, what, error);
    if (t->corners == NULL || t->normal == NULL || t->shape == NULL || t->pieces == NULL) TRY(LAM_ERR_MEMORY);
    memcpy(t->normal, faces->normal, t->n * sizeof *t->normal);
    for (size_t i = 0; i < t->n; i++) {
        t->shape[i] = (uint8_t)shape_of(faces, i);
        const bool triangle = t->shape[i] == SHADOW_TRIANGLE;
        for (int c = 0; c < 4; c++)
            for (int d = 0; d < 3; d++)
                t->corners[i][c][d] =
                    (float)(faces->vertices[faces->elements[i][triangle && c == 3 ? 2 : c]][d] -
                            t->middle[d]);
    }
    TRY(shadow_panes_make(t, faces, error));
    for (size_t i = 0; i < faces->n_fronts; i++) {
        const bool triangle = t->shape[i] == SHADOW_TRIANGLE;
        if (t->is_pane != NULL && t->is_pane[i]) continue;
        t->pieces[t->n_pieces++] = (uint32_t)i << 1;
        if (!triangle) t->pieces[t->n_pieces++] = (uint32_t)i << 1 | 1;
    }
    TRY(shadow_tree_build(t, error));
    *out = t;
    t = NULL;
done:
    shadow_tree_free(t);
    return status;
}

/* An element as a face. */
typedef struct flat_face {
    double corner[4][3], centre[3], normal[3];
    plane_face face;
} flat_face;

static void flat_face_set(const shadow_tree *t, size_t element, flat_face *out) {
    const int n = t->shape[element] == SHADOW_TRIANGLE ? 3 : 4;
    const float(*corner)[3] = (const float(*)[3])t->corners[element];
    for (int d = 0; d < 3; d++) {
        out->normal[d] = (double)t->normal[element][d];
        out->centre[d] = 0;
        for (int c = 0; c < n; c++) {
            out->corner[c][d] = (double)corner[c][d];
            out->centre[d] += out->corner[c][d] / n;
        }
    }
    out->face = (plane_face){
        .n = n, .corner = (const double(*)[3])out->corner, .centre = out->centre, .normal = out->normal};
    for (int c = 0; c < n; c++) {
        double away = 0;
        for (int d = 0; d < 3; d++)
            away += (out->corner[c][d] - out->centre[d]) * (out->corner[c][d] - out->centre[d]);
        out->face.radius = fmax(out->face.radius, sqrt(away));
    }
}

/* True where two elements are of one plane, so that neither blocks what the other sees. */
static bool in_own_plane(const shadow_tree *t, size_t own, size_t other) {
    flat_face a, b;
    const float *n = t->normal[own], *m = t->normal[other];
    if (!((double)fabsf(n[0] * m[0] + n[1] * m[1] + n[2] * m[2]) > plane_parallel)) return false;
    flat_face_set(t, own, &a);
    flat_face_set(t, other, &b);
    return plane_is_shared(&a.face, &b.face);
}

#define CPU_KERNELS "solver/shadow/shadow_kernels.inc"
#include "solver/base/cpu_kernels.inc"

unsigned shadow_tree_open(const shadow_tree *t, size_t element, const float direction[3], shadow_rays *rays,
                          uint32_t *last) {
    typedef unsigned find(const shadow_tree *, size_t, const shadow_way *, const shadow_rays *, unsigned,
                          uint32_t *);
    static find *const table[] = CPU_TABLE(find_open_portable, find_open_avx2, find_open_avx512);
    shadow_way way;
    for (int d = 0; d < 3; d++) {
        const float lift = element != SHADOW_NO_ELEMENT ? 2 * t->rounding * t->normal[element][d] : 0;
        way.direction[d] = direction[d];
        way.inverse[d] = fabsf(direction[d]) > LEAST_COMPONENT ? 1 / direction[d] : 1 / LEAST_COMPONENT;
        for (size_t k = 0; k < rays->n; k++) rays->at[d][k] += lift;
        /* Lanes without a ray take the last one's place. */
        for (size_t k = rays->n; k < SHADOW_PACKET; k++) rays->at[d][k] = rays->at[d][rays->n - 1];
    }
    return table[cpu_best()](t, element, &way, rays, (1u << rays->n) - 1, last);
}
