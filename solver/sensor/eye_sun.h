/* The sun's disc as eyes see it: a ray from the eye to its middle. Knows no weather. */
#ifndef LAMBERT_SENSOR_EYE_SUN_H
#define LAMBERT_SENSOR_EYE_SUN_H

#include "solver/scene/mesh.h"

typedef struct eye_sun eye_sun;

/* The mesh must outlive it. Freed by eye_sun_free. Errors: LAM_ERR_MEMORY, LAM_ERR_INTERNAL. */
lam_status eye_sun_create(const mesh *m, eye_sun **out, lam_error *error);
void eye_sun_free(eye_sun *s);

/* True where an eye at a place, which looks along view, has the sun in front of it, and only panes are
 * between; view and towards (the way to the sun) are unit vectors in the scene's axes. The ray begins a
 * millimetre before the eye, which may lie on a face. Cost: a ray. */
bool eye_sun_is_seen(const eye_sun *s, const double at[3], const double view[3], const double towards[3]);

#endif
