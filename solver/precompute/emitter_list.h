/* --emitters FILE|group=NAME,...|sky: the emitters that alone are going to shine, once the scene is read. */
#ifndef LAMBERT_PRECOMPUTE_EMITTER_LIST_H
#define LAMBERT_PRECOMPUTE_EMITTER_LIST_H

#include "solver/light/emission.h"

typedef struct emitter_list {
    size_t s;       /* 0: none */
    char **names;   /* [s], one block freed by one free() */
    emission light; /* E, and L where some are of the sky: s vectors */
} emitter_list;

void emitter_list_free(emitter_list *list);

/* sky: every tile of a sky of n_tiles with radiance 1; group=NAME,NAME: each of these groups with 1 W/m2;
 * else a file of emissions as emission_read takes it, an emitter each. Errors: LAM_ERR_ARGUMENT, _IO,
 * _FORMAT, _MEMORY name the option, the file and the place. */
lam_status emitter_list_read(const char *text, const mesh *m, size_t n_tiles, emitter_list *out,
                             lam_error *error);

#endif
