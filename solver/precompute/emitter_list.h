/* --emitters FILE|group=NAME,...|sky|luminaires: the emitters that alone are going to shine, once the scene
 * is read. Its luminaires join them. */
#ifndef LAMBERT_PRECOMPUTE_EMITTER_LIST_H
#define LAMBERT_PRECOMPUTE_EMITTER_LIST_H

#include "solver/light/emission.h"
#include "solver/luminaire/placed.h"

#define EMITTERS_LUMINAIRES "luminaires"

typedef struct emitter_list {
    size_t s;       /* 0: none, or luminaires alone */
    char **names;   /* [s], one block freed by one free() */
    emission light; /* E, and L where some are of the sky: s vectors */
    size_t n_luminaires;
    const char **luminaires; /* [n_luminaires], names owned by the scene */
    double *factors;         /* [C][n_luminaires], their colours */
} emitter_list;

void emitter_list_free(emitter_list *list);

/* All of them; 0: the store answers any emission. */
static inline size_t emitter_list_count(const emitter_list *list) {
    return list->s + list->n_luminaires;
}

/* sky: every tile of a sky of n_tiles with radiance 1; group=NAME,NAME: each of these groups with 1 W/m2;
 * luminaires: no others than these; else a file of emissions as emission_read takes it, an emitter each. The
 * luminaires of the scene come behind, with dimmers for weights; they outlive the list. Errors:
 * LAM_ERR_ARGUMENT (also a luminaire with the name of an emitter), _IO, _FORMAT, _MEMORY name the option, the
 * file and the place. */
lam_status emitter_list_read(const char *text, const mesh *m, size_t n_tiles, const placed_luminaires *placed,
                             emitter_list *out, lam_error *error);

#endif
