#include "solver/operator/wavelet/wavelets.h"

#include "store/status.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void wavelets_free(wavelets *w) {
    free(w->shapes);
    free(w->basis);
    free(w->nodes);
    free(w->padded);
    *w = (wavelets){.n = 0};
}

void wavelets_heights(const wavelets *w, uint32_t *out) {
    for (size_t t = 0; t < w->n_nodes; t++) {
        const wavelet_node *a = &w->nodes[t];
        out[t] = 0;
        if (a->from_left > 0) out[t] = 1 + (out[a->left] > out[t - 1] ? out[a->left] : out[t - 1]);
    }
}

static const double level_exponent = .25;

lam_status wavelets_weights(const wavelets *w, float **out, lam_error *error) {
    double sum = 0;
    float *made = memory_allocate(w->n_nodes, sizeof *made, "wavelets", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    for (size_t t = 0; t < w->n_nodes; t++) {
        const wavelet_node *a = &w->nodes[t];
        const size_t count = a->inputs - (t + 1 < w->n_nodes ? a->scaling : 0);
        sum -= level_exponent * (double)count * log((double)a->n_elements);
    }
    const double mean = exp(sum / (double)w->n);
    for (size_t t = 0; t < w->n_nodes; t++)
        made[t] = (float)(pow((double)w->nodes[t].n_elements, -level_exponent) / mean);
    *out = made;
    return LAM_OK;
}

static lam_status check_shapes(const wavelets *w, lam_error *error) {
    lam_status status = LAM_OK;
    size_t count = 0;
    for (size_t k = 0; k < w->n_shapes; k++) {
        const wavelet_shape *s = &w->shapes[k];
        if (s->leaf > 1 || s->inputs == 0 || s->inputs > WAVELET_INPUTS || s->scaling == 0 ||
            s->scaling > WAVELET_SCALING || s->scaling > s->inputs)
            FAIL(error, LAM_ERR_NUMERIC,
                 "shape[%zu] has %u inputs and %u scaling coefficients, must have 1 to 8 and 1 to 4 of them",
                 k, (unsigned)s->inputs, (unsigned)s->scaling);
        count += (size_t)s->inputs * s->inputs;
    }
    if (count != w->basis_count)
        FAIL(error, LAM_ERR_NUMERIC, "the basis has %zu numbers, its shapes need %zu", w->basis_count, count);
    for (size_t k = 0; k < count; k++)
        if (!isfinite(w->basis[k]))
            FAIL(error, LAM_ERR_NUMERIC, "basis[%zu] = %g, must be finite", k, (double)w->basis[k]);
done:
    return status;
}

/* Links nodes from their shapes in postorder; a stack holds the nodes that have no parent yet. */
static lam_status link_nodes(wavelets *w, const uint32_t *node_shapes, lam_error *error) {
    lam_status status = LAM_OK;
    size_t n_waiting = 0, begin = 0, first = 0;
    uint32_t *waiting = memory_allocate(w->n_nodes, sizeof *waiting, "wavelets", error);
    if (waiting == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t t = 0; t < w->n_nodes; t++) {
        if (node_shapes[t] >= w->n_shapes)
            FAIL(error, LAM_ERR_NUMERIC, "node[%zu] = %u, must be below %zu", t, (unsigned)node_shapes[t],
                 w->n_shapes);
        const wavelet_shape *shape = &w->shapes[node_shapes[t]];
        wavelet_node *a = &w->nodes[t];
        *a = (wavelet_node){.parent = WAVELET_NONE,
                            .shape = node_shapes[t],
                            .first = (uint32_t)first,
                            .inputs = shape->inputs,
                            .scaling = shape->scaling};
        if (shape->leaf == 1) {
            a->begin = (uint32_t)begin;
            a->n_elements = shape->inputs;
            begin += shape->inputs;
            if (begin > w->n)
                FAIL(error, LAM_ERR_NUMERIC, "node[%zu] ends at position %zu of %zu", t, begin, w->n);
        } else {
            if (n_waiting < 2) FAIL(error, LAM_ERR_NUMERIC, "node[%zu] has no two children before it", t);
            a->left = waiting[n_waiting - 2];
            const wavelet_node *left = &w->nodes[a->left], *right = &w->nodes[t - 1];
            if (left->scaling + right->scaling != shape->inputs)
                FAIL(error, LAM_ERR_NUMERIC,
                     "node[%zu] has %u inputs, its children have %u scaling coefficients", t,
                     (unsigned)shape->inputs, (unsigned)(left->scaling + right->scaling));
            w->nodes[a->left].parent = w->nodes[t - 1].parent = (uint32_t)t;
            a->from_left = left->scaling;
            a->begin = left->begin;
            a->n_elements = left->n_elements + right->n_elements;
            n_waiting -= 2;
        }
        first += shape->inputs - shape->scaling;
        waiting[n_waiting++] = (uint32_t)t;
    }
    if (n_waiting != 1 || begin != w->n)
        FAIL(error, LAM_ERR_NUMERIC, "%zu nodes make %zu trees of %zu elements, must be one of %zu",
             w->n_nodes, n_waiting, begin, w->n);
done:
    free(waiting);
    return status;
}

static lam_status pad_shapes(wavelets *w, lam_error *error) {
    const float *Q = w->basis;
    w->padded = memory_allocate(w->n_shapes, 2 * WAVELET_INPUTS * WAVELET_INPUTS * sizeof *w->padded,
                                "wavelets", error);
    if (w->padded == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < w->n_shapes; k++) {
        const size_t inputs = w->shapes[k].inputs;
        float *columns = w->padded + k * 2 * WAVELET_INPUTS * WAVELET_INPUTS;
        float *rows = columns + WAVELET_INPUTS * WAVELET_INPUTS;
        for (size_t i = 0; i < inputs; i++)
            for (size_t j = 0; j < inputs; j++) {
                columns[j * WAVELET_INPUTS + i] = Q[i * inputs + j];
                rows[i * WAVELET_INPUTS + j] = Q[i * inputs + j];
            }
        Q += inputs * inputs;
    }
    return LAM_OK;
}

lam_status wavelets_create(size_t n, size_t n_nodes, const uint32_t *node_shapes, size_t n_shapes,
                           wavelet_shape *shapes, float *basis, size_t basis_count, wavelets *out,
                           lam_error *error) {
    lam_status status = LAM_OK;
    wavelets w = {.n = n,
                  .n_nodes = n_nodes,
                  .n_shapes = n_shapes,
                  .shapes = shapes,
                  .basis = basis,
                  .basis_count = basis_count};
    TRY(check_shapes(&w, error));
    w.nodes = memory_allocate(n_nodes, sizeof *w.nodes, "wavelets", error);
    if (w.nodes == NULL) TRY(LAM_ERR_MEMORY);
    TRY(link_nodes(&w, node_shapes, error));
    TRY(pad_shapes(&w, error));
    *out = w;
    w = (wavelets){.n = 0};
done:
    wavelets_free(&w);
    return status;
}

/* out = Q in; the columns of Q lie eight apart. */
static void turn(const float *columns, size_t inputs, const double *in, double *out) {
    memset(out, 0, WAVELET_INPUTS * sizeof *out);
    for (size_t m = 0; m < inputs; m++)
        for (size_t k = 0; k < WAVELET_INPUTS; k++) out[k] += (double)columns[m * WAVELET_INPUTS + k] * in[m];
}

void wavelets_forward(const wavelets *w, const double *x, double *c, double *work) {
    for (size_t t = 0; t < w->n_nodes; t++) {
        const wavelet_node *a = &w->nodes[t];
        double in[WAVELET_INPUTS], out[WAVELET_INPUTS];
        if (a->from_left == 0) {
            memcpy(in, x + a->begin, a->inputs * sizeof *in);
        } else {
            memcpy(in, work + (size_t)a->left * WAVELET_SCALING, a->from_left * sizeof *in);
            memcpy(in + a->from_left, work + (t - 1) * WAVELET_SCALING,
                   (a->inputs - a->from_left) * sizeof *in);
        }
        turn(wavelet_columns(w, a), a->inputs, in, out);
        memcpy(work + t * WAVELET_SCALING, out, a->scaling * sizeof *out);
        memcpy(c + a->first, out + a->scaling, (a->inputs - a->scaling) * sizeof *out);
    }
    const size_t scaling = w->nodes[w->n_nodes - 1].scaling;
    memcpy(c + w->n - scaling, work + (w->n_nodes - 1) * WAVELET_SCALING, scaling * sizeof *c);
}

lam_status wavelets_save(const wavelets *w, const char *group, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    char name[64];
    uint32_t *nodes = memory_allocate(w->n_nodes, sizeof *nodes, "wavelets", error);
    if (nodes == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t t = 0; t < w->n_nodes; t++) nodes[t] = w->nodes[t].shape;
    snprintf(name, sizeof name, "%s/shape", group);
    TRY(store_write(s, name, STORE_U32, 2, (const size_t[]){w->n_shapes, 3}, w->shapes, error));
    snprintf(name, sizeof name, "%s/basis", group);
    TRY(store_write(s, name, STORE_F32, 1, &w->basis_count, w->basis, error));
    snprintf(name, sizeof name, "%s/node", group);
    TRY(store_write(s, name, STORE_U32, 1, &w->n_nodes, nodes, error));
done:
    free(nodes);
    return status;
}

void wavelet_arrays_free(wavelet_arrays *arrays) {
    store_view_free(&arrays->shape);
    store_view_free(&arrays->basis);
    store_view_free(&arrays->node);
}

lam_status wavelets_read(store *s, const char *group, wavelet_arrays *out, lam_error *error) {
    lam_status status = LAM_OK;
    char name[64];
    wavelet_arrays read = {.n_shapes = 0};
    size_t shapes[STORE_MAX_RANK] = {SIZE_MAX, 3}, count[STORE_MAX_RANK] = {SIZE_MAX},
           nodes[STORE_MAX_RANK] = {SIZE_MAX};
    snprintf(name, sizeof name, "%s/shape", group);
    TRY(store_read_view(s, name, STORE_U32, 2, shapes, &read.shape, error));
    snprintf(name, sizeof name, "%s/basis", group);
    TRY(store_read_view(s, name, STORE_F32, 1, count, &read.basis, error));
    snprintf(name, sizeof name, "%s/node", group);
    TRY(store_read_view(s, name, STORE_U32, 1, nodes, &read.node, error));
    read.n_shapes = shapes[0];
    read.basis_count = count[0];
    read.n_nodes = nodes[0];
    *out = read;
    read = (wavelet_arrays){.n_shapes = 0};
done:
    wavelet_arrays_free(&read);
    return status;
}

/* Numbers are checked after they are copied, as a mapped file may change. */
lam_status wavelets_make(const wavelet_arrays *from, size_t n, wavelets *out, lam_error *error) {
    lam_status status = LAM_OK;
    wavelet_shape *shapes = memory_allocate(from->n_shapes, sizeof *shapes, "wavelets", error);
    float *basis = memory_allocate(from->basis_count, sizeof *basis, "wavelets", error);
    uint32_t *nodes = memory_allocate(from->n_nodes, sizeof *nodes, "wavelets", error);
    if (shapes == NULL || basis == NULL || nodes == NULL) TRY(LAM_ERR_MEMORY);
    if (from->n_shapes > 0) memcpy(shapes, from->shape.data, from->n_shapes * sizeof *shapes);
    if (from->basis_count > 0) memcpy(basis, from->basis.data, from->basis_count * sizeof *basis);
    if (from->n_nodes > 0) memcpy(nodes, from->node.data, from->n_nodes * sizeof *nodes);
    wavelet_shape *const taken_shapes = shapes;
    float *const taken_basis = basis;
    shapes = NULL;
    basis = NULL;
    TRY(wavelets_create(n, from->n_nodes, nodes, from->n_shapes, taken_shapes, taken_basis, from->basis_count,
                        out, error));
done:
    free(shapes);
    free(basis);
    free(nodes);
    return status;
}
