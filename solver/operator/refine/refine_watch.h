/* Refinement that can be left before its end. */
#ifndef LAMBERT_OPERATOR_REFINE_REFINE_WATCH_H
#define LAMBERT_OPERATOR_REFINE_REFINE_WATCH_H

#include "store/status.h"

/* go_on is asked before every iteration, by the calling thread. */
typedef struct refine_watch {
    bool (*go_on)(void *context);
    void *context;
} refine_watch;

/* As lam_refine. LAM_ERR_NUMERIC, with the outputs untouched, also where the watch does not go on; NULL:
 * always. */
lam_status refine_watched(const lam_refiner *refiner, size_t n_rhs, lam_quantity quantity, const double *E,
                          const double *H0, const float *start, double tolerance, double *out,
                          double *certificates, size_t *iterations, const refine_watch *watch,
                          lam_error *error);

#endif
