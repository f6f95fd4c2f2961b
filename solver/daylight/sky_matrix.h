/* Reads sky matrices of Radiance, the radiance of sky patches over hours, as gendaymtx and genskyvec write
 * them. Knows neither weather nor the position of the sun. */
#ifndef LAMBERT_DAYLIGHT_SKY_MATRIX_H
#define LAMBERT_DAYLIGHT_SKY_MATRIX_H

#include "solver/base/progress.h"
#include "solver/daylight/sky_tiles.h"

typedef struct sky_matrix {
    size_t n;          /* columns: hours */
    size_t n_channels; /* 1 where the components are equal everywhere, else 3 */
    sky_tiling tiling; /* up is z */
    float *L;          /* [n][n_channels][n_tiles] */
} sky_matrix;

void sky_matrix_free(sky_matrix *m);

/* True for a name that ends in .mtx or .smx. */
bool sky_matrix_is_named(const char *path);

/* Reads a matrix. Its first line is #?RADIANCE; its header, up to an empty line, gives NROWS, NCOLS, NCOMP (1
 * or 3), FORMAT (ascii, float or double) and optionally BigEndian=1. Numbers follow row by row. Row 0 is the
 * ground, which is checked and dropped, because a store has its own. The others are patches from the horizon
 * up, from north by east, of Tregenza's sky (146 rows) or Reinhart's (144 MF^2 + 2); each is assigned to the
 * tile in its direction. tiles, which may be NULL, must be that tiling. Errors: LAM_ERR_IO, LAM_ERR_MEMORY,
 * LAM_ERR_CANCELLED, LAM_ERR_FORMAT: the file, the place, the value, what is allowed. Source: Radiance,
 * gendaymtx(1), genskyvec(1), reinhart.cal. */
lam_status sky_matrix_read(const char *path, const char *tiles, const progress *steps, sky_matrix *out,
                           lam_error *error);

#endif
