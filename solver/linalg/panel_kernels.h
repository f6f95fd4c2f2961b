/* The inner loops of the two products of a panel, one set for each instruction set. panel_kernels.c compiles
 * them, panel_product.c calls them for blocks of rows. */
#ifndef LAMBERT_LINALG_PANEL_KERNELS_H
#define LAMBERT_LINALG_PANEL_KERNELS_H

#include "solver/linalg/panel.h"

/* Chunks of columns that expand adds in single precision before they join the sum in double. */
#define EXPAND_CHUNKS 128

/* Chunks of a step when many vectors share a pass: few enough that the values of the panel and of the vectors
 * stay in the nearest cache. */
#define STEP_CHUNKS 16

/* The values that a kernel reads: whole tiles from the first row on, or (PANEL_ROWS) rows as in a store. */
typedef struct panel_values {
    const void *values;
    size_t row_step; /* PANEL_ROWS: values from a row to the next */
    size_t n_chunks;
    size_t tail; /* PANEL_ROWS: columns of the last chunk; 0: all of them. The values behind are read and
                    masked */
} panel_values;

/* t is [n_chunks][m][PANEL_CHUNK] for m vectors, at most PANEL_VECTORS, in all of these; from is one tile for
 * project, tiles for expand.
 *
 * t_v += sum_r c_rv row_r over chunks first <= q < last and rows which[0] < which[1] < ... of a tile: c is
 * [n_rows][m]. Rows are added one after another, so it does not matter which are left out because all their c
 * are 0. */
typedef void project_kernel(const panel_values *from, size_t n_rows, const unsigned char *which,
                            const float *c, size_t m, size_t first, size_t last, float *t);

/* Y_v,r = row_r t_v for n_rows rows that follow each other: Y_v = Y + v y_stride. */
typedef void expand_kernel(const panel_values *from, size_t n_rows, size_t m, const float *t, float *Y,
                           size_t y_stride);

/* Y_v = row t_v for one row of a tile, with the same bits. */
typedef void expand_row_kernel(const panel_values *from, size_t row, size_t m, const float *t, float *Y,
                               size_t y_stride);

struct panel_kernels {
    project_kernel *project[PANEL_LAYOUTS][PANEL_PRECISIONS];
    expand_kernel *expand[PANEL_LAYOUTS][PANEL_PRECISIONS];
    expand_row_kernel *expand_row[PANEL_LAYOUTS][PANEL_PRECISIONS];
    /* total += part; part = 0. */
    void (*flush)(size_t count, float *restrict part, double *restrict total);
};

#endif
