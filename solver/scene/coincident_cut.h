/* Faces that cover the same part of a plane, cut so that each place belongs to one of them. Knows no light.
 * Private to solver/scene. */
#ifndef LAMBERT_SCENE_COINCIDENT_CUT_H
#define LAMBERT_SCENE_COINCIDENT_CUT_H

#include "solver/scene/coincident_pairs.h"
#include "solver/scene/mesh_cells.h"

typedef struct coincident_cuts {
    size_t cut, covered; /* faces that lose a part, and those of which nothing is left */
    size_t parts;        /* faces that are left of the cut ones */
    size_t whole;        /* faces that stay as they are, as they would become too many parts */
    double area;         /* m^2 that go */
    double *lost;        /* [n_groups], of these */
    double first[3];     /* the centre of the first face that loses some */
    size_t n;         /* faces that stay as they are, and parts, in the order of faces; of those of which */
    mesh_cell *cells; /* nothing is left the whole, */
    bool *dropped;    /* [n], which is marked */
} coincident_cuts;

/* A place that several faces cover stays with the one whose surface is the smallest: a rug keeps its place in
 * a floor, a lamp in a ceiling, tiles what lies under them. A surface is what hangs together in one plane, of
 * one group and material. Of surfaces of one size the first that emits keeps it, or the first; within a
 * surface the first face. A face that would become more than a thousand parts stays whole. Freed by
 * coincident_cuts_free. Cost: O(n log n), and for each cut face the others in its place times its parts.
 * Errors: LAM_ERR_MEMORY. */
lam_status coincident_cuts_find(const mesh *m, const coincident_pairs *pairs, coincident_cuts *out,
                                lam_error *error);
void coincident_cuts_free(coincident_cuts *c);

/* Makes them: parts have the group, the material and the face of the file of what they are left of, and 3 or
 * 4 corners; groups of which nothing is left go. Errors: LAM_ERR_MEMORY. */
lam_status coincident_cuts_make(mesh *m, const coincident_cuts *cuts, lam_error *error);

#endif
