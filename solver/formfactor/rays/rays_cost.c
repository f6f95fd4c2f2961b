#include "solver/formfactor/rays/rays_cost.h"

#include "solver/formfactor/rays/ray_crossings.h"

#include <math.h>
#include <stdio.h>

/* A ray costs box_seconds for each box of a triangle that it crosses, less boxes_free, and at least
 * ray_seconds; a row costs row_seconds beside its rays. The numbers are fits to processor seconds, with other
 * work beside, of 512 to 8,192 rays in a furnished room, a Cornell box, rooms, a city, a canopy, two parts of
 * a town and a hotel room: 59 ns (2.8 boxes) to 345 (11). */
static const double ray_seconds = 3e-8, box_seconds = 2.65e-8, boxes_free = .3, row_seconds = 2.4e-5;

/* Entries of the triangle per ray that hits: many hit what others hit. */
static const double ray_entries = .3;

lam_status rays_work(const mesh *m, size_t rays, factor_cost *out, lam_error *error) {
    enum { SEED = 1 }; /* the choice of a recipe does not depend on --seed */
    lam_status status = LAM_OK;
    const double n = (double)m->n, all = n * (double)rays;
    ray_crossings w;
    TRY(ray_crossings_sample(m, SEED, &w, error));
    const double each = fmax((w.boxes - boxes_free) * box_seconds, ray_seconds);
    *out = (factor_cost){.seconds = all * each + n * row_seconds,
                         .entries = fmin(all * w.hits * ray_entries, n * n / 2),
                         .hits = w.hits};
done:
    return status;
}

lam_status rays_cost(const mesh *m, size_t rays, factor_cost *out, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(rays_work(m, rays, out, error));
    out->measured = out->seconds += out->entries * factor_entry_seconds;
    out->entries *= 2;
done:
    return status;
}

double rays_repair(const recipe *r) {
    return r->rays > 0 ? 1 / sqrt((double)r->rays) : 0;
}

static const double power_of_rays = -.5;

void rays_finer(recipe *r, double error, double wanted, const factor_knobs *knobs) {
    const double most = (double)r->rays * source_turn(error, wanted, power_of_rays);
    if (!knobs->rays) return;
    while (r->rays < RECIPE_RAYS_MOST && (double)r->rays < most) r->rays *= 2;
    if (r->rays > RECIPE_RAYS_MOST) r->rays = RECIPE_RAYS_MOST;
}

/* The least power of two times rays that lowers an error, which is as rays^-1/2, to most. */
static size_t rays_for(size_t rays, double error, double most) {
    size_t more = 2 * rays;
    while (more < RECIPE_RAYS_MOST && (double)rays * pow(error / most, 2) > (double)more) more *= 2;
    return more < RECIPE_RAYS_MOST ? more : RECIPE_RAYS_MOST;
}

void rays_advise(const recipe *r, double error, double most, bool finest, char option[64]) {
    (void)finest;
    snprintf(option, 64, "--rays %zu", rays_for(r->rays, error, most));
}

recipe rays_halved(const recipe *r, size_t rays) {
    recipe half = *r;
    (void)rays;
    if (half.rays > 1) half.rays /= 2;
    return half;
}

double rays_bytes(double n, const recipe *r) {
    return rows_bytes(n, (double)r->rays);
}

double rays_packed_bytes(double n, const recipe *r) {
    return rows_packed_bytes(n, (double)r->rays, false);
}

double rays_stored_bytes(double n, const recipe *r) {
    return rows_stored_bytes(n, rays_bytes(n, r));
}
