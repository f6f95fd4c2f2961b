/* A scene being generated: faces in named groups with materials, and its OBJ + MTL files. Private. */
#ifndef LAMBERT_SCENE_GENERATE_SCENE_DRAFT_H
#define LAMBERT_SCENE_GENERATE_SCENE_DRAFT_H

#include "solver/scene/generate/generate.h"
#include "solver/scene/tables.h"

typedef struct draft_material {
    const char *name;
    double diffuse[3], emission[3];
} draft_material;

typedef struct draft {
    bool counting;    /* faces are counted, not kept */
    double stretch;   /* of cells along a quad's first edge; 0 means 1 */
    const void *plan; /* what a draft_builder is to draw, where its options do not say it; not owned */
    size_t n_faces;
    point_table points;
    struct draft_face {
        uint32_t corners[4], group; /* corners[3] TABLE_NONE: a triangle */
    } * faces;
    size_t face_capacity;
    struct draft_group {
        const char *name; /* static, as materials are */
        const draft_material *material;
    } * groups;
    size_t n_groups, group_capacity;
} draft;

void draft_free(draft *d);

/* Faces added from now on belong to this group. */
lam_status draft_group(draft *d, const char *name, const draft_material *material, lam_error *error);

/* A triangle or quad, counter-clockwise seen from its front. */
lam_status draft_face(draft *d, const double (*corners)[3], size_t n, lam_error *error);

/* A quad as na x nb cells: na along its first edge. */
lam_status draft_grid(draft *d, const double quad[4][3], size_t na, size_t nb, lam_error *error);

/* The same with cells whose sides are as near to size as whole numbers allow. */
lam_status draft_cells(draft *d, const double quad[4][3], double size, lam_error *error);
/* How many cells of this size a length takes, along a first edge or across. */
size_t draft_steps_along(const draft *d, double length, double size);
size_t draft_steps_across(const draft *d, double length, double size);

/* Writes path (an .obj) and its .mtl beside it, both aside first, then renamed. A reflectance that is not
 * negative replaces every diffuse colour and turns emissions grey. */
lam_status draft_write(const draft *d, const char *path, double reflectance, lam_error *error);

/* One kind of scene, made with cells of about this size. */
typedef lam_status draft_builder(draft *d, const generate_options *options, double size, lam_error *error);

/* Builds with the cell size (and stretch, up to 4 %) that brings the number of faces nearest to wanted. */
lam_status draft_build_near(draft *d, draft_builder *build, const generate_options *options, size_t wanted,
                            lam_error *error);

lam_status draft_box_scene(draft *d, const generate_options *options, lam_error *error);
lam_status draft_cornell_scene(draft *d, const generate_options *options, lam_error *error);
lam_status draft_city_scene(draft *d, const generate_options *options, lam_error *error);
lam_status draft_furnace_scene(draft *d, const generate_options *options, lam_error *error);
lam_status draft_rooms_scene(draft *d, const generate_options *options, lam_error *error);
lam_status draft_maze_scene(draft *d, const generate_options *options, lam_error *error);
lam_status draft_anechoic_scene(draft *d, const generate_options *options, lam_error *error);
lam_status draft_patio_scene(draft *d, const generate_options *options, lam_error *error);
lam_status draft_atrium_scene(draft *d, const generate_options *options, lam_error *error);
lam_status draft_canopy_scene(draft *d, const generate_options *options, lam_error *error);

#endif
