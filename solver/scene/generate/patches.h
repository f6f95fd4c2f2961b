/* A generated scene as the flat patches it is cut from: cells only once their size is known. Private. */
#ifndef LAMBERT_SCENE_GENERATE_PATCHES_H
#define LAMBERT_SCENE_GENERATE_PATCHES_H

#include "solver/scene/generate/scene_draft.h"

/* What a patch belongs to: a place in the scene's list of these. */
typedef struct patch_group {
    const char *name; /* static, as materials are */
    const scene_draft_material *material;
} patch_group;

typedef struct patch {
    double corners[4][3]; /* counter-clockwise seen from the front */
    uint32_t n, group;    /* 3 or 4 corners */
} patch;

typedef struct patch_list {
    const patch_group *groups;
    size_t n_groups;
    patch *items;
    size_t n, capacity;
} patch_list;

lam_status patch_add(patch_list *list, const double (*corners)[3], size_t n, size_t group, lam_error *error);
void patches_free(patch_list *list);

/* Every patch in cells, about wanted of them together but at least one each, one group after the other. */
lam_status patches_draw(const patch_list *list, scene_draft *d, const generate_options *options,
                        size_t wanted, lam_error *error);

#endif
