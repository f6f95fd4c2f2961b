#include "solver/render/smooth.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

lam_status smooth_nodes_create(const mesh *m, smooth_nodes *out, lam_error *error) {
    lam_status status = LAM_OK;
    const corner_mesh surface = {.n_vertices = m->n_vertices,
                                 .n = m->n,
                                 .vertices = (const double(*)[3])m->vertices,
                                 .elements = (const uint32_t(*)[4])m->elements,
                                 .normal = (const float(*)[3])m->normal,
                                 .group = m->group,
                                 .buried = m->buried};
    smooth_nodes made = {.corner = NULL};
    corner_nodes nodes = {.n_nodes = 0};
    TRY(corner_nodes_create(&surface, &nodes, error));
    TRY(corner_plan_create(&surface, &nodes, &made.plan, error));
    made.corner = nodes.corner;
    nodes.corner = NULL;
    *out = made;
done:
    corner_nodes_free(&nodes);
    return status;
}

void smooth_nodes_free(smooth_nodes *nodes) {
    if (nodes == NULL) return;
    corner_plan_free(&nodes->plan);
    free(nodes->corner);
    *nodes = (smooth_nodes){.corner = NULL};
}

lam_status smooth_corners(const smooth_nodes *nodes, const mesh *m, size_t n_channels, const float *values,
                          const float *E, float *corners, lam_error *error) {
    lam_status status = LAM_OK;
    float *rest = memory_allocate(m->n, sizeof *rest, "smoothing", error);
    float *at_node = memory_allocate(nodes->plan.n_nodes, sizeof *at_node, "smoothing", error);
    if (rest == NULL || at_node == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t c = 0; c < n_channels; c++) {
        const float *emitted = E != NULL ? E + c * m->n : NULL;
        for (size_t i = 0; i < m->n; i++) rest[i] = values[c * m->n + i] - (emitted != NULL ? emitted[i] : 0);
        corner_plan_apply(&nodes->plan, 1, rest, at_node);
        for (size_t i = 0; i < m->n; i++) {
            float *out = corners + 4 * (c * m->n + i);
            out[3] = NAN;
            for (size_t k = 0; k < mesh_corners(m, i); k++)
                out[k] = at_node[nodes->corner[i][k]] + (emitted != NULL ? emitted[i] : 0);
        }
    }
done:
    free(rest);
    free(at_node);
    return status;
}

void smooth_weights(const double (*corners)[3], size_t n_corners, const double normal[3],
                    const double point[3], double *weights) {
    double spoke[4][3], radius[4], cross[4], dot[4], tangent[4], total = 0;
    assert(n_corners == 3 || n_corners == 4);
    for (size_t i = 0; i < n_corners; i++) {
        double height = 0;
        weights[i] = 0;
        for (int d = 0; d < 3; d++) height += (corners[i][d] - point[d]) * normal[d];
        for (int d = 0; d < 3; d++) spoke[i][d] = corners[i][d] - point[d] - height * normal[d];
        radius[i] = sqrt(spoke[i][0] * spoke[i][0] + spoke[i][1] * spoke[i][1] + spoke[i][2] * spoke[i][2]);
    }
    for (size_t i = 0; i < n_corners; i++) {
        const double *a = spoke[i], *b = spoke[(i + 1) % n_corners];
        if (!(radius[i] > 0)) {
            weights[i] = 1;
            return;
        }
        cross[i] = (a[1] * b[2] - a[2] * b[1]) * normal[0] + (a[2] * b[0] - a[0] * b[2]) * normal[1] +
                   (a[0] * b[1] - a[1] * b[0]) * normal[2];
        dot[i] = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    }
    for (size_t i = 0; i < n_corners; i++) {
        const size_t j = (i + 1) % n_corners;
        /* Within rounding of this edge: linear between its ends. */
        if (fabs(cross[i]) <= 1e-12 * radius[i] * radius[j] && dot[i] < 0) {
            for (size_t k = 0; k < n_corners; k++) weights[k] = 0;
            weights[i] = radius[j] / (radius[i] + radius[j]);
            weights[j] = 1 - weights[i];
            return;
        }
        /* tan of half the angle between the spokes, without cancellation */
        tangent[i] = dot[i] < 0 ? (radius[i] * radius[j] - dot[i]) / cross[i]
                                : cross[i] / (radius[i] * radius[j] + dot[i]);
    }
    for (size_t i = 0; i < n_corners; i++) {
        weights[i] = (tangent[(i + n_corners - 1) % n_corners] + tangent[i]) / radius[i];
        total += weights[i];
    }
    for (size_t i = 0; i < n_corners; i++) weights[i] /= total;
}
