/* Solids that are boxes, laid one over another as they are added; where solid meets air they become patches.
 * So whatever is built of them, no two faces lie on one another, none is hidden in or under a solid, and all
 * look into the air. Private. */
#ifndef LAMBERT_SCENE_GENERATE_BLOCKS_H
#define LAMBERT_SCENE_GENERATE_BLOCKS_H

#include "solver/scene/generate/patches.h"

/* What a box is filled with. Made is what the scene makes by itself, of other shapes: it has no faces here,
 * and neither has what it touches. Solid: BLOCK_SOLID + a place in the list of stuffs. */
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

/* To the millimetre, with the same bits however it was reckoned. Boxes are taken at such places, and what
 * touches them must be. */
double block_place(double x);

/* Over all that was there; the first is the whole scene, on whose border there are no faces and in which all
 * others must be. One without a width is left out. */
lam_status block_add(blocks *all, int fill, double x0, double y0, double z0, double x1, double y1, double z1,
                     lam_error *error);
void blocks_free(blocks *all);

lam_status blocks_patches(const blocks *all, const block_stuff *stuffs, patch_list *out, lam_error *error);

#endif
