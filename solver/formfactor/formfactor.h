/* The interface of form factors: F[i][j], the fraction of the power leaving element i that reaches element j,
 * as sparse rows with A_i F_ij = A_j F_ji and row sums of at most 1, or more where panes let
 * light pass (glass_row_most). */
#ifndef LAMBERT_FORMFACTOR_FORMFACTOR_H
#define LAMBERT_FORMFACTOR_FORMFACTOR_H

#include "solver/formfactor/recipe.h"
#include "solver/formfactor/scratch.h"
#include "solver/formfactor/sky_bounce.h"
#include "solver/linalg/csr.h"
#include "solver/operator/blocks/block_factors.h"
#include "solver/operator/blocks/importance.h"
#include "solver/scene/facet/face_openings.h"
#include "solver/scene/mesh.h"

/* The number of pairs of elements that each step of pairs.h decided. */
typedef struct pairs_report {
    double facing;    /* face each other and are above the threshold */
    double certain;   /* of those: no element reaches into the shaft between their clusters */
    double settled;   /* so small that the occlusion test is accurate enough */
    double open;      /* no visibility segment was blocked */
    double hidden;    /* every one was */
    double projected; /* partly hidden by few occluders: their visible parts are integrated */
    double mixed;     /* some were, or a neighbouring pair came out differently: estimated by many segments */
    double accuracy; /* standard error of a mixed pair's factor of .005 (occlusion.h): as requested, or as the
                        number of segments allowed */
} pairs_report;

/* The number of blocks that each rule decided. Pairs of elements of different planes are in a block, or are
 * among elements_away or elements_hidden, by geometry, or among elements_unseen: partly hidden as far as
 * geometry says, but all their segments were blocked. */
typedef struct block_report {
    double visits, away, hidden, linear, pairs, shaded, shaded_pairs, segments;
    bool joined; /* there are blocks of clusters of several planes, as nothing hides anything */
    double even; /* blocks of clusters of several planes, and the pairs of points they were sampled at */
    double sampled;
    double sifted;          /* pieces of facets that might stand between two clusters */
    double cast;            /* segments against the whole scene */
    double lines, replaced; /* lines of pairs of elements, and the segments that they stand for */
    double reduced;         /* whose slopes were reduced so that no form factor is negative */
    double elements_away, elements_hidden, elements_unseen; /* pairs of elements */
} block_report;

/* The way of light out of a scene: by rays that leave, and by rays that meet backs. */
typedef struct scene_outlet {
    double crack_width; /* metres: a narrower gap is a crack */
    double openings;    /* share of the light that leaves through wider gaps, by a sample */
    bool fronts_only;   /* no ray meets a back but through cracks */
    bool panes_only;    /* light leaves from panes, and else through cracks; not closed then */
} scene_outlet;

/* Above this many elements a store keeps the upper triangle A_i F_ij, j > i, in place of rows: half the
 * bytes. */
enum { FORM_FACTORS_ROWS_MOST = 10240 };

/* Either F or upper holds entries; the other one is zero. */
typedef struct form_factors {
    csr F;            /* rows F[i][.], mesh order */
    csr upper;        /* A_i F_ij for j > i, m^2 */
    double *row_sums; /* [n], of F after repair, <= mesh_row_most */
    double *through;  /* [n], the part of those of blocks that comes through panes; NULL: none does */
    double *leaving;  /* [n], share of an element's rays that left the scene */
    double *absorbed; /* [n], share that hit a back face */
    double *repair;   /* [n], row sum + outside share - 1 before repair; NULL: blocks */
    sky_bounce sky;   /* zero without a sky */
    recipe recipe;
    size_t rows_kept;     /* rows that an interrupted run had left in the scratch folder */
    pairs_report pairs;   /* of recipes with pairs, when just made */
    block_report blocks;  /* of blocks, when just made */
    bool closed;          /* nothing leaves but through cracks between elements */
    size_t n_aimed;       /* openings that rays for the sky were aimed at (rays/portals.h) */
    scene_outlet outlet;  /* the rays that decided that (leaving.h) */
    double leaving_share; /* area-weighted means */
    double absorbed_share;
    double closure_error;           /* largest |row sum - its target| after repair */
    double reciprocity_error;       /* largest |A_i F_ij - A_j F_ji| / max of both */
    double repair_mean, repair_max; /* of |repair|, by area */
    size_t repair_products;         /* products with the matrix that the repair took, when just made */
} form_factors;

