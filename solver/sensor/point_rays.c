/* The rays of a receiver. N rays of a half have the density of its weight, p = weight / pi, and M are aimed
 * at openings with the density q. In a direction in which N p > M q those by the weight count p / (N p) where
 * they leave the scene, and the others nothing; elsewhere those that are aimed count p / (M q). Rays that
 * meet pairs count nothing: the factors of these are known. For a row of a probe the counts are multiplied by
 * its ratio. */
#include "solver/sensor/point_rows.h"

#include "solver/base/random.h"
#include "solver/base/vector3.h"
#include "solver/formfactor/visibility/pane_path.h"
#include "solver/formfactor/visibility/sobol.h"

#include <math.h>

/* Rays of a packet, in double. */
typedef struct aimed_packet {
    ray_packet rays;
    double direction[VISIBILITY_PACKET][3];
    double density[VISIBILITY_PACKET]; /* p; 0: not cast */
    double ratio[VISIBILITY_PACKET][HARMONICS];
} aimed_packet;

/* A half of the rays while they are cast. */
typedef struct half_rays {
    const point_scene *s;
    const point_place *p;
    point_room *room;
    size_t half;
    portal_aim aim;
    point_found found;
} half_rays;

static void add_met(const half_rays *h, uint32_t j, double weight, const double ratio[HARMONICS]) {
    point_room *room = h->room;
    const size_t n_rows = h->p->n_rows;
    if ((room->known[j] & IS_PAIR) != 0) return;
    if ((room->known[j] & IS_MET) == 0) room->met[room->n_met++] = j;
    room->known[j] |= IS_MET;
    for (size_t w = 0; w < n_rows; w++) room->sum[j * n_rows + w][h->half] += weight * ratio[w];
}

/* p / (N p) or p / (M q) of a ray that leaves, by whichever of the two ways finds more rays there; 0 of a ray
 * of the other way. */
static double leaving_weight(const half_rays *h, const double direction[3], double density, bool aimed) {
    const point_scene *s = h->s;
    const double by_weight = (double)s->rays * density;
    double by_aim = 0, origin[3];
    for (int d = 0; d < 3; d++) origin[d] = (double)h->p->origin[d];
    if (h->aim.n > 0) by_aim = (double)s->aimed * portals_density(&s->openings, &h->aim, origin, direction);
    if ((by_aim > by_weight) != aimed) return 0;
    return density / fmax(by_aim, by_weight);
}

/* Adds a ray to a sum of shares, and to that of products. */
static void add_alone(half_rays *h, const double ratio[HARMONICS], double weight, double sum[HARMONICS]) {
    for (size_t k = 0; k < h->p->n_rows; k++) {
        sum[k] += weight * ratio[k];
        for (size_t l = 0; l <= k; l++) h->found.products[k][l] += weight * ratio[k] * ratio[l] / ratio[0];
    }
}

/* Adds rays that leave the scene to the tiles. */
static void add_leaving(half_rays *h, const aimed_packet *packet, bool aimed, const hit_packet *hits,
                        const double passed[VISIBILITY_PACKET]) {
    uint32_t tile[SKY_PACKET];
    const sky_bounce *sky = h->s->sky;
    const size_t n_rows = h->p->n_rows;
    if (sky != NULL) sky_tiling_find(&sky->tiling, packet->rays.direction, tile);
    for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
        if (hits->element[i] != VISIBILITY_NOTHING || !(packet->density[i] > 0)) continue;
        const double weight = leaving_weight(h, packet->direction[i], packet->density[i], aimed);
        if (sky == NULL) add_alone(h, packet->ratio[i], weight, h->found.left);
        for (size_t w = 0; w < n_rows && sky != NULL; w++) {
            const double share = weight * packet->ratio[i][w];
            h->found.left[w] += share;
            h->room->sky[tile[i] * n_rows + w][h->half] += share * passed[i];
        }
    }
}

