/* Occlusion of a pair of elements or of clusters, estimated by visibility segments between points of the two:
 *     A_i F_ij ~ g sum_k K_k V_k / sum_k K_k,   K = cos cos' / (pi r^2),   V = 1 where segment k is not
 * blocked with g the unoccluded exchange area of pair_factor.h. Panes block, but in occlusion_share. Knows no
 * rows. */
#ifndef LAMBERT_FORMFACTOR_SIGHT_OCCLUSION_H
#define LAMBERT_FORMFACTOR_SIGHT_OCCLUSION_H

#include "solver/formfactor/clusters/clusters.h"
#include "solver/formfactor/exchange/pair_factor.h"
#include "solver/formfactor/sight/segment_occluders.h"
#include "solver/formfactor/visibility/visibility.h"

/* N segments estimate the visible share of a pair with a standard error of about SEGMENTS_ERROR
 * N^-SEGMENTS_POWER (tests/bench/bench_segments.c: patio, atrium and rooms, N from 8 to 8,192, within a
 * fifth). */
#define SEGMENTS_ERROR .47
#define SEGMENTS_POWER .7
/* The same of N lines (visible_lines.h): the same program and scenes, N from 8 to 1,024, within two fifths.
 */
#define LINES_ERROR .2
#define LINES_POWER .75

/* The scene and the accuracy of its occlusion tests. All of it is only read, by any number of threads. */
typedef struct occlusion {
    const visibility *v;
    const double *area;      /* [n] */
    const polygon *polygons; /* [n] */
    const pair_factor_rules *rules;
    double tolerance; /* of the unoccluded factor, relative */
    double accuracy;  /* standard error of partly occluded factors of .005, see occlusion_estimate */
    size_t segments;  /* the least that occlusion_estimate casts; a multiple of VISIBILITY_PACKET */
    uint64_t seed;
    const segment_occluder *occluders; /* of the lists; NULL: no pair has one */
    const mesh *glass;                 /* whose panes let light of occlusion_share pass; NULL: none does */
} occlusion;

typedef enum occlusion_verdict { OCCLUSION_NONE, OCCLUSION_TOTAL, OCCLUSION_PARTIAL } occlusion_verdict;

/* The occlusion test of the pair i, j whose unoccluded exchange area is g > 0: eight segments, up to 256 for
 * a large factor, until one is blocked and one is not. seen is the estimate of the visible part of g. among:
 * all occluders, but for those in the planes of the two, that may block a segment of the pair; NULL: any of
 * the scene may. */
occlusion_verdict occlusion_test(const occlusion *o, segment_list *among, uint32_t i, uint32_t j, double g,
                                 double *seen);

/* True where the standard error of eight segments is o->accuracy at most, because the factor is small: seen
 * is then final. */
bool occlusion_test_suffices(const occlusion *o, uint32_t i, uint32_t j, double g);

/* The visible part of g, never more than g, by N segments. They are shared among pairs as answers need them:
 * with V known, errors of answers to single elements and to lamps are least, for so many segments of all
 * pairs together, where N grows like the .83th power of a pair's weight. F, the larger of F_ij and F_ji,
 * stands for it: N = (SEGMENTS_ERROR F0 / accuracy)^(1 / SEGMENTS_POWER) (F / F0) (A_small / A_large)^(1/8),
 * F0 = .005 so that the standard error of the factor F0 is accuracy, and that of another (F / F0)^.3 times
 * it. From .03 to .1 N ~ F^2 comes back to accuracy, and a visible factor F V above .1 has 10 F V times that.
 * among: all occluders that may block a segment of the pair; NULL: any of the scene may. */
double occlusion_estimate(const occlusion *o, segment_list *among, uint32_t i, uint32_t j, double g);

/* The same by at least so many segments. */
double occlusion_estimate_by(const occlusion *o, segment_list *among, uint32_t i, uint32_t j, double g,
                             double segments);

/* About how many segments occlusion_estimate will cast. */
double occlusion_segments(const occlusion *o, uint32_t i, uint32_t j, double g);

/* The accuracy of a share, and the segments or lines that it took. */
typedef struct share_effort {
    double error;                     /* standard error, about; segments are 16 to 1,024, lines 8 to 512 */
    size_t segments, lines, replaced; /* replaced: the segments that the lines stand for */
    double through;                   /* the part of the share that comes through panes */
} share_effort;

/* The visible share of elements i and j with the polygons a and b: sum K V / sum K over segments or lines
 * that lie in front of both. 1 where none does. among: all occluders that may block one of them, none of them
 * in the plane of either element; NULL: any of the scene may, and segments are cast. */
double occlusion_share(const occlusion *o, segment_list *among, uint32_t i, const polygon *a, uint32_t j,
                       const polygon *b, share_effort *effort);

/* True where all of 128 to 1,024 segments between two clusters are blocked: as many as the largest factor
 * from a point of one to the other asks for, so that the visible part is about o->accuracy at most. False for
 * factors that would ask for more. */
bool occlusion_is_total(const occlusion *o, const cluster_tree *t, const cluster *a, const cluster *b,
                        double factor);

#endif
