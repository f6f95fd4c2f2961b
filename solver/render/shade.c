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

lam_status shade_create(const mesh *m, size_t n_channels, const float *values, const float *E,
                        const smooth_nodes *nodes, shade **out, lam_error *error) {
    lam_status status = LAM_OK;
    shade *s = memory_allocate(1, sizeof *s, "shading", error);
    if (s == NULL) return LAM_ERR_MEMORY;
    s->mesh = m;
    s->n_channels = n_channels < SHADE_MAX_CHANNELS ? n_channels : SHADE_MAX_CHANNELS;
    if (nodes != NULL) {
        s->corners = memory_allocate(m->n, 4 * s->n_channels * sizeof *s->corners, "shading", error);
        if (s->corners == NULL) TRY(LAM_ERR_MEMORY);
        TRY(smooth_corners(nodes, m, s->n_channels, values, E, s->corners, error));
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

void shade_weights(const mesh *m, uint32_t element, const double point[3], float weights[4]) {
    const size_t n_corners = mesh_corners(m, element);
    double corners[4][3], normal[3], exact[4];
    for (size_t k = 0; k < n_corners; k++)
        memcpy(corners[k], m->vertices[m->elements[element][k]], sizeof corners[k]);
    for (int d = 0; d < 3; d++) normal[d] = (double)m->normal[element][d];
    smooth_weights((const double(*)[3])corners, n_corners, normal, point, exact);
    for (size_t k = 0; k < 4; k++) weights[k] = k < n_corners ? (float)exact[k] : 0;
}

void shade_mix(const shade *s, uint32_t element, const float *weights, float *values) {
    const size_t n_corners = mesh_corners(s->mesh, element);
    if (s->corners == NULL) {
        memcpy(values, s->values + (size_t)element * s->n_channels, s->n_channels * sizeof *values);
        return;
    }
    for (size_t c = 0; c < s->n_channels; c++) {
        const float *at = s->corners + 4 * (c * s->mesh->n + element);
        values[c] = 0;
        for (size_t k = 0; k < n_corners; k++) values[c] += weights[k] * at[k];
    }
}

void shade_at(const shade *s, uint32_t element, const double point[3], float *values) {
    float weights[4] = {0, 0, 0, 0};
    if (s->corners != NULL) shade_weights(s->mesh, element, point, weights);
    shade_mix(s, element, weights, values);
}
