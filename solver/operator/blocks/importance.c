#include "solver/operator/blocks/importance.h"

#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const double importance_least = 1. / 16;

/* Of the root mean square r of y by area: the shares are its multiple, no less than these and at most 1.
 * Where y is 1 everywhere, all is read. The less is important, the more the errors of the rest add up in what
 * is read, and the more there is to gain. Chosen by receivers and lamps in an office, three rooms and a
 * Cornell box with blocks (r from .08 to .57): what is read errs .36 to 1.08 times as much as without, but up
 * to 1.28 times at a lamp of .2 % of the area, and 1.45 times once (performance.md). */
static const double share_of_mean = 1.5, bounds_least = .4, thresholds_least = .25;
/* Of bounds of a reference: with bounds_least its blocks take as long as if all were read. */
static const double reference_least = .5;

#define GROUP "/importance"

/* Bounces, and the largest change of the last that counts, over 1. */
enum { BOUNCES_MOST = 64 };
static const double change_least = 1e-3;

void importance_free(importance *i) {
    free(i->read);
    free(i->of);
    *i = (importance){.n = 0};
}

lam_status importance_find(const factor_product *F, size_t n_channels, const float *rho, const double *area,
                           importance *io, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = io->n;
    double *y = memory_allocate(n, sizeof *y, "importance", error);
    double *light = memory_allocate(n, sizeof *light, "importance", error);
    float *of = memory_allocate(n, sizeof *of, "importance", error);
    double change = 1, square = 0, whole = 0;
    if (y == NULL || light == NULL || of == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) y[i] = (double)io->read[i];
    for (int bounce = 0; bounce < BOUNCES_MOST && change > change_least; bounce++) {
        TRY(F->multiply(F->context, 1, y, light, error));
        change = 0;
        for (size_t i = 0; i < n; i++) {
            double r = 0;
            for (size_t c = 0; c < n_channels; c++) r = fmax(r, (double)rho[c * n + i]);
            const double now = (double)io->read[i] + r * light[i];
            change = fmax(change, fabs(now - y[i]));
            y[i] = now;
        }
    }
    for (size_t i = 0; i < n; i++) of[i] = (float)fmin(fmax(y[i], importance_least), 1);
    for (size_t i = 0; i < n; i++) {
        square += area[i] * (double)of[i] * (double)of[i];
        whole += area[i];
    }
    const double share = share_of_mean * sqrt(square / whole);
    io->share_of_bounds = fmin(fmax(share, bounds_least), 1);
    io->share_of_thresholds = fmin(fmax(share, thresholds_least), 1);
    io->of = of;
    of = NULL;
done:
    free(y);
    free(light);
    free(of);
    return status;
}

lam_status importance_even_out(const importance *i, importance *out, lam_error *error) {
    importance made = {.n = i->n,
                       .share_of_bounds = fmax(i->share_of_bounds, reference_least),
                       .share_of_thresholds = i->share_of_thresholds};
    made.read = memory_allocate(i->n, sizeof *made.read, "importance", error);
    made.of = memory_allocate(i->n, sizeof *made.of, "importance", error);
    if (made.read == NULL || made.of == NULL) {
        importance_free(&made);
        return LAM_ERR_MEMORY;
    }
    memcpy(made.read, i->read, i->n * sizeof *made.read);
    for (size_t k = 0; k < i->n; k++) made.of[k] = sqrtf(i->of[k]);
    *out = made;
    return LAM_OK;
}

lam_status importance_save(const importance *i, const char *option, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    size_t count = 0;
    uint32_t *elements = memory_allocate(i->n, sizeof *elements, "importance", error);
    float *weights = memory_allocate(i->n, sizeof *weights, "importance", error);
    if (elements == NULL || weights == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < i->n; k++) {
        if (!(i->read[k] > 0)) continue;
        elements[count] = (uint32_t)k;
        weights[count++] = i->read[k];
    }
    TRY(store_write(s, GROUP "/elements", STORE_U32, 1, (size_t[]){count}, elements, error));
    TRY(store_write(s, GROUP "/weights", STORE_F32, 1, (size_t[]){count}, weights, error));
    TRY(store_set_text(s, GROUP, "option", option, error));
done:
    free(elements);
    free(weights);
    return status;
}

lam_status importance_load(store *s, size_t n, importance *out, lam_error *error) {
    lam_status status = LAM_OK;
    size_t count = SIZE_MAX;
    void *elements = NULL, *weights = NULL;
    float *read = NULL;
    *out = (importance){.n = 0};
    if (!store_has(s, GROUP)) return LAM_OK;
    TRY(store_read(s, GROUP "/elements", STORE_U32, 1, &count, &elements, error));
    TRY(store_read(s, GROUP "/weights", STORE_F32, 1, &count, &weights, error));
    read = memory_allocate(n, sizeof *read, "importance", error);
    if (read == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < count; k++) {
        const uint32_t i = ((const uint32_t *)elements)[k];
        const float w = ((const float *)weights)[k];
        if (i >= n)
            FAIL(error, LAM_ERR_FORMAT, "%s: " GROUP "/elements[%zu] = %u, must be below %zu", store_path(s),
                 k, (unsigned)i, n);
        if (!(w > 0 && w <= 1))
            FAIL(error, LAM_ERR_FORMAT, "%s: " GROUP "/weights[%zu] = %g, must be above 0 and at most 1",
                 store_path(s), k, (double)w);
        read[i] = w;
    }
    *out = (importance){.n = n, .read = read};
    read = NULL;
done:
    free(elements);
    free(weights);
    free(read);
    return status;
}

lam_status importance_of_nodes(const float *of, const double *area, const plane_tree *tree, float **out,
                               lam_error *error) {
    const size_t N = tree->n_clusters;
    double(*sums)[2] = memory_allocate(N, sizeof *sums, "importance", error); /* of A y^2, and of A */
    float *made = memory_allocate(N + tree->n, sizeof *made, "importance", error);
    if (sums == NULL || made == NULL) {
        free(sums);
        free(made);
        return LAM_ERR_MEMORY;
    }
    for (size_t t = 0; t < N; t++) {
        const plane_cluster *c = &tree->clusters[t];
        for (uint32_t p = c->begin; c->leaf && p < c->end; p++) {
            const uint32_t i = tree->order[p];
            sums[t][0] += area[i] * (double)of[i] * (double)of[i];
            sums[t][1] += area[i];
        }
        for (int k = 0; !c->leaf && k < 2; k++) sums[t][k] = sums[c->left][k] + sums[t - 1][k];
        made[t] = (float)sqrt(sums[t][0] / sums[t][1]);
    }
    for (size_t p = 0; p < tree->n; p++) made[N + p] = of[tree->order[p]];
    free(sums);
    *out = made;
    return LAM_OK;
}
