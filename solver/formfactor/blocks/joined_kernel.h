/* The kernel cos cos' / (pi r^2) between clusters of several planes that nothing hides from each other: all
 * of it, or a sample, for blocks of one number. */
#ifndef LAMBERT_FORMFACTOR_BLOCKS_JOINED_KERNEL_H
#define LAMBERT_FORMFACTOR_BLOCKS_JOINED_KERNEL_H

#include "solver/formfactor/blocks/flat_clusters.h"
#include "solver/formfactor/exchange/pair_factor.h"

/* Pairs of elements that are all taken, and pairs of points that each of the two is sampled at else. */
enum { JOINED_PAIRS = 64, JOINED_SAMPLES = 16 };

typedef struct joined_element {
    double centre[3], normal[3], area; /* centre: its centroid */
} joined_element;

/* The scene that the kernel is taken of; elements [n] by position. */
typedef struct joined_kernel {
    const flat_clusters *f;
    const joined_element *elements;
    const pair_factor_rules *rules;
    double exact; /* relative tolerance of pairs of elements that are near */
    uint64_t seed;
} joined_kernel;

/* out [n], by position. */
void joined_elements_set(const flat_clusters *f, joined_element *out);

/* True where two nodes have so few elements that all pairs are taken. */
bool joined_kernel_takes_all(const joined_kernel *k, uint32_t a, uint32_t b);

/* The standard deviation of the kernel over the centroids of elements of a and b, by area, as a share of its
 * mean; INFINITY where that is 0. A block of the mean is off by this share of its norm. */
double joined_kernel_spread(const joined_kernel *k, uint32_t a, uint32_t b);

/* The mean of the kernel over a and b, 1/m^2: of all pairs, near ones exactly, or from points that are
 * uniform by area. These are others than those of the spread: a mean of the same points would be too small
 * where it is accepted, as samples that miss the largest values have both a small mean and a small spread.
 * Either depends on (seed, a, b) alone. */
double joined_kernel_mean(const joined_kernel *k, uint32_t a, uint32_t b);

#endif
