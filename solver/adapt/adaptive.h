/* Meshes of unequal elements: faces are cut where the light of a coarse solution changes, as long as
 * constants on elements leave more than an error that is asked for (Cohen et al. 1986 subdivide by
 * differences of radiosities; here each cell gathers at points within itself, so that neither direct light
 * nor the cell's own size waits for a new solution). A cut may run along a shadow or a line of equal light,
 * as those of discontinuity meshing do (Lischinski, Tampieri and Greenberg 1992): it is the one of about 170
 * that leaves least. */
#ifndef LAMBERT_ADAPT_ADAPTIVE_H
#define LAMBERT_ADAPT_ADAPTIVE_H

#include "solver/adapt/cell_look.h"

typedef struct adaptive_options {
    double error;    /* |error| / |B - E| that constants on elements may leave, for each light */
    size_t elements; /* at most, both sides counted; where there are more faces, as many as these */
    size_t points;   /* that are looked at, about, at most; 0: as many as it takes */
    bool rough; /* a cell is cut by half as many points: a third of the time, for a tenth more elements */
    coarse_sources from; /* of adaptive_refine */
    uint64_t seed;
    const progress *progress;
} adaptive_options;

typedef struct adaptive_report {
    mesh_estimate left; /* by the mesh that was made */
    bool reached;       /* the largest error is at most what was asked for */
} adaptive_report;

/* Divides the faces of a mesh in place, which faces_join has made as large as can be, or not. Both sides are
 * looked at of those that are to have a back. Its lights are those of a coarse solution (coarse_light.h),
 * which is found first. Deterministic, for any number of threads. Cost: the coarse solution, and gather_at
 * for about 150 points of each element that is made; memory: at most 256 MiB of points beside the cells.
 * Errors: those of coarse_light_make and mesh_of_cells. */
lam_status adaptive_refine(mesh *m, const adaptive_options *how, adaptive_report *report, lam_error *error);

/* The same by a solution that is there, and its lights; the mesh goes to another one, as mesh_of_cells makes
 * it. */
lam_status adaptive_refine_by(const cell_light *light, const adaptive_options *how, mesh *out,
                              adaptive_report *report, lam_error *error);

#endif
