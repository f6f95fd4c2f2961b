/* An anechoic chamber: "Aguerre 2016, figure 5.1", below on the left. Pyramids stand on all six sides of a
 * room, as high as wide; where two sides meet, a slope joins the outer rows of their feet. */
#include "solver/scene/generate/patches.h"

#include <math.h>
#include <string.h>

static const double longest = 6; /* metres, between the tips at both ends */

/* Pyramids have 16 elements; the slopes about 40 for each pyramid along one of the three directions. */
enum { PER_PYRAMID = 16, PER_EDGE = 40, LEAST_PYRAMIDS = 2, CHAMBER_ELEMENTS = 6000 };
enum { FLOOR, CEILING, WALL, SLOPE, LAMP, GROUPS };

static const scene_draft_material foam = {"foam", {.3, .3, .3}, {0, 0, 0}};
static const scene_draft_material light = {"light", {.3, .3, .3}, {60, 60, 60}};
static const patch_group groups[GROUPS] = {
    {"floor", &foam}, {"ceiling", &foam}, {"wall", &foam}, {"slope", &foam}, {"lamp", &light}};

typedef struct chamber {
    size_t n[3];  /* pyramids along x, y, z */
    double pitch; /* metres: how wide a pyramid is, and how high */
    patch_list list;
} chamber;

static double expected_elements(const size_t n[3]) {
    return (double)(2 * PER_PYRAMID * (n[0] * n[1] + n[1] * n[2] + n[2] * n[0]) +
                    PER_EDGE * (n[0] + n[1] + n[2]));
}

/* The numbers of pyramids along x, y and z, about 5 : 4 : 3, for the number of elements. */
static chamber choose_chamber(size_t wanted) {
    chamber best = {.n = {0}};
    double off = HUGE_VAL;
    for (size_t x = LEAST_PYRAMIDS; off == HUGE_VAL || 1.2 * (double)(x * x * PER_PYRAMID) < (double)wanted;
         x++)
        for (size_t k = 0; k < 9; k++) {
            const size_t y = (size_t)round(.8 * (double)x) + k % 3, z = (size_t)round(.6 * (double)x) + k / 3;
            const size_t n[3] = {x, y > 1 + LEAST_PYRAMIDS ? y - 1 : LEAST_PYRAMIDS,
                                 z > 1 + LEAST_PYRAMIDS ? z - 1 : LEAST_PYRAMIDS};
            const double now = fabs(expected_elements(n) - (double)wanted);
            if (now >= off) continue;
            off = now;
            memcpy(best.n, n, sizeof n);
        }
    best.pitch = longest / (double)best.n[0];
    return best;
}

/* The coordinate of the feet of the pyramids at one end of an axis. */
static double feet_at(const chamber *c, int axis, bool far) {
    return far ? c->pitch * (double)(c->n[axis] + 1) : -c->pitch;
}

/* The coordinate of the tips, where the feet of the adjacent sides begin. */
static double tips_at(const chamber *c, int axis, bool far) {
    return far ? c->pitch * (double)c->n[axis] : 0;
}

/* The four corners of some pyramids' feet, counter-clockwise seen from the room. */
static void feet_of(const chamber *c, int axis, bool far, const size_t low[2], const size_t high[2],
                    double feet[4][3]) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (int k = 0; k < 4; k++) {
        const int corner = far ? 3 - k : k;
        feet[k][axis] = feet_at(c, axis, far);
        feet[k][u] = c->pitch * (double)(corner == 1 || corner == 2 ? high[0] : low[0]);
        feet[k][v] = c->pitch * (double)(corner >= 2 ? high[1] : low[1]);
    }
}

static lam_status add_pyramid(chamber *c, int axis, bool far, const size_t at[2], lam_error *error) {
    lam_status status = LAM_OK;
    const size_t high[2] = {at[0] + 1, at[1] + 1};
    double feet[4][3], tip[3];
    tip[axis] = tips_at(c, axis, far);
    for (int k = 0; k < 2; k++) tip[(axis + 1 + k) % 3] = c->pitch * ((double)at[k] + .5);
    feet_of(c, axis, far, at, high, feet);
    for (int k = 0; k < 4; k++) {
        double side[3][3];
        memcpy(side[0], feet[k], sizeof *side);
        memcpy(side[1], feet[(k + 1) % 4], sizeof *side);
        memcpy(side[2], tip, sizeof tip);
        TRY(patch_add(&c->list, (const double(*)[3])side, 3, axis < 2 ? WALL : far ? CEILING : FLOOR, error));
    }
done:
    return status;
}

