#include "solver/codec/emitters_error.h"

#include <math.h>
#include <stdlib.h>

#define COVARIANCE "/error/emitters/covariance"

void emitters_error_free(emitters_error *e) {
    free(e->covariance);
    *e = (emitters_error){.s = 0};
}

lam_status emitters_error_read(store *s, size_t n_emitters, emitters_error *out, lam_error *error) {
    lam_status status = LAM_OK;
    void *data = NULL;
    size_t dims[STORE_MAX_RANK] = {n_emitters, n_emitters};
    *out = (emitters_error){.s = 0};
    if (n_emitters == 0 || !store_has(s, COVARIANCE)) return LAM_OK;
    TRY(store_read(s, COVARIANCE, STORE_F64, 2, dims, &data, error));
    const double *K = data;
    for (size_t k = 0; k < n_emitters * n_emitters; k++)
        if (!isfinite(K[k]))
            FAIL(error, LAM_ERR_FORMAT, "%s: " COVARIANCE "[%zu] is not finite", store_path(s), k);
    *out = (emitters_error){.s = n_emitters, .covariance = data};
    data = NULL;
done:
    free(data);
    return status;
}

answer_error emitters_error_of(const emitters_error *e, const error_scene *scene, const error_answer *of,
                               const float *W) {
    const size_t s = e->s, C = scene->n_channels;
    double off = 0, power = 0, squares = 0;
    for (size_t j = 0; j < s; j++) {
        double row = 0, own = 0;
        for (size_t c = 0; c < C; c++) own = fmax(own, (double)W[c * s + j]);
        for (size_t l = 0; own > 0 && l < s; l++) {
            double other = 0;
            for (size_t c = 0; c < C; c++) other = fmax(other, (double)W[c * s + l]);
            row += e->covariance[j * s + l] * other;
        }
        off += own * row;
        power += own;
        squares += own * own;
    }
    answer_error made = answer_error_of_square(scene, of, fmax(off, 0));
    made.emitters = squares > 0 ? power * power / squares : 0;
    return made;
}
