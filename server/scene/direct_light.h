/* The direct irradiance of a request by the sky and the luminaires of its scene. That of suns is found by
 * rays (server/route/sun_answer.h). */
#ifndef LAMBERT_SERVER_SCENE_DIRECT_LIGHT_H
#define LAMBERT_SERVER_SCENE_DIRECT_LIGHT_H

#include "server/scene/scene.h"

/* Tiles of the scene's sky, and its luminaires; 0: it has none. */
size_t scene_tiles(const scene *s);
size_t scene_luminaires(const scene *s);

/* True where a vector of a request has light of a sky or of luminaires. */
static inline bool request_has_direct(const radiosity_request *request) {
    return request->sky.values != NULL || request->luminaires.values != NULL;
}

/* Sets H0 [count][C][n] to that of vectors first ... first + count - 1 of a request, which may have none.
 * O(C n) for each tile and luminaire that shines. */
void direct_light_find(const scene *s, const radiosity_request *request, size_t first, size_t count,
                       float *H0);

/* The same for refined answers; work is [count][C][max(m, k)]. */
void direct_light_find_double(const scene *s, const radiosity_request *request, size_t first, size_t count,
                              double *work, double *H0);
size_t direct_light_work(const scene *s, const radiosity_request *request);

#endif
