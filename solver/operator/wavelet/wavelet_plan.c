/* A plan computes c = W x and x = W^T c for the coefficients that are used (Gortler et al. 1993): a subtree
 * of at most WHOLE_ELEMENTS elements with none in use is one matrix, shared by subtrees of equal shapes, and
 * threads take pieces of the tree. wavelet_kernels.inc has the loops. */
#include "solver/operator/wavelet/wavelet_plan.h"

#include "solver/base/array_grow.h"
#include "solver/base/cpu.h"
#include "solver/base/parallel.h"
#include "store/status.h"

#include <stdlib.h>
#include <string.h>

/* Most elements of a piece, so that each thread gets several and each is worth its dispatch; most elements of
 * a subtree that becomes one matrix. */
enum { PIECE_ELEMENTS = 4096, WHOLE_ELEMENTS = 96 };

/* Numbers that are compared with 0 at once. */
enum { LOOKED_AT = 64 };

void wavelet_plan_rest(wavelet_plan *plan) {
    free(plan->steps);
    free(plan->matrices);
    free(plan->coefficient);
    free(plan->leaves);
    free(plan->pieces);
    free(plan->above);
    plan->steps = NULL;
    plan->matrices = NULL;
    plan->coefficient = plan->leaves = plan->above = NULL;
    plan->pieces = NULL;
}

void wavelet_plan_free(wavelet_plan *plan) {
    wavelet_plan_rest(plan);
    *plan = (wavelet_plan){.n = 0};
}

static size_t padded(size_t count) {
    return (count + WAVELET_INPUTS - 1) / WAVELET_INPUTS * WAVELET_INPUTS;
}

/* Subtrees of the same shapes in the same order have the same matrix. */
typedef struct whole_table {
    const wavelets *basis;
    const uint32_t *begin; /* [n_nodes], the first node of a subtree */
    uint32_t *slots;       /* [n_slots] node + 1, 0: empty */
    size_t *matrix;        /* [n_nodes], the offset of the matrix of a subtree's first occurrence */
    size_t n_slots, used, room;
    float *matrices;
} whole_table;

static bool same_subtree(const whole_table *t, size_t a, size_t b) {
    const size_t count = a - t->begin[a];
    if (b - t->begin[b] != count) return false;
    for (size_t k = 0; k <= count; k++)
        if (t->basis->nodes[a - k].shape != t->basis->nodes[b - k].shape) return false;
    return true;
}

static uint64_t hash_subtree(const whole_table *t, size_t a) {
    uint64_t h = 1;
    for (size_t k = t->begin[a]; k <= a; k++) {
        h = (h ^ t->basis->nodes[k].shape) * 0x9E3779B97F4A7C15u;
        h ^= h >> 29;
    }
    return h;
}

/* out [scaling][padded(n_elements)] = the scaling functions of node t on its elements. They are the first
 * rows of its matrix, C^T, with C_mk = columns[m WAVELET_INPUTS + k] for input m and function k. A node
 * with from_left == 0 is a leaf, and its inputs are its elements:
 *     out = C^T.
 * The inputs of another node are the functions of its left child, the first from_left of them, and of its
 * right child, each of which is 0 on the elements of the other:
 *     out = C^T [below_left; below_right]. */