struct block_scene; /* blocks/blocks.h */

typedef struct form_factor_options {
    recipe recipe;
    const progress *progress;
    const char *stage;        /* the name of this stage in the progress line */
    bool upper;               /* return the upper triangle, not rows */
    scratch *scratch;         /* keeps rows as they are found; NULL: in memory only */
    const char *scratch_name; /* of the file there, one for each sample */
    const large_place *large; /* holds the result of rays or hemicubes; NULL: in memory */
    importance *importance;   /* of blocks alone, which find `of` if it is NULL; NULL: all is read */
    const char *sky;          /* a tiling: rays that leave are binned by its tiles; NULL: none */
    double ground_albedo;
    sky_bounce *bounce;            /* set by form_factors_make: the bins of the sky */
    const face_openings *openings; /* rays are aimed at these for the sky; NULL: at those of the mesh */
    size_t *n_aimed; /* set by rays_count: the number of openings that rays were aimed at; NULL: not wanted */
    double *variance;  /* [n], set by rays_count: of leaving; NULL: not wanted */
    bool without_rows; /* rays_count leaves all rows empty: only the shares that leave the scene are wanted */
    const double *row_sums;    /* [n], that rows of blocks are to have, as a store has them; NULL: those that
                                  form_factors_make_blocks finds */
    struct block_scene *ready; /* of form_factors_make_blocks: the mesh on its tree, which can only be
                                  destroyed afterwards; NULL: it makes its own */
    size_t only_first; /* rays_count and hemicube_trace find only this many rows of the order and leave the
                          others  empty; not with a scratch folder; 0: all */
} form_factor_options;

/* Finds the form factors by a recipe, merges the two estimates of each pair by reciprocity and repairs the
 * row sums. The result is the same for any number of threads. order is [n] (mesh_z_order): the sequence in
 * which elements are worked on, for locality only.
 *
 * rays: counts rays (Embree) from every element. Cost: n * rays rays; 8 bytes of memory for each entry of the
 *   rows, half of that for the upper triangle.
 * hemicube: hemicubes around every element's centroid: no sampling noise, but aliasing. Cost: 3 n
 * resolution^2 rays, memory likewise. pairs: pair by pair; the unoccluded factor is computed by quadrature,
 * the visible share by segments. The rest of a row leaves the scene, or, in a closed scene, is put back by
 * the repair. Cost: O(n^2), about .3 us for each pair that faces; 9 bytes for each of those beside the rows.
 * near-pairs: the same for the pairs of the near field (recipe_near), which rays sample worst; rays for all
 * others.
 *
 * With a sky, the share that a repaired row leaves outside is distributed over its tiles, the ground and back
 * faces as the rays found it (recipe.rays of them for pairs): sum_j F_ij + sum_t first_bounce/pi <= 1, and =
 * 1 where no ray hits a back face and the ground's albedo is 1. Cost: 4 m n bytes.
 *
 * With a place for large arrays the merged rows lie in files there, and about 100 MB of memory cannot be
 * returned to the system.
 *
 * With a scratch folder an interrupted run is continued, with the same result.
 *
 * Errors: LAM_ERR_ARGUMENT (a recipe out of bounds, a scratch file of another run), LAM_ERR_IO (of the
 * scratch folder), LAM_ERR_MEMORY, LAM_ERR_CANCELLED, LAM_ERR_INTERNAL. */
lam_status form_factors_make(const mesh *m, const uint32_t *order, const form_factor_options *options,
                             form_factors *out, lam_error *error);

/* Finds a reference by pairs (source_pairs), and the same disturbed by a sample of its own noise, at about
 * the cost of one sample (pairs_twice.h): out[0] is the mean of two samples, by the recipe's seed and another
 * one, which share the pairs that are projected. stages: names for progress. No sky and no scratch folder. */
lam_status form_factors_make_twice(const mesh *m, const uint32_t *order, const form_factor_options *options,
                                   uint64_t other_seed, const char *const stages[2], form_factors out[2],
                                   lam_error *error);

