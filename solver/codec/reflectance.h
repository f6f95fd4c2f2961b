/* Request bytes to the reflectances of a variant. No I/O, so that it can be fuzzed. */
#ifndef LAMBERT_CODEC_REFLECTANCE_H
#define LAMBERT_CODEC_REFLECTANCE_H

#include "solver/codec/problem.h"
#include "solver/operator/groups/groups.h"

/* Once, before any thread uses jansson: lets the readers below tell short memory from a wrong text. */
void reflectance_watch_memory(void);

/* The scene that a request is about. */
typedef struct reflectance_scene {
    size_t n;
    size_t n_channels;
    const group_index *groups;
    const float *reflectance; /* [C][n], for groups that the request does not name */
} reflectance_scene;

/* Starts zeroed. */
typedef struct reflectance_request {
    char *variant;      /* its name, without the scene's */
    float *reflectance; /* [C][n] */
    char *groups;       /* the JSON object that was given */
} reflectance_request;

void reflectance_request_free(reflectance_request *request);

/* {"variant":NAME, "groups":{GROUP: a number or one for each channel, ...}}; group names are those of
 * emissions; a reflectance below FLT_MIN (1.2e-38) counts as 0. False with *why filled; request must be freed
 * either way. 400: not JSON; 422: a request that the contract refuses, a reflectance outside [0, 1); 503. */
bool codec_read_reflectance(const reflectance_scene *scene, const char *text, size_t length,
                            reflectance_request *request, problem *why);

/* {"variant":NAME}; the caller frees *variant. */
bool codec_read_variant(const char *text, size_t length, char **variant, problem *why);

#endif
