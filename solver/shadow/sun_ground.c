#include "solver/shadow/sun_ground.h"

#include <math.h>

void sun_ground_find(const sky_tiling *tiling, double albedo, const float *first_bounce, size_t n,
                     const float (*normal)[3], float *ground) {
    for (size_t i = 0; i < n; i++) {
        const double up = (double)tiling->sign[2] * (double)normal[i][tiling->axis[2]];
        double least = albedo * fmax(0, 1 - up) / 2;
        for (size_t t = 0; t < tiling->n_tiles; t++)
            least = fmin(least, (double)first_bounce[t * n + i] / tiling->tiles[t].cosine);
        ground[i] = (float)least;
    }
}

void sun_ground_at(const sky_tiling *tiling, double albedo, const float *sky, size_t n,
                   const placed_receiver *receivers, float *ground) {
    double up[3] = {0, 0, 0};
    up[tiling->axis[2]] = (double)tiling->sign[2];
    for (size_t i = 0; i < n; i++) {
        double least = albedo * receiver_weight_below(&receivers[i], up);
        for (size_t t = 0; t < tiling->n_tiles; t++)
            least = fmin(least, (double)sky[t * n + i] / tiling->tiles[t].cosine);
        ground[i] = (float)least;
    }
}