/* A pane behind others shows its own light too. */
typedef struct pane_meeting {
    const half_rays *h;
    const aimed_packet *packet;
} pane_meeting;

static void meet_pane(void *context, size_t i, uint32_t element, double passed) {
    const pane_meeting *m = context;
    add_met(m->h, element, passed / (double)m->h->s->rays, m->packet->ratio[i]);
}

/* Takes rays on behind the panes that they meet. */
static void follow_panes(const half_rays *h, aimed_packet *packet, bool aimed, hit_packet *hits,
                         double passed[VISIBILITY_PACKET]) {
    const mesh *m = h->s->m;
    pane_meeting meeting = {.h = h, .packet = packet};
    const pane_visitor visitor = {.meet = meet_pane, .context = &meeting};
    for (size_t i = 0; i < VISIBILITY_PACKET && !aimed; i++)
        if (hits->element[i] != VISIBILITY_NOTHING && !hits->back[i] && mesh_is_pane(m, hits->element[i]))
            meet_pane(&meeting, i, hits->element[i], 1);
    pane_path_follow(h->s->v, m, &packet->rays, VISIBILITY_PACKET, hits, passed, aimed ? NULL : &visitor);
}

/* Finds what rays in the directions of a packet meet; they start at the receiver, which is no element. */
static void meet(const half_rays *h, aimed_packet *packet, unsigned how, hit_packet *hits) {
    static const uint32_t self[VISIBILITY_PACKET] = {
        VISIBILITY_NOTHING, VISIBILITY_NOTHING, VISIBILITY_NOTHING, VISIBILITY_NOTHING,
        VISIBILITY_NOTHING, VISIBILITY_NOTHING, VISIBILITY_NOTHING, VISIBILITY_NOTHING};
    for (size_t i = 0; i < VISIBILITY_PACKET; i++)
        for (int d = 0; d < 3; d++) {
            packet->rays.origin[d][i] = h->p->origin[d];
            packet->rays.direction[d][i] = (float)packet->direction[i][d];
        }
    visibility_cast(h->s->v, &packet->rays, VISIBILITY_PACKET, self, how, hits);
}

/* Casts a packet; aimed: it looks for the sky alone. */
static void cast(half_rays *h, aimed_packet *packet, bool aimed) {
    const point_scene *s = h->s;
    const double each = 1 / (double)s->rays;
    double passed[VISIBILITY_PACKET] = {1, 1, 1, 1, 1, 1, 1, 1};
    hit_packet hits;
    for (size_t i = 0; i < VISIBILITY_PACKET; i++) point_ratios(h->p, packet->direction[i], packet->ratio[i]);
    meet(h, packet, aimed ? VISIBILITY_TOGETHER : 0, &hits);
    if (s->m->glass != NULL) follow_panes(h, packet, aimed, &hits, passed);
    add_leaving(h, packet, aimed, &hits, passed);
    for (size_t i = 0; i < VISIBILITY_PACKET && !aimed; i++) {
        if (hits.element[i] == VISIBILITY_NOTHING) continue;
        if (hits.back[i])
            add_alone(h, packet->ratio[i], each, h->found.backs);
        else
            add_met(h, hits.element[i], passed[i] * each, packet->ratio[i]);
    }
}

/* Coordinates 0 and 1 of point k, or 2 and 3, of Sobol's sequence, moved by random bits. */
static void place(uint64_t shift, uint32_t k, int first, double x[2]) {
    x[0] = (double)((uint32_t)shift ^ sobol_coordinate(first, k)) * 0x1p-32;
    x[1] = (double)((uint32_t)(shift >> 32) ^ sobol_coordinate(first + 1, k)) * 0x1p-32;
}

