/* What is served: an operator made up of random numbers, as its speed does not depend on them. */
#include "solver/bench/bench_service.h"
#include "solver/operator/operator.h"
#include "solver/scene/mesh.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/statvfs.h>

/* Left for everything but operators, in memory and on disk. */
static const double slack = 1 << 30;

/* Operators are held twice, here and by lambertd, and half of one a third time while an array of it is
 * written or read; .1 for the panels' padding. */
static const double copies = 2.6;

static const float reflectance = .5f;

size_t service_store_fits(const service_bench *b, size_t n, size_t k) {
    struct statvfs about;
    double bytes = INFINITY;
    if (b->run->memory > 0) bytes = ((double)b->run->memory - slack) / copies;
    if (statvfs(b->folder, &about) == 0)
        bytes = fmin(bytes, (double)about.f_bavail * (double)about.f_frsize - slack);
    const double most = bytes / (2 * sizeof(float) * (double)n);
    if (most >= (double)k) return k;
    return most >= 16 ? (size_t)most / 16 * 16 : 0;
}

/* In [0, 1), of a sequence that begins anew for every row. */
static float next_random(uint64_t *state) {
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (float)(*state >> 40) * 0x1p-24f;
}

/* rows[i][p] = scale x for x in [0, 1) */
static void fill(size_t n, size_t k, float scale, uint64_t seed, float *rows) {
#pragma omp parallel for
    for (size_t i = 0; i < n; i++) {
        uint64_t state = (i + 1) * 0x9E3779B97F4A7C15u ^ seed;
        for (size_t p = 0; p < k; p++) rows[i * k + p] = scale * next_random(&state);
    }
}

/* B = E - Y (V^T E): V is at most 2/n and Y above -1/k, so that B is about E + mean(E)/2. */
static lam_status make_operator(const service_bench *b, const mesh *m, size_t k, lam_operator **op,
                                lam_error *error) {
    lam_status status = LAM_OK;
    size_t bytes_of_row;
    float *Y = NULL, *V = NULL;
    if (!size_multiply(k, sizeof *Y, &bytes_of_row)) FAIL(error, LAM_ERR_MEMORY, "k = %zu: too large", k);
    Y = memory_allocate(m->n, bytes_of_row, "Y", error);
    V = memory_allocate(m->n, bytes_of_row, "V", error);
    if (Y == NULL || V == NULL) TRY(LAM_ERR_MEMORY);
    fill(m->n, k, -1 / (float)k, b->run->seed, Y);
    fill(m->n, k, 2 / (float)m->n, ~b->run->seed, V);
    float *taken_Y = Y, *taken_V = V;
    Y = V = NULL;
    TRY(operator_low_rank_create_folded(m->n, k, m->reflectance, taken_Y, taken_V, op, error));
done:
    free(Y);
    free(V);
    return status;
}

/* A strip of n unit squares, a quarter of them in each group. */
static lam_status make_mesh(size_t n, mesh *m, double **row_sums, lam_error *error) {
    static const char *const names[] = {"lamp", "desk", "floor", "wall"};
    enum { GROUPS = 4, NAME = 8 };
    lam_status status = LAM_OK;
    *m = (mesh){.n_vertices = 2 * (n + 1), .n = n, .n_groups = GROUPS, .n_channels = 1, .unit = 1, .up = 'z'};
    strcpy(m->name, "bench");
    m->vertices = memory_allocate(m->n_vertices, sizeof *m->vertices, "vertices", error);
    m->elements = memory_allocate(n, sizeof *m->elements, "elements", error);
    m->group = memory_allocate(n, sizeof *m->group, "groups", error);
    m->reflectance = memory_allocate(n, sizeof *m->reflectance, "reflectance", error);
    m->emission = memory_allocate(n, sizeof *m->emission, "emission", error);
    m->group_names = memory_allocate(GROUPS, sizeof *m->group_names + NAME, "groups", error);
    *row_sums = memory_allocate(n, sizeof **row_sums, "row sums", error);
    if (m->vertices == NULL || m->elements == NULL || m->group == NULL || m->reflectance == NULL ||
        m->emission == NULL || m->group_names == NULL || *row_sums == NULL)
        TRY(LAM_ERR_MEMORY);
    char *text = (char *)(m->group_names + GROUPS);
    for (size_t g = 0; g < GROUPS; g++, text += NAME) m->group_names[g] = strcpy(text, names[g]);
    for (size_t v = 0; v <= n; v++) {
        m->vertices[2 * v][0] = m->vertices[2 * v + 1][0] = (double)v;
        m->vertices[2 * v + 1][1] = 1;
    }
    for (uint32_t i = 0; i < n; i++) {
        const uint32_t corners[4] = {2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1};
        memcpy(m->elements[i], corners, sizeof corners);
        m->group[i] = (uint32_t)(i * (size_t)GROUPS / n);
        m->reflectance[i] = reflectance;
        (*row_sums)[i] = 1;
    }
    TRY(mesh_measure(m, error));
done:
    return status;
}

