/* Form factors by counting rays from every element. */
#include "solver/formfactor/closing.h"
#include "solver/formfactor/rays/rays.h"
#include "solver/formfactor/rays/rays_cost.h"
#include "solver/formfactor/source.h"

#include <math.h>
#include <stdio.h>

/* Fewer rays than these are not proposed. */
enum { FEWEST_RAYS = 256 };

static void describe(const recipe *r, char text[64]) {
    snprintf(text, 64, "%zu rays per element", r->rays);
}

static void option(const recipe *r, char text[40]) {
    snprintf(text, 40, "--rays %zu", r->rays);
}

static double making_bytes(double n, const recipe *r, factor_place place) {
    return rows_making_bytes(rays_bytes(n, r), rays_packed_bytes(n, r), place);
}

static double seconds(double n, const recipe *r, double entries, double ray_seconds, double slowness) {
    return rows_seconds(n, (double)r->rays, entries, ray_seconds, slowness);
}

static lam_status sample(const factor_work *w, const recipe *r, factor_cost *out, lam_error *error) {
    return rays_cost(w->m, r->rays, out, error);
}

static lam_status make(const mesh *m, const visibility *v, const uint32_t *order,
                       const form_factor_options *options, form_factors *f, lam_error *error) {
    lam_status status = LAM_OK;
    packed_rows counts = {0};
    TRY(rays_count(m, v, order, options, &counts, f->leaving, f->absorbed, error));
    TRY(closing_merge(f, m, v, &counts, options->recipe.rays, options->large, error));
done:
    packed_rows_free(&counts);
    return status;
}

static bool less(recipe *r) {
    if (r->rays <= FEWEST_RAYS) return false;
    r->rays /= 2;
    return true;
}

const factor_source source_rays = {
    .name = "rays",
    .flags =
        SOURCE_ROWS | SOURCE_STREAM | SOURCE_LARGE | SOURCE_NOISE | SOURCE_RAYS | SOURCE_TIMED | SOURCE_ASKED,
    .describe = describe,
    .option = option,
    .repair = rays_repair,
    .judge = rays_halved,
    .rays = source_rays_given,
    .bytes = rays_bytes,
    .packed_bytes = rays_packed_bytes,
    .making_bytes = making_bytes,
    .stored_bytes = rays_stored_bytes,
    .seconds = seconds,
    .sample = sample,
    .make = make,
    .less = less,
    .finer = rays_finer,
    .advise = rays_advise,
};
