/* The indirect error of operators where a scene is too large for a reference of all pairs, and what they
 * cost:
 *
 *     bench_hierarchical SCENE JUDGE SINGLES LAMPS RANDOMS STORE.h5 ...
 *
 * B - E = R H + D,  (I - R F') D = R F' (R H), with H the light that E itself gives: of single elements pair
 * by pair, of lamps (squares of a plane) by some of their elements for each element, of random emission by
 * F', as all that bounces on is. F' is of the recipe JUDGE. As CSV. */
#include "solver/base/clock.h"
#include "solver/base/random.h"
#include "solver/bench/stats.h"
#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/pairs/first_light.h"
#include "solver/method/reference.h"

#include "solver/operator/operator.h"
#include "solver/scene/import/import.h"
#include "tests/bench/bench_recipe.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <string.h>

enum { MOST_PROBES = 96, ROUNDS = 31 };
/* Edge of a lamp over the scene's largest extent. */
static const double lamp_width = .24;

/* An answer to random emission, to one element's emission, and to random emission for some elements. */
enum { WHOLE, FROM_ONE, FOR_SOME, WAYS, SOME = 100 };
static const char *const way_names[WAYS] = {"whole", "from_one", "for_some"};

enum { SINGLE, LAMP, RANDOM, GROUPS };
static const char *const group_names[GROUPS] = {"single", "lamp", "random"};

typedef struct bench {
    mesh m;
    uint32_t *order;
    first_light *first;
    size_t counts[GROUPS], n_probes;
    float *E;      /* [n_probes][n] */
    double *right; /* [n_probes][n], R H */
    double *B;     /* [n_probes][n], less E */
} bench;

static double unit(uint64_t *state) {
    return random_lcg_unit(state);
}

static void die(const char *what) {
    fprintf(stderr, "bench_hierarchical: %s\n", what);
    exit(1);
}

/* R H of the light H that E itself gives. */
static void bounce(const bench *b, const float *E, double *right) {
    lam_error error = {.message = ""};
    bool known;
    if (first_light_of(b->first, E, right, &known, &error) != LAM_OK) die(error.message);
    if (!known) die("a lamp of too many elements");
    for (size_t i = 0; i < b->m.n; i++) right[i] *= (double)b->m.reflectance[i];
}

static void single(const bench *b, float *E, double *right, uint64_t *state) {
    E[(size_t)(unit(state) * (double)b->m.n)] = 1;
    bounce(b, E, right);
}

static double extent(const mesh *m) {
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, most = 0,
           at[3];
    for (size_t i = 0; i < m->n; i++) {
        mesh_centroid(m, i, at);
        for (int d = 0; d < 3; d++) low[d] = fmin(low[d], at[d]), high[d] = fmax(high[d], at[d]);
    }
    for (int d = 0; d < 3; d++) most = fmax(most, high[d] - low[d]);
    return most;
}

static size_t lamp_elements(const bench *b, uint32_t middle, uint32_t *out) {
    double centre[3], at[3];
    const double half = .5 * lamp_width * extent(&b->m);
    size_t count = 0;
    mesh_centroid(&b->m, middle, centre);
    for (size_t i = 0; i < b->m.n; i++) {
        double turned = 0, away = 0, most = 0;
        mesh_centroid(&b->m, i, at);
        for (int d = 0; d < 3; d++) {
            turned += (double)b->m.normal[i][d] * (double)b->m.normal[middle][d];
            away += (double)b->m.normal[middle][d] * (at[d] - centre[d]);
            most = fmax(most, fabs(at[d] - centre[d]));
        }
        if (turned > .999 && fabs(away) < 1e-3 * half && most <= half) out[count++] = (uint32_t)i;
    }
    return count;
}

static void lamp(const bench *b, float *E, double *right, uint64_t *state) {
    uint32_t *of = malloc(b->m.n * sizeof *of);
    if (of == NULL) die("not enough memory");
    const size_t count = lamp_elements(b, (uint32_t)(unit(state) * (double)b->m.n), of);
    for (size_t k = 0; k < count; k++) E[of[k]] = 1;
    bounce(b, E, right);
    free(of);
}

static void everywhere(const bench *b, const csr *F, float *E, double *right, uint64_t *state) {
    double *x = malloc(b->m.n * sizeof *x);
    for (size_t i = 0; i < b->m.n; i++) x[i] = (double)(E[i] = (float)unit(state));
    csr_multiply_rows(F, 0, b->m.n, 1, x, right);
    for (size_t i = 0; i < b->m.n; i++) right[i] *= (double)b->m.reflectance[i];
    free(x);
}

static lam_status make_probes(bench *b, const csr *F, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = b->m.n;
    uint64_t state = 5;
    reference *r = NULL;
    double *X = memory_allocate(b->n_probes * n, sizeof *X, "bench", error);
    if (X == NULL) TRY(LAM_ERR_MEMORY);
    TRY(first_light_create(&b->m, 12345, &b->first, error));
    for (size_t k = 0; k < b->n_probes; k++) {
        float *E = b->E + k * n;
        double *right = b->right + k * n;
        if (k < b->counts[SINGLE])
            single(b, E, right, &state);
        else if (k < b->counts[SINGLE] + b->counts[LAMP])
            lamp(b, E, right, &state);
        else
            everywhere(b, F, E, right, &state);
        csr_multiply_rows(F, 0, n, 1, right, X + k * n);
        for (size_t i = 0; i < n; i++) b->B[k * n + i] = X[k * n + i] *= (double)b->m.reflectance[i];
    }
    TRY(reference_create(F, b->m.area, b->m.reflectance, REFERENCE_ITERATED, &r, error));
    TRY(reference_solve(r, b->n_probes, X, b->B, 1e-6, NULL, error));
    for (size_t k = 0; k < b->n_probes * n; k++) b->B[k] += b->right[k];
done:
    reference_destroy(r);
    first_light_destroy(b->first);
    free(X);
    return status;
}

