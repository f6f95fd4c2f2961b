/* Command lines: one table per verb, from which options are parsed, checked and explained (--help).
 * Knows no verb. */
#ifndef LAMBERT_CONSOLE_OPTIONS_H
#define LAMBERT_CONSOLE_OPTIONS_H

#include "store/status.h"

#include <stdint.h>

/* What options_parse returns when the verb should go on; anything else is its exit status. */
#define OPTIONS_GO (-1)

/* What --rays auto and --levels auto leave in a uint64_t. */
#define OPTION_AUTO UINT64_MAX

#define OPTIONS_MAX 63
#define OPTIONS_ARGUMENTS_MAX 8
#define OPTION_LIST_MAX 256

typedef enum option_kind {
    OPTION_FLAG,       /* bool */
    OPTION_TEXT,       /* const char * */
    OPTION_LIST,       /* option_list: may be given again and again */
    OPTION_NUMBER,     /* double within bounds */
    OPTION_COUNT,      /* uint64_t within bounds */
    OPTION_COUNT_AUTO, /* the same, or the word auto */
    OPTION_SIZE,       /* uint64_t, bytes with an optional K, M or G (powers of 1024) */
    OPTION_CHOICE,     /* const char *, one of choices; one of later is not supported yet */
    OPTION_OPTIONAL,   /* const char *, the value may be left out: then "" */
    OPTION_CUSTOM,     /* whatever parse makes of it */
    OPTION_LATER,      /* the whole option is not supported yet */
    OPTION_HEADING     /* a line of --help: doc */
} option_kind;

typedef struct option_list {
    const char *items[OPTION_LIST_MAX];
    size_t count;
} option_list;

/* One row of a table; offset says where in the verb's own struct the value goes. */
typedef struct option_row {
    const char *name; /* without dashes */
    int letter;       /* 'o' for -o; 0: none */
    option_kind kind;
    size_t offset;
    const char *value; /* what --help calls it */
    const char *doc;
    double low, high; /* both 0: no bounds */
    bool low_open;    /* low itself is outside */
    bool high_open;
    const char *choices; /* "rays|normal" */
    const char *later;   /* "hemicube" */
    lam_status (*parse)(const char *text, void *field, lam_error *error);
} option_row;

typedef struct option_verb {
    const char *name;
    const char *arguments; /* "SCENE -o STORE.h5", for --help */
    const char *summary;
    const option_row *options;           /* the last row has neither name nor doc */
    size_t min_arguments, max_arguments; /* at most OPTIONS_ARGUMENTS_MAX */
} option_verb;

typedef struct option_result {
    const char *arguments[OPTIONS_ARGUMENTS_MAX];
    size_t n_arguments;
    uint64_t given; /* bit i: row i of the table was on the command line */
} option_result;

/* Parses argv (argv[0] is the verb) into fields, which holds the defaults. Wrong usage is one line on
 * standard error and 2; --help goes to standard output and gives 0. */
int options_parse(const option_verb *verb, int argc, char **argv, void *fields, option_result *result);

/* Whether the option of this name was given. */
bool options_given(const option_verb *verb, const option_result *result, const char *name);

/* One line "lambert VERB: ..." on standard error; returns 2, the status of wrong usage. */
int options_usage(const char *verb, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Strict readers: the whole text must be a finite number; what is the name the message begins with. */
lam_status option_number(const char *what, const char *text, double *value, lam_error *error);
lam_status option_count(const char *what, const char *text, uint64_t *value, lam_error *error);
lam_status option_size(const char *what, const char *text, uint64_t *bytes, lam_error *error);

/* Exactly count, or at least 1 and at most count, numbers between commas; *found says how many. */
lam_status option_numbers(const char *what, const char *text, size_t count, bool exactly, double *values,
                          size_t *found, lam_error *error);

/* Whether word is one of the words of "a|b|c". */
bool option_among(const char *word, const char *words);

#endif
