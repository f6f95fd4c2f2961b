/* Request bytes to a cotangent and what is asked of it. No I/O. */
#ifndef LAMBERT_CODEC_ADJOINT_H
#define LAMBERT_CODEC_ADJOINT_H

#include "solver/codec/request.h"

typedef enum gradient_kind {
    GRADIENT_EMISSION,
    GRADIENT_REFLECTANCE,
    GRADIENT_SKY,
    GRADIENT_EMITTERS,
    GRADIENT_GROUPS,     /* by one emission that all elements of a group have */
    GRADIENT_LUMINAIRES, /* by their dimmers */
    GRADIENT_COUNT
} gradient_kind;

/* Starts zeroed. */
typedef struct adjoint_request {
    radiosity_request
        cotangent;           /* E is g [n_rhs][C][n]; at_sensors: its `sensors` are g [n_rhs][C][s] in
                                place of that, and the quantity is what they are gathered from, radiosity */
    radiosity_request light; /* E, sky and luminaires of `emission`; n_rhs is 0 without it */
    lam_quantity quantity;
    gradient_kind named[GRADIENT_COUNT];
    size_t n_named;
    unsigned wanted; /* a bit for each gradient of the answer */
} adjoint_request;

void adjoint_request_free(adjoint_request *request);

/* The word of a gradient in requests and answers. */
const char *gradient_name(gradient_kind kind);

static inline bool adjoint_wants(const adjoint_request *request, gradient_kind kind) {
    return (request->wanted & 1u << kind) != 0;
}

/* Both as codec_read_json. Without `gradient`, emission is meant; with emission a store's sky is, and its
 * luminaires, and in a store of few emitters that by these and luminaires. 422 also for what the store has
 * not, and for reflectance without emission. */
bool codec_read_adjoint_json(const codec_scene *scene, const char *text, size_t length,
                             adjoint_request *request, problem *why);

/* An array is a cotangent of radiosity, or a batch of them, in the shapes of codec_read_npy, whose gradient
 * by emission (or emitters) alone is asked for. */
bool codec_read_adjoint_npy(const codec_scene *scene, const char *bytes, size_t length,
                            adjoint_request *request, problem *why);

#endif
