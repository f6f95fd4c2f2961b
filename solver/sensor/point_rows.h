/* The row of one receiver: its pairs and its rays. Private to solver/sensor. */
#ifndef LAMBERT_SENSOR_POINT_ROWS_H
#define LAMBERT_SENSOR_POINT_ROWS_H

#include "solver/formfactor/rays/portal_aim.h"
#include "solver/formfactor/visibility/visibility.h"
#include "solver/sensor/sensor_rows.h"

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

/* The place of a receiver, off the faces that it lies on; origin: recentred. */
typedef struct point_place {
    receiver r;
    size_t number;
    float origin[3];
} point_place;

/* Room of one thread for a row. */
typedef struct point_room {
    uint32_t *pair;           /* [n] */
    double (*factor)[HALVES]; /* [n], of pairs */
    uint8_t *known;           /* [n], IS_PAIR and IS_MET, 0 between rows */
    double (*sum)[HALVES];    /* [n], by elements that rays meet, 0 between rows */
    uint32_t *met;            /* [n] */
    size_t n_pairs, n_met;
    double (*sky)[HALVES]; /* [n_tiles + 1], shares, the last one of the ground; 0 between rows */
    double backs;          /* share of the rays */
} point_room;

/* A ball about each element, [n]: centre and radius. The caller frees. Errors: LAM_ERR_MEMORY. */
lam_status point_balls_make(const mesh *m, double (**out)[4], lam_error *error);

/* Moves a receiver off the faces that it lies on. */
void point_place_set(const point_scene *s, const receiver *r, size_t number, point_place *out);

/* Lists the pairs of a receiver and finds their factors. */
void point_pairs(const point_scene *s, const point_place *p, point_room *room);

/* Casts its rays: those that meet other elements, the sky and backs. Pairs must be known. */
void point_rays(const point_scene *s, const point_place *p, point_room *room);

#endif
