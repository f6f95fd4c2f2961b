/* The nine real spherical harmonics up to order 2, with the constants, the signs and the order of three.js
 * and Godot: 1, y, z, x, xy, yz, 3 z^2 - 1, xz, x^2 - y^2 times .282095, .488603 (three), 1.092548 (two),
 * .315392, 1.092548 and .546274: over the sphere the integral of each squared is 1, and of the product of two
 * 0. Must not know of scenes. */
#ifndef LAMBERT_BASE_HARMONICS_H
#define LAMBERT_BASE_HARMONICS_H

enum { HARMONICS = 9 };

/* Y in a direction, a unit vector. */
void harmonics_at(const double direction[3], double Y[HARMONICS]);

/* A vector in the axes x = look, y = axis x look and z = axis, unit vectors. */
void harmonics_turn(const double axis[3], const double look[3], const double v[3], double out[3]);

/* The integrals of Y over the directions of a polygon in front of the origin: n corners, counter-clockwise as
 * the origin sees them, of which none lies at the origin and no edge passes through it. solid_angle: the
 * integral of 1. Cost: an arctangent for each corner. Source: Arvo 1995, "Applications of irradiance tensors
 * to the simulation of non-Lambertian phenomena". */
void harmonics_of_polygon(int n, const double (*corner)[3], double solid_angle, double out[HARMONICS]);

#endif
