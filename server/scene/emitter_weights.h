/* For a store of few emitters: which of them, how bright, are one group of the scene alone, or one tile of
 * its sky. What is told for each is told for every sum of them, so that such an emission needs no vector. */
#ifndef LAMBERT_SERVER_SCENE_EMITTER_WEIGHTS_H
#define LAMBERT_SERVER_SCENE_EMITTER_WEIGHTS_H

#include <stdbool.h>

typedef struct scene scene;

/* Immutable once made; of a channel in which no weights give the group or tile, the first weight is NaN. */
typedef struct emitter_weights {
    float *of_group; /* [groups][C][s] */
    float *of_tile;  /* [m][C][s] */
} emitter_weights;

/* Whether there are few enough to try them: else nothing is told. */
bool emitter_weights_worth(const scene *s);

/* NULL when memory is short. O(n C) for each group and tile. The caller frees. */
emitter_weights *emitter_weights_make(const scene *s);
void emitter_weights_free(emitter_weights *weights);

#endif
