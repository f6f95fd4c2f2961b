#include "solver/operator/limiter.h"

#include "solver/base/parallel.h"
#include "solver/base/work_area.h"
#include "solver/operator/emitters.h"
#include "store/groups.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

lam_limiter limiter_of(size_t n, size_t n_groups, const uint32_t *start, const uint32_t *elements,
                       const double *area) {
    lam_limiter l = {.n = n, .n_groups = n_groups, .start = start, .elements = elements, .area = area};
    for (size_t g = 0; g < n_groups; g++)
        if (start[g + 1] - start[g] > l.most) l.most = start[g + 1] - start[g];
    return l;
}

/* A block of a group: S = sum A x; then the share of it that the block is to have. */
typedef struct block {
    double sum, factor;
    double node; /* the sum of the node that is cut before this block */
    uint32_t negative;
} block;

static size_t blocks_of(size_t n_elements) {
    return (n_elements + LIMITER_BLOCK - 1) / LIMITER_BLOCK;
}

size_t lam_limiter_work_bytes(const lam_limiter *l) {
    size_t total = WORK_AREA_ALIGN;
    if (!work_area_add(&total, blocks_of(l->most) * sizeof(block)) ||
        !work_area_add(&total, l->n * sizeof(uint32_t)) || !work_area_add(&total, l->n_groups))
        return 0;
    return total;
}

/* True where the light of a row is negative somewhere. */
typedef enum signs { UNKNOWN_YET, NOWHERE, SOMEWHERE } signs;

/* One row: of a vector and a channel. */
typedef struct row {
    const lam_limiter *l;
    lam_quantity quantity;
    const float *rho, *E, *H0; /* [n]; E and H0 NULL: 0 */
    const float *W;            /* [s], of emitters; NULL: none */
    size_t s;
    const uint32_t *where; /* [n], element -> place in out, of those that are there; NULL: mesh order */
    float *out;
    signs signs;
} row;

/* The part of the answer that is not reflected. */
static inline float direct_at(const row *r, size_t i) {
    if (r->quantity == LAM_RADIOSITY && r->E != NULL) return operator_light(r->rho, r->E, r->H0, i);
    return r->quantity == LAM_IRRADIANCE && r->H0 != NULL ? r->H0[i] : 0.0f;
}

static inline size_t place_of(const row *r, size_t i) {
    return r->where != NULL ? r->where[i] : i;
}

/* LIMITER_BLOCK elements of a row, padded with zeros: what stands side by side in the mesh, as most does, is
 * read where it is, by loops that become vectors. */
typedef struct portion {
    const double *A;
    const float *out, *direct;
    double own_A[LIMITER_BLOCK];
    float own_out[LIMITER_BLOCK], own_direct[LIMITER_BLOCK];
} portion;

static void read_portion(const row *r, const uint32_t *elements, size_t count, portion *p) {
    const size_t first = elements[0];
    const bool together = count == LIMITER_BLOCK && elements[count - 1] - first == count - 1;
    p->A = together ? r->l->area + first : p->own_A;
    p->out = together && r->where == NULL ? r->out + first : p->own_out;
    p->direct = p->own_direct;
    for (size_t e = 0; e < count && p->A == p->own_A; e++) p->own_A[e] = r->l->area[elements[e]];
    for (size_t e = 0; e < count && p->out == p->own_out; e++)
        p->own_out[e] = r->out[place_of(r, elements[e])];
    if (together && r->quantity == LAM_RADIOSITY && r->E != NULL && r->H0 == NULL)
        p->direct = r->E + first;
    else
        for (size_t e = 0; e < count; e++) p->own_direct[e] = direct_at(r, elements[e]);
    for (size_t e = count; e < LIMITER_BLOCK; e++) {
        p->own_A[e] = 0;
        p->own_out[e] = p->own_direct[e] = 0;
    }
}

