/* The scenes that suites measure on: built in memory, generated, or read from a file. */
#ifndef LAMBERT_BENCH_SCENES_H
#define LAMBERT_BENCH_SCENES_H

#include "solver/scene/generate/generate.h"
#include "solver/scene/mesh.h"

/* A planar piece: a parallelogram, or the triangle that is half of it. Its front is where along x across
 * points. */
typedef struct scene_piece {
    double corner[3], along[3], across[3];
    bool triangle;
} scene_piece;

/* A mesh with an element a piece, reflectance .5, without emission. Freed by mesh_free.
 * Errors: LAM_ERR_MEMORY, LAM_ERR_ARGUMENT for a piece without an area. */
lam_status scene_of_pieces(const scene_piece *pieces, size_t n, mesh *out, lam_error *error);

/* Houses of one to six storeys on a plain under an open sky, lots x lots of them, about 44 elements each: the
 * kind of scene that the thesis calls a city. */
lam_status scene_houses(size_t lots, uint64_t seed, mesh *out, lam_error *error);

/* The Cornell box of `lambert generate cornell --elements`. */
lam_status scene_cornell(size_t elements, mesh *out, lam_error *error);

/* A room of 6 x 4 x 3 m with a square lamp below its ceiling, a table, a cabinet and a chair: faces as large
 * as they are, reflectance .6 and .4. */
lam_status scene_furnished(mesh *out, lam_error *error);

/* The same room without its lamp, with a window of 1.5 x 1.2 m in one wall, reflectance .6. */
lam_status scene_window(mesh *out, lam_error *error);

/* Any of the scenes of `lambert generate`, by way of a file in a folder of its own. */
lam_status scene_generated(const generate_options *how, mesh *out, lam_error *error);

/* A scene file, every face an element. */
lam_status scene_file(const char *path, mesh *out, lam_error *error);

#endif