static void cast_by_weight(half_rays *h, uint64_t shift) {
    for (uint32_t first = 0; first < h->s->rays; first += VISIBILITY_PACKET) {
        aimed_packet packet;
        for (uint32_t i = 0; i < VISIBILITY_PACKET; i++) {
            double x[2];
            place(shift, first + i, 0, x);
            receiver_direction(&h->p->r, x[0], x[1], packet.direction[i]);
            packet.density[i] = receiver_density(&h->p->r, packet.direction[i]);
        }
        cast(h, &packet, false);
    }
}

/* Rays to points of the openings of an aim. */
static void aim_packet(const half_rays *h, const portal_aim *aim, uint64_t shift, uint32_t first,
                       aimed_packet *packet) {
    for (uint32_t i = 0; i < VISIBILITY_PACKET; i++) {
        double x[2], to[3];
        place(shift, first + i, 0, x);
        portals_point(&h->s->openings, aim, x[0], x[1], to);
        for (int d = 0; d < 3; d++) to[d] -= (double)h->p->origin[d];
        const double length = sqrt(dot3(to, to));
        for (int d = 0; d < 3; d++) packet->direction[i][d] = length > 0 ? to[d] / length : d == 2;
        packet->density[i] = length > 0 ? receiver_density(&h->p->r, packet->direction[i]) : 0;
    }
}

/* Weighs the groups of openings by eight rays to each, where there are several. These are others than those
 * that count, so that the estimate stays without bias. */
static void try_openings(half_rays *h, uint64_t shift) {
    double open[PORTAL_GROUPS];
    if (h->aim.n < 2) return;
    for (size_t g = 0; g < h->aim.n; g++) {
        portal_aim alone = {.n = 1, .group = {h->aim.group[g]}};
        aimed_packet packet;
        hit_packet hits;
        double passed[VISIBILITY_PACKET], all = 0;
        alone.group[0].share = 1;
        aim_packet(h, &alone, random_hash(shift + g), 0, &packet);
        for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
            passed[i] = packet.density[i];
            all += packet.density[i];
        }
        meet(h, &packet, VISIBILITY_TOGETHER, &hits);
        pane_path_follow(h->s->v, h->s->m, &packet.rays, VISIBILITY_PACKET, &hits, passed, NULL);
        open[g] = 0;
        for (size_t i = 0; i < VISIBILITY_PACKET; i++)
            if (hits.element[i] == VISIBILITY_NOTHING) open[g] += passed[i];
        open[g] = all > 0 ? open[g] / all : 0;
    }
    portal_aim_weigh(&h->aim, open);
}

void point_rays(const point_scene *s, const point_place *p, point_room *room) {
    half_rays both = {.s = s, .p = p, .room = room};
    const uint64_t own = random_hash(random_hash(s->seed) ^ random_hash(p->number + 1));
    room->n_met = 0;
    room->backs = 0;
    if (s->aimed > 0) {
        const double *normal = p->r.kind == RECEIVER_PLANE ? p->r.axis : NULL;
        double at[3];
        for (int d = 0; d < 3; d++) at[d] = (double)p->origin[d];
        portals_aim_at(&s->openings, at, normal, &both.aim);
        try_openings(&both, random_hash(own + 2 * HALVES));
    }
    for (size_t half = 0; half < HALVES; half++) {
        half_rays h = both;
        h.half = half;
        cast_by_weight(&h, random_hash(own + half));
        for (uint32_t k = 0; h.aim.n > 0 && k < s->aimed; k += VISIBILITY_PACKET) {
            aimed_packet packet;
            aim_packet(&h, &h.aim, random_hash(own + HALVES + half), k, &packet);
            cast(&h, &packet, true);
        }
        double backs = h.found.backs[0];
        if (s->m->glass == NULL) point_close(s, p, room, half, h.aim.n > 0, &h.found, &backs);
        /* A probe outside of a room sees backs on one side only: of its rays those count that meet faces. */
        if (p->n_rows > 1) backs = h.found.backs[0] / fmax(M_2_SQRTPI - h.found.left[0], 1e-6);
        room->backs += backs / HALVES;
    }
}
