/* The parts of the reader of placed luminaires. Private to solver/luminaire. */
#ifndef LAMBERT_LUMINAIRE_PLACED_PARTS_H
#define LAMBERT_LUMINAIRE_PLACED_PARTS_H

#include "solver/luminaire/list_values.h"
#include "solver/luminaire/placed.h"

/* The list that is read. */
typedef struct placed_reading {
    const char *name; /* of the file, with which messages begin */
    double unit;      /* metres */
    char up;          /* x, y or z */
    json_t *files;
    placed_luminaires *out;
    size_t capacity, files_capacity, ignored_capacity;
} placed_reading;

/* Adds the luminaires of an entry: one, or a row or grid. entry: as in placed_luminaire. Errors:
 * LAM_ERR_ARGUMENT, LAM_ERR_MEMORY. */
lam_status placed_entry(placed_reading *r, json_t *value, size_t entry, lam_error *error);

/* The place of an entry in messages: "FILE: luminaires[3]", "FILE: line 3". */
enum { PLACED_PLACE = 320 };
void placed_place(const char *name, bool is_csv, size_t entry, char out[PLACED_PLACE]);

/* Adds the entries of a CSV file, of which each line becomes an object as those of JSON are. */
lam_status placed_csv(const luminaire_source *s, placed_reading *r, lam_error *error);

/* True where the first line names columns of such a file. */
bool placed_csv_is_it(const luminaire_source *s);

/* The frame of a luminaire that hangs in a scene with this axis upwards: z is up, and x (C0) is east, the
 * axis x of a scene or, where that is up, y. */
void placed_hang(char up, placed_luminaire *l);

/* The frame of one that sends gamma 0 along aim, both of any length. Its C0 is the part of c0 across the aim;
 * c0 NULL: that of east, or of up where the aim lies along east, as a luminaire that is tilted to it has C0.
 * Then it is turned about its own z by degrees. False where c0 is along the aim. */
bool placed_aim(const double aim[3], const double *c0, double degrees, char up, placed_luminaire *l);

/* The frame of one that hung and was turned about an axis. */
void placed_turn(const double axis[3], double degrees, char up, placed_luminaire *l);

/* The limits of placed_planck, in K. */
#define PLACED_KELVIN_LEAST 1667
#define PLACED_KELVIN_MOST 25000

/* The colour of a black body, of luminance 1: linear Rec. 709, without light below 0. */
void placed_planck(double kelvin, double colour[3]);

#endif
