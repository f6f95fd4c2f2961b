/* The intensities of a luminaire as a picture and as a table. */
#ifndef LAMBERT_LUMINAIRE_POLAR_CURVES_H
#define LAMBERT_LUMINAIRE_POLAR_CURVES_H

#include "solver/luminaire/luminaire.h"

#include <stdio.h>

/* An SVG of the curves C0-C180 and C90-C270, of one where they are the same; gamma 0 is at the bottom. title
 * is any UTF-8. A failed write is seen by ferror(stream). */
lam_status polar_curves_svg(const luminaire *l, const char *title, FILE *stream, lam_error *error);

/* A CSV of a row for each gamma and a column for each plane of the whole turn, cd: those of the table, with
 * their mirrors, of type C; every 2.5 and 15 degrees of other types. */
lam_status polar_curves_csv(const luminaire *l, FILE *stream, lam_error *error);

#endif
