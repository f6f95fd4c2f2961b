#include "solver/method/hierarchical/wavelet_importance.h"

#include <math.h>
#include <stdlib.h>

/* Of the product of the weights of two nodes of importance x and y: (x y)^-1/4. With all of (x y)^-1/2 the
 * coefficients of S are a third fewer, and what is read errs by a quarter more. */
static const double power = .25;

void wavelet_importance_free(wavelet_importance *i) {
    free(i->times);
    free(i->over);
    *i = (wavelet_importance){.times = NULL};
}

/* out [n_clusters]: the largest of `read` [n] by element. */
static lam_status find_most(const float *read, const plane_tree *tree, float **out, lam_error *error) {
    float *made = memory_allocate(tree->n_clusters, sizeof *made, "operator", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    for (size_t t = 0; t < tree->n_clusters; t++) {
        const plane_cluster *c = &tree->clusters[t];
        for (uint32_t p = c->begin; c->leaf && p < c->end; p++)
            made[t] = fmaxf(made[t], read[tree->order[p]]);
        if (!c->leaf) made[t] = fmaxf(made[c->left], made[t - 1]);
    }
    *out = made;
    return LAM_OK;
}

lam_status wavelet_importance_make(const importance *i, const double *area, const plane_tree *tree,
                                   float *weight, wavelet_importance *out, lam_error *error) {
    lam_status status = LAM_OK;
    wavelet_importance made = {.times = NULL};
    float *y = NULL;
    TRY(importance_of_nodes(i->of, area, tree, &y, error));
    TRY(find_most(i->read, tree, &made.over, error));
    made.times = memory_allocate(tree->n_clusters, sizeof *made.times, "operator", error);
    if (made.times == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t t = 0; t < tree->n_clusters; t++) {
        const double looser = sqrt(i->share_of_thresholds) * pow((double)y[t], -power);
        made.times[t] = (float)(1 / looser);
        made.over[t] = fmaxf(made.over[t], (float)importance_least);
        weight[t] *= (float)looser;
    }
    *out = made;
    made = (wavelet_importance){.times = NULL};
done:
    wavelet_importance_free(&made);
    free(y);
    return status;
}
