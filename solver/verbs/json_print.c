#include "solver/verbs/json_print.h"

#include <stdio.h>
#include <stdlib.h>

lam_status json_print(const char *of, const json_t *value, size_t digits, lam_error *error) {
    char *text = value != NULL ? json_dumps(value, JSON_INDENT(2) | JSON_REAL_PRECISION(digits)) : NULL;
    if (text == NULL) return status_fail(error, LAM_ERR_MEMORY, "%s: not enough memory to describe it", of);
    puts(text);
    free(text);
    return LAM_OK;
}
