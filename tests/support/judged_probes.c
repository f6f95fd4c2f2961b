#include "support/judged_probes.h"

#include "solver/base/random.h"
#include "solver/method/reference.h"
#include "solver/scene/import/import.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Edge of a lamp over the scene's largest extent. */
static const double lamp_width = .24;

const char *const probe_groups[PROBE_GROUPS] = {"single", "lamp", "random"};

static double unit(uint64_t *state) {
    return random_lcg_unit(state);
}

static void die(const char *what) {
    fprintf(stderr, "probes: %s\n", what);
    exit(1);
}

/* R H of the light H that E itself gives. */
static void bounce(const judged_probes *b, const float *E, double *right) {
    lam_error error = {.message = ""};
    bool known;
    double *spread = malloc(b->m.n * sizeof *spread);
    if (spread == NULL) die("not enough memory");
    if (first_light_of(b->first, E, right, spread, &known, &error) != LAM_OK) die(error.message);
    if (!known) die("a lamp of too many elements");
    free(spread);
    for (size_t i = 0; i < b->m.n; i++) right[i] *= (double)b->m.reflectance[i];
}

static void single(const judged_probes *b, float *E, double *right, uint64_t *state) {
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

static size_t lamp_elements(const judged_probes *b, uint32_t middle, uint32_t *out) {
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

static void lamp(const judged_probes *b, float *E, double *right, uint64_t *state) {
    uint32_t *of = malloc(b->m.n * sizeof *of);
    if (of == NULL) die("not enough memory");
    const size_t count = lamp_elements(b, (uint32_t)(unit(state) * (double)b->m.n), of);
    for (size_t k = 0; k < count; k++) E[of[k]] = 1;
    bounce(b, E, right);
    free(of);
}

static void everywhere(const judged_probes *b, const csr *F, float *E, double *right, uint64_t *state) {
    double *x = malloc(b->m.n * sizeof *x);
    for (size_t i = 0; i < b->m.n; i++) x[i] = (double)(E[i] = (float)unit(state));
    csr_multiply_rows(F, 0, b->m.n, 1, x, right);
    for (size_t i = 0; i < b->m.n; i++) right[i] *= (double)b->m.reflectance[i];
    free(x);
}

static lam_status make_probes(judged_probes *b, const csr *F, lam_error *error) {
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
        if (k < b->counts[PROBE_SINGLE])
            single(b, E, right, &state);
        else if (k < b->counts[PROBE_SINGLE] + b->counts[PROBE_LAMP])
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

/* Judge and probes in a file, for the same scene and recipe alone. */
static bool load(judged_probes *b, const char *path) {
    const size_t count = b->n_probes * b->m.n;
    size_t head[2];
    FILE *file = fopen(path, "rb");
    if (file == NULL) return false;
    if (fread(head, sizeof head, 1, file) != 1 || head[0] != b->m.n || head[1] != b->n_probes ||
        fread(b->E, sizeof *b->E, count, file) != count || fread(b->B, sizeof *b->B, count, file) != count)
        die("a judge of another scene or of other probes");
    fclose(file);
    return true;
}

static void save(const judged_probes *b, const char *path) {
    const size_t count = b->n_probes * b->m.n, head[2] = {b->m.n, b->n_probes};
    FILE *file = fopen(path, "wb");
    if (file == NULL || fwrite(head, sizeof head, 1, file) != 1 ||
        fwrite(b->E, sizeof *b->E, count, file) != count ||
        fwrite(b->B, sizeof *b->B, count, file) != count || fclose(file) != 0)
        die("cannot write the judge");
}

void judged_probes_make(const char *scene, const recipe *judging, const char *path,
                        const size_t counts[PROBE_GROUPS], judged_probes *b) {
    lam_error error = {.message = ""};
    const import_options how = {.unit = 1, .reflectance = -1};
    import_report report;
    form_factors f = {.closed = false};
    *b = (judged_probes){.n_probes = 0};
    for (int g = 0; g < PROBE_GROUPS; g++) b->n_probes += b->counts[g] = counts[g];
    if (b->n_probes == 0 || b->n_probes > PROBES_MOST) die("1 to 96 probes");
    if (scene_import(scene, &how, &b->m, &report, &error) != LAM_OK) die(error.message);
    const size_t n = b->m.n;
    b->order = malloc(n * sizeof *b->order);
    b->E = calloc(b->n_probes * n, sizeof *b->E);
    b->right = calloc(b->n_probes * n, sizeof *b->right);
    b->B = calloc(b->n_probes * n, sizeof *b->B);
    if (b->order == NULL || b->E == NULL || b->right == NULL || b->B == NULL) die("not enough memory");
    if (mesh_z_order(&b->m, b->order, &error) != LAM_OK) die(error.message);
    if (path != NULL && load(b, path)) return;
    const form_factor_options options = {
        .recipe = *judging, .stage = "form factors", .upper = true, .scratch_name = "form-factors"};
    if (form_factors_make(&b->m, b->order, &options, &f, &error) != LAM_OK ||
        form_factors_expand(&f, b->m.area, &error) != LAM_OK || make_probes(b, &f.F, &error) != LAM_OK)
        die(error.message);
    form_factors_free(&f);
    if (path != NULL) save(b, path);
}

void judged_probes_free(judged_probes *b) {
    mesh_free(&b->m);
    free(b->order);
    free(b->E);
    free(b->right);
    free(b->B);
}

double judged_probes_error(const judged_probes *b, size_t probe, const float *indirect) {
    double wrong = 0, all = 0;
    for (size_t i = 0; i < b->m.n; i++) {
        const double B = b->B[probe * b->m.n + i], x = (double)indirect[i];
        wrong += b->m.area[i] * (x - B) * (x - B);
        all += b->m.area[i] * B * B;
    }
    return sqrt(wrong / all);
}
