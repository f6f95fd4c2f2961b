/* A moving light from a file: its polygon, its emission, and the positions it takes, listed or along a path.
 * The file is JSON:
 *     {"light": {"polygon": [[x, y, z], ...], "emission": 10 or [r, g, b] or "800lm"},
 *      "positions": [{"name": "door", "move": [x, y, z], "turn": {"axis": [x, y, z], "degrees": d}}, ...]}
 * A position turns the polygon about the origin of its coordinates and then moves it; either may be left out,
 * a name too (then it is pose-0, pose-1, ...). With "path" in place of "positions" these are points that the
 * light passes, in order, and "closed": true brings it back to the first. The emission is an exitance in the
 * unit of the store, or a text of one or three numbers and a unit, of which a flux is that of the whole
 * polygon. */
#ifndef LAMBERT_LIGHT_LIGHT_PATH_H
#define LAMBERT_LIGHT_LIGHT_PATH_H

#include "solver/base/photometry.h"
#include "solver/walk/moving_light.h"

/* Positions of a light at most. */
enum { LIGHT_POSITIONS_MOST = 65536 };

typedef struct light_path_request {
    const char *path;  /* of the file */
    size_t frames;     /* 0: it lists positions; else the number of positions along its path, at least 2 */
    double unit;       /* metres of a unit of the file's coordinates */
    light_kind lights; /* that the emission becomes */
} light_path_request;

/* Reads the light; the caller frees it with moving_light_free. *coloured: the channels of its emission
 * differ; *converted: it was given in light of the other kind. Frames divide the length of a Catmull-Rom
 * curve through the points of the path evenly, from the first point to the last, or once around; turns
 * between two points are about one axis (slerp). Errors: LAM_ERR_IO, LAM_ERR_FORMAT (no JSON, line and
 * column), LAM_ERR_ARGUMENT name the file, the position and the value; LAM_ERR_MEMORY. */
lam_status light_path_read(const light_path_request *request, moving_light *out, bool *coloured,
                           bool *converted, lam_error *error);

#endif
