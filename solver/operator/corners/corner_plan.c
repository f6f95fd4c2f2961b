#include "solver/operator/corners/corner_plan.h"

#include "solver/base/array_grow.h"

#include <stdlib.h>
#include <string.h>

/* The order of hanging nodes: each waits for the ends of its edge. */
typedef struct link_order {
    const corner_nodes *nodes;
    bool *tied;         /* [n_nodes] */
    uint8_t *depth;     /* [n_nodes]: 0 of a free one */
    uint8_t *waits;     /* [n_nodes]: for how many ends */
    uint32_t *from;     /* [n_nodes + 2] */
    uint32_t *waiting;  /* [2 ties]: nodes that wait for node j */
    uint32_t *queue;    /* [n_nodes]: whose place is settled */
    size_t n_queue, at; /* and how many of them were looked at */
    corner_plan *plan;
} link_order;

static void order_free(link_order *o) {
    free(o->depth);
    free(o->waits);
    free(o->from);
    free(o->waiting);
    free(o->queue);
}

static lam_status order_begin(link_order *o, lam_error *error) {
    const size_t n_nodes = o->nodes->n_nodes;
    size_t count = 0;
    for (size_t j = 0; j < n_nodes; j++) count += o->tied[j] = o->nodes->ties[j].length > 0;
    o->depth = memory_allocate(n_nodes, sizeof *o->depth, "corners", error);
    o->waits = memory_allocate(n_nodes, sizeof *o->waits, "corners", error);
    o->from = memory_allocate(n_nodes + 2, sizeof *o->from, "corners", error);
    o->waiting = memory_allocate(count, 2 * sizeof *o->waiting, "corners", error);
    o->queue = memory_allocate(n_nodes, sizeof *o->queue, "corners", error);
    o->plan->links = memory_allocate(count, sizeof *o->plan->links, "corners", error);
    if (o->depth == NULL || o->waits == NULL || o->from == NULL || o->waiting == NULL || o->queue == NULL ||
        o->plan->links == NULL)
        return LAM_ERR_MEMORY;
    uint32_t *const from = o->from + 1;
    for (size_t j = 0; j < n_nodes; j++) {
        const corner_tie *tie = &o->nodes->ties[j];
        if (!o->tied[j]) continue;
        from[tie->a + 1]++;
        from[tie->b + 1]++;
    }
    for (size_t j = 0; j < n_nodes; j++) from[j + 1] += from[j];
    for (uint32_t j = 0; j < n_nodes; j++) {
        const corner_tie *tie = &o->nodes->ties[j];
        if (!o->tied[j]) continue;
        o->waiting[from[tie->a]++] = j;
        o->waiting[from[tie->b]++] = j;
    }
    return LAM_OK;
}

/* Settles a node of which all ends are settled, or which is free. */
static void settle(link_order *o, uint32_t j) {
    const corner_tie *tie = &o->nodes->ties[j];
    if (o->tied[j]) {
        const int deeper = o->depth[tie->a] > o->depth[tie->b] ? o->depth[tie->a] : o->depth[tie->b];
        o->tied[j] = deeper < CORNER_DEPTH;
        if (o->tied[j]) {
            o->depth[j] = (uint8_t)(deeper + 1);
            o->plan->links[o->plan->n_links++] = (corner_link){j, tie->a, tie->b, (float)tie->t};
        }
    }
    o->waits[j] = 0;
    o->queue[o->n_queue++] = j;
}

/* Settles all that waited for settled nodes alone. */
static void settle_waiting(link_order *o) {
    for (; o->at < o->n_queue; o->at++) {
        const uint32_t j = o->queue[o->at];
        for (uint32_t q = o->from[j]; q < o->from[j + 1]; q++) {
            const uint32_t other = o->waiting[q];
            if (o->waits[other] > 0 && --o->waits[other] == 0) settle(o, other);
        }
    }
}

/* The end that a waiting node waits for. */
static uint32_t awaited(const link_order *o, uint32_t j) {
    const corner_tie *tie = &o->nodes->ties[j];
    return o->waits[tie->a] > 0 ? tie->a : tie->b;
}

/* A node that still waits leads into a cycle; returns the node of the shortest edge in it. */
static uint32_t shortest_of_cycle(const link_order *o, uint32_t j) {
    const corner_tie *ties = o->nodes->ties;
    uint32_t slow = j, fast = j, found;
    do {
        slow = awaited(o, slow);
        fast = awaited(o, awaited(o, fast));
    } while (slow != fast);
    found = slow;
    for (uint32_t k = awaited(o, slow); k != slow; k = awaited(o, k))
        if (ties[k].length < ties[found].length || (ties[k].length == ties[found].length && k < found))
            found = k;
    return found;
}

