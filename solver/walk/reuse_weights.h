/* The first hits of paths and their weights for all positions of a light, private to reuse*.c. */
#ifndef LAMBERT_WALK_REUSE_WEIGHTS_H
#define LAMBERT_WALK_REUSE_WEIGHTS_H

#include "solver/walk/light_frames.h"
#include "solver/walk/reuse.h"

/* Hits of a chunk; those of which weights are found together; and the lanes of the widest vectors, to a
 * multiple of which arrays are filled up; they are longer than a power of two, so that the same places of
 * several arrays do not compete for one part of a cache. */
enum { HITS_MOST = 2048, HITS_BLOCK = 256, HITS_LANES = 16, HITS_ROOM = HITS_MOST + HITS_LANES };

/* First hits on fronts, one array for each number, in the order of their positions. */
typedef struct first_hits {
    size_t count;
    uint32_t element[HITS_ROOM], facet[HITS_ROOM];
    uint32_t position[HITS_ROOM]; /* that the path belongs to */
    float local[3][HITS_ROOM];    /* the point of the light, before any pose */
    int part[HITS_ROOM];          /* of the light that it is in, and the middle of that */
    float middle[3][HITS_ROOM];
    float y[3][HITS_ROOM];      /* recentred */
    float normal[3][HITS_ROOM]; /* at y */
    uint64_t random[HITS_ROOM]; /* the stream of the walk */
} first_hits;

/* A cell of a map. */
typedef struct map_cell {
    uint32_t facet; /* VISIBILITY_NOTHING where a ray leaves */
    float distance; /* m */
} map_cell;

/* Visibility from the middles of split x split parts of the light at all positions. */
typedef struct light_maps {
    reuse_way way;
    size_t split,
        side; /* parts, and cells of a map, along a side: a map has side^2 cells, a hemicube 3 side^2 */
    size_t one, cells; /* of a part, of a position */
    map_cell *cell;    /* [s][split^2][one]; hemicubes: NULL */
    uint32_t *facet;   /* the same of hemicubes, VISIBILITY_NOTHING where a ray leaves */
} light_maps;

/* The parts of a light, along a side, are so small beside a scene that each sees about what its middle sees:
 * a tenth of the radius at most, but no more than 4. */
size_t light_maps_split(const walk_scene *s, const moving_light *l, const light_pieces *p);

/* `resolution` cells along a side of all maps of a position together, so that parts cost nothing; there are
 * fewer than split^2 where one would have less than 32. Errors: LAM_ERR_ARGUMENT (too many cells),
 * LAM_ERR_MEMORY. */
lam_status light_maps_create(const walk_scene *s, size_t n, const light_frame *frames,
                             const light_pieces *pieces, reuse_way way, size_t resolution, size_t split,
                             light_maps *out, lam_error *error);
void light_maps_free(light_maps *m);

/* weight[k * n + l] = F(x_l, y_k) / sum_i N_i F(x_i, y_k) for the n positions l and the hits k: V is 1 from
 * the path's own position, and as maps have it (NULL: by rays) from others. work: [HITS_BLOCK * (n + 1)]. */
void reuse_weights(const walk_scene *s, size_t n, const light_frame *frames, const light_maps *maps,
                   const first_hits *hits, float *work, float *weight);

#endif
