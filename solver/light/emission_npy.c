/* Emissions and skies from NPY files, and what comes of the two together. */
#include "solver/light/emission.h"
#include "solver/light/npy_file.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

lam_status emission_check_value(const char *path, size_t vector, size_t index, double value, float *out,
                                lam_error *error) {
    lam_status status = LAM_OK;
    if (!isfinite(value))
        FAIL(error, LAM_ERR_ARGUMENT, "%s: emission %zu, value %zu is not finite", path, vector, index);
    if (value < 0 || value > (double)FLT_MAX)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: emission %zu, value %zu = %g, must be from 0 to %g", path, vector,
             index, value, (double)FLT_MAX);
    *out = (float)value;
done:
    return status;
}

lam_status emission_allocate(const char *path, size_t n_channels, size_t width, size_t n_vectors,
                             float **values, lam_error *error) {
    size_t count = 0;
    if (!size_multiply(width, n_channels, &count) || !size_multiply(count, n_vectors, &count))
        return status_fail(error, LAM_ERR_MEMORY, "%s: too many emissions for memory", path);
    *values = memory_allocate(count, sizeof **values, path, error);
    return *values == NULL ? LAM_ERR_MEMORY : LAM_OK;
}

/* Vectors of C rows of width numbers. */
typedef struct vectors {
    size_t n;
    bool batch;
    float *values; /* [n][C][width] */
} vectors;

static lam_status read_vectors(const char *path, size_t n_channels, size_t width, const char *of_what,
                               vectors *out, lam_error *error) {
    lam_status status = LAM_OK;
    npy a = {0};
    vectors made = {0};
    TRY(npy_read(path, &a, error));
    const bool grey = a.rank == 1; /* one row stands for every channel */
    const bool rows = a.rank == 2 && a.dims[0] == n_channels;
    made.batch = a.rank == 3 || (a.rank == 2 && !rows && n_channels == 1);
    if (a.dims[a.rank - 1] != width)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: rows of %zu values, the store has %zu %s", path,
             a.dims[a.rank - 1], width, of_what);
    if ((!grey && !rows && !made.batch) || (a.rank == 3 && a.dims[1] != n_channels))
        FAIL(error, LAM_ERR_ARGUMENT, "%s: shape does not fit; needs [%zu], [%zu][%zu] or a batch of them",
             path, width, n_channels, width);
    made.n = made.batch ? a.dims[0] : 1;
    if (made.n == 0) FAIL(error, LAM_ERR_ARGUMENT, "%s: an empty batch", path);
    TRY(emission_allocate(path, n_channels, width, made.n, &made.values, error));
    for (size_t v = 0; v < made.n; v++)
        for (size_t i = 0; i < n_channels * width; i++) {
            const size_t to = v * n_channels * width + i;
            TRY(emission_check_value(path, v, grey ? i % width : i, a.values[grey ? i % width : to],
                                     &made.values[to], error));
        }
    *out = made;
    made = (vectors){0};
done:
    free(made.values);
    npy_free(&a);
    return status;
}

lam_status emission_read_npy(const char *path, const mesh *m, emission *out, lam_error *error) {
    vectors read;
    const lam_status status = read_vectors(path, m->n_channels, m->n, "elements", &read, error);
    if (status == LAM_OK) *out = (emission){.n_vectors = read.n, .batch = read.batch, .E = read.values};
    return status;
}

/* One vector becomes count alike. */
static lam_status repeat(const char *path, size_t n_channels, size_t width, size_t count, float **values,
                         lam_error *error) {
    float *many = NULL;
    const lam_status status = emission_allocate(path, n_channels, width, count, &many, error);
    if (status != LAM_OK) return status;
    for (size_t v = 0; v < count; v++)
        memcpy(many + v * n_channels * width, *values, n_channels * width * sizeof *many);
    free(*values);
    *values = many;
    return LAM_OK;
}

/* Puts e under skies, which are taken over. */
static lam_status put_under(emission *e, const char *path, const mesh *m, size_t n_tiles, vectors *sky,
                            lam_error *error) {
    lam_status status = LAM_OK;
    if (e->L != NULL) FAIL(error, LAM_ERR_ARGUMENT, "%s: the emission has a sky of its own", path);
    if (sky->n != e->n_vectors && sky->n != 1 && e->n_vectors != 1)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: %zu skies beside %zu emissions, must be as many, or one", path,
             sky->n, e->n_vectors);
    e->steady = e->n_vectors < sky->n;
    if (e->steady) e->n_vectors = sky->n;
    if (sky->n < e->n_vectors) TRY(repeat(path, m->n_channels, n_tiles, e->n_vectors, &sky->values, error));
    e->batch = e->batch || sky->batch;
    e->L = sky->values;
    sky->values = NULL;
done:
    return status;
}

lam_status emission_add_sky(emission *e, const char *path, const mesh *m, size_t n_tiles, lam_error *error) {
    lam_status status = LAM_OK;
    vectors sky = {0};
    if (n_tiles == 0)
        FAIL(error, LAM_ERR_ARGUMENT, "--sky %s: the store has no sky; precompute it with --sky", path);
    TRY(read_vectors(path, m->n_channels, n_tiles, "tiles of sky", &sky, error));
    TRY(put_under(e, path, m, n_tiles, &sky, error));
done:
    free(sky.values);
    return status;
}

lam_status emission_add_skies(emission *e, const char *what, const mesh *m, size_t n_tiles, size_t n_skies,
                              const float *L, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t C = m->n_channels;
    vectors sky = {.n = n_skies, .batch = true};
    TRY(emission_allocate(what, C, n_tiles, n_skies, &sky.values, error));
    for (size_t row = 0; row < n_skies * C; row++)
        memcpy(sky.values + row * n_tiles, L + row / C * n_tiles, n_tiles * sizeof *L);
    TRY(put_under(e, what, m, n_tiles, &sky, error));
done:
    free(sky.values);
    return status;
}
