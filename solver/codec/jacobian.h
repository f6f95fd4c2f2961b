/* Request bytes to the rows and the lights of a matrix of derivatives. No I/O. */
#ifndef LAMBERT_CODEC_JACOBIAN_H
#define LAMBERT_CODEC_JACOBIAN_H

#include "solver/codec/request.h"

/* The kinds of columns, lam_by, are so many. */
enum { JACOBIAN_KINDS = LAM_BY_EMITTERS + 1 };

/* The word of a kind in requests and answers. */
const char *jacobian_name(lam_by kind);

/* The kinds of rows: values of sensors, means of groups and values of elements. */
typedef enum jacobian_of { JACOBIAN_AT_SENSORS, JACOBIAN_OF_GROUPS, JACOBIAN_OF_ELEMENTS } jacobian_of;

/* Starts zeroed; freed by jacobian_request_free. */
typedef struct jacobian_request {
    jacobian_of kind;
    radiosity_request of; /* receivers, with names of sets in the order asked in reduce; or names of groups
                             likewise; or selected elements; and the quantity */
    lam_by by[JACOBIAN_KINDS]; /* in the order asked */
    size_t n_by;
} jacobian_request;

void jacobian_request_free(jacobian_request *request);

/* Rows: receivers, names or elements. */
size_t jacobian_rows(const jacobian_request *request);

/* Reads {"of": {"sensors": [NAME, ...]} | {"groups": [NAME, ...]} | {"elements": [INDEX, ...]},
 * "by": [WORD, ...], "quantity": WORD}. Without `by` all that the store has; sensors have irradiance, all
 * others radiosity unless the quantity is given. False with *why; 422 for what the store has not. */
bool codec_read_jacobian_json(const codec_scene *scene, const char *text, size_t length,
                              jacobian_request *request, problem *why);

#endif
