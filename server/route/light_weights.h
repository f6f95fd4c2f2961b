/* The light of a request as weights of the emitters of a store of few. */
#ifndef LAMBERT_SERVER_ROUTE_LIGHT_WEIGHTS_H
#define LAMBERT_SERVER_ROUTE_LIGHT_WEIGHTS_H

#include "server/route/call.h"
#include "solver/codec/request.h"

/* Weights [n_rhs][C][s] of all that a request has, whose spots are expanded (radiosity_request_expand): those
 * of its emissions and skies, those that it gives, and its dimmers. The caller frees. NULL with *why: 422 for
 * light that the emitters do not send, 503. */
float *light_weights_find(const call *in, const radiosity_request *request, problem *why);

/* Fills request->seen_sky where its weights of emitters are of a sky, so that sensors know the radiances of
 * its tiles (request_sky_seen). False with *why: 503. */
bool light_weights_see_sky(const call *in, radiosity_request *request, problem *why);

#endif