/* True where a value of a whole row is below its direct light. Each case is a loop that becomes vectors. */
static bool any_below(const row *r, size_t first, size_t last) {
    const float *rho = r->rho, *E = r->E, *H0 = r->H0, *out = r->out;
    int found = 0;
    if (r->quantity == LAM_RADIOSITY && E != NULL && H0 == NULL)
        for (size_t i = first; i < last; i++) found |= out[i] < E[i];
    else if (r->quantity == LAM_RADIOSITY && E != NULL)
        for (size_t i = first; i < last; i++) found |= out[i] < E[i] + rho[i] * H0[i];
    else if (r->quantity == LAM_IRRADIANCE && H0 != NULL)
        for (size_t i = first; i < last; i++) found |= out[i] < H0[i];
    else
        for (size_t i = first; i < last; i++) found |= out[i] < 0.0f;
    return found != 0;
}

static bool any_negative(const float *x, size_t count) {
    int found = 0;
    for (size_t i = 0; x != NULL && i < count; i++) found |= x[i] < 0.0f;
    return found != 0;
}

/* Looks once, as this reads the light of all elements. */
static bool has_signs(row *r) {
    const size_t n = r->l->n;
    if (r->signs == UNKNOWN_YET)
        r->signs =
            any_negative(r->E, n) || any_negative(r->H0, n) || any_negative(r->W, r->s) ? SOMEWHERE : NOWHERE;
    return r->signs == SOMEWHERE;
}

/* A group under way. */
typedef struct group_work {
    const row *r;
    const uint32_t *elements;
    size_t count;
    block *blocks;
} group_work;

/* The elements of block k. */
static const uint32_t *block_elements(const group_work *w, size_t k, size_t *count) {
    const size_t first = k * LIMITER_BLOCK, left = w->count - first;
    *count = left < LIMITER_BLOCK ? left : LIMITER_BLOCK;
    return w->elements + first;
}

/* Sums stand in lanes, so that their order is that of the loop whatever the compiler makes of it. */
enum { LANES = 4 };

static void sum_portion(const portion *p, block *b) {
    double sum[LANES] = {0};
    int negative = 0;
    for (size_t e = 0; e < LIMITER_BLOCK; e += LANES)
        for (size_t lane = 0; lane < LANES; lane++) {
            const double x = (double)p->out[e + lane] - (double)p->direct[e + lane];
            sum[lane] += p->A[e + lane] * x;
        }
    for (size_t e = 0; e < LIMITER_BLOCK; e++) negative += p->out[e] < p->direct[e];
    b->sum = (sum[0] + sum[1]) + (sum[2] + sum[3]);
    b->negative = (uint32_t)negative;
}

static void sum_blocks(const void *job, size_t thread, size_t first, size_t last) {
    const group_work *w = job;
    (void)thread;
    for (size_t k = first; k < last; k++) {
        size_t count;
        const uint32_t *elements = block_elements(w, k, &count);
        portion p;
        read_portion(w->r, elements, count, &p);
        sum_portion(&p, &w->blocks[k]);
    }
}

static double node_sum(const block *blocks, size_t first, size_t last) {
    return last - first == 1 ? blocks[first].sum : blocks[first + (last - first) / 2].node;
}

/* Adds up the sums of the nodes of blocks first ... last - 1. */
static void add_up(block *blocks, size_t first, size_t last) {
    if (last - first <= 1) return;
    const size_t middle = first + (last - first) / 2;
    add_up(blocks, first, middle);
    add_up(blocks, middle, last);
    blocks[middle].node = node_sum(blocks, first, middle) + node_sum(blocks, middle, last);
}

/* Hands `factor` times the sum of a node on to its blocks. */
static void hand_down(block *blocks, size_t first, size_t last, double factor) {
    if (last - first == 1 || !(factor > 0)) {
        for (size_t k = first; k < last; k++) blocks[k].factor = factor;
        return;
    }
    const size_t middle = first + (last - first) / 2;
    const double left = node_sum(blocks, first, middle), right = node_sum(blocks, middle, last),
                 sum = blocks[middle].node; /* above 0, so that one of both is */
    const double of_left = right > 0 ? factor : factor * (sum / left),
                 of_right = left > 0 ? factor : factor * (sum / right);
    hand_down(blocks, first, middle, left > 0 ? of_left : 0);
    hand_down(blocks, middle, last, right > 0 ? of_right : 0);
}

