/* Cells: parts of a mesh's faces, made by halving, from which a mesh of unequal elements is made. A cell
 * keeps the plane of its face. Corners that lie on a side of a neighbour stay as they are (T-vertices). */
#ifndef LAMBERT_SCENE_MESH_CELLS_H
#define LAMBERT_SCENE_MESH_CELLS_H

#include "solver/scene/mesh.h"

/* Corners in steps of the face: of a quad (i, j) of its bilinear grid, of a triangle towards its second and
 * third corner. */
enum { MESH_CELL_STEPS = 1 << 15 };
typedef struct mesh_cell {
    uint32_t face;
    uint16_t n; /* corners, 3 or 4 */
    uint16_t at[4][2];
} mesh_cell;

/* The whole of a face. */
mesh_cell mesh_cell_of(const mesh *m, size_t face);

/* Halves a cell: a quad across its first (side 0) or its second edge (side 1), a triangle from the middle of
 * its edge `side` to the corner opposite. False where the cell is too small for it. */
bool mesh_cell_halve(const mesh_cell *c, size_t side, mesh_cell out[2]);

/* Its corners in the scene. */
void mesh_cell_corners(const mesh *m, const mesh_cell *c, double corners[4][3]);

/* Its area, and the lengths of its edges. */
double mesh_cell_area(const double corners[4][3], size_t n);
void mesh_cell_edges(const double corners[4][3], size_t n, double length[4]);

/* All faces, halved across their longest edges until no cell has more than an area, or there are `most`. The
 * cells of a face follow each other, in the order of faces. *out is freed with free(). Errors:
 * LAM_ERR_MEMORY. */
lam_status mesh_cells_even(const mesh *m, double area, size_t most, mesh_cell **out, size_t *n,
                           lam_error *error);

/* A mesh of n cells in that order, which cover all faces; they inherit group and materials, and mesh_replace
 * the names of groups. Errors: LAM_ERR_MEMORY, LAM_ERR_ARGUMENT. */
lam_status mesh_of_cells(const mesh *m, size_t n, const mesh_cell *cells, mesh *out, lam_error *error);

/* Replaces a mesh by one that was made of it; *by is empty then. */
void mesh_replace(mesh *m, mesh *by);

#endif
