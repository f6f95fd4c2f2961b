#include "solver/scene/mesh_cells.h"

#include "solver/base/vector3.h"
#include "solver/scene/face_grid.h"
#include "solver/scene/mesh_refined.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

mesh_cell mesh_cell_of(const mesh *m, size_t face) {
    mesh_cell c = {.face = (uint32_t)face, .n = (uint32_t)mesh_corners(m, face), .share = 1};
    for (size_t k = 0; k < c.n; k++)
        memcpy(c.corner[k], m->vertices[m->elements[face][k]], sizeof c.corner[k]);
    return c;
}

enum { STEPS = MESH_CELL_STEPS };

bool mesh_cut_divides(size_t corners, mesh_cut cut) {
    /* corners after `from` and before `to`, and those outside */
    const size_t between = (cut.to + STEPS - 1u) / STEPS - cut.from / STEPS - 1u;
    const size_t ends = (cut.from % STEPS == 0) + (cut.to % STEPS == 0);
    const size_t outside = corners - between - ends;
    return between >= 1 && between <= 2 && outside >= 1 && outside <= 2;
}

size_t mesh_cell_cuts(size_t corners, size_t every, mesh_cut cuts[MESH_CUTS_MOST]) {
    const size_t places = STEPS * corners;
    size_t n = 0;
    for (size_t from = 0; from < places; from += every)
        for (size_t to = from + every; to < places; to += every) {
            const mesh_cut cut = {(uint8_t)from, (uint8_t)to};
            if (mesh_cut_divides(corners, cut)) cuts[n++] = cut;
        }
    return n;
}

void mesh_cell_place(const mesh_cell *c, size_t place, double out[3]) {
    const size_t k = place / STEPS;
    edge_point(c->corner[k], c->corner[(k + 1) % c->n], place % STEPS, STEPS, out);
}

/* The part of a cell on the way from one place to another along its border. */
static mesh_cell part(const mesh_cell *c, size_t from, size_t to) {
    const size_t end = to > from ? to : to + STEPS * c->n;
    mesh_cell out = {.face = c->face};
    mesh_cell_place(c, from, out.corner[out.n++]);
    for (size_t k = from / STEPS + 1; STEPS * k < end; k++) {
        assert(out.n < 3);
        memcpy(out.corner[out.n++], c->corner[k % c->n], sizeof *out.corner);
    }
    mesh_cell_place(c, to, out.corner[out.n++]);
    return out;
}

bool mesh_cell_cut(const mesh_cell *c, mesh_cut cut, mesh_cell out[2]) {
    mesh_cell parts[2] = {part(c, cut.from, cut.to), part(c, cut.to, cut.from)};
    const double first = mesh_cell_area(&parts[0]), second = mesh_cell_area(&parts[1]);
    parts[0].share = c->share * first / (first + second);
    parts[1].share = c->share * second / (first + second);
    if (!(parts[0].share >= MESH_CELL_LEAST && parts[1].share >= MESH_CELL_LEAST)) return false;
    memcpy(out, parts, sizeof parts);
    return true;
}

bool mesh_cell_halve(const mesh_cell *c, size_t side, mesh_cell out[2]) {
    const size_t middle = STEPS * side + STEPS / 2;
    const size_t opposite = c->n == 4 ? (middle + 2 * STEPS) % (4 * STEPS) : STEPS * ((side + 2) % 3);
    return mesh_cell_cut(c, (mesh_cut){(uint8_t)middle, (uint8_t)opposite}, out);
}

double mesh_cell_area(const mesh_cell *c) {
    double sum[3] = {0};
    for (size_t k = 1; k + 1 < c->n; k++) {
        double a[3], b[3], product[3];
        subtract3(c->corner[k], c->corner[0], a);
        subtract3(c->corner[k + 1], c->corner[0], b);
        cross3(a, b, product);
        for (int d = 0; d < 3; d++) sum[d] += product[d] / 2;
    }
    return sqrt(dot3(sum, sum));
}

void mesh_cell_edges(const mesh_cell *c, double length[4]) {
    for (size_t k = 0; k < c->n; k++) length[k] = point_distance(c->corner[k], c->corner[(k + 1) % c->n]);
}

/* Halves a cell that is larger than an area; false where it is not, or is too small. */
static bool halve_large(const mesh_cell *c, double area, mesh_cell out[2]) {
    double length[4] = {0};
    size_t side = 0;
    if (mesh_cell_area(c) <= area) return false;
    mesh_cell_edges(c, length);
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
            if (count + halved < most && halve_large(&cells[i], area, next + at)) {
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
        fine.face[i] = cells[i].face;
        TRY(refined_mesh_add(&fine, i, cells[i].n, (const double(*)[3])cells[i].corner, error));
    }
    TRY(refined_mesh_end(&fine, m, out, error));
done:
    refined_mesh_free(&fine);
    return status;
}