static void write_rows(const wavelets *w, size_t t, float *out) {
    const wavelet_node *a = &w->nodes[t];
    const float *columns = wavelet_columns(w, a);
    const size_t width = padded(a->n_elements);
    memset(out, 0, a->scaling * width * sizeof *out);
    if (a->from_left == 0) {
        for (size_t k = 0; k < a->scaling; k++)
            for (size_t m = 0; m < a->inputs; m++) out[k * width + m] = columns[m * WAVELET_INPUTS + k];
        return;
    }
    const size_t children[2] = {a->left, t - 1};
    for (int side = 0; side < 2; side++) {
        float below[WAVELET_SCALING * WHOLE_ELEMENTS];
        const wavelet_node *child = &w->nodes[children[side]];
        const size_t child_width = padded(child->n_elements), shift = child->begin - a->begin;
        write_rows(w, children[side], below);
        for (size_t k = 0; k < a->scaling; k++)
            for (size_t p = 0; p < child->n_elements; p++) {
                double sum = 0;
                for (size_t m = 0; m < child->scaling; m++)
                    sum += (double)columns[((side == 0 ? 0 : a->from_left) + m) * WAVELET_INPUTS + k] *
                           (double)below[m * child_width + p];
                out[k * width + shift + p] = (float)sum;
            }
    }
}

static lam_status find_matrix(whole_table *table, size_t t, size_t *out, lam_error *error) {
    size_t slot = hash_subtree(table, t) % table->n_slots;
    for (; table->slots[slot] != 0; slot = (slot + 1) % table->n_slots) {
        const size_t other = table->slots[slot] - 1;
        *out = table->matrix[other];
        if (same_subtree(table, t, other)) return LAM_OK;
    }
    const wavelet_node *a = &table->basis->nodes[t];
    const size_t size = a->scaling * padded(a->n_elements);
    if (array_grow(&table->matrices, &table->room, table->used + size, sizeof *table->matrices, "wavelets",
                   error) != LAM_OK)
        return LAM_ERR_MEMORY;
    write_rows(table->basis, t, table->matrices + table->used);
    *out = table->matrix[t] = table->used;
    table->slots[slot] = (uint32_t)t + 1;
    table->used += size;
    return LAM_OK;
}

static size_t own_of(const wavelet_node *a) {
    return a->inputs - a->scaling;
}

/* For each node: the used coefficients of its subtree and its own, and the first node of the subtree. */
static void count_used(const wavelets *w, const bool *used, uint32_t *below, uint32_t *own, uint32_t *begin) {
    for (size_t t = 0; t < w->n_nodes; t++) {
        const wavelet_node *a = &w->nodes[t];
        own[t] = 0;
        for (size_t k = 0; k < own_of(a); k++) own[t] += used[a->first + k];
        below[t] = own[t];
        begin[t] = (uint32_t)t;
        if (a->from_left == 0) continue;
        below[t] += below[a->left] + below[t - 1];
        begin[t] = begin[a->left];
    }
}

/* The root is never part of a matrix, because its scaling coefficients are used. */
static bool is_whole(const wavelets *w, const uint32_t *below, size_t t) {
    return below[t] == 0 && w->nodes[t].n_elements <= WHOLE_ELEMENTS && t + 1 < w->n_nodes;
}

static lam_status add_steps(wavelet_plan *plan, whole_table *table, const uint32_t *below,
                            const uint32_t *own, uint32_t *step_of, lam_error *error) {
    lam_status status = LAM_OK;
    const wavelets *w = table->basis;
    for (size_t t = 0; t < w->n_nodes; t++) {
        const wavelet_node *a = &w->nodes[t];
        const bool whole = is_whole(w, below, t);
        if (whole && is_whole(w, below, a->parent)) continue;
        plan_step *step = &plan->steps[plan->n_steps];
        *step = (plan_step){
            .begin = a->begin, .count = a->n_elements, .scaling = (uint8_t)a->scaling, .whole = whole};
        step_of[t] = (uint32_t)plan->n_steps++;
        if (whole) {
            size_t matrix = 0;
            TRY(find_matrix(table, t, &matrix, error));
            step->left = (uint32_t)matrix; /* an offset until all matrices are made */
            continue;
        }
        step->columns = wavelet_columns(w, a);
        step->rows = step->columns + WAVELET_INPUTS * WAVELET_INPUTS;
        step->inputs = (uint8_t)a->inputs;
        step->from_left = (uint8_t)a->from_left;
        step->left = a->from_left > 0 ? step_of[a->left] : 0;
        step->first = (uint32_t)plan->n_used;
        step->own = own[t] > 0 ? (uint8_t)own_of(a) : 0;
        for (size_t k = 0; k < step->own; k++) plan->coefficient[plan->n_used++] = a->first + (uint32_t)k;
    }
    const size_t scaling = w->nodes[w->n_nodes - 1].scaling;
    for (size_t k = w->n - scaling; k < w->n; k++) plan->coefficient[plan->n_used++] = (uint32_t)k;
done:
    return status;
}

