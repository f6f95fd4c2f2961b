#include "solver/formfactor/rays/rays.h"

#include "solver/formfactor/rows/row_pool.h"
#include "solver/formfactor/visibility/sample.h"

_Static_assert((int)SKY_PACKET == VISIBILITY_PACKET, "packets go through the sky whole");

size_t rays_meet(const ray_context *c, const element_sampler *sampler, size_t element, size_t first,
                 size_t last, uint32_t *met, ray_tally *tally, double *sky) {
    static const double ones[VISIBILITY_PACKET] = {1, 1, 1, 1, 1, 1, 1, 1};
    uint32_t self[VISIBILITY_PACKET], order[RAYS_AT_ONCE + VISIBILITY_PACKET];
    size_t count = 0;
    for (int i = 0; i < VISIBILITY_PACKET; i++) self[i] = (uint32_t)element;
    element_sampler_order(sampler, (uint32_t)first, last - first, order);
    for (int i = 0; i < VISIBILITY_PACKET; i++) order[last - first + (size_t)i] = (uint32_t)first;
    for (size_t ray = 0; ray < last - first; ray += VISIBILITY_PACKET) {
        ray_packet rays;
        hit_packet hits;
        const size_t left = last - first - ray, n = left < VISIBILITY_PACKET ? left : VISIBILITY_PACKET;
        element_sampler_packet_of(sampler, order + ray, &rays);
        visibility_cast(c->v, &rays, n, self, VISIBILITY_TOGETHER, &hits);
        unsigned leaving = 0;
        for (size_t i = 0; i < n; i++) {
            if (hits.element[i] == VISIBILITY_NOTHING) {
                tally->left++;
                leaving |= 1u << i;
            } else if (hits.back[i]) {
                tally->lost++;
            } else {
                met[count++] = hits.element[i];
            }
        }
        if (c->sky != NULL && leaving != 0) sky_bounce_add(c->sky, rays.direction, leaving, ones, sky);
    }
    return count;
}

/* The context of a row_maker that counts rays. */
typedef struct count_context {
    ray_context rays;
    size_t n_rays;
    bool without_rows;
} count_context;

/* Traces one element; every ray has the weight 1. */
static void trace_element(const void *context, size_t element, row_pool *pool, double *leaving,
                          double *absorbed) {
    const count_context *c = context;
    element_sampler sampler;
    ray_tally tally = {0};
    uint32_t met[RAYS_AT_ONCE];
    element_sampler_init(&sampler, c->rays.m, c->rays.v, element, c->rays.seed);
    for (size_t first = 0; first < c->n_rays; first += RAYS_AT_ONCE) {
        const size_t last = first + RAYS_AT_ONCE < c->n_rays ? first + RAYS_AT_ONCE : c->n_rays;
        const size_t count = rays_meet(&c->rays, &sampler, element, first, last, met, &tally, pool->sky);
        for (size_t k = 0; k < count && !c->without_rows; k++) row_pool_add(pool, met[k], 1);
    }
    *leaving = (double)tally.left / (double)c->n_rays;
    *absorbed = (double)tally.lost / (double)c->n_rays;
}

lam_status rays_count(const mesh *m, const visibility *v, const uint32_t *order,
                      const form_factor_options *options, packed_rows *counts, double *leaving,
                      double *absorbed, lam_error *error) {
    const count_context context = {
        .rays = {.m = m, .v = v, .seed = options->recipe.seed, .sky = options->bounce},
        .n_rays = options->recipe.rays,
        .without_rows = options->without_rows};
    const row_maker maker = {.make = trace_element,
                             .context = &context,
                             .kind = ROW_COUNTS,
                             .rays = options->recipe.rays,
                             .whole = (double)options->recipe.rays,
                             .sky = options->bounce,
                             .cheaper = "fewer --rays",
                             .progress = options->progress,
                             .stage = options->stage,
                             .m = m,
                             .recipe = &options->recipe,
                             .only_first = options->only_first,
                             .scratch = options->scratch,
                             .scratch_name = options->scratch_name};
    return row_pool_make(&maker, order, counts, leaving, absorbed, error);
}

void rays_cast_some(const mesh *m, const visibility *v, const uint32_t *order, size_t n_elements,
                    size_t rays) {
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t k = 0; k < n_elements; k++) {
        const size_t element = order[k * m->n / n_elements];
        element_sampler sampler;
        element_sampler_init(&sampler, m, v, element, 0);
        const ray_context context = {.m = m, .v = v};
        ray_tally tally = {0};
        uint32_t met[RAYS_AT_ONCE];
        (void)rays_meet(&context, &sampler, element, 0, rays, met, &tally, NULL);
    }
}
