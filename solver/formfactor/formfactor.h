/* Form factors as sparse rows, repaired so that they keep reciprocity and their row sums. */
#ifndef LAMBERT_FORMFACTOR_FORMFACTOR_H
#define LAMBERT_FORMFACTOR_FORMFACTOR_H

#include "solver/formfactor/recipe.h"
#include "solver/formfactor/scratch.h"
#include "solver/formfactor/sky_bounce.h"
#include "solver/linalg/csr.h"
#include "solver/scene/mesh.h"

/* What was skipped and what was done, in pairs. */
typedef struct pairs_report {
    double facing;  /* each other, and near enough */
    double certain; /* of those: nothing is between their clusters */
    double settled; /* so small that a first look says enough */
    double open;    /* no segment was blocked; hidden: every one was; mixed: some were, or a neighbour's */
    double hidden, mixed;
    double accuracy; /* that mixed pairs were found to: asked for, or what their number allowed */
} pairs_report;

/* Above this many elements a store keeps A_i F_ij for j > i in place of rows: half of it. */
enum { FORM_FACTORS_ROWS_MOST = 10240 };

/* Either F or upper is there; the other one is zero. */
typedef struct form_factors {
    csr F;            /* rows F[i][.], mesh order */
    csr upper;        /* A_i F_ij for j > i, m^2, in place of F */
    double *row_sums; /* [n], of F after repair, <= 1 */
    double *leaving;  /* [n], share of an element's rays that left the scene */
    double *absorbed; /* [n], share that hit a back face */
    double *repair; /* [n], by how much a row and what goes outside summed to more than 1 before repair; NULL
                       of a mean, or where a store has none */
    sky_bounce sky; /* where one was asked for, else zero */
    recipe recipe;
    size_t rows_kept;     /* of rows, when just made: that were in the scratch folder */
    pairs_report pairs;   /* where just made of pairs */
    bool closed;          /* nothing leaves but through cracks between elements */
    double leaving_share; /* area-weighted means */
    double absorbed_share;
    double closure_error;           /* largest |row sum - its target| after repair */
    double reciprocity_error;       /* largest |A_i F_ij - A_j F_ji| / max of both */
    double repair_mean, repair_max; /* of |repair|, by area */
    size_t repair_products;         /* with the matrix, until all rows were right; when just made */
} form_factors;

typedef struct form_factor_options {
    recipe recipe;
    const progress *progress;
    const char *stage;        /* what progress calls it */
    bool upper;               /* leave the upper triangle, without the rows it stands for */
    scratch *scratch;         /* where rows are kept as they are found; NULL: in memory only */
    const char *scratch_name; /* of the file there, one for each sample */
    const large_place *large; /* where the result lies if it is of rays or a hemicube; NULL: in memory */
    const char *sky;          /* a tiling that what leaves is binned by, at no further ray; NULL: none */
    double ground_albedo;
    sky_bounce *bounce; /* form_factors_make's own: where the rays put what leaves */
    size_t only_first;  /* of rays_count and hemicube_trace: rows of so many of the order alone, the others
                           stay empty; not with a scratch folder; 0: all */
} form_factor_options;

/* Finds the form factors by a recipe, merges the two estimates of each pair by reciprocity and repairs the
 * row sums. The result is the same for any number of threads. order is [n] (mesh_z_order): the sequence in
 * which elements are worked on, for locality only.
 *
 * rays: counts rays (Embree) from every element. Cost: n * rays rays; 8 bytes of memory for each entry of the
 *   rows, half of that for the upper triangle.
 * hemicube: the same by hemicubes around every element's centroid: no sampling noise, but aliasing. Cost:
 *   3 n resolution^2 rays, memory likewise.
 * pairs: pair by pair, magnitudes by mathematics, by rays only what is hidden of them. What a row lacks goes
 *   outside, or, where the scene is closed, is put back by the repair. Cost: O(n^2), about .3 us a pair that
 *   is facing; 9 bytes for each of those beside the rows.
 * near-pairs: the same for pairs that rays know worst (recipe_near), the others by rays.
 *
 * With a sky, what a repaired row leaves outside is shared among its tiles, the ground and back faces as the
 * rays (of pairs: recipe.rays of them) found it: sum_j F_ij + sum_t first_bounce/pi <= 1, and = 1 where
 * nothing meets a back face and the ground's albedo is 1. Cost: 4 m n bytes.
 *
 * With a place for large arrays what is merged lies in files there, and takes about 100 MB of memory that
 * cannot be given back to the system.
 *
 * With a scratch folder a run that is stopped goes on where it was, and the result is the same.
 *
 * Errors: LAM_ERR_ARGUMENT (a recipe out of bounds, a scratch file of something else), LAM_ERR_IO (of the
 * scratch folder), LAM_ERR_MEMORY, LAM_ERR_CANCELLED, LAM_ERR_INTERNAL. */
lam_status form_factors_make(const mesh *m, const uint32_t *order, const form_factor_options *options,
                             form_factors *out, lam_error *error);

void form_factors_free(form_factors *f);

/* Turns the upper triangle into rows, in place; nothing where they are rows already. Costs as much memory
 * again. LAM_ERR_MEMORY: f is then only to be freed. */
lam_status form_factors_expand(form_factors *f, const double *area, lam_error *error);

/* The reverse, exact: expanded again, the rows have the same bits. */
lam_status form_factors_gather(form_factors *f, const double *area, lam_error *error);

/* Rays a second that all threads cast from some elements of the scene: a trial of some hundredths of a second
 * for a forecast. order as above. Errors as of form_factors_make. */
lam_status form_factors_ray_rate(const mesh *m, const uint32_t *order, double *rays_per_second,
                                 lam_error *error);

/* seen[k]: how many elements elements[k], which are all different, finds by the recipe, RECIPE_RAYS or
 * RECIPE_HEMICUBE: entries of the row as it is found, before the two estimates of a pair are merged, which is
 * how "Aguerre 2016, table 4.1" counts. The same for any number of threads. Cost: that of count rows.
 * Errors: LAM_ERR_ARGUMENT for another recipe, LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status form_factors_count_seen(const mesh *m, const recipe *how, const uint32_t *elements, size_t count,
                                   const progress *steps, const char *stage, size_t *seen, lam_error *error);

/* The mean of the rows of two independent samples of the same mesh: a reference with half the variance,
 * without a sky. */
lam_status form_factors_mean(const form_factors *a, const form_factors *b, form_factors *out,
                             lam_error *error);

/* /form_factors of a store, rows or the upper triangle, as they are; its /sky apart, by sky_bounce_save and
 * sky_bounce_load. large as above. */
lam_status form_factors_save(const form_factors *f, store *s, lam_error *error);
/* All of that but the rows, and that they are stored so. */
lam_status form_factors_save_about(const form_factors *f, const char *storage, store *s, lam_error *error);
lam_status form_factors_load(store *s, const mesh *m, const large_place *large, form_factors *out,
                             lam_error *error);

#endif