/* The level l with sum A max(x - l, 0) = target, which is above 0 and at most that sum at 0. The sum is
 * convex and falls with l, so that Newton's steps from 0 never pass the level, and end once no further x
 * falls below. */
static double level_of(const double *A, const double *x, double target) {
    double level = 0;
    for (int step = 0; step <= LIMITER_BLOCK; step++) {
        double sum[LANES] = {0}, area[LANES] = {0};
        for (size_t e = 0; e < LIMITER_BLOCK; e += LANES)
            for (size_t lane = 0; lane < LANES; lane++) {
                const double over = x[e + lane] - level;
                sum[lane] += over > 0 ? A[e + lane] * over : 0;
                area[lane] += over > 0 ? A[e + lane] : 0;
            }
        const double excess = (sum[0] + sum[1]) + (sum[2] + sum[3]) - target,
                     falls = (area[0] + area[1]) + (area[2] + area[3]);
        if (!(excess > DBL_EPSILON * target) || !(falls > 0)) break;
        level += excess / falls;
    }
    return level;
}

static void lower_blocks(const void *job, size_t thread, size_t first, size_t last) {
    const group_work *w = job;
    const row *r = w->r;
    (void)thread;
    for (size_t k = first; k < last; k++) {
        const block *b = &w->blocks[k];
        if (b->negative == 0 && b->factor == 1) continue;
        size_t count;
        const uint32_t *elements = block_elements(w, k, &count);
        portion p;
        double x[LIMITER_BLOCK];
        float made[LIMITER_BLOCK];
        read_portion(r, elements, count, &p);
        for (size_t e = 0; e < LIMITER_BLOCK; e++) x[e] = (double)p.out[e] - (double)p.direct[e];
        const double target = b->sum > 0 ? b->factor * b->sum : 0;
        const double level = target > 0 ? level_of(p.A, x, target) : HUGE_VAL;
        for (size_t e = 0; e < LIMITER_BLOCK; e++)
            made[e] = (float)((double)p.direct[e] + (x[e] > level ? x[e] - level : 0));
        if (p.out != p.own_out)
            memcpy(r->out + elements[0], made, sizeof made);
        else
            for (size_t e = 0; e < count; e++) r->out[place_of(r, elements[e])] = made[e];
    }
}

/* Groups shorter than this are limited by one thread; blocks that a thread takes at a time. */
enum { THREADS_WORTH = 65536, AT_ONCE = 128 };

/* Limits one group; returns the elements that were below zero. */
static size_t limit_group(row *r, size_t n_threads, size_t g, block *blocks) {
    const lam_limiter *l = r->l;
    const group_work w = {r, l->elements + l->start[g], l->start[g + 1] - l->start[g], blocks};
    const size_t n_blocks = blocks_of(w.count), threads = w.count >= THREADS_WORTH ? n_threads : 1;
    size_t negative = 0;
    bool finite = true;
    parallel_share(threads, n_blocks, AT_ONCE, sum_blocks, &w);
    for (size_t k = 0; k < n_blocks; k++) {
        negative += blocks[k].negative;
        finite = finite && isfinite(blocks[k].sum);
    }
    if (negative == 0 || !finite || has_signs(r)) return 0;
    add_up(blocks, 0, n_blocks);
    hand_down(blocks, 0, n_blocks, node_sum(blocks, 0, n_blocks) > 0 ? 1 : 0);
    parallel_share(threads, n_blocks, AT_ONCE, lower_blocks, &w);
    return negative;
}

/* Limits a row of all elements, or of the groups that are touched. */
static size_t limit_row(row *r, size_t n_threads, const uint8_t *touched, block *blocks) {
    size_t negative = 0;
    for (size_t g = 0; g < r->l->n_groups; g++)
        if ((touched == NULL || touched[g]) && r->l->start[g] < r->l->start[g + 1])
            negative += limit_group(r, n_threads, g, blocks);
    return negative;
}

