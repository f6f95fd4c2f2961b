/* Answers that --json prints. */
#ifndef LAMBERT_VERBS_JSON_PRINT_H
#define LAMBERT_VERBS_JSON_PRINT_H

#include "store/status.h"

#include <jansson.h>
#include <stddef.h>

/* Prints a value, indented, on standard output, numbers with so many digits (0: all). NULL, as jansson
 * returns it where memory is short, is LAM_ERR_MEMORY; `of` names in the message what is described. The value
 * stays the caller's. */
lam_status json_print(const char *of, const json_t *value, size_t digits, lam_error *error);

#endif
