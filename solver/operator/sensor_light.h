/* The runtime half of sensors: sets of receivers and the rows that gather light at them, of an open store. */
#ifndef LAMBERT_OPERATOR_SENSOR_LIGHT_H
#define LAMBERT_OPERATOR_SENSOR_LIGHT_H

#include "solver/base/receiver_weight.h"
#include "store/store.h"

/* Why a receiver has no value: most of its rays meet backs of faces; it lies in the opening of a luminaire.
 */
enum { SENSOR_IN_WALL = 1, SENSOR_IN_LUMINAIRE = 2 };

/* Kinds in the store: sets of probes, whose receivers are the spherical harmonics, each of this many. */
enum { SENSOR_SET_PROBES = 7, SENSOR_HARMONIC = 4, SENSOR_HARMONICS = 9 };

/* Kinds in the store that figures ask for: of sets, and of receivers. */
enum { SENSOR_SET_EYES = 2, RECEIVER_KIND_PLANE = 0, RECEIVER_KIND_CYLINDER = 1 };

/* A set, as people are shown it. */
typedef struct sensor_set_shown {
    const char *name;
    unsigned kind;        /* as in the store: 0 points, 1 grids ... */
    size_t first, count;  /* of the receivers */
    size_t rows, columns; /* of a grid, else 0 */
    double spacing[2];    /* m, of columns and of rows */
} sensor_set_shown;

/* A receiver, as people are shown it. */
typedef struct sensor_shown {
    unsigned kind;                  /* 0 plane, 1 cylinder, 2 semi-cylinder, 3 sphere, 4 ... 12 harmonics */
    double at[3], axis[3], look[3]; /* m; unit vectors, or 0 where it has none */
    uint32_t cell;                  /* of its grid, or 0xFFFFFFFF */
    unsigned flags;                 /* 0: it has a value */
} sensor_shown;

/* The weights of elements, as rows. */
typedef struct sensor_weights {
    const uint64_t *start;   /* [s + 1] */
    const uint32_t *element; /* [start[s]] */
    const float *weight;
} sensor_weights;

/* Luminaires as eyes see them: intensity at dimmer 1 (cd), projected area of the opening (m^2), distance (m),
 * Guth's index of its position, and the mean of the square of what is passed of it (store/FORMAT.md). */
enum { SENSOR_SEEN = 5 };
typedef struct sensor_eyes {
    size_t n;              /* 0: there are none, or no luminaires */
    const uint32_t *eyes;  /* [n], receivers, ascending */
    const float *seen;     /* [luminaires][n][SENSOR_SEEN] */
    const double *colours; /* [C][luminaires], factors of the light in each channel */
} sensor_eyes;

/* Loads /sensors for n elements of C channels, or NULL where the store has none; freed by lam_sensors_close.
 * Errors: LAM_ERR_FORMAT (another shape, an index or a value out of bounds), LAM_ERR_DAMAGED, LAM_ERR_MEMORY.
 */
lam_status sensors_load(store *s, size_t n, size_t C, lam_sensors **out, lam_error *error);

/* Texts of it are owned by l. */
sensor_set_shown sensors_set_shown(const lam_sensors *l, size_t set);
sensor_shown sensors_shown(const lam_sensors *l, size_t receiver);

/* True for receivers whose values may be negative: harmonics of a probe but the first. */
bool sensors_is_signed(const lam_sensors *l, size_t receiver);

/* Owned by l. */
sensor_weights sensors_weights(const lam_sensors *l);

/* The weights of the tiles of the sky [tiles][s], owned by l; NULL: it has none. */
const float *sensors_sky(const lam_sensors *l);

/* All receivers of l, in their order; the caller frees. Errors: LAM_ERR_MEMORY. */
lam_status sensors_receivers(const lam_sensors *l, placed_receiver **out, lam_error *error);

/* Owned by l. */
sensor_eyes sensors_eyes(const lam_sensors *l);

/* The numbers of the first luminaire as a receiver sees it, of which the next one has its own eyes.n *
 * SENSOR_SEEN further on; NULL: the receiver is no eye, or nothing is known of what it sees. O(log eyes). */
const float *sensors_seen(const lam_sensors *l, size_t receiver);

/* The light of luminaires that comes to a receiver directly, without their colours, at these dimmers
 * [luminaires]; 0 where the store has none. */
double sensors_direct(const lam_sensors *l, const double *dimmer, size_t receiver);

/* lam_sensors_gather for refined answers, in double. */
void sensors_gather_double(const lam_sensors *l, size_t n_rhs, const double *B, const double *L,
                           const double *D, double *out);

/* out [n_rhs][C][s]: half of the difference of what the two halves of samples gather, of B and L, as
 * lam_sensors_variance takes the square of it. */
void sensors_gather_off(const lam_sensors *l, size_t n_rhs, const float *B, const float *L, float *out);

#endif
