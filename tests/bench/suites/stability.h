/* Transport problems that are numerically hard, and the errors of operators on them. */
#ifndef LAMBERT_BENCH_STABILITY_H
#define LAMBERT_BENCH_STABILITY_H

#include "solver/method/method.h"

/* A problem as a matrix; all arrays owned. */
typedef struct stability_problem {
    const char *name; /* static */
    bool closed;      /* rows of F sum to 1 */
    size_t n;
    double *area;
    float *reflectance;
    csr F;
    uint32_t *order;
    /* These are of a mesh; NULL where the problem is a matrix alone, which methods on clusters are not tried
     * on. */
    double (*centre)[3];
    float (*normal)[3];
    uint32_t *surface;
} stability_problem;

void stability_free(stability_problem *p);

/* The problems, by index; false past the last. rho is the reflectance of those that have one. */
enum {
    STABILITY_ROOM,
    STABILITY_BLACK,
    STABILITY_HALF_BLACK,
    STABILITY_ONE,
    STABILITY_FLAT,
    STABILITY_TWINS,
    STABILITY_AREAS,
    STABILITY_PROBLEMS
};
lam_status stability_make(int which, double rho, stability_problem *out, lam_error *error);

/* The settings of one operator of a problem. A factorizer that is NULL and an epsilon or a rank of 0 are left
 * as the method presets them. */
typedef struct stability_way {
    const char *method, *factorizer;
    double epsilon;
    size_t rank;
} stability_way;

/* False where the method needs a mesh and the problem has none. */
bool stability_can(const stability_problem *p, const stability_way *way);

/* The operator that was built, and its errors. */
typedef struct stability_result {
    lam_status status; /* LAM_OK, or how it was refused: */
    char message[480];
    size_t rank;
    double rcond, norm;        /* |S - Q V^T|, or 0 */
    double relative, indirect; /* largest over the probes: one bright element, a third of all, all alike */
    double bound;              /* of relative, in the scaled norm: norm / (1 - max rho); 0: none is known */
    double negative;           /* the most negative radiosity over the largest one */
    double energy;             /* |sum A E - sum A (1 - rho) H| / sum A E of a closed scene, largest */
    double linearity;          /* |M (2 E1 + E2) - 2 M E1 - M E2| / |M (2 E1 + E2)| */
    double reciprocity;        /* |<g, M e> - <e, M g>| / <g, M e> in the weights A / rho, e and g >= 0 */
    bool finite;
} stability_result;

/* Builds and probes against a dense LU in double. An operator that is refused is a result, not an error. */
lam_status stability_try(const stability_problem *p, const stability_way *way, stability_result *out,
                         lam_error *error);

#endif
