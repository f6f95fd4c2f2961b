/* hierarchical: M - I in its symmetric scaling and in a basis of multiwavelets on a tree of clusters, where
 * light between distant clusters, its further bounces and light between neighbours take few coefficients
 * (Gortler et al. 1993; Beylkin et al. 1991). */
#include "solver/base/clock.h"
#include "solver/method/choice.h"
#include "solver/method/hierarchical/hierarchical_forecast.h"
#include "solver/method/hierarchical/self_check.h"
#include "solver/method/hierarchical/wavelet_basis.h"
#include "solver/method/hierarchical/wavelet_blocks.h"
#include "solver/method/hierarchical/wavelet_entries.h"
#include "solver/method/hierarchical/wavelet_importance.h"
#include "solver/method/hierarchical/wavelet_impose.h"
#include "solver/method/hierarchical/wavelet_inverse.h"
#include "solver/method/hierarchical/wavelet_norm.h"
#include "solver/method/hierarchical/wavelet_pass.h"
#include "solver/operator/blocks/plane_tree.h"
#include "solver/operator/hierarchical.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct hierarchical_options {
    double epsilon;
    const char *receivers, *importance, *sources; /* read by whoever makes the problem */
} hierarchical_options;

static const option_row rows[] = {
    {.name = "epsilon",
     .kind = OPTION_NUMBER,
     .offset = offsetof(hierarchical_options, epsilon),
     .argument = "X",
     .preset = ".05",
     .least = 0,
     .most = 1,
     .above = true},
    {.name = "receivers",
     .kind = OPTION_TEXT,
     .offset = offsetof(hierarchical_options, receivers),
     .argument = "GROUP|sensors,...",
     .not_with = "importance",
     .help = "The groups whose light is going to be read, or all sensors: errors are kept small there, and "
             "stated for it; light elsewhere is only roughly right; --method auto then takes hierarchical"},
    {.name = "importance",
     .kind = OPTION_TEXT,
     .offset = offsetof(hierarchical_options, importance),
     .argument = "FILE",
     .help = "The same with a weight for each group or element: a .json or .npy file like an emission, such "
             "as {\"groups\": {\"desk\": 1, \"wall\": 0.2}}"},
    {.name = "sources",
     .kind = OPTION_TEXT,
     .offset = offsetof(hierarchical_options, sources),
     .argument = "GROUP|luminaires,...",
     .help = "The groups that alone are going to emit, in any way, or the luminaires: errors are kept small, "
             "and stated, for such light; answers to others are only roughly right; --method auto then takes "
             "hierarchical"},
    {0},
};

/* Coefficients below this share of the 2-norm of the sampling error are mostly noise: of sqrt(2 / rays) in a
 * closed scene of equal elements, of less in others (noise_of_rows). */
static const double share_of_noise = .055;
/* No scene counts as having less noise than this share, not even one in which nothing sees anything. */
static const double noise_least = .1;
/* The threshold of K is `of_epsilon` times epsilon. Coefficients of S are kept from the share `of_S` of it on
 * (from the whole, where the threshold is the noise), of intermediate products from `inner`, terms of
 * products from `skipped`, and of K those above `entry` in tiles, all between two nodes, above `tile`. */
typedef struct shares {
    double of_epsilon;
    float of_S, entry, tile, inner, skipped;
} shares;
static const shares shares_of_rows = {
    .of_epsilon = .02, .of_S = .5f, .entry = 1, .inner = .25f, .skipped = .004f};
/* Blocks have no noise, so that small numbers are worth keeping beside large ones, where they cost no tile of
 * their own. In Cornell boxes of 10,249 and 163,687 elements this has 10 % fewer tiles than all numbers above
 * the threshold and errs by 1 to 3 % less, in the same time. */
static const shares shares_of_blocks = {
    .of_epsilon = .004, .of_S = .5f, .inner = .5f, .tile = 1.75f, .skipped = .085f};
/* The error of a block over that share of epsilon: at 2 blocks are most of the error, .0244 of single
 * elements and .0116 of the lamp in a Cornell box of 163,687 elements. */
