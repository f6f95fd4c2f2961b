/* The light of a luminaire on an element that sees all of it. Must not know what hides it. */
#ifndef LAMBERT_DIRECT_ELEMENT_LIGHT_H
#define LAMBERT_DIRECT_ELEMENT_LIGHT_H

#include "solver/direct/placed_source.h"
#include "solver/scene/mesh.h"

/* True if the front of an element faces no part of the opening. */
bool element_faces_away(const mesh *m, size_t element, const placed_source *s);

/* (1 / A) integral over A of sum_c I cos / d^2, lx at dim 1. The element is divided until two rules agree on
 * each part: one place and four, or three of a triangle. kept: of elements side by side. Error: below .1 %
 * where the intensity is smooth, and below .2 % where it ends with a step. Cost: 5 places and their cells for
 * an element that is small beside its distance. */
double element_light(const mesh *m, size_t element, const placed_source *s, kept_cells *kept);

#endif
