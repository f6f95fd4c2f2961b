/* The stated errors of groups of a scene, as laws of the size of an emission and of a sky: what the figures
 * of a store (error_figures.h) say of the light of one group. */
#ifndef LAMBERT_OPERATOR_STATED_ERROR_LAW_H
#define LAMBERT_OPERATOR_STATED_ERROR_LAW_H

#include "solver/operator/stated/error_figures.h"
#include "solver/operator/stated/luminaire_law.h"
#include "solver/operator/stated/mesh_law.h"
#include "solver/operator/stated/reflecting.h"

/* The scene of an answer; views of the caller's. */
typedef struct error_scene {
    size_t n, n_channels, n_groups;
    const double *area;              /* [n] */
    const float *reflectance;        /* [C][n] */
    const uint32_t *start, *members; /* [n_groups + 1], [n]: those of group g from members[start[g]] on */
    const bool *read;                /* [n], true of receivers; NULL: all are */
    const bool *emits;               /* [n], true of sources; NULL: all are */
    const bool *buried;              /* [n], true of elements that figures leave out; NULL: none is */
} error_scene;

/* Figures with what their formulas need of the mesh. A bin is the elements of a group, or of those that are
 * read, and in a second row the others. Zeroed: a store that states nothing by group.
 *
 * Faces that count twice make another error, which is as large as the light: of squares of the light B - E,
 * s^2 + o / 2 of the elements of a group and s^2 + o^2 / 2 of its mean, with s the share of light that
 * repaired row sums are off by, and o the share of the group's area that overlaps others
 * (precompute/overlap_error.c). */
typedef struct error_by_group {
    group_errors figures;
    size_t n_bins;
    double *area;         /* [n_bins] */
    double *squares;      /* [n_groups], sum A^2 */
    double *reflectance;  /* [C][n_groups], mean */
    reflecting *of_group; /* [n_groups] */
    uint32_t *bin;        /* [n] */
    uint32_t *whole_of;   /* [n_groups], places among figures.whole_groups (whole_law.h); NULL: none */
    double repair;        /* s; 0: none */
    double *overlap;      /* [n_groups], o; NULL: none */
    mesh_shares mesh;
} error_by_group;

void error_by_group_free(error_by_group *e);

/* The share of each group that overlaps others, [n_groups], freed with free(); NULL: none does. Errors:
 * LAM_ERR_FORMAT, LAM_ERR_MEMORY. */
lam_status error_overlap_load(store *s, size_t n_groups, double **out, lam_error *error);

/* Takes over by_group of figures; overlap [n_groups] is copied, NULL: none. *out is zeroed where by_group has
 * no rows. Errors: LAM_ERR_MEMORY. */
lam_status error_by_group_make(const error_scene *scene, const double *overlap, stated_figures *from,
                               error_by_group *out, lam_error *error);

/* The size of an emission, channels stacked: P^2 = sum (sum A E)^2 and sum A^2 E^2; and P^2 of that part
 * which groups with lamps of the scene emit (mesh_law.h), which emission_size_add leaves. */
typedef struct emission_size {
    double power2, squares, lamps2;
} emission_size;

/* (sum A E)^2 / sum A^2 E^2; 0 of no emission. */
double emission_size_number(const emission_size *e);

/* Adds a channel, [n]; with the powers of tiles as weights that of a sky, [n_tiles]. */
void emission_size_add(emission_size *e, size_t n, const double *weights, const float *E);

/* The size of both: their powers added up. */
emission_size emission_size_sum(const emission_size *a, const emission_size *b);

/* The light that whole groups emit evenly, [C][n_whole], W/m^2 (whole_law.h), whole_light_set_mesh of
 * those without lamps, and the size of all else that is emitted. weights NULL: nothing is known of whole
 * groups. */
typedef struct whole_light {
    double *weights;
    mesh_whole mesh;
    emission_size rest;
} whole_light;

/* P^2, S and W of a sky (error_figures.h), and the squares of the powers of its tiles. */
typedef struct sky_sizes {
    const float *L; /* [C][n_tiles]; NULL: no sky, or nothing is stated of skies */
    double power2, spread, power_off, squares;
} sky_sizes;
sky_sizes sky_sizes_of(const error_by_group *e, const float *L);

/* The quantity of an answer, its emission and its sky, and a sky whose bounced light alone is in it. */
typedef struct light_sizes {
    lam_quantity quantity;
    emission_size size;
    whole_light whole; /* of size; a view */
    sky_sizes sky, sent;
    double lost2;              /* (sum A E)^2 + sum (A E)^2 of light that is lost by that; 0: none */
    lit_luminaires luminaires; /* their direct light, which is no part of bounced light; what is reflected of
                                  it is in size */
} light_sizes;

/* Of the light that is reflected the direct light of a sky is no part, nor are errors of it. */
light_sizes light_sizes_of(const error_by_group *e, lam_quantity quantity, const emission_size *size,
                           const float *L);

/* Squares of the errors of a bin: of its elements, and of its mean. O(C n_tiles) under a sky. */
typedef struct bin_error {
    double elements2, mean2;
} bin_error;
bin_error error_law(const error_by_group *e, const light_sizes *of, size_t bin);

/* The shares of a bin's light that constants on elements lack; true where any are stated; and true where
 * lamps of the scene are in the group of a bin. */
mesh_lack mesh_lack_of_bin(const error_by_group *e, const light_sizes *of, size_t bin);
bool mesh_is_stated(const error_by_group *e);
bool mesh_lamps_in(const error_by_group *e, size_t bin);

/* The share o of a bin; the square, over that of the light, that faces which count twice are off by: of the
 * elements of a bin; and that of a mean, by the sums of its light and of the light that may be covered. */
double overlap_of_bin(const error_by_group *e, size_t bin);
double overlap_elements2(const error_by_group *e, size_t bin);
double overlap_mean2(const error_by_group *e, double light, double covered);

/* The root of error2 / light2. The light of the answer has the error in it, and its square is larger by that
 * of the error on average, which is taken out of it where it is no more than half: the figure is 1 there.
 * Beyond that it is over half of the light, so that it rises and stays finite; of no light at all it is not.
 */
double error_ratio(double error2, double light2);

#endif