static const double share_of_block = 1.2;
/* Pairs of elements, whose errors are independent, take over from blocks as epsilon falls, and the threshold
 * is then most of the error: rooms, patio, atrium and a Cornell box of 1,498 to 6,003 elements err by 10 to
 * 20 % less in the same time where blocks are twice as coarse at an epsilon of .0075, and three times at
 * .002. */
static const double coarser_below = .05, coarser_power = 1. / 3;
/* Above so many elements the threshold of blocks rises like this power of their number. At one threshold the
 * numbers left out err by .0176 of single elements and .0075 of the lamp in the box of 10,249, and by .0133
 * and .0034 at 163,687, where blocks err by .020 and .0093: twice as much as in the smaller box, in which
 * most of the light between neighbours is exact. */
static const double elements_of_threshold = 1e4, growth_of_threshold = 1. / 6;
/* The rows of S that single elements shine by are as small as its Frobenius norm, and coefficients that are
 * dropped are a larger share of them. Errors go as the root of the threshold (measured: .033, .025, .017 in a
 * hemisphere of 4,489 triangles at 1, 1/2 and 1/4 of it), so that it falls with the square of the norm below
 * this one. Rooms have 6 to 15, whatever the number of elements, a sphere 1, a hemisphere .5. */
static const double norm_least = 1.5;
/* Times the radius of a node over the cube root of the threshold: the reach of the node (wavelet_reach.h).
 * The light from beyond eight radii changes no coefficient by more than a threshold of .0026, as was
 * measured. */
static const double reach = 1.2;

/* Largest error of the irradiance of uniform emission that is not corrected: over epsilon, and the error of
 * rounding. */
static const double share_corrected = .1, least_corrected = 5e-4;

/* Row sums of F. */
static void sum_rows(const csr *F, double *sums) {
    for (size_t i = 0; i < F->n; i++) {
        sums[i] = 0;
        for (uint64_t e = F->indptr[i]; e < F->indptr[i + 1]; e++) sums[i] += (double)F->data[e];
    }
}

/* The root mean square noise of a row of S, over that of a closed scene of equal elements. Rays meet j from i
 * and i from j as often as F says, so that g_ij = A_i F_ij has the variance g_ij A_i A_j / (rays (A_i +
 * A_j)), and S_ij = g_ij (A_i A_j)^-1/2 that of g_ij / (rays (A_i + A_j)): the square of the share is the
 * mean of sum_j 2 A_i F_ij / (A_i + A_j) over the rows, never more than that of their sums. Where light
 * leaves, and where small elements see large ones, there is less noise, and less light that errors are
 * relative to: the share is .52, .45 and .39 in a town of 36,267 triangles, in a part of it and in a hotel
 * room. O(entries). */
static lam_status noise_of_rows(const csr *F, const double *area, double *out, lam_error *error) {
    double sum = 0;
    double *row = memory_allocate(F->n, sizeof *row, "operator", error);
    if (row == NULL) return LAM_ERR_MEMORY;
#pragma omp parallel for schedule(dynamic, 256)
    for (size_t i = 0; i < F->n; i++)
        for (uint64_t e = F->indptr[i]; e < F->indptr[i + 1]; e++) {
            const double a = area[i], b = area[F->indices[e]];
            row[i] += 2 * a * (double)F->data[e] / (a + b);
        }
    for (size_t i = 0; i < F->n; i++) sum += row[i];
    *out = sqrt(sum / (double)F->n);
    free(row);
    return LAM_OK;
}

/* Corrects the mean error of the operator for E = 1 - rho s, whose answer is B = 1 and H = s, the row sums of
 * F, where that error is much beside epsilon: H += (s - H~) (sum_j A_j E_j) / (sum_j A_j (1 - rho_j s_j)).
 * Not with sources: most of that error is of elements that do not emit, and would be added to the light of
 * those that do. */
