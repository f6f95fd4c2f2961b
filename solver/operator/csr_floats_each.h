/* What csr_floats.c compiles for one instruction set, which defines
 *   KERNEL(name) TARGET                  the name and the attribute of its functions
 *   lane LANE_SET(x) LANE_FMA(a, b, c) LANE_LOAD(p) LANE_STORE(p, x)
 *                                        a vector register, x in all of it, a b + c, in and out of memory
 *   SCALAR_FMA(a, b, c)                  a b + c, rounded as often as in a register
 *   AT_ONCE                              vectors whose sums stay in registers
 *   ROW_OF_8                             (or not) what 8 vectors take where a register holds more */

#define LANES (sizeof(lane) / sizeof(float))

TARGET static void KERNEL(row_of_1)(const uint32_t *indices, const float *data, uint64_t n_entries,
                                    const float *X, float *sums) {
    float part[TURNS] = {0};
    uint64_t e = 0;
    for (; e + TURNS <= n_entries; e += TURNS)
        for (int k = 0; k < TURNS; k++) part[k] = SCALAR_FMA(data[e + k], X[indices[e + k]], part[k]);
    for (int k = 0; e < n_entries; e++, k++) part[k] = SCALAR_FMA(data[e], X[indices[e]], part[k]);
    sums[0] = (part[0] + part[1]) + (part[2] + part[3]);
}

/* width: a multiple of LANES. */
TARGET static inline __attribute__((always_inline)) void
KERNEL(row_wide)(size_t width, const uint32_t *indices, const float *data, uint64_t n_entries, const float *X,
                 float *sums) {
    for (size_t first = 0; first < width; first += AT_ONCE) {
        const size_t registers = (width - first < AT_ONCE ? width - first : AT_ONCE) / LANES;
        lane part[TURNS][AT_ONCE / LANES];
        for (int k = 0; k < TURNS; k++)
            for (size_t s = 0; s < registers; s++) part[k][s] = LANE_SET(0.0f);
        uint64_t e = 0;
        for (; e + TURNS <= n_entries; e += TURNS)
            for (int k = 0; k < TURNS; k++) {
                const lane a = LANE_SET(data[e + k]);
                const float *x = X + (size_t)indices[e + k] * width + first;
                for (size_t s = 0; s < registers; s++)
                    part[k][s] = LANE_FMA(a, LANE_LOAD(x + s * LANES), part[k][s]);
            }
        for (int k = 0; k < TURNS && e < n_entries; e++, k++) {
            const lane a = LANE_SET(data[e]);
            const float *x = X + (size_t)indices[e] * width + first;
            for (size_t s = 0; s < registers; s++)
                part[k][s] = LANE_FMA(a, LANE_LOAD(x + s * LANES), part[k][s]);
        }
        for (size_t s = 0; s < registers; s++)
            LANE_STORE(sums + first + s * LANES, (part[0][s] + part[1][s]) + (part[2][s] + part[3][s]));
    }
}

#define ROW_OF(width)                                                                                        \
    TARGET static void KERNEL(row_of_##width)(const uint32_t *indices, const float *data,                    \
                                              uint64_t n_entries, const float *X, float *sums) {             \
        KERNEL(row_wide)(width, indices, data, n_entries, X, sums);                                          \
    }
#ifndef ROW_OF_8
ROW_OF(8)
#define ROW_OF_8 KERNEL(row_of_8)
#endif
ROW_OF(16)
ROW_OF(32)
#undef ROW_OF

static csr_float_row *const KERNEL(rows)[] = {KERNEL(row_of_1), ROW_OF_8, KERNEL(row_of_16),
                                              KERNEL(row_of_32)};

#undef LANES
#undef KERNEL
#undef TARGET
#undef lane
#undef LANE_SET
#undef LANE_FMA
#undef LANE_LOAD
#undef LANE_STORE
#undef SCALAR_FMA
#undef AT_ONCE
#undef ROW_OF_8
