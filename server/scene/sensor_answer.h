/* The answers of a request at the sensors of its scene, gathered from radiosities of all elements. */
#ifndef LAMBERT_SERVER_SCENE_SENSOR_ANSWER_H
#define LAMBERT_SERVER_SCENE_SENSOR_ANSWER_H

#include "server/scene/scene.h"

/* Receivers of the scene; 0: it has none. */
size_t scene_sensors(const scene *s);

/* The word for the places of a request at sensors, "sensors" or "probes". */
const char *sensor_places_word(const radiosity_request *request);

/* The unit of coefficients of probes, by that of irradiance; NULL: they have none in it. */
const char *probe_unit(const char *unit);

/* False with *why for probes among sensors, or these among probes, for figures of probes, and for ratings of
 * other sets than of eyes. */
bool sensor_request_check(const scene *s, const radiosity_request *request, const char *unit, problem *why);

/* Numbers of a vector in a channel: of those selected, or with reduce of all receivers of the scene. */
size_t sensor_values(const scene *s, const radiosity_request *request);

/* out [count][C][sensor_values] of B [count][C][n], the radiosities of vectors first ... first + count - 1,
 * with sun [n_suns][receivers], what each sun of the request gives directly (NULL: none shines). NaN where a
 * receiver has no value. work is [C][receivers]. */
void sensor_values_find(const scene *s, const radiosity_request *request, size_t first, size_t count,
                        const float *B, const float *sun, float *work, float *out);

/* Adds the suns of vector v to values [C][receivers]. */
void sensor_values_add_suns(const scene *s, const radiosity_request *request, size_t v, const float *sun,
                            float *values);

/* The same of a refined answer, whose certificates [count] become those of these values: an error of B of at
 * most e is one of at most e times the largest sum of a row. work is [C][receivers + tiles + luminaires]. */
void sensor_values_find_double(const scene *s, const radiosity_request *request, size_t first, size_t count,
                               const double *B, const float *sun, double *work, double *out,
                               double *certificates);
size_t sensor_values_work(const scene *s);

#endif
