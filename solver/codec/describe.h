/* The description of a store: the JSON of `lambert info --json` and of GET /v1/scenes/NAME. */
#ifndef LAMBERT_CODEC_DESCRIBE_H
#define LAMBERT_CODEC_DESCRIBE_H

#include "store/store.h"

#include <jansson.h>

/* *out is a new reference. Reads attributes and the groups, not the operator. */
lam_status describe_store(store *s, json_t **out, lam_error *error);

/* A whole number where x is one, so that 200 is not written 200.0. */
json_t *describe_number(double x);

#endif
