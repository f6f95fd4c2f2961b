#include "solver/formfactor/clusters/cluster_shaft.h"

/* Only elements in front of a cluster's plane occlude its elements. */
static void cut_front(shaft *s, const cluster *c, double slack) {
    if (c->plane) shaft_cut(s, c->normal, c->level + slack);
}

static shaft_box box_of(const cluster *c) {
    return (shaft_box){{c->low[0], c->low[1], c->low[2]}, {c->high[0], c->high[1], c->high[2]}};
}

void cluster_shaft_init(shaft *s, const cluster *a, const cluster *b, double slack) {
    const shaft_box of_a = box_of(a), of_b = box_of(b);
    shaft_of_boxes(s, &of_a, &of_b, slack);
    cut_front(s, a, slack);
    cut_front(s, b, slack);
}

static bool misses_leaf(const shaft *s, const mesh *m, const cluster_tree *t, const cluster *leaf) {
    for (uint32_t p = leaf->first; p < leaf->last; p++)
        if (!shaft_misses_element(s, m, t->element[p])) return false;
    return true;
}

static double extent2(const double low[3], const double high[3]) {
    double sum = 0;
    for (int d = 0; d < 3; d++) sum += (high[d] - low[d]) * (high[d] - low[d]);
    return sum;
}

size_t cluster_shaft_filter(const shaft *s, const mesh *m, const cluster_tree *t, const uint32_t *candidates,
                            size_t n_candidates, bool finest, uint32_t out[SHAFT_CANDIDATES]) {
    /* Clusters of an eighth of the shaft's diagonal are kept whole: the shafts inside this one split them. */
    enum { DEPTH = 128 };
    const double small = finest ? 0 : extent2(s->low, s->high) / 64;
    size_t n_out = 0;
    for (size_t k = 0; k < n_candidates; k++) {
        uint32_t stack[DEPTH];
        size_t depth = 0;
        stack[depth++] = candidates[k];
        while (depth > 0) {
            const uint32_t at = stack[--depth];
            const cluster *c = &t->clusters[at];
            if (shaft_misses_box(s, c->low, c->high)) continue;
            if (cluster_is_leaf(c)) {
                if (misses_leaf(s, m, t, c)) continue;
            } else if (extent2(c->low, c->high) > small && depth + 2 <= DEPTH &&
                       n_out + depth + (n_candidates - k) + 2 <= SHAFT_CANDIDATES) {
                stack[depth++] = c->child[1];
                stack[depth++] = c->child[0];
                continue;
            }
            out[n_out++] = at;
        }
    }
    return n_out;
}
