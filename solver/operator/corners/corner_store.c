#include "solver/operator/corners/corner_store.h"

#include "solver/base/scene/scene_buried.h"
#include "solver/operator/corners/corner_plan.h"
#include "store/groups.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static lam_status check_arrays(const store *s, const corner_arrays *a, lam_error *error) {
    lam_status status = LAM_OK;
    const uint32_t(*elements)[4] = a->elements;
    const double *vertices = a->vertices;
    for (size_t i = 0; i < a->n; i++)
        for (int k = 0; k < 4; k++)
            if (elements[i][k] >= a->n_vertices && !(k == 3 && elements[i][k] == CORNER_NONE))
                FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/elements[%zu][%d] = %u, there are %zu vertices",
                     store_path(s), i, k, elements[i][k], a->n_vertices);
    for (size_t k = 0; k < 3 * a->n_vertices; k++)
        if (!isfinite(vertices[k]))
            FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/vertices[%zu][%zu] = %g, must be finite", store_path(s),
                 k / 3, k % 3, vertices[k]);
done:
    return status;
}

lam_status corner_arrays_read(store *s, size_t n, corner_arrays *out, lam_error *error) {
    lam_status status = LAM_OK;
    store_type type;
    int rank;
    size_t dims[STORE_MAX_RANK];
    *out = (corner_arrays){.n = n};
    TRY(store_array_info(s, STORE_MESH "/vertices", &type, &rank, dims, error));
    if (rank != 2) FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/vertices must be [v][3]", store_path(s));
    out->n_vertices = dims[0];
    TRY(store_read(s, STORE_MESH "/vertices", STORE_F64, 2, (size_t[]){out->n_vertices, 3}, &out->vertices,
                   error));
    TRY(store_read(s, STORE_MESH "/elements", STORE_U32, 2, (size_t[]){n, 4}, &out->elements, error));
    TRY(store_read(s, STORE_MESH "/normal", STORE_F32, 2, (size_t[]){n, 3}, &out->normal, error));
    TRY(store_read(s, STORE_MESH "/group", STORE_U32, 1, (size_t[]){n}, &out->group, error));
    TRY(scene_buried_load(s, n, &out->buried, error));
    TRY(check_arrays(s, out, error));
done:
    return status;
}

void corner_arrays_free(corner_arrays *a) {
    free(a->vertices);
    free(a->elements);
    free(a->normal);
    free(a->group);
    free(a->buried);
    *a = (corner_arrays){.n = 0};
}

corner_mesh corner_arrays_mesh(const corner_arrays *a) {
    return (corner_mesh){.n_vertices = a->n_vertices,
                         .n = a->n,
                         .vertices = a->vertices,
                         .elements = a->elements,
                         .normal = a->normal,
                         .group = a->group,
                         .buried = a->buried};
}

struct lam_corners {
    corner_nodes nodes;
    corner_plan plan;
    double (*position)[3]; /* [n_nodes] */
};

static lam_status make_corners(const corner_mesh *m, lam_corners *c, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(corner_nodes_create(m, &c->nodes, error));
    TRY(corner_plan_create(m, &c->nodes, &c->plan, error));
    c->position = memory_allocate(c->nodes.n_nodes, sizeof *c->position, "corners", error);
    if (c->position == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t j = 0; j < c->nodes.n_nodes; j++)
        memcpy(c->position[j], m->vertices[c->nodes.vertex[j]], sizeof *c->position);
done:
    return status;
}

lam_status lam_corners_open(const char *path, lam_corners **corners, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    store_type type;
    int rank;
    size_t dims[STORE_MAX_RANK];
    corner_arrays arrays = {.n = 0};
    lam_corners *made = NULL;
    if (path == NULL || corners == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "a path and a place for the corners are needed");
    TRY(store_open(path, &s, error));
    TRY(store_array_info(s, STORE_MESH "/elements", &type, &rank, dims, error));
    if (rank != 2)
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/elements has %d dimensions, must have 2", store_path(s), rank);
    TRY(corner_arrays_read(s, dims[0], &arrays, error));
    made = memory_allocate(1, sizeof *made, "corners", error);
    if (made == NULL) TRY(LAM_ERR_MEMORY);
    const corner_mesh m = corner_arrays_mesh(&arrays);
    TRY(make_corners(&m, made, error));
    *corners = made;
    made = NULL;
done:
    lam_corners_close(made);
    corner_arrays_free(&arrays);
    store_close(s);
    return status;
}

void lam_corners_close(lam_corners *corners) {
    if (corners == NULL) return;
    corner_nodes_free(&corners->nodes);
    corner_plan_free(&corners->plan);
    free(corners->position);
    free(corners);
}

size_t lam_corners_elements(const lam_corners *corners) {
    return corners->plan.n;
}

size_t lam_corners_count(const lam_corners *corners) {
    return corners->plan.n_nodes;
}

const double *lam_corners_positions(const lam_corners *corners) {
    return corners->position[0];
}

size_t lam_corners_of(const lam_corners *corners, size_t element, const uint32_t **list) {
    const size_t first = corners->nodes.ring_start[element];
    *list = corners->nodes.ring + first;
    return corners->nodes.ring_start[element + 1] - first;
}

void lam_corners_apply(const lam_corners *corners, size_t n_rows, const float *x, float *out, float *work) {
    const size_t n = corners->plan.n;
    for (size_t r = 0; r < n_rows; r++) {
        memcpy(work, x + r * n, n * sizeof *work);
        corner_plan_apply(&corners->plan, 1, work, out + r * corners->plan.n_nodes);
    }
}

void lam_corners_adjoint(const lam_corners *corners, size_t n_rows, const float *g, float *x, float *work) {
    const size_t n = corners->plan.n, n_nodes = corners->plan.n_nodes;
    memset(x, 0, n_rows * n * sizeof *x);
    for (size_t r = 0; r < n_rows; r++) {
        memcpy(work, g + r * n_nodes, n_nodes * sizeof *work);
        corner_plan_transpose(&corners->plan, 1, work, x + r * n, work + n_nodes);
    }
}