/* The pyramids of one side. In the middle of the ceiling a lamp lies in place of some of them. */
static lam_status add_side(chamber *c, int axis, bool far, lam_error *error) {
    lam_status status = LAM_OK;
    size_t n[2], low[2], high[2], at[2];
    for (int k = 0; k < 2; k++) {
        n[k] = c->n[(axis + 1 + k) % 3];
        low[k] = n[k] * 2 / 5;
        high[k] = axis == 2 && far ? n[k] - low[k] : low[k];
    }
    for (at[1] = 0; at[1] < n[1]; at[1]++)
        for (at[0] = 0; at[0] < n[0]; at[0]++) {
            const bool lit = at[0] >= low[0] && at[0] < high[0] && at[1] >= low[1] && at[1] < high[1];
            if (!lit) TRY(add_pyramid(c, axis, far, at, error));
        }
    if (high[0] > low[0]) {
        double feet[4][3];
        feet_of(c, axis, far, low, high, feet);
        TRY(patch_add(&c->list, (const double(*)[3])feet, 4, LAMP, error));
    }
done:
    return status;
}

/* Adds a face in the orientation that faces the middle of the room. */
static lam_status add_slope(chamber *c, double corners[4][3], size_t n, lam_error *error) {
    double towards = 0;
    for (int d = 0; d < 3; d++) {
        const int e = (d + 1) % 3, f = (d + 2) % 3;
        const double normal = (corners[1][e] - corners[0][e]) * (corners[2][f] - corners[0][f]) -
                              (corners[1][f] - corners[0][f]) * (corners[2][e] - corners[0][e]);
        towards += normal * (c->pitch * (double)c->n[d] / 2 - corners[0][d]);
    }
    if (towards < 0) {
        double turned[4][3];
        for (size_t k = 0; k < n; k++) memcpy(turned[k], corners[n - 1 - k], sizeof *turned);
        return patch_add(&c->list, (const double(*)[3])turned, n, SLOPE, error);
    }
    return patch_add(&c->list, (const double(*)[3])corners, n, SLOPE, error);
}

static lam_status add_slopes(chamber *c, lam_error *error) {
    lam_status status = LAM_OK;
    double corners[4][3];
    for (int axis = 0; axis < 3; axis++) /* along the edges of the room */
        for (int ends = 0; ends < 4; ends++) {
            const int across[2] = {(axis + 1) % 3, (axis + 2) % 3};
            for (int k = 0; k < 4; k++) {
                corners[k][axis] = tips_at(c, axis, k == 1 || k == 2);
                for (int s = 0; s < 2; s++)
                    corners[k][across[s]] =
                        ((k >= 2) == (s == 1) ? feet_at : tips_at)(c, across[s], ends >> s & 1);
            }
            TRY(add_slope(c, corners, 4, error));
        }
    for (int ends = 0; ends < 8; ends++) { /* in its corners */
        for (int k = 0; k < 3; k++)
            for (int axis = 0; axis < 3; axis++)
                corners[k][axis] = (k == axis ? feet_at : tips_at)(c, axis, ends >> axis & 1);
        TRY(add_slope(c, corners, 3, error));
    }
done:
    return status;
}

lam_status generate_anechoic(scene_draft *d, const generate_options *options, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t wanted = options->elements > 0 ? options->elements : CHAMBER_ELEMENTS;
    chamber c = choose_chamber(wanted);
    c.list.groups = groups;
    c.list.n_groups = GROUPS;
    for (int axis = 0; axis < 3; axis++)
        for (int far = 0; far < 2; far++) TRY(add_side(&c, axis, far, error));
    TRY(add_slopes(&c, error));
    TRY(patches_draw(&c.list, d, options, wanted, error));
done:
    patches_free(&c.list);
    return status;
}
