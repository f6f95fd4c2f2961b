/* The inner loops of panel_kernels.c for one instruction set, one precision and one layout, which define
 *   KERNEL(name) TARGET                  the name and the attribute of their functions
 *   VALUE LANE_LOAD(p)                   the type of a value; LANES of them as floats
 *   BY_ROWS                              1: rows lie as in a store; 0: in tiles
 *   lane LANE_SET(x) LANE_FMA(a, b, c)   a vector register, x in all of it, a b + c
 *   float LANE_SUM(lane)                 the sum of a register, by halves
 *   ROW_TILE VECTOR_TILE                 rows and vectors of expand whose sums stay in registers
 *   PROJECT_TILE                         vectors of project whose numbers stay in registers
 * A chunk is always summed in PANEL_CHUNK lanes, so the bits depend on neither the width of a register nor
 * the tiles nor the layout: only on whether a b + c is rounded once or twice. */

#define LANES (sizeof(lane) / sizeof(float))
#define REGISTERS (PANEL_CHUNK / LANES)
/* Values of one chunk of all rows of a tile. */
#define TILE_CHUNK (PANEL_TILE * PANEL_CHUNK)
/* Values from a chunk to the next one of its row, and from a row of a tile to the next. */
#define CHUNK_STEP (BY_ROWS ? PANEL_CHUNK : TILE_CHUNK)
#define ROW_STEP(m) (BY_ROWS ? (m)->row_step : PANEL_CHUNK)
/* Chunks that a row has in one line of memory, which is asked for once. */
#define LINE_CHUNKS (BY_ROWS ? 64 / (PANEL_CHUNK * sizeof(VALUE)) : 1)
/* A row of a store may begin anywhere, and half of a register's loads then cost twice: values that many
 * vectors want are copied first, whatever their precision. */
#define WIDEN_FROM(few) (sizeof(VALUE) == sizeof(float) && !BY_ROWS ? SIZE_MAX : (few))

/* Asks for memory that will be wanted soon, for rows first <= r < last of a chunk and as many after it as
 * LINE_CHUNKS says; past the end it does nothing. Into the second cache: lines asked for into the nearest one
 * wait there for memory in a few places that loads need too, which made 16 bits a tenth slower. */
TARGET static inline __attribute__((always_inline)) void KERNEL(ask_for)(const VALUE *chunk, size_t first,
                                                                         size_t last, size_t row_step) {
    const size_t bytes = PANEL_CHUNK * sizeof(VALUE);
    for (size_t r = first; r < last; r++)
        if (BY_ROWS)
            __builtin_prefetch((const void *)((uintptr_t)(chunk + r * row_step) + ROWS_AHEAD_BYTES), 0, 2);
        else if (r * bytes % 64 == 0)
            __builtin_prefetch((const void *)((uintptr_t)chunk + AHEAD_BYTES + r * bytes), 0, 2);
}

/* LANES values as floats, register s of a chunk of which (tail > 0) only so many columns are the row's own:
 * what lies behind them counts as 0, whatever it is. */
TARGET static inline __attribute__((always_inline)) lane KERNEL(load)(const VALUE *chunk, size_t s,
                                                                      size_t tail) {
    typedef int32_t bits __attribute__((vector_size(sizeof(lane)), may_alias, aligned(4)));
    static const int32_t masks[2 * PANEL_CHUNK] = {-1, -1, -1, -1, -1, -1, -1, -1,
                                                   -1, -1, -1, -1, -1, -1, -1, -1};
    const lane x = LANE_LOAD(chunk + s * LANES);
    if (tail == 0) return x;
    return (lane)((bits)x & *(const bits *)(masks + PANEL_CHUNK - tail + s * LANES));
}

TARGET static inline __attribute__((always_inline)) void
KERNEL(widen_chunk)(const VALUE *chunk, size_t row_step, size_t tail, float *wide) {
    for (size_t r = 0; r < PANEL_TILE; r++)
        for (size_t s = 0; s < REGISTERS; s++)
            *(lane *)(wide + r * PANEL_CHUNK + s * LANES) = KERNEL(load)(chunk + r * row_step, s, tail);
}