void limiter_limit(const lam_limiter *l, const lam_operator *op, size_t n_rhs, lam_quantity quantity,
                   const limiter_light *light, size_t n_selected, const uint32_t *selected, float *out,
                   size_t *limited, void *work) {
    const size_t n = op->n, C = op->n_channels, width = selected != NULL ? n_selected : n;
    const size_t s = light->W != NULL ? lam_operator_emitters(op) : 0;
    void *rest = work_area_begin(work);
    block *blocks = work_area_take(&rest, blocks_of(l->most) * sizeof *blocks);
    uint32_t *where = selected != NULL ? work_area_take(&rest, n * sizeof *where) : NULL;
    uint8_t *touched = selected != NULL ? work_area_take(&rest, l->n_groups) : NULL;
    if (selected != NULL) { /* a place of its groups' first elements says of each group whether it is there */
        for (size_t g = 0; g < l->n_groups; g++)
            if (l->start[g] < l->start[g + 1]) where[l->elements[l->start[g]]] = UINT32_MAX;
        for (size_t k = 0; k < n_selected; k++) where[selected[k]] = (uint32_t)k;
        for (size_t g = 0; g < l->n_groups; g++)
            touched[g] = l->start[g] < l->start[g + 1] && where[l->elements[l->start[g]]] != UINT32_MAX;
    }
    for (size_t v = 0; v < n_rhs; v++) {
        size_t negative = 0;
        for (size_t at = v * C; at < (v + 1) * C; at++) {
            row r = {.l = l,
                     .quantity = quantity,
                     .rho = op->reflectance + at % C * n,
                     .E = light->E != NULL ? light->E + at * n : NULL,
                     .H0 = light->H0 != NULL ? light->H0 + at * n : NULL,
                     .W = light->W != NULL ? light->W + at * s : NULL,
                     .s = s,
                     .where = where,
                     .out = out + at * width};
            if (selected == NULL && (!any_below(&r, 0, n) || has_signs(&r))) continue;
            negative += limit_row(&r, op->n_threads, touched, blocks);
        }
        if (limited != NULL) limited[v] = negative;
    }
}

lam_status limiter_whole_groups(const lam_limiter *l, size_t n_selected, const uint32_t *selected,
                                uint32_t **elements, size_t *count, lam_error *error) {
    lam_status status = LAM_OK;
    bool *asked = memory_allocate(l->n, sizeof *asked, "selected elements", error);
    uint32_t *made = NULL;
    size_t n_made = 0;
    if (asked == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n_selected; k++) asked[selected[k]] = true;
    for (int writes = 0; writes < 2; writes++) {
        if (writes) made = memory_allocate(n_made, sizeof *made, "selected elements", error);
        if (writes && made == NULL) TRY(LAM_ERR_MEMORY);
        n_made = 0;
        for (size_t g = 0; g < l->n_groups; g++) {
            const size_t first = l->start[g], size = l->start[g + 1] - first;
            bool touched = false;
            for (size_t e = 0; e < size && !touched; e++) touched = asked[l->elements[first + e]];
            if (!touched) continue;
            if (writes) memcpy(made + n_made, l->elements + first, size * sizeof *made);
            n_made += size;
        }
    }
    *elements = made;
    *count = n_made;
    made = NULL;
done:
    free(asked);
    free(made);
    return status;
}