static void order_links(link_order *o) {
    const size_t n_nodes = o->nodes->n_nodes;
    for (uint32_t j = 0; j < n_nodes; j++) o->waits[j] = o->tied[j] ? 2 : 0;
    for (uint32_t j = 0; j < n_nodes; j++)
        if (!o->tied[j]) settle(o, j);
    settle_waiting(o);
    for (uint32_t j = 0; j < n_nodes; j++)
        while (o->waits[j] > 0) {
            const uint32_t freed = shortest_of_cycle(o, j);
            o->tied[freed] = false;
            settle(o, freed);
            settle_waiting(o);
        }
}

lam_status corner_plan_create(const corner_mesh *m, const corner_nodes *nodes, corner_plan *out,
                              lam_error *error) {
    lam_status status = LAM_OK;
    corner_plan plan = {.n = m->n, .n_nodes = nodes->n_nodes};
    link_order o = {.nodes = nodes, .plan = &plan};
    o.tied = memory_allocate(nodes->n_nodes, sizeof *o.tied, "corners", error);
    if (o.tied == NULL) TRY(LAM_ERR_MEMORY);
    TRY(order_begin(&o, error));
    order_links(&o);
    TRY(corner_weights_find(m, nodes, o.tied, &plan.rows, error));
    TRY(corner_means_find(m, nodes, &plan.means, error));
    TRY(array_resize(&plan.links, plan.n_links, sizeof *plan.links, "corners", error));
    *out = plan;
    plan = (corner_plan){.n = 0};
done:
    corner_plan_free(&plan);
    order_free(&o);
    free(o.tied);
    return status;
}

void corner_plan_free(corner_plan *plan) {
    corner_rows_free(&plan->rows);
    corner_rows_free(&plan->means);
    free(plan->links);
    *plan = (corner_plan){.n = 0};
}

size_t corner_plan_bytes(const corner_plan *plan) {
    return sizeof *plan + corner_rows_bytes(&plan->rows) + corner_rows_bytes(&plan->means) +
           plan->n_links * sizeof *plan->links;
}

/* Puts nodes inside edges on the line between the ends. */
static void link_ends(const corner_plan *plan, float *out) {
    for (size_t k = 0; k < plan->n_links; k++) {
        const corner_link *link = &plan->links[k];
        out[link->node] = (1 - link->t) * out[link->a] + link->t * out[link->b];
    }
}

/* 0, or the least number of a row. */
static float least_of(size_t n, const float *x) {
    float least = 0;
    for (size_t i = 0; i < n; i++) least = x[i] < least ? x[i] : least;
    return least;
}

/* Some rows at once. */
static void apply_some(const corner_plan *plan, size_t count, float *x, float *out) {
    const size_t n = plan->n, n_nodes = plan->n_nodes;
    float least[CORNER_ROWS_TOGETHER];
    for (size_t r = 0; r < count; r++) least[r] = least_of(n, x + r * n);
    corner_rows_apply(&plan->rows, count, n, x, out);
    for (size_t r = 0; r < count; r++) link_ends(plan, out + r * n_nodes);
    corner_rows_reflect(&plan->means, count, n_nodes, out, x);
    corner_rows_apply(&plan->rows, count, n, x, out);
    for (size_t r = 0; r < count; r++) {
        for (size_t j = r * n_nodes; j < (r + 1) * n_nodes; j++)
            out[j] = out[j] > least[r] ? out[j] : least[r];
        link_ends(plan, out + r * n_nodes);
    }
}

void corner_plan_apply(const corner_plan *plan, size_t n_rows, float *x, float *out) {
    for (size_t r = 0; r < n_rows; r += CORNER_ROWS_TOGETHER)
        apply_some(plan, n_rows - r < CORNER_ROWS_TOGETHER ? n_rows - r : CORNER_ROWS_TOGETHER,
                   x + r * plan->n, out + r * plan->n_nodes);
}

/* x += factor S^T g, in which the ends of edges take over the part of nodes inside. */
static void scatter(const corner_plan *plan, float factor, float *g, float *x) {
    for (size_t k = plan->n_links; k-- > 0;) {
        const corner_link *link = &plan->links[k];
        g[link->a] += (1 - link->t) * g[link->node];
        g[link->b] += link->t * g[link->node];
    }
    corner_rows_transpose(&plan->rows, factor, g, x);
}

/* w += 2 y - S^T N^T y with y = S^T g. */
static void transpose_row(const corner_plan *plan, float *g, float *w, float *work) {
    float *at_elements = work, *at_nodes = work + plan->n;
    memset(work, 0, (plan->n + plan->n_nodes) * sizeof *work);
    scatter(plan, 1, g, at_elements);
    for (size_t i = 0; i < plan->n; i++) w[i] += 2 * at_elements[i];
    corner_rows_transpose(&plan->means, 1, at_elements, at_nodes);
    scatter(plan, -1, at_nodes, w);
}

void corner_plan_transpose(const corner_plan *plan, size_t n_rows, float *g, float *w, float *work) {
    for (size_t r = 0; r < n_rows; r++) transpose_row(plan, g + r * plan->n_nodes, w + r * plan->n, work);
}