/* wide = values as floats, in tiles: n_chunks of them, the last with a tail. */
TARGET static inline __attribute__((always_inline)) void
KERNEL(widen)(const VALUE *values, size_t row_step, size_t n_chunks, size_t tail, float *wide) {
    const size_t n_whole = n_chunks - (tail > 0);
    for (size_t q = 0; q < n_whole; q++) {
        if (q % LINE_CHUNKS == 0) KERNEL(ask_for)(values + q * CHUNK_STEP, 0, PANEL_TILE, row_step);
        KERNEL(widen_chunk)(values + q * CHUNK_STEP, row_step, 0, wide + q * TILE_CHUNK);
    }
    if (tail > 0) {
        KERNEL(widen_chunk)(values + n_whole * CHUNK_STEP, row_step, tail, wide + n_whole * TILE_CHUNK);
    }
}

/* --- project ------------------------------------------------------------------------------------------ */

/* t_v += sum_r c_rv row_r for one chunk of a whole tile and W vectors from v on. */
TARGET static inline __attribute__((always_inline)) void
KERNEL(project_chunk)(size_t W, const VALUE *chunk, size_t row_step, size_t tail, const float *wide,
                      lane (*coefficient)[PROJECT_TILE], lane *t_v) {
    for (size_t s = 0; s < REGISTERS; s++) {
        lane a[PANEL_TILE];
        for (size_t r = 0; r < PANEL_TILE; r++)
            a[r] = wide != NULL ? *(const lane *)(wide + r * PANEL_CHUNK + s * LANES)
                                : KERNEL(load)(chunk + r * row_step, s, tail);
        for (size_t w = 0; w < W; w++) {
            lane sum = t_v[w * REGISTERS + s];
            for (size_t r = 0; r < PANEL_TILE; r++) sum = LANE_FMA(coefficient[r][w], a[r], sum);
            t_v[w * REGISTERS + s] = sum;
        }
    }
}

/* The same for n_chunks of them, the last with a tail, which wide holds as floats, or (NULL) values as they
 * are kept. */
TARGET static inline __attribute__((always_inline)) void
KERNEL(project_part)(size_t W, const VALUE *values, size_t row_step, const float *wide, size_t n_chunks,
                     size_t tail, const float *c, size_t m, size_t v, float *t) {
    const size_t n_whole = n_chunks - (tail > 0);
    lane coefficient[PANEL_TILE][PROJECT_TILE];
    for (size_t r = 0; r < PANEL_TILE; r++)
        for (size_t w = 0; w < W; w++) coefficient[r][w] = LANE_SET(c[r * m + v + w]);
    size_t q = 0;
    for (; n_whole - q >= LINE_CHUNKS && v == 0 && wide == NULL; q += LINE_CHUNKS) {
        KERNEL(ask_for)(values + q * CHUNK_STEP, 0, PANEL_TILE, row_step);
        for (size_t l = q; l < q + LINE_CHUNKS; l++) KERNEL(project_chunk)
        (W, values + l * CHUNK_STEP, row_step, 0, NULL, coefficient, (lane *)(t + (l * m + v) * PANEL_CHUNK));
    }
    for (; q < n_whole; q++) KERNEL(project_chunk)
    (W, values + q * CHUNK_STEP, row_step, 0, wide != NULL ? wide + q * TILE_CHUNK : NULL, coefficient,
     (lane *)(t + (q * m + v) * PANEL_CHUNK));
    if (tail > 0) {
        KERNEL(project_chunk)
        (W, values + n_whole * CHUNK_STEP, row_step, tail, NULL, coefficient,
         (lane *)(t + (n_whole * m + v) * PANEL_CHUNK));
    }
}

TARGET static inline __attribute__((always_inline)) void
KERNEL(project_step)(const VALUE *values, size_t row_step, const float *wide, size_t n_chunks, size_t tail,
                     const float *c, size_t m, float *t) {
    size_t v = 0;
    for (; v + PROJECT_TILE <= m; v += PROJECT_TILE)
        KERNEL(project_part)(PROJECT_TILE, values, row_step, wide, n_chunks, tail, c, m, v, t);
    for (; v < m; v++) KERNEL(project_part)(1, values, row_step, wide, n_chunks, tail, c, m, v, t);
}

