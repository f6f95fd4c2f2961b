/* Values of lists in JSON, of luminaires and of sensors: each is checked, and what is wrong is told with the
 * place of its entry, its value and its limit. */
#ifndef LAMBERT_LUMINAIRE_LIST_VALUES_H
#define LAMBERT_LUMINAIRE_LIST_VALUES_H

#include "solver/luminaire/luminaire_source.h"

#include <jansson.h>

/* A coordinate is below it in any unit, so that all sums are finite. */
#define LIST_LENGTH_MOST 1e9

/* The object of a text, freed with json_decref. Errors: LAM_ERR_FORMAT with line and column, LAM_ERR_MEMORY.
 */
lam_status list_open(const luminaire_source *s, json_t **out, lam_error *error);

/* The metres of the unit of a list; value NULL: they stay. `name` is that of the file. */
lam_status list_unit(const char *name, const json_t *value, double *metres, lam_error *error);

/* A value as messages show it. */
enum { LIST_SHOWN = 64 };
void list_shown(const json_t *value, char out[LIST_SHOWN]);

/* Fails for a member of an object that is none of the words. */
lam_status list_members(json_t *object, size_t n, const char *const *words, const char *place,
                        lam_error *error);

/* Fails with the place of the entry, the member, its value and the limit in one line. */
lam_status list_wrong(const char *place, const char *what, const json_t *value, const char *limit,
                      lam_error *error);

/* A number from least to most; above: it must be above least. */
lam_status list_number(const char *place, const char *what, const json_t *value, double least, double most,
                       bool above, double *out, lam_error *error);

/* Three numbers; three that are not all 0, made a unit vector. */
lam_status list_vector(const char *place, const char *what, const json_t *value, double out[3],
                       lam_error *error);
lam_status list_direction(const char *place, const char *what, const json_t *value, double out[3],
                          lam_error *error);

/* Makes the length 1; false where there is none. */
bool list_normalize(double v[3]);

#endif
