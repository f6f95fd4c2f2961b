/* A dense matrix and the two products that every dense kind is made of. Its values are kept in
 * single precision or in 16 or 8 bits; products are made in single precision and summed in double.
 * Knows nothing of light: rows, columns, vectors. */
#ifndef LAMBERT_LINALG_PANEL_H
#define LAMBERT_LINALG_PANEL_H

#include "solver/base/cpu.h"
#include "store/status.h"
#include "store/store_map.h"

#include <stdint.h>

/* Made here, it is kept in tiles of PANEL_TILE rows, [rows / PANEL_TILE][columns /
 * PANEL_CHUNK][PANEL_TILE][PANEL_CHUNK], padded with zeros: memory is read straight on although several rows
 * are summed at once, and yet a single row takes up whole cache lines (f32) of its own. Mapped from a store,
 * it is kept in rows as they are there, [rows][columns] without padding, and nobody has to
 * copy it: in f32 as fast, in 16 bits about a fifth and in 8 bits a third slower (one vector; Xeon, 2 cores).
 */
#define PANEL_TILE 4
#define PANEL_CHUNK 16
/* So many vectors share one pass over a matrix; more are cut into passes. At 16, one core computes about as
 * long as it reads. */
#define PANEL_VECTORS 16

/* How values are kept: float, IEEE half precision, signed bytes. */
typedef enum panel_precision { PANEL_F32, PANEL_F16, PANEL_I8 } panel_precision;
enum { PANEL_PRECISIONS = 3 };

/* Where a value is: PANEL_TILES as above, PANEL_ROWS as in a store. Both give the same bits. */
typedef enum panel_layout { PANEL_TILES, PANEL_ROWS } panel_layout;
enum { PANEL_LAYOUTS = 2 };

/* Bytes behind the last row of PANEL_ROWS that are read with it, and ignored. */
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
    float *scale;                 /* [k], what the values of a column are multiplied by; NULL: 1; owned */
    void *memory;                 /* where data lies, owned */
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

/* The same from values as a store keeps them, [n][k] of a precision, with scale [k] or NULL for 1.
 * Errors: also LAM_ERR_NUMERIC for a scale that is not above 0 and finite. */
lam_status panel_create_kept(size_t n, size_t k, panel_precision precision, const void *values,
                             const float *scale, const char *name, panel *a, lam_error *error);

/* a becomes values [n][k] as they lie where the caller keeps them for as long as a is there, with PANEL_SLACK
 * bytes behind that can be read; only scale is copied, and checked. Values are taken to be finite: what they
 * are compared with is the store's affair. Errors: as panel_create_kept. */
lam_status panel_view(size_t n, size_t k, panel_precision precision, const void *values, const float *scale,
                      const char *name, panel *a, lam_error *error);

/* out: what a, in single precision, becomes in another one. f16 gets a scale where a column would pass its
 * range, powers of two; i8 always one, the largest magnitude of a column over 127. Every value is off by at
 * most half a unit in its last place (f16: at least 2^-25 of the column's scale), i8 by half a scale.
 * Errors: LAM_ERR_MEMORY. */
lam_status panel_convert(const panel *a, panel_precision precision, const char *name, panel *out,
                         lam_error *error);

/* A zeroed panel is allowed. */
void panel_free(panel *a);

/* rows [n][k] = a, without the padding: the values times the scale. */
void panel_copy_rows(const panel *a, float *rows);
/* rows [count][k] = rows first ... first + count of it. */
void panel_copy_some(const panel *a, size_t first, size_t count, float *rows);
/* values [n][k] as they are kept, without the padding. */
void panel_copy_values(const panel *a, void *values);

/* Bytes that a product reads. */
size_t panel_bytes(const panel *a);

/* Bytes of work for either product with m vectors; 0 when that overflows. Never 0 otherwise. Depends on
 * n_threads. */
size_t panel_work_bytes(const panel *a, size_t m);

/* T_v = a^T X_v for m vectors: X_v = X + v x_stride holds n numbers, T_v = T + v t_stride gets k.
 * Rows where every X_v is 0 are not read. Sums over rows end in double; the bits of T_v depend on X_v alone,
 * not on the batch nor on the number of threads.
 * work is aligned to WORK_AREA_ALIGN. Cost: O(nk) a vector, one pass over a for PANEL_VECTORS of them. */
void panel_project(const panel *a, size_t m, const float *X, size_t x_stride, float *T, size_t t_stride,
                   void *work);

/* Y_v = a T_v, the same the other way round: T_v holds k numbers, Y_v gets n. */
void panel_expand(const panel *a, size_t m, const float *T, size_t t_stride, float *Y, size_t y_stride,
                  void *work);

/* The same for chosen rows, in any order, also twice: Y_v gets n_rows numbers, bit for bit those of
 * panel_expand. Row r is rows[r], or map[rows[r]] where map is not NULL; only these rows are read. */
void panel_expand_rows(const panel *a, size_t m, const float *T, size_t t_stride, size_t n_rows,
                       const uint32_t *rows, const uint32_t *map, float *Y, size_t y_stride, void *work);

/* The kernels of one level, at most cpu_best(), which panel_create takes. For tests. */
const panel_kernels *panel_kernels_of(cpu_level level);

#endif
