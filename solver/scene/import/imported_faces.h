/* The result of a scene reader: the polygons of the file, then quads and triangles with names and materials.
 * Filled in the child process, sent through a pipe, checked by the parent. Private to solver/scene/import. */
#ifndef LAMBERT_SCENE_IMPORT_IMPORTED_FACES_H
#define LAMBERT_SCENE_IMPORT_IMPORTED_FACES_H

#include "solver/scene/polygon_split.h"
#include "solver/scene/tables.h"

#include <stdbool.h>

/* Lines for the user, cut with a count when they are too many. */
typedef struct import_warnings {
    char text[2048]; /* '\n' between the lines */
    uint64_t omitted;
} import_warnings;

void import_warn(import_warnings *w, const char *format, ...) __attribute__((format(printf, 2, 3)));

typedef struct imported_material {
    double diffuse[3], emission[3];
    uint64_t defined;     /* 0: the file only names it */
    uint64_t has_diffuse; /* 0: the file gives none */
} imported_material;

typedef struct imported_faces {
    /* Polygons: polygon i has the corners first[i] .. first[i+1]-1 of corners, indices into vertices. */
    double (*vertices)[3];
    size_t n_vertices, vertex_capacity;
    uint32_t *corners;
    size_t n_corners, corner_capacity;
    struct imported_polygon {
        size_t first;
        uint32_t n_corners, object, material, line; /* line 0: the format has none */
    } * polygons;
    size_t n_polygons, polygon_capacity;

    /* Elements, after imported_faces_split. */
    point_table points;
    struct imported_element {
        uint32_t corners[4], object, material;
    } * elements;
    size_t n_elements, element_capacity;
    uint64_t dropped; /* faces without an area */

    name_table objects, materials;
    imported_material *values; /* [materials.n] */
    size_t value_capacity;
    import_warnings warnings;
} imported_faces;

void imported_faces_free(imported_faces *s);

lam_status imported_faces_add_vertex(imported_faces *s, const double vertex[3], lam_error *error);
lam_status imported_faces_add_polygon(imported_faces *s, const uint32_t *corners, size_t n, uint32_t object,
                                      uint32_t material, uint32_t line, lam_error *error);

/* The index of the material of this name, made with no values when it is new. */
lam_status imported_faces_add_material(imported_faces *s, const char *name, size_t length, uint32_t *index,
                                       lam_error *error);

/* Turns polygons into elements: planar convex quads stay, others become triangles, faces without an area are
 * counted in dropped. Equal vertices are shared, unused ones dropped. Errors: LAM_ERR_FORMAT for an empty
 * scene or a bad index. */
lam_status imported_faces_split(imported_faces *s, const char *path, lam_error *error);

/* A reader of one family of formats; runs in the child. */
typedef lam_status scene_reader(const char *path, imported_faces *s, lam_error *error);
scene_reader obj_read;
scene_reader assimp_read;

/* Runs reader on path in a child process under limits and receives the elements, names and materials (not the
 * polygons). Every index and size is checked. */
typedef struct child_limits {
    unsigned cpu_seconds;
    size_t memory_bytes;
} child_limits;

lam_status import_in_child(scene_reader *reader, const char *path, const child_limits *limits,
                           imported_faces *s, lam_error *error);

#endif
