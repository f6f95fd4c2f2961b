/* Rows of means and of elements, which are linear in the light (lam_rows, lam_scene_jacobian). */
#include "solver/operator/scene/lam_scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Rows of a pass over the operator. */
enum { PASS = OPERATOR_PASS };

struct lam_rows {
    const lam_scene *scene;
    size_t n_rows;
    adjoint_row **row; /* [n_rows] */
};

void lam_rows_close(lam_rows *rows) {
    if (rows == NULL) return;
    for (size_t k = 0; rows->row != NULL && k < rows->n_rows; k++) adjoint_row_free(rows->row[k]);
    free(rows->row);
    free(rows);
}

/* Work of a pass: cotangents and results, and the operator's own. */
typedef struct pass_work {
    float *g;
    void *work;
    size_t work_bytes;
} pass_work;

static lam_status pass_allocate(const lam_scene *s, size_t count, pass_work *out, lam_error *error) {
    out->work_bytes = lam_operator_work_bytes(s->op, count);
    out->g = memory_allocate(1, adjoint_pass_bytes(&s->linear, count), "rows", error);
    out->work = memory_allocate(1, out->work_bytes, "rows", error);
    return out->g != NULL && out->work != NULL ? LAM_OK : LAM_ERR_MEMORY;
}

static void pass_free(pass_work *p) {
    free(p->g);
    free(p->work);
}

/* Finds the groups of a name. */
static lam_status find_name(const lam_scene *s, const char *name, adjoint_row **out, lam_quantity quantity,
                            lam_error *error) {
    const uint32_t *groups;
    const size_t count = lam_scene_find(s, name, &groups);
    if (count == 0) {
        char miss[GROUP_MISS];
        group_index_miss(&s->groups, name, strlen(name), miss);
        return status_fail(error, LAM_ERR_ARGUMENT, "the store has %s", miss);
    }
    *out = adjoint_row_create(&s->linear, groups, count, quantity);
    return *out != NULL ? LAM_OK : status_fail(error, LAM_ERR_MEMORY, "not enough memory for a row");
}

lam_status lam_rows_create(const lam_scene *scene, lam_quantity quantity, size_t n_names,
                           const char *const *names, lam_rows **rows, lam_error *error) {
    lam_status status = LAM_OK;
    pass_work p = {.g = NULL};
    const size_t vector = scene->n_channels * scene->n;
    lam_rows *made = memory_allocate(1, sizeof *made, "rows", error);
    if (made == NULL) TRY(LAM_ERR_MEMORY);
    made->scene = scene;
    made->n_rows = n_names;
    made->row = memory_allocate(n_names, sizeof *made->row, "rows", error);
    if (made->row == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n_names; k++) TRY(find_name(scene, names[k], &made->row[k], quantity, error));
    TRY(pass_allocate(scene, n_names < PASS ? n_names : PASS, &p, error));
    for (size_t first = 0; first < n_names; first += PASS) {
        const size_t left = n_names - first, count = left < PASS ? left : PASS;
        for (size_t k = 0; k < count; k++)
            adjoint_row_cotangent(&scene->linear, made->row[first + k], p.g + k * vector);
        TRY(adjoint_rows_fill(&scene->linear, scene->weights, quantity, count, p.g, p.work, p.work_bytes,
                              made->row + first, error));
    }
    *rows = made;
    made = NULL;
done:
    pass_free(&p);
    lam_rows_close(made);
    return status;
}

double lam_rows_area(const lam_rows *rows, size_t k) {
    return rows->row[k]->area;
}

/* The light as rows read it. spots [n_groups]. */
static source_light light_of(const lam_light *light, emission_spot *spots) {
    for (size_t k = 0; k < light->n_groups; k++)
        spots[k] = (emission_spot){.where = light->groups[k], .whole_group = true};
    return (source_light){.E = light->E,
                          .spots = spots,
                          .colours = light->exitances,
                          .n_spots = light->n_groups,
                          .L = light->L,
                          .D = light->D,
                          .W = light->W};
}

lam_status lam_rows_means(const lam_rows *rows, size_t n_lights, const lam_light *lights, double *means,
                          lam_error *error) {
    lam_status status = LAM_OK;
    const lam_scene *s = rows->scene;
    size_t most = 0;
    emission_spot *spots = NULL;
    for (size_t v = 0; v < n_lights; v++) {
        TRY(lam_light_check(s, &lights[v], error));
        if (lights[v].n_groups > most) most = lights[v].n_groups;
    }
    spots = memory_allocate(most, sizeof *spots, "light", error);
    if (spots == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t v = 0; v < n_lights; v++) {
        const source_light light = light_of(&lights[v], spots);
        for (size_t k = 0; k < rows->n_rows; k++) {
            const adjoint_row *row = rows->row[k];
            double *to = means + (v * rows->n_rows + k) * s->n_channels;
            if (!adjoint_row_suffices(&s->linear, row, &light))
                FAIL(error, LAM_ERR_ARGUMENT,
                     "light %zu of a store of few emitters is of no weights that are known; give its weights",
                     v);
            adjoint_row_evaluate(&s->linear, row, &light, to);
            for (size_t c = 0; !(row->area > 0) && c < s->n_channels; c++) to[c] = NAN;
        }
    }
done:
    free(spots);
    return status;
}

