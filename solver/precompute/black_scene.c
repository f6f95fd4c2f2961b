#include "solver/precompute/black_scene.h"

#include <string.h>

static const float reflects = 0x1p-10f;

bool black_scene_lighten(mesh *m) {
    const size_t count = m->n * m->n_channels;
    if (m->textures != NULL) return false;
    for (size_t k = 0; k < count; k++)
        if (m->reflectance[k] > 0) return false;
    for (size_t k = 0; k < count; k++) m->reflectance[k] = reflects;
    return true;
}

void black_scene_darken(mesh *m) {
    memset(m->reflectance, 0, m->n * m->n_channels * sizeof *m->reflectance);
}
