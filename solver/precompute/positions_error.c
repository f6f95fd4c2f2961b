/* The errors of the positions of a light and of mixtures of them, from the covariance of the walks. */
#include "solver/base/random.h"
#include "solver/precompute/stages.h"
#include "store/groups.h"

#include <math.h>
#include <stdlib.h>

enum { MIXTURES = 64 };

/* True where nothing reflects: figures are those of the irradiance then. */
static bool is_black(const mesh *m) {
    for (size_t k = 0; k < m->n * m->n_channels; k++)
        if (m->reflectance[k] > 0) return false;
    return true;
}

/* Squared norms of mixtures with weights w: w' M w, channels stacked. */
typedef struct norms {
    size_t s;
    const double *covariance;      /* [s][s] */
    double *radiosity, *reflected; /* [s][s], of B and of B - rho H0 */
} norms;

static double square(const double *M, size_t s, const double *w) {
    double sum = 0;
    for (size_t j = 0; j < s; j++) {
        double row = 0;
        for (size_t l = 0; l < s; l++) row += M[j * s + l] * w[l];
        sum += w[j] * row;
    }
    return sum;
}

/* The error over the light without it, which is in the light that the walks found. */
static double ratio(double error2, double light2) {
    return error2 > 0 ? sqrt(error2 / fmax(light2 - error2, 0)) : 0;
}

static void measure(const norms *of, const double *w, double *relative, double *indirect) {
    const double error2 = square(of->covariance, of->s, w);
    *relative = ratio(error2, square(of->radiosity, of->s, w));
    *indirect = ratio(error2, square(of->reflected, of->s, w));
}

static void figures_take(double x, size_t count, error_figures *f) {
    f->mean += x / (double)count;
    f->std += x * x / (double)count;
    f->max = fmax(f->max, x);
}

static void figures_close(error_figures *f) {
    f->std = sqrt(fmax(0, f->std - f->mean * f->mean));
}

/* A standard error from so many batches is itself off by this part. */
static double own_noise(const error_figures *f, size_t probes) {
    return f->mean / sqrt(2. * (WALK_BATCHES - 1) * (double)probes);
}

static void measure_all(const norms *of, uint64_t seed, double *w, double *relative, double *indirect,
                        error_report *out) {
    const size_t s = of->s;
    error_group *single = &out->single, *lights = &out->lights, *random = &out->random;
    for (size_t j = 0; j < s; j++) {
        for (size_t l = 0; l < s; l++) w[l] = l == j;
        measure(of, w, &relative[j], &indirect[j]);
        figures_take(relative[j], s, &single->total_relative);
        figures_take(indirect[j], s, &single->total_indirect);
    }
    for (size_t l = 0; l < s; l++) w[l] = 1;
    measure(of, w, &lights->total_relative.mean, &lights->total_indirect.mean);
    lights->total_relative.max = lights->total_relative.mean;
    lights->total_indirect.max = lights->total_indirect.mean;
    for (size_t k = 0; k < MIXTURES; k++) {
        double x, y;
        for (size_t l = 0; l < s; l++) w[l] = random_unit(&seed);
        measure(of, w, &x, &y);
        figures_take(x, MIXTURES, &random->total_relative);
        figures_take(y, MIXTURES, &random->total_indirect);
    }
    error_group *const groups[] = {single, lights, random};
    const size_t probes[] = {s, 1, MIXTURES};
    for (size_t g = 0; g < 3; g++) {
        groups[g]->probes = probes[g];
        groups[g]->probes_noise = -1;
        if (probes[g] > 1) figures_close(&groups[g]->total_relative);
        if (probes[g] > 1) figures_close(&groups[g]->total_indirect);
        groups[g]->reference_noise = own_noise(&groups[g]->total_indirect, 1);
    }
    out->has_total = true;
}

/* M [s][s] += the products of rows x [s][n], weighted by A. */
static void add_products(size_t s, size_t n, const double *area, const float *x, double *M) {
#pragma omp parallel for schedule(dynamic)
    for (size_t j = 0; j < s; j++)
        for (size_t l = 0; l <= j; l++) {
            double sum = 0;
            for (size_t i = 0; i < n; i++) sum += area[i] * (double)x[j * n + i] * (double)x[l * n + i];
            M[j * s + l] += sum;
            if (l != j) M[l * s + j] += sum;
        }
}

lam_status walked_judge(const precompute_job *job, const precompute_scene *scene, made_operator *made,
                        walked_light *walked, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &scene->m;
    const reuse_estimates *e = &walked->paths;
    const size_t n = m->n, C = m->n_channels, s = e->n_positions;
    const bool black = is_black(m);
    norms of = {.s = s, .covariance = e->covariance};
    float *x = memory_allocate(s, n * sizeof *x, "errors of positions", error);
    double *w = memory_allocate(s, sizeof *w, "errors of positions", error);
    of.radiosity = memory_allocate(s, s * sizeof *of.radiosity, "errors of positions", error);
    of.reflected = memory_allocate(s, s * sizeof *of.reflected, "errors of positions", error);
    walked->position_errors = memory_allocate(s, 2 * sizeof *walked->position_errors, "errors", error);
    if (x == NULL || w == NULL || of.radiosity == NULL || of.reflected == NULL ||
        walked->position_errors == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t c = 0; c < C; c++) {
        const float *rho = m->reflectance + c * n, *H = e->H + c * s * n,
                    power = (float)walked->light.emission[c];
        for (size_t k = 0; k < s * n; k++) x[k] = (black ? 1 : rho[k % n]) * H[k];
        add_products(s, n, m->area, x, of.radiosity);
        for (size_t k = 0; k < s * n; k++) x[k] = (black ? 1 : rho[k % n]) * (H[k] - power * e->direct[k]);
        add_products(s, n, m->area, x, of.reflected);
    }
    measure_all(&of, precompute_seed(job->options->seed, SEED_PROBES), w, walked->position_errors,
                walked->position_errors + s, &made->errors);
    const error_group *g = &made->errors.single;
    terminal_log(job->t, "positions relative %.3g, indirect %.3g; at most %.3g, %.3g", g->total_relative.mean,
                 g->total_indirect.mean, g->total_relative.max, g->total_indirect.max);
done:
    free(x);
    free(w);
    free(of.radiosity);
    free(of.reflected);
    return status;
}

/* Its polygon, and turn and move of every position side by side. */
lam_status walked_save(const walked_light *walked, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const moving_light *l = &walked->light;
    const size_t n_channels = walked->paths.n_channels;
    if (l->n == 0) return LAM_OK;
    const size_t corners[2] = {l->n_corners, 3}, poses[3] = {l->n, 3, 4};
    double *pose = memory_allocate(l->n, 12 * sizeof *pose, "positions", error);
    if (pose == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < l->n; k++)
        for (size_t d = 0; d < 3; d++) {
            for (size_t e = 0; e < 3; e++) pose[12 * k + 4 * d + e] = l->pose[k].turn[d][e];
            pose[12 * k + 4 * d + 3] = l->pose[k].move[d];
        }
    TRY(store_write(s, STORE_POSITIONS "/polygon", STORE_F64, 2, corners, l->corner, error));
    TRY(store_write(s, STORE_POSITIONS "/emission", STORE_F64, 1, &n_channels, l->emission, error));
    TRY(store_write(s, STORE_POSITIONS "/pose", STORE_F64, 3, poses, pose, error));
done:
    free(pose);
    return status;
}