/* Sets the parents and lists the leaves. */
static lam_status link_steps(wavelet_plan *plan, lam_error *error) {
    plan->leaves = memory_allocate(plan->n_steps, sizeof *plan->leaves, "wavelets", error);
    if (plan->leaves == NULL) return LAM_ERR_MEMORY;
    for (size_t t = 0; t < plan->n_steps; t++) {
        plan_step *a = &plan->steps[t];
        a->parent = WAVELET_NONE;
        if (a->from_left > 0)
            plan->steps[a->left].parent = plan->steps[t - 1].parent = (uint32_t)t;
        else
            plan->leaves[plan->n_leaves++] = (uint32_t)t;
    }
    return LAM_OK;
}

/* Finds the largest subtrees of at most PIECE_ELEMENTS elements and the steps above them. */
static lam_status cut_pieces(wavelet_plan *plan, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t *begin = memory_allocate(plan->n_steps, sizeof *begin, "wavelets", error);
    plan->pieces = memory_allocate(plan->n_steps, sizeof *plan->pieces, "wavelets", error);
    plan->above = memory_allocate(plan->n_steps, sizeof *plan->above, "wavelets", error);
    if (begin == NULL || plan->pieces == NULL || plan->above == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t t = 0; t < plan->n_steps; t++) {
        const plan_step *a = &plan->steps[t];
        begin[t] = a->from_left > 0 ? begin[a->left] : (uint32_t)t;
        if (a->count > PIECE_ELEMENTS) {
            plan->above[plan->n_above++] = (uint32_t)t;
            continue;
        }
        while (plan->n_pieces > 0 && plan->pieces[plan->n_pieces - 1].first >= begin[t]) plan->n_pieces--;
        plan->pieces[plan->n_pieces++] = (wavelet_piece){begin[t], (uint32_t)t + 1};
    }
    for (size_t k = 0; k < plan->n_pieces; k++) {
        const size_t steps = plan->pieces[k].last - plan->pieces[k].first,
                     count = plan->steps[plan->pieces[k].last - 1].count;
        if (steps > plan->most_steps) plan->most_steps = steps;
        if (count > plan->most_positions) plan->most_positions = count;
    }
done:
    free(begin);
    return status;
}

lam_status wavelet_plan_create(const wavelets *basis, const bool *used, wavelet_plan *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t N = basis->n_nodes;
    wavelet_plan plan = {.n = basis->n};
    uint32_t *below = memory_allocate(N, sizeof *below, "wavelets", error);
    uint32_t *own = memory_allocate(N, sizeof *own, "wavelets", error);
    uint32_t *begin = memory_allocate(N, sizeof *begin, "wavelets", error);
    uint32_t *step_of = memory_allocate(N, sizeof *step_of, "wavelets", error);
    whole_table table = {.basis = basis, .begin = begin, .n_slots = 2 * N + 1};
    table.slots = memory_allocate(table.n_slots, sizeof *table.slots, "wavelets", error);
    table.matrix = memory_allocate(N, sizeof *table.matrix, "wavelets", error);
    plan.steps = memory_allocate(N, sizeof *plan.steps, "wavelets", error);
    plan.coefficient = memory_allocate(basis->n, sizeof *plan.coefficient, "wavelets", error);
    if (below == NULL || own == NULL || begin == NULL || step_of == NULL || table.slots == NULL ||
        table.matrix == NULL || plan.steps == NULL || plan.coefficient == NULL)
        TRY(LAM_ERR_MEMORY);
    count_used(basis, used, below, own, begin);
    TRY(add_steps(&plan, &table, below, own, step_of, error));
    plan.matrices = table.matrices;
    plan.n_numbers = table.used;
    table.matrices = NULL;
    for (size_t t = 0; t < plan.n_steps; t++) {
        if (!plan.steps[t].whole) continue;
        plan.steps[t].rows = plan.matrices + plan.steps[t].left;
        plan.steps[t].left = 0;
    }
    TRY(link_steps(&plan, error));
    TRY(cut_pieces(&plan, error));
    *out = plan;
    plan = (wavelet_plan){.n = 0};
done:
    free(below);
    free(own);
    free(begin);
    free(step_of);
    free(table.slots);
    free(table.matrix);
    free(table.matrices);
    wavelet_plan_free(&plan);
    return status;
}

