/* Rooms joined by corridors with a bend: "Aguerre 2016, figure 5.1", above on the right. Each is a plain box,
 * which sees next to nothing of the others. */
#include "solver/base/random.h"
#include "solver/base/union_find.h"
#include "solver/scene/generate/blocks.h"

#include <math.h>

/* Metres. Rooms keep a distance from the borders of their lots, so that a corridor can turn between two of
 * them. */
static const double lot = 8, half_room[2] = {1.8, 2.8}, room_height[2] = {2.6, 3.6}, outside = .3;
static const double half_corridor = .7, corridor_height = 2.2, half_lamp[2] = {.6, .3}, lamp_depth = .1;
static const double extra_share = .3; /* of the neighbours that need no corridor: these have one too */

/* The least number of elements of a room: with fewer, F is no longer of low rank, which this scene
 * demonstrates. */
enum { ROOM_ELEMENTS = 1000 };

enum { ROOMS_MOST = 12, ROOMS_ELEMENTS = 6000, FLOOR = 0, CEILING, WALL, LAMP };

static const scene_draft_material grey = {"grey", {.6, .6, .6}, {0, 0, 0}};
static const scene_draft_material light = {"light", {.6, .6, .6}, {40, 40, 40}};

static const patch_group groups[LAMP + ROOMS_MOST] = {
    {"floor", &grey},   {"ceiling", &grey}, {"wall", &grey},     {"lamp-1", &light},  {"lamp-2", &light},
    {"lamp-3", &light}, {"lamp-4", &light}, {"lamp-5", &light},  {"lamp-6", &light},  {"lamp-7", &light},
    {"lamp-8", &light}, {"lamp-9", &light}, {"lamp-10", &light}, {"lamp-11", &light}, {"lamp-12", &light}};

/* Seen from above: x, then y. */
typedef struct room {
    double low[2], high[2];
} room;

/* Between two tenths of a metre, so that no two walls are closer than that. */
static double tenths_between(uint64_t *r, double low, double high) {
    return round(random_between(r, low, high) * 10) / 10;
}

static lam_status carve(blocks *all, const room *r, double height, lam_error *error) {
    return block_add(all, BLOCK_AIR, r->low[0], r->low[1], 0, r->high[0], r->high[1], height, error);
}

/* A corridor from room a to its neighbour b along an axis: two straight pieces that end half way, and a piece
 * across that joins them. */
static lam_status add_corridor(blocks *all, uint64_t *r, const room *a, const room *b, int axis,
                               double border, double middle, lam_error *error) {
    lam_status status = LAM_OK;
    const int across = 1 - axis;
    const double at[2] = {middle + tenths_between(r, -1, -.4), middle + tenths_between(r, .4, 1)};
    const bool turned = random_next(r) % 2 == 1;
    room piece[3] = {*a, *b, *a};
    for (int k = 0; k < 2; k++) {
        const double y = at[turned ? 1 - k : k];
        piece[k].low[across] = y - half_corridor;
        piece[k].high[across] = y + half_corridor;
    }
    piece[0].low[axis] = a->high[axis];
    piece[0].high[axis] = piece[2].high[axis] = border + half_corridor;
    piece[1].low[axis] = piece[2].low[axis] = border - half_corridor;
    piece[1].high[axis] = b->low[axis];
    piece[2].low[across] = at[0] - half_corridor;
    piece[2].high[across] = at[1] + half_corridor;
    for (int k = 0; k < 3; k++) TRY(carve(all, &piece[k], corridor_height, error));
done:
    return status;
}

