#include "solver/formfactor/pairs/leaf_reaches.h"

#include "solver/base/array_grow.h"

#include <stdlib.h>

static int compare_reaches(const void *a, const void *b) {
    const reach *one = a, *two = b;
    return (one->first > two->first) - (one->first < two->first);
}

bool leaf_reaches_find(const cluster_tree *t, const cluster_links *links, const uint32_t *parent,
                       uint32_t leaf, leaf_reaches *out) {
    out->leaf = leaf;
    out->n = out->n_among = 0;
    for (uint32_t c = leaf;; c = parent[c]) {
        const size_t first = links->of_cluster[c], last = links->of_cluster[c + 1];
        if (array_grow(&out->reaches, &out->capacity, out->n + (last - first), sizeof *out->reaches, "pairs",
                       NULL) != LAM_OK)
            return false;
        for (size_t k = first; k < last; k++) {
            const cluster_link *link = &links->links[k];
            const cluster *b = &t->clusters[link->b];
            out->reaches[out->n++] =
                (reach){.first = b->first, .last = b->last, .cluster = link->b, .open = link->open};
        }
        if (c == 0) break;
    }
    if (out->n > 0) qsort(out->reaches, out->n, sizeof *out->reaches, compare_reaches);
    return true;
}

void leaf_reaches_free(leaf_reaches *r) {
    free(r->reaches);
    free(r->among);
    *r = (leaf_reaches){.n = 0};
}

reach *leaf_reaches_at(leaf_reaches *r, uint32_t position) {
    size_t low = 0, high = r->n;
    while (high - low > 1) {
        const size_t middle = low + (high - low) / 2;
        if (r->reaches[middle].first <= position)
            low = middle;
        else
            high = middle;
    }
    return &r->reaches[low];
}

link_occluders *leaf_reaches_among(const cluster_tree *t, const occluders *o, int most, leaf_reaches *r,
                                   reach *partner) {
    if (!partner->searched) {
        const cluster *a = &t->clusters[r->leaf], *b = &t->clusters[partner->cluster];
        shaft s;
        if (array_grow(&r->among, &r->among_capacity, r->n_among + 1, sizeof *r->among, "pairs", NULL) !=
            LAM_OK)
            return NULL;
        partner->searched = true;
        partner->among = r->n_among++;
        cluster_shaft_init(&s, a, b, o->slack);
        link_occluders_find(o, &s, a, b, most, &r->among[partner->among]);
    }
    return &r->among[partner->among];
}
