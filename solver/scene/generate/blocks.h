/* Scenes of boxes of solid and air, each laid over the ones before. The borders between solid and air become
 * patches, so that no two faces overlap, none is hidden inside a solid, and all face the air. Private to
 * solver/scene/generate. */
#ifndef LAMBERT_SCENE_GENERATE_BLOCKS_H
#define LAMBERT_SCENE_GENERATE_BLOCKS_H

#include "solver/scene/generate/patches.h"

/* The filling of a box. BLOCK_MADE: the scene draws other shapes there itself; neither they nor the solids
 * they touch get faces here. A solid is BLOCK_SOLID + its index in the list of stuffs. */
enum { BLOCK_AIR, BLOCK_MADE, BLOCK_SOLID };

/* The groups of a solid's faces: on top of it, at its sides, below. */
typedef struct block_stuff {
    uint8_t top, side, under;
} block_stuff;

typedef struct block {
    double low[3], high[3];
    int fill;
} block;

typedef struct blocks {
    block *items;
    size_t n, capacity;
} blocks;

/* x rounded to the millimetre, with the same bits however x was computed. Boxes are placed so, and shapes
 * that touch them must be. */
double block_place(double x);

/* Lays a box over all previous ones. The first one is the whole scene: it contains all others, and its border
 * has no faces. A box of no width is ignored. */
lam_status block_add(blocks *all, int fill, double x0, double y0, double z0, double x1, double y1, double z1,
                     lam_error *error);
void blocks_free(blocks *all);

lam_status blocks_patches(const blocks *all, const block_stuff *stuffs, patch_list *out, lam_error *error);

#endif
