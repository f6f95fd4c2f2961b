#include "solver/formfactor/pairs/open_scene.h"

#include "solver/base/vector3.h"
#include "solver/formfactor/pairs/polygon.h"
#include "store/status.h"

#include <math.h>

/* Nothing shorter than this share of the extent of the scene is a distance. */
static const double least_length = 1e-7;

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

/* True where no vertex of the tree lies behind a plane. */
static bool all_in_front(const mesh *m, const cluster_tree *t, const element_plane *plane, double slack) {
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
                if (!is_in_front(m, t->element[p], plane, slack)) return false;
            continue;
        }
        waiting[n_waiting++] = c->child[0];
        waiting[n_waiting++] = c->child[1];
    }
    return true;
}

static double slack_of(const mesh *m) {
    double centre[3], radius;
    mesh_bounds(m, centre, &radius);
    return 2 * radius * least_length;
}

bool clusters_hide_nothing(const mesh *m, const cluster_tree *t) {
    const double slack = slack_of(m);
    int hidden = 0;
#pragma omp parallel for schedule(dynamic, 64)
    for (size_t p = 0; p < m->n; p++) {
        if (__atomic_load_n(&hidden, __ATOMIC_RELAXED)) continue;
        const element_plane plane = plane_of(m, t->element[p]);
        if (!all_in_front(m, t, &plane, slack)) __atomic_store_n(&hidden, 1, __ATOMIC_RELAXED);
    }
    return hidden == 0;
}

/* Elements that are looked at one by one before a tree is made. */
enum { FEW = 16 };

/* True where nothing lies behind the planes of few elements: almost all scenes that hide something end here.
 */
static bool few_hide_nothing(const mesh *m, double slack) {
    for (size_t i = 0; i < m->n; i += (m->n + FEW - 1) / FEW) {
        const element_plane plane = plane_of(m, i);
        for (size_t j = 0; j < m->n; j++)
            if (!is_in_front(m, j, &plane, slack)) return false;
    }
    return true;
}

lam_status mesh_is_unhidden(const mesh *m, bool *out, lam_error *error) {
    lam_status status = LAM_OK;
    cluster_tree tree = {.n = 0};
    bool found = few_hide_nothing(m, slack_of(m));
    if (found) {
        TRY(cluster_tree_build(m, slack_of(m), &tree, error));
        found = clusters_hide_nothing(m, &tree);
    }
    *out = found;
done:
    cluster_tree_free(&tree);
    return status;
}
