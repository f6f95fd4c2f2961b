/* The nodes of a transform, one after the other; compiled once for each instruction set. KERNEL(name),
 * TARGET. No include guard: wavelets.c includes it for each. */

typedef float KERNEL(lane) __attribute__((vector_size(32), aligned(4), may_alias));
#define lane KERNEL(lane)

/* y = sum_m x_m column_m */
static inline TARGET void KERNEL(turn)(const float *columns, size_t inputs, const float *x, float *y) {
    lane sum = x[0] * *(const lane *)columns;
    for (size_t m = 1; m < inputs; m++) sum += x[m] * *(const lane *)(columns + m * WAVELET_INPUTS);
    *(lane *)y = sum;
}

/* Hands up s [n_nodes][4] and leaves coefficients. */
static inline TARGET void KERNEL(forward_node)(const wavelets *w, size_t t, const float *X, float *C,
                                               float *s) {
    const wavelet_node *a = &w->nodes[t];
    const float *columns = w->padded + (size_t)a->shape * 2 * WAVELET_INPUTS * WAVELET_INPUTS;
    float from[WAVELET_INPUTS + WAVELET_SCALING], to[WAVELET_INPUTS];
    const float *x = X + a->begin;
    if (a->from_left > 0) {
        memcpy(from, s + (size_t)a->left * WAVELET_SCALING, WAVELET_SCALING * sizeof *s);
        memcpy(from + a->from_left, s + (t - 1) * WAVELET_SCALING, WAVELET_SCALING * sizeof *s);
        x = from;
    }
    KERNEL(turn)(columns, a->inputs, x, to);
    memcpy(s + t * WAVELET_SCALING, to, WAVELET_SCALING * sizeof *s);
    for (size_t k = a->scaling; k < a->inputs; k++) C[a->first + k - a->scaling] = to[k];
}

static inline TARGET void KERNEL(inverse_node)(const wavelets *w, size_t t, const float *C, float *X,
                                               float *s) {
    const wavelet_node *a = &w->nodes[t];
    const float *rows = w->padded + ((size_t)a->shape * 2 + 1) * WAVELET_INPUTS * WAVELET_INPUTS;
    float from[WAVELET_INPUTS], to[WAVELET_INPUTS + WAVELET_SCALING];
    memcpy(from, s + t * WAVELET_SCALING, WAVELET_SCALING * sizeof *s);
    for (size_t k = a->scaling; k < a->inputs; k++) from[k] = C[a->first + k - a->scaling];
    KERNEL(turn)(rows, a->inputs, from, to);
    if (a->from_left > 0) {
        memcpy(s + (size_t)a->left * WAVELET_SCALING, to, WAVELET_SCALING * sizeof *s);
        memcpy(s + (t - 1) * WAVELET_SCALING, to + a->from_left, WAVELET_SCALING * sizeof *s);
    } else {
        for (size_t k = 0; k < a->inputs; k++) X[a->begin + k] = to[k];
    }
}

static TARGET void KERNEL(forward)(const wavelets *w, size_t first, size_t last, const uint32_t *which,
                                   const float *X, float *C, float *s) {
    for (size_t k = first; k < last; k++) KERNEL(forward_node)(w, which != NULL ? which[k] : k, X, C, s);
}

static TARGET void KERNEL(inverse)(const wavelets *w, size_t first, size_t last, const uint32_t *which,
                                   const float *C, float *X, float *s) {
    for (size_t k = last; k-- > first;) KERNEL(inverse_node)(w, which != NULL ? which[k] : k, C, X, s);
}

#undef lane
#undef KERNEL
#undef TARGET
