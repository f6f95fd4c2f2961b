/* Form factors by blocks of clusters of elements. */
#include "solver/formfactor/blocks/blocks.h"
#include "solver/formfactor/blocks/blocks_importance.h"
#include "solver/formfactor/blocks/blocks_sample.h"
#include "solver/formfactor/source.h"

#include <math.h>
#include <stdio.h>

static void describe(const recipe *r, char text[64]) {
    snprintf(text, 64, "blocks of clusters to %.2g", r->accuracy);
}

static void option(const recipe *r, char text[40]) {
    (void)r;
    snprintf(text, 40, "blocks");
}

/* Blocks have few terms, and are biased: repairs are 6e-6 to .006 in the ten generated scenes. The judge
 * makes finer blocks. */
static double repair(const recipe *r) {
    (void)r;
    return .02;
}

/* Errors fall as the square root of the accuracy, or faster. The judge has no sky. */
static recipe judge(const recipe *r, size_t rays) {
    static const double judge_share = .5;
    recipe finer = *r;
    (void)rays;
    if (finer.rays > RAYS_BESIDE_PAIRS) finer.rays = RAYS_BESIDE_PAIRS;
    finer.accuracy *= judge_share;
    return finer;
}

/* Blocks in rooms of large planes: measured 7.6e5 (a Cornell box of 10,249 elements) and 2.0e6 (of 163,687)
 * at an accuracy of 3e-4, 3.3e5 and 9.3e5 at 1e-3; 6.1e6 (of 2,620,549) at 4e-4. */
static double blocks_of(double n, const recipe *r) {
    return fmin(7.6e5 * pow(n / 1e4, .4) * pow(r->accuracy / 3e-4, -.7), n * n / 2);
}

/* A block with its places in both orders, and the nodes of its trees per element. */
static double bytes(double n, const recipe *r) {
    static const double block_bytes = 100, element_bytes = 400;
    return element_bytes * n + block_bytes * blocks_of(n, r);
}

static double packed_bytes(double n, const recipe *r) {
    return rows_packed_bytes(n, (double)r->rays, false); /* of the rays that find the share which leaves */
}

static double making_bytes(double n, const recipe *r, factor_place place) {
    (void)place;
    return bytes(n, r);
}

/* A stored block and its share of the tree: measured 19 bytes (a Cornell box of 10,249 elements), 24 (of
 * 40,978) and 28 (of 163,687). */
static double stored_bytes(double n, const recipe *r) {
    return 32 * blocks_of(n, r);
}

/* A block is found, sorted and balanced. */
static double seconds(double n, const recipe *r, double entries, double ray_seconds, double slowness) {
    static const double block_seconds = 1.2e-6;
    (void)entries, (void)ray_seconds;
    return blocks_of(n, r) * block_seconds * slowness;
}

static lam_status sample(const factor_work *w, const recipe *r, factor_cost *out, lam_error *error) {
    lam_status status = LAM_OK;
    importance *const read = w->importance->n > 0 ? w->importance : NULL;
    block_options coarse = block_options_of(r);
    coarse.progress = w->progress;
    if (*w->ready == NULL) TRY(block_scene_make(w->m, w->tree, w->ready, error));
    if (read != NULL)
        TRY(blocks_importance(w->m, block_scene_visibility(*w->ready), w->tree, &coarse, read, error));
    TRY(blocks_forecast(*w->ready, r, read, w->progress, out, error));
done:
    return status;
}

static bool less(recipe *r) {
    (void)r;
    return false;
}

static void finer(recipe *r, double error, double wanted, const factor_knobs *knobs) {
    static const double power_of_accuracy = .5;
    if (knobs->accuracy) r->accuracy *= source_turn(error, wanted, power_of_accuracy);
}

static void advise(const recipe *r, double error, double most, bool finest, char option_text[64]) {
    (void)r, (void)error, (void)most, (void)finest;
    snprintf(option_text, 64, "--form-factors rays");
}

const factor_source source_blocks = {
    .name = "blocks",
    .flags = SOURCE_BLOCKS | SOURCE_ACCURACY | SOURCE_BY_EPSILON | SOURCE_ASKED,
    .describe = describe,
    .option = option,
    .repair = repair,
    .judge = judge,
    .rays = source_rays_given,
    .blocks = blocks_of,
    .bytes = bytes,
    .packed_bytes = packed_bytes,
    .making_bytes = making_bytes,
    .stored_bytes = stored_bytes,
    .seconds = seconds,
    .sample = sample,
    .less = less,
    .finer = finer,
    .advise = advise,
};