/* Neighbours in random order: those that are not joined yet are, and a few others. */
static lam_status add_corridors(blocks *all, const room *rooms, size_t nx, size_t ny, uint64_t seed,
                                lam_error *error) {
    lam_status status = LAM_OK;
    uint64_t order = random_stream(seed, 3), shape = random_stream(seed, 4);
    uint32_t joined[ROOMS_MOST];
    size_t pairs[2 * ROOMS_MOST], n = 0; /* a pair: 2 i + axis */
    for (uint32_t i = 0; i < nx * ny; i++) {
        joined[i] = i;
        if (i % nx + 1 < nx) pairs[n++] = 2 * i;
        if (i / nx + 1 < ny) pairs[n++] = 2 * i + 1;
    }
    for (size_t left = n; left > 0; left--) {
        const size_t drawn = (size_t)(random_next(&order) % left), pair = pairs[drawn];
        const size_t i = pair / 2, axis = pair % 2, j = axis == 0 ? i + 1 : i + nx;
        const uint32_t a = union_find_root(joined, (uint32_t)i), b = union_find_root(joined, (uint32_t)j);
        pairs[drawn] = pairs[left - 1];
        if (a == b && random_unit(&order) >= extra_share) continue;
        union_find_join(joined, a, b);
        const double lots[2] = {(double)(i % nx), (double)(i / nx)};
        TRY(add_corridor(all, &shape, &rooms[i], &rooms[j], (int)axis, lot * (lots[axis] + 1),
                         lot * (lots[1 - axis] + .5), error));
    }
done:
    return status;
}

static lam_status add_room(blocks *all, uint64_t *r, size_t number, double x, double y, room *out,
                           lam_error *error) {
    lam_status status = LAM_OK;
    const double middle[2] = {x, y}, height = tenths_between(r, room_height[0], room_height[1]);
    double lamp[2];
    for (int axis = 0; axis < 2; axis++) {
        out->low[axis] = middle[axis] - tenths_between(r, half_room[0], half_room[1]);
        out->high[axis] = middle[axis] + tenths_between(r, half_room[0], half_room[1]);
        lamp[axis] = (out->low[axis] + out->high[axis]) / 2;
    }
    TRY(carve(all, out, height, error));
    TRY(block_add(all, BLOCK_SOLID + 1 + (int)number, lamp[0] - half_lamp[0], lamp[1] - half_lamp[1], height,
                  lamp[0] + half_lamp[0], lamp[1] + half_lamp[1], height + lamp_depth, error));
done:
    return status;
}

lam_status generate_rooms(scene_draft *d, const generate_options *options, lam_error *error) {
    static const size_t plans[][2] = {{2, 1}, {3, 1}, {2, 2}, {3, 2}, {4, 2}, {3, 3}, {4, 3}};
    const size_t wanted = options->elements > 0 ? options->elements : ROOMS_ELEMENTS;
    size_t n_plans = 1;
    while (n_plans < sizeof plans / sizeof *plans &&
           plans[n_plans][0] * plans[n_plans][1] * ROOM_ELEMENTS <= wanted)
        n_plans++;
    lam_status status = LAM_OK;
    blocks all = {0};
    patch_list list = {.groups = groups};
    block_stuff stuffs[1 + ROOMS_MOST] = {{FLOOR, WALL, CEILING}};
    room rooms[ROOMS_MOST];
    uint64_t size = random_stream(options->seed, 1), shape = random_stream(options->seed, 2);
    /* one of the two largest, by the seed */
    const size_t *plan = plans[n_plans - 1 - (n_plans > 1 ? random_next(&size) % 2 : 0)],
                 n = plan[0] * plan[1];
    TRY(block_add(&all, BLOCK_SOLID, 0, 0, -outside, lot * (double)plan[0], lot * (double)plan[1],
                  room_height[1] + outside, error));
    for (size_t i = 0; i < n; i++) {
        const uint8_t lamp = (uint8_t)(LAMP + i);
        stuffs[1 + i] = (block_stuff){lamp, lamp, lamp};
        TRY(add_room(&all, &shape, i, lot * ((double)(i % plan[0]) + .5), lot * ((double)(i / plan[0]) + .5),
                     &rooms[i], error));
    }
    TRY(add_corridors(&all, rooms, plan[0], plan[1], options->seed, error));
    list.n_groups = LAMP + n;
    TRY(blocks_patches(&all, stuffs, &list, error));
    TRY(patches_draw(&list, d, options, wanted, error));
done:
    blocks_free(&all);
    patches_free(&list);
    return status;
}
