/* A piece of the tree has its elements and scaling coefficients in memory of its thread, [..][WAVELET_WIDE],
 * which stays in the second cache; the steps above all pieces have theirs in `above`, by step.
 * wavelet_wide_kernels.inc has the loops. */
#include "solver/operator/wavelet/wavelet_wide.h"

#include "solver/base/cpu.h"
#include "solver/base/parallel.h"

#include <string.h>

/* Steps first to last - 1, or those that `which` has at these places, whose scaling coefficients are in s
 * from that of step first_scaling on, and whose elements are in X from position first_position on. */
typedef struct wide_steps {
    const wavelet_plan *plan;
    size_t first, last;
    const uint32_t *which;
    size_t first_scaling, first_position;
} wide_steps;

static inline float *wide_scaling(const wide_steps *w, float *s, size_t step) {
    return s + (step - w->first_scaling) * WAVELET_SCALING * WAVELET_WIDE;
}

static inline float *wide_place(const wide_steps *w, float *X, const plan_step *a) {
    return X + (a->begin - w->first_position) * WAVELET_WIDE;
}

#define KERNEL(name) name##_portable
#define TARGET
#define LANE_FLOATS 4
#include "solver/operator/wavelet/wavelet_wide_kernels.inc"

#ifdef CPU_AVX2_TARGET
#define KERNEL(name) name##_avx2
#define TARGET CPU_AVX2_TARGET
#define LANE_FLOATS 8
#include "solver/operator/wavelet/wavelet_wide_kernels.inc"

#define KERNEL(name) name##_avx512
#define TARGET CPU_AVX512_TARGET
#define LANE_FLOATS 16
#include "solver/operator/wavelet/wavelet_wide_kernels.inc"
#endif

typedef void transform(const wide_steps *w, float *X, const float *scale, float *C, float *s);

static transform *const forward[] = CPU_TABLE(forward_portable, forward_avx2, forward_avx512);
static transform *const inverse[] = CPU_TABLE(inverse_portable, inverse_avx2, inverse_avx512);

/* Floats of the elements of a piece, and of it with its scaling coefficients. */
static size_t elements_room(const wavelet_plan *plan) {
    return plan->most_positions * WAVELET_WIDE;
}

static size_t piece_room(const wavelet_plan *plan) {
    return elements_room(plan) + plan->most_steps * WAVELET_SCALING * WAVELET_WIDE;
}

size_t wavelet_wide_work(const wavelet_plan *plan, size_t n_threads) {
    return plan->n_steps * WAVELET_SCALING * WAVELET_WIDE + n_threads * piece_room(plan);
}

/* Scaling coefficients above all pieces, and the memory of each thread. */
typedef struct wide_job {
    const wavelet_plan *plan;
    wavelet_wide_visit *visit;
    void *context;
    const float *scale;
    float *C, *above, *rooms;
} wide_job;

static wide_job job_of(const wavelet_plan *plan, wavelet_wide_visit *visit, void *context, const float *scale,
                       float *C, float *work) {
    return (wide_job){
        plan, visit, context, scale, C, work, work + plan->n_steps * WAVELET_SCALING * WAVELET_WIDE};
}

static wide_steps steps_of(const wavelet_plan *plan, const wavelet_piece *piece) {
    return (wide_steps){plan, piece->first, piece->last,
                        NULL, piece->first, wavelet_piece_begin(plan, piece)};
}

static wide_steps steps_above(const wavelet_plan *plan) {
    return (wide_steps){plan, 0, plan->n_above, plan->above, 0, 0};
}

/* The scaling coefficients of a piece's topmost step, which the steps above it know. */
static float *top_of(const wide_job *j, const wavelet_piece *piece) {
    return j->above + (size_t)(piece->last - 1) * WAVELET_SCALING * WAVELET_WIDE;
}

/* Writes the transform of a piece that is 0. */
static void leave_dark(const wide_job *j, const wavelet_piece *piece) {
    for (size_t t = piece->first; t < piece->last; t++) {
        const plan_step *a = &j->plan->steps[t];
        memset(j->C + (size_t)a->first * WAVELET_WIDE, 0, a->own * WAVELET_WIDE * sizeof *j->C);
    }
    memset(top_of(j, piece), 0, WAVELET_SCALING * WAVELET_WIDE * sizeof *j->above);
}

static void forward_pieces(const void *job, size_t thread, size_t first, size_t last) {
    const wide_job *j = job;
    const wavelet_plan *plan = j->plan;
    float *X = j->rooms + thread * piece_room(plan), *s = X + elements_room(plan);
    for (size_t k = first; k < last; k++) {
        const wavelet_piece *piece = &plan->pieces[k];
        const wide_steps w = steps_of(plan, piece);
        const size_t end = wavelet_piece_end(plan, piece);
        j->visit(j->context, k, w.first_position, end, X);
        if (wavelet_is_dark(X, (end - w.first_position) * WAVELET_WIDE)) {
            leave_dark(j, piece);
            continue;
        }
        forward[cpu_best()](&w, X, j->scale, j->C, s);
        memcpy(top_of(j, piece), wide_scaling(&w, s, piece->last - 1),
               WAVELET_SCALING * WAVELET_WIDE * sizeof *s);
    }
}

static void inverse_pieces(const void *job, size_t thread, size_t first, size_t last) {
    const wide_job *j = job;
    const wavelet_plan *plan = j->plan;
    float *X = j->rooms + thread * piece_room(plan), *s = X + elements_room(plan);
    for (size_t k = first; k < last; k++) {
        const wavelet_piece *piece = &plan->pieces[k];
        const wide_steps w = steps_of(plan, piece);
        memcpy(wide_scaling(&w, s, piece->last - 1), top_of(j, piece),
               WAVELET_SCALING * WAVELET_WIDE * sizeof *s);
        inverse[cpu_best()](&w, X, NULL, j->C, s);
        j->visit(j->context, k, w.first_position, wavelet_piece_end(plan, piece), X);
    }
}

/* The scaling coefficients of the root are the last of all. */
static void copy_root(const wide_job *j, bool back) {
    const wavelet_plan *plan = j->plan;
    const size_t scaling = plan->steps[plan->n_steps - 1].scaling, first = plan->n_used - scaling;
    float *s = j->above + (plan->n_steps - 1) * WAVELET_SCALING * WAVELET_WIDE;
    for (size_t k = 0; k < scaling; k++)
        for (size_t v = 0; v < WAVELET_WIDE; v++) {
            float *at = &j->C[(first + k) * WAVELET_WIDE + v];
            if (back)
                s[k * WAVELET_WIDE + v] = *at;
            else
                *at = s[k * WAVELET_WIDE + v] * j->scale[first + k];
        }
}

void wavelet_wide_forward(const wavelet_plan *plan, wavelet_wide_visit *fill, void *context,
                          const float *scale, float *C, float *work, size_t n_threads) {
    const wide_job job = job_of(plan, fill, context, scale, C, work);
    const wide_steps above = steps_above(plan);
    parallel_share(n_threads, plan->n_pieces, 1, forward_pieces, &job);
    forward[cpu_best()](&above, NULL, scale, C, job.above);
    copy_root(&job, false);
}

void wavelet_wide_inverse(const wavelet_plan *plan, float *C, wavelet_wide_visit *use, void *context,
                          float *work, size_t n_threads) {
    const wide_job job = job_of(plan, use, context, NULL, C, work);
    const wide_steps above = steps_above(plan);
    copy_root(&job, true);
    inverse[cpu_best()](&above, NULL, NULL, C, job.above);
    parallel_share(n_threads, plan->n_pieces, 1, inverse_pieces, &job);
}
