#include "solver/formfactor/sight/open_scene.h"

#include "solver/base/vector3.h"
#include "solver/formfactor/exchange/pair_factor.h"
#include "solver/scene/plane.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Clusters that wait while the tree is descended: one at each level, which halve an extent. Deeper ones are
 * looked at in full. */
enum { WAITING_MOST = 256 };

/* A plane: normal . x = level. */
typedef struct element_plane {
    double normal[3], level;
} element_plane;

static element_plane plane_of(const mesh *m, size_t element) {
    polygon shape;
    element_plane out;
    polygon_of_element(m, element, &shape);
    for (int d = 0; d < 3; d++) out.normal[d] = shape.normal[d];
    out.level = dot3(shape.normal, shape.centre);
    return out;
}

static bool is_in_front(const mesh *m, size_t element, const element_plane *plane, double slack) {
    const uint32_t *corners = m->elements[element];
    for (size_t k = 0; k < corner_count(corners); k++)
        if (dot3(plane->normal, m->vertices[corners[k]]) < plane->level - slack) return false;
    return true;
}

/* Calls for each element of the tree with a vertex behind a plane, until a call returns false. */
typedef bool behind_call(void *context, size_t element);

static bool visit_behind(const mesh *m, const cluster_tree *t, const element_plane *plane, double slack,
                         behind_call *call, void *context) {
    uint32_t waiting[WAITING_MOST];
    size_t n_waiting = 0;
    waiting[n_waiting++] = 0;
    while (n_waiting > 0) {
        const cluster *c = &t->clusters[waiting[--n_waiting]];
        double least = -plane->level;
        for (int d = 0; d < 3; d++)
            least += plane->normal[d] * (plane->normal[d] > 0 ? c->low[d] : c->high[d]);
        if (least >= -slack) continue;
        if (cluster_is_leaf(c) || n_waiting + 2 > WAITING_MOST) {
            for (uint32_t p = c->first; p < c->last; p++)
                if (!is_in_front(m, t->element[p], plane, slack) && !call(context, t->element[p]))
                    return false;
            continue;
        }
        waiting[n_waiting++] = c->child[0];
        waiting[n_waiting++] = c->child[1];
    }
    return true;
}

static bool refuse(void *context, size_t element) {
    (void)context;
    (void)element;
    return false;
}

static double slack_of(const mesh *m) {
    double centre[3], radius;
    mesh_bounds(m, centre, &radius);
    return 2 * radius * plane_least_length;
}

bool clusters_hide_nothing(const mesh *m, const cluster_tree *t) {
    const double slack = slack_of(m);
    int hidden = 0;
#pragma omp parallel for schedule(dynamic, 64)
    for (size_t p = 0; p < m->n; p++) {
        if (__atomic_load_n(&hidden, __ATOMIC_RELAXED)) continue;
        const element_plane plane = plane_of(m, t->element[p]);
        if (!visit_behind(m, t, &plane, slack, refuse, NULL)) __atomic_store_n(&hidden, 1, __ATOMIC_RELAXED);
    }
    return hidden == 0;
}

/* H of each element in whole units, so that no order of adding matters. */
static const double unit_of_share = 0x1p-50;

typedef struct dents {
    const mesh *m;
    pair_factor_rules rules;
    double slack, deepest; /* metres */
    uint64_t *hidden;      /* [n] */
} dents;

/* One element Z and those behind its plane. */
typedef struct dent {
    const dents *all;
    element_plane plane;
    polygon back; /* Z from behind */
    size_t count;
} dent;

/* Elements behind one plane, and how far, of the extent of the scene, at most: beyond it is no dent. */
enum { BEHIND_MOST = 4096 };
static const double deepest = 1e-2;

static void dent_begin(const dents *all, size_t element, dent *out) {
    polygon front;
    polygon_of_element(all->m, element, &front);
    *out = (dent){.all = all, .plane = plane_of(all->m, element), .back = front};
    for (int c = 0; c < front.n; c++)
        memcpy(out->back.corner[c], front.corner[front.n - 1 - c], sizeof front.corner[c]);
    for (int d = 0; d < 3; d++) out->back.normal[d] = -front.normal[d];
}

static bool add_behind(void *context, size_t element) {
    const double tolerance = 1e-3;
    dent *z = context;
    polygon shape;
    if (++z->count > BEHIND_MOST || !is_in_front(z->all->m, element, &z->plane, z->all->deepest))
        return false;
    polygon_of_element(z->all->m, element, &shape);
    const double share =
        pair_factor_exchange(&z->all->rules, &shape, &z->back, tolerance) / z->all->m->area[element];
    const uint64_t units = (uint64_t)ceil(fmin(share, 1) / unit_of_share);
    const uint64_t sum = __atomic_add_fetch(&z->all->hidden[element], units, __ATOMIC_RELAXED);
    return (double)sum * unit_of_share <= OPEN_SCENE_ROW_MOST;
}

/* sum A H / sum A */
static double mean_hidden(const dents *all) {
    double hidden = 0, area = 0;
    for (size_t i = 0; i < all->m->n; i++) {
        hidden += all->m->area[i] * (double)all->hidden[i] * unit_of_share;
        area += all->m->area[i];
    }
    return hidden / area;
}

/* Elements that are looked at one by one before a tree is made. */
enum { FEW = 16 };

/* True where little lies behind the planes of few elements: almost all scenes that hide something end here.
 */
static bool few_hide_little(const dents *all) {
    const mesh *m = all->m;
    bool little = true;
    for (size_t i = 0; i < m->n && little; i += (m->n + FEW - 1) / FEW) {
        dent z;
        dent_begin(all, i, &z);
        for (size_t j = 0; j < m->n && little; j++)
            little = is_in_front(m, j, &z.plane, all->slack) || add_behind(&z, j);
    }
    memset(all->hidden, 0, m->n * sizeof *all->hidden);
    return little;
}

static bool all_hide_little(const dents *all, const cluster_tree *t) {
    int hidden = 0;
#pragma omp parallel for schedule(dynamic, 64)
    for (size_t p = 0; p < all->m->n; p++) {
        if (__atomic_load_n(&hidden, __ATOMIC_RELAXED)) continue;
        dent z;
        dent_begin(all, t->element[p], &z);
        if (!visit_behind(all->m, t, &z.plane, all->slack, add_behind, &z))
            __atomic_store_n(&hidden, 1, __ATOMIC_RELAXED);
    }
    return hidden == 0;
}

lam_status mesh_is_unhidden(const mesh *m, bool *out, double *hidden, lam_error *error) {
    lam_status status = LAM_OK;
    cluster_tree tree = {.n = 0};
    double mean = 0;
    bool found = false;
    const double slack = slack_of(m);
    dents all = {.m = m, .slack = slack, .deepest = slack * (deepest / plane_least_length)};
    all.hidden = memory_allocate(m->n, sizeof *all.hidden, "occlusion", error);
    if (all.hidden == NULL) TRY(LAM_ERR_MEMORY);
    pair_factor_rules_init(&all.rules);
    if (few_hide_little(&all)) {
        TRY(cluster_tree_build(m, all.slack, &tree, error));
        found = all_hide_little(&all, &tree);
        mean = mean_hidden(&all);
    }
    *out = found && mean <= OPEN_SCENE_MEAN_MOST;
    if (hidden != NULL && *out) *hidden = mean;
done:
    cluster_tree_free(&tree);
    free(all.hidden);
    return status;
}