static lam_status correct_mean(const build_problem *problem, const double *s, double epsilon,
                               const uint32_t *order, lam_operator *op, bool *corrected, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n, C = problem->n_channels, bytes = lam_operator_work_bytes(op, 1);
    double share = 0;
    if (problem->importance != NULL && problem->importance->emits != NULL) return LAM_OK;
    double *missing = memory_allocate(C, n * sizeof *missing, "operator", error);
    double *light = memory_allocate(C, sizeof *light, "operator", error);
    float *E = memory_allocate(C, n * sizeof *E, "operator", error);
    float *H = memory_allocate(C, n * sizeof *H, "operator", error);
    void *work = memory_allocate(1, bytes, "operator", error);
    if (missing == NULL || light == NULL || E == NULL || H == NULL || work == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) {
        for (size_t c = 0; c < C; c++)
            E[c * n + i] = (float)fmax(1 - (double)problem->reflectance[c * n + i] * s[i], 0);
    }
    TRY(lam_operator_apply(op, 1, LAM_IRRADIANCE, E, H, work, bytes, error));
    for (size_t c = 0; c < C; c++) {
        double lost = 0, all = 0;
        for (size_t p = 0; p < n; p++) {
            const size_t i = order[p];
            const double d = s[i] - (double)H[c * n + i];
            missing[c * n + p] = d;
            lost += problem->area[i] * d * d;
            all += problem->area[i] * s[i] * s[i];
            light[c] += problem->area[i] * (double)E[c * n + i];
        }
        if (all > 0) share = fmax(share, sqrt(lost / all));
    }
    *corrected = share > fmax(share_corrected * epsilon, least_corrected);
    if (*corrected) TRY(operator_hierarchical_correct(op, missing, light, error));
done:
    free(missing);
    free(light);
    free(E);
    free(H);
    free(work);
    return status;
}

/* Imposes on K of a channel the answer H = s of E = 1 - rho s, s the row sums of F. Not where importance
 * makes light elsewhere only roughly right: there the mean of all elements is none of those that are read, or
 * that emit. */
static lam_status impose_uniform(const build_problem *problem, size_t c, const double *s,
                                 const plane_tree *tree, const wavelet_roots *roots, const double *area,
                                 const wavelet_inverse_input *inverse, csr *K, lam_error *error) {
    const size_t n = problem->n;
    if (inverse->tile_times != NULL) return LAM_OK;
    double *E = memory_allocate(n, sizeof *E, "operator", error);
    if (E == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < n; i++) E[i] = 1 - (double)problem->reflectance[c * n + i] * s[i];
    const lam_status status = wavelet_impose_answer(inverse->basis, roots, tree->order, area, E, s,
                                                    inverse->threshold, inverse->weight, K, error);
    free(E);
    return status;
}

/* S in the basis, on its way. */
typedef struct expansion {
    const build_problem *problem;
    const plane_tree *tree;
    const wavelets *basis;
    const wavelet_roots *roots;
    const float *weight; /* [n_nodes] */
    const double *area;  /* [n], by position */
    float threshold;     /* of S */
    double radii;        /* reach of a node */
    size_t n_threads;
    const progress *progress;
} expansion;

/* S from rows of F. row_sums: of the stream, or `sums` [n], which are set. */
static lam_status expand_rows(const expansion *x, double *sums, const double **row_sums, csr *S,
                              lam_error *error) {
    lam_status status = LAM_OK;
    row_stream *const stream = x->problem->stream;
    row_source held;
    if (stream == NULL) row_source_of_csr(&held, x->problem->F);
    const wavelet_pass_input pass = {.basis = x->basis,
                                     .rows = stream != NULL ? &stream->rows : &held,
                                     .one_sided = stream != NULL,
                                     .area = x->problem->area,
                                     .tree = x->tree,
                                     .threshold = x->threshold,
                                     .weight = x->weight,
                                     .centre = x->problem->centre,
                                     .reach = x->radii,
                                     .n_threads = x->n_threads,
                                     .progress = x->progress};
    TRY(wavelet_pass(&pass, S, error));
    *row_sums = sums;
    if (stream == NULL) {
        sum_rows(x->problem->F, sums);
        goto done;
    }
    TRY(stream->close(stream->context, row_sums, error));
    TRY(wavelet_impose_row_sums(x->basis, x->roots, x->tree->order, x->area, *row_sums, x->threshold,
                                x->weight, S, error));
done:
    return status;
}

/* S from blocks, and the row sums [n] of F, which are imposed: within a cluster the balance counts by its
 * mean and its slopes alone. */
