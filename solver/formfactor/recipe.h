/* The parameters that determine form factors: the same recipe on the same mesh gives the same bits. */
#ifndef LAMBERT_FORMFACTOR_RECIPE_H
#define LAMBERT_FORMFACTOR_RECIPE_H

#include "store/status.h"
#include "store/store.h"

struct factor_source; /* source.h */

/* Decides whether light leaves a scene: the rays (leaving.h), or the user. */
typedef enum scene_closure { CLOSURE_MEASURED, CLOSURE_CLOSED, CLOSURE_OPEN } scene_closure;

typedef struct recipe {
    const struct factor_source *source; /* NULL: rays */
    size_t rays; /* from every element; for pairs and blocks they only find the share that leaves the scene */
    size_t resolution; /* of a hemicube: pixels along its top, even; else 0 */
    double accuracy; /* of (near) pairs: standard error of a partly occluded factor of .005 (occlusion.h); of
                        blocks: bound of the error of one in S, 2-norm; else 0 */
    uint64_t seed;   /* of all samples */
    scene_closure closure;
} recipe;

enum { RECIPE_RAYS_MOST = 1 << 24, HEMICUBE_RESOLUTION_LEAST = 4, HEMICUBE_RESOLUTION_MOST = 4096 };

/* Rays beside pairs without a sky: they only find whether the scene is closed and has turned faces. */
enum { RAYS_BESIDE_PAIRS = 256 };

/* "rays", "hemicube", "pairs", "near-pairs", "blocks" */
const char *recipe_name(const recipe *r);

/* LAM_ERR_ARGUMENT for a value out of bounds, naming the option. */
lam_status recipe_check(const recipe *r, lam_error *error);

/* "4096 rays per element": for a log. */
void recipe_describe(const recipe *r, char text[64]);

/* The names of a recipe's attributes in a group; rays, resolution and accuracy are called the same in each.
 */
typedef struct recipe_names {
    const char *group, *method, *seed;
} recipe_names;
extern const recipe_names recipe_of_form_factors, recipe_of_operator;

lam_status recipe_save(const recipe *r, const recipe_names *names, store *s, lam_error *error);

/* LAM_ERR_FORMAT when it is missing or out of bounds. */
lam_status recipe_load(store *s, const recipe_names *names, recipe *out, lam_error *error);

/* The closure alone, of a group that may have nothing else of a recipe: CLOSURE_MEASURED without an
 * attribute. */
lam_status recipe_save_closure(scene_closure closure, const char *group, store *s, lam_error *error);
lam_status recipe_load_closure(store *s, const char *group, scene_closure *out, lam_error *error);

/* The relative tolerance of the unoccluded factors of pairs. */
double recipe_tolerance(const recipe *r);

/* The threshold of the near field: 1/rays. A pair is near where the mean of its unoccluded factors,
 * 2 A_i F_ij / (A_i + A_j), is above it, so that about one ray of an element hits the other. The sampling
 * noise of rays in S = A^1/2 F A^-1/2 has the variance mean / (2 rays). The mean, not the larger factor,
 * keeps a large element from being near to all the small ones that see it. */
double recipe_near(const recipe *r);

/* The bound of the 2-norm of a partly hidden block: its shadow is resolved down to this. */
double recipe_shadow(const recipe *r);

/* Rays beside the blocks of n elements: they only find whether the scene is closed and has turned faces. */
size_t recipe_rays_beside_blocks(size_t n);

/* The standard error of the factor of a partly occluded pair: accuracy, and for near pairs at least half of
 * 1/rays. An element has about ten of those, so that their variance is some hundredths of that of its rays.
 */
double recipe_accuracy(const recipe *r);

/* The factor, 1 or more, by which all pairs are coarser than their quality where the operator leaves out what
 * is below epsilon: as its root, from .0031 on. Their error adds .03 of the operator's for single elements at
 * epsilon .05, .08 at .0125, for .6 and .75 of the time (an atrium, a patio and an anechoic room of 1,500 to
 * 2,030 elements). */
double recipe_coarser(double epsilon);

/* Rays per element, a power of two, whose sampling noise, sqrt(2/rays) in the 2-norm of the merged S, is at
 * most share times epsilon, the bound of a factorization. */
size_t recipe_auto_rays(double epsilon, double share);

/* About the 2-norm of the sampling noise in S; 0 where it is unknown or negligible. */
double recipe_noise(const recipe *r);

/* The recipe of the independent sample that another one is judged by: the same with another seed, which also
 * moves the points of the cubature of projected pairs (projection.h). For hemicubes, which would only repeat
 * themselves, it is rays; for pairs and blocks it omits the rays that only a sky needs; of blocks it asks for
 * half of the error; of rays it is one of two, of half the rays each. */
recipe recipe_of_judge(const recipe *judged, size_t rays_beside_hemicubes, uint64_t seed);

#endif
