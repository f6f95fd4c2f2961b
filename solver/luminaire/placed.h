/* Luminaires of a scene: where each of them is, how it is turned, and how much of the light of its own file
 * it gives. A file of them is JSON,
 *     {"unit": "m", "files": {"panel": "panel.ldt"},
 *      "luminaires": [{"name": "desk", "file": "panel", "at": [x, y, z], "aim": [0, 0, -1], ...},
 *                     {"name": "row", "file": "panel", "from": [x, y, z],
 *                      "steps": [[1.8, 0, 0]], "counts": [4]}]}
 * or CSV with a column for each number. Knows nothing of meshes. */
#ifndef LAMBERT_LUMINAIRE_PLACED_H
#define LAMBERT_LUMINAIRE_PLACED_H

#include "solver/base/scene/punctual_lights.h"
#include "solver/luminaire/luminaire.h"

enum { PLACED_MOST = 65536, PLACED_FILES_MOST = 1000, PLACED_NAME = 64, PLACED_IGNORED = 256 };

/* Bytes of a file of luminaires. */
#define PLACED_BYTES_MOST ((size_t)8 << 20)

typedef struct placed_luminaire {
    char name[PLACED_NAME], group[PLACED_NAME]; /* group: "" where it has none */
    size_t file;                                /* of placed_luminaires */
    double at[3];                               /* the middle of its opening, m */
    double x[3], y[3], z[3]; /* its frame in the scene, orthonormal: x is C0, y is C90, -z is gamma 0 */
    double dim, maintenance;
    double flux;      /* lm before dim and maintenance, 0 of a dark light; NAN: those of its file */
    double scale;     /* the factor of its file's candela: dim * maintenance * flux / lumens of the file */
    double colour[3]; /* factors of red, green and blue, of luminance 1 */
    bool is_point;    /* its light comes from one point, whatever opening its file has */
    size_t ignored, n_ignored; /* groups that do not hide it: the first in `ignored`, and their number */
    size_t entry;              /* in the file: of `luminaires` from 0, or the line of the CSV */
} placed_luminaire;

/* A file of a luminaire, with one lamp set. */
typedef struct placed_file {
    char *name, *path; /* as the list names it, and where it was found; NULL: it is a formula */
    size_t set;        /* 0: the first */
    size_t entry;      /* the first that names it */
    double lumens;
    luminaire photometry;
} placed_file;

typedef struct placed_group_name {
    char text[PLACED_IGNORED];
} placed_group_name;

typedef struct placed_luminaires {
    bool is_csv;
    size_t n, n_files, n_ignored;
    placed_luminaire *luminaires;
    placed_file *files; /* no two are the same file with the same lamp set */
    placed_group_name *ignored;
    luminaire_warnings warnings; /* of the list; those of its files are theirs */
} placed_luminaires;

typedef struct placed_options {
    double unit;        /* metres of a unit of its coordinates where it states none; 0: 1 */
    char up;            /* axis of the scene that points up: x, y or z; 0: z */
    const char *assets; /* folder of files that do not lie beside the list; NULL: none */
} placed_options;

/* True where the content of a file is a list of luminaires, as opposed to the light of one; its name decides
 * where the content tells nothing. False for a file that cannot be read. Reads 64 KB. */
bool placed_is_list(const char *path);

/* Reads a list and its files, each once, in children without rights. The caller frees *out by placed_free.
 * Errors: LAM_ERR_IO, LAM_ERR_MEMORY, LAM_ERR_FORMAT (no JSON, no CSV, a file of a luminaire that is wrong),
 * LAM_ERR_ARGUMENT; each names the file, the luminaire or the line, the value and its limit. Cost: .1 ms for
 * 10 luminaires, and luminaire_read of each file. */
lam_status placed_read(const char *path, const placed_options *options, placed_luminaires *out,
                       lam_error *error);

/* The same of a text, but that no file of a luminaire is looked for: their paths are NULL, and scale has no
 * factor of the flux. Messages have `name` for the path. */
lam_status placed_read_text(const char *name, const char *text, size_t length, const placed_options *options,
                            placed_luminaires *out, lam_error *error);

/* Appends the point and spot lights of a scene file to a list that was read, or to an empty one. The
 * intensity of a light is multiplied by the luminance of its colour, which becomes one of luminance 1; its
 * file has no path, and a table of 1 cd that lights of the same cone share; C0 is the preset of a list, and
 * `entry` its place in lights. Light from one direction comes from outside of the scene: it is left out, and
 * *n_directional is the number of these lights. lights [n] are settled, and have names that differ; `name` is
 * that of the scene file for messages. *p stays as it is on an error. Cost: O(n log list), and for each light
 * up to PLACED_FILES_MOST cones. Errors: LAM_ERR_ARGUMENT (a name that the list has, too many),
 * LAM_ERR_MEMORY.
 */
lam_status placed_from_lights(const char *name, size_t n, const punctual_light *lights, placed_luminaires *p,
                              size_t *n_directional, lam_error *error);

void placed_free(placed_luminaires *p);

/* The flux of a luminaire after all factors, lm. */
double placed_lumens(const placed_luminaires *p, const placed_luminaire *l);

#endif
