/* Chooses the levels of the hierarchical factorization by forecast time: Aguerre 2016, eqs. 3.16 to 3.19,
 * with the compression measured on samples of the matrix in place of one rho for all levels. */
#include "solver/method/low_rank/hf.h"

#include <math.h>
#include <stdlib.h>

/* A sample has at most SAMPLE columns and at most n / SAMPLE_PART, as they are read twice. It is taken at
 * PLACES places and halved HALVINGS times. */
enum { SAMPLE = 512, SAMPLE_LEAST = 64, SAMPLE_PART = 20, HALVINGS = 3, PLACES = 6, SIZES = HALVINGS + 1 };
/* Least and most columns of a leaf: below these the eigenvectors of nodes dominate, and beyond these their
 * work area is beyond LAPACK's integers (eigen.c). */
enum { LEAF_LEAST = 64, LEAF_MOST = 32766 };

/* Rates of one core per second: flops of BLAS, scattered products of sparse rows, flops of adding scaled
 * rows, and cubed columns of eigenvector problems. Only their ratios matter. */
static const double blas_rate = 9e10, scatter_rate = 1e9, axpy_rate = 8e9, eigen_rate = 1e10;

/* A row with a larger share of entries is expanded (tsvd.c). */
static const double spread_above = 1. / 5;

struct hf_forecast {
    size_t n;                             /* rows of S */
    size_t sizes[SIZES];                  /* columns, falling by halves; 0: none */
    double values[PLACES][SIZES][SAMPLE]; /* squares of the singular values, ascending */
    double entries;                       /* of a row that has any in the largest sample, mean */
    double filled;                        /* share of such rows */
    double noise, edge;                   /* sampling noise, see find_noise; 0: none found */
};

/* Sampling noise is independent between columns and of equal norm: the singular values of m columns of noise
 * form a plateau at that norm, while those of smooth transport fall. noise is the height of the plateau;
 * singular values above edge, the upper eighth, are attributed to transport. */
static void find_noise(hf_forecast *f) {
    enum { STEEP = 2 };
    const size_t m = f->sizes[0];
    for (size_t place = 0; place < PLACES; place++) {
        const double *values = f->values[place][0], low = values[m / 8], middle = values[m / 2];
        if (!(low > 0) || middle > STEEP * low) {
            f->noise = f->edge = 0;
            return;
        }
        f->noise += sqrt(values[m / 4]) / PLACES;
        f->edge += sqrt(values[m - 1 - m / 8]) / PLACES;
    }
}

lam_status hf_forecast_create(const scaled_matrix *S, hf_forecast **out, lam_error *error) {
    lam_status status = LAM_OK;
    sparse_block block = {0};
    size_t filled = 0, entries = 0;
    hf_forecast *f = memory_allocate(1, sizeof *f, "factorization", error);
    if (f == NULL) return LAM_ERR_MEMORY;
    f->n = S->n;
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
    find_noise(f);
    f->filled = (double)filled / (double)(PLACES * S->n);
    f->entries = filled > 0 ? (double)entries / (double)filled : 0;
    *out = f;
    f = NULL;
done:
    sparse_block_free(&block);
    free(f);
    return status;
}

/* Entries of a column, mean. */
static double column_entries(const hf_forecast *f) {
    return f->entries * f->filled * (double)f->n / (double)f->sizes[0];
}

void hf_forecast_free(hf_forecast *f) {
    free(f);
}

/* Rank of a sample of size number k at p, mean over places. */
static double sample_rank(const hf_forecast *f, size_t k, double p) {
    size_t sum = 0;
    for (size_t place = 0; place < PLACES; place++) {
        const double *values = f->values[place][k];
        size_t low = 0, high = f->sizes[k]; /* values[low-1] < p^2 <= values[high] */
        while (low < high) {
            const size_t middle = (low + high) / 2;
            if (values[middle] >= p * p)
                high = middle;
            else
                low = middle + 1;
        }
        sum += f->sizes[k] - low;
    }
    return (double)sum / PLACES;
}

/* The largest b in rank ~ m^b: transport between neighbours across edges has high rank, in proportion to the
 * number of edges. */
static const double steepest = 1;

/* The number of singular values of transport without noise, of m columns, above p. */
static double rank_of_light(const hf_forecast *f, double m, double p) {
    size_t least = 0, k = 0;
    while (least + 1 < SIZES && f->sizes[least + 1] > 0) least++;
    while (k < least && (double)f->sizes[k + 1] >= m) k++;
    const double known = (double)f->sizes[k], rank = fmax(1, sample_rank(f, k, p));
    if (m <= known) return rank * m / known;
    /* The exponent is fitted over all sizes, as places differ more than one halving does. */
    const double low = fmax(1, sample_rank(f, least, p));
    const double b = k < least ? log(rank / low) / log(known / (double)f->sizes[least]) : 1;
    return rank * pow(m / known, fmin(steepest, fmax(0, b)));
}

