#include "solver/formfactor/rays.h"

#include "solver/formfactor/row_pool.h"
#include "solver/formfactor/sample.h"

/* What the rays of every element share. */
typedef struct ray_context {
    const mesh *m;
    const visibility *v;
    size_t rays;
    uint64_t seed;
    const sky_bounce *sky;
} ray_context;

/* Traces one element: every ray counts 1. */
static void trace_element(const void *context, size_t element, row_pool *pool, double *leaving,
                          double *absorbed) {
    const ray_context *c = context;
    element_sampler sampler;
    element_sampler_init(&sampler, c->m, c->v, element, c->seed);
    uint32_t self[VISIBILITY_PACKET];
    for (int i = 0; i < VISIBILITY_PACKET; i++) self[i] = (uint32_t)element;
    static const double ones[VISIBILITY_PACKET] = {1, 1, 1, 1, 1, 1, 1, 1};
    size_t left = 0, lost = 0;
    for (size_t ray = 0; ray < c->rays; ray += VISIBILITY_PACKET) {
        ray_packet rays;
        hit_packet hits;
        const size_t n = c->rays - ray < VISIBILITY_PACKET ? c->rays - ray : VISIBILITY_PACKET;
        element_sampler_packet(&sampler, (uint32_t)ray, &rays);
        visibility_cast(c->v, &rays, n, self, 0, &hits);
        unsigned leaving_now = 0;
        for (size_t i = 0; i < n; i++) {
            const uint32_t hit = hits.element[i];
            if (hit == VISIBILITY_NOTHING) {
                left++;
                leaving_now |= 1u << i;
            } else if (hits.back[i]) {
                lost++;
            } else {
                row_pool_add(pool, hit, 1);
            }
        }
        row_pool_leave(pool, c->sky, &rays, leaving_now, ones);
    }
    *leaving = (double)left / (double)c->rays;
    *absorbed = (double)lost / (double)c->rays;
}

lam_status rays_count(const mesh *m, const visibility *v, const uint32_t *order,
                      const form_factor_options *options, found_rows *counts, double *leaving,
                      double *absorbed, lam_error *error) {
    const ray_context context = {
        .m = m, .v = v, .rays = options->recipe.rays, .seed = options->recipe.seed, .sky = options->bounce};
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
    return rows_make(&maker, order, counts, leaving, absorbed, error);
}

void rays_cast_some(const mesh *m, const visibility *v, const uint32_t *order, size_t n_elements,
                    size_t rays) {
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t k = 0; k < n_elements; k++) {
        const size_t element = order[k * m->n / n_elements];
        element_sampler sampler;
        element_sampler_init(&sampler, m, v, element, 0);
        uint32_t self[VISIBILITY_PACKET];
        for (int i = 0; i < VISIBILITY_PACKET; i++) self[i] = (uint32_t)element;
        for (size_t ray = 0; ray < rays; ray += VISIBILITY_PACKET) {
            ray_packet packet;
            hit_packet hits;
            element_sampler_packet(&sampler, (uint32_t)ray, &packet);
            visibility_cast(v, &packet, VISIBILITY_PACKET, self, 0, &hits);
        }
    }
}
