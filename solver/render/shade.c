#include "solver/render/shade.h"

#include "solver/render/smooth.h"

#include <stdlib.h>
#include <string.h>

struct shade {
    const mesh *mesh;
    size_t n_channels;
    float *values;  /* [n][C]; NULL when smooth */
    float *corners; /* [C][n][4]; NULL unless smooth */
};

static lam_status set_corners(shade *s, const float *values, const float *E, lam_error *error) {
    lam_status status = LAM_OK;
    smooth_nodes nodes = {0};
    s->corners = memory_allocate(s->mesh->n, 4 * s->n_channels * sizeof *s->corners, "shading", error);
    if (s->corners == NULL) TRY(LAM_ERR_MEMORY);
    TRY(smooth_nodes_create(s->mesh, &nodes, error));
    TRY(smooth_corners(&nodes, s->mesh, s->n_channels, values, E, s->corners, error));
done:
    smooth_nodes_free(&nodes);
    return status;
}

lam_status shade_create(const mesh *m, size_t n_channels, const float *values, const float *E, bool smooth,
                        shade **out, lam_error *error) {
    lam_status status = LAM_OK;
    shade *s = memory_allocate(1, sizeof *s, "shading", error);
    if (s == NULL) return LAM_ERR_MEMORY;
    s->mesh = m;
    s->n_channels = n_channels < SHADE_MAX_CHANNELS ? n_channels : SHADE_MAX_CHANNELS;
    if (smooth) {
        TRY(set_corners(s, values, E, error));
    } else {
        s->values = memory_allocate(m->n, s->n_channels * sizeof(float), "shading", error);
        if (s->values == NULL) TRY(LAM_ERR_MEMORY);
        for (size_t c = 0; c < s->n_channels; c++)
            for (size_t i = 0; i < m->n; i++) s->values[i * s->n_channels + c] = values[c * m->n + i];
    }
    *out = s;
    s = NULL;
done:
    shade_destroy(s);
    return status;
}

void shade_destroy(shade *s) {
    if (s == NULL) return;
    free(s->corners);
    free(s->values);
    free(s);
}

size_t shade_channels(const shade *s) {
    return s->n_channels;
}

void shade_at(const shade *s, uint32_t element, const double point[3], float *values) {
    const mesh *m = s->mesh;
    if (s->corners == NULL) {
        memcpy(values, s->values + (size_t)element * s->n_channels, s->n_channels * sizeof *values);
        return;
    }
    const size_t n_corners = mesh_corners(m, element);
    double corners[4][3], normal[3], weights[4], sum[SHADE_MAX_CHANNELS] = {0};
    for (size_t k = 0; k < n_corners; k++)
        memcpy(corners[k], m->vertices[m->elements[element][k]], sizeof corners[k]);
    for (int d = 0; d < 3; d++) normal[d] = (double)m->normal[element][d];
    smooth_weights((const double(*)[3])corners, n_corners, normal, point, weights);
    for (size_t c = 0; c < s->n_channels; c++) {
        const float *at = s->corners + 4 * (c * m->n + element);
        for (size_t k = 0; k < n_corners; k++) sum[c] += weights[k] * (double)at[k];
        values[c] = (float)sum[c];
    }
}
