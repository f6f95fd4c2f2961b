#include "solver/operator/sky_light.h"

#include "store/groups.h"
#include "store/status.h"
#include "store/store_map.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

struct lam_sky {
    size_t n_tiles, n;
    const float *first_bounce; /* [m][n], sr; in where */
    store_view where;
};

lam_status sky_load(store *s, size_t n, lam_sky **out, lam_error *error) {
    lam_status status = LAM_OK;
    size_t dims[STORE_MAX_RANK] = {SIZE_MAX, n};
    store_view view = {.data = NULL};
    lam_sky *made = NULL;
    if (!store_has(s, STORE_SKY)) {
        *out = NULL;
        return LAM_OK;
    }
    TRY(store_read_view(s, STORE_SKY "/first_bounce", STORE_F32, 2, dims, &view, error));
    const float *values = view.data;
    if (dims[0] == 0) FAIL(error, LAM_ERR_FORMAT, "%s: /sky/first_bounce has no tiles", store_path(s));
    /* A mapped array is compared with its checksums later; its writer has checked the values. */
    for (size_t k = 0; k < dims[0] * n && view.map == NULL; k++)
        if (!(values[k] >= 0 && isfinite(values[k])))
            FAIL(error, LAM_ERR_FORMAT, "%s: /sky/first_bounce[%zu][%zu] = %g, must be at least 0",
                 store_path(s), k / n, k % n, (double)values[k]);
    made = memory_allocate(1, sizeof *made, "the sky", error);
    if (made == NULL) TRY(LAM_ERR_MEMORY);
    *made = (lam_sky){.n_tiles = dims[0], .n = n, .first_bounce = values, .where = view};
    view = (store_view){.data = NULL};
    *out = made;
done:
    store_view_free(&view);
    return status;
}

lam_status sky_create(size_t n_tiles, size_t n, const float *first_bounce, lam_sky **out, lam_error *error) {
    lam_status status = LAM_OK;
    lam_sky *made = memory_allocate(1, sizeof *made, "the sky", error);
    if (made == NULL) TRY(LAM_ERR_MEMORY);
    made->n_tiles = n_tiles;
    made->n = n;
    made->where.memory = memory_allocate(n_tiles, n * sizeof *made->first_bounce, "the sky", error);
    if (made->where.memory == NULL) TRY(LAM_ERR_MEMORY);
    memcpy(made->where.memory, first_bounce, n_tiles * n * sizeof *first_bounce);
    made->first_bounce = made->where.memory;
    *out = made;
    made = NULL;
done:
    lam_sky_close(made);
    return status;
}

lam_status lam_sky_open(const char *path, lam_sky **sky, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    store_type type;
    int rank;
    size_t dims[STORE_MAX_RANK];
    if (path == NULL || sky == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "a path and a place for the sky are needed");
    TRY(store_open(path, &s, error));
    TRY(store_array_info(s, STORE_MESH "/area", &type, &rank, dims, error));
    if (rank != 1)
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/area has %d dimensions, must have 1", store_path(s), rank);
    TRY(sky_load(s, dims[0], sky, error));
done:
    store_close(s);
    return status;
}

void lam_sky_close(lam_sky *sky) {
    if (sky == NULL) return;
    store_view_free(&sky->where);
    free(sky);
}

size_t lam_sky_tiles(const lam_sky *sky) {
    return sky->n_tiles;
}

size_t lam_sky_elements(const lam_sky *sky) {
    return sky->n;
}

const float *sky_first_bounce(const lam_sky *sky) {
    return sky->first_bounce;
}

void lam_sky_irradiance(const lam_sky *sky, size_t n_rows, const float *L, float *H0) {
    enum { BLOCK = 512 }; /* elements whose rows of first_bounce stay in the cache from one row to the next */
    const size_t m = sky->n_tiles, n = sky->n;
    for (size_t first = 0; first < n; first += BLOCK) {
        const size_t count = n - first < BLOCK ? n - first : BLOCK;
        for (size_t r = 0; r < n_rows; r++) {
            double sum[BLOCK] = {0};
            for (size_t t = 0; t < m; t++) {
                const double radiance = (double)L[r * m + t];
                const float *row = sky->first_bounce + t * n + first;
                if (radiance == 0) continue;
                for (size_t i = 0; i < count; i++) sum[i] += radiance * (double)row[i];
            }
            for (size_t i = 0; i < count; i++) H0[r * n + first + i] = (float)sum[i];
        }
    }
}

void sky_irradiance_double(const lam_sky *sky, size_t n_rows, const double *L, double *H0) {
    const size_t m = sky->n_tiles, n = sky->n;
    memset(H0, 0, n_rows * n * sizeof *H0);
    for (size_t r = 0; r < n_rows; r++)
        for (size_t t = 0; t < m; t++) {
            const double radiance = L[r * m + t];
            const float *row = sky->first_bounce + t * n;
            double *sum = H0 + r * n;
            if (radiance == 0) continue;
            for (size_t i = 0; i < n; i++) sum[i] += radiance * (double)row[i];
        }
}

void lam_sky_adjoint(const lam_sky *sky, size_t n_rows, const float *g, float *L) {
    const size_t m = sky->n_tiles, n = sky->n;
    for (size_t r = 0; r < n_rows; r++)
        for (size_t t = 0; t < m; t++) {
            const float *row = sky->first_bounce + t * n, *g_r = g + r * n;
            double sum = 0;
            for (size_t i = 0; i < n; i++) sum += (double)row[i] * (double)g_r[i];
            L[r * m + t] = (float)sum;
        }
}
