/* The errors that a store states for answers, and the elements that they hold for. */
#ifndef LAMBERT_CODEC_STATED_ERRORS_H
#define LAMBERT_CODEC_STATED_ERRORS_H

#include "solver/codec/answer.h"
#include "store/store.h"

/* Of the scene's own lights, else of single elements, against the independent sample. */
typedef struct stated_error {
    bool known;
    double relative, indirect;
} stated_error;

/* Zeroed: nothing is stated. */
typedef struct stated_errors {
    stated_error all;       /* means over probes, of the light of all elements */
    stated_error receivers; /* of the light of receivers; known only where the store was built for them */
    bool *read;             /* [n], true of receivers; NULL: the store was built for all elements */
    size_t n;
} stated_errors;

void stated_errors_free(stated_errors *e);

/* Reads those of a store of n elements. A figure that is missing or no finite number is not known. Errors:
 * those of importance_load; LAM_ERR_MEMORY. */
lam_status stated_errors_read(store *s, size_t n, stated_errors *out, lam_error *error);

/* The number among count elements that are no receivers; selected NULL: the first count elements. 0 where
 * the store was built for all. O(count). */
size_t stated_errors_others(const stated_errors *e, size_t count, const uint32_t *selected);

/* Puts the error of an answer, and the elements that it is of, into notes. only: nothing but the light of
 * receivers is in the answer. The error of receivers stands in no other answer. */
void stated_errors_note(const stated_errors *e, bool only, answer_notes *notes);

#endif
