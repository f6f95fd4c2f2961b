/* Lists of sensors: named sets of receivers. A file of them is JSON,
 *     {"unit": "m",
 *      "points": [{"name": "desk", "at": [[1, 1, .75]], "normal": [0, 0, 1]}],
 *      "grids": [{"name": "room", "over": "floor", "height": .85, "spacing": "en12464", "border": .5}],
 *      "eyes": [{"name": "seat", "at": [2, 3, 1.2], "view": [0, 1, 0]}],
 *      "cylinders": [...], "semicylinders": [...], "spheres": [...], "cubes": [...],
 *      "probes": [{"name": "hall", "from": [1, 1, 1], "steps": [[2, 0, 0], [0, 2, 0]], "counts": [4, 3]}]}
 * or CSV with the columns name, x, y, z, nx, ny, nz, or points as Radiance has them, .pts: six numbers a
 * line. Must not know what light comes to them. */
#ifndef LAMBERT_SENSOR_SENSORS_H
#define LAMBERT_SENSOR_SENSORS_H

#include "solver/luminaire/luminaire.h"
#include "solver/scene/mesh.h"
#include "solver/sensor/receiver.h"

enum { SENSORS_MOST = 1000000, SENSOR_SETS_MOST = 100000, SENSOR_NAME = 64, SENSOR_CORNERS_MOST = 1000 };

/* Bytes of a file of sensors. */
#define SENSORS_BYTES_MOST ((size_t)64 << 20)

/* The kinds of sets. A cube is six planes, which look along +x, -x, +y, -y, +z and -z; a probe is nine
 * spherical harmonics. */
typedef enum sensor_set_kind {
    SENSOR_POINTS,
    SENSOR_GRIDS,
    SENSOR_EYES,
    SENSOR_CYLINDERS,
    SENSOR_SEMICYLINDERS,
    SENSOR_SPHERES,
    SENSOR_CUBES,
    SENSOR_PROBES,
    SENSOR_SET_KINDS
} sensor_set_kind;

/* The word of a kind, as a list has it: "points". */
const char *sensor_set_word(sensor_set_kind kind);

/* The cell of a receiver that lies in no grid. */
#define SENSOR_NO_CELL 0xFFFFFFFFu

typedef struct sensor_set {
    char name[SENSOR_NAME];
    sensor_set_kind kind;
    size_t first, count;  /* of the receivers of the list */
    size_t rows, columns; /* of a grid, some of whose cells may have no receiver; else 0 */
    double spacing[2];    /* m, of columns and of rows */
    size_t entry;         /* in the file: its place in the array of its kind from 0, or the line */
} sensor_set;

typedef struct sensor_list {
    size_t n_sets, n;
    sensor_set *sets;
    receiver *receivers; /* [n] */
    uint32_t *cell;      /* [n], row * columns + column of its grid, or SENSOR_NO_CELL */
    luminaire_warnings warnings;
} sensor_list;

typedef struct sensors_options {
    double unit; /* metres of a unit of coordinates where the file states none; 0: 1 */
    char up;     /* the axis of the scene that points up, x, y or z: normals look there unless stated; 0: z */
    const mesh *m; /* for grids over groups; NULL: these are refused */
} sensors_options;

/* Reads a list. The caller frees *out by sensors_free. Errors: LAM_ERR_IO, LAM_ERR_MEMORY, LAM_ERR_FORMAT (no
 * JSON, no CSV), LAM_ERR_ARGUMENT; each names the file, the entry or the line, the value and its limit. Cost:
 * O(bytes), and for each grid O(elements of the group, cells). */
lam_status sensors_read(const char *path, const sensors_options *options, sensor_list *out, lam_error *error);

/* The same of a text; its name says the format where its content does not. */
lam_status sensors_read_text(const char *name, const char *text, size_t length,
                             const sensors_options *options, sensor_list *out, lam_error *error);

void sensors_free(sensor_list *l);

/* The first harmonic of a probe at the origin, in the axes of the scene or, y_up, in those of glTF, three.js
 * and Godot, into which the axis of the scene that points up, `up`, is turned. */
receiver sensors_probe(bool y_up, char up);

#endif