static lam_status time_answers(const bench *b, const lam_operator *op, float *out, void *work, size_t bytes,
                               lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = b->m.n;
    double ms[ROUNDS];
    uint32_t some[SOME];
    uint64_t state = 9;
    float *one = calloc(n, sizeof *one);
    if (one == NULL) die("not enough memory");
    one[n / 2] = 1;
    for (size_t k = 0; k < SOME; k++) some[k] = (uint32_t)(unit(&state) * (double)n);
    for (int way = 0; way < WAYS; way++) {
        const float *E = way == FROM_ONE ? one : b->E + (b->n_probes - 1) * n;
        for (size_t round = 0; round < ROUNDS; round++) {
            const double started = clock_seconds();
            if (way == FOR_SOME)
                TRY(lam_operator_apply_selected(op, 1, LAM_RADIOSITY, E, NULL, SOME, some, out, work, bytes,
                                                error));
            else
                TRY(lam_operator_apply(op, 1, LAM_RADIOSITY, E, out, work, bytes, error));
            ms[round] = 1e3 * (clock_seconds() - started);
        }
        printf(",%.3f,%.3f", stats_median(ms, ROUNDS), stats_quantile(ms, ROUNDS, 0));
    }
done:
    free(one);
    return status;
}

static lam_status judge(const bench *b, const char *path, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = b->m.n;
    lam_operator *op = NULL;
    operator_description about;
    void *work = NULL;
    float *out = memory_allocate(n, sizeof *out, "bench", error);
    if (out == NULL) TRY(LAM_ERR_MEMORY);
    TRY(lam_operator_open(path, &op, error));
    if (op->n != n || op->n_channels != 1) die("a store of other elements, or of colours");
    lam_operator_set_threads(op, (size_t)omp_get_max_threads());
    const size_t bytes = lam_operator_work_bytes(op, 1);
    work = memory_allocate(1, bytes, "bench", error);
    if (work == NULL) TRY(LAM_ERR_MEMORY);
    operator_describe(op, &about);
    printf("%s,%zu,%s,%.3f", path, n, lam_operator_kind(op), (double)about.bytes * 1e-6);
    for (size_t g = 0, k = 0; g < GROUPS; g++) {
        double mean = 0, most = 0;
        for (size_t end = k + b->counts[g]; k < end; k++) {
            double wrong = 0, all = 0;
            TRY(lam_operator_apply(op, 1, LAM_INDIRECT, b->E + k * n, out, work, bytes, error));
            for (size_t i = 0; i < n; i++) {
                const double B = b->B[k * n + i], x = (double)out[i];
                wrong += b->m.area[i] * (x - B) * (x - B);
                all += b->m.area[i] * B * B;
            }
            mean += sqrt(wrong / all) / (double)b->counts[g];
            most = fmax(most, sqrt(wrong / all));
        }
        printf(",%.4f,%.4f", mean, most);
    }
    TRY(time_answers(b, op, out, work, bytes, error));
    printf("\n");
    fflush(stdout);
done:
    lam_operator_close(op);
    free(work);
    free(out);
    return status;
}

int main(int argc, char **argv) {
    lam_error error = {.message = ""};
    bench b = {.n_probes = 0};
    const import_options how = {.unit = 1, .reflectance = -1};
    import_report report;
    recipe judging;
    form_factors f = {.closed = false};
    if (argc < 6 || !bench_recipe(argv[2], 7, &judging))
        die("usage: bench_hierarchical SCENE RAYS|near:RAYS|pairs SINGLES LAMPS RANDOMS STORE.h5 ...");
    for (int g = 0; g < GROUPS; g++) b.n_probes += b.counts[g] = (size_t)atoi(argv[3 + g]);
    if (b.n_probes == 0 || b.n_probes > MOST_PROBES) die("1 to 96 probes");
    if (scene_import(argv[1], &how, &b.m, &report, &error) != LAM_OK) die(error.message);
    const size_t n = b.m.n;
    b.order = malloc(n * sizeof *b.order);
    b.E = calloc(b.n_probes * n, sizeof *b.E);
    b.right = calloc(b.n_probes * n, sizeof *b.right);
    b.B = calloc(b.n_probes * n, sizeof *b.B);
    if (b.order == NULL || b.E == NULL || b.right == NULL || b.B == NULL) die("not enough memory");
    const form_factor_options options = {
        .recipe = judging, .stage = "form factors", .upper = true, .scratch_name = "form-factors"};
    if (mesh_z_order(&b.m, b.order, &error) != LAM_OK ||
        form_factors_make(&b.m, b.order, &options, &f, &error) != LAM_OK ||
        form_factors_expand(&f, b.m.area, &error) != LAM_OK || make_probes(&b, &f.F, &error) != LAM_OK)
        die(error.message);
    form_factors_free(&f);
    printf("store,n,kind,MB");
    for (int g = 0; g < GROUPS; g++) printf(",%s,%s_most", group_names[g], group_names[g]);
    for (int way = 0; way < WAYS; way++) printf(",%s_ms,%s_best_ms", way_names[way], way_names[way]);
    printf("\n");
    for (int k = 6; k < argc; k++)
        if (judge(&b, argv[k], &error) != LAM_OK) die(error.message);
    mesh_free(&b.m);
    free(b.order);
    free(b.E);
    free(b.right);
    free(b.B);
    return 0;
}
