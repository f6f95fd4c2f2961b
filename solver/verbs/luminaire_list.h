/* Prints a list of placed luminaires. Private to solver/verbs. */
#ifndef LAMBERT_VERBS_LUMINAIRE_LIST_H
#define LAMBERT_VERBS_LUMINAIRE_LIST_H

#include "solver/base/terminal.h"
#include "solver/luminaire/placed.h"

/* Reads the list and prints it to standard output: as JSON, or as a table with warnings on t. Errors: those
 * of placed_read, LAM_ERR_MEMORY. */
lam_status luminaire_list_print(const char *path, const char *assets, bool as_json, terminal *t,
                                lam_error *error);

#endif