static lam_status expand_blocks(const expansion *x, double *sums, csr *S, lam_error *error) {
    lam_status status = LAM_OK;
    const block_factors *f = x->problem->blocks;
    const wavelet_blocks_input input = {.blocks = f,
                                        .basis = x->basis,
                                        .threshold = x->threshold,
                                        .weight = x->weight,
                                        .n_threads = x->n_threads,
                                        .progress = x->progress};
    double *ones = memory_allocate(f->n, sizeof *ones, "operator", error);
    double *product = memory_allocate(f->n, sizeof *product, "operator", error);
    if (ones == NULL || product == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t p = 0; p < f->n; p++) ones[p] = 1;
    TRY(block_factors_multiply(f, 1, ones, product, error));
    for (size_t p = 0; p < f->n; p++) sums[f->order[p]] = product[p];
    TRY(wavelet_blocks(&input, S, error));
    TRY(wavelet_impose_row_sums(x->basis, x->roots, x->tree->order, x->area, sums, x->threshold, x->weight, S,
                                error));
done:
    free(ones);
    free(product);
    return status;
}

/* The threshold over epsilon: by the norm of S where F has no noise, and of rows by `planes`, the share by
 * the elements per plane, if that is less. Rows of rays have a norm by their noise, too: noise_of_rows lowers
 * their threshold. */
static lam_status threshold_share(const build_problem *problem, double planes, double *out,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    double norm = INFINITY;
    if (problem->blocks != NULL)
        TRY(wavelet_norm_of_blocks(problem->blocks, &norm, error));
    else if (problem->stream == NULL && problem->noise == 0)
        norm = wavelet_norm_of_rows(problem->F, problem->area);
    *out = norm > 0 ? fmin(norm * norm / (norm_least * norm_least), 1) : 1;
    if (problem->blocks == NULL)
        *out = fmin(*out, planes) * shares_of_rows.of_epsilon;
    else
        *out *= shares_of_blocks.of_epsilon *
                pow(fmax(1, (double)problem->n / elements_of_threshold), growth_of_threshold);
done:
    return status;
}

/* The threshold of K at an epsilon, and the least one, below which coefficients are noise. planes: as of
 * threshold_share. */
static lam_status find_threshold(const build_problem *problem, double planes, double epsilon, double *least,
                                 double *threshold, lam_error *error) {
    lam_status status = LAM_OK;
    double of_epsilon, noise = 1; /* over that of a closed scene of equal elements */
    TRY(threshold_share(problem, planes, &of_epsilon, error));
    if (problem->noise > 0 && problem->F != NULL)
        TRY(noise_of_rows(problem->F, problem->area, &noise, error));
    if (problem->stream != NULL && problem->stream->noise_share > 0) noise = problem->stream->noise_share;
    noise = fmax(noise, noise_least);
    *least = noise * planes * share_of_noise * problem->noise;
    *threshold = fmax(noise * of_epsilon * epsilon, *least);
done:
    return status;
}

/* Figures of a build, for its report. */
typedef struct build_figures {
    double threshold, entries, numbers_of_S; /* coefficients of all K, and of S */
    size_t n_own, n_nodes, n_shapes;
    bool corrected;
} build_figures;

/* The number of channels that no earlier one is like, and the last of them. */
static size_t own_channels(const build_problem *problem, size_t *last) {
    size_t count = 0;
    for (size_t c = 0; c < problem->n_channels; c++)
        if (operator_like_channel(problem->n, problem->reflectance, c) == c) count++, *last = c;
    return count;
}

/* Says how the operator was made, and how large it came out. */
static void describe_build(const build_problem *problem, const plane_tree *tree, const wavelet_roots *roots,
                           const build_figures *f, build_report *report) {
    const double n = (double)problem->n;
    snprintf(
        report->detail, sizeof report->detail,
        "threshold %.2g by %s, %.3g stored coefficients per element (%.3g of S), %zu planes, %zu clusters "
        "of %zu shapes, %zu part%s%s%s",
        f->threshold, report->by_noise ? "the noise of the rays" : "--epsilon",
        f->entries / (n * (double)f->n_own), f->numbers_of_S / n, tree->n_frames, f->n_nodes, f->n_shapes,
        roots->count, roots->count == 1 ? "" : "s that exchange no light",
        f->n_own < problem->n_channels ? ", equal channels share them" : "",
        f->corrected ? "; the mean error of uniform emission is corrected" : "");
}

