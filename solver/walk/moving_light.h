/* A light that moves: a plane polygon that is no part of a mesh, and the poses it takes. Every point of it
 * emits alike, from its front alone, and it neither blocks nor reflects. */
#ifndef LAMBERT_WALK_MOVING_LIGHT_H
#define LAMBERT_WALK_MOVING_LIGHT_H

#include "store/status.h"

enum { MOVING_LIGHT_CHANNELS = 3 };

/* A point x of the polygon is at turn x + move, in metres; turn is a rotation. */
typedef struct light_pose {
    char *name;
    double turn[3][3], move[3];
} light_pose;

typedef struct moving_light {
    size_t n_corners;
    double (
        *corner)[3]; /* [n_corners], plane, all seen from the first, counter-clockwise seen from the front */
    double normal[3], area;
    double *share; /* [n_corners - 2]: the part of the area up to each triangle of the fan */
    size_t n;
    light_pose *pose;                       /* [n] */
    double emission[MOVING_LIGHT_CHANNELS]; /* W/m2 or lm/m2 of each channel of the scene */
} moving_light;

/* Takes corners over; poses and emission are the caller's to add. Errors: LAM_ERR_ARGUMENT (fewer than three
 * corners, no area, not plane to a thousandth of its size, not all seen from the first), LAM_ERR_MEMORY. */
lam_status moving_light_create(size_t n_corners, double (*corner)[3], moving_light *out, lam_error *error);
void moving_light_free(moving_light *l);

/* The point of the polygon, before any pose, at (u, w) in [0, 1)^2; uniform over its area. */
void moving_light_point(const moving_light *l, double u, double w, double point[3]);

/* The same point, or with `turned` alone the same direction, as a pose carries it. */
void light_pose_point(const light_pose *p, const double x[3], double out[3]);
void light_pose_direction(const light_pose *p, const double x[3], double out[3]);

#endif
