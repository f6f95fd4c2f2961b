/* The sides that bound joined elements. Private to facets.c. */
#ifndef LAMBERT_SCENE_FACET_FACET_SIDES_H
#define LAMBERT_SCENE_FACET_FACET_SIDES_H

#include "solver/scene/mesh.h"

/* A side of an element that no other element of its part shares: from place to place, as the outline runs. */
typedef struct side {
    uint32_t from, to, part;
} side;

typedef struct side_list {
    side *sides; /* sorted by part */
    size_t n, capacity;
} side_list;

/* How far vertex v lies off the straight way from a to b, metres; infinity where it is not between them. */
double vertex_off_way(const mesh *m, uint32_t a, uint32_t v, uint32_t b);

/* Takes away sides of a part that run along each other in opposite directions, also where one of them is as
 * long as several together: a corner of one element on the side of another parts nothing in a plane. Cost:
 * for each part the square of its sides; those with more than some thousands stay as they are.
 * Errors: LAM_ERR_MEMORY. */
lam_status sides_cancel(const mesh *m, double flat, side_list *list, lam_error *error);

#endif
