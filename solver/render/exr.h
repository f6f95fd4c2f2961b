/* The OpenEXR file of linear values: the only file that knows libOpenEXRCore. */
#ifndef LAMBERT_RENDER_EXR_H
#define LAMBERT_RENDER_EXR_H

#include "solver/render/picture.h"

/* The attributes that say what the values are. */
typedef struct exr_notes {
    const char *quantity; /* "radiosity" */
    const char *unit;     /* "W/m2"; "" for none */
} exr_notes;

/* Writes the values as they are, without exposure or tone curve, beside path and renames them onto it: one
 * part of scanlines, compressed by zlib in blocks of 16. Channels: Y for one, R, G, B (primaries of Rec. 709)
 * for three, else channel0, channel1, ... (channel00 ... of more than ten), SHADE_MAX_CHANNELS at most.
 * Values are half precision, or with `single` 32-bit floats. Halves end at 65504: *clamped, which may be
 * NULL, counts the larger values, which become that. Attributes: quantity, unit, exposure (0) and software.
 * Errors: LAM_ERR_IO naming path (also for a full disk), LAM_ERR_MEMORY. */
lam_status exr_write(const picture_values *v, bool single, const exr_notes *notes, const char *path,
                     size_t *clamped, lam_error *error);

#endif
