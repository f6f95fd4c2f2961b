/* The sets of sensors of a store by name, as groups of receivers: names, selections and figures of sets are
 * those of groups of elements. */
#ifndef LAMBERT_CODEC_SENSOR_NAMES_H
#define LAMBERT_CODEC_SENSOR_NAMES_H

#include "solver/operator/groups/groups.h"

/* Set k of a store is group k, whose elements are its receivers; receivers without a value are left out of
 * figures. NULL: the store has none, and *out is empty. The index need not outlive the sensors. Freed by
 * group_index_free. O(receivers). Errors: LAM_ERR_MEMORY. */
lam_status sensor_names_make(const lam_sensors *sensors, group_index *out, lam_error *error);

/* Bytes that the index takes of so many receivers, beside what it takes of names. */
size_t sensor_names_bytes(size_t n_receivers);

#endif
