/* The trees, occluders and shapes that walks of a scene share. */
#include "solver/formfactor/blocks/block_walk.h"

#include "solver/formfactor/sight/open_scene.h"

#include <math.h>
#include <stdlib.h>

/* The kernel of a block of clusters of several planes may vary by this share of itself, times the root of the
 * bound of the 2-norm that open blocks err by: .08 at the bound of the default. A bound of the norm alone
 * would leave errors of .6 for single elements, as no block of small clusters has much of it. */
static const double spread_most = 5;
/* Single pairs beside such blocks are computed to this share of what a kernel varies by: an error that is
 * much smaller than those of the blocks is not seen in any sum of both. */
static const double share_of_spread = .01;
/* Shapes of this many elements at most are kept, 16 MB. */
enum { SHAPES_MOST = 1 << 16 };

lam_status block_finder_make(const mesh *m, const visibility *v, const plane_tree *tree, block_factors *nodes,
                             block_finder *out, lam_error *error) {
    lam_status status = LAM_OK;
    *out = (block_finder){.tree = tree, .n_clusters = tree->n_clusters};
    double(*centre)[3] = memory_allocate(m->n, sizeof *centre, "blocks", error);
    if (centre == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < m->n; i++) mesh_centroid(m, i, centre[i]);
    TRY(block_factors_begin(tree, m->area, (const double(*)[3])centre, nodes, error));
    TRY(flat_clusters_make(m, v, tree, nodes, &out->flat, error));
    TRY(occluders_make(m, visibility_facets(v), out->flat.slack, &out->pieces, error));
    TRY(flat_clusters_find_sets(v, tree, &out->pieces, &out->flat, error));
    out->joined = tree->view == PLANE_VIEW_UNHIDDEN;
    if (tree->view == PLANE_VIEW_UNKNOWN && !blocks_are_planar(tree))
        TRY(mesh_is_unhidden(m, &out->joined, NULL, error));
    pair_factor_rules_init(&out->rules);
    out->shade =
        (shade_scene){.f = &out->flat, .occluders = &out->pieces, .v = v, .glass = out->pieces.glass};
    out->occlusion = (occlusion){.v = v, .area = m->area, .rules = &out->rules, .glass = out->pieces.glass};
    TRY(segment_occluders_make(&out->pieces, visibility_centre(v), &out->segment_pieces, error));
    out->occlusion.occluders = out->segment_pieces;
    if (m->n <= SHAPES_MOST) {
        out->shapes = memory_allocate(m->n, sizeof *out->shapes, "blocks", error);
        if (out->shapes == NULL) TRY(LAM_ERR_MEMORY);
        for (size_t i = 0; i < m->n; i++) polygon_of_element(m, i, &out->shapes[i]);
    }
done:
    free(centre);
    return status;
}

lam_status block_finder_set(block_finder *k, const block_options *options, lam_error *error) {
    lam_status status = LAM_OK;
    k->options = options;
    k->spread = spread_most * sqrt(options->open);
    k->exact = k->joined ? fmax(options->exact, share_of_spread * k->spread) : options->exact;
    k->shade.seed = k->occlusion.seed = options->seed;
    importance_nodes_free(&k->important);
    if (options->importance != NULL)
        TRY(importance_nodes_make(options->importance, k->flat.m->area, k->tree, &k->important, error));
    if (k->joined && k->elements == NULL) {
        k->elements = memory_allocate(k->tree->n, sizeof *k->elements, "blocks", error);
        if (k->elements == NULL) TRY(LAM_ERR_MEMORY);
        joined_elements_set(&k->flat, k->elements);
    }
    k->kernel = (joined_kernel){&k->flat, k->elements, &k->rules, k->exact, options->seed};
done:
    return status;
}

void block_finder_free(block_finder *k) {
    occluders_free(&k->pieces);
    flat_clusters_free(&k->flat);
    free(k->elements);
    free(k->segment_pieces);
    free(k->shapes);
    importance_nodes_free(&k->important);
    k->elements = NULL;
    k->segment_pieces = NULL;
    k->shapes = NULL;
}

lam_status block_finder_planes(const block_finder *k, uint32_t **out, size_t *count, lam_error *error) {
    const plane_tree *tree = k->tree;
    uint32_t *roots = memory_allocate(tree->n_frames, sizeof *roots, "blocks", error);
    if (roots == NULL) return LAM_ERR_MEMORY;
    *count = 0;
    if (k->joined) roots[(*count)++] = (uint32_t)tree->n_clusters - 1;
    for (uint32_t t = 0; !k->joined && t < tree->n_clusters; t++) {
        const uint32_t parent = k->flat.tree->nodes[t].parent;
        if (tree->clusters[t].frame == PLANE_ABOVE) continue;
        if (parent == BLOCK_NO_NODE || tree->clusters[parent].frame == PLANE_ABOVE) roots[(*count)++] = t;
    }
    *out = roots;
    return LAM_OK;
}
