#include "solver/formfactor/visibility/openings.h"

#include <math.h>

double openings_crack_width(const mesh *m) {
    double centre[3], radius;
    mesh_bounds(m, centre, &radius);
    return 2 * radius / OPENINGS_NARROWEST;
}

/* The rays beside a ray: a packet around it, of which lanes i and i + 4 lie on opposite sides. */
typedef struct beside {
    double axes[VISIBILITY_PACKET][3]; /* unit, across the ray */
    double point[VISIBILITY_PACKET][3];
    bool met[VISIBILITY_PACKET], below[VISIBILITY_PACKET]; /* a front; the plane of the ray's own element */
} beside;

enum { SIDES = VISIBILITY_PACKET / 2 };

static void beside_begin(beside *b, const double d[3]) {
    /* Two directions across d, the first also across the axis that d is least along. */
    int least = 0;
    for (int k = 1; k < 3; k++)
        if (fabs(d[k]) < fabs(d[least])) least = k;
    double u[3], w[3], length = 0;
    const int next = (least + 1) % 3, last = (least + 2) % 3;
    u[least] = 0;
    u[next] = -d[last];
    u[last] = d[next];
    for (int k = 0; k < 3; k++) length += u[k] * u[k];
    for (int k = 0; k < 3; k++) u[k] /= sqrt(length);
    w[0] = d[1] * u[2] - d[2] * u[1];
    w[1] = d[2] * u[0] - d[0] * u[2];
    w[2] = d[0] * u[1] - d[1] * u[0];
    for (int i = 0; i < VISIBILITY_PACKET; i++) {
        const double turn = M_PI * i / SIDES;
        for (int k = 0; k < 3; k++) b->axes[i][k] = cos(turn) * u[k] + sin(turn) * w[k];
        b->met[i] = b->below[i] = false;
    }
}

/* Casts the packet whose rays deviate by `tangent`; notes what lanes meet that have not met anything yet. */
static void beside_cast(beside *b, const visibility *v, const double origin[3], const double d[3],
                        const double normal[3], double tangent, uint32_t self) {
    ray_packet rays;
    hit_packet hits;
    uint32_t selves[VISIBILITY_PACKET];
    for (int i = 0; i < VISIBILITY_PACKET; i++) {
        double height = 0;
        for (int k = 0; k < 3; k++) {
            const double along = d[k] + tangent * b->axes[i][k];
            rays.origin[k][i] = (float)origin[k];
            rays.direction[k][i] = (float)along;
            height += along * normal[k];
        }
        selves[i] = self;
        b->below[i] = b->below[i] || (!b->met[i] && height <= 0);
    }
    visibility_cast(v, &rays, VISIBILITY_PACKET, selves, 0, &hits);
    for (int i = 0; i < VISIBILITY_PACKET; i++) {
        if (b->met[i] || b->below[i] || hits.element[i] == VISIBILITY_NOTHING || hits.back[i]) continue;
        b->met[i] = true;
        for (int k = 0; k < 3; k++)
            b->point[i][k] = origin[k] + (double)hits.distance[i] * (double)rays.direction[k][i];
    }
}

/* The least distance between what opposite lanes have met; INFINITY where none of them has. Below the plane
 * of the ray's element this element is the other side of the gap. */
static double beside_width(const beside *b, const double origin[3], const double normal[3]) {
    double least = INFINITY;
    for (int i = 0; i < VISIBILITY_PACKET; i++) {
        const int j = (i + SIDES) % VISIBILITY_PACKET;
        double square = 0, height = 0;
        for (int k = 0; k < 3 && b->met[i]; k++) {
            height += (b->point[i][k] - origin[k]) * normal[k];
            if (b->met[j]) square += (b->point[i][k] - b->point[j][k]) * (b->point[i][k] - b->point[j][k]);
        }
        if (b->met[i] && b->met[j]) least = fmin(least, sqrt(square));
        if (b->met[i] && b->below[j]) least = fmin(least, height);
    }
    return least;
}

/* The part of the width of a crack by which origins are moved: more would take openings hardly wider than a
 * crack for cracks. */
static const double moved_share = 1. / 16;

/* True where the ray meets a front once its origin lies further inside its element: rays that start at the
 * very edge may start behind a neighbour. */
static bool starts_behind(const visibility *v, const mesh *m, double width, const double origin[3],
                          const float direction[3], uint32_t self) {
    double centre[3], to[3], length = 0;
    ray_packet rays;
    hit_packet hits;
    mesh_centroid(m, self, centre);
    for (int k = 0; k < 3; k++) {
        to[k] = centre[k] - visibility_centre(v)[k] - origin[k];
        length += to[k] * to[k];
    }
    length = sqrt(length);
    const double moved = length > 0 ? fmin(moved_share * width, length / 2) / length : 0;
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < VISIBILITY_PACKET; i++) {
            rays.origin[k][i] = (float)(origin[k] + moved * to[k]);
            rays.direction[k][i] = direction[k];
        }
    visibility_cast(v, &rays, 1, &self, 0, &hits);
    return hits.element[0] != VISIBILITY_NOTHING && !hits.back[0];
}

bool openings_is_crack(const visibility *v, const mesh *m, double width, const float origin[3],
                       const float direction[3], uint32_t self) {
    /* At the far end of the scene the first rays deviate by a quarter of the width; the last ones find a
     * crack beside the origin. */
    const double first = .25 / OPENINGS_NARROWEST, last = 4, step = cbrt(2);
    double from[3], d[3], normal[3], length = 0;
    beside b;
    for (int k = 0; k < 3; k++) {
        from[k] = (double)origin[k];
        normal[k] = (double)m->normal[self][k];
        length += (double)direction[k] * (double)direction[k];
    }
    for (int k = 0; k < 3; k++) d[k] = (double)direction[k] / sqrt(length);
    if (starts_behind(v, m, width, from, direction, self)) return true;
    beside_begin(&b, d);
    for (double tangent = first; tangent <= last; tangent *= step) {
        beside_cast(&b, v, from, d, normal, tangent, self);
        if (beside_width(&b, from, normal) <= width) return true;
    }
    return false;
}
