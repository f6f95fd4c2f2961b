/* Some elements of kind "hierarchical": the part of the tree and of K that they need, for answers of which
 * only they are asked, and for light that is only there. */
#ifndef LAMBERT_OPERATOR_HIERARCHICAL_SOME_H
#define LAMBERT_OPERATOR_HIERARCHICAL_SOME_H

#include "solver/operator/hierarchical.h"

/* The part that some elements need; both lists are ascending. */
typedef struct hierarchical_part {
    size_t n_steps, n_groups;
    uint32_t *steps;  /* [plan.n_steps], of the plan: those on the paths to the elements */
    uint32_t *groups; /* [self->n_groups], of K: the coefficients of these steps */
} hierarchical_part;

/* The extent of the light of a channel; of few elements the part is known. */
typedef enum hierarchical_extent { LIT_NOWHERE, LIT_FEW, LIT_MANY } hierarchical_extent;

/* The elements asked, and those that are lit by the light whose coefficients were made last. */
typedef struct hierarchical_some {
    const hierarchical *self;
    hierarchical_part asked, lit;
    const float *E; /* [n], that light, which must not have changed; NULL: nothing is known of it */
    hierarchical_extent extent;
    double sum;       /* of its areas times light, where few elements are lit */
    bool knows_lit;   /* lit is that of the marks lit_at */
    uint8_t *wanted;  /* [n_used + TILED_PAST], 1 for the first coefficient of the groups asked */
    uint64_t *marks;  /* work, of positions */
    uint64_t *lit_at; /* marks */
    uint8_t *flags;   /* [plan.n_steps], work, 0 */
} hierarchical_some;

/* Bytes of the parts of a work area; false when *total overflows. */
bool hierarchical_some_add(const hierarchical *self, size_t *total);

hierarchical_some hierarchical_some_take(const hierarchical *self, void **work);

/* Finds what the elements selected need. False where that is more than one in `share` steps. */
bool hierarchical_some_ask(hierarchical_some *some, size_t n_selected, const uint32_t *selected,
                           size_t share);

/* True where light E + rho H0 [n] of a channel, in mesh order, H0 may be NULL, is that whose coefficients
 * were made last, which are those of any channel. Mostly channels emit alike. Else its extent is found, with
 * the part of few elements. */
bool hierarchical_some_light(hierarchical_some *some, const float *E, const float *H0);

/* The coefficients of such light of few elements, times their steps: C [n_used], with the numbers of a
 * transform of all of X [n], of which only lit leaves are written. */
void hierarchical_some_forward(hierarchical_some *some, size_t c, const float *E, const float *H0, float *X,
                               float *C, float *work);

/* The rows asked of K_c C, with the bits of a whole product. */
void hierarchical_some_multiply(const hierarchical_some *some, size_t c, const float *C, float *to);

#endif