lam_status lam_limiter_apply(const lam_limiter *l, const lam_operator *op, size_t n_rhs,
                             lam_quantity quantity, const float *E, const float *H0, const float *W,
                             float *out, size_t *limited, void *work, size_t work_bytes, lam_error *error) {
    lam_status status = LAM_OK;
    if (l == NULL || op == NULL || out == NULL || work == NULL)
        FAIL(error, LAM_ERR_ARGUMENT,
             "a limiter, an operator, its answer and a work area are needed, one is NULL");
    if (op->n != l->n)
        FAIL(error, LAM_ERR_ARGUMENT, "an operator of %zu elements and a limiter of %zu are not of one store",
             op->n, l->n);
    if (quantity != LAM_RADIOSITY && quantity != LAM_IRRADIANCE && quantity != LAM_INDIRECT)
        FAIL(error, LAM_ERR_ARGUMENT, "there is no quantity %d", (int)quantity);
    if (op->kind->apply == NULL ? W == NULL || E != NULL || H0 != NULL : W != NULL || E == NULL)
        FAIL(error, LAM_ERR_ARGUMENT,
             op->kind->apply == NULL ? "the weights of emitters alone are the light of an operator of kind %s"
                                     : "an emission is the light of an operator of kind %s",
             op->kind->name);
    const size_t needed = lam_limiter_work_bytes(l);
    if (needed == 0 || work_bytes < needed)
        FAIL(error, LAM_ERR_ARGUMENT, "work area of %zu bytes, %zu are needed", work_bytes, needed);
    limiter_limit(l, op, n_rhs, quantity, &(limiter_light){E, H0, W}, 0, NULL, out, limited, work);
done:
    return status;
}

/* Sorts elements by their groups, in mesh order within one: *start [n_groups + 1], *elements [n]. */
static lam_status sort_groups(const char *path, size_t n, const uint32_t *group, size_t n_groups,
                              uint32_t **start, uint32_t **elements, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t *begin = memory_allocate(n_groups + 1, sizeof *begin, "groups", error);
    uint32_t *list = memory_allocate(n, sizeof *list, "groups", error);
    if (begin == NULL || list == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) {
        if (group[i] >= n_groups)
            FAIL(error, LAM_ERR_FORMAT, "%s: " STORE_MESH "/group[%zu] = %u, must be below the %zu names",
                 path, i, (unsigned)group[i], n_groups);
        begin[group[i] + 1]++;
    }
    for (size_t g = 0; g < n_groups; g++) begin[g + 1] += begin[g];
    /* begin[g] serves as the place of the next element of g, which leaves it one group ahead. */
    for (size_t i = 0; i < n; i++) list[begin[group[i]]++] = (uint32_t)i;
    memmove(begin + 1, begin, n_groups * sizeof *begin);
    begin[0] = 0;
    *start = begin;
    *elements = list;
    begin = list = NULL;
done:
    free(begin);
    free(list);
    return status;
}

lam_status lam_limiter_open(const char *path, lam_limiter **out, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    lam_limiter *made = NULL;
    void *group = NULL, *area = NULL;
    char **names = NULL;
    uint32_t *start = NULL, *elements = NULL;
    size_t dims[STORE_MAX_RANK] = {SIZE_MAX}, n_groups = 0;
    if (path == NULL || out == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "a path and a place for the limiter are needed");
    TRY(store_open(path, &s, error));
    TRY(store_read(s, STORE_MESH "/group", STORE_U32, 1, dims, &group, error));
    TRY(store_read(s, STORE_MESH "/area", STORE_F64, 1, dims, &area, error));
    TRY(store_read_texts(s, STORE_MESH "/group_names", &n_groups, &names, error));
    const double *areas = area;
    for (size_t i = 0; i < dims[0]; i++)
        if (!(areas[i] >= 0 && isfinite(areas[i])))
            FAIL(error, LAM_ERR_FORMAT, "%s: " STORE_MESH "/area[%zu] = %g, must be at least 0", path, i,
                 areas[i]);
    TRY(sort_groups(path, dims[0], group, n_groups, &start, &elements, error));
    made = memory_allocate(1, sizeof *made, "the limiter", error);
    if (made == NULL) TRY(LAM_ERR_MEMORY);
    *made = limiter_of(dims[0], n_groups, start, elements, areas);
    made->owned[0] = start;
    made->owned[1] = elements;
    made->owned[2] = area;
    start = elements = NULL;
    area = NULL;
    *out = made;
done:
    free(group);
    free(area);
    free(names);
    free(start);
    free(elements);
    store_close(s);
    return status;
}

void lam_limiter_close(lam_limiter *limiter) {
    if (limiter == NULL) return;
    for (size_t k = 0; k < sizeof limiter->owned / sizeof *limiter->owned; k++) free(limiter->owned[k]);
    free(limiter);
}
