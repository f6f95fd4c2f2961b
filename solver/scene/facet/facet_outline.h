/* Outlines of joined elements, cut into few pieces. Private to facets.c. */
#ifndef LAMBERT_SCENE_FACET_FACET_OUTLINE_H
#define LAMBERT_SCENE_FACET_FACET_OUTLINE_H

#include "solver/scene/mesh.h"

/* A side of an element that no other element of its part shares: from place to place, as the outline runs. */
typedef struct side {
    uint32_t from, to, part;
} side;

typedef struct side_list {
    side *sides; /* sorted by part */
    size_t n, capacity;
} side_list;

typedef struct outlines {
    const mesh *m;
    size_t n_elements;
    const uint32_t *place; /* [n_vertices], one vertex for all that are at the same point */
    double flat;           /* metres: the distance from a line within which a vertex may be dropped */
    size_t n_parts;
    const uint32_t *part;      /* [n_elements] */
    const uint32_t *size;      /* [n_parts], elements */
    const double (*normal)[3]; /* [n_parts], unit */
    const double *area;        /* [n_parts] */
    bool *alone;               /* [n_parts], not joined; set where a part has no usable outline */
    const side *sides;         /* sorted by part */
    size_t n_sides;
    uint32_t (*pieces)[4]; /* result, freed by the caller: those of joined parts, as in facets */
    uint32_t *piece_part;
    size_t n_pieces, piece_capacity, owner_capacity;
} outlines;

/* Cost: O(sides), and for each part the square of its outline's corners. Errors: LAM_ERR_MEMORY. */
lam_status outlines_cut(outlines *o, lam_error *error);

/* Removes sides of a part that run along each other in opposite directions, also where one is as long as
 * several others together, because a corner of one element lies on the side of another. Cost: for each part
 * the square of its sides; parts with more than some thousands stay unchanged. Errors: LAM_ERR_MEMORY. */
lam_status sides_cancel(const mesh *m, double flat, side_list *list, lam_error *error);

#endif
