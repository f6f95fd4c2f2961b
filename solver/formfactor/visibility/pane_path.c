#include "solver/formfactor/visibility/pane_path.h"

#include <math.h>

/* The component of a direction along the normal of an element. */
static double along_normal(const mesh *m, uint32_t element, const ray_packet *rays, size_t i) {
    double along = 0;
    for (int d = 0; d < 3; d++) along += (double)m->normal[element][d] * (double)rays->direction[d][i];
    return along;
}

double pane_path_passes(const mesh *m, uint32_t pane, const ray_packet *rays, size_t i) {
    double square = 0;
    for (int d = 0; d < 3; d++) square += (double)rays->direction[d][i] * (double)rays->direction[d][i];
    return mesh_pane_passes(m, pane, fabs(along_normal(m, pane, rays, i)) / sqrt(square));
}

/* Puts the origin of a ray into the plane of the pane that it has met, where casts that lift origins off
 * their elements leave it a little before that, and then behind it, above all that rises from it there. */
static void put_behind(const visibility *v, const mesh *m, uint32_t pane, double distance, ray_packet *rays,
                       size_t i) {
    const float *normal = m->normal[pane];
    const double height =
        copysign(2 * visibility_rounding(v) + visibility_rise(v, pane), along_normal(m, pane, rays, i));
    double at[3], above = 0;
    float corner[3];
    visibility_recentre(v, m->vertices[m->elements[pane][0]], corner);
    for (int d = 0; d < 3; d++) {
        at[d] = (double)rays->origin[d][i] + distance * (double)rays->direction[d][i];
        above += (at[d] - (double)corner[d]) * (double)normal[d];
    }
    for (int d = 0; d < 3; d++) rays->origin[d][i] = (float)(at[d] + (height - above) * (double)normal[d]);
}

void pane_path_step(const visibility *v, const mesh *m, ray_packet *rays, size_t n, const bool *ahead,
                    unsigned how, hit_packet *hits) {
    static const uint32_t self[VISIBILITY_PACKET] = {
        VISIBILITY_NOTHING, VISIBILITY_NOTHING, VISIBILITY_NOTHING, VISIBILITY_NOTHING,
        VISIBILITY_NOTHING, VISIBILITY_NOTHING, VISIBILITY_NOTHING, VISIBILITY_NOTHING};
    ray_packet behind;
    hit_packet met;
    size_t lane[VISIBILITY_PACKET], count = 0;
    for (size_t i = 0; i < n; i++) {
        if (!ahead[i]) continue;
        put_behind(v, m, hits->element[i], (double)hits->distance[i], rays, i);
        for (int d = 0; d < 3; d++) {
            behind.origin[d][count] = rays->origin[d][i];
            behind.direction[d][count] = rays->direction[d][i];
        }
        lane[count++] = i;
    }
    if (count == 0) return;
    visibility_cast(v, &behind, count, self, how, &met);
    for (size_t k = 0; k < count; k++) {
        hits->element[lane[k]] = met.element[k];
        hits->back[lane[k]] = met.back[k];
        hits->distance[lane[k]] = met.distance[k];
    }
}

/* left, unless NULL: the lengths of rays that count, in units of their directions. */
static void follow(const visibility *v, const mesh *m, ray_packet *rays, size_t n, hit_packet *hits,
                   double weight[VISIBILITY_PACKET], double *left, const pane_visitor *visitor) {
    for (int crossed = 0; m->glass != NULL; crossed++) {
        bool ahead[VISIBILITY_PACKET] = {false}, any = false;
        for (size_t i = 0; i < n; i++) {
            const uint32_t element = hits->element[i];
            if (element == VISIBILITY_NOTHING || !mesh_is_pane(m, element)) continue;
            if (left != NULL && !((double)hits->distance[i] < left[i])) continue;
            if (crossed > 0 && visitor != NULL && !hits->back[i])
                visitor->meet(visitor->context, i, element, weight[i]);
            weight[i] *= crossed < PANES_MOST ? pane_path_passes(m, element, rays, i) : 0;
            if (left != NULL) left[i] -= (double)hits->distance[i];
            ahead[i] = any = true;
        }
        if (!any || crossed == PANES_MOST) return;
        pane_path_step(v, m, rays, n, ahead, 0, hits);
    }
}

void pane_path_follow(const visibility *v, const mesh *m, ray_packet *rays, size_t n, hit_packet *hits,
                      double weight[VISIBILITY_PACKET], const pane_visitor *visitor) {
    follow(v, m, rays, n, hits, weight, NULL, visitor);
}

void pane_path_reach(const visibility *v, const mesh *m, ray_packet *segments, size_t n, hit_packet *hits,
                     const double end[VISIBILITY_PACKET], double weight[VISIBILITY_PACKET]) {
    double left[VISIBILITY_PACKET];
    for (size_t i = 0; i < n; i++) left[i] = end[i];
    follow(v, m, segments, n, hits, weight, left, NULL);
    for (size_t i = 0; i < n; i++)
        if (hits->element[i] != VISIBILITY_NOTHING && (double)hits->distance[i] < left[i]) weight[i] = 0;
}

/* Both ends, above their elements and what rises from these. */
static void lift(const visibility *v, const mesh *m, uint32_t from, uint32_t to, ray_packet *segments,
                 size_t i) {
    const double height = 2 * visibility_rounding(v);
    const double begin = height + visibility_rise(v, from), end = height + visibility_rise(v, to);
    for (int d = 0; d < 3; d++) {
        const double up = begin * (double)m->normal[from][d], down = end * (double)m->normal[to][d];
        segments->origin[d][i] += (float)up;
        segments->direction[d][i] += (float)(down - up);
    }
}

void pane_path_between(const visibility *v, const mesh *m, const ray_packet *segments, size_t n,
                       const uint32_t *from, const uint32_t *to, unsigned blocked,
                       double passed[VISIBILITY_PACKET]) {
    static const double nearly = 1 - 1e-5;
    ray_packet cast = {.origin = {{0}}};
    size_t lane[VISIBILITY_PACKET], count = 0;
    uint32_t self[VISIBILITY_PACKET];
    double end[VISIBILITY_PACKET], weight[VISIBILITY_PACKET];
    hit_packet hits;
    for (size_t i = 0; i < n; i++) {
        passed[i] = blocked >> i & 1 ? 0 : 1;
        if (passed[i] > 0 || m->glass == NULL) continue;
        for (int d = 0; d < 3; d++) {
            cast.origin[d][count] = segments->origin[d][i];
            cast.direction[d][count] = segments->direction[d][i];
        }
        lift(v, m, from[i], to[i], &cast, count);
        self[count] = from[i];
        end[count] = nearly;
        weight[count] = 1;
        lane[count++] = i;
    }
    if (count == 0) return;
    visibility_cast(v, &cast, count, self, 0, &hits);
    pane_path_reach(v, m, &cast, count, &hits, end, weight);
    for (size_t k = 0; k < count; k++) passed[lane[k]] = weight[k];
}