static lam_status build(const build_problem *problem, const build_options *options, const void *own,
                        lam_operator **op, build_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n, C = problem->n_channels, n_threads = (size_t)omp_get_max_threads();
    const double started = clock_seconds(), epsilon = ((const hierarchical_options *)own)->epsilon;
    const shares *const share = problem->blocks != NULL ? &shares_of_blocks : &shares_of_rows;
    plane_tree made_tree = {.n = 0};
    const plane_tree *const tree = problem->blocks != NULL ? problem->blocks->tree : &made_tree;
    hierarchical_arrays arrays = {.K = memory_allocate(C, sizeof *arrays.K, "operator", error)};
    wavelet_inverse_report inverted = {.doublings = 0};
    wavelet_importance important = {.times = NULL};
    wavelet_roots roots = {.count = 0};
    csr S = {.n = 0};
    lam_operator *made = NULL;
    float *weight = NULL, *rho = memory_allocate(n, sizeof *rho, "operator", error);
    double *area = memory_allocate(n, sizeof *area, "operator", error), entries = 0;
    double *sums = memory_allocate(n, sizeof *sums, "operator", error);
    const double *row_sums = sums;
    double planes = 1, least, threshold;
    if (arrays.K == NULL || rho == NULL || area == NULL || sums == NULL) TRY(LAM_ERR_MEMORY);
    if (problem->blocks == NULL) {
        TRY(wavelet_tree_make(n, problem->F, problem->stream != NULL ? problem->stream->part : NULL,
                              problem->centre, problem->normal, problem->corners, &made_tree, error));
        planes = hierarchical_share_of_planes((double)n, (double)tree->n_frames);
    }
    TRY(find_threshold(problem, planes, epsilon, &least, &threshold, error));
    TRY(wavelet_basis_make(tree, problem->area, problem->centre, &arrays.basis, error));
    TRY(wavelet_roots_make(tree, &arrays.basis, &roots, error));
    TRY(wavelets_weights(&arrays.basis, &weight, error));
    if (problem->importance != NULL)
        TRY(wavelet_importance_make(problem->importance, problem->area, tree, weight, &important, error));
    TRY(hierarchical_steps(&arrays.basis, threshold, &arrays.step, error));
    for (size_t p = 0; p < n; p++) area[p] = problem->area[tree->order[p]];
    const expansion x = {.problem = problem,
                         .tree = tree,
                         .basis = &arrays.basis,
                         .roots = &roots,
                         .weight = weight,
                         .area = area,
                         .threshold = (float)threshold * (threshold > least ? share->of_S : 1),
                         .radii = reach / cbrt(threshold),
                         .n_threads = n_threads,
                         .progress = options->progress};
    TRY(problem->blocks != NULL ? expand_blocks(&x, sums, &S, error)
                                : expand_rows(&x, sums, &row_sums, &S, error));
    const double expanded = clock_seconds(), numbers_of_S = (double)S.indptr[n];
    report_step_add(report, problem->stream != NULL ? "rays, wavelets" : "wavelets", expanded - started);
    size_t last = 0;
    const size_t n_own = own_channels(problem, &last);
    for (size_t c = 0; c < C; c++) {
        if (operator_like_channel(n, problem->reflectance, c) != c) continue;
        for (size_t p = 0; p < n; p++) rho[p] = problem->reflectance[c * n + tree->order[p]];
        const wavelet_inverse_input inverse = {.basis = &arrays.basis,
                                               .S = &S,
                                               .last = c == last,
                                               .rho = rho,
                                               .weight = weight,
                                               .threshold = (float)threshold,
                                               .entry = share->entry,
                                               .tile = share->tile,
                                               .tile_times = important.times,
                                               .tile_read = important.read,
                                               .tile_emits = important.emits,
                                               .inner = share->inner,
                                               .skipped = share->skipped,
                                               .n_threads = n_threads,
                                               .progress = options->progress};
        TRY(wavelet_inverse(&inverse, &arrays.K[c], &inverted, error));
        TRY(impose_uniform(problem, c, row_sums, tree, &roots, area, &inverse, &arrays.K[c], error));
        entries += (double)arrays.K[c].indptr[n];
    }
    build_figures figures = {
        threshold, entries, numbers_of_S, n_own, arrays.basis.n_nodes, arrays.basis.n_shapes, false};
    TRY(operator_hierarchical_create(n, C, problem->reflectance, area, tree->order, &arrays, &made, error));
    lam_operator_set_threads(made, n_threads);
    /* Light in proportion to the mean of several parts would not stay in its own. */
    if (roots.count <= 1 + (size_t)(tree->n_alone > 0))
        TRY(correct_mean(problem, row_sums, epsilon, tree->order, made, &figures.corrected, error));
    report_number(report, "threshold", threshold);
    report->by_noise = !(threshold > least);
    report_step_add(report, "invert", clock_seconds() - expanded);
    describe_build(problem, tree, &roots, &figures, report);
    TRY(self_check(problem, row_sums, made, epsilon, options->seed, report, error));
    *op = made;
    made = NULL;
done:
    lam_operator_close(made);
    csr_free(&S);
    hierarchical_arrays_free(&arrays, C);
    plane_tree_free(&made_tree);
    wavelet_importance_free(&important);
    wavelet_roots_free(&roots);
    free(weight);
    free(rho);
    free(area);
    free(sums);
    return status;
}

