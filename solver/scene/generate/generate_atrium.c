/* A long hall under an open roof, between two storeys of galleries behind round columns and arches, in the
 * manner of the Sponza atrium of Aguerre 2016, figure 3.6, with as many elements. */
#include "solver/scene/generate/column.h"
#include "solver/scene/generate/court.h"

#include <math.h>
#include <string.h>

/* Metres; out from the hall. A bay is from the middle of one column to that of the next. */
static const double bay = 3, square = .64, gallery_end = 3.8, house_end = 4.1;
static const double slab = .3, sky = 9.5, half_lamp = .25, lamp_depth = .1;
static const double above_arch = .08, parapet_height = .9, parapet[2] = {.22, .42};

typedef struct storey {
    double floor, foot, capital, spring, ceiling; /* heights: of the floor, and where each of these begins */
} storey;

static const storey storeys[2] = {{0, .3, 2.4, 2.6, 4.2}, {4.5, 5.5, 6.7, 6.85, 8.4}};

enum { BAYS_ACROSS = 2, BAYS_LEAST = 3, BAYS_MOST = 8, PER_BAY = 1500 };
enum { ARCH_PARTS = 8, ROUND_FROM = 40000, ATRIUM_ELEMENTS = 79232 };
enum { FLOOR, CEILING, WALL, COLUMN, ARCH, PARAPET, ROOF, LAMP, GROUPS };

static const scene_draft_material paving = {"paving", {.48, .42, .36}, {0, 0, 0}};
static const scene_draft_material plaster = {"plaster", {.7, .64, .54}, {0, 0, 0}};
static const scene_draft_material marble = {"marble", {.65, .63, .6}, {0, 0, 0}};
static const scene_draft_material brick = {"brick", {.55, .33, .24}, {0, 0, 0}};
static const scene_draft_material light = {"light", {.7, .7, .7}, {40, 34, 26}};

static const patch_group groups[GROUPS] = {{"floor", &paving},  {"ceiling", &plaster}, {"wall", &plaster},
                                           {"column", &marble}, {"arch", &brick},      {"parapet", &marble},
                                           {"roof", &paving},   {"lamp", &light}};

enum { OF_FLOOR = BLOCK_SOLID, OF_WALL, OF_SLAB, OF_ROOF, OF_COLUMN, OF_PARAPET, OF_LAMP };
static const block_stuff stuffs[] = {
    {FLOOR, FLOOR, FLOOR},    {WALL, WALL, CEILING},       {FLOOR, WALL, CEILING}, {ROOF, WALL, CEILING},
    {COLUMN, COLUMN, COLUMN}, {PARAPET, PARAPET, PARAPET}, {LAMP, LAMP, LAMP}};

typedef struct atrium {
    court hall;
    size_t sides; /* of a column */
    blocks all;
    patch_list list;
} atrium;

/* Between two columns: how far along the side. */
typedef struct opening {
    double low, high;
} opening;

/* The wall above an arch on both of its faces, and the arch from below, in flat parts; the blocks leave out
 * what is between its feet and the height above. */
static lam_status add_arch(atrium *a, int side, const opening *o, double spring, lam_error *error) {
    lam_status status = LAM_OK;
    const double radius = (o->high - o->low) / 2, top = block_place(spring + radius + above_arch);
    const court_box made = {{0, square}, {o->low, o->high}, {spring, top}};
    double foot[2][ARCH_PARTS + 1][3], head[2][ARCH_PARTS + 1][3]; /* on the hall's face, on the gallery's */
    for (int k = 0; k <= ARCH_PARTS; k++) {
        const double angle = M_PI * k / ARCH_PARTS, rise = radius * sin(angle);
        const double along = k == 0 ? o->low : k == ARCH_PARTS ? o->high : o->low + radius * (1 - cos(angle));
        for (int face = 0; face < 2; face++) {
            court_point(&a->hall, side, face * square, along, k % ARCH_PARTS == 0 ? spring : spring + rise,
                        foot[face][k]);
            court_point(&a->hall, side, face * square, along, top, head[face][k]);
        }
    }
    for (int k = 0; k < ARCH_PARTS; k++) {
        const double *parts[3][4] = {{head[0][k], head[0][k + 1], foot[0][k + 1], foot[0][k]},
                                     {foot[1][k], foot[1][k + 1], head[1][k + 1], head[1][k]},
                                     {foot[0][k], foot[0][k + 1], foot[1][k + 1], foot[1][k]}};
        for (int part = 0; part < 3; part++) {
            double quad[4][3];
            for (int i = 0; i < 4; i++) memcpy(quad[i], parts[part][i], sizeof *quad);
            TRY(patch_add(&a->list, (const double(*)[3])quad, 4, part < 2 ? WALL : ARCH, error));
        }
    }
    TRY(court_add(&a->hall, side, BLOCK_MADE, &made, &a->all, error));
done:
    return status;
}

