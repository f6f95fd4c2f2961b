/* The errors that a store states, under /error: their figures, each name once, and both ways between
 * (store/FORMAT.md). The judge fills most of them; error_law.h and emitters_law.h say what they mean for an
 * answer. */
#ifndef LAMBERT_OPERATOR_STATED_ERROR_FIGURES_H
#define LAMBERT_OPERATOR_STATED_ERROR_FIGURES_H

#include "store/store.h"

/* Mean, standard deviation and largest value over the probes of a group. */
typedef struct error_figures {
    double mean, std, max;
} error_figures;

/* Errors of the light of receivers, |B~ - B|_w / |B|_w with |x|_w^2 = sum over probes, channels and elements
 * of A w x^2, w the weights of what is read: the errors of all probes together, as receivers see next to
 * nothing of many a single element. */
typedef struct receiver_figures {
    bool known; /* false: all is read, or there is no such light */
    double total_relative, total_indirect, operator_indirect;
    double noise; /* error of the reference, likewise; above a third of total_indirect it is in the figures of
                     total, which is_bound then calls upper bounds */
    bool is_bound;
} receiver_figures;

typedef struct error_group {
    size_t probes;                                      /* 0: nothing measured, nothing stored */
    size_t operator_probes;                             /* of them, for the operator's own error */
    error_figures total_relative, total_indirect;       /* against an independent sample of F */
    error_figures operator_relative, operator_indirect; /* against the very F that was factorized */
    double reference_noise; /* standard error of the mean of total_indirect by the noise of the reference */
    double probes_noise;    /* the same by the choice of probes; negative: of one probe nobody knows */
    /* The noise of the reference is more than a third of the mean: it is not taken out, and the figures of
     * total are upper bounds, with twice their standard error added. */
    bool is_bound;
    double negative_share; /* power of negative radiosity over all, mean */
    double energy_balance; /* |emitted - absorbed - left| / emitted, mean */
    receiver_figures receivers;
} error_group;

/* The errors in each group of the scene, for answers to any emission E of power P = sum A E (per channel,
 * squares added up) and effective number of emitters N = P^2 / sum A^2 E^2. The arrays are in double,
 * [n_rows][n_groups]: row 0 is of the elements of a group, or of those that are read, row 1 then of its
 * others. Zeroed: nothing is known.
 *
 * The error of an answer, of the mean of a group or the root of the mean square of its elements, is about
 *     P sqrt(one^2 / N^2 + many^2 (1 - 1/N) / N + even^2),
 * in which errors of the light of single elements are independent: they add up in squares, to many^2 / N,
 * where those of one element of any size are one^2, and even is what whole groups and the scene's own lights
 * are off beyond that. */
enum {
    GROUP_MEAN_ONE,
    GROUP_MEAN_MANY,
    GROUP_MEAN_EVEN,
    GROUP_RMS_ONE,
    GROUP_RMS_MANY,
    GROUP_RMS_EVEN,
    /* For people: errors of the mean of a group over the reflected light in it, over all probes together and
     * the largest, by random emission, by elements that light it at least as much as the whole scene, and by
     * those that light it less. */
    GROUP_UNIFORM,
    GROUP_UNIFORM_LARGEST,
    GROUP_NEAR,
    GROUP_NEAR_LARGEST,
    GROUP_FAR,
    GROUP_FAR_LARGEST,
    GROUP_FIGURES
};

/* The same of skies. With Q_t the power that radiance 1 of tile t sends into the scene after the first
 * bounce, M the mean of radiances L weighted by Q, and f_t the mean first bounce of a group, let P = sum_t
 * L_t Q_t,  S = sum_t Q_t (L_t - M)^2,  D = rho^2 sum_t f_t (L_t - M)^2, their squares and S, D added up over
 * channels, rho the mean reflectance of the group. The error is about sqrt(direct^2 D + tiles^2 S + even^2
 * P^2). Rays that meet a tile, and with them the noise of the direct light, are as many as it is bright, so
 * that squared errors of direct light grow as D; where all of a window is seen, what one tile has too much
 * another has not, and an even sky is off by far less.
 *
 * That is the law of all tiles alike. The errors of single ones are known better (judge_sky_tiles.h): with
 * d_t, or of the mean of a group d'_t, the squared error of the first bounce of a tile there, and w_t that of
 * the power that it sends into the scene, which bounces into the group as the light of single tiles does,
 *     D = rho^2 sum_t d_t (L_t - M)^2,    W = sum_t w_t (L_t - M)^2
 * are the square of the error D + bounced^2 W + tiles^2 S + even^2 P^2. */
