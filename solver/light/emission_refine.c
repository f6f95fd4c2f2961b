#include "solver/light/emission_refine.h"

#include <stdlib.h>

enum { AT_ONCE = 16 }; /* vectors between two checks for a signal */

void refined_light_free(refined_light *r) {
    free(r->values);
    free(r->certificates);
    free(r->iterations);
    *r = (refined_light){0};
}

/* The vectors of one pass. */
typedef struct room {
    double *E, *H0;
    float *start;
} room;

static lam_status reserve(const emission *e, const lam_operator *op, size_t most, room *r,
                          refined_light *made, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t C = lam_operator_channels(op), n = lam_operator_elements(op);
    size_t rows;
    if (!size_multiply(e->n_vectors, C, &rows))
        FAIL(error, LAM_ERR_MEMORY, "%zu emissions are too many for memory", e->n_vectors);
    made->values = memory_allocate(rows, n * sizeof *made->values, "the solution", error);
    made->certificates = memory_allocate(e->n_vectors, sizeof *made->certificates, "the solution", error);
    made->iterations = memory_allocate(e->n_vectors, sizeof *made->iterations, "the solution", error);
    r->E = memory_allocate(most * C, n * sizeof *r->E, "emissions", error);
    r->H0 = memory_allocate(most * C, n * sizeof *r->H0, "the light of the sky", error);
    r->start = memory_allocate(most * C, n * sizeof *r->start, "the solution", error);
    if (made->values == NULL || made->certificates == NULL || made->iterations == NULL || r->E == NULL ||
        r->H0 == NULL || r->start == NULL)
        TRY(LAM_ERR_MEMORY);
done:
    return status;
}

lam_status emission_refine(const emission *e, const char *path, const lam_operator *op, const lam_sky *sky,
                           lam_quantity quantity, double tolerance, lam_status (*stop)(lam_error *error),
                           refined_light *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t size = lam_operator_channels(op) * lam_operator_elements(op);
    const size_t most = e->n_vectors < AT_ONCE ? e->n_vectors : AT_ONCE;
    lam_form_factors *F = NULL;
    lam_refiner *refiner = NULL;
    emission_pass p = {0};
    room r = {0};
    refined_light made = {0};
    size_t vectors[AT_ONCE];
    lam_error cause;
    TRY(lam_form_factors_open(path, &F, error));
    if (F == NULL)
        FAIL(error, LAM_ERR_ARGUMENT,
             "%s: keeps no form factors, which --tolerance needs; precompute it with --keep-form-factors",
             path);
    status = lam_refiner_create(op, F, &refiner, &cause);
    if (status != LAM_OK) FAIL(error, status, "%s: %s", path, cause.message);
    TRY(emission_pass_create(e, op, sky, quantity, 0, NULL, most, &p, error));
    TRY(reserve(e, op, most, &r, &made, error));
    for (size_t first = 0; first < e->n_vectors; first += most) {
        const size_t left = e->n_vectors - first, now = left < most ? left : most;
        bool H0_there;
        for (size_t k = 0; k < now; k++) vectors[k] = first + k;
        TRY(emission_pass_light(&p, now, vectors, r.E, r.H0, &H0_there, r.start, error));
        status = lam_refine(refiner, now, quantity, r.E, H0_there ? r.H0 : NULL, p.W != NULL ? r.start : NULL,
                            tolerance, made.values + first * size, made.certificates + first,
                            made.iterations + first, &cause);
        if (status != LAM_OK) FAIL(error, status, "%s: vectors from %zu on: %s", path, first, cause.message);
        if (stop != NULL) TRY(stop(error));
    }
    *out = made;
    made = (refined_light){0};
done:
    refined_light_free(&made);
    free(r.E);
    free(r.H0);
    free(r.start);
    emission_pass_free(&p);
    lam_refiner_free(refiner);
    lam_form_factors_close(F);
    return status;
}
