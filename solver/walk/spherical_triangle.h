/* Spherical triangles: their solid angles, and directions that are uniform in them. */
#ifndef LAMBERT_WALK_SPHERICAL_TRIANGLE_H
#define LAMBERT_WALK_SPHERICAL_TRIANGLE_H

typedef struct spherical_triangle {
    double a[3], b[3], c[3];                   /* unit */
    double solid_angle;                        /* 0: none, or too thin to choose from */
    double alpha, cos_alpha, sin_alpha, cos_c; /* the angle at a, and the side from a to b */
} spherical_triangle;

/* The triangle of directions from y to three points, none of which is y. */
void spherical_triangle_set(const double y[3], const double p[3], const double q[3], const double r[3],
                            spherical_triangle *out);

/* The direction at (u, w) in [0, 1)^2, uniform in solid angle (Arvo 1995, Stratified sampling of spherical
 * triangles). */
void spherical_triangle_direction(const spherical_triangle *t, double u, double w, double out[3]);

#endif
