#include "solver/formfactor/leaving.h"

#include <math.h>
#include <stdlib.h>

static double area_mean(const mesh *m, const double *x) {
    double sum = 0, total = 0;
    for (size_t i = 0; i < m->n; i++) {
        sum += m->area[i] * x[i];
        total += m->area[i];
    }
    return total > 0 ? sum / total : 0;
}

void leaving_measure(form_factors *f, const mesh *m) {
    f->leaving_share = area_mean(m, f->leaving);
    f->absorbed_share = area_mean(m, f->absorbed);
    f->closed = f->leaving_share < LEAVING_CRACKS;
}

static double absorbed(const form_factors *f, size_t element) {
    return f->absorbed_share < LEAVING_CRACKS ? 0 : f->absorbed[element];
}

bool leaving_nothing(const form_factors *f) {
    return f->closed && f->absorbed_share < LEAVING_CRACKS;
}

double leaving_outside(const form_factors *f, size_t element) {
    return (f->closed ? 0 : f->leaving[element]) + absorbed(f, element);
}

lam_status leaving_to_sky(form_factors *f, size_t n, lam_error *error) {
    double *scale = memory_allocate(n, sizeof *scale, "first bounce of the sky", error);
    if (scale == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < n; i++) {
        const double outside = f->leaving[i] + absorbed(f, i);
        scale[i] = f->closed || outside <= 0 ? 0 : fmax(0, 1 - f->row_sums[i]) / outside;
    }
    sky_bounce_close(&f->sky, scale);
    free(scale);
    return LAM_OK;
}
