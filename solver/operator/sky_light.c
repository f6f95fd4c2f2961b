#include "solver/operator/sky_light.h"

#include "solver/operator/first_rows.h"
#include "store/groups.h"
#include "store/status.h"

#include <stdlib.h>
#include <string.h>

struct lam_sky {
    first_rows rows; /* of first_bounce, sr */
};

/* Takes over the rows, also on an error. */
static lam_status make(first_rows *rows, lam_sky **out, lam_error *error) {
    lam_sky *made = memory_allocate(1, sizeof *made, "the sky", error);
    if (made == NULL) {
        first_rows_free(rows);
        return LAM_ERR_MEMORY;
    }
    made->rows = *rows;
    *out = made;
    return LAM_OK;
}

lam_status sky_load(store *s, size_t n, lam_sky **out, lam_error *error) {
    lam_status status = LAM_OK;
    first_rows rows;
    if (!store_has(s, STORE_SKY)) {
        *out = NULL;
        return LAM_OK;
    }
    TRY(first_rows_load(s, STORE_SKY "/first_bounce", "tile", n, NULL, &rows, error));
    TRY(make(&rows, out, error));
done:
    return status;
}

lam_status sky_create(size_t n_tiles, size_t n, const float *first_bounce, lam_sky **out, lam_error *error) {
    lam_status status = LAM_OK;
    first_rows rows;
    TRY(first_rows_copy(n_tiles, n, first_bounce, &rows, error));
    TRY(make(&rows, out, error));
done:
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
    first_rows_free(&sky->rows);
    free(sky);
}

size_t lam_sky_tiles(const lam_sky *sky) {
    return sky->rows.m;
}

size_t lam_sky_elements(const lam_sky *sky) {
    return sky->rows.n;
}

const float *sky_first_bounce(const lam_sky *sky) {
    return sky->rows.values;
}

void lam_sky_irradiance(const lam_sky *sky, size_t n_rows, const float *L, float *H0) {
    first_rows_apply(&sky->rows, n_rows, L, NULL, false, H0);
}

void sky_irradiance_double(const lam_sky *sky, size_t n_rows, const double *L, double *H0) {
    memset(H0, 0, n_rows * sky->rows.n * sizeof *H0);
    first_rows_apply_double(&sky->rows, n_rows, L, NULL, H0);
}

void lam_sky_adjoint(const lam_sky *sky, size_t n_rows, const float *g, float *L) {
    first_rows_adjoint(&sky->rows, n_rows, g, NULL, L);
}
