/* How form factors are found: all that it takes to find the same ones again. */
#ifndef LAMBERT_FORMFACTOR_RECIPE_H
#define LAMBERT_FORMFACTOR_RECIPE_H

#include "store/status.h"
#include "store/store.h"

typedef enum recipe_method { RECIPE_RAYS, RECIPE_HEMICUBE, RECIPE_PAIRS, RECIPE_NEAR_PAIRS } recipe_method;

typedef struct recipe {
    recipe_method method;
    size_t rays;       /* from every element; of pairs: those that only find what leaves the scene */
    size_t resolution; /* of a hemicube: pixels along its top, even; else 0 */
    double accuracy;   /* of (near) pairs: standard error of a factor that is partly hidden; else 0 */
    uint64_t seed;     /* of all that is sampled */
} recipe;

enum { RECIPE_RAYS_MOST = 1 << 24, RECIPE_RESOLUTION_LEAST = 4, RECIPE_RESOLUTION_MOST = 4096 };

/* Rays beside pairs that only ask whether a scene is closed and whether its faces are turned. */
enum { RECIPE_RAYS_FEW = 256 };

/* "rays", "hemicube", "pairs", "near-pairs" */
const char *recipe_name(recipe_method method);

/* LAM_ERR_ARGUMENT for what is out of bounds, naming the option. */
lam_status recipe_check(const recipe *r, lam_error *error);

/* "4096 rays an element": for a log. */
void recipe_describe(const recipe *r, char text[64]);

/* The attributes of one group that hold a recipe; resolution and accuracy only where the method has one. */
typedef struct recipe_names {
    const char *group, *method, *seed;
} recipe_names;
extern const recipe_names recipe_of_form_factors, recipe_of_operator;

lam_status recipe_save(const recipe *r, const recipe_names *names, store *s, lam_error *error);

/* LAM_ERR_FORMAT when it is missing or out of bounds. */
lam_status recipe_load(store *s, const recipe_names *names, recipe *out, lam_error *error);

/* Relative tolerance of unoccluded factors of pairs. */
double recipe_tolerance(const recipe *r);

/* Pairs are near when the mean of their unoccluded factors, F_ij and F_ji weighted by A_i and A_j, is above
 * this: when a ray of an element would hit the other. What rays leave of S = A^1/2 F A^-1/2 has the variance
 * mean / (2 rays), so that a large element is not near to all the small ones that see it. At 10,000 elements
 * four times that pays as well, a lower one would not. */
double recipe_near(const recipe *r);

/* What partly hidden pairs are found to: accuracy, of near ones not finer than half a ray's share. An element
 * has ten or so; their variance is then some hundredths of that of the rays. */
double recipe_accuracy(const recipe *r);

/* Rays per element for a factorization bound epsilon: the sampling noise of a merged F has a 2-norm of about
 * sqrt(2/rays); share is what part of epsilon it may be. A power of two. */
size_t recipe_auto_rays(double epsilon, double share);

/* The 2-norm of the sampling error of S, about; 0 where it is not known or negligible. */
double recipe_noise(const recipe *r);

/* The recipe of an independent sample that another one is judged by: its like with another seed; of rays
 * beside hemicubes, which would only repeat themselves; of pairs without the rays that only a sky needs. */
recipe recipe_of_judge(const recipe *judged, size_t rays_beside_hemicubes, uint64_t seed);

#endif