/* The number of singular values of noise, of m columns, above p: the plateau widens as 1 + sqrt(m/n)
 * (Marchenko and Pastur 1967). */
static double rank_of_noise(const hf_forecast *f, double m, double p) {
    const double n = (double)f->n, known = (double)f->sizes[0];
    const double here = p * (1 + sqrt(known / n)) / (1 + sqrt(m / n));
    if (here >= f->edge) return 0;
    return m * (sample_rank(f, 0, here) - sample_rank(f, 0, f->edge)) / known;
}

double hf_forecast_rank(const hf_forecast *f, double m, double p) {
    return fmin(m, rank_of_light(f, m, fmax(p, f->edge)) + rank_of_noise(f, m, p));
}

/* The rank of a node whose halves were truncated before. The noise in the columns that they kept adds to the
 * square of each singular value. */
static double rank_of_node(const hf_forecast *f, double m, double given, double p) {
    const double light = p * p - f->noise * f->noise;
    return light > 0 ? fmin(given, rank_of_light(f, m, sqrt(light))) : given;
}

/* True if r eigenvectors of a Gram matrix of c columns are so few that gram_leading finds them. */
static bool are_few(double c, double r) {
    return 2 * r < c / 3;
}

/* Eigenvectors of a Gram matrix of c columns, r of which are kept: all of them, or, if they are few, four
 * products with 2 r vectors after one attempt with r (gram_leading). */
static double seconds_of_eigenvectors(double c, double r) {
    const double all = c * c * c / eigen_rate, few = 2 * c * c * 3 * r * 4 / blas_rate;
    return are_few(c, r) && few < all ? few : all;
}

/* A truncated SVD of dense n x c to rank r. */
static double seconds_of_node(double n, double c, double r) {
    return (n * c * c + 2 * n * c * r) / blas_rate + seconds_of_eigenvectors(c, r);
}

static double seconds_of_leaf(const hf_forecast *f, double n, double m, double r) {
    const double entries = f->entries * m / (double)f->sizes[0], rows = f->filled * n;
    if (entries > spread_above * m) return seconds_of_node(rows, m, r);
    return rows * (entries * entries / 2 / scatter_rate + entries * r / axpy_rate) +
           seconds_of_eigenvectors(m, r);
}

double hf_forecast_seconds(const hf_forecast *f, const factorizer_options *options, hf_plan *plan) {
    const double n = (double)f->n;
    double seconds = 0, below = 0;
    const int levels = plan->levels;
    for (int l = levels; l >= 0; l--) {
        const double m = ldexp(n, -l), nodes = ldexp(1, l), given = l == levels ? m : 2 * below;
        plan->kept[l] = below = given;
        if (l > 0 && l < levels && plan->left[l] <= 0 && !plan->every) continue; /* no nodes */
        const double rank = options->rank > 0 ? (double)options->rank
                            : l == levels     ? hf_forecast_rank(f, m, plan->left[l])
                                              : rank_of_node(f, m, given, plan->left[l]);
        const double kept = fmin(given, rank);
        seconds += nodes * (l == levels ? seconds_of_leaf(f, n, m, kept)
                                        : seconds_of_node(n, given, kept) + m * given * kept / blas_rate);
        plan->kept[l] = below = kept;
    }
    return seconds;
}

int hf_plan_below(const hf_plan *plan, int level) {
    do level++;
    while (level < plan->levels && plan->left[level] <= 0 && !plan->every);
    return level < plan->levels ? level : plan->levels;
}

/* A Gram matrix of c columns in single precision, r or all of its eigenvectors, and the work area for them:
 * three times 5/4 r vectors and two small matrices in double, or that of LAPACK's syevd. */
static double bytes_of_eigenvectors(double c, double r) {
    const double w = 1.25 * r;
    return sizeof(float) * (are_few(c, r) ? c * c + 3 * c * w + 8 * w * w : 3 * c * c + c * r);
}

/* A leaf of m columns that keeps r: its columns twice while they are put in order; then once, beside the
 * tiles of its rows (gram.c), a panel and the eigenvectors; then beside its result. */
static double bytes_of_leaf(const hf_walk *walk, double m, double r) {
    enum { ENTRY = sizeof(float) + sizeof(uint32_t), PANEL = 1024, TILE = 256 };
    const double n = (double)walk->n, block = m * walk->entries * ENTRY + 8 * n;
    const double gram = 8 * n * (m / TILE + 2) + 4 * PANEL * m + bytes_of_eigenvectors(m, r);
    return block + fmax(fmax(block, gram), 4 * (n + m) * r + 4 * PANEL * m);
}

