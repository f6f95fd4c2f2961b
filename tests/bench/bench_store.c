/* Writes a low-rank store of any size, of arbitrary numbers: the start of a daemon depends on its size alone.
 * tests/bench/start.py serves it.
 *
 *     bench_store STORE.h5 NxK [f32|f16|i8]        2 n k values: 320000x2000 in f32 are 5.1 GB
 */
#include "solver/base/half.h"
#include "solver/base/random.h"
#include "solver/linalg/panel.h"
#include "store/store.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void die(const char *what) {
    fprintf(stderr, "bench_store: %s\n", what);
    exit(1);
}

static void need(lam_status status, const lam_error *error) {
    if (status != LAM_OK) die(error->message);
}

static void *room(size_t count, size_t size) {
    void *memory = calloc(count, size);
    if (memory == NULL) die("not enough memory");
    return memory;
}

/* Numbers around 0 whose sums stay small: B is E and a little more. */
static void fill(size_t n, size_t k, int precision, unsigned seed, void *values) {
#pragma omp parallel for
    for (size_t i = 0; i < n; i++) {
        uint64_t state = (i + 1) * RANDOM_STEP + seed;
        for (size_t j = 0; j < k; j++) {
            const int digit = (int)(random_lcg(&state) >> 57) - 64; /* -64 to 63 */
            if (precision == PANEL_F32) ((float *)values)[i * k + j] = (float)digit * 1e-5f;
            if (precision == PANEL_F16) ((uint16_t *)values)[i * k + j] = half_of_float((float)digit * 1e-3f);
            if (precision == PANEL_I8) ((int8_t *)values)[i * k + j] = (int8_t)digit;
        }
    }
}

static void write_matrix(store *s, const char *name, size_t n, size_t k, int precision, unsigned seed,
                         void *values, lam_error *error) {
    static const store_type types[PANEL_PRECISIONS] = {STORE_F32, STORE_F16, STORE_I8};
    char scale_name[48];
    fill(n, k, precision, seed, values);
    need(store_write(s, name, types[precision], 2, (size_t[]){n, k}, values, error), error);
    if (precision != PANEL_I8) return;
    float *scale = room(k, sizeof *scale);
    for (size_t j = 0; j < k; j++) scale[j] = 1e-5f;
    snprintf(scale_name, sizeof scale_name, "%s_scale", name);
    need(store_write(s, scale_name, STORE_F32, 1, &k, scale, error), error);
    free(scale);
}

static void write_mesh(store *s, size_t n, lam_error *error) {
    static const char *const names[] = {"floor", "lamp"};
    double *vertices = room(n, 3 * sizeof *vertices), *area = room(n, sizeof *area);
    uint32_t *elements = room(n, 4 * sizeof *elements), *group = room(n, sizeof *group);
    float *reflectance = room(n, sizeof *reflectance), *normal = room(n, 3 * sizeof *normal);
    for (size_t i = 0; i < n; i++) {
        area[i] = 1;
        reflectance[i] = .5f;
        normal[3 * i + 2] = 1;
        group[i] = i < 100;
        for (size_t v = 0; v < 4; v++) elements[4 * i + v] = v < 3 ? (uint32_t)((i + v) % n) : UINT32_MAX;
    }
    need(store_write(s, "/mesh/vertices", STORE_F64, 2, (size_t[]){n, 3}, vertices, error), error);
    need(store_write(s, "/mesh/elements", STORE_U32, 2, (size_t[]){n, 4}, elements, error), error);
    need(store_write(s, "/mesh/area", STORE_F64, 1, &n, area, error), error);
    need(store_write(s, "/mesh/normal", STORE_F32, 2, (size_t[]){n, 3}, normal, error), error);
    need(store_write(s, "/mesh/reflectance", STORE_F32, 2, (size_t[]){1, n}, reflectance, error), error);
    need(store_write(s, "/mesh/emission", STORE_F32, 2, (size_t[]){1, n}, reflectance, error), error);
    need(store_write(s, "/mesh/group", STORE_U32, 1, &n, group, error), error);
    need(store_write(s, "/mesh/row_sums", STORE_F64, 1, &n, area, error), error);
    need(store_write_texts(s, "/mesh/group_names", 2, names, error), error);
    need(store_set_text(s, "/mesh", "geometry_hash", "00000000000000000000000000000000", error), error);
    free(vertices);
    free(area);
    free(elements);
    free(group);
    free(reflectance);
    free(normal);
}

int main(int argc, char **argv) {
    lam_error error = {.message = ""};
    panel_precision precision = PANEL_F32;
    size_t n = 0, k = 0;
    store *s = NULL;
    if (argc < 3 || sscanf(argv[2], "%zux%zu", &n, &k) != 2 || n == 0 || k == 0 ||
        (argc > 3 && !panel_precision_find(argv[3], &precision)))
        die("STORE.h5 NxK [f32|f16|i8]");
    need(store_create(argv[1], &s, &error), &error);
    need(store_set_text(s, "/", "name", "big", &error), &error);
    need(store_set_text(s, "/", "tool", "bench_store", &error), &error);
    write_mesh(s, n, &error);
    need(store_set_text(s, "/operator", "kind", "low_rank", &error), &error);
    need(store_set_text(s, "/operator", "form", "folded", &error), &error);
    need(store_set_text(s, "/operator", "layout", "rows", &error), &error);
    need(store_set_text(s, "/operator", "precision", panel_precision_name(precision), &error), &error);
    need(store_set_integer(s, "/operator", "rank", (int64_t)k, &error), &error);
    void *values = room(n * k, panel_value_size(precision));
    write_matrix(s, "/operator/Y", n, k, precision, 1, values, &error);
    write_matrix(s, "/operator/V", n, k, precision, 2, values, &error);
    free(values);
    need(store_seal(s, &error), &error);
    return 0;
}
