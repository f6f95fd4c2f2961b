/* How many levels of the hierarchical factorization are fastest: eqs. 3.16 to 3.19 of the thesis, with the
 * compression that samples of the matrix show in place of one guess for all levels. */
#include "solver/build/hf.h"

#include <math.h>
#include <stdlib.h>

/* Columns of a sample: at most SAMPLE, and no more than the part of all that may be read twice; how often it
 * is halved. */
enum { SAMPLE = 512, SAMPLE_LEAST = 64, SAMPLE_PART = 20, HALVINGS = 3, PLACES = 2, SIZES = HALVINGS + 1 };
/* Leaves have no fewer and no more columns than these, or the eigenvectors of one cost more than all. */
enum { LEAF_LEAST = 64, LEAF_MOST = 8192 };

/* What one core does in a second, about: products of BLAS (flops, two a product), scattered products of
 * sparse rows, and the cube of the columns whose eigenvectors are found. Only ratios decide. */
static const double blas_rate = 9e10, scatter_rate = 1e9, axpy_rate = 8e9, eigen_rate = 1e10;

/* A row with more entries than this share of the columns is spread out (tsvd.c). */
static const double spread_above = 1. / 5;

struct hf_forecast {
    size_t sizes[SIZES];                  /* columns, falling by halves; 0: none */
    double values[PLACES][SIZES][SAMPLE]; /* squares of the singular values, ascending */
    double entries;                       /* of a row that has any in the largest sample, mean */
    double filled;                        /* share of such rows */
};

lam_status hf_forecast_create(const scaled_matrix *S, hf_forecast **out, lam_error *error) {
    lam_status status = LAM_OK;
    sparse_block block = {0};
    size_t filled = 0, entries = 0;
    hf_forecast *f = memory_allocate(1, sizeof *f, "factorization", error);
    if (f == NULL) return LAM_ERR_MEMORY;
    size_t most = S->n / SAMPLE_PART;
    if (most > SAMPLE) most = SAMPLE;
    if (most < SAMPLE_LEAST) most = S->n < SAMPLE_LEAST ? S->n : SAMPLE_LEAST;
    for (size_t k = 0; k < SIZES && most >> k > 0; k++) f->sizes[k] = most >> k;
    for (size_t place = 0; place < PLACES; place++) {
        const size_t first = (S->n - most) * (2 * place + 1) / (2 * PLACES);
        TRY(scaled_block(S, first, first + most, &block, error));
        for (size_t k = 0; k < SIZES && f->sizes[k] > 0; k++)
            TRY(tsvd_values(&block, f->sizes[k], f->values[place][k], error));
        for (size_t i = 0; i < S->n; i++) filled += block.indptr[i + 1] > block.indptr[i];
        entries += block.indptr[S->n];
        sparse_block_free(&block);
    }
    f->filled = (double)filled / (double)(PLACES * S->n);
    f->entries = filled > 0 ? (double)entries / (double)filled : 0;
    *out = f;
    f = NULL;
done:
    sparse_block_free(&block);
    free(f);
    return status;
}

void hf_forecast_free(hf_forecast *f) {
    free(f);
}

/* Columns kept of sample size k, mean of the places. */
static double sample_rank(const hf_forecast *f, size_t k, double p) {
    const truncation keep = {.norm = TRUNCATION_SPECTRAL, .epsilon = p, .round = 1};
    double sum = 0;
    for (size_t place = 0; place < PLACES; place++)
        sum += (double)truncation_rank(&keep, f->sizes[k], f->values[place][k]);
    return sum / PLACES;
}

double hf_forecast_rank(const hf_forecast *f, double m, double p) {
    size_t k = 0;
    while (k + 1 < SIZES && f->sizes[k + 1] > 0 && (double)f->sizes[k + 1] >= m) k++;
    const double known = (double)f->sizes[k], rank = fmax(1, sample_rank(f, k, p));
    if (k + 1 >= SIZES || f->sizes[k + 1] == 0) return fmin(m, rank * fmin(1, m / known));
    /* rank ~ m^b between the two sizes, and on from the largest. */
    const double half = fmax(1, sample_rank(f, k + 1, p));
    const double b = fmin(1, fmax(0, log(rank / half) / log(known / (double)f->sizes[k + 1])));
    return fmin(m, rank * pow(m / known, b));
}

/* Eigenvectors of a Gram matrix of c columns of which r are kept: all of them, or, where they are few, four
 * products with twice as many vectors and, before, one attempt with half of those (gram_leading). */
static double seconds_of_eigenvectors(double c, double r) {
    const double all = c * c * c / eigen_rate, few = 2 * c * c * 3 * r * 4 / blas_rate;
    return 2 * r < c / 3 && few < all ? few : all;
}

/* A truncated SVD of n x c, kept r, of dense columns. */
static double seconds_of_node(double n, double c, double r) {
    return (n * c * c + 2 * n * c * r) / blas_rate + seconds_of_eigenvectors(c, r);
}

static double seconds_of_leaf(const hf_forecast *f, double n, double m, double r) {
    const double entries = f->entries * m / (double)f->sizes[0], rows = f->filled * n;
    if (entries > spread_above * m) return seconds_of_node(rows, m, r);
    return rows * (entries * entries / 2 / scatter_rate + entries * r / axpy_rate) +
           seconds_of_eigenvectors(m, r);
}

double hf_forecast_seconds(const hf_forecast *f, size_t n, const factorizer_options *options,
                           const hf_plan *plan) {
    double p[BUDGET_LEVELS_MOST + 1], seconds = 0, kept = 0;
    const int levels = plan->levels;
    const budget shared = {.rule = options->budget.rule,
                           .alpha = options->budget.alpha,
                           .ratio = plan->ratio,
                           .leaf = plan->leaf};
    budget_share(&shared, options->epsilon, levels, p);
    for (int l = levels; l >= 0; l--) {
        const double m = ldexp((double)n, -l), nodes = ldexp(1, l), given = l == levels ? m : 2 * kept;
        const double rank = options->rank > 0 ? (double)options->rank : hf_forecast_rank(f, m, p[l]);
        kept = fmin(given, rank);
        seconds +=
            nodes * (l == levels ? seconds_of_leaf(f, (double)n, m, kept)
                                 : seconds_of_node((double)n, given, kept) + m * given * kept / blas_rate);
    }
    return seconds;
}

hf_plan hf_forecast_plan(const hf_forecast *f, size_t n, const factorizer_options *options) {
    /* Falling shares suit a spectrum that falls; much for the leaves keeps them above the noise of rays. */
    static const double ratios[] = {.5, .7, 1}, leaves[] = {0, .3, .5, .7, .9};
    enum { RATIOS = sizeof ratios / sizeof *ratios, LEAVES = sizeof leaves / sizeof *leaves };
    hf_plan best = {.ratio = .5};
    double least = INFINITY;
    for (int levels = 0; levels <= BUDGET_LEVELS_MOST; levels++) {
        const size_t columns = n >> levels;
        if (options->levels >= 0 && levels != options->levels) continue;
        if (options->levels < 0 && levels > 0 && columns < LEAF_LEAST) break;
        if (options->levels < 0 && columns > LEAF_MOST) continue;
        for (size_t k = 0; k < RATIOS * LEAVES; k++) {
            const hf_plan plan = {.levels = levels, .ratio = ratios[k % RATIOS], .leaf = leaves[k / RATIOS]};
            const double seconds = hf_forecast_seconds(f, n, options, &plan);
            if (seconds >= least) continue;
            least = seconds;
            best = plan;
        }
    }
    return best;
}
