/* A maze under the open sky: a tree of passages, drawn by walking at random until there is no way on and
 * going back to where there was one. */
#include "solver/base/random.h"
#include "solver/scene/generate/blocks.h"

#include <math.h>
#include <stdlib.h>

/* Metres. */
static const double passage = 1.8, wall = .3, wall_height = 2.2, sky = 3, ground_depth = .3;

/* Elements per cell of the maze, about: a maze of more elements has more cells, not finer ones. */
enum { PER_CELL = 60, LEAST_CELLS = 3, MAZE_ELEMENTS = 6000, FLOOR = 0, WALL, WALL_TOP, GROUPS };

static const scene_draft_material stone = {"stone", {.5, .5, .5}, {0, 0, 0}};
static const patch_group groups[GROUPS] = {{"floor", &stone}, {"wall", &stone}, {"wall-top", &stone}};

/* Carves cells from (x, y) on, and the walls between them. */
static lam_status carve(blocks *all, size_t x, size_t y, size_t nx, size_t ny, lam_error *error) {
    const double pitch = passage + wall, low[2] = {wall + pitch * (double)x, wall + pitch * (double)y};
    return block_add(all, BLOCK_AIR, low[0], low[1], 0, low[0] + pitch * (double)nx - wall,
                     low[1] + pitch * (double)ny - wall, wall_height, error);
}

/* One of the neighbours of a cell that were not visited yet, or the cell itself. */
static size_t way_on(const bool *visited, size_t k, size_t cell, uint64_t *r) {
    const size_t x = cell % k, y = cell / k;
    size_t ways[4], n = 0;
    if (x > 0 && !visited[cell - 1]) ways[n++] = cell - 1;
    if (x + 1 < k && !visited[cell + 1]) ways[n++] = cell + 1;
    if (y > 0 && !visited[cell - k]) ways[n++] = cell - k;
    if (y + 1 < k && !visited[cell + k]) ways[n++] = cell + k;
    return n == 0 ? cell : ways[random_next(r) % n];
}

/* k x k cells; each is entered once, from another. */
static lam_status carve_passages(blocks *all, size_t k, uint64_t seed, lam_error *error) {
    lam_status status = LAM_OK;
    uint64_t r = random_stream(seed, 1);
    bool *visited = memory_allocate(k * k, sizeof *visited, "maze", error);
    size_t *way = memory_allocate(k * k, sizeof *way, "maze", error), length = 1;
    if (visited == NULL || way == NULL) TRY(LAM_ERR_MEMORY);
    way[0] = (size_t)(random_next(&r) % (k * k));
    visited[way[0]] = true;
    while (length > 0) {
        const size_t here = way[length - 1], next = way_on(visited, k, here, &r);
        if (next == here) {
            length--;
            continue;
        }
        const size_t first = here < next ? here : next, aside = here / k == next / k;
        TRY(carve(all, first % k, first / k, 1 + aside, 2 - aside, error));
        visited[next] = true;
        way[length++] = next;
    }
done:
    free(visited);
    free(way);
    return status;
}

lam_status generate_maze(scene_draft *d, const generate_options *options, lam_error *error) {
    static const block_stuff stuffs[2] = {{FLOOR, FLOOR, FLOOR}, {WALL_TOP, WALL, WALL}};
    lam_status status = LAM_OK;
    blocks all = {0};
    patch_list list = {.groups = groups, .n_groups = GROUPS};
    const size_t wanted = options->elements > 0 ? options->elements : MAZE_ELEMENTS;
    const size_t k = (size_t)fmax(LEAST_CELLS, round(sqrt((double)wanted / PER_CELL)));
    const double side = (passage + wall) * (double)k + wall, door = wall + (passage + wall) * (double)(k - 1);
    TRY(block_add(&all, BLOCK_AIR, 0, 0, -ground_depth, side, side, sky, error));
    TRY(block_add(&all, BLOCK_SOLID, 0, 0, -ground_depth, side, side, 0, error));
    TRY(block_add(&all, BLOCK_SOLID + 1, 0, 0, 0, side, side, wall_height, error));
    TRY(carve_passages(&all, k, options->seed, error));
    TRY(block_add(&all, BLOCK_AIR, wall, 0, 0, wall + passage, wall, wall_height, error)); /* in and out */
    TRY(block_add(&all, BLOCK_AIR, door, side - wall, 0, door + passage, side, wall_height, error));
    TRY(blocks_patches(&all, stuffs, &list, error));
    TRY(patches_draw(&list, d, options, wanted, error));
done:
    blocks_free(&all);
    patches_free(&list);
    return status;
}