static lam_status save(const service_bench *b, const mesh *m, const double *row_sums, const lam_operator *op,
                       lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    char path[PATH_MAX];
    operator_description about = {.density = -1};
    operator_describe(op, &about);
    snprintf(path, sizeof path, "%s/store.h5", b->folder);
    TRY(store_create(path, &s, error));
    TRY(store_set_text(s, "/", "name", m->name, error));
    TRY(store_set_text(s, "/", "tool", "lambert " LAMBERT_VERSION, error));
    TRY(store_set_text(s, "/", "command", "lambert bench service", error));
    TRY(store_set_integer(s, "/", "seed", (int64_t)b->run->seed, error));
    TRY(store_set_number(s, "/", "unit", m->unit, error));
    TRY(mesh_save(m, row_sums, s, error));
    TRY(operator_save(op, s, error));
    TRY(store_set_text(s, "/operator", "method", "low-rank", error));
    TRY(store_set_text(s, "/operator", "factorizer", "none", error));
    TRY(store_set_text(s, "/operator", "reason", "made up, to be measured", error));
    TRY(store_set_integer(s, "/operator", "rank", (int64_t)about.rank, error));
    store *sealing = s;
    s = NULL;
    TRY(store_seal(sealing, error));
done:
    store_close(s);
    return status;
}

lam_status service_store_make(const service_bench *b, size_t n, size_t k, lam_operator **op,
                              lam_error *error) {
    lam_status status = LAM_OK;
    mesh m = {0};
    double *row_sums = NULL;
    lam_operator *made = NULL;
    TRY(make_mesh(n, &m, &row_sums, error));
    TRY(make_operator(b, &m, k, &made, error));
    TRY(bench_check(b->run, error));
    TRY(save(b, &m, row_sums, made, error));
    *op = made;
    made = NULL;
done:
    lam_operator_close(made);
    free(row_sums);
    mesh_free(&m);
    return status;
}

/* --- requests ------------------------------------------------------------------------------------------- */

lam_status service_emission(const service_bench *b, size_t n, float **E, lam_error *error) {
    uint64_t state = b->run->seed;
    float *made = memory_allocate(n, sizeof *made, "emission", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < n; i++) made[i] = next_random(&state);
    *E = made;
    return LAM_OK;
}

/* NPY format 1.0: magic number, version, length of the header, header, values. */
static void write_npy(FILE *stream, size_t n, const float *E) {
    enum { BEFORE = 10, ALL = 128 };
    char header[ALL - BEFORE + 1];
    const int used =
        snprintf(header, sizeof header, "{'descr': '<f4', 'fortran_order': False, 'shape': (%zu,), }", n);
    memset(header + used, ' ', sizeof header - 1 - (size_t)used);
    header[ALL - BEFORE - 1] = '\n';
    const unsigned char before[BEFORE] = {0x93, 'N', 'U', 'M', 'P', 'Y', 1, 0, ALL - BEFORE, 0};
    fwrite(before, 1, sizeof before, stream);
    fwrite(header, 1, ALL - BEFORE, stream);
    fwrite(E, sizeof *E, n, stream);
}

static void write_json(FILE *stream, size_t n, const float *E) {
    fputs("{\"emission\":[", stream);
    for (size_t i = 0; i < n; i++) fprintf(stream, "%s%.9g", i > 0 ? "," : "", (double)E[i]);
    fputs("]}", stream);
}

lam_status service_body(const service_bench *b, service_format format, size_t n, const float *E, char **body,
                        size_t *length, lam_error *error) {
    lam_status status = LAM_OK;
    char path[PATH_MAX], *bytes = NULL;
    size_t size = 0;
    FILE *file = NULL, *memory = open_memstream(&bytes, &size);
    if (memory == NULL) FAIL(error, LAM_ERR_MEMORY, "a request of %zu values: not enough memory", n);
    (format == SERVICE_NPY ? write_npy : write_json)(memory, n, E);
    const bool whole = ferror(memory) == 0;
    if (fclose(memory) != 0 || !whole)
        FAIL(error, LAM_ERR_MEMORY, "a request of %zu values: not enough memory", n);
    snprintf(path, sizeof path, "%s/%s", b->folder, service_format_names[format]);
    file = fopen(path, "wbe");
    if (file == NULL || fwrite(bytes, 1, size, file) != size || fflush(file) != 0)
        FAIL(error, LAM_ERR_IO, "%s: %s", path, strerror(errno));
    *body = bytes;
    *length = size;
    bytes = NULL;
done:
    if (file != NULL) fclose(file);
    free(bytes);
    return status;
}
