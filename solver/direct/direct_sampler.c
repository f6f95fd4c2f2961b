#include "solver/direct/direct_sampler.h"

#include "solver/base/random.h"
#include "solver/base/vector3.h"
#include "solver/base/weighted.h"
#include "solver/direct/luminaire_sight.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A luminaire that shines. */
typedef struct sampled_source {
    placed_source source;
    double moved[3];  /* of its opening, before segments end there */
    double colour[3]; /* factors of the channels, with its dimmer */
} sampled_source;

struct direct_sampler {
    const mesh *m;
    size_t n;
    sampled_source *of;
    luminaire_sight sight;
};

void direct_sampler_free(direct_sampler *s) {
    if (s == NULL) return;
    luminaire_sight_free(&s->sight);
    free(s->of);
    free(s);
}

/* The groups that any luminaire ignores; the caller frees out->groups. */
static lam_status ignore_all(const mesh *m, const placed_luminaires *p, ignored_groups *out,
                             lam_error *error) {
    lam_status status = LAM_OK;
    double(*boxes)[2][3] = NULL;
    bool *ignored = memory_allocate(m->n_groups, sizeof *ignored, "luminaires", error);
    out->groups = memory_allocate(m->n_groups, sizeof *out->groups, "luminaires", error);
    if (ignored == NULL || out->groups == NULL) TRY(LAM_ERR_MEMORY);
    TRY(group_boxes_make(m, &boxes, error));
    for (size_t k = 0; k < p->n; k++) {
        ignored_groups one = {.n = 0};
        TRY(ignored_groups_find(m, (const double(*)[2][3])boxes, p, &p->luminaires[k], &one, error));
        for (size_t g = 0; g < one.n; g++) ignored[one.groups[g]] = true;
        free(one.groups);
    }
    for (uint32_t g = 0; g < m->n_groups; g++)
        if (ignored[g]) out->groups[out->n++] = g;
done:
    free(ignored);
    free(boxes);
    return status;
}

lam_status direct_sampler_create(const mesh *m, const placed_luminaires *p, direct_sampler **out,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    ignored_groups ignored = {.n = 0};
    bool dark = true;
    direct_sampler *s = memory_allocate(1, sizeof *s, "luminaires", error);
    if (s == NULL) TRY(LAM_ERR_MEMORY);
    s->m = m;
    s->of = memory_allocate(p->n, sizeof *s->of, "luminaires", error);
    if (s->of == NULL) TRY(LAM_ERR_MEMORY);
    TRY(ignore_all(m, p, &ignored, error));
    TRY(luminaire_sight_make(m, &ignored, &s->sight, error));
    for (size_t k = 0; k < p->n; k++) dark = dark && !(p->luminaires[k].dim > 0);
    const size_t taken = p->n < DIRECT_SAMPLED ? p->n : DIRECT_SAMPLED;
    for (size_t k = 0; k < taken; k++) {
        const placed_luminaire *l = &p->luminaires[k * p->n / taken];
        const double dim = (dark ? 1 : l->dim) * (double)p->n / (double)taken;
        sampled_source *of = &s->of[s->n];
        if (!(dim > 0)) continue;
        placed_source_set(p, l, m->up, &of->source);
        luminaire_sight_settle(&s->sight, &of->source, of->moved);
        for (size_t c = 0; c < 3; c++) of->colour[c] = dim * (m->n_channels == 1 ? 1 : l->colour[c]);
        s->n++;
    }
    *out = s;
    s = NULL;
done:
    free(ignored.groups);
    direct_sampler_free(s);
    return status;
}

/* The irradiance of a surface at x in the scene by a place of an opening, as all of its light came from
 * there, I part cos / d^2; place: in the scene. */
static double from_place(const sampled_source *of, const opening_cell *cell, const double x[3],
                         const double normal[3], double place[3]) {
    const placed_source *source = &of->source;
    double own[3], turned[3], towards[3], moved[3];
    placed_source_inwards(source, x, own);
    placed_source_turn(source, normal, turned);
    const double across = placed_source_normal(source, cell, own, towards);
    placed_source_outwards(source, cell->at, moved);
    for (int d = 0; d < 3; d++) place[d] = moved[d] + of->moved[d];
    return across * fmax(0, dot3(turned, towards));
}

