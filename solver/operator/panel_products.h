/* The inner loops of panel_kernels.c for one instruction set and one precision, which define
 *   KERNEL(name) TARGET                  the name and the attribute of their functions
 *   VALUE LANE_LOAD(p)                   the type of a value; LANES of them as floats
 *   lane LANE_SET(x) LANE_FMA(a, b, c)   a vector register, x in all of it, a b + c
 *   float LANE_SUM(lane)                 the sum of a register, by halves
 *   ROW_TILE VECTOR_TILE                 rows and vectors of expand whose sums stay in registers
 *   PROJECT_TILE                         vectors of project whose numbers stay in registers
 * A chunk is always summed in PANEL_CHUNK lanes, so the bits depend on neither the width of a register nor
 * the tiles: only on whether a b + c is rounded once or twice. */

#define LANES (sizeof(lane) / sizeof(float))
#define REGISTERS (PANEL_CHUNK / LANES)
/* Values of one chunk of all rows of a tile. */
#define TILE_CHUNK (PANEL_TILE * PANEL_CHUNK)

/* Asks for memory that will be wanted soon, a line at a time as the rows of a chunk are used; past the end it
 * does nothing. Into the second cache: lines asked for into the nearest one wait there for memory in a few
 * places that loads need too, which made 16 bits a tenth slower. */
TARGET static inline __attribute__((always_inline)) void KERNEL(ask_for)(const VALUE *chunk, size_t row) {
    const size_t at = row * PANEL_CHUNK * sizeof(VALUE);
    if (at % 64 == 0) __builtin_prefetch((const void *)((uintptr_t)chunk + AHEAD_BYTES + at), 0, 2);
}

/* wide = values as floats, of so many chunks of a tile. */
TARGET static inline __attribute__((always_inline)) void KERNEL(widen)(const VALUE *values, size_t n_chunks,
                                                                       float *wide) {
    for (size_t q = 0; q < n_chunks; q++) {
        for (size_t r = 0; r < PANEL_TILE; r++) KERNEL(ask_for)(values + q * TILE_CHUNK, r);
        for (size_t at = q * TILE_CHUNK; at < (q + 1) * TILE_CHUNK; at += LANES)
            *(lane *)(wide + at) = LANE_LOAD(values + at);
    }
}

/* --- project ------------------------------------------------------------------------------------------ */

/* t_v += sum_r c_rv row_r for a whole tile, W vectors from v on and n_chunks chunks, which wide holds as
 * floats, or (NULL) values as they are kept. */
TARGET static inline __attribute__((always_inline)) void KERNEL(project_part)(size_t W, const VALUE *values,
                                                                              const float *wide,
                                                                              size_t n_chunks, const float *c,
                                                                              size_t m, size_t v, float *t) {
    lane coefficient[PANEL_TILE][PROJECT_TILE];
    for (size_t r = 0; r < PANEL_TILE; r++)
        for (size_t w = 0; w < W; w++) coefficient[r][w] = LANE_SET(c[r * m + v + w]);
    for (size_t q = 0; q < n_chunks; q++) {
        lane *t_v = (lane *)(t + (q * m + v) * PANEL_CHUNK);
        for (size_t s = 0; s < REGISTERS; s++) {
            lane a[PANEL_TILE];
            for (size_t r = 0; r < PANEL_TILE; r++) {
                const size_t at = q * TILE_CHUNK + r * PANEL_CHUNK + s * LANES;
                if (v == 0 && s == 0 && wide == NULL) KERNEL(ask_for)(values + q * TILE_CHUNK, r);
                a[r] = wide != NULL ? *(const lane *)(wide + at) : LANE_LOAD(values + at);
            }
            for (size_t w = 0; w < W; w++) {
                lane sum = t_v[w * REGISTERS + s];
                for (size_t r = 0; r < PANEL_TILE; r++) sum = LANE_FMA(coefficient[r][w], a[r], sum);
                t_v[w * REGISTERS + s] = sum;
            }
        }
    }
}

TARGET static inline __attribute__((always_inline)) void KERNEL(project_step)(const VALUE *values,
                                                                              const float *wide,
                                                                              size_t n_chunks, const float *c,
                                                                              size_t m, float *t) {
    size_t v = 0;
    for (; v + PROJECT_TILE <= m; v += PROJECT_TILE)
        KERNEL(project_part)(PROJECT_TILE, values, wide, n_chunks, c, m, v, t);
    for (; v < m; v++) KERNEL(project_part)(1, values, wide, n_chunks, c, m, v, t);
}

