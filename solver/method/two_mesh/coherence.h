/* What each element sees of the scene, coarsely, and how alike the elements of a patch see it: the spatial
 * coherence of Fernández et al. 2011, section 3.2. */
#ifndef LAMBERT_METHOD_TWO_MESH_COHERENCE_H
#define LAMBERT_METHOD_TWO_MESH_COHERENCE_H

#include "solver/method/method.h"

/* So few that each gathers many rays of an element: noise must not look like incoherence. */
#define VIEWS_MOST 64

/* v_eg = F_eg / A_g^1/2, F_eg the form factor from element e to all of group g. */
typedef struct views {
    size_t n_groups; /* at most VIEWS_MOST */
    float *v;        /* [n][n_groups] */
} views;

/* group [n] is below n_groups. Freed by views_free. Cost: O(nnz). */
lam_status views_create(const build_problem *problem, const uint32_t *group, size_t n_groups, views *out,
                        lam_error *error);
void views_free(views *v);

/* How a patch sees. With v the mean of the v_e by area:
 *     loss = sum_e A_e |v_e - v|^2,    coherence = 1 - loss / sum_e A_e |v_e|^2,    in [0, 1].
 * For reciprocal F, F_ej ~ F_ep A_j/A_p leaves sum_e A_e |F_e - F|^2 (entry j weighted by 1/A_j) of the
 * Frobenius norm of S's columns in the patch; loss is that to the resolution of the groups, and coherence the
 * share of their norm that is kept: 1 where all see the same or nothing. */
typedef struct view_figures {
    double area, loss, coherence;
} view_figures;

view_figures views_measure(const views *v, const double *area, const uint32_t *elements, size_t count);

#endif
