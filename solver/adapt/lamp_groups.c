#include "solver/adapt/lamp_groups.h"

#include "solver/base/random.h"
#include "solver/base/vector3.h"
#include "solver/base/weighted.h"
#include "solver/formfactor/visibility/sample.h"
#include "solver/scene/face_grid.h"

#include <math.h>
#include <stdlib.h>

/* Shares by power alone, mixed in: what the few segments of a group have missed keeps some samples. */
static const double by_power = .1;

/* Groups of smaller shares are not tested by segments. */
static const double tested_least = 1. / 32;

/* The points of a look: all lie in this ball, in one plane. */
typedef struct points_ball {
    double centre[3], radius, normal[3];
} points_ball;

void lamp_groups_free(lamp_groups *l) {
    free(l->element);
    free(l->before);
    free(l->first);
    free(l->group);
    free(l->of);
    *l = (lamp_groups){.n = 0};
}

double lamp_groups_brightness(const lamp_groups *l, size_t element) {
    double sum = 0;
    for (size_t c = 0; c < l->m->n_channels; c++) sum += (double)l->E[c * l->m->n + element];
    return sum;
}

/* The ball about the centre of the corners' box, and the plane of the first lamp. */
static lamp_group group_of(const lamp_groups *l, size_t first, size_t end) {
    static const double same_way = 1 - 1e-6;
    const mesh *m = l->m;
    lamp_group g = {.flat = true, .power = l->before[end] - l->before[first]};
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int d = 0; d < 3; d++) g.normal[d] = (double)m->normal[l->element[first]][d];
    for (size_t k = first; k < end; k++) {
        const uint32_t i = l->element[k];
        double cosine = 0;
        for (int d = 0; d < 3; d++) cosine += g.normal[d] * (double)m->normal[i][d];
        g.flat = g.flat && cosine >= same_way;
        for (size_t c = 0; c < mesh_corners(m, i); c++)
            for (int d = 0; d < 3; d++) {
                low[d] = fmin(low[d], m->vertices[m->elements[i][c]][d]);
                high[d] = fmax(high[d], m->vertices[m->elements[i][c]][d]);
            }
    }
    for (int d = 0; d < 3; d++) g.centre[d] = .5 * (low[d] + high[d]);
    g.radius = .5 * point_distance(low, high);
    return g;
}

lam_status lamp_groups_make(const mesh *m, const visibility *v, const float *E, lamp_groups *out,
                            lam_error *error) {
    lam_status status = LAM_OK;
    *out = (lamp_groups){.m = m, .v = v, .E = E};
    if (E == NULL) return LAM_OK;
    for (size_t i = 0; i < m->n; i++) out->n += lamp_groups_brightness(out, i) > 0;
    if (out->n == 0) return LAM_OK;
    out->n_groups = out->n < LAMP_GROUPS_MOST ? out->n : LAMP_GROUPS_MOST;
    out->element = memory_allocate(out->n, sizeof *out->element, "lamps", error);
    out->before = memory_allocate(out->n + 1, sizeof *out->before, "lamps", error);
    out->first = memory_allocate(out->n_groups + 1, sizeof *out->first, "lamps", error);
    out->group = memory_allocate(m->n, sizeof *out->group, "lamps", error);
    out->of = memory_allocate(out->n_groups, sizeof *out->of, "lamps", error);
    if (out->element == NULL || out->before == NULL || out->first == NULL || out->group == NULL ||
        out->of == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t i = 0, k = 0; i < m->n; i++) {
        if (!(lamp_groups_brightness(out, i) > 0)) continue;
        out->before[k + 1] = out->before[k] + m->area[i] * lamp_groups_brightness(out, i);
        out->element[k++] = (uint32_t)i;
    }
    for (size_t g = 0; g <= out->n_groups; g++) out->first[g] = out->n * g / out->n_groups;
    for (size_t g = 0; g < out->n_groups; g++) {
        out->of[g] = group_of(out, out->first[g], out->first[g + 1]);
        for (size_t k = out->first[g]; k < out->first[g + 1]; k++) out->group[out->element[k]] = (uint32_t)g;
    }
done:
    return status;
}

static points_ball ball_of(const mesh *m, uint32_t element, size_t n, const double (*points)[3]) {
    points_ball b = {.radius = 0};
    for (int d = 0; d < 3; d++) {
        b.normal[d] = (double)m->normal[element][d];
        for (size_t k = 0; k < n; k++) b.centre[d] += points[k][d] / (double)n;
    }
    for (size_t k = 0; k < n; k++) b.radius = fmax(b.radius, point_distance(b.centre, points[k]));
    return b;
}

