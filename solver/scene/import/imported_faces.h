/* The result of a scene reader: the polygons of the file, then quads and triangles with names and materials.
 * Filled in the child process, sent through a pipe, checked by the parent. Private to solver/scene/import. */
#ifndef LAMBERT_SCENE_IMPORT_IMPORTED_FACES_H
#define LAMBERT_SCENE_IMPORT_IMPORTED_FACES_H

#include "solver/base/scene/punctual_lights.h"
#include "solver/base/scene/scene_cameras.h"
#include "solver/scene/polygon_split.h"
#include "solver/scene/tables.h"
#include "solver/scene/texture.h"

#include <stdbool.h>

/* Lines for the user, cut with a count when they are too many. */
typedef struct import_warnings {
    char text[2048]; /* '\n' between the lines */
    uint64_t omitted;
} import_warnings;

void import_warn(import_warnings *w, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* The image of a material's reflectance or emission. */
typedef struct imported_texture {
    uint32_t image;          /* 1 + its index; 0: none that is read */
    uint32_t named;          /* 1: the file names one, which may not be read */
    uint32_t wrap[2];        /* texture_wrap in u and in v */
    uint32_t coordinates[2]; /* [0]: the set of the file that it takes; [1]: 0 */
    double transform[2][3];  /* from coordinates of the file to those of the image, v downwards */
} imported_texture;

typedef struct imported_material {
    double diffuse[3], emission[3];
    uint64_t defined;     /* 0: the file only names it */
    uint64_t has_diffuse; /* 0: the file gives none */
    uint64_t two_sided;   /* 1: its faces have it on their backs, too */
    double transmittance; /* of a pane (scene/glass.h); 0: it is opaque */
    imported_texture textures[TEXTURE_QUANTITIES];
} imported_material;

/* A corner of a polygon that has coordinates of images, or colours, which multiply its reflectance. */
typedef struct imported_corner {
    double uv[TEXTURE_QUANTITIES][2], colour[3];
} imported_corner;

typedef struct imported_faces {
    /* Polygons: polygon i has the corners first[i] .. first[i+1]-1 of corners, indices into vertices. */
    double (*vertices)[3];
    size_t n_vertices, vertex_capacity;
    uint32_t *corners;
    size_t n_corners, corner_capacity;
    struct imported_polygon {
        size_t first;
        uint32_t n_corners, object, material, line; /* line 0: the format has none */
    } *polygons;
    size_t n_polygons, polygon_capacity; /* the parent knows their number alone: the faces of the file */

    /* Skins of some of the polygons, in their order: the same number of corners, from first on. */
    struct imported_skin {
        size_t polygon, first;
    } *skins;
    imported_corner *skin_corners;
    size_t n_skins, skin_capacity, n_skin_corners, skin_corner_capacity;

    /* Elements, after imported_faces_split. */
    point_table points;
    struct imported_element {
        uint32_t corners[4], object, material;
        uint32_t polygon; /* that it is, or is a part of */
    } *elements;
    size_t n_elements, element_capacity;
    uint64_t dropped; /* faces without an area */

    /* Elements with a skin, in their order; surfaces are materials, lengths those of the file. */
    texture_face *faces;
    uint32_t *face_elements;
    size_t n_faces, face_capacity, face_element_capacity;

    /* Images; one that is not read has no pixels. Keys are paths, or numbers in the scene file. */
    texture_image *images;
    size_t n_images, image_capacity;
    name_table image_keys;

    name_table objects, materials;
    imported_material *values; /* [materials.n] */
    size_t value_capacity;
    scene_camera *cameras; /* in units of the file, settled; names differ */
    size_t n_cameras, camera_capacity;
    punctual_light *punctual; /* in units of the file, settled; names differ */
    size_t n_punctual, punctual_capacity;
    size_t latin1;      /* names that were not UTF-8 and were read as Latin-1 */
    const char *assets; /* folder that files of the scene may lie in beside the scene's own; NULL: none */
    const char *source; /* the file that has the bytes of the scene; NULL: its path */
    const char *format; /* "obj", "GLB"; NULL: by the extension of its path */
    double unit;        /* metres of the file's, for people; 0: not known yet */
    import_warnings warnings;
} imported_faces;

void imported_faces_free(imported_faces *s);

lam_status imported_faces_add_vertex(imported_faces *s, const double vertex[3], lam_error *error);
lam_status imported_faces_add_polygon(imported_faces *s, const uint32_t *corners, size_t n, uint32_t object,
                                      uint32_t material, uint32_t line, lam_error *error);

/* The skin of the polygon that was added last, with a corner for each of its. */
lam_status imported_faces_add_skin(imported_faces *s, const imported_corner *corners, lam_error *error);

/* The index of the object of this name, or of the material, which is made with no values when it is new. A
 * name that is not UTF-8 is read as Latin-1, and counted. */
lam_status imported_faces_add_object(imported_faces *s, const char *name, size_t length, uint32_t *index,
                                     lam_error *error);
lam_status imported_faces_add_material(imported_faces *s, const char *name, size_t length, uint32_t *index,
                                       lam_error *error);

/* Adds a camera, whose name is made different from those before: NAME-2 and so on. One that cannot be
 * settled, or beyond SCENE_CAMERAS_MOST, is left out with a warning. */
lam_status imported_faces_add_camera(imported_faces *s, const char *path, const scene_camera *camera,
                                     lam_error *error);

/* Turns polygons into elements: planar convex quads stay, others become triangles, faces without an area are
 * counted in dropped. Equal vertices are shared, unused ones dropped. Errors: LAM_ERR_FORMAT for an empty
 * scene or a bad index. */
lam_status imported_faces_split(imported_faces *s, const char *path, lam_error *error);

/* *image = 1 + the index of the image of a key, decoded where the key is new, or 0 where it cannot be read,
 * which a warning says once for each key. label: its name for people. imported_faces_find_image looks for the
 * file as asset_find does. Errors: LAM_ERR_MEMORY for the tables alone. */
lam_status imported_faces_add_image(imported_faces *s, const char *path, const char *key, const char *label,
                                    const char *bytes, size_t length, uint32_t *image, lam_error *error);
lam_status imported_faces_find_image(imported_faces *s, const char *path, const char *file, uint32_t *image,
                                     lam_error *error);

/* The same for an image that is known not to be readable. */
lam_status imported_faces_lack_image(imported_faces *s, const char *path, const char *key, const char *label,
                                     const char *why, lam_error *error);

/* Halves the largest images until all have few enough pixels together. */
void imported_faces_fit_images(imported_faces *s);

/* The parts of a glTF's material that the library does not tell. */
typedef struct gltf_material {
    char *name;           /* NULL: it has none */
    double strength;      /* KHR_materials_emissive_strength; 1 */
    double diffuse;       /* the share of its colour that a diffuse surface has: what is neither transmitted
                             (KHR_materials_transmission) nor blended with what lies behind (alphaMode); 1 */
    double transmittance; /* 0: opaque */
    bool two_sided;
    imported_texture textures[TEXTURE_QUANTITIES];
} gltf_material;

/* Reads the materials of a glTF or GLB with their images, *out [*n], freed by gltf_materials_free, in the
 * file's order. Errors: LAM_ERR_FORMAT where it requires an extension which changes what is read and is not
 * read here; other faults are the library's to tell. */
lam_status gltf_read_materials(const char *path, const char *bytes, size_t length, imported_faces *s,
                               gltf_material **out, size_t *n, lam_error *error);
void gltf_materials_free(size_t n, gltf_material *materials);

/* Numbers that a rewritten glTF has in place of compressed views, and of integers, as files of these names.
 */
#define GLTF_UNPACKED "lambert-unpacked.bin"
#define GLTF_NUMBERS "lambert-numbers.bin"
typedef struct gltf_numbers {
    char *bytes;
    size_t length, capacity;
} gltf_numbers;

/* Rewrites a glTF or GLB for the library: with a child for each instance of a node (EXT_mesh_gpu_instancing),
 * with plain bytes, in unpacked, in place of compressed ones, with floats, in numbers, in place of integers,
 * without bones and lights, and with GLTF_NUMBER and its place in the file for the name of each material;
 * warns of what is left out.
 * *out is a copy of the file, freed by the caller as the bytes of both, or NULL where there is nothing to
 * rewrite. Errors: LAM_ERR_FORMAT (instances, views or integers that cannot be read, or too many),
 * LAM_ERR_MEMORY. */
#define GLTF_NUMBER "lambert material "
lam_status gltf_rewrite(const char *path, const char *bytes, size_t length, imported_faces *s, char **out,
                        size_t *out_length, gltf_numbers *unpacked, gltf_numbers *numbers, lam_error *error);

/* Refuses a PLY that is shorter than its header says: a library may take minutes to notice. */
lam_status ply_check_head(const char *path, const char *bytes, size_t length, lam_error *error);

/* Moves a view of a glTF or GLB to its JSON, which is the first chunk of a GLB; a damaged GLB stays as it is.
 */
void gltf_find_json(const char **bytes, size_t *length);

/* Adds the perspective cameras of the nodes of a glTF's or GLB's scene, in the order of its tree, in scene
 * coordinates and by the names of their nodes. Broken JSON has none: the library says so. Errors:
 * LAM_ERR_MEMORY. */
lam_status gltf_read_cameras(const char *path, const char *bytes, size_t length, imported_faces *s,
                             lam_error *error);

/* Adds the lights that nodes of the scene have by KHR_lights_punctual, in the order of its tree, in scene
 * coordinates and by the names of their nodes, made different, NAME-2 and so on; lines say how many there
 * are, and how many nodes of no scene or another one have. One without a usable place or direction is left
 * out with a warning. Broken JSON has none. O(n). Errors: LAM_ERR_FORMAT (a light that is not there, or a
 * value of one that is wrong), LAM_ERR_MEMORY. */
lam_status gltf_read_lights(const char *path, const char *bytes, size_t length, imported_faces *s,
                            lam_error *error);

/* Some writers of GLB do not pad chunks to 4 bytes, which the library refuses. *out is a padded copy, freed
 * by the caller, or NULL where the file is not a GLB or is padded. Errors: LAM_ERR_MEMORY. */
lam_status glb_padded(const char *glb, size_t length, char **out, size_t *out_length, lam_error *error);

/* The library takes an STL for text where it begins with "solid" in small letters, and for binary where it
 * has no byte more than its triangles. *out is a copy of a text that begins so, freed by the caller, its
 * words in small letters but for names of solids; NULL for any other file. *out_length: bytes to be read.
 * Errors: LAM_ERR_MEMORY. */
lam_status stl_normalised(const char *bytes, size_t length, char **out, size_t *out_length, lam_error *error);

/* A reader of one family of formats; runs in the child. */
typedef lam_status scene_reader(const char *path, imported_faces *s, lam_error *error);
scene_reader obj_read;
scene_reader assimp_read;

/* Runs reader on path in a child process under limits and receives the elements, names and materials (not the
 * polygons). Every index and size is checked. */
typedef struct child_limits {
    unsigned cpu_seconds;
    size_t memory_bytes;         /* beyond that of the caller */
    const char *assets, *format; /* of imported_faces */
    double unit;                 /* the same */
    int input;                   /* the descriptor of a file that has the scene's bytes; 0: its path */
} child_limits;

lam_status import_in_child(scene_reader *reader, const char *path, const child_limits *limits,
                           imported_faces *s, lam_error *error);

#endif
