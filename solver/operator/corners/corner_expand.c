/* The matrix of a plan as a whole, v = S (2 x - N S x): the rows of its factors, multiplied. */
#include "solver/base/array_grow.h"
#include "solver/operator/corners/corner_plan.h"

#include <math.h>
#include <stdlib.h>

/* Smaller weights change nothing that a picture shows. */
static const double weight_least = 1e-6;

/* A row while it is made: sums by element, and which of them were touched. */
typedef struct sums {
    double *of; /* [n] */
    bool *has;  /* [n] */
    uint32_t *touched;
    size_t n_touched;
} sums;

typedef struct expansion {
    const corner_plan *plan;
    uint32_t *link; /* [n_nodes]: 1 + the number of its link, or 0 */
    sums inner, whole;
    uint32_t *columns; /* [n] */
    double *weights;   /* [n] */
} expansion;

static lam_status sums_create(sums *s, size_t n, lam_error *error) {
    s->of = memory_allocate(n, sizeof *s->of, "corners", error);
    s->has = memory_allocate(n, sizeof *s->has, "corners", error);
    s->touched = memory_allocate(n, sizeof *s->touched, "corners", error);
    return s->of == NULL || s->has == NULL || s->touched == NULL ? LAM_ERR_MEMORY : LAM_OK;
}

static void sums_free(sums *s) {
    free(s->of);
    free(s->has);
    free(s->touched);
}

static void sums_add(sums *s, uint32_t i, double weight) {
    if (!s->has[i]) {
        s->has[i] = true;
        s->of[i] = 0;
        s->touched[s->n_touched++] = i;
    }
    s->of[i] += weight;
}

static void sums_clear(sums *s) {
    for (size_t k = 0; k < s->n_touched; k++) s->has[s->touched[k]] = false;
    s->n_touched = 0;
}

/* Adds factor times the row of S of a node: of one inside an edge those of the ends, CORNER_DEPTH deep. */
static void add_node(const expansion *e, uint32_t node, double factor, sums *to) {
    const corner_rows *rows = &e->plan->rows;
    if (e->link[node] > 0) {
        const corner_link *link = &e->plan->links[e->link[node] - 1];
        add_node(e, link->a, factor * (1 - (double)link->t), to);
        add_node(e, link->b, factor * (double)link->t, to);
        return;
    }
    for (uint32_t k = rows->first[node]; k < rows->first[node + 1]; k++)
        sums_add(to, rows->columns[k], factor * (double)rows->weights[k]);
}

static int compare_numbers(const void *left, const void *right) {
    const uint32_t a = *(const uint32_t *)left, b = *(const uint32_t *)right;
    return (a > b) - (a < b);
}

/* Adds factor times the row of a free node. */
static lam_status add_row(expansion *e, uint32_t node, double factor, corner_rows *out, lam_error *error) {
    const corner_rows *means = &e->plan->means;
    size_t count = 0;
    sums_clear(&e->inner);
    sums_clear(&e->whole);
    add_node(e, node, factor, &e->inner);
    for (size_t k = 0; k < e->inner.n_touched; k++) {
        const uint32_t i = e->inner.touched[k];
        const double weight = e->inner.of[i];
        sums_add(&e->whole, i, 2 * weight);
        for (uint32_t c = means->first[i]; c < means->first[i + 1]; c++)
            add_node(e, means->columns[c], -weight * (double)means->weights[c], &e->whole);
    }
    qsort(e->whole.touched, e->whole.n_touched, sizeof *e->whole.touched, compare_numbers);
    for (size_t k = 0; k < e->whole.n_touched; k++) {
        const uint32_t i = e->whole.touched[k];
        if (fabs(e->whole.of[i]) < weight_least) continue;
        e->columns[count] = i;
        e->weights[count++] = e->whole.of[i];
    }
    return corner_rows_add(out, count, e->columns, e->weights, error);
}

/* The parts of a node: of one inside an edge those of the ends, each of which has a bound of its own. */
static lam_status add_parts(expansion *e, uint32_t node, double factor, size_t most, corner_rows *out,
                            lam_error *error) {
    lam_status status = LAM_OK;
    if (e->link[node] > 0) {
        const corner_link *link = &e->plan->links[e->link[node] - 1];
        TRY(add_parts(e, link->a, factor * (1 - (double)link->t), most, out, error));
        TRY(add_parts(e, link->b, factor * (double)link->t, most, out, error));
        return status;
    }
    TRY(add_row(e, node, factor, out, error));
    if (out->first[out->n_rows] > most)
        FAIL(error, LAM_ERR_ARGUMENT, "corners have more than %zu weights", most);
done:
    return status;
}

static size_t parts_of(const expansion *e, uint32_t node) {
    if (e->link[node] == 0) return 1;
    const corner_link *link = &e->plan->links[e->link[node] - 1];
    return parts_of(e, link->a) + parts_of(e, link->b);
}

lam_status corner_plan_expand(const corner_plan *plan, size_t most, corner_matrix *out, lam_error *error) {
    lam_status status = LAM_OK;
    expansion e = {.plan = plan};
    corner_matrix made = {.n_nodes = plan->n_nodes};
    e.link = memory_allocate(plan->n_nodes, sizeof *e.link, "corners", error);
    e.columns = memory_allocate(plan->n, sizeof *e.columns, "corners", error);
    e.weights = memory_allocate(plan->n, sizeof *e.weights, "corners", error);
    if (e.link == NULL || e.columns == NULL || e.weights == NULL) TRY(LAM_ERR_MEMORY);
    TRY(sums_create(&e.inner, plan->n, error));
    TRY(sums_create(&e.whole, plan->n, error));
    for (size_t k = 0; k < plan->n_links; k++) e.link[plan->links[k].node] = (uint32_t)k + 1;
    made.parts = memory_allocate(plan->n_nodes + 1, sizeof *made.parts, "corners", error);
    if (made.parts == NULL) TRY(LAM_ERR_MEMORY);
    for (uint32_t j = 0; j < plan->n_nodes; j++) {
        const size_t end = made.parts[j] + parts_of(&e, j);
        if (end > most / CORNER_WEIGHTS_OF_PART)
            FAIL(error, LAM_ERR_ARGUMENT, "corners have more than %zu parts", most / CORNER_WEIGHTS_OF_PART);
        made.parts[j + 1] = (uint32_t)end;
    }
    TRY(corner_rows_begin(&made.rows, made.parts[plan->n_nodes], error));
    for (uint32_t j = 0; j < plan->n_nodes; j++) TRY(add_parts(&e, j, 1, most, &made.rows, error));
    TRY(corner_rows_end(&made.rows, error));
    *out = made;
    made = (corner_matrix){.n_nodes = 0};
done:
    corner_matrix_free(&made);
    sums_free(&e.inner);
    sums_free(&e.whole);
    free(e.link);
    free(e.columns);
    free(e.weights);
    return status;
}

void corner_matrix_free(corner_matrix *matrix) {
    corner_rows_free(&matrix->rows);
    free(matrix->parts);
    *matrix = (corner_matrix){.n_nodes = 0};
}
