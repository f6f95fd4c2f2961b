/* The text of a luminaire's file, or of a list: lines, words, numbers, and where they stand. Private to
 * solver/luminaire, and to solver/sensor, whose lists are written alike. */
#ifndef LAMBERT_LUMINAIRE_SOURCE_H
#define LAMBERT_LUMINAIRE_SOURCE_H

#include "solver/luminaire/luminaire.h"

/* Real files have less than a tenth of it: 1,801 by 361 values are 5 MB. */
#define LUMINAIRE_BYTES_MOST ((size_t)16 << 20)

enum { LUMINAIRE_SETS_MOST = 1000, LUMINAIRE_WORDS_MOST = 1000, LUMINAIRE_LENGTH_MOST = 1000000 };

/* The largest intensity, cd. */
#define LUMINAIRE_CANDELA_MOST 1e15

typedef struct luminaire_source {
    const char *name;       /* with which messages begin */
    const char *text, *end; /* without byte order mark, and without blanks and marks of the end of a file */
    bool doubled;           /* its lines end in CR CR LF */
} luminaire_source;

/* Errors: LAM_ERR_FORMAT where the bytes are none, too many, UTF-16, or no text. */
lam_status luminaire_source_open(const char *name, const char *text, size_t length, luminaire_source *out,
                                 lam_error *error);

/* The same of a text of any length. */
lam_status luminaire_source_begin(const char *name, const char *text, size_t length, luminaire_source *out,
                                  lam_error *error);

/* The next line, from *at on, without its end; false at the end of the text. Lines end in CR LF, LF or CR. */
bool luminaire_source_line(const luminaire_source *s, const char **at, const char **begin, const char **end);

/* The number of the line of a place, and the column in it, both from 1. Cost: O(bytes before it). */
size_t luminaire_source_place(const luminaire_source *s, const char *at, size_t *column);

/* The next word between blanks, ends of lines and commas, from *at on; false at the end of the text. */
bool luminaire_source_word(const luminaire_source *s, const char **at, const char **begin, const char **end);

/* Blanks at both ends of a part of a text left out. */
void luminaire_trim(const char **begin, const char **end);

/* A part of a text as one line of UTF-8 for people: Latin-1 becomes UTF-8; control characters, and those that
 * turn the direction of writing, become '?'; tabs are blanks; it is cut to fit. */
void luminaire_clean(const char *begin, const char *end, char *out, size_t room);

/* True where all of the text is one finite number, such as 1, +.5, 1.0E+02, or 1.0D+02 of Fortran; a comma
 * counts as the decimal mark where comma is set. */
bool luminaire_number(const char *begin, const char *end, bool comma, double *out);

/* True from least to most, or above least; else limit says where it must be: "must not be negative". */
enum { LUMINAIRE_LIMIT = 64 };
bool luminaire_in_limits(double value, double least, double most, bool above, char limit[LUMINAIRE_LIMIT]);

/* Adds a line to warnings. */
void luminaire_warnings_add(luminaire_warnings *w, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
void luminaire_warn(luminaire *l, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Adds a word; those above LUMINAIRE_WORDS_MOST are left out. Errors: LAM_ERR_MEMORY. */
lam_status luminaire_add_word(luminaire *l, size_t *capacity, const char *key, const char *begin,
                              const char *end, lam_error *error);

/* Allocates planes, angles and candela for one plane more than n_planes, with which a turn is closed. */
lam_status luminaire_allocate_table(luminaire *l, const char *name, size_t n_planes, size_t n_angles,
                                    lam_error *error);

/* Closes a turn: the first plane once more, at its angle and 360 degrees. */
void luminaire_close_turn(luminaire *l);

/* The readers of the formats. They leave a luminaire that luminaire_free frees, also after an error. */
lam_status lm63_read(const luminaire_source *s, const luminaire_options *options, luminaire *l,
                     lam_error *error);
lam_status eulumdat_read(const luminaire_source *s, const luminaire_options *options, luminaire *l,
                         lam_error *error);

/* True where a line TILT= or the first line says that it is LM-63; where the numbers at the begin are those
 * of EULUMDAT. */
bool lm63_is_it(const luminaire_source *s);
bool eulumdat_is_it(const luminaire_source *s);

/* True where a name ends in an extension: the format of a text that has no marks of any is that of its name.
 */
bool luminaire_is_named(const char *name, const char *extension);

/* The line TILT=VALUE: *begin and *end are those of the value. */
bool lm63_is_tilt_line(const char **begin, const char **end);

/* The opening of width, length and height as an LM-63 of a version states them, in units of so many metres;
 * false, and a point, for signs that no shape has. */
bool lm63_opening(luminaire_format version, const double stated[3], double metres, luminaire_opening *out);

#endif
