/* The light of a request whose vectors are not all expanded: what the laws of stated errors need of it.
 * Private to server/scene. */
#ifndef LAMBERT_SERVER_SCENE_REQUEST_LIGHT_H
#define LAMBERT_SERVER_SCENE_REQUEST_LIGHT_H

#include "server/scene/scene.h"
#include "solver/operator/stated/answer_error.h"

/* The radiances of the sky of vector v, [C][m]; NULL: it has none. */
const float *request_sky(const scene *s, const radiosity_request *request, size_t v);

/* The same of the sky as sensors see it, with that of weights of emitters, once seen_sky of the request is
 * filled (server/route/light_weights.h). */
const float *request_sky_seen(const scene *s, const radiosity_request *request, size_t v);

/* The dimmers of the luminaires of vector v, [C][k]; NULL: it has none. */
const float *request_dimmers(const scene *s, const radiosity_request *request, size_t v);

/* Fills sizes, whole, and of weights of emitters sums and L; emission is work. Cost: as long as the request
 * is, and O(C n) for each vector that is expanded or of emitters. False when memory is short. */
bool request_sizes(const scene *s, const radiosity_request *request, mean_errors *to);

/* True where weights of emitters are given, some of which may be of the sky. */
bool request_has_sky_weights(const scene *s, const radiosity_request *request);

/* True where the error of the answer's own emission can be told: the store states errors by group, of the
 * light that it has. */
bool request_has_own_error(const scene *s, const radiosity_request *request, const answer_notes *notes);

/* The same of the store alone: whether the laws of its errors hold of light with a sky, or with luminaires.
 */
bool scene_states_errors(const scene *s, bool sky, bool luminaires);

/* The light of one vector of an answer. */
typedef struct vector_light {
    const float *E, *H0, *L; /* [C][n], [C][m]; NULL: none */
} vector_light;

/* Writes the light of few emitters, by weights [C][s], into own, which is [2][C][n] and then [C][m]. False
 * when memory is short. */
bool light_of_weights(const scene *s, const float *weights, float *own, vector_light *out);

/* Floats that light_of_weights writes, of a scene that states errors by group. */
size_t light_of_weights_room(const scene *s);

/* The size of the sky L [C][m]; NULL: there is none. */
emission_size request_sky_size(const scene *s, const float *L);

/* Work for the light that elements send on: vectors [C][n] and [n]. */
typedef struct sent_light {
    float *luminaires; /* [C][n], their irradiance; NULL: no vector has any */
    float *H;          /* [n], of suns and luminaires; NULL: there is neither */
    float *work;       /* [2][n] */
} sent_light;

/* sun: whether the request has any. False when memory is short; freed by sent_light_free also then. */
bool sent_light_allocate(const scene *s, const radiosity_request *request, bool sun, sent_light *out);
void sent_light_free(sent_light *l);

/* Fills the sizes of the light that vector v sends on: of its emission E [C][n] with what is reflected of its
 * suns, of shares sun [n_suns][n] or NULL, and of its luminaires, and of this alone. */
void sent_light_size(const scene *s, const radiosity_request *request, size_t v, const float *E,
                     const float *sun, sent_light *l, error_answer *of);

#endif
