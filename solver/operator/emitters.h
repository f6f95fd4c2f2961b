/* The arrays of an operator of few emitters. */
#ifndef LAMBERT_OPERATOR_EMITTERS_H
#define LAMBERT_OPERATOR_EMITTERS_H

#include "solver/operator/operator.h"

/* Rows are numbered c s + k for emitter k in channel c. */
typedef struct emitter_arrays {
    size_t s;
    char **names; /* [s], one block freed by one free() */
    float *T; /* [C][s][n] in mesh order: rho' H of every emitter alone, rho' being rho or 1 where it is 0 */
    uint64_t
        *ends; /* [C s + 1]: what the elements themselves emit, entries ends[row] ... ends[row + 1] - 1: */
    uint32_t *elements;
    float *values;
    size_t n_tiles;
    float *L;        /* [C][s][m], radiances of the sky's tiles; NULL: no emitter is of the sky */
    lam_sky *sky;    /* with L */
    float *direct;   /* [s][n], the irradiance that each gives directly where 1 W/m^2 leaves it, of emitters
                        that are no part of the mesh; NULL: there are none */
    float *exitance; /* [C], with direct: W/m^2 of such an emitter of weight 1 */
    lam_luminaires *luminaires; /* the last of s are these, in their order; NULL: none is one */
} emitter_arrays;

/* Copies s names into one block, freed by one free(). Errors: LAM_ERR_MEMORY. */
lam_status emitter_names_copy(size_t s, const char *const *names, char ***out, lam_error *error);

void emitter_arrays_free(emitter_arrays *arrays);

/* The answer to weights w is sum_k w_k B_k. Takes over what arrays points to, also on an error, and zeroes
 * it. Errors as the others: LAM_ERR_NUMERIC names a value, LAM_ERR_FORMAT what does not fit. */
lam_status operator_emitters_create(size_t n, size_t n_channels, const float *reflectance,
                                    emitter_arrays *arrays, lam_operator **op, lam_error *error);

/* The operator itself, for emitters.c and emitters_apply.c. */
typedef struct emitters {
    lam_operator base;
    emitter_arrays a; /* without T */
    panel *T;         /* [C] of [n][s] */
    /* [C s]: an element, or (n and above) a tile n + t, where no other emitter sends anything; EMITTERS_NONE:
     * there is none. */
    uint32_t *own;
    float *own_value; /* [C s], its emission or radiance there */
} emitters;

#define EMITTERS_NONE UINT32_MAX

/* The last emitters, that are luminaires; their weights are dimmers. */
size_t emitters_luminaires(const emitter_arrays *a);

/* Adds dimmers D [n_rhs][C][k] of the luminaires among the emitters to weights W [n_rhs][C][s]. */
void operator_emitters_dim(const lam_operator *op, size_t n_rhs, const float *D, float *W);

/* The same operator seen from inside; NULL of another kind. */
const emitters *operator_emitters_of(const lam_operator *op);

/* The emission E [n_rhs][C][n] of elements that weights [n_rhs][C][s] stand for, and H0, the direct
 * irradiance of their sky, luminaires and positions, in the same shape. Errors: LAM_ERR_MEMORY. */
lam_status operator_emitters_light(const lam_operator *op, size_t n_rhs, const float *W, float *E, float *H0,
                                   lam_error *error);

/* E alone. */
void operator_emitters_emission(const lam_operator *op, size_t n_rhs, const float *W, float *E);

/* The radiances L [n_rhs][C][m] of the tiles that the weights stand for: m is n_tiles of the arrays. */
void operator_emitters_radiances(const lam_operator *op, size_t n_rhs, const float *W, float *L);

/* The transpose, added to W [n_rhs][C][s]: w_k += sum_t L_kt g_t of g [n_rhs][C][m]. Nothing where no emitter
 * is of the sky. */
void operator_emitters_adjoint_radiances(const lam_operator *op, size_t n_rhs, const float *g, float *W);

/* The reason, in one line, for which answers of an operator of any kind have no values at points between its
 * elements: light that comes to these directly is not known there. NULL: they have values. */
const char *operator_points_why_not(const lam_operator *op);

/* E and H0 in double, for refined answers. */
lam_status operator_emitters_light_double(const lam_operator *op, size_t n_rhs, const float *W, double *E,
                                          double *H0, lam_error *error);

#endif
