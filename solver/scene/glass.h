/* The elements of a mesh that are panes (scene_glass.h), and how their backs and reflectances must be. Must
 * not know rays. */
#ifndef LAMBERT_SCENE_GLASS_H
#define LAMBERT_SCENE_GLASS_H

#include "solver/base/scene/scene_glass.h"
#include "solver/scene/mesh.h"

static inline bool mesh_is_pane(const mesh *m, size_t element) {
    return m->glass != NULL && m->glass[m->group[element]].transmittance > 0;
}

/* The part that an element of a pane passes. */
double mesh_pane_passes(const mesh *m, size_t element, double cosine);

/* The largest sum of form factors of a row (glass_row_most). */
static inline double mesh_row_most(const mesh *m) {
    return glass_row_most(m->glass, m->n_glass);
}

/* The groups that are panes, those of backs left out: these lie behind the others. */
size_t mesh_pane_groups(const mesh *m);

/* Makes a group a pane, or opaque again. Errors: LAM_ERR_MEMORY. */
lam_status mesh_set_glass(mesh *m, size_t group, const struct group_glass *glass, lam_error *error);

/* Gives a mesh the panes of another one, by whose groups its elements are numbered. Errors: LAM_ERR_MEMORY.
 */
lam_status mesh_copy_glass(const mesh *from, mesh *to, lam_error *error);

/* The panes of a scene, once they are settled. */
typedef struct glass_report {
    size_t groups, faces; /* that are panes */
    size_t limited;       /* faces whose reflectance was more than what they do not pass, and is that now */
    double limited_most;  /* the largest such reflectance before */
} glass_report;

/* Settles the panes of a mesh before its backs are made: each face of one gets a back, as light comes from
 * both sides, unless other faces of panes cover its place and look the other way; and none reflects more than
 * it does not pass. Does nothing where there are no panes. O(n log n). Errors: LAM_ERR_MEMORY. */
lam_status mesh_settle_glass(mesh *m, glass_report *report, lam_error *error);

/* The same limit for the elements of a divided mesh, which have the means of their own parts of images. O(n).
 */
void mesh_limit_panes(mesh *m);

/* /mesh/glass of a store, and its law; nothing where there are no panes. Loading checks every value. */
lam_status mesh_save_glass(const mesh *m, store *s, lam_error *error);
lam_status mesh_load_glass(store *s, mesh *m, lam_error *error);

#endif
