/* What rows of a node make of the wavelets of finer clusters: carried up the rows' tree coefficient by
 * coefficient. Where rows know both sides of every pair the transposed rows find it; of one side it is what
 * they do not. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_WAVELET_DETAILS_H
#define LAMBERT_METHOD_HIERARCHICAL_WAVELET_DETAILS_H

#include "solver/operator/wavelet/wavelets.h"

/* Functions that a node hands up, at most. */
enum { DETAIL_LANES = 3 };

/* Coefficient j, of a node of this weight, as the rows that are handed up have it. */
typedef struct detail {
    uint32_t j;
    float weight;
    float of[DETAIL_LANES];
} detail;

typedef struct details {
    size_t count, capacity;
    detail *list; /* j ascending */
} details;

void details_free(details *d);

/* Room for so many more. Errors: LAM_ERR_MEMORY. */
lam_status details_reserve(details *d, size_t more, lam_error *error);

/* All of a, whose j ascend, and of b, whose j ascend, none of them in both: into `into`, ascending; a and b
 * stay. Errors: LAM_ERR_MEMORY. */
lam_status details_join(const details *a, const detail *b, size_t b_count, details *into, lam_error *error);

/* The same list with room for no more than it has. Errors: LAM_ERR_MEMORY. */
lam_status details_copy(const details *from, details *out, lam_error *error);

#endif