size_t wavelet_plan_bytes(const wavelet_plan *plan) {
    return plan->n_steps * sizeof *plan->steps + plan->n_numbers * sizeof *plan->matrices;
}

#define KERNEL(name) name##_portable
#define TARGET
#include "solver/operator/wavelet/wavelet_kernels.inc"

#ifdef CPU_AVX2_TARGET
#define KERNEL(name) name##_avx2
#define TARGET CPU_AVX2_TARGET
#include "solver/operator/wavelet/wavelet_kernels.inc"
#endif

typedef void forward_steps(const wavelet_plan *plan, size_t first, size_t last, const uint32_t *which,
                           const float *X, const float *scale, float *C, float *s);
typedef void inverse_steps(const wavelet_plan *plan, size_t first, size_t last, const uint32_t *which,
                           const float *C, float *X, float *s);

static forward_steps *const forward[] = CPU_TABLE(forward_portable, forward_avx2, forward_avx2);
static inverse_steps *const inverse[] = CPU_TABLE(inverse_portable, inverse_avx2, inverse_avx2);

bool wavelet_is_dark(const float *x, size_t count) {
    for (size_t first = 0; first < count; first += LOOKED_AT) {
        const size_t last = first + LOOKED_AT < count ? first + LOOKED_AT : count;
        int lit = 0;
        for (size_t p = first; p < last; p++) lit |= x[p] != 0;
        if (lit) return false;
    }
    return true;
}

/* True when all of a piece is 0. */
static bool is_dark(const wavelet_plan *plan, const wavelet_piece *piece, const float *x) {
    const plan_step *top = &plan->steps[piece->last - 1];
    return wavelet_is_dark(x + top->begin, top->count);
}

/* Writes the transform of a piece that is 0. */
static void leave_dark(const wavelet_plan *plan, const wavelet_piece *piece, float *c, float *s) {
    for (size_t t = piece->first; t < piece->last; t++)
        memset(c + plan->steps[t].first, 0, plan->steps[t].own * sizeof *c);
    memset(s + (piece->last - 1) * WAVELET_SCALING, 0, WAVELET_SCALING * sizeof *s);
}

/* One of the two transforms: elements X [n], coefficients C [n_used]. */
typedef struct transform_job {
    const wavelet_plan *plan;
    wavelet_visit *visit; /* before a piece forward, after it inverse; or NULL */
    void *context;
    const float *from, *scale;
    float *to, *work;
} transform_job;

static void forward_pieces(const void *job, size_t thread, size_t first, size_t last) {
    const transform_job *t = job;
    const wavelet_plan *plan = t->plan;
    forward_steps *const run = forward[cpu_best()];
    (void)thread;
    for (size_t k = first; k < last; k++) {
        const wavelet_piece *piece = &plan->pieces[k];
        if (t->visit != NULL)
            t->visit(t->context, k, wavelet_piece_begin(plan, piece), wavelet_piece_end(plan, piece));
        if (is_dark(plan, piece, t->from))
            leave_dark(plan, piece, t->to, t->work);
        else
            run(plan, piece->first, piece->last, NULL, t->from, t->scale, t->to, t->work);
    }
}