/* About the light of a group at the points, if nothing stands between; 0 only where they cannot see it. */
static double open_light(const lamp_group *g, const points_ball *b) {
    double away[3];
    subtract3(g->centre, b->centre, away);
    const double reach = g->radius + b->radius, r = fmax(sqrt(dot3(away, away)), reach);
    const double arrives = dot3(b->normal, away) + reach,
                 leaves = g->flat ? reach - dot3(g->normal, away) : r;
    if (!(arrives > 0 && leaves > 0)) return 0;
    return g->power * fmin(arrives / r, 1) * fmin(leaves / r, 1) / (r * r);
}

/* The lamp of a group at a share of its power. */
static uint32_t lamp_of_group(const lamp_groups *l, size_t group, double share) {
    const size_t first = l->first[group], count = l->first[group + 1] - first;
    const double power = l->before[first] + share * l->of[group].power;
    return l->element[first + weighted_part(l->before + first, count, power)];
}

/* The share of a packet of segments that a group is seen by, never 0: other segments may be open. */
static double seen_by(const lamp_groups *l, size_t group, uint32_t element, uint64_t key, size_t n_points,
                      const double (*points)[3]) {
    ray_packet segments = {.origin = {{0}}};
    uint32_t from[VISIBILITY_PACKET] = {0}, to[VISIBILITY_PACKET] = {0};
    uint64_t random = random_hash(key ^ random_hash(group + 1));
    size_t n = 0;
    for (size_t k = 0; k < VISIBILITY_PACKET; k++) {
        const uint32_t lamp = lamp_of_group(l, group, ((double)k + .5) / VISIBILITY_PACKET);
        const float u = (float)random_unit(&random), w = (float)random_unit(&random);
        element_sampler sampler;
        float origin[3], place[3];
        double leaves = 0, arrives = 0;
        element_sampler_init(&sampler, l->m, l->v, lamp, 0);
        element_sampler_point(&sampler, u, w, place);
        visibility_recentre(l->v, points[k * n_points / VISIBILITY_PACKET], origin);
        for (int d = 0; d < 3; d++) {
            const double along = (double)place[d] - (double)origin[d];
            segments.origin[d][n] = origin[d];
            segments.direction[d][n] = (float)along;
            leaves += along * (double)l->m->normal[element][d];
            arrives -= along * (double)l->m->normal[lamp][d];
        }
        from[n] = element;
        to[n] = lamp;
        n += leaves > 0 && arrives > 0;
    }
    const unsigned blocked = n > 0 ? visibility_blocked(l->v, &segments, n, from, to) : 0;
    const int seen = (int)n - __builtin_popcount(blocked);
    return (1 + (double)seen) / (1 + VISIBILITY_PACKET);
}

void lamp_groups_share(const lamp_groups *l, uint32_t element, uint64_t key, size_t n_points,
                       const double (*points)[3], lamp_shares *out) {
    double worth[LAMP_GROUPS_MOST], all = 0, left = 0;
    const points_ball ball = ball_of(l->m, element, n_points, points);
    for (size_t g = 0; g < l->n_groups; g++) all += worth[g] = open_light(&l->of[g], &ball);
    for (size_t g = 0; g < l->n_groups; g++) {
        if (l->n_groups > 1 && worth[g] > tested_least * all)
            worth[g] *= seen_by(l, g, element, key, n_points, points);
        left += worth[g];
    }
    const double power = l->before[l->n], mixed = left > 0 ? by_power : 1;
    double sum = 0;
    for (size_t g = 0; g < l->n_groups; g++) {
        out->before[g] = sum;
        sum += mixed * l->of[g].power / power + (left > 0 ? (1 - mixed) * worth[g] / left : 0);
    }
    for (size_t g = 0; g < l->n_groups; g++) out->before[g] /= sum;
    out->before[l->n_groups] = 1;
}

uint32_t lamp_groups_at(const lamp_groups *l, const lamp_shares *shares, double place) {
    const size_t group = weighted_part(shares->before, l->n_groups, place);
    const double share = shares->before[group + 1] - shares->before[group];
    return lamp_of_group(l, group, share > 0 ? (place - shares->before[group]) / share : 0);
}

double lamp_groups_density(const lamp_groups *l, const lamp_shares *shares, uint32_t element) {
    const uint32_t g = l->group[element];
    return lamp_groups_brightness(l, element) * (shares->before[g + 1] - shares->before[g]) / l->of[g].power;
}