/* The same for some rows of a tile. */
TARGET static void KERNEL(project_some)(const VALUE *values, size_t row_step, size_t n_rows,
                                        const unsigned char *which, size_t n_chunks, size_t tail,
                                        const float *c, size_t m, float *t) {
    for (size_t q = 0; q < n_chunks; q++) {
        const VALUE *chunk = values + q * CHUNK_STEP;
        const size_t there = q + 1 < n_chunks ? 0 : tail;
        for (size_t v = 0; v < m; v++)
            for (size_t s = 0; s < REGISTERS; s++) {
                lane *t_v = (lane *)(t + (q * m + v) * PANEL_CHUNK) + s;
                lane sum = *t_v;
                for (size_t r = 0; r < n_rows; r++)
                    sum = LANE_FMA(LANE_SET(c[r * m + v]),
                                   KERNEL(load)(chunk + which[r] * row_step, s, there), sum);
                *t_v = sum;
            }
    }
}

TARGET static void KERNEL(project)(const panel_values *from, size_t n_rows, const unsigned char *which,
                                   const float *c, size_t m, size_t first, size_t last, float *t) {
    __attribute__((aligned(64))) float wide[STEP_CHUNKS * TILE_CHUNK];
    const VALUE *values = (const VALUE *)from->values;
    const size_t row_step = ROW_STEP(from);
    if (n_rows < PANEL_TILE || m <= WIDEN_FROM(PROJECT_TILE)) {
        const VALUE *begin = values + first * CHUNK_STEP;
        const size_t tail = BY_ROWS && last == from->n_chunks ? from->tail : 0;
        if (n_rows < PANEL_TILE) {
            KERNEL(project_some)
            (begin, row_step, n_rows, which, last - first, tail, c, m, t + first * m * PANEL_CHUNK);
        } else {
            KERNEL(project_step)
            (begin, row_step, NULL, last - first, tail, c, m, t + first * m * PANEL_CHUNK);
        }
        return;
    }
    for (size_t q = first; q < last; q += STEP_CHUNKS) {
        const size_t count = last - q < STEP_CHUNKS ? last - q : STEP_CHUNKS;
        KERNEL(widen)
        (values + q * CHUNK_STEP, row_step, count, BY_ROWS && q + count == from->n_chunks ? from->tail : 0,
         wide);
        KERNEL(project_step)
        (values + q * CHUNK_STEP, row_step, wide, count, 0, c, m, t + q * m * PANEL_CHUNK);
    }
}

/* --- expand ------------------------------------------------------------------------------------------- */

/* sum_rv += a_r t_v for one chunk of ROW_TILE rows and W vectors. */
TARGET static inline __attribute__((always_inline)) void
KERNEL(expand_chunk)(size_t W, const VALUE *chunk, size_t row_step, size_t tail, const float *wide,
                     const lane *t_v, lane (*sum)[VECTOR_TILE][REGISTERS]) {
    for (size_t r = 0; r < ROW_TILE; r++)
        for (size_t s = 0; s < REGISTERS; s++) {
            const lane a = wide != NULL ? *(const lane *)(wide + r * PANEL_CHUNK + s * LANES)
                                        : KERNEL(load)(chunk + r * row_step, s, tail);
            for (size_t w = 0; w < W; w++) sum[r][w][s] = LANE_FMA(a, t_v[w * REGISTERS + s], sum[r][w][s]);
        }
}

/* lanes_rv += a_r t_v for ROW_TILE rows from r0 on, W vectors from v on and n_chunks chunks, the last with a
 * tail, which wide holds as floats, or (NULL) values as they are kept. */
