/* Panes between faces and the sun: all of them that a ray crosses. */
#include "solver/shadow/shadow_private.h"

#include <math.h>
#include <stdlib.h>

/* Panes that a ray crosses at most; nothing is left of one that crosses more. */
enum { CROSSED_MOST = 32 };

void shadow_panes_free(shadow_panes *p) {
    if (p->tree != NULL) {
        free(p->tree->pieces);
        free(p->tree->nodes);
    }
    free(p->tree);
    free(p->glass);
}

size_t shadow_panes_bytes(const shadow_panes *p) {
    const shadow_tree *t = p->tree;
    return t == NULL ? 0
                     : sizeof *t + t->n_pieces * sizeof *t->pieces + t->n_nodes * sizeof *t->nodes +
                           t->n * sizeof *p->glass;
}

bool shadow_tree_has_panes(const shadow_tree *t) {
    return t->panes.tree != NULL;
}

lam_status shadow_panes_make(shadow_tree *t, const shadow_faces *faces, lam_error *error) {
    lam_status status = LAM_OK;
    static const char what[] = "panes before the sun";
    const struct group_glass *of = faces->glass != NULL ? faces->glass->of : NULL;
    shadow_panes made = {.tree = NULL};
    size_t n = 0;
    for (size_t i = 0; of != NULL && i < faces->n; i++) n += of[faces->group[i]].transmittance > 0;
    if (n == 0) return LAM_OK;
    t->is_pane = memory_allocate(t->n, sizeof *t->is_pane, what, error);
    made.glass = memory_allocate(t->n, sizeof *made.glass, what, error);
    made.tree = memory_allocate(1, sizeof *made.tree, what, error);
    if (t->is_pane == NULL || made.glass == NULL || made.tree == NULL) TRY(LAM_ERR_MEMORY);
    *made.tree = (shadow_tree){
        .n = t->n, .rounding = t->rounding, .corners = t->corners, .normal = t->normal, .shape = t->shape};
    made.tree->pieces = memory_allocate(n, 2 * sizeof *made.tree->pieces, what, error);
    if (made.tree->pieces == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < t->n; i++) {
        made.glass[i] = of[faces->group[i]];
        t->is_pane[i] = made.glass[i].transmittance > 0;
        if (!t->is_pane[i] || i >= faces->n_fronts) continue;
        made.tree->pieces[made.tree->n_pieces++] = (uint32_t)i << 1;
        if (t->shape[i] != SHADOW_TRIANGLE) made.tree->pieces[made.tree->n_pieces++] = (uint32_t)i << 1 | 1;
    }
    made.by_angle = faces->glass->by_angle;
    TRY(shadow_tree_build(made.tree, error));
    t->panes = made;
    made = (shadow_panes){.tree = NULL};
done:
    shadow_panes_free(&made);
    return status;
}

/* A ray, and where it has crossed panes. */
typedef struct pane_ray {
    float at[3], direction[3], inverse[3];
    double passed;
    size_t n;
    float crossed[CROSSED_MOST];
} pane_ray;

static bool meets_box(const pane_ray *r, const shadow_node *node, int k) {
    float from = 0, to = INFINITY;
    for (int d = 0; d < 3; d++) {
        const bool up = r->inverse[d] >= 0; /* a child that is not there has its ends the other way round */
        from = fmaxf(from, ((up ? node->low : node->high)[d][k] - r->at[d]) * r->inverse[d]);
        to = fminf(to, ((up ? node->high : node->low)[d][k] - r->at[d]) * r->inverse[d]);
    }
    return from <= to;
}

/* The distance of the triangle a, a + one, a + other along the ray, as in shadow_kernels.inc; below 0: it is
 * not met. */
static float distance_of(const pane_ray *r, const float a[3], const float one[3], const float other[3],
                         float *cosine) {
    static const float slack = 1e-6f, edge_on = 1e-6f;
    float normal[3], s[3], D = 0, length2 = 0, t = 0, u = 0, w = 0;
    for (int d = 0; d < 3; d++) {
        const int e = (d + 1) % 3, f = (d + 2) % 3;
        normal[d] = one[e] * other[f] - one[f] * other[e];
        D += r->direction[d] * normal[d];
        length2 += normal[d] * normal[d];
        s[d] = r->at[d] - a[d];
    }
    *cosine = fabsf(D) / sqrtf(length2);
    if (!(*cosine > edge_on)) return -1;
    for (int d = 0; d < 3; d++) {
        const int e = (d + 1) % 3, f = (d + 2) % 3;
        t -= s[d] * normal[d] / D;
        u += s[d] * (other[e] * r->direction[f] - other[f] * r->direction[e]) / D;
        w += s[d] * (r->direction[e] * one[f] - r->direction[f] * one[e]) / D;
    }
    return u >= -slack && w >= -slack && u + w <= 1 + slack ? t : -1;
}

/* A place that the ray has crossed already is an edge of two panes, or the other face of a sheet. */
static void cross(const shadow_panes *p, pane_ray *r, uint32_t piece) {
    float a[3], one[3], other[3], cosine;
    piece_of(p->tree, piece, a, one, other);
    const float t = distance_of(r, a, one, other, &cosine);
    if (!(t > 0)) return;
    for (size_t k = 0; k < r->n; k++)
        if (fabsf(r->crossed[k] - t) <= 4 * p->tree->rounding / cosine) return;
    r->passed *= glass_passes(&p->glass[piece >> 1], p->by_angle, (double)cosine);
    if (r->n == CROSSED_MOST)
        r->passed = 0;
    else
        r->crossed[r->n++] = t;
}

static void pass_ray(const shadow_panes *p, pane_ray *r) {
    uint32_t waiting[SHADOW_STACK];
    size_t n_waiting = 1;
    waiting[0] = 0;
    while (n_waiting > 0) {
        const shadow_node *node = &p->tree->nodes[waiting[--n_waiting]];
        for (int k = 0; k < SHADOW_WIDTH; k++) {
            if (!meets_box(r, node, k)) continue;
            if (node->count[k] == 0) {
                waiting[n_waiting++] = node->child[k];
                continue;
            }
            for (uint32_t i = node->child[k]; i < node->child[k] + node->count[k]; i++)
                cross(p, r, p->tree->pieces[i]);
        }
    }
}

void shadow_tree_pass(const shadow_tree *t, const float direction[3], const shadow_rays *rays, unsigned open,
                      double passed[SHADOW_PACKET]) {
    static const float least = 1e-20f;
    for (size_t k = 0; k < rays->n; k++) {
        pane_ray r = {.passed = 1};
        if (t->panes.tree != NULL && (open >> k & 1) != 0) {
            for (int d = 0; d < 3; d++) {
                r.at[d] = rays->at[d][k];
                r.direction[d] = direction[d];
                r.inverse[d] = fabsf(direction[d]) > least ? 1 / direction[d] : 1 / least;
            }
            pass_ray(&t->panes, &r);
        }
        passed[k] = r.passed;
    }
}
