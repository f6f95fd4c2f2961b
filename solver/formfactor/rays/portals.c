#include "solver/formfactor/rays/portals.h"

#include "solver/base/random.h"
#include "solver/formfactor/visibility/openings.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static portal portal_of(const plane_rectangle *r, const visibility *v) {
    portal p = {.area = plane_rectangle_area(r)};
    for (int d = 0; d < 3; d++) {
        p.corner[d] = r->corner[d] - visibility_centre(v)[d];
        for (int k = 0; k < 2; k++) p.edge[k][d] = r->edge[k][d];
    }
    const double *a = p.edge[0], *b = p.edge[1];
    p.normal[0] = (a[1] * b[2] - a[2] * b[1]) / p.area;
    p.normal[1] = (a[2] * b[0] - a[0] * b[2]) / p.area;
    p.normal[2] = (a[0] * b[1] - a[1] * b[0]) / p.area;
    return p;
}

/* The density p_k of a direction by its solid angle; 0 where it does not pass the portal. */
static double portal_density(const portal *p, const double origin[3], const double direction[3]) {
    const double along = dot(direction, p->normal);
    double r[3];
    if (along == 0) return 0;
    for (int d = 0; d < 3; d++) r[d] = p->corner[d] - origin[d];
    const double distance = dot(r, p->normal) / along;
    if (!(distance > 0)) return 0;
    for (int d = 0; d < 3; d++) r[d] = distance * direction[d] - r[d];
    for (int k = 0; k < 2; k++) {
        const double place = dot(r, p->edge[k]) / dot(p->edge[k], p->edge[k]);
        if (!(place >= 0 && place <= 1)) return 0;
    }
    return distance * distance / (p->area * fabs(along));
}

unsigned portals_in_front(const portals *p, const mesh *m, const visibility *v, size_t element) {
    unsigned in_front = 0;
    double normal[3], centre[3];
    mesh_centroid(m, element, centre);
    for (int d = 0; d < 3; d++) {
        normal[d] = (double)m->normal[element][d];
        centre[d] -= visibility_centre(v)[d];
    }
    for (size_t k = 0; k < p->n; k++)
        for (int c = 0; c < 4; c++) {
            double r[3];
            for (int d = 0; d < 3; d++)
                r[d] = p->portal[k].corner[d] + (c & 1) * p->portal[k].edge[0][d] +
                       (c >> 1) * p->portal[k].edge[1][d] - centre[d];
            /* A quad is planar to a millionth of its size only. */
            if (dot(r, normal) > 1e-5 * sqrt(dot(r, r))) in_front |= 1u << k;
        }
    return in_front;
}

double portals_weight(const portals *p, unsigned in_front, size_t n_rays, const double origin[3],
                      const double direction[3], double cosine) {
    const double of_cosine = (double)n_rays * cosine * M_1_PI;
    double sum = of_cosine;
    for (size_t k = 0; k < p->n; k++)
        if ((in_front >> k & 1) != 0)
            sum += (double)p->rays * portal_density(&p->portal[k], origin, direction);
    return sum > 0 ? of_cosine / sum : 0;
}

/* Eight rays from points of an element to points of a portal; a lane whose point lies behind the element is
 * cast along its normal, and cosine is 0. */
static void aim(const portal *p, const element_sampler *sampler, const double x[4][VISIBILITY_PACKET],
                ray_packet *rays, double direction[VISIBILITY_PACKET][3], double cosine[VISIBILITY_PACKET]) {
    for (int i = 0; i < VISIBILITY_PACKET; i++) {
        float from[3];
        double to[3], normal[3];
        element_sampler_point(sampler, (float)x[0][i], (float)x[1][i], from);
        for (int d = 0; d < 3; d++) {
            to[d] = p->corner[d] + x[2][i] * p->edge[0][d] + x[3][i] * p->edge[1][d] - (double)from[d];
            normal[d] = (double)sampler->frame.normal[d];
        }
        const double length = sqrt(dot(to, to));
        cosine[i] = length > 0 ? fmax(dot(to, normal) / length, 0) : 0;
        for (int d = 0; d < 3; d++) {
            direction[i][d] = cosine[i] > 0 ? to[d] / length : normal[d];
            rays->origin[d][i] = from[d];
            rays->direction[d][i] = (float)direction[i][d];
        }
    }
}