/* The same for some rows of a tile. */
TARGET static void KERNEL(project_rows)(const VALUE *values, size_t n_rows, const unsigned char *which,
                                        size_t n_chunks, const float *c, size_t m, float *t) {
    for (size_t q = 0; q < n_chunks; q++)
        for (size_t v = 0; v < m; v++)
            for (size_t s = 0; s < REGISTERS; s++) {
                lane *t_v = (lane *)(t + (q * m + v) * PANEL_CHUNK) + s;
                lane sum = *t_v;
                for (size_t r = 0; r < n_rows; r++)
                    sum = LANE_FMA(LANE_SET(c[r * m + v]),
                                   LANE_LOAD(values + q * TILE_CHUNK + which[r] * PANEL_CHUNK + s * LANES),
                                   sum);
                *t_v = sum;
            }
}

TARGET static void KERNEL(project)(const void *tile, size_t n_rows, const unsigned char *which,
                                   const float *c, size_t m, size_t first, size_t last, float *t) {
    __attribute__((aligned(64))) float wide[STEP_CHUNKS * TILE_CHUNK];
    const VALUE *values = (const VALUE *)tile;
    if (n_rows < PANEL_TILE) {
        KERNEL(project_rows)
        (values + first * TILE_CHUNK, n_rows, which, last - first, c, m, t + first * m * PANEL_CHUNK);
    } else if (sizeof(VALUE) == sizeof(float) || m <= PROJECT_TILE) {
        KERNEL(project_step)
        (values + first * TILE_CHUNK, NULL, last - first, c, m, t + first * m * PANEL_CHUNK);
    } else {
        for (size_t q = first; q < last; q += STEP_CHUNKS) {
            const size_t count = last - q < STEP_CHUNKS ? last - q : STEP_CHUNKS;
            KERNEL(widen)(values + q * TILE_CHUNK, count, wide);
            KERNEL(project_step)(NULL, wide, count, c, m, t + q * m * PANEL_CHUNK);
        }
    }
}

/* --- expand ------------------------------------------------------------------------------------------- */

/* lanes_rv += a_r t_v for ROW_TILE rows from r0 on, W vectors from v on and n_chunks chunks, which wide holds
 * as floats, or (NULL) values as they are kept. */
TARGET static inline __attribute__((always_inline)) void
KERNEL(expand_part)(size_t W, size_t r0, const VALUE *values, const float *wide, size_t n_chunks,
                    const float *t, size_t m, size_t v, float (*lanes)[PANEL_VECTORS][PANEL_CHUNK]) {
    lane sum[ROW_TILE][VECTOR_TILE][REGISTERS];
    for (size_t r = 0; r < ROW_TILE; r++)
        for (size_t w = 0; w < W; w++)
            for (size_t s = 0; s < REGISTERS; s++) sum[r][w][s] = ((const lane *)lanes[r0 + r][v + w])[s];
    for (size_t q = 0; q < n_chunks; q++) {
        const lane *t_v = (const lane *)(t + (q * m + v) * PANEL_CHUNK);
        const size_t first = q * TILE_CHUNK + r0 * PANEL_CHUNK;
        for (size_t r = 0; r < ROW_TILE; r++)
            for (size_t s = 0; s < REGISTERS; s++) {
                if (v == 0 && s == 0 && wide == NULL) KERNEL(ask_for)(values + q * TILE_CHUNK, r0 + r);
                const size_t at = first + r * PANEL_CHUNK + s * LANES;
                const lane a = wide != NULL ? *(const lane *)(wide + at) : LANE_LOAD(values + at);
                for (size_t w = 0; w < W; w++)
                    sum[r][w][s] = LANE_FMA(a, t_v[w * REGISTERS + s], sum[r][w][s]);
            }
    }
    for (size_t r = 0; r < ROW_TILE; r++)
        for (size_t w = 0; w < W; w++)
            for (size_t s = 0; s < REGISTERS; s++) ((lane *)lanes[r0 + r][v + w])[s] = sum[r][w][s];
}

/* Vectors that have a use for values as floats more than once. */
TARGET static inline __attribute__((always_inline)) void
KERNEL(expand_step)(const VALUE *values, const float *wide, size_t n_chunks, const float *t, size_t m,
                    float (*lanes)[PANEL_VECTORS][PANEL_CHUNK]) {
    for (size_t r0 = 0; r0 < PANEL_TILE; r0 += ROW_TILE) {
        size_t v = 0;
        for (; v + VECTOR_TILE <= m; v += VECTOR_TILE)
            KERNEL(expand_part)(VECTOR_TILE, r0, values, wide, n_chunks, t, m, v, lanes);
        for (; v < m; v++) KERNEL(expand_part)(1, r0, values, wide, n_chunks, t, m, v, lanes);
    }
}

TARGET static inline __attribute__((always_inline)) double KERNEL(sum_lanes)(const float *lanes) {
    lane sum[REGISTERS];
    for (size_t s = 0; s < REGISTERS; s++) sum[s] = ((const lane *)lanes)[s];
    for (size_t half = REGISTERS / 2; half > 0; half /= 2)
        for (size_t s = 0; s < half; s++) sum[s] += sum[s + half];
    return (double)LANE_SUM(sum[0]);
}

