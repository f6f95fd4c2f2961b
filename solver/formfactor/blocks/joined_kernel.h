/* The kernel cos cos' / (pi r^2) between clusters of several planes that nothing hides from each other: a
 * sample of it, for blocks of one number. */
#ifndef LAMBERT_FORMFACTOR_BLOCKS_JOINED_KERNEL_H
#define LAMBERT_FORMFACTOR_BLOCKS_JOINED_KERNEL_H

#include "solver/formfactor/blocks/flat_clusters.h"

/* Pairs of points that each of the two is sampled at. */
enum { JOINED_SAMPLES = 16 };

/* The standard deviation of the kernel over the centroids of elements of a and b, drawn by area, as a share
 * of its mean; INFINITY where that is 0. A block of the mean is off by this share of its norm. */
double joined_kernel_spread(const flat_clusters *f, uint64_t seed, uint32_t a, uint32_t b);

/* The mean of the kernel over a and b, 1/m^2, from points that are uniform by area. They are others than
 * those of the spread: a mean of the same points would be too small where it is accepted, as samples that
 * miss the largest values have both a small mean and a small spread. Either depends on (seed, a, b) alone. */
double joined_kernel_mean(const flat_clusters *f, uint64_t seed, uint32_t a, uint32_t b);

#endif
