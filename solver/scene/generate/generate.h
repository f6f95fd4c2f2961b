/* The generated scenes, written as OBJ + MTL. */
#ifndef LAMBERT_SCENE_GENERATE_GENERATE_H
#define LAMBERT_SCENE_GENERATE_GENERATE_H

#include "solver/base/progress.h"

#include <stdint.h>

typedef struct generate_options {
    const char *kind;    /* one of generate_kind */
    double size[3];      /* box, metres; 1,1,1 */
    unsigned divisions;  /* box: M, exactly 6 M^2 faces; 0: not set */
    bool closed;         /* cornell */
    unsigned variant;    /* city: 1, 2 or 3 */
    const char *terrain; /* city: "flat", "valley" or "hill" */
    size_t elements;     /* about this many faces; 0: not set */
    double reflectance;  /* for every face, grey (emission turns grey too); negative: the scene's own */
    uint64_t seed;
} generate_options;

/* The name of the k-th kind of scene; NULL after the last. */
const char *generate_kind(size_t k);

/* Writes path (an .obj) and its .mtl beside it, each written aside and renamed.
 * LAM_ERR_ARGUMENT for an unknown kind.
 */
lam_status scene_generate(const generate_options *options, const char *path, size_t *faces, lam_error *error);

#endif
