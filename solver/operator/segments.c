/* Owns the runs of a sparse V and their sums for the CPU at hand. */
#include "solver/operator/segments.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>

struct segment_kernels {
    const char *name;
    void (*sum)(const segments *s, const float *x, float *t);
};

/* 8 and 4 sums side by side, whatever the width of a register: so the order of the additions is one. */
typedef double wide __attribute__((vector_size(64)));
typedef double half __attribute__((vector_size(32)));
typedef float wide_floats __attribute__((vector_size(32), aligned(4), may_alias));
typedef float half_floats __attribute__((vector_size(16), aligned(4), may_alias));

#define WIDE(x) __builtin_convertvector(*(const wide_floats *)(x), wide)
#define HALF(x) __builtin_convertvector(*(const half_floats *)(x), half)

/* sum weight_j x_j, j < count; weight may be NULL. */
static inline __attribute__((always_inline)) float sum_run(const float *x, const float *weight,
                                                           size_t count) {
    wide one = {0}, two = {0};
    half three = {0};
    double rest = 0;
    size_t j = 0;
    for (; j + 16 <= count; j += 16) {
        one += weight != NULL ? WIDE(weight + j) * WIDE(x + j) : WIDE(x + j);
        two += weight != NULL ? WIDE(weight + j + 8) * WIDE(x + j + 8) : WIDE(x + j + 8);
    }
    if (j + 8 <= count) {
        one += weight != NULL ? WIDE(weight + j) * WIDE(x + j) : WIDE(x + j);
        j += 8;
    }
    if (j + 4 <= count) {
        three = weight != NULL ? HALF(weight + j) * HALF(x + j) : HALF(x + j);
        j += 4;
    }
    for (; j < count; j++) rest += weight != NULL ? (double)weight[j] * (double)x[j] : (double)x[j];
    if (count >= 8) {
        one += two;
        for (int lane = 0; lane < 4; lane++) three[lane] += one[lane] + one[lane + 4];
    }
    return (float)(((three[0] + three[2]) + (three[1] + three[3])) + rest);
}

static inline __attribute__((always_inline)) void sum_runs(const segments *s, const float *x, float *t) {
    const uint64_t *begin = s->begin;
    if (s->weight == NULL)
        for (size_t p = 0; p < s->k; p++) t[p] = sum_run(x + begin[p], NULL, begin[p + 1] - begin[p]);
    else
        for (size_t p = 0; p < s->k; p++)
            t[p] = sum_run(x + begin[p], s->weight + begin[p], begin[p + 1] - begin[p]);
}

static void sum_portable(const segments *s, const float *x, float *t) {
    sum_runs(s, x, t);
}
static const segment_kernels kernels_portable = {"portable", sum_portable};

#if defined(__x86_64__)
__attribute__((target("avx2,fma"))) static void sum_avx2(const segments *s, const float *x, float *t) {
    sum_runs(s, x, t);
}
__attribute__((target("avx512f,avx512vl"))) static void sum_avx512(const segments *s, const float *x,
                                                                   float *t) {
    sum_runs(s, x, t);
}
static const segment_kernels kernels_avx2 = {"avx2", sum_avx2};
static const segment_kernels kernels_avx512 = {"avx512", sum_avx512};
#endif

const segment_kernels *segment_kernels_available(size_t index) {
    const segment_kernels *available[3];
    size_t count = 0;
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl"))
        available[count++] = &kernels_avx512;
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) available[count++] = &kernels_avx2;
#endif
    available[count++] = &kernels_portable;
    return index < count ? available[index] : NULL;
}

const char *segment_kernels_name(const segment_kernels *kernels) {
    return kernels->name;
}

lam_status segments_create(size_t n, size_t k, uint64_t *begin, float *weight, segments *s,
                           lam_error *error) {
    lam_status status = LAM_OK;
    if (begin[0] != 0) FAIL(error, LAM_ERR_NUMERIC, "/operator/I[0] = %" PRIu64 ", must be 0", begin[0]);
    for (size_t p = 0; p < k; p++)
        if (begin[p + 1] < begin[p] || begin[p + 1] > n)
            FAIL(error, LAM_ERR_NUMERIC,
                 "/operator/I[%zu] = %" PRIu64 ", must be at least %" PRIu64 " and at most %zu", p + 1,
                 begin[p + 1], begin[p], n);
    if (k > 0 && begin[k] != n)
        FAIL(error, LAM_ERR_NUMERIC, "/operator/I[%zu] = %" PRIu64 ", must be %zu", k, begin[k], n);
    for (size_t j = 0; weight != NULL && j < n; j++)
        if (!isfinite(weight[j]))
            FAIL(error, LAM_ERR_NUMERIC, "/operator/weight[%zu] = %g, must be finite", j, (double)weight[j]);
    *s =
        (segments){.n = n, .k = k, .begin = begin, .weight = weight, .kernels = segment_kernels_available(0)};
done:
    return status;
}

void segments_free(segments *s) {
    free(s->begin);
    free(s->weight);
    *s = (segments){0};
}

size_t segments_bytes(const segments *s) {
    return (s->k + 1) * sizeof *s->begin + (s->weight != NULL ? s->n * sizeof *s->weight : 0);
}

void segments_sum(const segments *s, const float *x, float *t) {
    s->kernels->sum(s, x, t);
}

void segments_spread(const segments *s, const float *t, float *x) {
    for (size_t p = 0; p < s->k; p++)
        for (uint64_t j = s->begin[p]; j < s->begin[p + 1]; j++)
            x[j] = s->weight != NULL ? s->weight[j] * t[p] : t[p];
}