/* One tile. Within a block of columns a lane adds at most EXPAND_CHUNKS products. With many vectors a block
 * is gone through in steps, so that its values stay in the nearest cache, as floats, for all of them. */
TARGET static inline __attribute__((always_inline)) void KERNEL(expand_tile)(const VALUE *tile, size_t m,
                                                                             size_t n_chunks, const float *t,
                                                                             double (*sums)[PANEL_VECTORS]) {
    __attribute__((aligned(64))) float lanes[PANEL_TILE][PANEL_VECTORS][PANEL_CHUNK];
    __attribute__((aligned(64))) float wide[STEP_CHUNKS * TILE_CHUNK];
    for (size_t block = 0; block < n_chunks; block += EXPAND_CHUNKS) {
        const size_t end = n_chunks - block < EXPAND_CHUNKS ? n_chunks : block + EXPAND_CHUNKS;
        const bool at_once = m <= VECTOR_TILE && ROW_TILE == PANEL_TILE;
        const size_t step = at_once ? EXPAND_CHUNKS : STEP_CHUNKS;
        for (size_t r = 0; r < PANEL_TILE; r++)
            for (size_t v = 0; v < m; v++)
                for (size_t s = 0; s < REGISTERS; s++) ((lane *)lanes[r][v])[s] = LANE_SET(0.0f);
        for (size_t first = block; first < end; first += step) {
            const size_t count = end - first < step ? end - first : step;
            const VALUE *values = tile + first * TILE_CHUNK;
            if (sizeof(VALUE) == sizeof(float) || m <= VECTOR_TILE) {
                KERNEL(expand_step)(values, NULL, count, t + first * m * PANEL_CHUNK, m, lanes);
                continue;
            }
            KERNEL(widen)(values, count, wide);
            KERNEL(expand_step)(values, wide, count, t + first * m * PANEL_CHUNK, m, lanes);
        }
        for (size_t r = 0; r < PANEL_TILE; r++)
            for (size_t v = 0; v < m; v++) sums[r][v] += KERNEL(sum_lanes)(lanes[r][v]);
    }
}

TARGET static void KERNEL(expand)(const void *tiles, size_t n_rows, size_t m, size_t n_chunks, const float *t,
                                  float *Y, size_t y_stride) {
    for (size_t i = 0; i < n_rows; i += PANEL_TILE) {
        const size_t count = n_rows - i < PANEL_TILE ? n_rows - i : PANEL_TILE;
        double sums[PANEL_TILE][PANEL_VECTORS];
        for (size_t r = 0; r < PANEL_TILE; r++)
            for (size_t v = 0; v < m; v++) sums[r][v] = 0.0;
        const VALUE *tile = (const VALUE *)tiles + i * n_chunks * PANEL_CHUNK;
        /* Compiled apart for one vector, whose sums then never leave the registers: a sixth faster where rows
         * are short. */
        if (m == 1)
            KERNEL(expand_tile)(tile, 1, n_chunks, t, sums);
        else
            KERNEL(expand_tile)(tile, m, n_chunks, t, sums);
        for (size_t r = 0; r < count; r++)
            for (size_t v = 0; v < m; v++) Y[v * y_stride + i + r] = (float)sums[r][v];
    }
}

TARGET static void KERNEL(expand_row)(const void *tile, size_t row, size_t m, size_t n_chunks, const float *t,
                                      float *Y, size_t y_stride) {
    const VALUE *values = (const VALUE *)tile + row * PANEL_CHUNK;
    double sums[PANEL_VECTORS] = {0};
    for (size_t block = 0; block < n_chunks; block += EXPAND_CHUNKS) {
        const size_t end = n_chunks - block < EXPAND_CHUNKS ? n_chunks : block + EXPAND_CHUNKS;
        for (size_t v = 0; v < m; v++) {
            __attribute__((aligned(64))) float lanes[PANEL_CHUNK];
            lane sum[REGISTERS];
            for (size_t s = 0; s < REGISTERS; s++) sum[s] = LANE_SET(0.0f);
            for (size_t q = block; q < end; q++) {
                const lane *t_v = (const lane *)(t + (q * m + v) * PANEL_CHUNK);
                for (size_t s = 0; s < REGISTERS; s++)
                    sum[s] = LANE_FMA(LANE_LOAD(values + q * TILE_CHUNK + s * LANES), t_v[s], sum[s]);
            }
            for (size_t s = 0; s < REGISTERS; s++) ((lane *)lanes)[s] = sum[s];
            sums[v] += KERNEL(sum_lanes)(lanes);
        }
    }
    for (size_t v = 0; v < m; v++) Y[v * y_stride] = (float)sums[v];
}

#undef LANES
#undef REGISTERS
#undef TILE_CHUNK
#undef KERNEL
#undef VALUE
#undef LANE_LOAD
