/* Openings of a scene: how wide a gap is through which a ray leaves, or through which it reaches a back face.
 * A gap narrower than a stated width is a crack between elements that should meet, a wider one lets light
 * out. */
#ifndef LAMBERT_FORMFACTOR_VISIBILITY_OPENINGS_H
#define LAMBERT_FORMFACTOR_VISIBILITY_OPENINGS_H

#include "solver/formfactor/visibility/visibility.h"

/* A gap that is narrower than the diagonal of the scene divided by this is a crack: 9 mm in a room of 6 x 4 x
 * 3 m, .18 m in a hall of 100 m. */
#define OPENINGS_NARROWEST 800

/* The width of the widest crack, in metres: it depends on the mesh alone. */
double openings_crack_width(const mesh *m);

/* True where a lost ray, one that meets no front, passes a gap narrower than width: rays from the same origin
 * beside it meet fronts on two opposite sides of it, not further apart than width, or it meets a front once
 * its origin is moved by a sixteenth of width towards the centre of its element. origin is recentred
 * (visibility_recentre), self the element that the ray leaves. Gaps of more than about .7 width may be taken
 * for wider ones, as the rays beside it lie a cube root of 2 apart. Cost: at most 400 rays. */
bool openings_is_crack(const visibility *v, const mesh *m, double width, const float origin[3],
                       const float direction[3], uint32_t self);

#endif
