#include "solver/formfactor/clusters/link_occluders.h"

#include "solver/base/vector3.h"

/* Heights of a box above a plane. */
static void box_heights(const cluster *c, const double normal[3], double level, double *low, double *high) {
    *low = *high = -level;
    for (int d = 0; d < 3; d++) {
        *low += normal[d] * (normal[d] > 0 ? c->low[d] : c->high[d]);
        *high += normal[d] * (normal[d] > 0 ? c->high[d] : c->low[d]);
    }
}

/* True where a segment between the two boxes may cross the occluder's plane. */
static bool is_between(const occluder *o, const cluster *a, const cluster *b, double slack) {
    double low[2], high[2];
    box_heights(a, o->normal, o->level, &low[0], &high[0]);
    box_heights(b, o->normal, o->level, &low[1], &high[1]);
    return (low[0] < -slack && high[1] > slack) || (low[1] < -slack && high[0] > slack);
}

int link_occluders_projected(const occluders *o) {
    enum { OF_FEW = 48, AMID_MANY = 8 };
    return o->n <= FEW_OCCLUDERS ? OF_FEW : AMID_MANY;
}

void link_occluders_find(const occluders *o, const shaft *s, const cluster *a, const cluster *b, int most,
                         link_occluders *out) {
    const uint32_t *found;
    uint32_t count;
    out->count = 0;
    for (occluder_search search = occluder_search_begin(o, s); occluder_search_next(&search, &found, &count);)
        for (uint32_t k = 0; k < count; k++) {
            const occluder *one = &o->of[found[k]];
            if (shaft_misses_points(s, one->n, one->corner) || !is_between(one, a, b, o->slack)) continue;
            if (out->count == most) {
                out->count = OCCLUDERS_UNCOUNTED;
                return;
            }
            out->of[out->count++] = found[k];
        }
}

static void box_corners(const cluster *c, double corner[8][3]) {
    for (int k = 0; k < 8; k++)
        for (int d = 0; d < 3; d++) corner[k][d] = k >> d & 1 ? c->high[d] : c->low[d];
}

/* All segments between corners of the boxes cross a convex occluder, so all others do. */
static bool hides(const occluder *o, const double corner[2][8][3], double slack) {
    double height[2][8];
    for (int k = 0; k < 16; k++) height[k / 8][k % 8] = dot3(o->normal, corner[k / 8][k % 8]) - o->level;
    const double sign = height[0][0] > 0 ? 1 : -1;
    for (int k = 0; k < 8; k++)
        if (sign * height[0][k] <= slack || sign * height[1][k] >= -slack) return false;
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 8; k++) {
            const double t = height[0][i] / (height[0][i] - height[1][k]);
            double at[3];
            for (int d = 0; d < 3; d++) at[d] = corner[0][i][d] + t * (corner[1][k][d] - corner[0][i][d]);
            for (int e = 0; e < o->n; e++)
                if (dot3(o->edge[e], at) + o->edge[e][3] < -slack) return false;
        }
    return true;
}

bool link_occluders_hide(const occluders *o, const link_occluders *among, const cluster *a,
                         const cluster *b) {
    double corner[2][8][3];
    box_corners(a, corner[0]);
    box_corners(b, corner[1]);
    for (int k = 0; k < among->count; k++)
        if (hides(&o->of[among->of[k]], (const double(*)[8][3])corner, o->slack)) return true;
    return false;
}
