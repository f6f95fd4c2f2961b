/* Moving lights as rays need them, private to reuse*.c: the frames of their positions in recentred
 * coordinates, and the pieces of their polygon, triangles or one parallelogram, on which points are chosen.
 */
#ifndef LAMBERT_WALK_LIGHT_FRAMES_H
#define LAMBERT_WALK_LIGHT_FRAMES_H

#include "solver/walk/moving_light.h"
#include "solver/walk/walk_steps.h"

/* One position, recentred (visibility_recentre). A light that lies in a face starts above it. */
typedef struct light_frame {
    float turn[3][3], move[3];
    float tangent[3], bitangent[3], normal[3], centre[3];
    float paths; /* N_l: of this position in a batch */
} light_frame;

void light_frame_set(const visibility *v, const moving_light *l, const light_pose *p, light_frame *out);

/* A piece before any pose. */
typedef struct light_piece {
    double share; /* the part of the area up to this piece and with it */
    float corner[3], edge[2][3];
} light_piece;

typedef struct light_pieces {
    size_t n;
    bool parallelogram;  /* the only piece */
    float middle[3];     /* the mean of the corners, before any pose */
    light_piece *piece;  /* [n] */
    walk_shape *carried; /* [positions][n] */
} light_pieces;

/* Errors: LAM_ERR_MEMORY. Freed by light_pieces_free. */
lam_status light_pieces_create(const moving_light *l, const light_frame *frames, light_pieces *out,
                               lam_error *error);
void light_pieces_free(light_pieces *p);

/* The piece of a place by its first coordinate, which becomes one of that piece. */
size_t light_pieces_choose(const light_pieces *p, uint32_t *place);

/* A parallelogram in split x split parts: that of a place, and its middle before any pose. Other lights are
 * one part. */
size_t light_pieces_part(const light_pieces *p, size_t split, const uint32_t place[4]);
void light_pieces_middle(const light_pieces *p, size_t split, size_t part, float local[3]);

/* The point of a piece at a place, the same as walk_leave finds on the piece that was carried. */
void light_pieces_point(const light_pieces *p, size_t k, const uint32_t place[4], float local[3]);

#endif
