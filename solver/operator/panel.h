/* A dense row-major matrix in single precision and the two products that every dense kind is made of.
 * Knows nothing of light: rows, columns, vectors. */
#ifndef LAMBERT_OPERATOR_PANEL_H
#define LAMBERT_OPERATOR_PANEL_H

#include "store/status.h"

/* Rows are padded with zeros to whole chunks of this many floats (one cache line). */
#define PANEL_CHUNK 16
/* So many vectors share one pass over a matrix; more are cut into passes. At 16, one core computes about as
 * long as it reads. */
#define PANEL_VECTORS 16
/* Work areas are handed out in pieces of this alignment, in bytes. */
#define PANEL_ALIGN 64

typedef struct panel_kernels panel_kernels;

typedef struct panel {
    size_t n;                     /* rows */
    size_t k;                     /* columns */
    size_t stride;                /* k rounded up to PANEL_CHUNK */
    float *data;                  /* [n][stride], aligned to PANEL_ALIGN */
    void *memory;                 /* where data lies, owned */
    const panel_kernels *kernels; /* for this CPU */
} panel;

/* Fills a from rows [n][k], in huge pages when it is large. The caller frees with panel_free.
 * Errors: LAM_ERR_MEMORY; LAM_ERR_NUMERIC names the entry that is not finite. */
lam_status panel_create(size_t n, size_t k, const float *rows, const char *name, panel *a, lam_error *error);

/* A zeroed panel is allowed. */
void panel_free(panel *a);

/* rows [n][k] = a, without the padding. */
void panel_copy_rows(const panel *a, float *rows);

size_t panel_bytes(const panel *a);

/* Bytes of work for either product with m vectors; 0 when that overflows. Never 0 otherwise. */
size_t panel_work_bytes(const panel *a, size_t m);

/* T_v = a^T X_v for m vectors: X_v = X + v x_stride holds n numbers, T_v = T + v t_stride gets k.
 * Rows where every X_v is 0 are not read. Sums over rows end in double; the bits of T_v depend on X_v alone.
 * work is aligned to PANEL_ALIGN. Cost: O(nk) a vector, one pass over a for PANEL_VECTORS of them. */
void panel_project(const panel *a, size_t m, const float *X, size_t x_stride, float *T, size_t t_stride,
                   void *work);

/* Y_v = a T_v, the same the other way round: T_v holds k numbers, Y_v gets n. */
void panel_expand(const panel *a, size_t m, const float *T, size_t t_stride, float *Y, size_t y_stride,
                  void *work);

/* The instruction sets this CPU can run, best first; NULL past the last. For tests: panel_create takes the
 * first. */
const panel_kernels *panel_kernels_available(size_t index);
const char *panel_kernels_name(const panel_kernels *kernels);

/* *total += bytes rounded up to PANEL_ALIGN; false on an overflow. */
static inline bool work_add(size_t *total, size_t bytes) {
    size_t rounded;
    return !__builtin_add_overflow(bytes, PANEL_ALIGN - 1, &rounded) &&
           !__builtin_add_overflow(*total, rounded / PANEL_ALIGN * PANEL_ALIGN, total);
}

/* The next piece of a work area that was measured with work_add. */
static inline void *work_take(void **work, size_t bytes) {
    char *piece = *work;
    *work = piece + (bytes + PANEL_ALIGN - 1) / PANEL_ALIGN * PANEL_ALIGN;
    return piece;
}

#endif
