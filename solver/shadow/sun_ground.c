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
        /* The nine harmonics of a probe, which have either sign, see as much of the ground as the first of
         * them does, which has none. */
        const size_t of = i - receiver_weight_order(receivers[i].kind);
        const double open = receiver_weight_below(&receivers[of], up);
        double least = albedo * open;
        for (size_t t = 0; t < tiling->n_tiles; t++)
            least = fmin(least, (double)sky[t * n + of] / tiling->tiles[t].cosine);
        ground[i] = (float)(open > 0 ? least * receiver_weight_below(&receivers[i], up) / open : 0);
    }
}
