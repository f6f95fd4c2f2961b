/* Files of operators that are as they should be or are not, and what opening them must say. */
#ifndef LAMBERT_TESTS_OPERATOR_FILE_H
#define LAMBERT_TESTS_OPERATOR_FILE_H

#include "solver/operator/operator.h"
#include "support/store_sample.h"
#include "support/suite.h"
#include "support/transport.h"

/* The folder of the test that runs, and the path of the file in it. */
extern char operator_file_folder[64], operator_file_path[256];

void operator_file_setup(void);

void operator_file_teardown(void);

/* Opens the file: it is good, or refused in words that name it. */
void operator_file_judge(const char *what, lam_status expected, const char *word);

/* A file to write, and how it differs from a good one: what is 0 or NULL is as it should be, "-" is left out.
 * The good ones have n = 6, k = 2; one channel when folded or exact, two when factored. */
typedef struct file_recipe {
    const char *what, *kind, *form, *layout;
    const char *without;    /* this dataset */
    const char *other_type; /* this dataset in double */
    const char *narrow;     /* these datasets (names after each other) are of narrow_type, all of fill */
    store_type narrow_type;
    uint16_t fill;
    const char *scales; /* these have a scale of scale_size (0: 2) numbers that are scale */
    float scale;
    size_t scale_size;
    const char *precision; /* the attribute; NULL: none */
    const char *bad;       /* this dataset holds bad_value at bad_index */
    float bad_value;
    size_t bad_index;
    size_t n, n_channels, left[2], V[2], core[3], M[3], order_size;
    uint32_t order[6];
    lam_status status;
    const char *word;
} file_recipe;

void operator_file_write(const file_recipe *r);

#endif
