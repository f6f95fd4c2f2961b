/* Faces that are written twice, and faces that overlap in one plane: light would be counted twice there. */
#ifndef LAMBERT_SCENE_COINCIDENT_H
#define LAMBERT_SCENE_COINCIDENT_H

#include "solver/scene/mesh.h"

enum { COINCIDENT_TEXT = 640 };

typedef struct coincident_report {
    size_t dropped;      /* faces that repeated another one */
    size_t differing;    /* of them in another group, or of another material, than the one that is kept */
    size_t cut, covered; /* faces that lost a part to others of their plane, or all */
    double cut_area;     /* m^2 that they lost */
    size_t overlapping;  /* faces that overlap others in one plane nevertheless, with the same side */
    double area;         /* m^2 that they cover more than once */
    /* A line each for people, "" where there is nothing to say. */
    char dropped_line[COINCIDENT_TEXT], cut_line[COINCIDENT_TEXT], overlap_line[COINCIDENT_TEXT];
} coincident_report;

/* Sets m->rounding of a mesh whose vertices are those of the file. Cost: O(n). */
void coincident_find_rounding(mesh *m);

/* Drops faces whose corners are those of another one, in the same sequence from any of them on: of these the
 * first that emits is kept, or, where none does, the first. Then cuts faces that cover the same part of a
 * plane, so that each place belongs to one (coincident_cut.h). Sets m->overlap, or NULL where no face
 * overlaps others after that. The opposite sides of a sheet, or of a box and the floor that it stands on, do
 * not overlap, unless both have a back; with both_sides (`--two-sided`) they do. Cost: O(n log n). Errors:
 * LAM_ERR_MEMORY. */
lam_status mesh_settle_coincident(mesh *m, bool both_sides, coincident_report *out, lam_error *error);

/* shared [n]: the m^2 of each element that others of its plane cover which look to the opposite side, backs
 * of fronts aside. Cost: O(n log n). Errors: LAM_ERR_MEMORY. */
lam_status mesh_find_sheets(const mesh *m, double *shared, lam_error *error);

/* m: no faces of one plane are further apart, however they were rounded. Cost: O(n). */
double coincident_reach(const mesh *m);

/* The m^2 that the overlapping faces of a mesh cover more than once: half the sum of what each of them
 * shares; and the share of the mesh's area that they have together. 0 where none overlaps. */
double mesh_overlap_area(const mesh *m);
double mesh_overlap_share(const mesh *m);

#endif
