/* A closed box seen from inside: its mesh, and its form factors by closed form instead of rays. */
#ifndef LAMBERT_TESTS_BOX_H
#define LAMBERT_TESTS_BOX_H

#include "solver/linalg/csr.h"
#include "solver/scene/mesh.h"
#include "support/suite.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Axis-aligned rectangles: the plane x[axis] = level, spanned by from/to on the other two axes. */
typedef struct box_cell {
    int axis;
    double level;
    double from[3], to[3];
} box_cell;

/* Cell i of the box [0, size] with divisions x divisions equal cells a face: faces x0 x1 y0 y1 z0 z1. */
box_cell box_cell_of(const double size[3], unsigned divisions, size_t i);

/* Adds a quad with its own four vertices; corners counter-clockwise seen from its front. */
void mesh_add_quad(mesh *m, const double corners[4][3]);

/* Adds an axis-aligned rectangle facing towards + (or -) its axis. */
void mesh_add_cell(mesh *m, const box_cell *cell, bool positive);

/* Measures a hand-made mesh and gives it one group and one grey material. */
void mesh_finish(mesh *m, float reflectance);

/* Names the group "room" and the axis z up: what places luminaires finds no housing in it. */
void mesh_name_room(mesh *m);

mesh box_mesh(const double size[3], unsigned divisions, float reflectance);

/* The exchange area A1 F12 of two cells of the inside of a box. */
double box_exchange(const box_cell *one, const box_cell *two);

/* F_ij, 0 where none is stored. */
double csr_entry(const csr *F, size_t i, size_t j);

/* F of a box without anything in it, as rows; only single precision is between it and the closed forms. */
csr box_form_factors(const double size[3], unsigned divisions, const double *area);

#endif