/* The tree of a mesh's elements on which blocks are found; it keeps parts of the scene apart that exchange no
 * light as far as rays show (visibility/parts.h), if its planes are large enough for blocks. Its view is
 * known where blocks may depend on it (plane_tree_look). Errors: LAM_ERR_MEMORY. */
lam_status form_factors_tree(const mesh *m, plane_tree *out, lam_error *error);

/* The same by blocks of clusters (source_blocks) on a tree of the elements with leaves of PLANE_LEAF, which
 * must outlive blocks: these hold the form factors, freed by block_factors_free, and out all but rows. In a
 * closed scene their balance gives rows the sum 1, in others it keeps sums at most 1. With a sky,
 * recipe.rays of an element find its share of each tile, and what the blocks leave of its row is distributed
 * so. judged: those that the blocks are to judge, or NULL. Visible shares of a quarter of them then come from
 * the whole scene by Embree, so that a judge sees what lists of single occluders lack, but for the proofs
 * that nothing, or one piece, stands between; that the scene is closed is taken from judged, and no ray is
 * cast for it; out has neither leaving nor absorbed, nor a sky. No scratch folder. Cost: about a microsecond
 * for each of some n^1/2 blocks, and without judged n recipe.rays rays. Errors: LAM_ERR_ARGUMENT,
 * LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status form_factors_make_blocks(const mesh *m, const uint32_t *order, const plane_tree *tree,
                                    const form_factors *judged, const form_factor_options *options,
                                    form_factors *out, block_factors *blocks, lam_error *error);

/* The part of repair_mean that is an error of the form factors and no noise of their recipe, which a judge
 * with other samples measures: the root of the difference of their squares; 0 where that is below 1e-3. O(1).
 */
double form_factors_repair_error(const form_factors *f);

void form_factors_free(form_factors *f);

/* Turns the upper triangle into rows, in place; does nothing where they are rows already. Takes the same
 * memory again. After LAM_ERR_MEMORY f can only be freed. */
lam_status form_factors_expand(form_factors *f, const double *area, lam_error *error);

/* The inverse of form_factors_expand, exact: expanded again, the rows have the same bits. */
lam_status form_factors_gather(form_factors *f, const double *area, lam_error *error);

/* Rays that all threads cast for some hundredths of a second from some elements: for a forecast. */
typedef struct ray_trial {
    double rays, seconds, processor_seconds; /* of all threads together */
} ray_trial;

/* order and errors as for form_factors_make. */
lam_status form_factors_try_rays(const mesh *m, const uint32_t *order, ray_trial *out, lam_error *error);

/* seen[k]: the number of elements that elements[k] sees by the recipe, of rays or hemicubes:
 * entries of its row before the two estimates of a pair are merged, as in Aguerre 2016, table 4.1. The
 * elements must differ. The same for any number of threads. Cost: that of count rows. Errors:
 * LAM_ERR_ARGUMENT for another recipe, LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status form_factors_count_seen(const mesh *m, const recipe *how, const uint32_t *elements, size_t count,
                                   const progress *steps, const char *stage, size_t *seen, lam_error *error);

/* The same rows themselves, out [n], of which all others are empty; freed by csr_free. Errors as above. */
lam_status form_factors_some_rows(const mesh *m, const recipe *how, const uint32_t *elements, size_t count,
                                  const progress *steps, const char *stage, csr *out, lam_error *error);

/* /form_factors of a store, rows or the upper triangle as they are; sky_bounce_save and sky_bounce_load
 * handle /sky. large as above. */
lam_status form_factors_save(const form_factors *f, store *s, lam_error *error);
lam_status form_factors_load(store *s, const mesh *m, const large_place *large, form_factors *out,
                             lam_error *error);

/* Form factors of form_factors_make_blocks: what form_factors_load gives but for the rows, and in their place
 * the blocks and their tree, which must stay where it is and outlive them. */
lam_status form_factors_save_blocks(const form_factors *f, const block_factors *blocks, store *s,
                                    lam_error *error);
lam_status form_factors_load_blocks(store *s, const mesh *m, plane_tree *tree, block_factors *blocks,
                                    form_factors *out, lam_error *error);

#endif
