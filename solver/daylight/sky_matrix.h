/* Sky matrices of Radiance: the radiance of patches of sky over hours, as gendaymtx and genskyvec write them.
 * Knows neither weather nor where the sun stands. */
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

/* Whether the name ends in .mtx or .smx. */
bool sky_matrix_is_named(const char *path);

/* Reads a matrix. Its first line is #?RADIANCE; its header, up to an empty line, tells NROWS, NCOLS, NCOMP (1
 * or 3), FORMAT (ascii, float or double) and, where it is 1, BigEndian. Numbers follow row by row. Row 0 is
 * the ground, which is checked and left out: a store has one of its own. The others are patches from the
 * horizon up, from north by east, those of a sky of 145 tiles (146 rows) or of Reinhart's (144 MF^2 + 2);
 * each finds its tile by its direction. tiles, which may be NULL, must be that tiling.
 * Errors: LAM_ERR_IO, LAM_ERR_MEMORY, LAM_ERR_CANCELLED, LAM_ERR_FORMAT: the file, the place, the value, what
 * is allowed. Source: Radiance, gendaymtx(1), genskyvec(1), reinhart.cal. */
lam_status sky_matrix_read(const char *path, const char *tiles, const progress *steps, sky_matrix *out,
                           lam_error *error);

#endif
