/* The inner loops of panel.c, included there once for each instruction set, which defines
 *   KERNEL(name) TARGET                  the name and the attribute of its functions
 *   lane LANE_SET(x) LANE_FMA(a, b, c)   a vector register, x in all of it, a b + c
 *   float KERNEL(lane_sum)(lane)         the sum of a register, by halves
 *   ROW_TILE VECTOR_TILE                 rows and vectors of expand whose sums stay in registers
 *   PROJECT_TILE                         the same for the vectors of project
 * A chunk is always summed in PANEL_CHUNK lanes, so the bits depend on neither the width of a register nor
 * the tiles: only on whether a b + c is rounded once or twice. */

#define LANES (sizeof(lane) / sizeof(float))
#define REGISTERS (PANEL_CHUNK / LANES)

/* t_v += sum_r c_rv row_r for W vectors from v on, one chunk. */
TARGET static inline __attribute__((always_inline)) void KERNEL(project_tile)(size_t W, size_t n_rows,
                                                                              const float *const *rows,
                                                                              const float *c, size_t m,
                                                                              size_t q, size_t v, float *t) {
    lane sum[PROJECT_TILE][REGISTERS];
    lane *t_v = (lane *)(t + (q * m + v) * PANEL_CHUNK);
    for (size_t w = 0; w < W; w++)
        for (size_t s = 0; s < REGISTERS; s++) sum[w][s] = t_v[w * REGISTERS + s];
#pragma GCC unroll 8
    for (size_t r = 0; r < n_rows; r++) {
        const lane *row = (const lane *)(rows[r] + q * PANEL_CHUNK);
        for (size_t w = 0; w < W; w++) {
            lane coefficient = LANE_SET(c[r * m + v + w]);
            for (size_t s = 0; s < REGISTERS; s++) sum[w][s] = LANE_FMA(coefficient, row[s], sum[w][s]);
        }
    }
    for (size_t w = 0; w < W; w++)
        for (size_t s = 0; s < REGISTERS; s++) t_v[w * REGISTERS + s] = sum[w][s];
}

/* The same for one vector and PROJECT_ROWS rows, whose numbers stay in registers all the way. */
TARGET static void KERNEL(project_one)(const float *const *rows, const float *c, size_t n_chunks, float *t) {
    lane coefficient[PROJECT_ROWS];
    for (size_t r = 0; r < PROJECT_ROWS; r++) coefficient[r] = LANE_SET(c[r]);
    for (size_t q = 0; q < n_chunks; q++) {
        lane *t_q = (lane *)(t + q * PANEL_CHUNK);
        for (size_t s = 0; s < REGISTERS; s++) {
            lane sum = t_q[s];
            for (size_t r = 0; r < PROJECT_ROWS; r++)
                sum = LANE_FMA(coefficient[r], ((const lane *)(rows[r] + q * PANEL_CHUNK))[s], sum);
            t_q[s] = sum;
        }
    }
}

/* t += sum over rows: c is [n_rows][m], t is [n_chunks][m][PANEL_CHUNK]. Rows are added one after another,
 * so it does not matter how they are grouped into calls. */
TARGET static void KERNEL(project)(size_t n_rows, const float *const *rows, const float *c, size_t m,
                                   size_t n_chunks, float *t) {
    if (m == 1 && n_rows == PROJECT_ROWS) {
        KERNEL(project_one)(rows, c, n_chunks, t);
        return;
    }
    for (size_t q = 0; q < n_chunks; q++) {
        size_t v = 0;
        if (n_rows == PROJECT_ROWS) {
            for (; v + PROJECT_TILE <= m; v += PROJECT_TILE)
                KERNEL(project_tile)(PROJECT_TILE, PROJECT_ROWS, rows, c, m, q, v, t);
            for (; v + PROJECT_TILE / 2 <= m; v += PROJECT_TILE / 2)
                KERNEL(project_tile)(PROJECT_TILE / 2, PROJECT_ROWS, rows, c, m, q, v, t);
            if (v + 2 <= m) {
                KERNEL(project_tile)(2, PROJECT_ROWS, rows, c, m, q, v, t);
                v += 2;
            }
            for (; v < m; v++) KERNEL(project_tile)(1, PROJECT_ROWS, rows, c, m, q, v, t);
        } else {
            for (; v < m; v++) KERNEL(project_tile)(1, n_rows, rows, c, m, q, v, t);
        }
    }
}

