/* Form factors by hemicubes around the centroids of elements: no noise, but aliasing. */
#include "solver/formfactor/closing.h"
#include "solver/formfactor/rays/hemicube.h"
#include "solver/formfactor/source.h"

#include <stdio.h>

/* Fewer pixels than these are not proposed. */
enum { LOWEST_RESOLUTION = 32 };

static void describe(const recipe *r, char text[64]) {
    snprintf(text, 64, "hemicubes of %zu pixels", r->resolution);
}

static void option(const recipe *r, char text[40]) {
    snprintf(text, 40, "--resolution %zu", r->resolution);
}

/* Hemicubes stand at centroids and are biased: repairs are .007 to .015 in the ten generated scenes. The
 * judge casts rays. */
static double repair(const recipe *r) {
    (void)r;
    return .02;
}

/* Hemicubes would only repeat themselves. */
static recipe judge(const recipe *r, size_t rays) {
    (void)r;
    return (recipe){.source = &source_rays, .rays = rays};
}

/* A ray for each pixel of half a cube: res^2 on top, res^2 / 2 on each side. */
static double rays_of(double n, const recipe *r) {
    (void)n;
    return 3 * (double)r->resolution * (double)r->resolution;
}

static double bytes(double n, const recipe *r) {
    return rows_bytes(n, rays_of(n, r));
}

static double packed_bytes(double n, const recipe *r) {
    return rows_packed_bytes(n, rays_of(n, r), true);
}

static double making_bytes(double n, const recipe *r, factor_place place) {
    return rows_making_bytes(bytes(n, r), packed_bytes(n, r), place);
}

static double stored_bytes(double n, const recipe *r) {
    return rows_stored_bytes(n, bytes(n, r));
}

static double seconds(double n, const recipe *r, double entries, double ray_seconds, double slowness) {
    return rows_seconds(n, rays_of(n, r), entries, ray_seconds, slowness);
}

static lam_status make(const mesh *m, const visibility *v, const uint32_t *order,
                       const form_factor_options *options, form_factors *f, lam_error *error) {
    lam_status status = LAM_OK;
    hemicube h = {0};
    packed_rows rows = {0};
    TRY(hemicube_create(options->recipe.resolution, &h, error));
    TRY(hemicube_trace(&h, m, v, order, options, &rows, f->leaving, f->absorbed, error));
    /* The weights are form factors already, as if one ray had been cast. */
    TRY(closing_merge(f, m, v, &rows, 1, options->large, error));
done:
    hemicube_free(&h);
    packed_rows_free(&rows);
    return status;
}

static recipe asked(const recipe *r) {
    return (recipe){
        .source = &source_hemicube, .resolution = r->resolution, .seed = r->seed, .closure = r->closure};
}

static bool less(recipe *r) {
    if (r->resolution / 2 < LOWEST_RESOLUTION) return false;
    r->resolution = r->resolution / 4 * 2; /* even */
    return true;
}

static void finer(recipe *r, double error, double wanted, const factor_knobs *knobs) {
    (void)r, (void)error, (void)wanted, (void)knobs; /* it has no knob that trials turn */
}

static void advise(const recipe *r, double error, double most, bool finest, char option_text[64]) {
    (void)r, (void)error, (void)most, (void)finest;
    snprintf(option_text, 64, "--form-factors rays");
}

const factor_source source_hemicube = {
    .name = "hemicube",
    .flags = SOURCE_ROWS | SOURCE_LARGE | SOURCE_RESOLUTION | SOURCE_ASKED,
    .describe = describe,
    .option = option,
    .repair = repair,
    .judge = judge,
    .asked = asked,
    .rays = rays_of,
    .bytes = bytes,
    .packed_bytes = packed_bytes,
    .making_bytes = making_bytes,
    .stored_bytes = stored_bytes,
    .seconds = seconds,
    .make = make,
    .less = less,
    .finer = finer,
    .advise = advise,
};
