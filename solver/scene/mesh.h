/* The mesh: planar elements with their materials and groups. Owns geometry; must not know form factors. */
#ifndef LAMBERT_SCENE_MESH_H
#define LAMBERT_SCENE_MESH_H

#include "solver/base/photometry.h"
#include "solver/base/progress.h"
#include "solver/base/scene/punctual_lights.h"
#include "solver/base/scene/scene_cameras.h"
#include "solver/base/scene/scene_faces.h"
#include "store/store.h"

#include <stdint.h>

/* The 4th vertex of an element that is a triangle. */
#define MESH_NO_VERTEX 0xFFFFFFFFu

/* A quad is planar and convex; its front is the side from which its vertices run counter-clockwise.
 * The last n_backs elements are the backs of others, in the order of these; with two_sided, elements n/2 ...
 * n-1 are those of elements 0 ... n/2-1. */
typedef struct mesh {
    size_t n_vertices;
    double (*vertices)[3]; /* [v][3], metres */
    size_t n;              /* elements */
    uint32_t (*elements)[4];
    double *area;       /* [n], m^2 */
    float (*normal)[3]; /* [n][3], unit, towards the front */
    uint32_t *group;    /* [n] */
    scene_faces faces;  /* of the scene file, of which elements are parts; they have parts of their own only
                           after the last change of elements but for backs */
    size_t n_groups;
    char **group_names;              /* [n_groups], one block freed by one free() */
    double *overlap;                 /* [n_groups], share of a group's area that other faces cover in the same
                                        plane (coincident.h); NULL: none */
    size_t n_channels;               /* 1 when every reflectance and emission is grey, else 3 */
    float *reflectance;              /* [C][n], in [0, 1) */
    float *emission;                 /* [C][n], W/m^2 or lm/m^2, as lights says */
    struct mesh_textures *textures;  /* NULL: none (texture.h) */
    struct scene_pictures *pictures; /* for those who show the elements; NULL: none */
    uint32_t *textured_face; /* [n], of textures, or TEXTURE_NONE; NULL: no element has a textured face */
    size_t n_cameras;
    scene_camera *cameras; /* [n_cameras], of the scene file */
    size_t n_punctual;
    punctual_light *punctual; /* [n_punctual], lights of the scene file that are no faces; /mesh has none */
    bool *has_back; /* [n]: faces that mesh_make_backs gives a second element; NULL: none, or all are made */
    size_t n_backs;
    bool *buried;   /* [n]: elements between a body and the face that it stands on, which see nothing, are not
                       seen (buried.h), and which figures of groups leave out; NULL: none, or not looked
                       for. Only after the last change of elements */
    size_t n_glass; /* that of the groups where some of them let light pass, else 0 */
    struct group_glass *glass; /* [n_glass] (glass.h); NULL: none does */
    bool glass_by_angle;       /* they pass less of light that comes aslant */
    bool glass_given;          /* --glass said more than the scene file */
    light_kind lights;         /* W or lm, of emission */
    bool two_sided;            /* every element has its back, or is one */
    double unit;               /* metres per unit of the scene file, for the record */
    double rounding;      /* m: the step of the decimals of the file, or 0 where it has more than eight */
    char up;              /* 'x', 'y' or 'z' */
    char name[128];       /* the scene file's stem */
    char source_hash[33]; /* of the faces as imported, before any subdivision: hex */
} mesh;

/* The number of corners, 3 or 4, of an element or of any other list of vertices with this layout. */
static inline size_t corner_count(const uint32_t vertices[4]) {
    return vertices[3] == MESH_NO_VERTEX ? 3 : 4;
}

static inline size_t mesh_corners(const mesh *m, size_t element) {
    return corner_count(m->elements[element]);
}

static inline bool mesh_is_buried(const mesh *m, size_t element) {
    return m->buried != NULL && m->buried[element];
}

/* Frees what a mesh owns and zeroes it. */
void mesh_free(mesh *m);

/* Computes area and normal from vertices and elements (allocating them when NULL).
 * Errors: LAM_ERR_ARGUMENT for a zero area or an index out of range, naming the element. */
lam_status mesh_measure(mesh *m, lam_error *error);

/* The refinement of a mesh; at most one of the three is set, 0 means not set. */
typedef struct mesh_refinement {
    unsigned subdivide_levels; /* the number of times that each element is split into 4 */
    double max_edge;           /* metres */
    size_t elements;           /* the number of elements, as closely as near-equal areas allow */
} mesh_refinement;

/* Refines in place; children of an element are consecutive and inherit its group, face and materials, of
 * textures the means over their own areas. */
lam_status mesh_refine(mesh *m, const mesh_refinement *how, lam_error *error);

/* The same in another mesh, which has neither cameras, lights nor names of groups until mesh_replace; parent
 * [n of out], or NULL: the face that each element is a part of. The caller frees both. */
lam_status mesh_refine_into(const mesh *m, const mesh_refinement *how, mesh *out, uint32_t **parent,
                            lam_error *error);

/* Gives the elements that are marked in has_back their backs, which lie behind all elements, in mesh order,
 * and have the faces and the materials of their fronts. Backs get groups of their own, behind the others:
 * that of `floor` is called `floor.back`, or `floor.back-2` and so on where the scene has a group of that
 * name. has_back is NULL then. Once for a mesh, after its last refinement. Errors: LAM_ERR_ARGUMENT (too many
 * elements), LAM_ERR_MEMORY. */
lam_status mesh_make_backs(mesh *m, lam_error *error);

/* Marks every element in has_back, and makes the backs, too (`--two-sided`). */
lam_status mesh_mark_two_sided(mesh *m, lam_error *error);
lam_status mesh_make_two_sided(mesh *m, lam_error *error);

/* Removes the elements that are marked in dropped [n], and groups that have none left; at least one element
 * stays. Vertices and the hash of the source stay as they are. Cost: O(n + groups). Errors: LAM_ERR_MEMORY,
 * with nothing changed. */
lam_status mesh_drop(mesh *m, const bool *dropped, lam_error *error);

/* 3-D Morton order of the element centroids (thesis 2.3): order[position] = element. order is [n]. */
lam_status mesh_z_order(const mesh *m, uint32_t *order, lam_error *error);

/* Hash of vertices, elements and sidedness: 32 hex digits and a NUL. */
void mesh_geometry_hash(const mesh *m, char hash[33]);

/* The bounding box; its centre and half its diagonal. */
void mesh_box(const mesh *m, double low[3], double high[3]);
void mesh_bounds(const mesh *m, double centre[3], double *radius);

/* The centroid of an element. */
void mesh_centroid(const mesh *m, size_t element, double centroid[3]);

/* /mesh, with its pictures, and /cameras of a store (store/FORMAT.md); loading checks every index and value.
 * row_sums are NULL where no form factors were found. */
lam_status mesh_save(const mesh *m, const double *row_sums, store *s, lam_error *error);
lam_status mesh_load(store *s, mesh *m, double **row_sums, lam_error *error);

#endif
