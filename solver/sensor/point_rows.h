/* The rows of one point: its pairs and its rays. A point is a receiver, or the nine of a probe, which are
 * found together: by the density d of a sphere, and the ratio d_w / d of the density of each row w to it.
 * Private to solver/sensor. */
#ifndef LAMBERT_SENSOR_POINT_ROWS_H
#define LAMBERT_SENSOR_POINT_ROWS_H

#include "solver/formfactor/rays/portal_aim.h"
#include "solver/formfactor/visibility/visibility.h"
#include "solver/sensor/sensor_rows.h"

#include <math.h>

enum { HALVES = 2, IS_PAIR = 1, IS_MET = 2 };

/* The scene that all receivers share. */
typedef struct point_scene {
    const mesh *m;
    const visibility *v;
    double (*ball)[4];     /* [n]: centre and radius of each element */
    const bool *is_source; /* [n], elements that give light */
    size_t n_sources;
    const sky_bounce *sky; /* NULL: none */
    portals openings;      /* n 0: none */
    size_t rays;           /* of a half */
    double pair_factor;    /* of sensor_rows_options */
    size_t aimed;          /* of a half; 0 without openings */
    uint64_t seed;
} point_scene;

/* The place of a point, off the faces that it lies on; origin: recentred. */
typedef struct point_place {
    receiver r;     /* of a probe, a sphere: the density that it is found by */
    receiver probe; /* its first harmonic */
    size_t n_rows;  /* 1, or HARMONICS of a probe */
    size_t number;
    float origin[3];
} point_place;

/* A share by both halves. */
typedef double point_share[HALVES];

/* Room of one thread for a point of n_rows. */
typedef struct point_room {
    uint32_t *pair;      /* [n] */
    point_share *factor; /* [n][n_rows], of pairs */
    uint8_t *known;      /* [n], IS_PAIR and IS_MET, 0 between points */
    point_share *sum;    /* [n][n_rows], by elements that rays meet, 0 between points */
    uint32_t *met;       /* [n] */
    size_t n_pairs, n_met;
    point_share *sky; /* [n_tiles + 1][n_rows], shares, the last one of the ground; 0 between points */
    double backs;     /* share of the rays */
} point_room;

/* Shares v of backs and of the sky that the rays of a half have found, [n_rows] each; and the sums of
 * products v_k v_l / v_0 over rays that are kept nowhere else: those of backs, and of the sky where it has no
 * tiles. */
typedef struct point_found {
    double backs[HARMONICS], left[HARMONICS], products[HARMONICS][HARMONICS];
} point_found;

/* A ball about each element, [n]: centre and radius. The caller frees. Errors: LAM_ERR_MEMORY. */
lam_status point_balls_make(const mesh *m, double (**out)[4], lam_error *error);

/* Moves a receiver off the faces that it lies on, or the probe of which it is the first harmonic. */
void point_place_set(const point_scene *s, const receiver *r, size_t number, point_place *out);

/* The ratios d_w / d of its rows in a direction. */
static inline void point_ratios(const point_place *p, const double direction[3], double ratio[HARMONICS]) {
    ratio[0] = 1;
    if (p->n_rows == 1) return;
    receiver_densities(&p->probe, direction, ratio);
    for (size_t w = 0; w < HARMONICS; w++) ratio[w] *= 4 * M_PI;
}

/* Lists the pairs of a point and finds their factors. */
void point_pairs(const point_scene *s, const point_place *p, point_room *room);

/* Scales the shares of a half, and that of backs, so that they sum in each row to the integral of its
 * density, in a scene without panes. sky_is_known: rays were aimed at openings, so that what leaves is known
 * better. */
void point_close(const point_scene *s, const point_place *p, point_room *room, size_t half, bool sky_is_known,
                 const point_found *found, double *backs);

/* Casts its rays: those that meet other elements, the sky and backs. Pairs must be known. */
void point_rays(const point_scene *s, const point_place *p, point_room *room);

#endif
