/* The numbers of one block: the kernel cos cos' / (pi r^2) between two flat clusters, times the visible share
 * of the light, as a function that is linear on either of them. */
#ifndef LAMBERT_FORMFACTOR_BLOCKS_BLOCK_NUMBERS_H
#define LAMBERT_FORMFACTOR_BLOCKS_BLOCK_NUMBERS_H

#include "solver/formfactor/blocks/flat_clusters.h"

/* Linear in the places of both ends: V = of[0] + of[1] u_a + of[2] v_a + of[3] u_b + of[4] v_b. */
enum { SHARE_TERMS = 5 };
typedef struct visible_share {
    double of[SHARE_TERMS];
} visible_share;

/* One segment: its places on both rectangles, in [-1, 1]^2 each, 1 where it is not blocked, or what panes
 * between its ends pass, and the part of that which comes through panes. */
typedef struct seen_segment {
    double place[4], seen, through;
} seen_segment;

/* Fits the visible share to segments by least squares. */
visible_share visible_share_fit(const seen_segment *s, size_t count);

/* Sets the numbers by cubature at 2 x 2 points of each rectangle; share NULL: nothing stands between. */
void block_numbers_set(const flat_clusters *f, const visible_share *share, cluster_block *block);

/* Sets the numbers of a pair of elements from their exchange area A_i F_ij. */
void block_numbers_of_pair(const flat_clusters *f, double exchange, cluster_block *block);

/* The largest value of the kernel between two clusters, as found at corners and centres; *crosses is set
 * where one of them lies on both sides of the plane of the other, and the value is a bound then. 0: they face
 * away from each other. behind [2]: the first, the second cluster lies partly behind the plane of the other.
 * at: their corners.
 */
double block_kernel_most(const flat_clusters *f, uint32_t a, uint32_t b, const flat_pair *at, bool behind[2]);

/* A bound of the error of a kernel's approximation by `order` points an axis on either cluster, as a share of
 * its largest value: (p + 1) (r_a^-p + r_b^-p), r = z + sqrt(z^2 - 1), z the distance of a cluster's centre
 * from the other cluster over its radius (Bernstein's ellipse of Chebyshev interpolation). INFINITY where
 * they are too near. */
double block_kernel_roughness(const flat_clusters *f, uint32_t a, uint32_t b, int order);

#endif
