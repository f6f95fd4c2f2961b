#include "support/random_basis.h"

#include "solver/base/random.h"

double random_basis(size_t n, uint64_t *state, wavelets *basis, double *W, double *size) {
    enum { NODES = 512 };
    lam_error error = {.message = ""};
    uint32_t shapes_of[NODES], waiting[NODES], depth[NODES];
    size_t n_nodes = 0, n_waiting = 0, used = 0, begin = 0, deepest = 0;
    wavelet_shape *shapes = test_allocate(NODES, sizeof *shapes);
    float *matrices = test_allocate(NODES, WAVELET_INPUTS * WAVELET_INPUTS * sizeof *matrices);
    while (begin < n || n_waiting > 1) {
        const bool join = n_waiting >= 2 && (begin == n || (n_waiting > 4 && random_lcg_unit(state) < .7));
        wavelet_shape *shape = &shapes[n_nodes];
        depth[n_nodes] = 1;
        if (join) {
            const uint32_t left = waiting[n_waiting - 2], right = waiting[n_waiting - 1];
            shape->inputs = shapes[left].scaling + shapes[right].scaling;
            depth[n_nodes] = 1 + (depth[left] > depth[right] ? depth[left] : depth[right]);
            n_waiting -= 2;
        } else {
            shape->leaf = 1;
            shape->inputs = 1 + (uint32_t)(7 * random_lcg_unit(state));
            if (shape->inputs > n - begin) shape->inputs = (uint32_t)(n - begin);
            begin += shape->inputs;
        }
        if (depth[n_nodes] > deepest) deepest = depth[n_nodes];
        shape->scaling = shape->inputs < 4 ? shape->inputs : 1 + (uint32_t)(4 * random_lcg_unit(state));
        for (size_t i = 0; i < shape->inputs; i++)
            for (size_t j = 0; j < shape->inputs; j++)
                matrices[used++] = (float)((i + j + 1 == shape->inputs ? (j % 2 == 0 ? 1 : -1) : 0) +
                                           .2 * (random_lcg_unit(state) - .5));
        shapes_of[n_nodes] = (uint32_t)n_nodes;
        waiting[n_waiting++] = (uint32_t)n_nodes++;
        ck_assert_uint_lt(n_nodes, NODES);
    }
    ck_assert_msg(wavelets_create(n, n_nodes, shapes_of, n_nodes, shapes, matrices, used, basis, &error) ==
                      LAM_OK,
                  "%s", error.message);
    /* Column p: what becomes of a 1 there, node by node. */
    double(*up)[2][WAVELET_SCALING] = test_allocate(n_nodes, sizeof *up);
    for (size_t p = 0; p < n; p++) {
        const float *Q = basis->basis;
        for (size_t t = 0; t < n_nodes; t++) {
            const wavelet_node *a = &basis->nodes[t];
            for (int of = 0; of < 2; of++) {
                double x[WAVELET_INPUTS], *to = of == 0 ? W : size;
                for (size_t m = 0; m < a->inputs; m++)
                    x[m] = a->from_left == 0  ? (a->begin + m == p ? 1 : 0)
                           : m < a->from_left ? up[a->left][of][m]
                                              : up[t - 1][of][m - a->from_left];
                for (size_t k = 0; k < a->inputs; k++) {
                    double sum = 0;
                    for (size_t m = 0; m < a->inputs; m++) {
                        const double q = (double)Q[k * a->inputs + m];
                        sum += (of == 0 ? q : fabs(q)) * x[m];
                    }
                    if (k < a->scaling) up[t][of][k] = sum;
                    if (k >= a->scaling) to[(a->first + k - a->scaling) * n + p] = sum;
                    if (k < a->scaling && t + 1 == n_nodes) to[(n - a->scaling + k) * n + p] = sum;
                }
            }
            Q += (size_t)a->inputs * a->inputs;
        }
    }
    free(up);
    return (double)deepest * (WAVELET_INPUTS + 1);
}
