/* The direct light of placed luminaires on the elements of a mesh, found by geometry: the integral over an
 * element of what the cells of the opening give, times the share of it that nothing hides, by segments. */
#ifndef LAMBERT_DIRECT_DIRECT_ELEMENTS_H
#define LAMBERT_DIRECT_DIRECT_ELEMENTS_H

#include "solver/luminaire/placed.h"
#include "solver/scene/mesh.h"

typedef struct direct_options {
    uint64_t seed;
    size_t segments;          /* of an element and a luminaire: 16, 32 ... 4096; 0: 16 */
    size_t more_segments;     /* of those that are partly hidden; beside these 64; 0: 256 */
    const progress *progress; /* may be NULL */
    const char *stage;
    size_t n_wanted;
    const size_t *wanted; /* luminaires of the list, ascending; NULL: all */
} direct_options;

/* Light that ends nearer than this to the opening is mostly lost in a housing. */
#define DIRECT_NEAR .2

/* About one luminaire, for people (direct_report_line). */
typedef struct direct_report {
    size_t luminaire;  /* of the list */
    size_t n_ignored;  /* groups that hide nothing from it */
    uint32_t *ignored; /* [n_ignored], ascending */
    double near_share; /* of its flux, that ends nearer than DIRECT_NEAR */
    double lit_share;  /* of its flux, that elements receive; 1 where it has none */
    size_t n_inside;   /* elements whose middle lies in the box about its opening: no number is true there */
} direct_report;

typedef struct direct_light {
    size_t n_luminaires, n, n_groups;
    float *H;            /* [n_luminaires][n], lx = lm/m^2 at dim 1: with maintenance, flux and TILT, without
                            colour */
    float *elements_off; /* [n_luminaires][n_groups], lx^2: mean squared error of H by area */
    float *means_off;    /* [n_luminaires][n_groups], lx^2: squared error of the mean of a group */
    direct_report *reports; /* [n_luminaires] */
} direct_light;

/* Finds the light of the luminaires that are wanted, or of all. A luminaire ignores the groups that it names
 * and those that wrap its opening: they hide nothing from it, and receive light. The errors are those of
 * segments, from two independent halves of them; that of the integral is below .2 %. The bits depend on the
 * seed and on the place of a luminaire in the list, not on threads nor on what else is wanted. Freed by
 * direct_light_free. Errors: LAM_ERR_ARGUMENT for a group that the scene does not have, LAM_ERR_MEMORY,
 * LAM_ERR_CANCELLED, LAM_ERR_INTERNAL. Cost: 16 segments for an element and a luminaire that face each other,
 * 256 where it is partly hidden; memory of one copy of the scene where a luminaire ignores groups. */
lam_status direct_light_make(const mesh *m, const placed_luminaires *p, const direct_options *o,
                             direct_light *out, lam_error *error);
void direct_light_free(direct_light *l);

/* One line for people about a luminaire, or "" where there is nothing to say. */
enum { DIRECT_LINE = 1024 };
void direct_report_line(const mesh *m, const placed_luminaires *p, const direct_report *r,
                        char line[DIRECT_LINE]);

#endif
