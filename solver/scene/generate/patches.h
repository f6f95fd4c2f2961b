/* A generated scene as plane patches, cut into cells once their size is known. Private to
 * solver/scene/generate. */
#ifndef LAMBERT_SCENE_GENERATE_PATCHES_H
#define LAMBERT_SCENE_GENERATE_PATCHES_H

#include "solver/scene/generate/scene_draft.h"

/* The group of a patch, an index into the scene's list of groups. */
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

/* Draws every patch in cells, about wanted of them together but at least one each, group by group. */
lam_status patches_draw(const patch_list *list, scene_draft *d, const generate_options *options,
                        size_t wanted, lam_error *error);

#endif