void portals_cast(const portals *p, unsigned in_front, const ray_context *c, const element_sampler *sampler,
                  size_t element, size_t n_rays, ray_tally *tally, double *sky) {
    uint32_t self[VISIBILITY_PACKET];
    for (int i = 0; i < VISIBILITY_PACKET; i++) self[i] = (uint32_t)element;
    for (size_t k = 0; k < p->n; k++) {
        pair_sampler points;
        if ((in_front >> k & 1) == 0) continue;
        pair_sampler_init(&points, c->seed ^ RANDOM_STEP, element, c->m->n + k);
        for (uint32_t ray = 0; ray < p->rays; ray += VISIBILITY_PACKET) {
            double x[4][VISIBILITY_PACKET], direction[VISIBILITY_PACKET][3], cosine[VISIBILITY_PACKET];
            double weight[VISIBILITY_PACKET];
            ray_packet rays;
            hit_packet hits;
            unsigned leaving = 0;
            pair_sampler_packet(&points, ray, x);
            aim(&p->portal[k], sampler, (const double(*)[VISIBILITY_PACKET])x, &rays, direction, cosine);
            visibility_cast(c->v, &rays, VISIBILITY_PACKET, self, VISIBILITY_TOGETHER, &hits);
            for (int i = 0; i < VISIBILITY_PACKET; i++) {
                if (hits.element[i] != VISIBILITY_NOTHING || !(cosine[i] > 0)) continue;
                const double origin[3] = {(double)rays.origin[0][i], (double)rays.origin[1][i],
                                          (double)rays.origin[2][i]};
                leaving |= 1u << i;
                weight[i] = portals_weight(p, in_front, n_rays, origin, direction[i], cosine[i]);
                ray_tally_leave(tally, weight[i]);
            }
            if (c->sky != NULL && leaving != 0) sky_bounce_add(c->sky, rays.direction, leaving, weight, sky);
        }
    }
}

/* Elements of a first look, rays of each by the cosine and towards each hole. */
enum { LOOK_ELEMENTS = 256, LOOK_RAYS = 64, LOOK_TOWARDS = 16, HOLES_MOST = 64 };
static const double open_share = .1, area_share = .05, seen_share = .01;

/* The share of light that leaves, by rays of some elements. */
static double leaving_share(const ray_context *c) {
    const size_t n = c->m->n, count = n < LOOK_ELEMENTS ? n : LOOK_ELEMENTS;
    double left[LOOK_ELEMENTS], sum = 0, area = 0;
#pragma omp parallel for schedule(dynamic, 8)
    for (size_t k = 0; k < count; k++) {
        const size_t i = k * n / count;
        element_sampler sampler;
        uint32_t met[RAYS_AT_ONCE];
        ray_tally tally = {0};
        element_sampler_init(&sampler, c->m, c->v, i, c->seed);
        (void)rays_meet(c, &sampler, i, 0, LOOK_RAYS, met, &tally, NULL);
        left[k] = tally.left / LOOK_RAYS * c->m->area[i];
    }
    for (size_t k = 0; k < count; k++) {
        sum += left[k];
        area += c->m->area[k * n / count];
    }
    return sum / area;
}

/* The share of the rays of some elements towards a portal that leave the scene. */
static double share_through(const ray_context *c, const portal *p) {
    const size_t n = c->m->n, count = n < LOOK_ELEMENTS ? n : LOOK_ELEMENTS;
    const portals alone = {.n = 1, .portal = {*p}, .rays = LOOK_TOWARDS};
    double left[LOOK_ELEMENTS], sum = 0;
#pragma omp parallel for schedule(dynamic, 8)
    for (size_t k = 0; k < count; k++) {
        const size_t i = k * n / count;
        element_sampler sampler;
        ray_tally tally = {0};
        const unsigned in_front = portals_in_front(&alone, c->m, c->v, i);
        element_sampler_init(&sampler, c->m, c->v, i, c->seed);
        portals_cast(&alone, in_front, c, &sampler, i, 1, &tally, NULL);
        left[k] = (double)tally.count;
    }
    for (size_t k = 0; k < count; k++) sum += left[k];
    return sum / ((double)count * LOOK_TOWARDS);
}

static lam_status find_holes(const ray_context *c, portals *out, lam_error *error) {
    lam_status status = LAM_OK;
    plane_rectangle *holes = NULL;
    size_t n_holes = 0, looked = 0;
    double area = 0;
    if (leaving_share(c) > open_share) return LAM_OK;
    TRY(facet_holes(c->m, visibility_facets(c->v), openings_crack_width(c->m), &holes, &n_holes, error));
    for (size_t i = 0; i < c->m->n; i++) area += c->m->area[i];
    for (size_t h = 0; h < n_holes && out->n < PORTALS_MOST && looked < HOLES_MOST; h++) {
        const portal p = portal_of(&holes[h], c->v);
        if (p.area > area_share * area) continue;
        looked++;
        if (share_through(c, &p) > seen_share) out->portal[out->n++] = p;
    }
done:
    free(holes);
    return status;
}

lam_status portals_find(const mesh *m, const visibility *v, uint64_t seed, size_t rays,
                        const plane_rectangle *given, size_t n_given, portals *out, lam_error *error) {
    lam_status status = LAM_OK;
    const ray_context c = {.m = m, .v = v, .seed = seed};
    portals made = {.n = 0};
    if (n_given > PORTALS_MOST)
        FAIL(error, LAM_ERR_ARGUMENT, "%zu portals: at most %d are possible", n_given, PORTALS_MOST);
    for (size_t k = 0; k < n_given; k++) made.portal[made.n++] = portal_of(&given[k], v);
    if (n_given == 0) TRY(find_holes(&c, &made, error));
    if (made.n > 0) made.rays = (rays / made.n / VISIBILITY_PACKET + 1) * VISIBILITY_PACKET;
    *out = made;
done:
    return status;
}
