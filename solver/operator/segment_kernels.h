/* The inner loops of segments.c, included there once for each instruction set, which defines
 *   KERNEL(name) TARGET          the name and the attribute of its functions
 *   KERNEL(load_eight)(x, count, lanes)   lanes = the first count < 8 of x, then zeros
 *   KERNEL(load_four)(x, count, lanes)    the same of 4, count <= 4
 * A run is always added in 2 x 8 lanes and these by halves, whatever the width of a register, so that the
 * order of the additions is one. */

/* sum of weight_j x_j, j < count; weight may be NULL. */
TARGET static inline __attribute__((always_inline)) float KERNEL(sum_run)(const float *x, const float *weight,
                                                                          size_t count) {
    half low, high;
    if (count <= 4) { /* the other lanes would be zeros */
        KERNEL(load_four)(x, count, &low);
        if (weight != NULL) {
            KERNEL(load_four)(weight, count, &high);
            low *= high;
        }
        return (float)((low[0] + low[2]) + (low[1] + low[3]));
    }
    wide one = {0}, two = {0}, rest;
    size_t j = 0;
    for (; j + 16 <= count; j += 16) {
        one += weight != NULL ? WIDE(weight + j) * WIDE(x + j) : WIDE(x + j);
        two += weight != NULL ? WIDE(weight + j + 8) * WIDE(x + j + 8) : WIDE(x + j + 8);
    }
    if (j + 8 <= count) {
        one += weight != NULL ? WIDE(weight + j) * WIDE(x + j) : WIDE(x + j);
        j += 8;
    }
    if (j < count) {
        KERNEL(load_eight)(x + j, count - j, &rest);
        if (weight != NULL) {
            wide factor;
            KERNEL(load_eight)(weight + j, count - j, &factor);
            rest *= factor;
        }
        two += rest;
    }
    one += two;
    memcpy(&low, &one, sizeof low);
    memcpy(&high, (const char *)&one + sizeof low, sizeof high);
    low += high;
    return (float)((low[0] + low[2]) + (low[1] + low[3]));
}

TARGET static void KERNEL(sum)(const segments *s, const float *x, float *t) {
    const uint64_t *begin = s->begin;
    if (s->weight == NULL)
        for (size_t p = 0; p < s->k; p++) t[p] = KERNEL(sum_run)(x + begin[p], NULL, begin[p + 1] - begin[p]);
    else
        for (size_t p = 0; p < s->k; p++)
            t[p] = KERNEL(sum_run)(x + begin[p], s->weight + begin[p], begin[p + 1] - begin[p]);
}

#undef KERNEL
#undef TARGET