enum {
    SKY_MEAN_TILES,
    SKY_MEAN_EVEN,
    SKY_MEAN_BOUNCED,
    SKY_RMS_TILES,
    SKY_RMS_EVEN,
    SKY_RMS_BOUNCED,
    SKY_FIGURES
};

typedef struct group_errors {
    size_t n_groups, n_rows;
    double *of[GROUP_FIGURES];
    /* Of groups that emit evenly the errors are known themselves, and together: K [n_rows][n_groups][n_whole]
     * [n_whole] has for whole_groups k and l, 1 W/m^2 in every channel from each, the mean product of the
     * errors that both make, over the elements of a bin (rms) or of its mean (mean), channels added up, so
     * that weights w of them have the squared error w' K w. */
    size_t n_whole;
    uint32_t *whole_groups;         /* [n_whole] */
    double *whole_rms, *whole_mean; /* W^2/m^4 at 1 W/m^2; NULL: n_whole is 0 */
    /* The part of them that is against the very F of the operator, by its share of the error of those probes
     * that are compared with it. Not stored. */
    double *of_operator[GROUP_FIGURES];
    double *sky[SKY_FIGURES]; /* [n_rows][n_groups]; NULL: no sky was judged */
    double sky_direct;        /* of all groups alike; 0 where sky_first is NULL: tiles have it all */
    size_t n_channels, n_tiles;
    double *sky_power; /* [C][n_tiles], Q_t = sum A rho first_bounce_t, m^2 sr */
    double *sky_first; /* [n_groups][n_tiles], mean first_bounce_t over a group, sr; NULL: too many numbers */
    double *sky_elements_off, *sky_means_off; /* [n_groups][n_tiles], d_t and d'_t, sr^2; NULL: likewise */
    double *sky_power_off;                    /* [C][n_tiles], w_t, m^4 sr^2 */
} group_errors;
void group_errors_free(group_errors *e);

/* Leaves out the errors of whole groups. */
void group_errors_drop_whole(group_errors *e);

typedef struct error_report {
    error_group single, lights, random;
    error_group whole; /* one whole group of the scene emits evenly */
    error_group sky;   /* only a sky shines; against the independent sample alone */
    bool has_total;
    double seconds;
} error_report;

/* The lights that the error of the mesh is measured for: the scene's lamps or all emitters together, 1 from
 * every element, an even and a cloudy sky, and several lights of one element, of one group and of one tile
 * of the sky each; of all luminaires, and of several, each alone, their direct light with it. */
enum {
    MESH_OF_LAMPS,
    MESH_OF_EVEN,
    MESH_OF_SKY_EVEN,
    MESH_OF_SKY_CLOUDY,
    MESH_OF_SINGLE,
    MESH_OF_GROUPS,
    MESH_OF_SKY_TILE,
    MESH_OF_LUMINAIRES,
    MESH_OF_LUMINAIRE,
    MESH_FIGURES
};

/* The share of light that constants on elements leave, |error| / |B - E|, of each of these; and by group the
 * root of the mean square, by area, of what B varies by inside elements and of B - E, which mesh_law.h
 * divides by each other: 0 of both where a group was not looked at. Of several lights, each of them scaled to
 * sum A (B - E)^2 = 1, all together. */
