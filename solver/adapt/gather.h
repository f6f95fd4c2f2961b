/* Final gathering: the irradiance at points of a scene from an answer that is constant on elements,
 *     H(x) = integral of B(y) V(x, y) cos cos' / (pi r^2) dA(y),
 * by cosine-weighted rays and, for lamps, by samples on them too, joined by the balance heuristic (Veach and
 * Guibas 1995). Unbiased for that answer. Immutable once created: any number of threads may gather. Must not
 * know operators. */
#ifndef LAMBERT_ADAPT_GATHER_H
#define LAMBERT_ADAPT_GATHER_H

#include "solver/daylight/sky_tiles.h"
#include "solver/scene/mesh.h"

/* Samples of a half of an estimate: rays, and places on lamps. */
enum { GATHER_HALVES = 2, GATHER_RAYS = 64, GATHER_LAMP_SAMPLES = 32 };

/* At most so many lights, and channels of all of them. */
enum { GATHER_VALUES_MOST = 9 };

typedef struct gather gather;

/* Skies, one of each light: L [n_lights][n_tiles + 1] are radiances, the same in all channels, of the tiles
 * and, last, of the ground below the horizon. */
typedef struct gather_sky {
    const sky_tiling *tiling;
    const double *L;
} gather_sky;

/* Light that comes to points directly from sources that are no elements, such as luminaires: add adds the
 * irradiance of points with one normal to E [n_points][GATHER_HALVES][stride], in whose first channels it is,
 * by samples that the key chooses for all points; the halves are independent. Called by any thread. */
typedef struct gather_direct {
    void (*add)(const void *context, const double normal[3], uint64_t key, size_t n_points,
                const double (*points)[3], size_t stride, double *E);
    const void *context;
} gather_direct;

/* The answers that are gathered from: B [n_lights][C][n]. lamps [C][n], or NULL, is the part of the first
 * light that lamps emit, which GATHER_LAMP_SAMPLES samples look for. Rays that leave the scene bring light of
 * a sky, or none where it is NULL; direct light, unless NULL, is added to the first light. All of these must
 * outlive what is made. Errors: LAM_ERR_ARGUMENT, LAM_ERR_MEMORY, LAM_ERR_INTERNAL. */
lam_status gather_create(const mesh *m, size_t n_lights, const float *B, const float *lamps,
                         const gather_sky *sky, const gather_direct *direct, gather **out, lam_error *error);
void gather_free(gather *g);

size_t gather_values(const gather *g); /* n_lights C */

/* H [n_points][GATHER_HALVES][n_lights C] at points of the plane of an element. The halves are independent.
 * All points share the directions of rays and the places on lamps, which the key chooses, so that differences
 * between near points have little noise. Lamps have samples as they light the points (lamp_groups.h). Cost:
 * for each point 128 rays and at most 64 segments, and once lamp_groups_share. */
void gather_at(const gather *g, uint32_t element, uint64_t key, size_t n_points, const double (*points)[3],
               double *H);

/* hit [n_points][GATHER_HALVES][GATHER_RAYS]: the elements whose fronts the same rays meet,
 * VISIBILITY_NOTHING where there is none. */
void gather_hits(const gather *g, uint32_t element, uint64_t key, size_t n_points, const double (*points)[3],
                 uint32_t *hit);

/* Points of an element at (u, w) of the unit square; the map preserves area. */
void gather_place(const gather *g, uint32_t element, size_t n, const float (*uw)[2], double (*points)[3]);

/* One random point in each quarter of an element. The mean square of what a function is there, about the mean
 * of the four, lacks the variance of that mean, which for a function that is linear over a square is a 16th
 * of the whole: its variance is GATHER_QUARTERS_LACK times as much. */
enum { GATHER_QUARTERS = 4 };
#define GATHER_QUARTERS_LACK (16. / 15)
void gather_quarters(const gather *g, uint32_t element, uint64_t key, double points[GATHER_QUARTERS][3]);

#endif
