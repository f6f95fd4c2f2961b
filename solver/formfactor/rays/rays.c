#include "solver/formfactor/rays/rays.h"

#include "solver/formfactor/rays/portals.h"
#include "solver/formfactor/rows/row_pool.h"
#include "solver/formfactor/visibility/sample.h"

#include <math.h>

_Static_assert((int)SKY_PACKET == VISIBILITY_PACKET, "packets go through the sky whole");

/* The weight of ray i of a packet, which leaves the scene, beside rays towards portals. */
static double weight_of(const ray_context *c, const element_sampler *sampler, const ray_packet *rays,
                        size_t i) {
    double origin[3], direction[3], cosine = 0;
    for (int d = 0; d < 3; d++) {
        origin[d] = (double)rays->origin[d][i];
        direction[d] = (double)rays->direction[d][i];
        cosine += direction[d] * (double)sampler->frame.normal[d];
    }
    return portals_weight(c->portals, &c->aim, c->n_rays, origin, direction, cosine);
}

size_t rays_meet(const ray_context *c, const element_sampler *sampler, size_t element, size_t first,
                 size_t last, uint32_t *met, ray_tally *tally, double *sky) {
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
        double weight[VISIBILITY_PACKET];
        unsigned leaving = 0;
        for (size_t i = 0; i < n; i++) {
            if (hits.element[i] == VISIBILITY_NOTHING) {
                weight[i] = c->portals != NULL && c->aim.n > 0 ? weight_of(c, sampler, &rays, i) : 1;
                ray_tally_leave(tally, weight[i]);
                leaving |= 1u << i;
            } else if (hits.back[i]) {
                tally->lost++;
            } else {
                met[count++] = hits.element[i];
            }
        }
        if (c->sky != NULL && leaving != 0) sky_bounce_add(c->sky, rays.direction, leaving, weight, sky);
    }
    return count;
}

/* The context of a row_maker that counts rays. */
typedef struct count_context {
    ray_context rays;
    size_t n_rays;
    bool without_rows;
    double *variance; /* [n], or NULL */
} count_context;

void rays_aim(ray_context *c, const element_sampler *sampler, size_t element, size_t n_rays) {
    if (c->portals == NULL) return;
    portals_aim(c->portals, c->m, c->v, element, &c->aim);
    portals_try(c, sampler, element);
    c->n_rays = n_rays;
}

double rays_variance(const ray_tally *tally, size_t n_rays, bool aimed) {
    static const double weight_of_aimed = 1. / 16;
    const double N = (double)n_rays, share = tally->left / N;
    const double weight = tally->count > 0 ? tally->left / (double)tally->count : aimed ? weight_of_aimed : 1;
    return fmax(tally->squares / N - share * share, weight * weight / N) / N;
}

/* Traces one element; every ray has the weight 1, but for rays that leave beside portals. Rays that find
 * nothing but the sky are half as many where others are aimed at it, unless the scene is open. */
static void trace_element(const void *context, size_t element, row_pool *pool, double *leaving,
                          double *absorbed) {
    const count_context *c = context;
    ray_context rays = c->rays;
    element_sampler sampler;
    ray_tally tally = {0};
    uint32_t met[RAYS_AT_ONCE];
    size_t n_rays = c->n_rays;
    element_sampler_init(&sampler, rays.m, rays.v, element, rays.seed);
    rays_aim(&rays, &sampler, element, n_rays);
    if (rays.aim.n > 0 && c->without_rows && !rays.portals->in_the_open)
        rays.n_rays = n_rays = (n_rays + 1) / 2;
    for (size_t first = 0; first < n_rays; first += RAYS_AT_ONCE) {
        const size_t last = first + RAYS_AT_ONCE < n_rays ? first + RAYS_AT_ONCE : n_rays;
        const size_t count = rays_meet(&rays, &sampler, element, first, last, met, &tally, pool->sky);
        for (size_t k = 0; k < count && !c->without_rows; k++) row_pool_add(pool, met[k], 1);
    }
    if (rays.aim.n > 0) portals_cast(&rays, &sampler, element, &tally, pool->sky);
    if (c->variance != NULL) c->variance[element] = rays_variance(&tally, n_rays, rays.aim.n > 0);
    pool->whole = (double)n_rays;
    *leaving = fmin(tally.left / (double)n_rays, 1);
    *absorbed = (double)tally.lost / (double)n_rays;
}

lam_status rays_count(const mesh *m, const visibility *v, const uint32_t *order,
                      const form_factor_options *options, packed_rows *counts, double *leaving,
                      double *absorbed, lam_error *error) {
    lam_status status = LAM_OK;
    portals aimed = {.n = 0};
    const size_t n_rays = options->recipe.rays;
    if (options->bounce != NULL)
        TRY(portals_find(m, v, options->recipe.seed, n_rays / 4, options->openings, false, &aimed, error));
    if (options->n_aimed != NULL) *options->n_aimed = aimed.n_openings;
    const count_context context = {.rays = {.m = m,
                                            .v = v,
                                            .seed = options->recipe.seed,
                                            .sky = options->bounce,
                                            .portals = aimed.n > 0 ? &aimed : NULL},
                                   .n_rays = n_rays,
                                   .without_rows = options->without_rows,
                                   .variance = options->variance};
    const row_maker maker = {.make = trace_element,
                             .context = &context,
                             .kind = ROW_COUNTS,
                             .rays = n_rays,
                             .whole = (double)n_rays,
                             .sky = options->bounce,
                             .cheaper = "fewer --rays",
                             .progress = options->progress,
                             .stage = options->stage,
                             .m = m,
                             .recipe = &options->recipe,
                             .only_first = options->only_first,
                             .scratch = options->scratch,
                             .scratch_name = options->scratch_name};
    TRY(row_pool_make(&maker, order, counts, leaving, absorbed, error));
done:
    portals_free(&aimed);
    return status;
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
