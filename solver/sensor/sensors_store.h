/* Sensors in a store (/sensors, store/FORMAT.md). */
#ifndef LAMBERT_SENSOR_SENSORS_STORE_H
#define LAMBERT_SENSOR_SENSORS_STORE_H

#include "solver/figures/glare.h"
#include "solver/sensor/sensor_rows.h"
#include "solver/sensor/sensors.h"
#include "store/store.h"

/* The luminaires of the store, and their light at the receivers. */
typedef struct sensors_lit {
    size_t n_luminaires;
    const float *H;     /* [n_luminaires][n] */
    const bool *inside; /* [n], receivers in the opening of one; NULL: none */
    size_t n_eyes;
    const uint32_t *eyes;     /* [n_eyes], receivers that are eyes, ascending */
    const glare_source *seen; /* [n_luminaires][n_eyes] */
} sensors_lit;

/* Writes a list and its rows; receivers of whose rays most meet backs, and those inside of luminaires, are
 * marked. Errors: those of the store, LAM_ERR_MEMORY. */
lam_status sensors_save(const sensor_list *l, const sensor_rows *rows, const sensors_lit *lit, store *s,
                        lam_error *error);

/* Writes the light of luminaires at the n sensors of the store `from`, of which all else is copied, and their
 * flags. Errors: those of both stores, LAM_ERR_MEMORY. */
lam_status sensors_save_lit(store *from, size_t n, const sensors_lit *lit, store *to, lam_error *error);

/* The arrays that it writes are luminaires, flags, eyes and seen of /sensors. */
bool sensors_are_lit_by(const char *array);

/* Reads the list, so that rows can be found anew; *out is empty where the store has none. Freed by
 * sensors_free. Errors: LAM_ERR_FORMAT, LAM_ERR_DAMAGED, LAM_ERR_MEMORY. */
lam_status sensors_load_list(store *s, sensor_list *out, lam_error *error);

#endif
