#include "solver/formfactor/repair.h"

#include "solver/formfactor/row_scaling.h"
#include "solver/formfactor/rows/upper.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_SWEEPS = 200 };

/* Rows are cut into slices that do not depend on the number of threads. Each slice adds to sums of its own,
 * which are then added in the order of the slices. */
enum { SLICES = 32 };

typedef struct sums {
    size_t n;
    size_t first[SLICES + 1]; /* rows of the slices, about equally many entries in each */
    double *of_slices;        /* [SLICES][n] */
} sums;

static lam_status sums_init(sums *s, const csr *G, lam_error *error) {
    *s = (sums){.n = G->n};
    s->of_slices = memory_allocate(G->n, SLICES * sizeof *s->of_slices, "row sums", error);
    if (s->of_slices == NULL) return LAM_ERR_MEMORY;
    size_t row = 0;
    for (size_t k = 1; k <= SLICES; k++) {
        while (row < G->n && G->indptr[row] < G->indptr[G->n] / SLICES * k) row++;
        s->first[k] = k == SLICES ? G->n : row;
    }
    return LAM_OK;
}

/* total_i = sum over slices; a slice of the upper triangle adds nothing to rows before its first. */
static void sums_add(const sums *s, double *total) {
#pragma omp parallel for schedule(static)
    for (size_t i = 0; i < s->n; i++) {
        double sum = 0;
        for (size_t k = 0; k < SLICES && s->first[k] <= i; k++) sum += s->of_slices[k * s->n + i];
        total[i] = sum;
    }
}

/* r_i = d_i (A_i outside_i + sum_j g_ij d_j) */
static void scaled_row_sums(const csr *G, sums *s, const double *area, const double *outside, const double *d,
                            double *r) {
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t k = 0; k < SLICES; k++) {
        double *to = s->of_slices + k * s->n;
        memset(to + s->first[k], 0, (s->n - s->first[k]) * sizeof *to);
        for (size_t i = s->first[k]; i < s->first[k + 1]; i++) {
            const double d_i = d[i];
            double sum = 0;
            for (uint64_t p = G->indptr[i]; p < G->indptr[i + 1]; p++) {
                const uint32_t j = G->indices[p];
                const double g = (double)G->data[p];
                sum += g * d[j];
                to[j] += g * d_i;
            }
            to[i] += sum;
        }
    }
    sums_add(s, r);
    for (size_t i = 0; i < s->n; i++) r[i] = d[i] * (area[i] * outside[i] + r[i]);
}

/* The scene of scaled_row_sums. */
typedef struct repair_rows {
    const csr *G;
    sums *s;
    const double *area, *outside;
} repair_rows;

static lam_status sums_of_rows(void *context, const double *d, double *r, lam_error *error) {
    const repair_rows *c = context;
    (void)error; /* it cannot fail */
    scaled_row_sums(c->G, c->s, c->area, c->outside, d, r);
    return LAM_OK;
}

/* g_ij <- g_ij d_i d_j; sets the row sums of F; returns the largest error of reciprocity. */
static double scale(csr *G, sums *s, const double *area, const double *d, double *row_sums) {
    double worst = 0;
#pragma omp parallel for schedule(dynamic, 1) reduction(max : worst)
    for (size_t k = 0; k < SLICES; k++) {
        double *to = s->of_slices + k * s->n;
        memset(to + s->first[k], 0, (s->n - s->first[k]) * sizeof *to);
        for (size_t i = s->first[k]; i < s->first[k + 1]; i++) {
            double sum = 0;
            for (uint64_t p = G->indptr[i]; p < G->indptr[i + 1]; p++) {
                const uint32_t j = G->indices[p];
                G->data[p] = (float)((double)G->data[p] * d[i] * d[j]);
                const double forward = (double)upper_factor(G->data[p], area[i]),
                             backward = (double)upper_factor(G->data[p], area[j]);
                sum += forward;
                to[j] += backward;
                const double one = area[i] * forward, other = area[j] * backward;
                if (fmax(one, other) > 0) worst = fmax(worst, fabs(one - other) / fmax(one, other));
            }
            to[i] += sum;
        }
    }
    sums_add(s, row_sums);
    return worst;
}

lam_status repair_close(csr *G, const double *area, const double *outside, form_factors *out,
                        lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = G->n;
    sums s = {0};
    double *before = memory_allocate(n, sizeof *before, "row sums", error);
    double *d = memory_allocate(n, sizeof *d, "row scales", error);
    double *r = memory_allocate(n, sizeof *r, "row sums", error);
    double *row_sums = memory_allocate(n, sizeof *row_sums, "row sums", error);
    if (before == NULL || d == NULL || r == NULL || row_sums == NULL) TRY(LAM_ERR_MEMORY);
    TRY(sums_init(&s, G, error));

    repair_rows rows = {.G = G, .s = &s, .area = area, .outside = outside};
    row_scaling c = {.n = n,
                     .area = area,
                     .sums = sums_of_rows,
                     .context = &rows,
                     .sweeps_most = MAX_SWEEPS,
                     .d = d,
                     .r = r};
    TRY(row_scaling_settle(&c, before, error));
    out->repair_products = c.products;
    out->reciprocity_error = scale(G, &s, area, d, row_sums);
    out->closure_error = out->repair_max = 0;
    double repair = 0, total_area = 0;
    for (size_t i = 0; i < n; i++) {
        before[i] = before[i] / area[i] - 1;
        const double total = row_sums[i] + d[i] * outside[i], change = fabs(before[i]);
        /* A row that sees nothing at all has nothing to close. */
        if (total > 0) out->closure_error = fmax(out->closure_error, fabs(1 - total));
        out->repair_max = fmax(out->repair_max, change);
        repair += area[i] * change;
        total_area += area[i];
    }
    out->repair_mean = repair / total_area;
    out->row_sums = row_sums;
    out->repair = before;
    row_sums = before = NULL;
done:
    free(s.of_slices);
    free(before);
    free(d);
    free(r);
    free(row_sums);
    return status;
}
