/* The suns of a request: what they give directly to each element. */
#ifndef LAMBERT_SERVER_ROUTE_SUN_ANSWER_H
#define LAMBERT_SERVER_ROUTE_SUN_ANSWER_H

#include "server/route/call.h"

/* Shares are irradiances, of that of a plane normal to the sun. Starts zeroed. */
typedef struct sun_answer {
    float *shares;     /* [n_suns][n]; NULL: no sun shines */
    float *at_sensors; /* [n_suns][receivers], of a request at sensors; else NULL */
} sun_answer;

/* Makes the rays of the scene if a sun is asked for, and room for its shares. False with *why. */
bool sun_answer_begin(const call *in, const radiosity_request *request, sun_answer *out, problem *why);
void sun_answer_free(sun_answer *s);

/* Casts the rays of the suns of vectors first ... first + count - 1. False where the request is no longer
 * wanted, which is looked at before each sun. */
bool sun_answer_find(call *in, const radiosity_request *request, size_t first, size_t count, sun_answer *s);

/* Seconds of that for a vector of a request with suns, roughly. */
double sun_answer_cost(const scene *of);

/* Adds the light of these suns to H0 [count][C][n], that of vectors first ... first + count - 1; in double
 * for refined answers. */
void sun_answer_add(const scene *of, const radiosity_request *request, const sun_answer *s, size_t first,
                    size_t count, float *H0);
void sun_answer_add_double(const scene *of, const radiosity_request *request, const sun_answer *s,
                           size_t first, size_t count, double *H0);

#endif
