/* The places of the tiles of a store's sky, as /sky/tiles states them, for clients that draw skies. Knows no
 * tiling by name and no sky. */
#ifndef LAMBERT_SERVER_SCENE_TILE_PLACES_H
#define LAMBERT_SERVER_SCENE_TILE_PLACES_H

#include "solver/codec/buffer.h"
#include "store/store.h"

/* Sets *out (empty before) to the places of n_tiles tiles as members of the JSON of GET /v1/scenes/NAME/sky,
 * without braces: angles in degrees, azimuths from north by east. They are written once, as those of a fine
 * sky take a tenth of a second. A store without them leaves *out empty. O(n_tiles). Errors: as store_read;
 * LAM_ERR_FORMAT names the tile. */
lam_status tile_places_read(store *s, size_t n_tiles, buffer *out, lam_error *error);

#endif