static void inverse_pieces(const void *job, size_t thread, size_t first, size_t last) {
    const transform_job *t = job;
    const wavelet_plan *plan = t->plan;
    inverse_steps *const run = inverse[cpu_best()];
    (void)thread;
    for (size_t k = first; k < last; k++) {
        const wavelet_piece *piece = &plan->pieces[k];
        run(plan, piece->first, piece->last, NULL, t->from, t->to, t->work);
        if (t->visit != NULL)
            t->visit(t->context, k, wavelet_piece_begin(plan, piece), wavelet_piece_end(plan, piece));
    }
}

/* The scaling coefficients of the root are coefficients. */
static void write_root(const wavelet_plan *plan, const float *scale, float *C, const float *work) {
    const plan_step *root = &plan->steps[plan->n_steps - 1];
    const float *s = work + (plan->n_steps - 1) * WAVELET_SCALING;
    for (size_t k = 0, i = plan->n_used - root->scaling; k < root->scaling; k++, i++)
        C[i] = scale != NULL ? s[k] * scale[i] : s[k];
}

void wavelet_plan_forward(const wavelet_plan *plan, wavelet_visit *fill, void *context, const float *X,
                          const float *scale, float *C, float *work, size_t n_threads) {
    const transform_job job = {plan, fill, context, X, scale, C, work};
    parallel_share(n_threads, plan->n_pieces, 1, forward_pieces, &job);
    forward[cpu_best()](plan, 0, plan->n_above, plan->above, X, scale, C, work);
    write_root(plan, scale, C, work);
}

void wavelet_plan_inverse(const wavelet_plan *plan, const float *C, float *X, wavelet_visit *use,
                          void *context, float *work, size_t n_threads) {
    const plan_step *root = &plan->steps[plan->n_steps - 1];
    const transform_job job = {plan, use, context, C, NULL, X, work};
    float *s = work + (plan->n_steps - 1) * WAVELET_SCALING;
    for (size_t k = 0; k < root->scaling; k++) s[k] = C[plan->n_used - root->scaling + k];
    inverse[cpu_best()](plan, 0, plan->n_above, plan->above, C, X, work);
    parallel_share(n_threads, plan->n_pieces, 1, inverse_pieces, &job);
}

void wavelet_plan_forward_some(const wavelet_plan *plan, size_t n_steps, const uint32_t *steps,
                               const float *X, const float *scale, float *C, float *work) {
    memset(C, 0, plan->n_used * sizeof *C);
    if (n_steps == 0) return;
    /* A child that is not among the steps is dark; one that is gets its numbers before its parent. */
    for (size_t k = 0; k < n_steps; k++) {
        const plan_step *a = &plan->steps[steps[k]];
        if (a->from_left == 0) continue;
        memset(work + (size_t)a->left * WAVELET_SCALING, 0, WAVELET_SCALING * sizeof *work);
        memset(work + (size_t)(steps[k] - 1) * WAVELET_SCALING, 0, WAVELET_SCALING * sizeof *work);
    }
    forward[cpu_best()](plan, 0, n_steps, steps, X, scale, C, work);
    write_root(plan, scale, C, work);
}

void wavelet_plan_inverse_some(const wavelet_plan *plan, size_t n_steps, const uint32_t *steps,
                               const float *C, float *X, float *work) {
    const plan_step *root = &plan->steps[plan->n_steps - 1];
    float *s = work + (plan->n_steps - 1) * WAVELET_SCALING;
    for (size_t k = 0; k < root->scaling; k++) s[k] = C[plan->n_used - root->scaling + k];
    inverse[cpu_best()](plan, 0, n_steps, steps, C, X, work);
}
