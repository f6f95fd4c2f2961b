/* The error that a store states for a lambert solve, before that of its own light (own_error.h). */
#ifndef LAMBERT_VERBS_STORE_ERROR_H
#define LAMBERT_VERBS_STORE_ERROR_H

#include "solver/base/terminal.h"
#include "solver/codec/stated_notes.h"
#include "solver/light/emission.h"
#include "solver/output/output.h"

/* Puts the error for the elements that are wanted, selected [n_selected] or NULL for all, or for those that
 * sensors see, and the light into out. Warns where the store was built for receivers and others are wanted,
 * or for sources and others emit. */
void store_error_take(const stated_errors *stated, const emission *light, bool at_sensors, size_t n_selected,
                      const uint32_t *selected, terminal *t, solution *out);

#endif
