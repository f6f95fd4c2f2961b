/* The weights of a path for all positions of a light, private to reuse*.c. */
#ifndef LAMBERT_WALK_REUSE_WEIGHTS_H
#define LAMBERT_WALK_REUSE_WEIGHTS_H

#include "solver/walk/reuse.h"
#include "solver/walk/walk_steps.h"

/* One position, recentred (visibility_recentre). */
typedef struct light_frame {
    float turn[3][3], move[3];
    float tangent[3], bitangent[3], normal[3], centre[3];
} light_frame;

/* The first hit of a path. */
typedef struct first_hit {
    uint32_t element;  /* VISIBILITY_NOTHING: it left the scene or met a back */
    uint32_t position; /* that the path belongs to */
    float local[3];    /* the point of the light, before any pose */
    float y[3];        /* recentred */
    uint64_t random;   /* the stream of the walk */
} first_hit;

/* The positions again, one array for each number of a frame. */
typedef struct light_table {
    size_t n;
    float *turn[9], *move[3], *tangent[3], *bitangent[3], *normal[3], *centre[3]; /* [n] each, one block */
} light_table;

lam_status light_table_create(size_t n, const light_frame *frames, light_table *out, lam_error *error);
void light_table_free(light_table *t);

/* Visibility from the centres of all positions. */
typedef struct light_maps {
    reuse_way way;
    size_t side;     /* cells of a map: maps side^2, hemicubes 3 side^2 */
    size_t cells;    /* of a position */
    uint32_t *facet; /* [s][cells], VISIBILITY_NOTHING where a ray leaves */
    float *distance; /* [s][cells], m; hemicubes: NULL */
} light_maps;

lam_status light_maps_create(const walk_scene *s, size_t n, const light_frame *frames, reuse_way way,
                             size_t resolution, light_maps *out, lam_error *error);
void light_maps_free(light_maps *m);

/* f[l] = F(x_l, y) times pi for every position l: V is 1 from the path's own position, and as maps have it
 * (NULL: by rays) from others. */
void reuse_kernels(const walk_scene *s, const light_table *table, const light_frame *frames,
                   const light_maps *maps, const first_hit *hit, float *f);

#endif