/* Nodes whose children stand two levels or more below them have more than two. */
double hf_plan_bytes(const hf_plan *plan, const hf_walk *walk, int level) {
    const double n = (double)walk->n, m = ldexp(n, -level), r = plan->kept[level];
    if (level >= plan->levels) return bytes_of_leaf(walk, m, r);
    const int below = hf_plan_below(plan, level);
    const double count = ldexp(1, below - level), given = count * plan->kept[below];
    const double one = 4 * (n + ldexp(n, -below)) * plan->kept[below]; /* Q and V of a child */
    const int shared = below - (walk->alone > level ? walk->alone : level);
    const double at_once = shared > 0 ? fmin(walk->threads, ldexp(1, shared)) : 1;
    hf_walk theirs = *walk;
    theirs.threads = ceil(walk->threads / at_once);
    const double children = (count - at_once) * one + at_once * hf_plan_bytes(plan, &theirs, below);
    /* Q takes the place of those of the children (tsvd_joined). */
    const double join = count * one + 4 * TSVD_JOINED * given + bytes_of_eigenvectors(given, r);
    const double V = 4 * (n * r + m * (r + plan->kept[below])); /* in place of the children's, one by one */
    return fmax(children, fmax(join, V));
}

/* Moves a part of the budget from one level to another if that is forecast to be faster; true if it is. */
static bool move(const hf_forecast *f, const factorizer_options *options, int from, int to, double part,
                 budget *shares, hf_plan *plan, double *seconds) {
    budget tried = *shares;
    hf_plan other = *plan;
    tried.part[from] = part < tried.part[from] ? tried.part[from] - part : 0;
    tried.part[to] += shares->part[from] - tried.part[from];
    budget_share(&tried, options->epsilon, plan->levels, other.left);
    const double takes = hf_forecast_seconds(f, options, &other);
    if (takes > .999 * *seconds) return false;
    *seconds = takes;
    *shares = tried;
    *plan = other;
    return true;
}

/* Moves parts of the budget between levels, large ones first, as long as that is faster. seconds is the time
 * of the given shares; returns the time of the improved ones. */
static double improve(const hf_forecast *f, const factorizer_options *options, budget *shares, hf_plan *plan,
                      double seconds) {
    static const double steps[] = {1, .3, .1, .03};
    enum { STEPS = sizeof steps / sizeof *steps, ROUNDS = 8 };
    for (size_t s = 0; s < STEPS; s++)
        for (int round = 0, better = 1; round < ROUNDS && better; round++) {
            better = 0;
            for (int from = 1; from <= plan->levels; from++)
                for (int to = 1; to <= plan->levels; to++)
                    if (from != to && shares->part[from] > 0)
                        better |= move(f, options, from, to, steps[s], shares, plan, &seconds);
        }
    return seconds;
}

/* Tries some divisions of the budget among the levels of plan; returns the time of the best. */
static double divide(const hf_forecast *f, const factorizer_options *options, budget *shares, hf_plan *plan) {
    static const double ratios[] = {.5, 1}, leaves[] = {0, .5, .9};
    enum { RATIOS = sizeof ratios / sizeof *ratios, LEAVES = sizeof leaves / sizeof *leaves };
    double least = INFINITY;
    const int levels = plan->levels;
    for (size_t k = 0; k < RATIOS * LEAVES; k++) {
        budget tried = {.alpha = options->budget.alpha};
        hf_plan other = {.levels = levels, .every = plan->every};
        budget_divide(&tried, levels, ratios[k % RATIOS], leaves[k / RATIOS]);
        budget_share(&tried, options->epsilon, levels, other.left);
        const double seconds = hf_forecast_seconds(f, options, &other);
        if (seconds >= least) continue;
        least = seconds;
        *shares = tried;
        *plan = other;
    }
    return least;
}

hf_plan hf_forecast_plan(const hf_forecast *f, const factorizer_options *options) {
    /* A division this much slower than the best of another number of levels is not improved. */
    static const double hopeless = 3;
    const bool shared = budget_divided(&options->budget);
    const hf_walk walk = {.n = f->n, .entries = column_entries(f), .alone = BUDGET_LEVELS_MOST, .threads = 1};
    const double most = options->memory > 0 ? (double)options->memory : INFINITY;
    hf_plan best = {.levels = 0};
    double least = INFINITY, fewest = INFINITY; /* seconds, bytes */
    for (int levels = 0; levels <= BUDGET_LEVELS_MOST; levels++) {
        const size_t columns = f->n >> levels;
        if (options->levels >= 0 && levels != options->levels) continue;
        if (options->levels < 0 && levels > 0 && columns < LEAF_LEAST) break;
        if (options->levels < 0 && columns > LEAF_MOST) continue;
        hf_plan plan = {.levels = levels, .every = options->rank > 0};
        budget shares = options->budget;
        double seconds;
        if (shared) {
            budget_share(&shares, options->epsilon, levels, plan.left);
            seconds = hf_forecast_seconds(f, options, &plan);
        } else {
            seconds = divide(f, options, &shares, &plan);
            if (fewest > most || seconds < hopeless * least)
                seconds = improve(f, options, &shares, &plan, seconds);
        }
        const double bytes = hf_plan_bytes(&plan, &walk, 0);
        const bool better = bytes > most ? bytes < fewest : fewest > most || seconds < least;
        if (!better) continue;
        least = seconds;
        fewest = bytes;
        best = plan;
    }
    return best;
}