/* sums_rv += a_r t_v for R rows and W vectors from v on, over chunks first <= q < last. */
TARGET static inline __attribute__((always_inline)) void
KERNEL(expand_tile)(size_t R, size_t W, const float *rows, size_t stride, const float *t, size_t m,
                    size_t first, size_t last, size_t v, double (*sums)[PANEL_VECTORS]) {
    lane sum[ROW_TILE][VECTOR_TILE][REGISTERS];
    for (size_t r = 0; r < R; r++)
        for (size_t w = 0; w < W; w++)
            for (size_t s = 0; s < REGISTERS; s++) sum[r][w][s] = LANE_SET(0.0f);
    for (size_t q = first; q < last; q++) {
        const lane *t_v = (const lane *)(t + (q * m + v) * PANEL_CHUNK);
        for (size_t r = 0; r < R; r++) {
            const lane *row = (const lane *)(rows + r * stride + q * PANEL_CHUNK);
            /* The same place in the next R rows; past the end it does nothing. */
            if (v == 0) __builtin_prefetch((const void *)((uintptr_t)row + R * stride * sizeof(float)));
            for (size_t w = 0; w < W; w++)
                for (size_t s = 0; s < REGISTERS; s++)
                    sum[r][w][s] = LANE_FMA(row[s], t_v[w * REGISTERS + s], sum[r][w][s]);
        }
    }
    for (size_t r = 0; r < R; r++)
        for (size_t w = 0; w < W; w++) {
            for (size_t half = REGISTERS / 2; half > 0; half /= 2)
                for (size_t s = 0; s < half; s++) sum[r][w][s] += sum[r][w][s + half];
            sums[r][v + w] += (double)KERNEL(lane_sum)(sum[r][w][0]);
        }
}

/* R rows from i on. Within a block of columns a lane adds at most EXPAND_CHUNKS products. */
TARGET static inline __attribute__((always_inline)) void
KERNEL(expand_rows)(size_t R, const panel *a, size_t i, size_t m, const float *t, float *Y, size_t y_stride) {
    double sums[ROW_TILE][PANEL_VECTORS] = {{0}};
    size_t n_chunks = a->stride / PANEL_CHUNK;
    for (size_t first = 0; first < n_chunks; first += EXPAND_CHUNKS) {
        size_t last = n_chunks - first < EXPAND_CHUNKS ? n_chunks : first + EXPAND_CHUNKS, v = 0;
        for (; v + VECTOR_TILE <= m; v += VECTOR_TILE) KERNEL(expand_tile)
        (R, VECTOR_TILE, a->data + i * a->stride, a->stride, t, m, first, last, v, sums);
        for (; v < m; v++)
            KERNEL(expand_tile)(R, 1, a->data + i * a->stride, a->stride, t, m, first, last, v, sums);
    }
    for (size_t r = 0; r < R; r++)
        for (size_t v = 0; v < m; v++) Y[v * y_stride + i + r] = (float)sums[r][v];
}

/* Y_v = a t_v: t is [n_chunks][m][PANEL_CHUNK]. */
TARGET static void KERNEL(expand)(const panel *a, size_t m, const float *t, float *Y, size_t y_stride) {
    size_t i = 0;
    for (; i + ROW_TILE <= a->n; i += ROW_TILE) KERNEL(expand_rows)(ROW_TILE, a, i, m, t, Y, y_stride);
    for (; i < a->n; i++) KERNEL(expand_rows)(1, a, i, m, t, Y, y_stride);
}

/* total += part; part = 0. */
TARGET static void KERNEL(flush)(size_t count, float *restrict part, double *restrict total) {
#pragma omp simd
    for (size_t j = 0; j < count; j++) {
        total[j] += (double)part[j];
        part[j] = 0.0f;
    }
}

#undef LANES
#undef REGISTERS
#undef KERNEL
#undef TARGET
#undef lane
#undef LANE_SET
#undef LANE_FMA
#undef ROW_TILE
#undef VECTOR_TILE
#undef PROJECT_TILE