static void forecast(const method_scale *scale, const void *own, method_forecast *out) {
    hierarchical_forecast(scale, ((const hierarchical_options *)own)->epsilon, out);
}

static double block_accuracy(const void *own) {
    const double epsilon = ((const hierarchical_options *)own)->epsilon;
    const double coarser = pow(fmax(coarser_below / epsilon, 1), coarser_power);
    return share_of_block * coarser * shares_of_blocks.of_epsilon * epsilon;
}

/* The cost of an answer's transforms per element; a coefficient costs as much as a sparse entry. */
static const double transform_cost = 40;

/* Nothing cheaper than building it tells how many coefficients there are. */
static lam_status weigh(const decision *so_far, void *own, candidate *out, lam_error *error) {
    lam_status status = LAM_OK;
    const hierarchical_options *o = own;
    const build_problem *p = so_far->problem;
    const double n = (double)p->n;
    operator_description about;
    out->object = "hierarchical";
    if (o->receivers != NULL || o->importance != NULL || o->sources != NULL) {
        out->claim = CLAIM_INPUT;
        snprintf(out->found, sizeof out->found, "no other method knows %s",
                 o->receivers != NULL    ? "--receivers"
                 : o->importance != NULL ? "--importance"
                                         : "--sources");
        return LAM_OK;
    }
    if (so_far->asked != NULL) return LAM_OK;
    if (p->F == NULL) {
        out->open = true;
        out->claim = CLAIM_USUAL;
        if (p->stream != NULL)
            snprintf(out->found, sizeof out->found,
                     "too large for the whole inverse, too noisy for a sparse one");
        if (p->blocks != NULL) snprintf(out->found, sizeof out->found, "the form factors are blocks");
        return LAM_OK;
    }
    if (p->centre == NULL || p->normal == NULL || (decision_claimed(so_far) && !so_far->thorough))
        return LAM_OK;
    TRY(method_build(out->method, p, so_far->options, own, &out->op, &out->built, error));
    operator_describe(out->op, &about);
    candidate_figure(out, "numbers", about.density * n);
    snprintf(out->found, sizeof out->found, "%.3g coefficients per element at epsilon %.3g",
             about.density * n, o->epsilon);
    if (so_far->options->memory == 0 || lam_operator_bytes(out->op) <= so_far->options->memory)
        out->cost = (CHOICE_SCATTERED * about.density * n + transform_cost) * n;
done:
    return status;
}

const build_method method_hierarchical = {
    .name = "hierarchical",
    .summary = "wavelets on a tree of clusters; most scenes",
    .kind = &operator_hierarchical,
    .rows = rows,
    .flags = METHOD_GEOMETRY | METHOD_STREAMS | METHOD_BLOCKS | METHOD_FILTERS_NOISE | METHOD_KEEPS_EPSILON |
             METHOD_READS,
    .forecast = forecast,
    .weigh = weigh,
    .block_accuracy = block_accuracy,
    .build = build,
};
