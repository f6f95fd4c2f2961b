#include "solver/formfactor/rays/portals.h"

#include "solver/base/random.h"
#include "solver/base/vector3.h"
#include "solver/formfactor/rays/portal_strength.h"
#include "solver/formfactor/visibility/openings.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

double portals_weight(const portals *p, const portal_aim *aim, size_t n_rays, const double origin[3],
                      const double direction[3], double cosine) {
    const double of_cosine = (double)n_rays * cosine * M_1_PI;
    const double sum = of_cosine + (double)p->rays * portals_density(p, aim, origin, direction);
    return sum > 0 ? of_cosine / sum : 0;
}

void portals_rays(const portals *p, const portal_aim *to_groups, const element_sampler *sampler,
                  const double x[4][VISIBILITY_PACKET], ray_packet *rays,
                  double direction[VISIBILITY_PACKET][3], double cosine[VISIBILITY_PACKET]) {
    for (int i = 0; i < VISIBILITY_PACKET; i++) {
        float from[3];
        double to[3], normal[3];
        element_sampler_point(sampler, (float)x[0][i], (float)x[1][i], from);
        portals_point(p, to_groups, x[2][i], x[3][i], to);
        for (int d = 0; d < 3; d++) {
            to[d] -= (double)from[d];
            normal[d] = (double)sampler->frame.normal[d];
        }
        const double length = sqrt(dot3(to, to));
        cosine[i] = length > 0 ? fmax(dot3(to, normal) / length, 0) : 0;
        for (int d = 0; d < 3; d++) {
            direction[i][d] = cosine[i] > 0 ? to[d] / length : normal[d];
            rays->origin[d][i] = from[d];
            rays->direction[d][i] = (float)direction[i][d];
        }
    }
}

/* The sum of the cosines of eight rays to a group that leave the scene, over that of all eight. */
static double open_share_of(const ray_context *c, const element_sampler *sampler, size_t element, size_t g) {
    portal_aim alone = {.n = 1, .group = {c->aim.group[g]}};
    double x[4][VISIBILITY_PACKET], direction[VISIBILITY_PACKET][3], cosine[VISIBILITY_PACKET];
    double open = 0, all = 0;
    uint32_t self[VISIBILITY_PACKET];
    pair_sampler points;
    ray_packet rays;
    hit_packet hits;
    alone.group[0].share = 1;
    for (int i = 0; i < VISIBILITY_PACKET; i++) self[i] = (uint32_t)element;
    pair_sampler_init(&points, c->seed + RANDOM_STEP, element, c->m->n + g);
    pair_sampler_packet(&points, 0, x);
    portals_rays(c->portals, &alone, sampler, (const double(*)[VISIBILITY_PACKET])x, &rays, direction,
                 cosine);
    visibility_cast(c->v, &rays, VISIBILITY_PACKET, self, VISIBILITY_TOGETHER, &hits);
    for (int i = 0; i < VISIBILITY_PACKET; i++) {
        all += cosine[i];
        if (hits.element[i] == VISIBILITY_NOTHING) open += cosine[i];
    }
    return all > 0 ? open / all : 0;
}

void portals_try(ray_context *c, const element_sampler *sampler, size_t element) {
    double open[PORTAL_GROUPS];
    if (c->aim.n < 2) return;
    for (size_t g = 0; g < c->aim.n; g++) open[g] = open_share_of(c, sampler, element, g);
    portal_aim_weigh(&c->aim, open);
}

void portals_cast(const ray_context *c, const element_sampler *sampler, size_t element, ray_tally *tally,
                  double *sky) {
    uint32_t self[VISIBILITY_PACKET];
    pair_sampler points;
    for (int i = 0; i < VISIBILITY_PACKET; i++) self[i] = (uint32_t)element;
    pair_sampler_init(&points, c->seed ^ RANDOM_STEP, element, c->m->n);
    for (uint32_t ray = 0; ray < c->portals->rays; ray += VISIBILITY_PACKET) {
        double x[4][VISIBILITY_PACKET], direction[VISIBILITY_PACKET][3], cosine[VISIBILITY_PACKET];
        double weight[VISIBILITY_PACKET];
        ray_packet rays;
        hit_packet hits;
        unsigned leaving = 0;
        pair_sampler_packet(&points, ray, x);
        portals_rays(c->portals, &c->aim, sampler, (const double(*)[VISIBILITY_PACKET])x, &rays, direction,
                     cosine);
        visibility_cast(c->v, &rays, VISIBILITY_PACKET, self, VISIBILITY_TOGETHER, &hits);
        for (int i = 0; i < VISIBILITY_PACKET; i++) {
            if (hits.element[i] != VISIBILITY_NOTHING || !(cosine[i] > 0)) continue;
            const double origin[3] = {(double)rays.origin[0][i], (double)rays.origin[1][i],
                                      (double)rays.origin[2][i]};
            leaving |= 1u << i;
            weight[i] = portals_weight(c->portals, &c->aim, c->n_rays, origin, direction[i], cosine[i]);
            ray_tally_leave(tally, weight[i]);
        }
        if (c->sky != NULL && leaving != 0) sky_bounce_add(c->sky, rays.direction, leaving, weight, sky);
    }
}

/* Rays of an element towards openings in thick walls, where others cast one. */
enum { RAYS_INTO_REVEALS = 4 };

lam_status portals_find(const mesh *m, const visibility *v, uint64_t seed, size_t rays,
                        const face_openings *openings, bool of_open, portals *out, lam_error *error) {
    lam_status status = LAM_OK;
    face_openings own = {.n = 0};
    portals made = {.n = 0};
    portal *array = NULL;
    double(*strength)[2] = NULL;
    size_t n = 0, n_openings = 0;
    bool doubled = false;
    if (openings == NULL) {
        TRY(face_openings_find(m, openings_crack_width(m), &own, error));
        openings = &own;
    }
    array = memory_allocate(openings->n_patches + 1, sizeof *array, "portals", error);
    strength = memory_allocate(openings->n + 1, sizeof *strength, "portals", error);
    if (array == NULL || strength == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t o = 0; o < openings->n; o++) strength[o][0] = strength[o][1] = 1;
    if (!openings->given) TRY(portals_measure(m, v, seed, openings, of_open, strength, &doubled, error));
    for (size_t k = 0; k < openings->n_patches; k++) {
        const uint32_t opening = openings->patches[k].opening;
        if (!(strength[opening][0] + strength[opening][1] > 0)) continue;
        n_openings += n == 0 || opening != openings->patches[k - 1].opening;
        array[n] = portal_of(&openings->patches[k], visibility_centre(v));
        memcpy(array[n++].strength, strength[opening], sizeof array->strength);
    }
    status = portals_build(array, n, &made, error);
    array = NULL;
    TRY(status);
    made.n_openings = n_openings;
    made.in_the_open = n > 0 && portals_are_in_the_open(m, v, seed);
    /* Many of the rays into a thick wall meet its reveals. */
    if (doubled) rays *= RAYS_INTO_REVEALS;
    if (n > 0) made.rays = (rays / VISIBILITY_PACKET + 1) * VISIBILITY_PACKET;
    *out = made;
done:
    free(array);
    free(strength);
    face_openings_free(&own);
    return status;
}
