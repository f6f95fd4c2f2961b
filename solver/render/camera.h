/* A pinhole camera in scene coordinates, and the automatic choice of a view. */
#ifndef LAMBERT_RENDER_CAMERA_H
#define LAMBERT_RENDER_CAMERA_H

#include "solver/formfactor/visibility/visibility.h"

#define CAMERA_DEFAULT_FOV 40.0

typedef struct camera {
    double eye[3];
    double forward[3], right[3], up[3]; /* orthonormal; right x up points back at the viewer */
    double tan_x, tan_y;                /* half the width and height of the picture at distance 1 */
} camera;

/* A camera at eye that faces target; fov is its vertical angle in degrees, aspect width over height, up the
 * axis ('x', 'y', 'z') that stays upright. LAM_ERR_ARGUMENT: eye at the target, fov not within 1 to 170. */
lam_status camera_look(const double eye[3], const double target[3], double fov, double aspect, char up,
                       camera *c, lam_error *error);

/* A camera with a direction and an up vector of its own, unit vectors at right angles, such as one of a
 * scene. LAM_ERR_ARGUMENT: fov not within 1 to 170. */
lam_status camera_place(const double eye[3], const double direction[3], const double up[3], double fov,
                        double aspect, camera *c, lam_error *error);

/* The direction (forward component 1) through a point of the picture; x and y run from 0 to 1, right and
 * down. */
void camera_direction(const camera *c, double x, double y, double direction[3]);

/* Chooses a camera that fills the picture with fronts of elements, preferably lit ones (lit[n]). The camera
 * stands outside, with back faces culled; where lit fronts are not visible from outside, it stands inside the
 * scene. */
lam_status camera_choose(const mesh *m, const visibility *v, const bool *lit, double aspect, camera *c,
                         lam_error *error);

#endif
