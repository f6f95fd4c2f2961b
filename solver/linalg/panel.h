/* A dense matrix and its two products, x -> a^T x and t -> a t. Values are kept in single precision, f16 or
 * i8; products are made in single precision and summed in double. It knows rows, columns and vectors, no
 * light. */
#ifndef LAMBERT_LINALG_PANEL_H
#define LAMBERT_LINALG_PANEL_H

#include "solver/base/cpu.h"
#include "store/status.h"
#include "store/store_map.h"

#include <stdint.h>

/* A panel in memory lies in tiles of PANEL_TILE rows, [rows / PANEL_TILE][columns /
 * PANEL_CHUNK][PANEL_TILE][PANEL_CHUNK], padded with zeros: the products read memory in sequence although
 * they sum several rows at once, and a single row (f32) still fills whole cache lines. A panel mapped from a
 * store keeps its rows, [rows][columns] without padding, and is not copied: products are as fast in f32,
 * about a fifth slower in f16 and a third slower in i8 (one vector; Xeon, 2 cores). */
#define PANEL_TILE 4
#define PANEL_CHUNK 16
/* Vectors that share one pass over a matrix; a larger batch takes several passes. With 16, one core computes
 * about as long as it reads. */
#define PANEL_VECTORS 16

/* The type of stored values: float, IEEE half precision, signed bytes. */
typedef enum panel_precision { PANEL_F32, PANEL_F16, PANEL_I8 } panel_precision;
enum { PANEL_PRECISIONS = 3 };

/* PANEL_TILES: as above; PANEL_ROWS: as in a store. Both give the same bits. */
typedef enum panel_layout { PANEL_TILES, PANEL_ROWS } panel_layout;
enum { PANEL_LAYOUTS = 2 };

/* Readable bytes that must follow the last row of PANEL_ROWS; their values do not matter. */
#define PANEL_SLACK (PANEL_CHUNK * sizeof(float))

typedef struct panel_kernels panel_kernels;

typedef struct panel {
    size_t n;      /* rows */
    size_t k;      /* columns */
    size_t stride; /* k rounded up to PANEL_CHUNK */
    panel_precision precision;
    panel_layout layout;
    void *data;                   /* PANEL_TILES: tiles, aligned to WORK_AREA_ALIGN */
    const void *rows;             /* PANEL_ROWS: [n][k] */
    store_map *mapping;           /* held, where rows lie in one; else NULL */
    float *scale;                 /* [k], the factor of each column; NULL: 1; owned */
    void *memory;                 /* the allocation that holds data, owned */
    size_t n_threads;             /* that one product may use, at least 1 */
    const panel_kernels *kernels; /* for this CPU */
} panel;

/* The contract's names "f32", "f16", "i8"; false for another. */
const char *panel_precision_name(panel_precision precision);
bool panel_precision_find(const char *name, panel_precision *precision);
/* Bytes of a value. */
size_t panel_value_size(panel_precision precision);

/* Fills a from rows [n][k], in huge pages when it is large. The caller frees with panel_free.
 * Errors: LAM_ERR_MEMORY; LAM_ERR_NUMERIC names the entry that is not finite. */
lam_status panel_create(size_t n, size_t k, const float *rows, const char *name, panel *a, lam_error *error);

/* panel_create from values [n][k] of any precision, as a store keeps them, with scale [k] or NULL for 1.
 * Errors: also LAM_ERR_NUMERIC for a scale that is not above 0 and finite. */
lam_status panel_create_kept(size_t n, size_t k, panel_precision precision, const void *values,
                             const float *scale, const char *name, panel *a, lam_error *error);

/* a refers to values [n][k], which the caller keeps for as long as a lives, with PANEL_SLACK readable bytes
 * behind them; only scale is copied and checked. The values are not tested for being finite; the store's
 * checksums cover them. Errors: as panel_create_kept. */
lam_status panel_view(size_t n, size_t k, panel_precision precision, const void *values, const float *scale,
                      const char *name, panel *a, lam_error *error);

/* out = a, which is in single precision, rounded to another one. f16 gets a scale, a power of two, where a
 * column passes its range; i8 always gets one, the largest magnitude of a column over 127. Every value is off
 * by at most half a unit in its last place (f16: at least 2^-25 of the column's scale), i8 by half a scale.
 * Errors: LAM_ERR_MEMORY. */
lam_status panel_convert(const panel *a, panel_precision precision, const char *name, panel *out,
                         lam_error *error);

/* A zeroed panel is allowed. */
void panel_free(panel *a);

/* rows [n][k] = a, without the padding: the values times the scale. */
void panel_copy_rows(const panel *a, float *rows);
/* rows [count][k] = rows first ... first + count of a. */
void panel_copy_some(const panel *a, size_t first, size_t count, float *rows);
/* values [n][k] in the precision of a, without the padding. */
void panel_copy_values(const panel *a, void *values);

/* Bytes that a product reads. */
size_t panel_bytes(const panel *a);

/* Bytes of work for either product with m vectors; 0 when that overflows. Never 0 otherwise. Depends on
 * n_threads. */
size_t panel_work_bytes(const panel *a, size_t m);

/* T_v = a^T X_v for m vectors: X_v = X + v x_stride holds n numbers, T_v = T + v t_stride gets k.
 * Rows where every X_v is 0 are not read. Sums over rows end in double; the bits of T_v depend on X_v alone,
 * not on the batch nor on the number of threads.
 * work is aligned to WORK_AREA_ALIGN. Cost: O(nk) per vector, one pass over a for PANEL_VECTORS of them. */
void panel_project(const panel *a, size_t m, const float *X, size_t x_stride, float *T, size_t t_stride,
                   void *work);

/* Y_v = a T_v: T_v holds k numbers, Y_v gets n. Rounding, threads and cost are those of panel_project. */
void panel_expand(const panel *a, size_t m, const float *T, size_t t_stride, float *Y, size_t y_stride,
                  void *work);

/* panel_expand for chosen rows, in any order, which may repeat: Y_v gets n_rows numbers, bit for bit those of
 * panel_expand. Row r is rows[r], or map[rows[r]] where map is not NULL; only these rows are read. */
void panel_expand_rows(const panel *a, size_t m, const float *T, size_t t_stride, size_t n_rows,
                       const uint32_t *rows, const uint32_t *map, float *Y, size_t y_stride, void *work);

/* The kernels of one level, at most cpu_best(), which panel_create takes. For tests. */
const panel_kernels *panel_kernels_of(cpu_level level);

#endif