/* A column from the square foot to the square capital, both of which are blocks. */
static lam_status add_column(atrium *a, int side, double along, const storey *s, lam_error *error) {
    lam_status status = LAM_OK;
    const double height = s->capital - s->foot, half = square / 2;
    const double profile[][2] = {{0, .27},           {.12, .27},          {.2, .2},
                                 {height - .3, .17}, {height - .06, .28}, {height, .28}};
    enum { RINGS = sizeof profile / sizeof *profile };
    const court_box foot = {{0, square}, {along - half, along + half}, {s->floor, s->foot}};
    const court_box shaft = {{0, square}, {along - half, along + half}, {s->foot, s->capital}};
    const court_box capital = {{0, square}, {along - half, along + half}, {s->capital, s->spring}};
    double middle[3], low[2], high[2];
    court_point(&a->hall, side, half, along, 0, middle);
    for (int axis = 0; axis < 2; axis++) {
        low[axis] = block_place(middle[axis] - half);
        high[axis] = block_place(middle[axis] + half);
    }
    const column c = {{middle[0], middle[1]}, a->sides, COLUMN};
    TRY(court_add(&a->hall, side, OF_COLUMN, &foot, &a->all, error));
    TRY(court_add(&a->hall, side, BLOCK_MADE, &shaft, &a->all, error));
    TRY(court_add(&a->hall, side, OF_COLUMN, &capital, &a->all, error));
    TRY(column_square(&c, low, high, s->foot, profile[0][1], false, &a->list, error));
    for (int k = 0; k + 1 < RINGS; k++)
        TRY(column_band(&c, s->foot + profile[k][0], profile[k][1],
                        k + 2 < RINGS ? s->foot + profile[k + 1][0] : s->capital, profile[k + 1][1], &a->list,
                        error));
    TRY(column_square(&c, low, high, s->capital, profile[RINGS - 1][1], true, &a->list, error));
done:
    return status;
}

/* One side: columns from the first corner up to the one at the other end, which is the next side's; between
 * them arches and, above the ground, parapets; a lamp behind each. */
static lam_status add_side(atrium *a, int side, const storey *s, lam_error *error) {
    lam_status status = LAM_OK;
    const double end = court_half(&a->hall, side) + square;
    const size_t bays = (size_t)lround((2 * end - square) / bay);
    const court_box wall = {{0, square}, {-end, end}, {s->spring, s->ceiling}};
    TRY(court_add(&a->hall, side, OF_WALL, &wall, &a->all, error));
    for (size_t k = 0; k < bays; k++) {
        const double along = block_place(-end + square / 2 + bay * (double)k);
        const opening between = {block_place(along + square / 2), block_place(along + bay - square / 2)};
        const double middle[2] = {(square + gallery_end) / 2, (between.low + between.high) / 2};
        const court_box rail = {
            {parapet[0], parapet[1]}, {between.low, between.high}, {s->floor, s->floor + parapet_height}};
        const court_box lamp = {{middle[0] - half_lamp, middle[0] + half_lamp},
                                {middle[1] - half_lamp, middle[1] + half_lamp},
                                {s->ceiling, s->ceiling + lamp_depth}};
        TRY(add_column(a, side, along, s, error));
        TRY(add_arch(a, side, &between, s->spring, error));
        TRY(court_add(&a->hall, side, OF_LAMP, &lamp, &a->all, error));
        if (s->floor > 0) TRY(court_add(&a->hall, side, OF_PARAPET, &rail, &a->all, error));
    }
done:
    return status;
}

static lam_status add_house(atrium *a, lam_error *error) {
    lam_status status = LAM_OK;
    const court *hall = &a->hall;
    blocks *all = &a->all;
    TRY(court_add_square(hall, BLOCK_AIR, house_end, -slab, sky, all, error));
    TRY(court_add_square(hall, OF_FLOOR, house_end, -slab, 0, all, error));
    TRY(court_add_square(hall, OF_WALL, house_end, 0, storeys[1].ceiling, all, error));
    TRY(court_add_square(hall, OF_SLAB, house_end, storeys[0].ceiling, storeys[1].floor, all, error));
    TRY(court_add_square(hall, OF_ROOF, house_end, storeys[1].ceiling, storeys[1].ceiling + slab, all,
                         error));
    TRY(court_add_square(hall, BLOCK_AIR, 0, 0, sky, all, error));
    for (int k = 0; k < 2; k++) {
        TRY(court_add_square(hall, BLOCK_AIR, gallery_end, storeys[k].floor, storeys[k].ceiling, all, error));
        for (int side = 0; side < COURT_SIDES; side++) TRY(add_side(a, side, &storeys[k], error));
    }
done:
    return status;
}

lam_status generate_atrium(scene_draft *d, const generate_options *options, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t wanted = options->elements > 0 ? options->elements : ATRIUM_ELEMENTS;
    const size_t fitting = wanted / PER_BAY;
    const size_t bays = fitting < BAYS_LEAST ? BAYS_LEAST : fitting > BAYS_MOST ? BAYS_MOST : fitting;
    atrium a = {.hall = {{(bay * (double)bays - square) / 2, (bay * BAYS_ACROSS - square) / 2}},
                .sides = wanted < ROUND_FROM ? 8 : COLUMN_SIDES_MOST,
                .list = {.groups = groups, .n_groups = GROUPS}};
    TRY(add_house(&a, error));
    TRY(blocks_patches(&a.all, stuffs, &a.list, error));
    TRY(patches_draw(&a.list, d, options, wanted, error));
done:
    blocks_free(&a.all);
    patches_free(&a.list);
    return status;
}
