/* The parts of the reader of sensors. Private to solver/sensor. */
#ifndef LAMBERT_SENSOR_SENSORS_PARTS_H
#define LAMBERT_SENSOR_SENSORS_PARTS_H

#include "solver/luminaire/list_values.h"
#include "solver/sensor/sensors.h"

/* The list that is read. */
typedef struct sensors_reading {
    const char *name; /* of the file, with which messages begin */
    double unit;      /* metres */
    char up;          /* x, y or z */
    const mesh *m;    /* or NULL */
    sensor_list *out;
    size_t sets_capacity, receivers_capacity, cells_capacity;
} sensors_reading;

enum { SENSORS_PLACE = 320 };

/* Adds the sets of an array of JSON, of one kind. Errors: LAM_ERR_ARGUMENT, LAM_ERR_MEMORY. */
lam_status sensors_array(sensors_reading *r, sensor_set_kind kind, const json_t *array, lam_error *error);

/* The unit vector upwards. */
void sensors_up(char up, double out[3]);

/* Reads a set of probes; set: its kind and entry. */
lam_status sensors_probe_set(sensors_reading *r, json_t *value, const char *place, sensor_set *set,
                             lam_error *error);

/* Reads the name of a set. */
lam_status sensors_set_name(const json_t *value, const char *place, sensor_set *set, lam_error *error);

/* Begins a set, to which sensors_add adds receivers. place begins messages. */
lam_status sensors_begin(sensors_reading *r, const sensor_set *set, const char *place, lam_error *error);

/* Adds a receiver to the last set; of a cube, its six, of a probe, its nine. */
lam_status sensors_add(sensors_reading *r, const receiver *one, uint32_t cell, const char *place,
                       lam_error *error);

/* True for a text that may be a name: 1 to 63 bytes of one line, without '=' and ','; else limit says so. */
bool sensors_is_name(const char *text, size_t length, const char **limit);

/* Adds the sets of a CSV file: lines of the same name that follow each other are one. */
lam_status sensors_csv(const luminaire_source *s, sensors_reading *r, lam_error *error);

/* Adds the points of a file of Radiance as one set. */
lam_status sensors_pts(const luminaire_source *s, const char *set_name, sensors_reading *r, lam_error *error);

/* True where the first line has six numbers; where it names columns of a CSV file. */
bool sensors_is_pts(const luminaire_source *s);
bool sensors_is_csv(const luminaire_source *s);

/* A grid over the main plane of a group, or over a polygon. */
typedef struct sensors_area {
    const char *place; /* begins messages */
    const char *group; /* NULL: the polygon */
    size_t n_corners;
    const double (*corner)[3];      /* [n_corners], m */
    double height, border, spacing; /* m; spacing 0: that of EN 12464-1 */
} sensors_area;

/* Cells of an area whose middles lie in it, and no nearer to its rim than the border. */
typedef struct sensors_cells {
    size_t rows, columns, n;
    double spacing[2], normal[3]; /* the normal of the plane, upwards where it lies flat */
    double (*at)[3];              /* [n], m, raised by the height */
    uint32_t *cell;               /* [n] */
} sensors_cells;

/* Finds them. The caller frees at and cell. Errors: LAM_ERR_ARGUMENT (no such group, corners that are in no
 * plane, no cell, too many), LAM_ERR_MEMORY. */
lam_status sensors_cells_find(sensors_reading *r, const sensors_area *area, sensors_cells *out,
                              lam_error *error);

/* The spacing of EN 12464-1 for an area of these sides: .2 5^(log10 d) m, at most 10, with d the longer side,
 * or the shorter one where that is at most half of it. */
double sensors_en12464(double longer, double shorter);

#endif
