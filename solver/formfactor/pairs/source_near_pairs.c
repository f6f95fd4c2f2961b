/* Form factors pair by pair in the near field, which rays sample worst, and by rays elsewhere. */
#include "solver/formfactor/closing.h"
#include "solver/formfactor/pairs/pairs.h"
#include "solver/formfactor/pairs/pairs_sample.h"
#include "solver/formfactor/rays/rays.h"
#include "solver/formfactor/rays/rays_cost.h"
#include "solver/formfactor/source.h"

#include <math.h>
#include <stdio.h>

static double accuracy(const recipe *r) {
    return fmax(r->accuracy, .5 * recipe_near(r));
}

static void describe(const recipe *r, char text[64]) {
    snprintf(text, 64, "near pairs to %.2g, %zu rays per element", accuracy(r), r->rays);
}

static void option(const recipe *r, char text[40]) {
    (void)r;
    snprintf(text, 40, "near-pairs");
}

/* Near pairs are as many as rays at most, and stand in a triangle of their own. */
static double making_bytes(double n, const recipe *r, factor_place place) {
    const double near = rays_bytes(n, r), packed = rays_packed_bytes(n, r);
    if (place == FACTORS_ON_DISK) return near + rows_making_bytes(near, packed, place);
    return rows_making_bytes(near, (place == FACTORS_IN_MEMORY ? packed : 0) + 1.5 * near, FACTORS_IN_MEMORY);
}

/* Near pairs alone, where nothing else is held: measured 7 (a Cornell box of 163,687 elements) to 33 (a city
 * of 39,999) per element at 512 rays; as found and in rows. */
static double stream_bytes(double n, const recipe *r) {
    static const double near_share = .25, near_bytes = 17;
    return n * fmin(n, near_share * (double)r->rays) * near_bytes;
}

static double seconds(double n, const recipe *r, double entries, double ray_seconds, double slowness) {
    return rows_seconds(n, (double)r->rays, entries, ray_seconds, slowness);
}

static lam_status sample(const factor_work *w, const recipe *r, factor_cost *out, lam_error *error) {
    return pairs_cost(w->m, r, recipe_near(r), w->progress, out, error);
}

static lam_status make(const mesh *m, const visibility *v, const uint32_t *order,
                       const form_factor_options *options, form_factors *f, lam_error *error) {
    lam_status status = LAM_OK;
    packed_rows counts = {0};
    csr near = {0}, counted = {0};
    TRY(pairs_find(m, v, options, recipe_near(&options->recipe), f, &near, error));
    TRY(rays_count(m, v, order, options, &counts, f->leaving, f->absorbed, error));
    if (counts.kept > f->rows_kept) f->rows_kept = counts.kept;
    TRY(upper_merge(&counts, options->recipe.rays, m->area, options->large, &counted, error));
    packed_rows_free(&counts);
    TRY(csr_replace(&counted, &near, &f->upper, error));
    csr_free(&near);
    csr_free(&counted);
    TRY(closing_repair(f, m, v, error));
done:
    packed_rows_free(&counts);
    csr_free(&near);
    csr_free(&counted);
    return status;
}

static bool less(recipe *r) {
    *r = (recipe){.source = &source_rays, .rays = RECIPE_RAYS_MOST};
    return true;
}

const factor_source source_near_pairs = {
    .name = "near-pairs",
    .flags = SOURCE_ROWS | SOURCE_STREAM | SOURCE_LARGE | SOURCE_NOISE | SOURCE_RAYS | SOURCE_ACCURACY,
    .describe = describe,
    .option = option,
    .accuracy = accuracy,
    .repair = rays_repair,
    .judge = rays_halved,
    .rays = source_rays_given,
    .bytes = rays_bytes,
    .packed_bytes = rays_packed_bytes,
    .making_bytes = making_bytes,
    .stream_bytes = stream_bytes,
    .stored_bytes = rays_stored_bytes,
    .seconds = seconds,
    .sample = sample,
    .make = make,
    .less = less,
    .finer = rays_finer,
    .advise = rays_advise,
};
