/* Ratings of the eyes that a reduction of sensors asks for: their light, kept vector by vector, and their
 * text. */
#ifndef LAMBERT_SERVER_ROUTE_EYE_FIGURES_H
#define LAMBERT_SERVER_ROUTE_EYE_FIGURES_H

#include "server/scene/scene.h"

typedef struct eye_figures eye_figures;

/* Bytes that ratings and their text take, at most; 0 where none are asked for. */
size_t eye_figures_bytes(const scene *s, const radiosity_request *request);

/* *out is NULL where none are asked for; freed by eye_figures_free. False when memory is short. */
bool eye_figures_create(const scene *s, const radiosity_request *request, eye_figures **out);
void eye_figures_free(eye_figures *e);

/* Numbers of the text, at most, and products of the ratings; 0 of NULL. */
size_t eye_figures_numbers(const eye_figures *e);
size_t eye_figures_work(const eye_figures *e);

/* Keeps the light of vectors first ... first + count; x [count][n_channels] is of all receivers. NULL is
 * allowed. */
void eye_figures_take(eye_figures *e, size_t first, size_t count, size_t n_channels, reduce_values x);

/* Goes on, by an eye at least, with the text of those of a name in the light of a vector, until the time of
 * clock_ms; *whole once it is written:
 *     [{"ugr":16.1,"background":21,"luminaires":[{"name":...,"part":...},...]},...]
 * with "why" beside a null. A batch has no luminaires. in_lux is false where the answer is in another unit.
 */
bool eye_figures_write(eye_figures *e, bool in_lux, size_t name, size_t vector, double until, bool *whole,
                       buffer *b);

#endif
