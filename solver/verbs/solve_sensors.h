/* The answers of `lambert solve` at sensors, --sensors: a table of sets, CSV, JSON, NPY, and what
 * sensor_files.h has. */
#ifndef LAMBERT_VERBS_SOLVE_SENSORS_H
#define LAMBERT_VERBS_SOLVE_SENSORS_H

#include "solver/base/options/options.h"
#include "solver/light/emission.h"
#include "solver/output/output.h"
#include "store/store.h"

/* Thresholds at most. */
enum { SENSOR_LEAST_MOST = 16 };

/* The sensors of a store, and the sets of them that are asked for, in this order. Freed by
 * sensor_choice_free. */
typedef struct sensor_choice {
    lam_sensors *all;     /* NULL: none are asked for */
    size_t n_sets, n;     /* of the sets chosen, and of their receivers */
    size_t *sets;         /* [n_sets] */
    const double *begins; /* [vectors]: hours from the beginning of the year, where each vector is one;
                             borrowed, NULL: they are not known */
    size_t n_least;       /* thresholds of --at-least */
    double least[SENSOR_LEAST_MOST];
    double *stated; /* [n_sets], the stated error of each; NULL: none is stated */
} sensor_choice;

/* The word for all sets. */
#define SENSORS_ALL "all"

/* names: NAME,NAME or SENSORS_ALL. Errors: LAM_ERR_ARGUMENT (a store without sensors, an unknown name), those
 * of the store, LAM_ERR_MEMORY. */
lam_status sensor_choice_open(store *s, const mesh *m, const char *names, sensor_choice *out,
                              lam_error *error);
void sensor_choice_free(sensor_choice *c);

/* The value of a vector and channel, row = v C + c, at a receiver; NaN where it has none. */
double sensor_value(const sensor_choice *c, const solution *s, size_t row, size_t receiver);

/* Reads X,X: numbers, ascending or not, in the unit of the answer. Errors: LAM_ERR_ARGUMENT. */
lam_status sensor_choice_least(const char *text, sensor_choice *out, lam_error *error);

/* Checks the extension of a file: .csv, .json, .npy or .vtu, or a folder, whose name ends in '/'. Errors:
 * LAM_ERR_ARGUMENT. */
lam_status solve_sensors_check(const char *path, lam_error *error);

/* Writes irradiances s->values [n_vectors][C][sensors of the store], the answers to a light: to path, or,
 * where that is NULL, to standard output, as a table or as JSON, both with figures of sets and of eyes. suns
 * [n_vectors]: the ways to the sun in the axes of the scene, 0 where none shines; NULL: not known. A
 * receiver without a value is NaN in NPY, null in JSON, empty in CSV and left out of figures. Errors:
 * LAM_ERR_IO, LAM_ERR_MEMORY. */
lam_status solve_sensors_put(const sensor_choice *c, const solution *s, const emission *light,
                             const double (*suns)[3], const char *path, bool as_json, lam_error *error);

#endif
