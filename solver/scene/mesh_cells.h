/* Cells: parts of a mesh's faces, made by straight cuts, from which a mesh of unequal elements is made. A
 * cell keeps the plane of its face. Corners that lie on a side of a neighbour stay as they are (T-vertices).
 */
#ifndef LAMBERT_SCENE_MESH_CELLS_H
#define LAMBERT_SCENE_MESH_CELLS_H

#include "solver/scene/mesh.h"

typedef struct mesh_cell {
    uint32_t face;
    uint32_t n;          /* corners, 3 or 4 */
    double corner[4][3]; /* m */
    double share;        /* of the face's area */
} mesh_cell;

/* No cell has less of its face. */
#define MESH_CELL_LEAST 0x1p-28

/* The whole of a face. */
mesh_cell mesh_cell_of(const mesh *m, size_t face);

/* A straight cut between two places on the border of a cell: place MESH_CELL_STEPS k + q is q steps of the
 * way from corner k to the next one. */
enum { MESH_CELL_STEPS = 16 };
typedef struct mesh_cut {
    uint8_t from, to; /* below MESH_CELL_STEPS n, from < to */
} mesh_cut;

/* True if a cut leaves two cells of 3 or 4 corners: it runs between two sides, between a corner and a side
 * that is not its own, or along a diagonal of a quad. */
bool mesh_cut_divides(size_t corners, mesh_cut cut);

/* All such cuts between places that are multiples of `every` steps, which divides MESH_CELL_STEPS into
 * MESH_CELL_STEPS / every parts, 8 at most. Returns their number. */
enum { MESH_CUTS_MOST = 168 };
size_t mesh_cell_cuts(size_t corners, size_t every, mesh_cut cuts[MESH_CUTS_MOST]);

/* Cuts a cell. False where it is too small for it. */
bool mesh_cell_cut(const mesh_cell *c, mesh_cut cut, mesh_cell out[2]);

/* Halves a cell: a quad across its first (side 0) or its second edge (side 1), a triangle from the middle of
 * its edge `side` to the corner opposite. False where the cell is too small for it. */
bool mesh_cell_halve(const mesh_cell *c, size_t side, mesh_cell out[2]);

/* A place on the border of a cell; from either side of an edge it has the same bits. */
void mesh_cell_place(const mesh_cell *c, size_t place, double out[3]);

/* The area of a cell, and the lengths of its edges. */
double mesh_cell_area(const mesh_cell *c);
void mesh_cell_edges(const mesh_cell *c, double length[4]);

/* All faces, halved across their longest edges until no cell has more than an area, or there are `most`. The
 * cells of a face follow each other, in the order of faces. *out is freed with free(). Errors:
 * LAM_ERR_MEMORY. */
lam_status mesh_cells_even(const mesh *m, double area, size_t most, mesh_cell **out, size_t *n,
                           lam_error *error);

/* A mesh of n cells in that order, which cover all faces; they inherit group, face of the file and materials,
 * and mesh_replace the names of groups. Errors: LAM_ERR_MEMORY, LAM_ERR_ARGUMENT. */
lam_status mesh_of_cells(const mesh *m, size_t n, const mesh_cell *cells, mesh *out, lam_error *error);

/* Replaces a mesh by one that was made of it; *by is empty then. */
void mesh_replace(mesh *m, mesh *by);

#endif
