#include "solver/operator/wavelet/wavelet_doubles.h"

#include <string.h>

/* out = Q in, for a matrix whose columns (of its transposed: rows) lie eight apart. */
static void turn(const float *columns, size_t inputs, const double *in, double *out) {
    memset(out, 0, WAVELET_INPUTS * sizeof *out);
    for (size_t m = 0; m < inputs; m++)
        for (size_t k = 0; k < WAVELET_INPUTS; k++) out[k] += (double)columns[m * WAVELET_INPUTS + k] * in[m];
}

void wavelet_doubles_forward(const wavelets *w, const double *x, double *c, double *work) {
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

void wavelet_doubles_inverse(const wavelets *w, const double *c, double *x, double *work) {
    const size_t scaling = w->nodes[w->n_nodes - 1].scaling;
    memcpy(work + (w->n_nodes - 1) * WAVELET_SCALING, c + w->n - scaling, scaling * sizeof *c);
    for (size_t t = w->n_nodes; t-- > 0;) {
        const wavelet_node *a = &w->nodes[t];
        double in[WAVELET_INPUTS], out[WAVELET_INPUTS];
        memcpy(in, work + t * WAVELET_SCALING, a->scaling * sizeof *in);
        memcpy(in + a->scaling, c + a->first, (a->inputs - a->scaling) * sizeof *in);
        turn(wavelet_columns(w, a) + WAVELET_INPUTS * WAVELET_INPUTS, a->inputs, in, out);
        if (a->from_left == 0) {
            memcpy(x + a->begin, out, a->inputs * sizeof *out);
        } else {
            memcpy(work + (size_t)a->left * WAVELET_SCALING, out, a->from_left * sizeof *out);
            memcpy(work + (t - 1) * WAVELET_SCALING, out + a->from_left,
                   (a->inputs - a->from_left) * sizeof *out);
        }
    }
}
