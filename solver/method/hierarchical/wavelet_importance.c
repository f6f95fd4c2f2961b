#include "solver/method/hierarchical/wavelet_importance.h"

#include <math.h>
#include <stdlib.h>

/* The product of the weights of two nodes of importance x and y is (x y)^-1/4. With all of (x y)^-1/2 the
 * coefficients of S are a third fewer, and what is read errs by a quarter more. */
static const double power = .25;

void wavelet_importance_free(wavelet_importance *i) {
    free(i->times);
    free(i->read);
    free(i->emits);
    *i = (wavelet_importance){.times = NULL};
}

/* out [n_clusters]: the largest of x [n] by element, no less than importance_least; NULL of NULL. */
static lam_status find_most(const float *x, const plane_tree *tree, float **out, lam_error *error) {
    if (x == NULL) return LAM_OK;
    float *made = memory_allocate(tree->n_clusters, sizeof *made, "operator", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    for (size_t t = 0; t < tree->n_clusters; t++) {
        const plane_cluster *c = &tree->clusters[t];
        made[t] = (float)importance_least;
        for (uint32_t p = c->begin; c->leaf && p < c->end; p++) made[t] = fmaxf(made[t], x[tree->order[p]]);
        if (!c->leaf) made[t] = fmaxf(made[c->left], made[t - 1]);
    }
    *out = made;
    return LAM_OK;
}

lam_status wavelet_importance_make(const importance *i, const double *area, const plane_tree *tree,
                                   float *weight, wavelet_importance *out, lam_error *error) {
    lam_status status = LAM_OK;
    wavelet_importance made = {.times = NULL};
    importance_nodes nodes = {.of = NULL};
    TRY(importance_nodes_make(i, area, tree, &nodes, error));
    TRY(find_most(i->read, tree, &made.read, error));
    TRY(find_most(i->emits, tree, &made.emits, error));
    made.times = memory_allocate(tree->n_clusters, sizeof *made.times, "operator", error);
    if (made.times == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t t = 0; t < tree->n_clusters; t++) {
        const double looser = sqrt(i->share_of_thresholds) * pow(importance_at(&nodes, t), -power);
        made.times[t] = (float)(1 / looser);
        weight[t] *= (float)looser;
    }
    *out = made;
    made = (wavelet_importance){.times = NULL};
done:
    wavelet_importance_free(&made);
    importance_nodes_free(&nodes);
    return status;
}
