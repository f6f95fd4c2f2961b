/* Request bytes to emission vectors: what is asked of a scene. No I/O, so that it can be fuzzed.
 * Knows nothing of HTTP but the status that a refusal has. */
#ifndef LAMBERT_SERVER_CODEC_REQUEST_H
#define LAMBERT_SERVER_CODEC_REQUEST_H

#include "lambert/lambert.h"
#include "server/groups.h"
#include "server/problem.h"

/* What a request is read against. */
typedef struct codec_scene {
    size_t n;
    size_t n_channels;
    const group_index *groups;
    size_t n_tiles;    /* of the sky; 0: none */
    size_t n_emitters; /* 0: none */
    size_t max_batch;  /* vectors in a request */
    size_t max_bytes;  /* of emission vectors in a request */
} codec_scene;

/* What stands beside the emissions of some vectors: [n][C][width], for the first n of them. */
typedef struct side_rows {
    float *values; /* NULL: no vector has any */
    size_t n, capacity;
} side_rows;

/* Starts zeroed. */
typedef struct radiosity_request {
    size_t n_rhs;
    bool batch;  /* the answer is one level deeper, also for one vector */
    float *E;    /* [n_rhs][C][n], mesh order */
    bool select; /* only these elements, in this order */
    uint32_t *selected;
    size_t n_selected;
    lam_quantity quantity;
    double tolerance; /* of a refined answer, above 0 and below 1; 0: none is asked for */

    side_rows sky;      /* radiances of its tiles */
    side_rows emitters; /* their weights */

    size_t capacity; /* vectors that E has room for */
} radiosity_request;

void radiosity_request_free(radiosity_request *request);

/* Both return false with *why filled; request must be freed either way.
 * text[length] must be NUL. 400: not JSON, or not NPY; 422: what the contract lists; 501: not supported yet.
 */
bool codec_read_json(const codec_scene *scene, const char *text, size_t length, radiosity_request *request,
                     problem *why);

/* NPY format 1.0 to 3.0, little-endian <f4 or <f8, C order. For one channel [n], or a batch [m][n] or
 * [m][1][n]; for more channels [n] (all alike), [C][n], or a batch [m][C][n]. */
bool codec_read_npy(const codec_scene *scene, const char *bytes, size_t length, radiosity_request *request,
                    problem *why);

/* Room for one more vector, zeroed: *E is its [C][n]. */
bool radiosity_request_add(radiosity_request *request, const codec_scene *scene, float **E, problem *why);

/* The sky over the last vector, or the weights of its emitters, zeroed: *row is its [C][m], or [C][s]; so are
 * those of the vectors before it that have none. */
bool radiosity_request_sky(radiosity_request *request, const codec_scene *scene, float **row, problem *why);
bool radiosity_request_emitters(radiosity_request *request, const codec_scene *scene, float **row,
                                problem *why);

/* The contract's word for a quantity. */
const char *codec_quantity_name(lam_quantity quantity);

#endif
