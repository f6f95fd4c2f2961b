#include "solver/scene/mesh_cells.h"

#include "solver/base/vector3.h"
#include "solver/scene/face_grid.h"
#include "solver/scene/mesh_refined.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

mesh_cell mesh_cell_of(const mesh *m, size_t face) {
    enum { S = MESH_CELL_STEPS };
    const size_t n = mesh_corners(m, face);
    if (n == 4) return (mesh_cell){(uint32_t)face, 4, {{0, 0}, {S, 0}, {S, S}, {0, S}}};
    return (mesh_cell){(uint32_t)face, 3, {{0, 0}, {S, 0}, {0, S}, {0, 0}}};
}

/* False where the middle is none of the steps. */
static bool middle(const uint16_t a[2], const uint16_t b[2], uint16_t out[2]) {
    for (int d = 0; d < 2; d++) {
        const unsigned sum = (unsigned)a[d] + b[d];
        if (sum % 2 == 1) return false;
        out[d] = (uint16_t)(sum / 2);
    }
    return true;
}

bool mesh_cell_halve(const mesh_cell *c, size_t side, mesh_cell out[2]) {
    const size_t n = c->n, a = side, b = (side + 1) % n, across = n == 4 ? (side + 3) % n : 0;
    uint16_t near[2], far[2];
    if (!middle(c->at[a], c->at[b], near)) return false;
    if (n == 4 && !middle(c->at[(side + 2) % n], c->at[across], far)) return false;
    out[0] = out[1] = *c;
    memcpy(out[0].at[b], near, sizeof near);
    memcpy(out[1].at[a], near, sizeof near);
    if (n == 4) {
        memcpy(out[0].at[(side + 2) % n], far, sizeof far);
        memcpy(out[1].at[across], far, sizeof far);
    }
    return true;
}

void mesh_cell_corners(const mesh *m, const mesh_cell *c, double corners[4][3]) {
    double face[4][3];
    const size_t n = c->n == 4 ? 4 : 3;
    for (size_t k = 0; k < n; k++) memcpy(face[k], m->vertices[m->elements[c->face][k]], sizeof face[k]);
    for (size_t k = 0; k < n; k++) {
        const uint16_t *at = c->at[k];
        if (n == 4)
            grid_point(face, at[0], MESH_CELL_STEPS, at[1], MESH_CELL_STEPS, corners[k]);
        else
            triangle_point(face, at[0], at[1], MESH_CELL_STEPS, corners[k]);
    }
}

double mesh_cell_area(const double corners[4][3], size_t n) {
    double sum[3] = {0};
    for (size_t k = 1; k + 1 < n; k++) {
        double a[3], b[3], product[3];
        subtract3(corners[k], corners[0], a);
        subtract3(corners[k + 1], corners[0], b);
        cross3(a, b, product);
        for (int d = 0; d < 3; d++) sum[d] += product[d] / 2;
    }
    return sqrt(dot3(sum, sum));
}

void mesh_cell_edges(const double corners[4][3], size_t n, double length[4]) {
    for (size_t k = 0; k < n; k++) length[k] = point_distance(corners[k], corners[(k + 1) % n]);
}

/* Halves a cell that is larger than an area; false where it is not, or is too small. */
static bool halve_large(const mesh *m, const mesh_cell *c, double area, mesh_cell out[2]) {
    double corners[4][3], length[4];
    size_t side = 0;
    mesh_cell_corners(m, c, corners);
    if (mesh_cell_area((const double(*)[3])corners, c->n) <= area) return false;
    mesh_cell_edges((const double(*)[3])corners, c->n, length);
    for (size_t k = 1; k < (c->n == 4 ? 2u : 3u); k++)
        if (length[k] > length[side]) side = k;
    return mesh_cell_halve(c, side, out);
}

lam_status mesh_cells_even(const mesh *m, double area, size_t most, mesh_cell **out, size_t *n,
                           lam_error *error) {
    lam_status status = LAM_OK;
    size_t count = m->n, halved = m->n;
    mesh_cell *cells = memory_allocate(count, sizeof *cells, "cells of a mesh", error), *next = NULL;
    if (cells == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < count; i++) cells[i] = mesh_cell_of(m, i);
    while (halved > 0 && count < most) {
        size_t at = 0;
        halved = 0;
        next = memory_allocate(count, 2 * sizeof *next, "cells of a mesh", error);
        if (next == NULL) TRY(LAM_ERR_MEMORY);
        for (size_t i = 0; i < count; i++) {
            if (count + halved < most && halve_large(m, &cells[i], area, next + at)) {
                at += 2;
                halved++;
            } else {
                next[at++] = cells[i];
            }
        }
        free(cells);
        cells = next;
        next = NULL;
        count = at;
    }
    *out = cells;
    *n = count;
    cells = NULL;
done:
    free(cells);
    free(next);
    return status;
}

lam_status mesh_of_cells(const mesh *m, size_t n, const mesh_cell *cells, mesh *out, lam_error *error) {
    lam_status status = LAM_OK;
    refined_mesh fine = {.n = 0};
    TRY(refined_mesh_begin(m, n, &fine, error));
    for (size_t i = 0; i < n; i++) {
        double corners[4][3];
        mesh_cell_corners(m, &cells[i], corners);
        fine.face[i] = cells[i].face;
        TRY(refined_mesh_add(&fine, i, cells[i].n, (const double(*)[3])corners, error));
    }
    TRY(refined_mesh_end(&fine, m, out, error));
done:
    refined_mesh_free(&fine);
    return status;
}
