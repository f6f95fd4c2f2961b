/* Windows between two polygons: where several occluders in one plane stand between them, light passes only
 * what these leave open of it. Cuts both polygons to the parts that windows let see each other. Knows no
 * light. */
#ifndef LAMBERT_FORMFACTOR_SIGHT_WINDOWS_H
#define LAMBERT_FORMFACTOR_SIGHT_WINDOWS_H

#include "solver/formfactor/clusters/link_occluders.h"
#include "solver/formfactor/exchange/polygon.h"

typedef enum windows_found { WINDOWS_NONE, WINDOWS_CUT, WINDOWS_CLOSED } windows_found;

/* a and b face each other wholly. WINDOWS_CUT: no segment between them is open outside of the parts that they
 * become; WINDOWS_CLOSED: none is open at all, and a and b stay unchanged; both are proven within the slack
 * of the occluders. own_facets and rise: as for pair_occluders_find. Cost: O(occluders^2) in a plane, at
 * most.
 */
windows_found windows_cut(const occluders *o, const link_occluders *among, const uint32_t own_facets[2],
                          const double rise[2], polygon *a, polygon *b);

#endif
