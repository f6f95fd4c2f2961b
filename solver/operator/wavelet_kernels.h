/* The steps of a transform, one after the other; compiled once for each instruction set. KERNEL(name),
 * TARGET. No include guard: wavelet_plan.c includes it for each. */

typedef float KERNEL(lane) __attribute__((vector_size(32), aligned(4), may_alias));
#define lane KERNEL(lane)

/* y = sum_m x_m column_m */
static inline TARGET void KERNEL(turn)(const float *columns, size_t inputs, const float *x, float *y) {
    lane sum = x[0] * *(const lane *)columns;
    for (size_t m = 1; m < inputs; m++) sum += x[m] * *(const lane *)(columns + m * WAVELET_INPUTS);
    *(lane *)y = sum;
}

/* Few numbers, by two overlapping copies at most. */
static inline TARGET void KERNEL(copy_few)(float *to, const float *from, size_t count) {
    if (count >= 4) {
        memcpy(to, from, 4 * sizeof *to);
        memcpy(to + count - 4, from + count - 4, 4 * sizeof *to);
    } else if (count >= 2) {
        memcpy(to, from, 2 * sizeof *to);
        memcpy(to + count - 2, from + count - 2, 2 * sizeof *to);
    } else if (count == 1) {
        *to = *from;
    }
}

/* s_k = row_k . x, eight sums side by side. */
static inline TARGET void KERNEL(gather_whole)(const plan_step *a, const float *X, float *s) {
    const float *x = X + a->begin;
    const size_t count = a->count, full = count / WAVELET_INPUTS * WAVELET_INPUTS;
    float tail[WAVELET_INPUTS] = {0};
    KERNEL(copy_few)(tail, x + full, count - full);
    for (size_t k = 0; k < a->scaling; k++) {
        const float *row = a->rows + k * ((count + WAVELET_INPUTS - 1) / WAVELET_INPUTS * WAVELET_INPUTS);
        lane sum = *(const lane *)tail * 0;
        for (size_t p = 0; p < full; p += WAVELET_INPUTS)
            sum += *(const lane *)(row + p) * *(const lane *)(x + p);
        if (full < count) sum += *(const lane *)(row + full) * *(const lane *)tail;
        s[k] = ((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7]));
    }
}

/* x = sum_k s_k row_k */
static inline TARGET void KERNEL(spread_whole)(const plan_step *a, const float *s, float *X) {
    float *x = X + a->begin;
    const size_t count = a->count, width = (count + WAVELET_INPUTS - 1) / WAVELET_INPUTS * WAVELET_INPUTS;
    for (size_t p = 0; p < width; p += WAVELET_INPUTS) {
        lane sum = s[0] * *(const lane *)(a->rows + p);
        for (size_t k = 1; k < a->scaling; k++) sum += s[k] * *(const lane *)(a->rows + k * width + p);
        if (p + WAVELET_INPUTS <= count) {
            *(lane *)(x + p) = sum;
        } else {
            float tail[WAVELET_INPUTS];
            *(lane *)tail = sum;
            KERNEL(copy_few)(x + p, tail, count - p);
        }
    }
}

/* Hands up s [n_steps][4] and leaves coefficients. */
static inline TARGET void KERNEL(forward_step)(const wavelet_plan *plan, size_t t, const float *X, float *C,
                                               float *s) {
    const plan_step *a = &plan->steps[t];
    float from[WAVELET_INPUTS + WAVELET_SCALING], to[WAVELET_INPUTS];
    const float *x = X + a->begin;
    if (a->whole) {
        KERNEL(gather_whole)(a, X, s + t * WAVELET_SCALING);
        return;
    }
    if (a->from_left > 0) {
        memcpy(from, s + (size_t)a->left * WAVELET_SCALING, WAVELET_SCALING * sizeof *s);
        memcpy(from + a->from_left, s + (t - 1) * WAVELET_SCALING, WAVELET_SCALING * sizeof *s);
        x = from;
    }
    KERNEL(turn)(a->columns, a->inputs, x, to);
    memcpy(s + t * WAVELET_SCALING, to, WAVELET_SCALING * sizeof *s);
    KERNEL(copy_few)(C + a->first, to + a->scaling, a->own);
}

static inline TARGET void KERNEL(inverse_step)(const wavelet_plan *plan, size_t t, const float *C, float *X,
                                               float *s) {
    const plan_step *a = &plan->steps[t];
    float from[WAVELET_INPUTS], to[WAVELET_INPUTS + WAVELET_SCALING];
    if (a->whole) {
        KERNEL(spread_whole)(a, s + t * WAVELET_SCALING, X);
        return;
    }
    memcpy(from, s + t * WAVELET_SCALING, WAVELET_SCALING * sizeof *s);
    KERNEL(copy_few)(from + a->scaling, C + a->first, a->own);
    KERNEL(turn)(a->rows, a->own > 0 ? a->inputs : a->scaling, from, to);
    if (a->from_left > 0) {
        memcpy(s + (size_t)a->left * WAVELET_SCALING, to, WAVELET_SCALING * sizeof *s);
        memcpy(s + (t - 1) * WAVELET_SCALING, to + a->from_left, WAVELET_SCALING * sizeof *s);
    } else {
        KERNEL(copy_few)(X + a->begin, to, a->inputs);
    }
}

static TARGET void KERNEL(forward)(const wavelet_plan *plan, size_t first, size_t last, const uint32_t *which,
                                   const float *X, float *C, float *s) {
    for (size_t k = first; k < last; k++) KERNEL(forward_step)(plan, which != NULL ? which[k] : k, X, C, s);
}

static TARGET void KERNEL(inverse)(const wavelet_plan *plan, size_t first, size_t last, const uint32_t *which,
                                   const float *C, float *X, float *s) {
    for (size_t k = last; k-- > first;) KERNEL(inverse_step)(plan, which != NULL ? which[k] : k, C, X, s);
}

#undef lane
#undef KERNEL
#undef TARGET
