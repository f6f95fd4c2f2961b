/* What csr_floats.c and csr_doubles.c compile for one instruction set. They define
 *   number row_function                  float or double, and the type of the functions
 *   NARROW MIDDLE WIDE                   widths there are beside 1
 * and for each set
 *   KERNEL(name) TARGET                  the name and the attribute of its functions
 *   lane LANE_SET(x) LANE_FMA(a, b, c) LANE_LOAD(p) LANE_STORE(p, x)
 *                                        a vector register, x in all of it, a b + c, in and out of memory
 *   SCALAR_FMA(a, b, c)                  a b + c, rounded as often as in a register
 *   AT_ONCE                              vectors whose sums stay in registers
 *   ROW_NARROW                           (or not) what NARROW vectors take where a register holds more */

#define LANES (sizeof(lane) / sizeof(number))

TARGET static void KERNEL(row_of_1)(const uint32_t *indices, const float *data, uint64_t n_entries,
                                    const number *X, number *sums) {
    number part[TURNS] = {0};
    uint64_t e = 0;
    for (; e + TURNS <= n_entries; e += TURNS)
        for (int k = 0; k < TURNS; k++) part[k] = SCALAR_FMA((number)data[e + k], X[indices[e + k]], part[k]);
    for (int k = 0; e < n_entries; e++, k++) part[k] = SCALAR_FMA((number)data[e], X[indices[e]], part[k]);
    sums[0] = (part[0] + part[1]) + (part[2] + part[3]);
}

/* width: a multiple of LANES. */
TARGET static inline __attribute__((always_inline)) void
KERNEL(row_any)(size_t width, const uint32_t *indices, const float *data, uint64_t n_entries, const number *X,
                number *sums) {
    for (size_t first = 0; first < width; first += AT_ONCE) {
        const size_t registers = (width - first < AT_ONCE ? width - first : AT_ONCE) / LANES;
        lane part[TURNS][AT_ONCE / LANES];
        for (int k = 0; k < TURNS; k++)
            for (size_t s = 0; s < registers; s++) part[k][s] = LANE_SET((number)0);
        uint64_t e = 0;
        for (; e + TURNS <= n_entries; e += TURNS)
            for (int k = 0; k < TURNS; k++) {
                const lane a = LANE_SET((number)data[e + k]);
                const number *x = X + (size_t)indices[e + k] * width + first;
                for (size_t s = 0; s < registers; s++)
                    part[k][s] = LANE_FMA(a, LANE_LOAD(x + s * LANES), part[k][s]);
            }
        for (int k = 0; k < TURNS && e < n_entries; e++, k++) {
            const lane a = LANE_SET((number)data[e]);
            const number *x = X + (size_t)indices[e] * width + first;
            for (size_t s = 0; s < registers; s++)
                part[k][s] = LANE_FMA(a, LANE_LOAD(x + s * LANES), part[k][s]);
        }
        for (size_t s = 0; s < registers; s++)
            LANE_STORE(sums + first + s * LANES, (part[0][s] + part[1][s]) + (part[2][s] + part[3][s]));
    }
}

#define ROW_OF(name, width)                                                                                  \
    TARGET static void KERNEL(name)(const uint32_t *indices, const float *data, uint64_t n_entries,          \
                                    const number *X, number *sums) {                                         \
        KERNEL(row_any)(width, indices, data, n_entries, X, sums);                                           \
    }
#ifndef ROW_NARROW
ROW_OF(row_narrow, NARROW)
#define ROW_NARROW KERNEL(row_narrow)
#endif
ROW_OF(row_middle, MIDDLE)
ROW_OF(row_wide, WIDE)
#undef ROW_OF

static row_function *const KERNEL(rows)[] = {KERNEL(row_of_1), ROW_NARROW, KERNEL(row_middle),
                                             KERNEL(row_wide)};

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
#undef ROW_NARROW
