/* The options of the method emitters, for precompute, which reads their files and walks. */
#ifndef LAMBERT_METHOD_EMITTERS_OPTIONS_H
#define LAMBERT_METHOD_EMITTERS_OPTIONS_H

#include "solver/method/method.h"

typedef struct emitters_options {
    const char *emitters;         /* FILE, group=NAME, sky */
    const char *positions, *path; /* FILE.json of a moving light */
    uint64_t frames;              /* along path */
    const char *reuse;            /* "A" to "E" */
    uint64_t paths;               /* walks of each position */
} emitters_options;

/* The options of emitters among those of a build. */
const emitters_options *emitters_options_of(const build_options *options);

/* True where the emitters are positions of a light outside the mesh. */
static inline bool emitters_are_positions(const emitters_options *o) {
    return o->positions != NULL || o->path != NULL;
}

#endif
