#include "solver/formfactor/pairs/pair_ground.h"

#include <math.h>
#include <stdlib.h>

lam_status pair_ground_find(const mesh *m, const visibility *v, const pairs_options *options, size_t one_of,
                            pair_ground *out, lam_error *error) {
    lam_status status = LAM_OK;
    const double slack = visibility_rounding(v);
    cluster_link_options how = {
        .threshold = options->threshold, .slack = slack, .one_of = one_of, .progress = options->progress};
    *out = (pair_ground){.m = m, .options = options};
    pair_factor_rules_init(&out->rules);
    out->polygons = memory_allocate(m->n, sizeof *out->polygons, "pairs", error);
    if (out->polygons == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < m->n; i++) polygon_of_element(m, i, &out->polygons[i]);
    out->occlusion = (occlusion){.v = v,
                                 .area = m->area,
                                 .polygons = out->polygons,
                                 .rules = &out->rules,
                                 .tolerance = options->tolerance,
                                 .accuracy = options->accuracy * fmax(options->coarser, 1),
                                 .segments = options->segments,
                                 .seed = options->seed};
    if (options->occluders > 0)
        TRY(few_occluders_make(m, v, out->polygons, &out->rules, options->seed, options->occluders, &out->few,
                               error));
    TRY(cluster_tree_build(m, slack, &out->tree, error));
    TRY(pair_far_table_build(out->polygons, &out->tree, &out->rules, options->tolerance, &out->far, error));
    if (few_occluders_apply(&out->few)) how.occluders = &out->few.occluders;
    TRY(cluster_links_find(m, &out->tree, &out->occlusion, &how, &out->links, error));
    out->projects = options->occluders > 0 && few_occluders_pay(&out->few, &out->tree, &out->links);
    out->lists = options->occluders > 0 && few_occluders_are_listed(&out->few, &out->tree, &out->links);
done:
    return status;
}

bool pair_ground_projects(const pair_ground *g, uint32_t i, uint32_t j, double exchange) {
    static const double all_up_to = 1e-4;
    return g->options->accuracy <= all_up_to || !occlusion_test_suffices(&g->occlusion, i, j, exchange);
}

void pair_ground_free(pair_ground *g) {
    free(g->polygons);
    few_occluders_free(&g->few);
    pair_far_table_free(&g->far);
    cluster_links_free(&g->links);
    cluster_tree_free(&g->tree);
    *g = (pair_ground){.m = NULL};
}