TARGET static inline __attribute__((always_inline)) void
KERNEL(expand_part)(size_t W, size_t r0, const VALUE *values, size_t row_step, const float *wide,
                    size_t n_chunks, size_t tail, const float *t, size_t m, size_t v,
                    float (*lanes)[PANEL_VECTORS][PANEL_CHUNK]) {
    const size_t n_whole = n_chunks - (tail > 0);
    lane sum[ROW_TILE][VECTOR_TILE][REGISTERS];
    for (size_t r = 0; r < ROW_TILE; r++)
        for (size_t w = 0; w < W; w++)
            for (size_t s = 0; s < REGISTERS; s++) sum[r][w][s] = ((const lane *)lanes[r0 + r][v + w])[s];
    size_t q = 0;
    for (; n_whole - q >= LINE_CHUNKS && v == 0 && wide == NULL; q += LINE_CHUNKS) {
        KERNEL(ask_for)(values + q * CHUNK_STEP, r0, r0 + ROW_TILE, row_step);
        for (size_t l = q; l < q + LINE_CHUNKS; l++) KERNEL(expand_chunk)
        (W, values + l * CHUNK_STEP + r0 * row_step, row_step, 0, NULL,
         (const lane *)(t + (l * m + v) * PANEL_CHUNK), sum);
    }
    for (; q < n_whole; q++) KERNEL(expand_chunk)
    (W, values + q * CHUNK_STEP + r0 * row_step, row_step, 0,
     wide != NULL ? wide + q * TILE_CHUNK + r0 * PANEL_CHUNK : NULL,
     (const lane *)(t + (q * m + v) * PANEL_CHUNK), sum);
    if (tail > 0) {
        KERNEL(expand_chunk)
        (W, values + n_whole * CHUNK_STEP + r0 * row_step, row_step, tail, NULL,
         (const lane *)(t + (n_whole * m + v) * PANEL_CHUNK), sum);
    }
    for (size_t r = 0; r < ROW_TILE; r++)
        for (size_t w = 0; w < W; w++)
            for (size_t s = 0; s < REGISTERS; s++) ((lane *)lanes[r0 + r][v + w])[s] = sum[r][w][s];
}

