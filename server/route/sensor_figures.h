/* Reductions of sensors to figures by their columns (server/scene/sensor_columns.h): of requests whose light
 * is that of whole groups, of luminaires and of tiles, or of the emitters of a store of few. */
#ifndef LAMBERT_SERVER_ROUTE_SENSOR_FIGURES_H
#define LAMBERT_SERVER_ROUTE_SENSOR_FIGURES_H

#include "server/route/call.h"
#include "solver/codec/answer.h"

typedef struct sensor_figures sensor_figures;

/* Lights of a request that columns answer, at most; and numbers of their columns together. */
enum { SENSOR_LIGHTS_MOST = 1024 };
#define SENSOR_NUMBERS_MOST ((size_t)1 << 23)

/* *out is NULL where columns do not answer a request: its vectors do then. That follows from scene and
 * request alone, so that an answer has the same bits whatever is kept. False with *why; freed by
 * sensor_figures_free also then. Notes begin as those of the store (scene_note_error), and refer to *out. */
bool sensor_figures_begin(call *in, radiosity_request *request, answer_notes *notes, sensor_figures **out,
                          problem *why);

/* A step of some milliseconds: columns that are missing, then vectors, then the text; *done once that is
 * whole. False with *why. */
bool sensor_figures_step(call *in, const radiosity_request *request, sensor_figures *f,
                         batch_workspace *workspace, answer_notes *notes, buffer *b, bool *done,
                         problem *why);

/* NULL is allowed. */
void sensor_figures_free(const scene *s, sensor_figures *f);

/* Answers at once where all columns are there and the work is well below a millisecond; false, with nothing
 * done, elsewhere. */
bool sensor_figures_quick(call *in, radiosity_request *request, answer_notes *notes, buffer *b);

#endif
