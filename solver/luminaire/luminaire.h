/* The light that a luminaire gives into each direction, as a file of a laboratory or a maker says: IES LM-63
 * of 1986, 1991, 1995, 2002 and 2019, and EULUMDAT. Knows nothing of scenes.
 *
 * A luminaire has a frame of its own: x is C0, y is C90, -z is gamma 0. So a direction (C, gamma) is
 * (sin gamma cos C, sin gamma sin C, -cos gamma). */
#ifndef LAMBERT_LUMINAIRE_LUMINAIRE_H
#define LAMBERT_LUMINAIRE_LUMINAIRE_H

#include "solver/base/luminaire_shape.h"
#include "store/status.h"

#include <stdint.h>

typedef enum luminaire_format {
    LM63_1986,
    LM63_1991,
    LM63_1995,
    LM63_2002,
    LM63_2019,
    EULUMDAT,
    LUMINAIRE_FORMULA, /* of no file: luminaire_made.h */
    LUMINAIRE_FORMATS
} luminaire_format;

/* The angles of a table. C: the plane C and gamma. B: tan V = tan gamma cos C, sin H = sin gamma sin C. A:
 * tan H = tan gamma sin C, sin V = sin gamma cos C. */
typedef enum luminaire_type { LUMINAIRE_C, LUMINAIRE_B, LUMINAIRE_A, LUMINAIRE_TYPES } luminaire_type;

/* The planes that are mirrors of the light. */
typedef enum luminaire_symmetry {
    SYMMETRY_NONE,
    SYMMETRY_ROTATIONAL,
    SYMMETRY_C0_C180,
    SYMMETRY_C90_C270,
    SYMMETRY_QUADRANT,
    LUMINAIRE_SYMMETRIES
} luminaire_symmetry;

/* The luminous opening, in m. */
typedef struct luminaire_opening {
    luminaire_shape shape;
    double size[3];               /* along x, y and z */
    double side[4];               /* luminous heights of its sides at C0, C90, C180 and C270 */
    double width, length, height; /* as the file states them, of LM-63 with their signs */
} luminaire_opening;

enum { LUMINAIRE_TEXT = 1024, LUMINAIRE_KEY = 32, LUMINAIRE_WARNINGS = 2048 };

/* A line of words of the file. key: the keyword of LM-63 without brackets, or the name of the line of
 * EULUMDAT. */
typedef struct luminaire_word {
    char key[LUMINAIRE_KEY];
    char text[LUMINAIRE_TEXT];
} luminaire_word;

/* Lamps that the luminaire is sold with; all sets of a file share one table per 1,000 lm. */
typedef struct luminaire_lamps {
    double number; /* as the file states it, of EULUMDAT negative for absolute photometry */
    double lumens; /* of all of them; of absolute photometry those of the luminaire. NAN: not stated */
    double watts;  /* NAN: not stated */
    char type[LUMINAIRE_TEXT], colour[LUMINAIRE_TEXT], rendering[LUMINAIRE_TEXT];
} luminaire_lamps;

/* TILT: factors of the light by the angle between a lamp and its place while the luminaire is aimed straight
 * down. candela does not contain them. LM-63 tells lamps that lie apart by what a turn about the axis of its
 * zero-degree plane, C0 to C180, does to them: those of geometry 2 stay horizontal, as they lie along that
 * axis, x; those of geometry 3 do not, as they lie across it, along y. */
typedef struct luminaire_tilt {
    size_t n;     /* 0: none */
    int geometry; /* 1: the lamp is upright; 2: it lies along C0; 3: along C90 */
    double *angles, *factors;
} luminaire_tilt;

/* Lines of warnings, of which those that do not fit are counted. */
typedef struct luminaire_warnings {
    char text[LUMINAIRE_WARNINGS]; /* lines, the last without an end */
    uint64_t omitted;
} luminaire_warnings;

typedef struct luminaire {
    luminaire_format format;
    luminaire_type type;
    bool absolute; /* its candela were measured, not found from the lumens of lamps */
    luminaire_symmetry symmetry;
    double measured_tilt; /* degrees, while it was measured; EULUMDAT alone states it */
    double output_ratio;  /* LORL / 100; NAN: not stated */
    size_t n_planes, n_angles;
    double
        *planes; /* [n_planes] ascending, degrees: C, one turn where there is no symmetry; of types A, B: H */
    double *angles;  /* [n_angles] ascending, degrees: gamma; of types A, B: V */
    double *candela; /* [n_planes][n_angles], of the lamp set chosen */
    luminaire_opening opening;
    luminaire_tilt tilt;
    size_t n_sets, set; /* set: the one that was chosen, from 0 */
    luminaire_lamps *sets;
    size_t n_words;
    luminaire_word *words;
    luminaire_warnings warnings;
} luminaire;

typedef struct luminaire_options {
    size_t set;         /* lamp set, from 1; 0: the first, which a warning says where there are others */
    const char *assets; /* folder that a file of TILT may lie in, beside that of the luminaire; NULL: none */
} luminaire_options;

/* Reads a file in a child process without rights; its content says the format, not its name. The caller frees
 * *out by luminaire_free. Errors: LAM_ERR_IO, LAM_ERR_MEMORY, LAM_ERR_ARGUMENT for a lamp set that is not
 * there, LAM_ERR_FORMAT with file, line, value and limit. Cost: 2 ms, and .1 s for each MB. */
lam_status luminaire_read(const char *path, const luminaire_options *options, luminaire *out,
                          lam_error *error);

/* The same of a text of so many bytes, in this process; messages have `name` for a path, beside which a file
 * of TILT is looked for. */
lam_status luminaire_read_text(const char *name, const char *text, size_t length,
                               const luminaire_options *options, luminaire *out, lam_error *error);

void luminaire_free(luminaire *l);

/* The intensity in a direction, degrees, cd: linear in both angles of the table, and 0 outside of it. C is
 * any angle; gamma is from 0 to 180. Cost: O(log angles). */
double luminaire_candela(const luminaire *l, double C, double gamma);

/* The luminous flux, lm: the integral of what luminaire_candela gives, exact but for rounding. */
double luminaire_lumens(const luminaire *l);

/* The largest intensity of the table, cd, and the first direction that has it. */
double luminaire_peak(const luminaire *l, double *C, double *gamma);

/* The first text of a keyword, or "". Capitals, and underscores before the keyword, do not matter. */
const char *luminaire_find_word(const luminaire *l, const char *key);

/* Names for people; static. */
const char *luminaire_format_name(luminaire_format format);       /* "LM-63-2002" */
const char *luminaire_type_name(luminaire_type type);             /* "C" */
const char *luminaire_symmetry_name(luminaire_symmetry symmetry); /* "about C0-C180" */

/* True where all that a luminaire holds can be used: for one that came from another process. */
bool luminaire_is_sound(const luminaire *l);

#endif