typedef struct mesh_figures {
    bool has_lights, has_even, has_skies, has_single, has_groups, has_tiles, has_luminaires, has_luminaire;
    double lights, even, sky_even, sky_cloudy, single, groups, sky_tile, luminaires, luminaire;
    double even_emitters,
        groups_emitters;           /* effective numbers, of several lights in the middle; 0: not stated */
    double luminaires_number;      /* the same of luminaires, by their fluxes */
    double light_of[MESH_FIGURES]; /* of EVEN, SINGLE, SKY_EVEN, SKY_TILE and of luminaires: sum A (B - E)^2
                                      over the square of the power, on average, 1/m^2; 0: not stated */
    size_t n_groups;
    double *variation[MESH_FIGURES], *reflected[MESH_FIGURES]; /* [n_groups]; NULL: not stated */
    double *lights_power; /* [n_groups], that the scene's lamps emit; NULL: not stated */
    /* Of each group that was lit alone, [n_groups]: its own share, and its light as light_of has it; light 0
     * of the others. Both NULL: not stated. Together: the share of these lights, 1 W/m^2 from each group, in
     * which a group that lights little counts little. */
    double *group_share, *group_light, groups_together;
} mesh_figures;
void mesh_figures_free(mesh_figures *m);

/* The error of the answer for the scene's own lights and luminaires, as dim as these are listed, by the laws
 * of all other figures: members of answer_error and its parts (solver/operator/stated/answer_error.h). Stated
 * of scenes with luminaires, whose light no probe is. */
typedef struct own_figures {
    bool known;
    double relative, indirect;
    double rest, mesh; /* shares of the light that surfaces reflect; mesh negative: not stated */
} own_figures;

/* Weights w of emitters have the mean squared error w' K w of B, channels stacked, of all elements (K, with
 * areas), of those of a group (K_g), and of the mean of a group (M_g); of a group that reflects nothing,
 * which has no part in K unless all are so, of H. */
typedef struct emitter_figures {
    size_t s, n_groups;
    double *covariance;           /* [s][s] */
    double *of_groups, *of_means; /* [n_groups][s][s]; both NULL: there are too many groups */
    double *relative, *indirect;  /* [s]: of each alone; not loaded */
} emitter_figures;
void emitter_figures_free(emitter_figures *e);

/* All of them. Zeroed: nothing is stated. */
typedef struct stated_figures {
    error_report report;
    emitter_figures emitters; /* s is 0 where none are stated */
    mesh_figures mesh;
    own_figures own;       /* not loaded */
    double repair;         /* relative error of reflected light by faces that count twice; 0: none */
    group_errors by_group; /* n_rows is 0 where none are stated */
} stated_figures;
void stated_figures_free(stated_figures *f);

/* Writes those that are known. */
lam_status stated_figures_save(const stated_figures *f, store *s, lam_error *error);

/* True for an object or an attribute (NULL: none) of a store that is a figure of luminaires: those of a store
 * whose luminaires are others are found anew. mesh_figures_are_stated: the store has figures of the mesh. */
bool figure_is_of_luminaires(const char *object, const char *attribute);
bool mesh_figures_are_stated(store *s);

/* The shape of a scene; n_emitters 0: figures of emitters are not read. */
typedef struct figures_shape {
    size_t n_groups, n_channels, n_emitters;
} figures_shape;

/* Reads them; of by_group those of its laws, not those for people. Errors: LAM_ERR_FORMAT, LAM_ERR_MEMORY.
 * Freed by stated_figures_free. */
lam_status stated_figures_load(store *s, const figures_shape *shape, stated_figures *out, lam_error *error);

/* The part of it that is attributes: a figure that is missing, or no number, is negative. */
void error_report_load(store *s, error_report *out);

/* The attributes of the mesh alone, without arrays. */
void mesh_figures_load_shown(store *s, mesh_figures *out);
void own_figures_load(store *s, own_figures *out);

/* For descriptions. The groups of /error whose attributes are figures; a name of NULL ends the list. */
typedef struct figures_group {
    const char *name, *path;
} figures_group;
extern const figures_group figures_groups[];

/* The names of figures by group, GROUP_MEAN_ONE to GROUP_FIGURES; those from GROUP_UNIFORM on, all else NULL;
 * n_rows is 0 where the store has none. Errors: LAM_ERR_FORMAT, LAM_ERR_MEMORY. */
const char *group_figure_name(int figure);
lam_status group_errors_load_shown(store *s, size_t n_groups, group_errors *out, lam_error *error);

/* The figures of each emitter alone: relative and indirect, of any number s; 0 where the store has none. */
lam_status emitter_figures_load_shown(store *s, emitter_figures *out, lam_error *error);

#endif
