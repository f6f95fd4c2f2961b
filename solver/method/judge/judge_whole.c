#include "solver/method/judge/judge_whole.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Numbers of corrections that are held at once, and figures of a store, at most. */
static const size_t most_numbers = (size_t)1 << 22, most_figures = (size_t)1 << 16;

enum { WHOLE_LEAST = 3 };

size_t judge_whole_most(size_t n, size_t n_channels, size_t n_bins) {
    size_t most = WHOLE_MOST;
    while (most > WHOLE_LEAST &&
           (most * n * n_channels > most_numbers || most * most * n_bins > most_figures))
        most--;
    return most;
}

/* Sums of products over the elements of bins, [n_bins][count][count], of k >= l alone: of errors, and of the
 * noise in them; and of one channel the sums over bins, [count][n_bins]. */
typedef struct product_sums {
    size_t count, n_bins;
    double *rms, *rms_noise, *mean, *mean_noise;
    double *off, *noise;
} product_sums;

static void product_sums_free(product_sums *s) {
    free(s->rms);
    free(s->rms_noise);
    free(s->mean);
    free(s->mean_noise);
    free(s->off);
    free(s->noise);
}

static lam_status product_sums_begin(size_t count, size_t n_bins, product_sums *s, lam_error *error) {
    const size_t pairs = count * count;
    *s = (product_sums){.count = count, .n_bins = n_bins};
    double **const of_pairs[] = {&s->rms, &s->rms_noise, &s->mean, &s->mean_noise},
                   **const of_bins[] = {&s->off, &s->noise};
    for (size_t k = 0; k < 4; k++) {
        *of_pairs[k] = memory_allocate(n_bins, pairs * sizeof(double), "errors of groups", error);
        if (*of_pairs[k] == NULL) return LAM_ERR_MEMORY;
    }
    for (size_t k = 0; k < 2; k++) {
        *of_bins[k] = memory_allocate(n_bins, count * sizeof(double), "errors of groups", error);
        if (*of_bins[k] == NULL) return LAM_ERR_MEMORY;
    }
    return LAM_OK;
}

/* Adds element k % n in channel k / n. The noise of the first light is no part of that of the references. */
static void add_element(const figure_probe *each, size_t k, size_t bin, product_sums *s) {
    const size_t count = s->count;
    const double a = each->problem->area[k % each->problem->n];
    figure_number at[WHOLE_MOST];
    double *const rms = s->rms + bin * count * count, *const noise = s->rms_noise + bin * count * count;
    for (size_t v = 0; v < count; v++) {
        at[v] = figure_number_at(&each[v], k);
        s->off[v * s->n_bins + bin] += a * at[v].off;
        s->noise[v * s->n_bins + bin] += a * (at[v].noise + at[v].light);
        for (size_t w = 0; w <= v; w++) {
            rms[v * count + w] += a * at[v].off * at[w].off;
            noise[v * count + w] += a * (at[v].noise * at[w].noise + at[v].light * at[w].light);
        }
    }
}

/* Adds the products of the sums over bins of a channel, and makes these 0. */
static void add_means(product_sums *s) {
    const size_t count = s->count;
    for (size_t b = 0; b < s->n_bins; b++)
        for (size_t v = 0; v < count; v++)
            for (size_t w = 0; w <= v; w++) {
                const size_t at = (b * count + v) * count + w;
                s->mean[at] += s->off[v * s->n_bins + b] * s->off[w * s->n_bins + b];
                s->mean_noise[at] += s->noise[v * s->n_bins + b] * s->noise[w * s->n_bins + b];
            }
    memset(s->off, 0, count * s->n_bins * sizeof *s->off);
    memset(s->noise, 0, count * s->n_bins * sizeof *s->noise);
}

/* sums over the area times `scale` [n_bins], without the noise where that is little in both groups of a pair;
 * pairs k < l as l, k. */
static void finish_pairs(const product_sums *s, const by_group_sums *bins, bool squared, double *sums,
                         const double *noise) {
    const size_t n = s->count;
    for (size_t b = 0; b < s->n_bins; b++) {
        const double area = bins->bins[b].area, over = area > 0 ? 1 / (squared ? area * area : area) : 0;
        double *const of = sums + b * n * n;
        const double *const in = noise + b * n * n;
        bool little[WHOLE_MOST];
        for (size_t v = 0; v < n; v++)
            little[v] = square_without_noise(of[v * n + v], in[v * n + v]) < of[v * n + v];
        for (size_t v = 0; v < n; v++)
            for (size_t w = 0; w <= v; w++) {
                const double less = little[v] && little[w] ? in[v * n + w] : 0;
                of[v * n + w] = of[w * n + v] = (of[v * n + w] - less) * over;
            }
    }
}

lam_status whole_errors(size_t count, const figure_probe *each, const uint32_t *groups,
                        const by_group_sums *bins, group_errors *to, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n_bins = by_group_bins(bins);
    product_sums s = {.count = 0};
    uint32_t *copy = NULL;
    if (count == 0) return LAM_OK;
    copy = memory_allocate(count, sizeof *copy, "errors of groups", error);
    if (copy == NULL) TRY(LAM_ERR_MEMORY);
    memcpy(copy, groups, count * sizeof *copy);
    TRY(product_sums_begin(count, n_bins, &s, error));
    for (size_t c = 0; c < each->problem->n_channels; c++) {
        for (size_t i = 0; i < bins->n; i++) add_element(each, c * bins->n + i, by_group_bin(bins, i), &s);
        add_means(&s);
    }
    finish_pairs(&s, bins, false, s.rms, s.rms_noise);
    finish_pairs(&s, bins, true, s.mean, s.mean_noise);
    to->n_whole = count;
    to->whole_groups = copy;
    to->whole_rms = s.rms;
    to->whole_mean = s.mean;
    s.rms = s.mean = NULL;
    copy = NULL;
done:
    product_sums_free(&s);
    free(copy);
    return status;
}