void lam_rows_jacobian(const lam_rows *rows, lam_by by, float *out) {
    const linear_scene *s = &rows->scene->linear;
    const size_t width = adjoint_row_width(s, by);
    for (size_t c = 0; c < s->n_channels; c++)
        for (size_t k = 0; k < rows->n_rows; k++)
            adjoint_row_derivatives(s, rows->row[k], by, c, out + (c * rows->n_rows + k) * width);
}

/* Rows of elements: a pass of them at a time. */
static lam_status by_rows(const lam_scene *s, lam_quantity quantity, size_t n_elements,
                          const uint32_t *elements, lam_by by, float *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t C = s->n_channels, width = adjoint_row_width(&s->linear, by);
    pass_work p = {.g = NULL};
    adjoint_row *rows[PASS] = {NULL};
    const size_t most = n_elements < PASS ? n_elements : PASS;
    TRY(pass_allocate(s, most, &p, error));
    for (size_t k = 0; k < most; k++) {
        rows[k] = adjoint_row_create(&s->linear, NULL, 0, quantity);
        if (rows[k] == NULL) FAIL(error, LAM_ERR_MEMORY, "not enough memory for a row");
        rows[k]->area = 1; /* one value is its own mean */
    }
    for (size_t first = 0; first < n_elements; first += PASS) {
        const size_t left = n_elements - first, count = left < PASS ? left : PASS;
        memset(p.g, 0, count * C * s->n * sizeof *p.g);
        for (size_t k = 0; k < count * C; k++) p.g[k * s->n + elements[first + k / C]] = 1;
        TRY(adjoint_rows_fill(&s->linear, s->weights, quantity, count, p.g, p.work, p.work_bytes, rows,
                              error));
        for (size_t k = 0; k < count * C; k++)
            adjoint_row_derivatives(&s->linear, rows[k / C], by, k % C,
                                    out + (k % C * n_elements + first + k / C) * width);
    }
done:
    for (size_t k = 0; k < most; k++) adjoint_row_free(rows[k]);
    pass_free(&p);
    return status;
}

/* Light of source k alone, in every channel; unit [C][width], zeroed, is of sides, and `one` [C] holds 1. */
static lam_light unit_light(size_t n_channels, size_t width, lam_by by, const uint32_t *k, float *unit,
                            const float *one) {
    if (by == LAM_BY_GROUPS) return (lam_light){.groups = k, .exitances = one, .n_groups = 1};
    for (size_t c = 0; c < n_channels; c++) unit[c * width + *k] = 1;
    return (lam_light){.L = by == LAM_BY_SKY ? unit : NULL,
                       .D = by == LAM_BY_LUMINAIRES ? unit : NULL,
                       .W = by == LAM_BY_EMITTERS ? unit : NULL};
}

/* Columns: an answer to each source. */
static lam_status by_columns(const lam_scene *s, lam_quantity quantity, size_t n_elements,
                             const uint32_t *elements, lam_by by, float *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t C = s->n_channels, n = s->n, width = adjoint_row_width(&s->linear, by);
    float *values = memory_allocate(C, n * sizeof *values, "a column", error);
    float *unit = memory_allocate(C, (width + 1) * sizeof *unit, "a column", error);
    if (values == NULL || unit == NULL) TRY(LAM_ERR_MEMORY);
    float *const one = unit + C * width;
    for (size_t c = 0; c < C; c++) one[c] = 1;
    for (uint32_t k = 0; k < width; k++) {
        const lam_light light = unit_light(C, width, by, &k, unit, one);
        const lam_status answered = lam_scene_answer(s, quantity, 1, &light, values, NULL, error);
        memset(unit, 0, C * width * sizeof *unit);
        /* A store of few emitters has no weights for it. */
        const bool none = answered == LAM_ERR_ARGUMENT && s->linear.n_emitters > 0;
        if (!none) TRY(answered);
        for (size_t r = 0; r < C * n_elements; r++)
            out[r * width + k] = none ? NAN : values[r / n_elements * n + elements[r % n_elements]];
    }
done:
    free(values);
    free(unit);
    return status;
}

lam_status lam_scene_jacobian(const lam_scene *scene, lam_quantity quantity, size_t n_elements,
                              const uint32_t *elements, lam_by by, float *out, lam_error *error) {
    for (size_t k = 0; k < n_elements; k++)
        if (elements[k] >= scene->n)
            return status_fail(error, LAM_ERR_ARGUMENT, "elements[%zu] = %u, must be below %zu", k,
                               elements[k], scene->n);
    if (n_elements == 0) return LAM_OK;
    return (n_elements <= adjoint_row_width(&scene->linear, by) ? by_rows : by_columns)(
        scene, quantity, n_elements, elements, by, out, error);
}
