/* The places of the tiles of a store's sky, as /sky/tiles states them, for pages that make skies. Knows no
 * tiling by name and no sky. */
#ifndef LAMBERT_SERVER_SCENE_TILE_PLACES_H
#define LAMBERT_SERVER_SCENE_TILE_PLACES_H

#include "solver/codec/buffer.h"
#include "store/store.h"

typedef struct tile_places {
    size_t n_tiles;
    double *tiles; /* [n_tiles][TILE_COLUMNS], as in FORMAT.md, /sky; NULL: the store has none */
    char *tiling;  /* its name */
    char up;       /* 'x', 'y' or 'z' */
    double ground_albedo;
} tile_places;

enum { TILE_COLUMNS = 9 };

/* Reads the places of n_tiles tiles; *out stays as it is for a store without them. Freed by tile_places_free.
 * Errors: as store_read; LAM_ERR_FORMAT names the tile. */
lam_status tile_places_read(store *s, size_t n_tiles, tile_places *out, lam_error *error);
void tile_places_free(tile_places *p);

/* Appends the members of the JSON of GET /v1/scenes/NAME/sky, without braces: angles in degrees, azimuths
 * from north by east. False when memory is short. O(n_tiles). */
bool tile_places_write(const tile_places *p, buffer *b);

#endif
