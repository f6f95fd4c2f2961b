/* Tilings of the sky: the position of each tile, and the tile in a direction. Knows neither elements nor
 * rays.
 *
 * North is +y where z is up, -z where y is up, and +z where x is up; east is +x, +x and +y, so that east,
 * north and up are right-handed. Azimuth runs from north by east. */
#ifndef LAMBERT_DAYLIGHT_SKY_TILES_H
#define LAMBERT_DAYLIGHT_SKY_TILES_H

#include "store/status.h"

#include <stdint.h>

/* One tile, angles in radians: nine numbers, as in a store. */
typedef struct sky_tile {
    double centre[3];   /* unit vector towards its middle altitude and azimuth, in the scene's axes */
    double altitude[2]; /* above the horizon: from, to */
    double azimuth[2];  /* from, to; the first of a band begins west of north, below 0 */
    double solid_angle; /* sr; all together 2 pi */
    double cosine;      /* integral of the cosine to the zenith, sr; all together pi */
} sky_tile;

/* Tiles of one band of altitudes, from north by east. */
typedef struct sky_band {
    uint32_t first, count;
} sky_band;

enum { SKY_PACKET = 8, SKY_NAME = 28, SKY_REINHART_MOST = 16, SKY_SECTORS_MOST = 360, SKY_BANDS_MOST = 90 };

typedef struct sky_tiling {
    char name[SKY_NAME];
    char up; /* 'x', 'y' or 'z' */
    size_t n_tiles, n_bands;
    sky_tile *tiles; /* [n_tiles], band by band from the horizon */
    sky_band *bands; /* [n_bands], all of one height; a zenith cap is the lower half of a band */
    float bands_per_radian;
    int axis[3];   /* of the scene: east, north, up */
    float sign[3]; /* likewise */
} sky_tiling;

/* Finds the tiles by name; the first tile of every band is centred on north.
 *   tregenza      145 tiles: bands of 12 degrees with 30, 30, 24, 24, 18, 12, 6 tiles, and a cap of radius 6
 *                 (Tregenza 1987)
 *   reinhart:MF   144 MF^2 + 1: each of those bands becomes MF bands of MF times as many tiles; all bands are
 *                 90/(7 MF + 1/2) degrees high, and the cap, still one tile, has half of that for its radius.
 *                 These are the tiles of Radiance's gendaymtx -m MF in its order, less the ground
 *   grid:AxB      A sectors by B bands of equal angles
 * Freed by sky_tiling_free. Errors: LAM_ERR_ARGUMENT names what is wrong with the name, LAM_ERR_MEMORY. */
lam_status sky_tiling_create(const char *name, char up, sky_tiling *out, lam_error *error);
void sky_tiling_free(sky_tiling *s);

/* The tile in each of a packet of directions (of any length, one array for each component); n_tiles, the
 * ground, for directions below the horizon. O(1). */
void sky_tiling_find(const sky_tiling *s, const float direction[3][SKY_PACKET], uint32_t tile[SKY_PACKET]);

#endif
