/* The light of a request whose vectors are not all expanded: what the laws of stated errors need of it.
 * Private to server/scene. */
#ifndef LAMBERT_SERVER_SCENE_REQUEST_LIGHT_H
#define LAMBERT_SERVER_SCENE_REQUEST_LIGHT_H

#include "server/scene/scene.h"

/* The radiances of the sky of vector v, [C][m]; NULL: it has none. */
const float *request_sky(const scene *s, const radiosity_request *request, size_t v);

/* Fills sizes, whole, and of weights of emitters sums and L; emission is work. Cost: as long as the request
 * is, and O(C n) for each vector that is expanded or of emitters. False when memory is short. */
bool request_sizes(const scene *s, const radiosity_request *request, mean_errors *to);

#endif
