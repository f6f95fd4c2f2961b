/* A solution on its mesh as binary glTF, for viewers that know no values: the light of the first vector as
 * colour, all of it as attributes of vertices. */
#include "solver/output/mesh_gltf.h"
#include "solver/output/output.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The value that is shown white, in means of the scene: what a lamp emits may be cut. */
#define WHITE_IN_MEANS 4

static float value_at(const void *context, size_t column, size_t element, size_t corner) {
    const solution *s = context;
    const size_t k = column * s->m->n + element;
    return s->corners != NULL ? s->corners[4 * k + corner] : (float)output_value(s, k);
}

/* The mean by area of the first vector. */
static double mean_of(const solution *s) {
    const mesh *m = s->m;
    double sum = 0, area = 0;
    for (size_t i = 0; i < m->n; i++) {
        area += m->area[i];
        for (size_t c = 0; c < m->n_channels; c++)
            sum += m->area[i] * output_value(s, c * m->n + i) / (double)m->n_channels;
    }
    return sum / area;
}

/* Names of attributes: _RADIOSITY_R; *names is one block, freed with free(). */
static lam_status name_columns(const solution *s, size_t count, char ***names, lam_error *error) {
    char **made = memory_allocate(count, sizeof *made + OUTPUT_COLUMN + 1, "glTF", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    char *at = (char *)(made + count);
    for (size_t k = 0; k < count; k++, at += OUTPUT_COLUMN + 1) {
        made[k] = at;
        at[0] = '_';
        output_column(s, k / s->m->n_channels, k % s->m->n_channels, at + 1);
        for (char *letter = at; *letter != '\0'; letter++) *letter = (char)toupper((unsigned char)*letter);
    }
    *names = made;
    return LAM_OK;
}

lam_status output_glb(const solution *s, FILE *stream, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = s->m;
    char **names = NULL;
    buffer b = {0};
    const double mean = mean_of(s);
    gltf_light light = {.n_columns = s->n_vectors * m->n_channels,
                        .value = value_at,
                        .context = s,
                        .white = mean > 0 && isfinite(mean) ? WHITE_IN_MEANS * mean : 1};
    TRY(name_columns(s, light.n_columns, &names, error));
    light.columns = (const char *const *)names;
    scene_glass glass;
    gltf_mesh of = mesh_gltf(s->materials != NULL ? s->materials : m, s->scene, s->groups, &glass);
    of.light = &light;
    TRY(gltf_write(&of, &b, error));
    fwrite(b.bytes, 1, b.length, stream);
done:
    free(names);
    buffer_free(&b);
    return status;
}
