/* All light of an answer in one kind and one unit. Answers are linear in light, so that numbers which have it
 * need no conversion: thresholds, certificates and figures are in the unit as they come. */
#ifndef LAMBERT_LIGHT_LIGHT_UNITS_H
#define LAMBERT_LIGHT_LIGHT_UNITS_H

#include "solver/light/emission.h"
#include "solver/light/sun_way.h"

/* The sky that was put over e is of this kind, and its other light is of e->lights. Both become photometric
 * where one of them is, by photometry.h, which sets e->converted where anything shines. The sun of a sky is
 * of the kind of its sky and must be photometric where the store is. */
void light_units_meet_sky(emission *e, const emission_scene *scene, light_kind sky);

/* Puts all light of e, with its sun and what was measured of that (NULL: none), into a unit, and tells the
 * conversion. Errors: LAM_ERR_ARGUMENT for channels whose luminance is not known, or light beyond single
 * precision. */
lam_status light_units_convert(emission *e, const emission_scene *scene, answer_unit unit, sunlight *sun,
                               sun_way *way, light_conversion *out, lam_error *error);

#endif
