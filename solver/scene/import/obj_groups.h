/* The groups that the `g` lines of an OBJ name. Private to obj_reader.c. */
#ifndef LAMBERT_SCENE_IMPORT_OBJ_GROUPS_H
#define LAMBERT_SCENE_IMPORT_OBJ_GROUPS_H

#include "solver/scene/import/imported_faces.h"

typedef struct obj_groups {
    name_table lines; /* the texts behind `g`, each once */
    uint32_t *of;     /* [n]: the text of the line that a polygon stands under; TABLE_NONE: none */
    size_t n, capacity;
} obj_groups;

void obj_groups_free(obj_groups *g);

/* The polygon added last, of n_polygons, stands under a line, which is not empty. Errors: LAM_ERR_MEMORY. */
lam_status obj_groups_add(obj_groups *g, const char *line, size_t n_polygons, lam_error *error);

/* Sets the objects of these polygons, and warns where lines have several names. O(polygons + letters of the
 * lines). Errors: LAM_ERR_MEMORY. */
lam_status obj_groups_settle(const obj_groups *g, const char *path, imported_faces *s, lam_error *error);

#endif
