/* Thresholds by importance (importance.h): of light that is read and of light on its way to it. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_WAVELET_IMPORTANCE_H
#define LAMBERT_METHOD_HIERARCHICAL_WAVELET_IMPORTANCE_H

#include "solver/operator/blocks/importance.h"

/* The importance of the nodes of a basis; all NULL: all is read, and may emit. */
typedef struct wavelet_importance {
    float *times, *read, *emits; /* of wavelet_inverse_input */
} wavelet_importance;

/* Multiplies the weights [n_clusters] of the nodes of a tree, by which coefficients of S and of its powers
 * are dropped, by what their importance y z allows, s^1/2 (y z)^-1/4; sets out for K, whose entry i, j
 * matters only where element i is read and j emits, or the other way round. s < 1 makes up for what is lost
 * elsewhere. area [n] by element. Errors: LAM_ERR_MEMORY. */
lam_status wavelet_importance_make(const importance *i, const double *area, const plane_tree *tree,
                                   float *weight, wavelet_importance *out, lam_error *error);
void wavelet_importance_free(wavelet_importance *i);

#endif
