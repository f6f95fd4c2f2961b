/* Answers at sensors in files of other programs: points for ParaView (.vtu), and the folder of results that
 * Honeybee reads. */
#ifndef LAMBERT_VERBS_SENSOR_FILES_H
#define LAMBERT_VERBS_SENSOR_FILES_H

#include "solver/verbs/solve_sensors.h"

/* Writes the receivers that have a value as points: of each a column for each vector and channel, its normal
 * and the number of its set, in the order in which sets were chosen. A failed write is seen by
 * ferror(stream). */
void sensor_points_vtu(const sensor_choice *c, const solution *s, FILE *stream);

/* True for a path that ends in '/'. */
bool sensor_results_named(const char *path);

/* LAM_ERR_IO unless the folder is there and can be written, or can be made. For a check before long work. */
lam_status sensor_results_check(const char *path, lam_error *error);

/* Writes a folder of results, as annual studies of Honeybee have it; values are of one channel:
 *   NAME.ill           of each set: a row for each receiver, a column for each hour with light, by tabs
 *   sun-up-hours.txt   the hours: when each begins, counted from the beginning of the year
 *   NAME.res           of one light in place of both: a number a line
 *   grids_info.json    [{"name", "identifier", "full_id", "group": "", "count"}]
 * A receiver without a value is nan. NAME is the name of the set with '_' for all but letters, digits, '-'
 * and '.'. Each file is whole or not there; grids_info.json is the last. Errors: LAM_ERR_ARGUMENT (hours that
 * are not known, figures of a year, more channels), LAM_ERR_IO, LAM_ERR_MEMORY. */
lam_status sensor_results_write(const sensor_choice *c, const solution *s, const char *path,
                                lam_error *error);

#endif
