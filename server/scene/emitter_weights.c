#include "server/scene/emitter_weights.h"

#include "server/scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Numbers looked at to try all groups and tiles (some tenths of a second), and weights that are kept. */
#define MOST_WORK ((double)(1u << 28))
#define MOST_WEIGHTS ((double)(1u << 24))

static size_t tiles_of(const scene *s) {
    return s->sky != NULL ? lam_sky_tiles(s->sky) : 0;
}

bool emitter_weights_worth(const scene *s) {
    const double C = (double)s->n_channels, count = (double)(s->groups.n_groups + tiles_of(s));
    return count * C * C * (double)(s->n + tiles_of(s)) <= MOST_WORK &&
           count * C * (double)s->n_emitters <= MOST_WEIGHTS;
}

/* What gives this E and L (either NULL) of one channel alone, the others being dark; the first is NaN where
 * nothing does. all: [C][s]. */
static void tell(const scene *s, size_t c, const float *E, const float *L, float *all, float *weights) {
    const size_t n_emitters = s->n_emitters;
    if (lam_operator_weights(s->op, 1, E, tiles_of(s), L, all, NULL) == LAM_OK)
        memcpy(weights, all + c * n_emitters, n_emitters * sizeof *weights);
    else
        weights[0] = NAN;
}

static void tell_groups(const scene *s, float *E, float *all, float *weights) {
    const group_index *groups = &s->groups;
    for (size_t g = 0; g < groups->n_groups; g++)
        for (size_t c = 0; c < s->n_channels; c++, weights += s->n_emitters) {
            for (size_t e = groups->start[g]; e < groups->start[g + 1]; e++)
                E[c * s->n + groups->elements[e]] = 1;
            tell(s, c, E, NULL, all, weights);
            for (size_t e = groups->start[g]; e < groups->start[g + 1]; e++)
                E[c * s->n + groups->elements[e]] = 0;
        }
}

static void tell_tiles(const scene *s, float *L, float *all, float *weights) {
    const size_t m = tiles_of(s);
    for (size_t t = 0; t < m; t++)
        for (size_t c = 0; c < s->n_channels; c++, weights += s->n_emitters) {
            L[c * m + t] = 1;
            tell(s, c, NULL, L, all, weights);
            L[c * m + t] = 0;
        }
}

emitter_weights *emitter_weights_make(const scene *s) {
    const size_t C = s->n_channels, row = C * s->n_emitters, m = tiles_of(s);
    emitter_weights *made = memory_allocate(1, sizeof *made, "weights", NULL);
    float *E = memory_allocate(C, (s->n > m ? s->n : m) * sizeof *E, "weights", NULL);
    float *all = memory_allocate(row, sizeof *all, "weights", NULL);
    if (made != NULL) {
        made->of_group = memory_allocate(s->groups.n_groups, row * sizeof(float), "weights", NULL);
        made->of_tile = memory_allocate(m, row * sizeof(float), "weights", NULL);
    }
    const bool good =
        made != NULL && made->of_group != NULL && made->of_tile != NULL && E != NULL && all != NULL;
    if (good) {
        tell_groups(s, E, all, made->of_group);
        tell_tiles(s, E, all, made->of_tile);
    } else {
        emitter_weights_free(made);
    }
    free(E);
    free(all);
    return good ? made : NULL;
}

void emitter_weights_free(emitter_weights *weights) {
    if (weights == NULL) return;
    free(weights->of_group);
    free(weights->of_tile);
    free(weights);
}
