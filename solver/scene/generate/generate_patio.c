/* A house of two storeys around a court under the open sky: arcades on square pillars, and rooms behind them
 * with doors and windows. As many elements as the patio of "Aguerre 2016, figure 3.6". */
#include "solver/scene/generate/court.h"

/* Metres; out from the court. Pillars stand in the first .4 of the arcades. */
static const court patio = {{5, 5}};
static const double arcade = 2.6, room_wall = .3, room_end = 6.9, house_end = 7.2;
static const double pillar = .4, pillar_step = 2.6, beam = .35, railing[2] = {.15, .25}, railing_height = .9;
static const double storeys[2][2] = {{0, 3}, {3.3, 6.3}}, slab = .3, sky = 7.4;
static const double sill = .9, lintel = 2.1, half_lamp = .4, lamp_depth = .1;

enum { PATIO_ELEMENTS = 21888, COURT = 0, FLOOR, CEILING, WALL, PILLAR, RAILING, ROOF, LAMP, GROUPS };

static const scene_draft_material stone = {"stone", {.45, .44, .4}, {0, 0, 0}};
static const scene_draft_material tiles = {"tiles", {.5, .32, .24}, {0, 0, 0}};
static const scene_draft_material plaster = {"plaster", {.75, .7, .6}, {0, 0, 0}};
static const scene_draft_material wood = {"wood", {.35, .22, .14}, {0, 0, 0}};
static const scene_draft_material light = {"light", {.75, .75, .75}, {30, 26, 20}};

static const patch_group groups[GROUPS] = {{"court", &stone},  {"floor", &tiles},  {"ceiling", &plaster},
                                           {"wall", &plaster}, {"pillar", &stone}, {"railing", &wood},
                                           {"roof", &tiles},   {"lamp", &light}};

enum { OF_COURT = BLOCK_SOLID, OF_FLOOR, OF_WALL, OF_SLAB, OF_ROOF, OF_PILLAR, OF_RAILING, OF_LAMP };
static const block_stuff stuffs[] = {
    {COURT, COURT, COURT}, {FLOOR, FLOOR, FLOOR},    {WALL, WALL, CEILING},       {FLOOR, WALL, CEILING},
    {ROOF, WALL, CEILING}, {PILLAR, PILLAR, PILLAR}, {RAILING, RAILING, RAILING}, {LAMP, LAMP, LAMP}};

/* From low to high along a side; a door, then windows. */
typedef struct plan_room {
    double low, high, openings[3][2];
} plan_room;

/* At the sides that have the corners of the house, and at the others. */
static const plan_room corner_rooms[] = {{-11.9, -4.1, {{-5.6, -4.6}, {-7.3, -6.1}}},
                                         {-3.9, 3.9, {{-.5, .5}, {-3, -1.6}, {1.6, 3}}},
                                         {4.1, 11.9, {{4.6, 5.6}, {6.1, 7.3}}}};
static const plan_room middle_rooms[] = {{-7.7, -.1, {{-2.2, -1.2}, {-4.6, -3.2}, {-7.2, -5.8}}},
                                         {.1, 7.7, {{1.2, 2.2}, {3.2, 4.6}, {5.8, 7.2}}}};

static lam_status add_room(blocks *all, int side, const double storey[2], const plan_room *r,
                           lam_error *error) {
    lam_status status = LAM_OK;
    const double begin = arcade + room_wall, middle[2] = {(begin + room_end) / 2, (r->low + r->high) / 2};
    const court_box inside = {{begin, room_end}, {r->low, r->high}, {storey[0], storey[1]}};
    const court_box lamp = {{middle[0] - half_lamp, middle[0] + half_lamp},
                            {middle[1] - half_lamp, middle[1] + half_lamp},
                            {storey[1], storey[1] + lamp_depth}};
    TRY(court_add(&patio, side, BLOCK_AIR, &inside, all, error));
    TRY(court_add(&patio, side, OF_LAMP, &lamp, all, error));
    for (int k = 0; k < 3; k++) {
        const court_box opening = {{arcade, begin},
                                   {r->openings[k][0], r->openings[k][1]},
                                   {storey[0] + (k == 0 ? 0 : sill), storey[0] + lintel}};
        TRY(court_add(&patio, side, BLOCK_AIR, &opening, all, error));
    }
done:
    return status;
}

/* Pillars under a beam, from corner to corner, and above the ground railings between them. */
static lam_status add_colonnade(blocks *all, int side, const double storey[2], lam_error *error) {
    lam_status status = LAM_OK;
    const double end = court_half(&patio, side) + pillar;
    const court_box over = {{0, pillar}, {-end, end}, {storey[1] - beam, storey[1]}};
    TRY(court_add(&patio, side, OF_WALL, &over, all, error));
    for (double along = -end; along < end; along += pillar_step) {
        const court_box post = {{0, pillar}, {along, along + pillar}, {storey[0], storey[1] - beam}};
        const court_box rail = {{railing[0], railing[1]},
                                {along + pillar, along + pillar_step},
                                {storey[0], storey[0] + railing_height}};
        TRY(court_add(&patio, side, OF_PILLAR, &post, all, error));
        if (storey[0] > 0 && along + pillar_step < end)
            TRY(court_add(&patio, side, OF_RAILING, &rail, all, error));
    }
done:
    return status;
}

static lam_status add_storey(blocks *all, const double storey[2], lam_error *error) {
    lam_status status = LAM_OK;
    TRY(court_add_square(&patio, BLOCK_AIR, arcade, storey[0], storey[1], all, error));
    for (int side = 0; side < COURT_SIDES; side++) {
        const plan_room *rooms = side % 2 == 0 ? corner_rooms : middle_rooms;
        for (int k = 0; k < (side % 2 == 0 ? 3 : 2); k++) TRY(add_room(all, side, storey, &rooms[k], error));
        TRY(add_colonnade(all, side, storey, error));
    }
done:
    return status;
}

static lam_status add_house(blocks *all, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(court_add_square(&patio, BLOCK_AIR, house_end, -slab, sky, all, error));
    TRY(court_add_square(&patio, OF_FLOOR, house_end, -slab, 0, all, error));
    TRY(court_add_square(&patio, OF_COURT, 0, -slab, 0, all, error));
    TRY(court_add_square(&patio, OF_WALL, house_end, 0, storeys[1][1], all, error));
    TRY(court_add_square(&patio, OF_SLAB, house_end, storeys[0][1], storeys[1][0], all, error));
    TRY(court_add_square(&patio, OF_ROOF, house_end, storeys[1][1], storeys[1][1] + slab, all, error));
    TRY(court_add_square(&patio, BLOCK_AIR, 0, 0, sky, all, error));
    for (int k = 0; k < 2; k++) TRY(add_storey(all, storeys[k], error));
done:
    return status;
}

lam_status generate_patio(scene_draft *d, const generate_options *options, lam_error *error) {
    lam_status status = LAM_OK;
    blocks all = {0};
    patch_list list = {.groups = groups, .n_groups = GROUPS};
    TRY(add_house(&all, error));
    TRY(blocks_patches(&all, stuffs, &list, error));
    TRY(patches_draw(&list, d, options, options->elements > 0 ? options->elements : PATIO_ELEMENTS, error));
done:
    blocks_free(&all);
    patches_free(&list);
    return status;
}
