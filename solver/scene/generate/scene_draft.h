/* A scene in progress: faces in named groups with materials, and its OBJ + MTL files. Private to
 * solver/scene/generate. */
#ifndef LAMBERT_SCENE_GENERATE_SCENE_DRAFT_H
#define LAMBERT_SCENE_GENERATE_SCENE_DRAFT_H

#include "solver/scene/generate/generate.h"
#include "solver/scene/tables.h"

typedef struct scene_draft_material {
    const char *name;
    double diffuse[3], emission[3];
} scene_draft_material;

typedef struct scene_draft {
    bool counting;    /* faces are counted, not kept */
    double stretch;   /* of cells along a quad's first edge; 0 means 1 */
    int decimals;     /* of coordinates in the file; 0: as many as read back as the same number */
    const void *plan; /* of a scene_draft_builder, beside its options; not owned */
    size_t n_faces;
    point_table points;
    struct scene_draft_face {
        uint32_t corners[4], group; /* corners[3] TABLE_NONE: a triangle */
    } *faces;
    size_t face_capacity;
    struct scene_draft_group {
        const char *name; /* static, as materials are */
        const scene_draft_material *material;
    } *groups;
    size_t n_groups, group_capacity;
} scene_draft;

void scene_draft_free(scene_draft *d);

/* Faces added from now on belong to this group. */
lam_status scene_draft_group(scene_draft *d, const char *name, const scene_draft_material *material,
                             lam_error *error);

/* A triangle or quad, counter-clockwise seen from its front. */
lam_status scene_draft_face(scene_draft *d, const double (*corners)[3], size_t n, lam_error *error);

/* A quad as na x nb cells: na along its first edge. */
lam_status scene_draft_grid(scene_draft *d, const double quad[4][3], size_t na, size_t nb, lam_error *error);

/* A quad as cells whose sides are as close to size as whole numbers allow. */
lam_status scene_draft_cells(scene_draft *d, const double quad[4][3], double size, lam_error *error);
/* The number of cells of this size for a length, along a first edge or across it. */
size_t scene_draft_steps_along(const scene_draft *d, double length, double size);
size_t scene_draft_steps_across(const scene_draft *d, double length, double size);

/* Writes path (an .obj) and its .mtl beside it, both aside first, then renamed. A reflectance that is not
 * negative replaces every diffuse colour and turns emissions grey. */
lam_status scene_draft_write(const scene_draft *d, const char *path, double reflectance, lam_error *error);

/* Draws one kind of scene with cells of about this size. */
typedef lam_status scene_draft_builder(scene_draft *d, const generate_options *options, double size,
                                       lam_error *error);

/* Builds with the cell size (and stretch, up to 4 %) that brings the number of faces nearest to wanted. */
lam_status scene_draft_build_near(scene_draft *d, scene_draft_builder *build, const generate_options *options,
                                  size_t wanted, lam_error *error);

lam_status generate_box(scene_draft *d, const generate_options *options, lam_error *error);
lam_status generate_cornell(scene_draft *d, const generate_options *options, lam_error *error);
lam_status generate_city(scene_draft *d, const generate_options *options, lam_error *error);
lam_status generate_furnace(scene_draft *d, const generate_options *options, lam_error *error);
lam_status generate_rooms(scene_draft *d, const generate_options *options, lam_error *error);
lam_status generate_maze(scene_draft *d, const generate_options *options, lam_error *error);
lam_status generate_anechoic(scene_draft *d, const generate_options *options, lam_error *error);
lam_status generate_patio(scene_draft *d, const generate_options *options, lam_error *error);
lam_status generate_atrium(scene_draft *d, const generate_options *options, lam_error *error);
lam_status generate_canopy(scene_draft *d, const generate_options *options, lam_error *error);

#endif
