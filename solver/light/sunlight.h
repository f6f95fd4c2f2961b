/* The sun itself on the elements and at the sensors of a scene, hour by hour, in place of the tile of sky
 * that holds it. */
#ifndef LAMBERT_LIGHT_SUNLIGHT_H
#define LAMBERT_LIGHT_SUNLIGHT_H

#include "lambert/lambert.h"
#include "solver/daylight/year.h"
#include "solver/formfactor/visibility/sun_rays.h"
#include "solver/light/sensor_sun.h"
#include "store/store.h"

/* The direct irradiance of an element by the sun of vector h: E_n max(0, n . s) V with the normal irradiance
 * E_n and the share V of the element that sees the sun, plus the light that an unshaded ground of the store's
 * albedo reflects. Where the answer already holds the sun of a tile, that tile's direct light is subtracted.
 * At sensors it is the same, with the weight of each in place of max(0, n . s) V. */
typedef struct sunlight {
    size_t n_vectors, n; /* hours, elements */
    year_sun *suns;      /* [n_vectors] */
    sun_rays *rays;      /* NULL: sensors alone have the sun itself, elements that of its tile */
    sensor_sun *sensors; /* NULL: it is not wanted there */
    const lam_sky *sky;  /* borrowed; NULL: no sun is in the tiles */
    sky_tiling tiling;
    float *ground;   /* [n], of the irradiance of the ground */
    float *given;    /* [n]: one vector that is known; the members above are then unused */
    float *given_at; /* [sensors]: likewise; NULL: it is not wanted there */
    size_t n_given_at;
    bool sensors_alone; /* rays are NULL, or were */
} sunlight;

/* Takes over suns [n_vectors], also on an error. Rays are n_points per element, of those wanted or, where
 * that is NULL, of all; 0 points: sensors alone are to have it. in_tiles: the sky whose answers have the sun
 * in a tile, or NULL. The light of the ground is that of sun_ground.h.
 * Errors: those of the store's /sky, LAM_ERR_MEMORY, LAM_ERR_INTERNAL. */
lam_status sunlight_create(store *s, const mesh *m, year_sun *suns, size_t n_vectors, size_t n_points,
                           size_t n_wanted, const uint32_t *wanted, const lam_sky *in_tiles, sunlight *out,
                           lam_error *error);
void sunlight_free(sunlight *s);

/* Wants it at the sensors of that store too, which outlive it. Errors: as sensor_sun_create. */
lam_status sunlight_at_sensors(sunlight *s, store *of, const mesh *m, const lam_sensors *sensors,
                               lam_error *error);

/* The tiling of a store's sky, without what it holds. Freed by sky_tiling_free. Errors: those of the store.
 */
lam_status sky_tiling_of_store(store *s, sky_tiling *out, lam_error *error);

/* True where the sun shines in a vector. */
bool sunlight_shines(const sunlight *s, size_t vector);

/* The tile that holds the sun of a vector, and the radiance that it has there; false where the sun is in no
 * tile. */
bool sunlight_in_tile(const sunlight *s, size_t vector, size_t *tile, double *radiance);

enum { SUNLIGHT_MOST = 64 };

/* Numbers that work below must have room for. */
size_t sunlight_work(const sunlight *s);

/* H [n_vectors][n] of at most SUNLIGHT_MOST vectors by their numbers; work is overwritten. Elements that are
 * not wanted get no meaningful value. Not where sensors alone have it. */
void sunlight_irradiance(const sunlight *s, size_t n_vectors, const size_t *vectors, float *H, float *work);

/* The same at sensors, H [n_vectors][sensors], after sunlight_at_sensors. */
void sunlight_sensors(const sunlight *s, size_t n_vectors, const size_t *vectors, float *H);

/* The light of the sun alone, without the ground and whatever tiles hold: at sensors where it is wanted
 * there, else on elements. H [n_vectors][sensors, or n]; not of a known vector. */
void sunlight_direct(const sunlight *s, size_t n_vectors, const size_t *vectors, float *H);

/* The mean of all vectors as one. Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status sunlight_mean(const sunlight *s, const progress *steps, sunlight *out, lam_error *error);

#endif
