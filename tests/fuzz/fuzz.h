/* What the harnesses share. Each is a LLVMFuzzerTestOneInput: libFuzzer and AFL++ call it with what they make
 * up, replay.c with files. */
#ifndef LAMBERT_TESTS_FUZZ_H
#define LAMBERT_TESTS_FUZZ_H

#include "server/problem.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Unlike assert, also in a release build. */
#define FUZZ_CHECK(condition)                                                                                \
    do {                                                                                                     \
        if (!(condition)) {                                                                                  \
            fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition);                                  \
            abort();                                                                                         \
        }                                                                                                    \
    } while (0)

/* A copy with a NUL behind it, and nothing that may be read behind that. The caller frees. */
static inline char *fuzz_text(const uint8_t *data, size_t size) {
    char *text = malloc(size + 1);
    FUZZ_CHECK(text != NULL);
    if (size > 0) memcpy(text, data, size);
    text[size] = '\0';
    return text;
}

/* A refusal has a status that the contract lists and a text. */
static inline void fuzz_check_problem(const problem *why) {
    FUZZ_CHECK(why->status == 400 || why->status == 422 || why->status == 501 || why->status == 503);
    FUZZ_CHECK(why->detail[0] != '\0');
}

#endif
