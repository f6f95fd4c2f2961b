/* Slices times several vectors, a lane for each; compiled once for each instruction set and form.
 * KERNEL(name), TARGET, SCALAR_FMA(a, b, c): a b + c, rounded as often as where a lane is a row; the rest as
 * in sliced_kernels.h, which includes it. No include guard. */

/* side: [n][WIDTH]; sums are made in the same order as those of one vector. */
TARGET static void KERNEL(wide)(const sliced_rows *s, size_t first, size_t last, size_t m, const float *side,
                                float *Y) {
    const size_t n = s->all->n;
    for (size_t k = first; k < last; k++) {
        const slice *t = &s->slices[k];
        for (size_t lane = 0; lane < SLICE_ROWS; lane++) {
            float sums[WIDTH] = {0};
            for (size_t e = 0; e < t->length; e++) {
                const uint64_t at = t->begin + e * SLICE_ROWS + lane;
                const float *x = side + (size_t)INDICES(s)[at] * WIDTH, a = VALUE_OF(VALUES(s)[at]);
                for (size_t v = 0; v < WIDTH; v++) sums[v] = SCALAR_FMA(a, x[v], sums[v]);
            }
            for (size_t v = 0; v < m; v++) Y[v * n + t->row[lane]] = s->scale * sums[v];
        }
    }
}

TARGET static void KERNEL(wide_long)(const sliced_rows *s, size_t k, const float *side, float *sums) {
    const uint64_t begin = s->long_begin[k];
    const size_t count = length_of(s->all, s->long_rows[k]);
    const INDEX *indices = LONG_INDICES(s) + begin;
    const VALUE *values = LONG_VALUES(s) + begin;
    float turns[SLICE_ROWS][WIDTH] = {{0}};
    for (size_t e = 0; e < count; e++) {
        const float *x = side + (size_t)indices[e] * WIDTH, a = VALUE_OF(values[e]);
        float *turn = turns[e % SLICE_ROWS];
        for (size_t v = 0; v < WIDTH; v++) turn[v] = SCALAR_FMA(a, x[v], turn[v]);
    }
    for (size_t half = SLICE_ROWS / 2; half > 0; half /= 2)
        for (size_t l = 0; l < half; l++)
            for (size_t v = 0; v < WIDTH; v++) turns[l][v] += turns[l + half][v];
    for (size_t v = 0; v < WIDTH; v++) sums[v] = s->scale * turns[0][v];
}

#undef KERNEL
#undef TARGET
#undef SCALAR_FMA
