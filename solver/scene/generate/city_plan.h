/* The plan of a generated city: streets, yards, buildings, and the ground they stand on. Private. */
#ifndef LAMBERT_SCENE_GENERATE_CITY_PLAN_H
#define LAMBERT_SCENE_GENERATE_CITY_PLAN_H

#include "solver/scene/generate/generate.h"

/* Seen from above: x, then y. */
typedef struct city_rectangle {
    double low[2], high[2];
} city_rectangle;

typedef struct city_rectangles {
    city_rectangle *items;
    size_t n, capacity;
} city_rectangles;

/* What lies along x or y: a street from at[0] to at[1], blocks to at[2], and so on to a last street. */
typedef struct city_axis {
    double *at, *rise; /* [n]; metres; the ground is straight between two of them */
    size_t n;
} city_axis;

typedef struct city_plan {
    city_axis axes[2];
    city_rectangles streets, yards, buildings; /* each within one cell of the axes; together the whole site */
    double *heights;                           /* [buildings.n], metres above the ground */
} city_plan;

/* The same seed gives the same streets and buildings whatever the variant and terrain, which must be known
 * ones. plan is filled and owned by the caller (city_plan_free), also after an error. */
lam_status city_plan_make(const generate_options *options, size_t blocks_per_side, city_plan *plan,
                          lam_error *error);
void city_plan_free(city_plan *plan);

/* Height of the ground: a function of x plus one of y, each straight across a block or street, so that every
 * rectangle of the plan lies in a plane and no neighbours gape, however they are meshed. */
double city_ground(const city_plan *plan, double x, double y);

#endif