/* The places that all points look at: a luminaire each, with the probability of it. */
typedef struct sampled_places {
    size_t source[DIRECT_SAMPLES];
    double chance[DIRECT_SAMPLES];
    opening_cell cell[DIRECT_SAMPLES];
} sampled_places;

/* before [n + 1]: sums of what luminaires would give the points if nothing hid them, by the middle of their
 * openings at the first, the middle and the last point, and of a hundredth of the light of a body of their
 * flux, as a middle may miss a beam. */
static void weigh(const direct_sampler *s, const double normal[3], size_t n_points, const double (*points)[3],
                  double *before) {
    const size_t looks[3] = {0, n_points / 2, n_points - 1};
    before[0] = 0;
    for (size_t k = 0; k < s->n; k++) {
        opening_cell middle;
        double most = 0;
        opening_place(&s->of[k].source.opening, .5, .5, &middle);
        for (int l = 0; l < 3; l++) {
            double place[3], way[3];
            const double *x = points[looks[l]];
            const double E = from_place(&s->of[k], &middle, x, normal, place);
            subtract3(place, x, way);
            most = fmax(most, E + .01 * s->of[k].source.peak / fmax(dot3(way, way), 1e-12));
        }
        before[k + 1] = before[k] + most * s->of[k].colour[1];
    }
}

static void draw(const direct_sampler *s, const double *before, uint64_t key, sampled_places *out) {
    const double all = before[s->n], turn = random_unit(&key);
    for (size_t q = 0; q < DIRECT_SAMPLES; q++) {
        const double at = ((double)q + turn) / DIRECT_SAMPLES * all, u = random_unit(&key),
                     w = random_unit(&key);
        const size_t k = weighted_part(before, s->n, at);
        out->source[q] = k;
        out->chance[q] = (before[k + 1] - before[k]) / all;
        opening_place(&s->of[k].source.opening, u, w, &out->cell[q]);
    }
}

/* The samples of a packet's size that begin with the first, at one point. */
static void add_packet(const direct_sampler *s, const sampled_places *places, size_t first,
                       const double normal[3], const double x[3], const float origin[3], double *E) {
    ray_packet segments = {.origin = {{0}}};
    size_t of[VISIBILITY_PACKET], n = 0;
    double light[VISIBILITY_PACKET], passed[VISIBILITY_PACKET];
    size_t element[VISIBILITY_PACKET];
    for (size_t q = first; q < first + VISIBILITY_PACKET; q++) {
        const size_t k = places->source[q];
        double place[3];
        float end[3];
        const double irradiance = from_place(&s->of[k], &places->cell[q], x, normal, place);
        if (!(irradiance > 0)) continue;
        luminaire_sight_recentre(&s->sight, place, end);
        for (int d = 0; d < 3; d++) {
            segments.origin[d][n] = origin[d];
            segments.direction[d][n] = end[d] - origin[d];
        }
        light[n] = irradiance / (places->chance[q] * DIRECT_SAMPLES);
        element[n] = SIGHT_OPEN;
        of[n++] = k;
    }
    if (n == 0) return;
    luminaire_sight_passed(&s->sight, &segments, n, element, passed);
    for (size_t i = 0; i < n; i++)
        for (size_t c = 0; c < s->m->n_channels; c++) E[c] += passed[i] * light[i] * s->of[of[i]].colour[c];
}

void direct_sampler_add(const direct_sampler *s, const double normal[3], uint64_t key, size_t n_points,
                        const double (*points)[3], size_t stride, double *E) {
    double before[DIRECT_SAMPLED + 1];
    if (s->n == 0 || s->sight.v == NULL) return;
    weigh(s, normal, n_points, points, before);
    for (size_t h = 0; h < DIRECT_HALVES && before[s->n] > 0; h++) {
        sampled_places places;
        draw(s, before, random_hash(key ^ random_hash(h + 1)), &places);
        for (size_t p = 0; p < n_points; p++) {
            double lifted[3];
            float origin[3];
            /* Nothing in the plane of the points hides the light. */
            const double lift = 2 * visibility_rounding(s->sight.v);
            for (int d = 0; d < 3; d++) lifted[d] = points[p][d] + lift * normal[d];
            luminaire_sight_recentre(&s->sight, lifted, origin);
            for (size_t first = 0; first < DIRECT_SAMPLES; first += VISIBILITY_PACKET)
                add_packet(s, &places, first, normal, points[p], origin,
                           E + (p * DIRECT_HALVES + h) * stride);
        }
    }
}