/* Vectors that have a use for values as floats more than once. */
TARGET static inline __attribute__((always_inline)) void
KERNEL(expand_step)(const VALUE *values, size_t row_step, const float *wide, size_t n_chunks, size_t tail,
                    const float *t, size_t m, float (*lanes)[PANEL_VECTORS][PANEL_CHUNK]) {
    for (size_t r0 = 0; r0 < PANEL_TILE; r0 += ROW_TILE) {
        size_t v = 0;
        for (; v + VECTOR_TILE <= m; v += VECTOR_TILE)
            KERNEL(expand_part)(VECTOR_TILE, r0, values, row_step, wide, n_chunks, tail, t, m, v, lanes);
        for (; v < m; v++) KERNEL(expand_part)(1, r0, values, row_step, wide, n_chunks, tail, t, m, v, lanes);
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
TARGET static inline __attribute__((always_inline)) void KERNEL(expand_tile)(const VALUE *tile,
                                                                             const panel_values *from,
                                                                             size_t m, const float *t,
                                                                             double (*sums)[PANEL_VECTORS]) {
    __attribute__((aligned(64))) float lanes[PANEL_TILE][PANEL_VECTORS][PANEL_CHUNK];
    __attribute__((aligned(64))) float wide[STEP_CHUNKS * TILE_CHUNK];
    const size_t n_chunks = from->n_chunks, row_step = ROW_STEP(from);
    for (size_t block = 0; block < n_chunks; block += EXPAND_CHUNKS) {
        const size_t end = n_chunks - block < EXPAND_CHUNKS ? n_chunks : block + EXPAND_CHUNKS;
        const bool at_once = m <= VECTOR_TILE && ROW_TILE == PANEL_TILE;
        const size_t step = at_once ? EXPAND_CHUNKS : STEP_CHUNKS;
        for (size_t r = 0; r < PANEL_TILE; r++)
            for (size_t v = 0; v < m; v++)
                for (size_t s = 0; s < REGISTERS; s++) ((lane *)lanes[r][v])[s] = LANE_SET(0.0f);
        for (size_t first = block; first < end; first += step) {
            const size_t count = end - first < step ? end - first : step;
            const size_t tail = BY_ROWS && first + count == n_chunks ? from->tail : 0;
            const VALUE *values = tile + first * CHUNK_STEP;
            if (m <= WIDEN_FROM(VECTOR_TILE)) {
                KERNEL(expand_step)
                (values, row_step, NULL, count, tail, t + first * m * PANEL_CHUNK, m, lanes);
                continue;
            }
            KERNEL(widen)(values, row_step, count, tail, wide);
            KERNEL(expand_step)(values, row_step, wide, count, 0, t + first * m * PANEL_CHUNK, m, lanes);
        }
        for (size_t r = 0; r < PANEL_TILE; r++)
            for (size_t v = 0; v < m; v++) sums[r][v] += KERNEL(sum_lanes)(lanes[r][v]);
    }
}

TARGET static void KERNEL(expand_row)(const panel_values *from, size_t row, size_t m, const float *t,
                                      float *Y, size_t y_stride) {
    const VALUE *values = (const VALUE *)from->values + row * ROW_STEP(from);
    const size_t n_chunks = from->n_chunks;
    double sums[PANEL_VECTORS] = {0};
    for (size_t block = 0; block < n_chunks; block += EXPAND_CHUNKS) {
        const size_t end = n_chunks - block < EXPAND_CHUNKS ? n_chunks : block + EXPAND_CHUNKS;
        for (size_t v = 0; v < m; v++) {
            __attribute__((aligned(64))) float lanes[PANEL_CHUNK];
            lane sum[REGISTERS];
            for (size_t s = 0; s < REGISTERS; s++) sum[s] = LANE_SET(0.0f);
            for (size_t q = block; q < end; q++) {
                const lane *t_v = (const lane *)(t + (q * m + v) * PANEL_CHUNK);
                const size_t tail = BY_ROWS && q + 1 == n_chunks ? from->tail : 0;
                for (size_t s = 0; s < REGISTERS; s++)
                    sum[s] = LANE_FMA(KERNEL(load)(values + q * CHUNK_STEP, s, tail), t_v[s], sum[s]);
            }
            for (size_t s = 0; s < REGISTERS; s++) ((lane *)lanes)[s] = sum[s];
            sums[v] += KERNEL(sum_lanes)(lanes);
        }
    }
    for (size_t v = 0; v < m; v++) Y[v * y_stride] = (float)sums[v];
}

TARGET static void KERNEL(expand)(const panel_values *from, size_t n_rows, size_t m, const float *t, float *Y,
                                  size_t y_stride) {
    const size_t tile_step = BY_ROWS ? PANEL_TILE * from->row_step : from->n_chunks * TILE_CHUNK;
    for (size_t i = 0; i < n_rows; i += PANEL_TILE) {
        const size_t count = n_rows - i < PANEL_TILE ? n_rows - i : PANEL_TILE;
        const VALUE *tile = (const VALUE *)from->values + i / PANEL_TILE * tile_step;
        double sums[PANEL_TILE][PANEL_VECTORS];
        if (BY_ROWS && count < PANEL_TILE) { /* behind the last row there is none */
            const panel_values rest = {tile, from->row_step, from->n_chunks, from->tail};
            for (size_t r = 0; r < count; r++) KERNEL(expand_row)(&rest, r, m, t, Y + i + r, y_stride);
            return;
        }
        for (size_t r = 0; r < PANEL_TILE; r++)
            for (size_t v = 0; v < m; v++) sums[r][v] = 0.0;
        /* Compiled apart for one vector, whose sums then never leave the registers: a sixth faster where rows
         * are short. */
        if (m == 1)
            KERNEL(expand_tile)(tile, from, 1, t, sums);
        else
            KERNEL(expand_tile)(tile, from, m, t, sums);
        for (size_t r = 0; r < count; r++)
            for (size_t v = 0; v < m; v++) Y[v * y_stride + i + r] = (float)sums[r][v];
    }
}

#undef LANES
#undef REGISTERS
#undef TILE_CHUNK
#undef CHUNK_STEP
#undef ROW_STEP
#undef LINE_CHUNKS
#undef WIDEN_FROM
