/* The errors of an answer at sensors, set by set, as its notes tell them. */
#ifndef LAMBERT_SERVER_SCENE_SENSOR_ERRORS_H
#define LAMBERT_SERVER_SCENE_SENSOR_ERRORS_H

#include "server/scene/scene.h"
#include "solver/codec/sensor_error.h"

/* Zeroed: nothing is stated. */
typedef struct sensor_errors {
    name_error *names;       /* [names of the request] */
    sensor_squares *squares; /* [sets of the scene], of one vector */
    uint32_t *sets;          /* [n_sets], those that names mean, each once */
    size_t n_sets;
} sensor_errors;

/* Begins with the notes of the store (scene_note_error). Where the store states errors of the light of the
 * request the notes refer to the names, and squares are to be filled for each vector; else the notes say why
 * nothing is stated, and *out is zeroed. False when memory is short. */
bool sensor_errors_begin(const scene *s, const radiosity_request *request, answer_notes *notes,
                         sensor_errors *out);
void sensor_errors_free(sensor_errors *e);

/* Takes the squares of a vector: the larger error of each name, and of all together. */
void sensor_errors_take(const radiosity_request *request, sensor_errors *e, answer_notes *notes);

#endif
