/* The arrays of a hierarchical operator. */
#ifndef LAMBERT_OPERATOR_HIERARCHICAL_H
#define LAMBERT_OPERATOR_HIERARCHICAL_H

#include "solver/linalg/tiled.h"
#include "solver/operator/mean_correction.h"
#include "solver/operator/operator.h"
#include "solver/operator/wavelet/wavelet_plan.h"

/* H_c = A^-1/2 W^T K_c W A^1/2 E_c, with K_c = W A^1/2 F (I - R_c F)^-1 A^-1/2 W^T, symmetric whatever R is,
 * of which entries below the threshold are left out. */
typedef struct hierarchical_arrays {
    wavelets basis;
    csr *K;      /* [C], of n rows each: the upper triangle, the diagonal included; without rows where an
                    earlier channel has the same reflectances (operator_like_channel) */
    float *step; /* [n], by coefficient: K_ij is rounded to a multiple of step_i step_j at most */
} hierarchical_arrays;

/* Elements of a piece of the plan whose numbers in the mesh follow each other. */
typedef struct hierarchical_run {
    uint32_t element, count; /* the first, and how many */
} hierarchical_run;

/* The arrays of an operator in a store but for its tiles; they may be mapped. */
typedef struct hierarchical_source {
    bool ordered;
    size_t n_groups;
    store_view order, area, missing, light; /* area in mesh order; missing.data NULL: nothing is missing */
    store_view rows, step;
    wavelet_arrays basis;
} hierarchical_source;

/* The source of an operator of which much is made when it is first needed (operator_prepare). */
typedef struct hierarchical_rest hierarchical_rest;

/* A loaded operator. Pointers from `basis` on, and those in base.order, plan, even and first and step of K,
 * may wait for operator_prepare; numbers do not. */
typedef struct hierarchical {
    lam_operator base;
    hierarchical_rest *rest; /* NULL: all is made */
    size_t n_groups;
    size_t *of_channel; /* [C], the K of a channel: its own, or that of an earlier one which is alike */
    tiled_rows *K;      /* [C]; empty where a channel has that of another */
    wavelets basis;
    wavelet_plan plan;      /* of the coefficients that any K has */
    tile_group *groups;     /* [n_groups], by number in the basis, all that the plan has */
    float *step;            /* [n_groups] */
    float *root_area;       /* [n] A^1/2, by position */
    float *left;            /* [C][n] rho' A^-1/2, by position */
    float *left_of_element; /* [C][n], the same in mesh order */
    hierarchical_run *runs; /* of pieces, in their order; of piece k those from first_run[k] on */
    uint32_t *first_run;    /* [n_pieces + 1] */
    mean_correction even;
} hierarchical;

/* The products of the kind (operator.h), in hierarchical_apply.c. */
size_t hierarchical_work_bytes(const lam_operator *op, size_t n_rhs);
void hierarchical_apply(const lam_operator *op, size_t n_rhs, const float *E, float *P, void *work);
void hierarchical_apply_adjoint(const lam_operator *op, size_t n_rhs, float *g, float *w, void *work);
void hierarchical_answer(const lam_operator *op, size_t n_rhs, const operator_vector *vectors, void *work);
bool hierarchical_answer_selected(const lam_operator *op, size_t n_rhs, const operator_vector *vectors,
                                  size_t n_selected, const uint32_t *selected, void *work);

void hierarchical_arrays_free(hierarchical_arrays *arrays, size_t n_channels);

/* area [n] is by position, that is in the order of the basis, which order [n] says (copied; NULL: mesh
 * order). Takes over what arrays points to, also on an error, and
 * zeroes it. Errors: as operator_init; LAM_ERR_NUMERIC for an area or a number that cannot be. */
lam_status operator_hierarchical_create(size_t n, size_t n_channels, const float *reflectance,
                                        const double *area, const uint32_t *order,
                                        hierarchical_arrays *arrays, lam_operator **op, lam_error *error);

/* H += missing (sum_j A_j E_j) / light from now on (mean_correction.h): missing [C][n], by position, is what
 * op lacks of the irradiance that a light E0 brings, light [C] the area-weighted sum of E0. Once at most.
 * Errors: as mean_correction_create. */
lam_status operator_hierarchical_correct(lam_operator *op, const double *missing, const double *light,
                                         lam_error *error);

/* The steps that keep the error of rounding K far below that of the numbers left out by a threshold of
 * coefficients of weight 1 (wavelets_weights): out [n] by coefficient is freed by the caller. Errors:
 * LAM_ERR_MEMORY. */
lam_status hierarchical_steps(const wavelets *basis, double threshold, float **out, lam_error *error);

/* Cuts the coefficients of a plan into groups of neighbours in the basis, of at most TILE: those of a node,
 * and of several nodes where they fit. group_step is the smallest step of a group's coefficients, but at
 * least `least`. The caller frees groups and group_step, [n_groups]. Errors: LAM_ERR_MEMORY. */
lam_status hierarchical_groups(const wavelet_plan *plan, const float *step, float least, size_t *n_groups,
                               tile_group **groups, float **group_step, lam_error *error);

/* Sets the order of positions (NULL: mesh order) and areas [n], by position or in mesh order, which are
 * copied. Errors: LAM_ERR_NUMERIC, LAM_ERR_MEMORY. */
lam_status hierarchical_set_area(hierarchical *self, const uint32_t *order, const double *area,
                                 bool by_position, lam_error *error);

/* Makes the lift of the correction of the mean error. Errors: LAM_ERR_MEMORY. */
lam_status hierarchical_lift(hierarchical *self, lam_error *error);

/* Frees what hierarchical_make makes. */
void hierarchical_unmake(hierarchical *self);

/* Makes of its source all of an operator but K, and first and step of the K that it has. Errors: as
 * operator_set_order, wavelets_make and mean_correction_create; LAM_ERR_NUMERIC for groups that cannot be. */
lam_status hierarchical_make(hierarchical *self, const hierarchical_source *from, lam_error *error);

/* The kind's memory (operator.h). */
uint64_t hierarchical_memory(store *s, uint64_t stored);

/* Reads an operator of a store; where that is mapped, much of it is only checked, and made by
 * hierarchical_prepare. Errors: as store_read_view and hierarchical_make. */
lam_status hierarchical_load(store *s, size_t n, size_t n_channels, const float *reflectance,
                             lam_operator **op, lam_error *error);
lam_status hierarchical_prepare(const lam_operator *op, lam_error *error);
void hierarchical_rest_free(hierarchical_rest *rest);

/* An operator without K and basis, of which each channel has its own K so far. Errors: as operator_init. */
lam_status hierarchical_begin(size_t n, size_t n_channels, const float *reflectance, hierarchical **out,
                              lam_error *error);

/* The tiles of a K of an older store: GROUP/count [planes][n_groups] u16 (u32 where a row has more than
 * 65,535 tiles), tile [tiles] u16, far u32, digit i8, as store/FORMAT.md says. Errors: as store_read;
 * LAM_ERR_FORMAT where they do not fit together, LAM_ERR_NUMERIC for a tile that cannot be. */
lam_status hierarchical_load_tiles(store *s, const char *group, size_t n_groups, const tile_group *groups,
                                   tile_matrix *out, lam_error *error);

#endif
