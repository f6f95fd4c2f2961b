/* Command lines of both programs: tables of rows, from which options are read, checked and explained
 * (--help). A row is the only place where an option's name, preset, unit, limits and help stand. Knows no
 * verb. */
#ifndef LAMBERT_BASE_OPTIONS_H
#define LAMBERT_BASE_OPTIONS_H

#include "store/status.h"

#include <stdint.h>

/* The result of options_parse when the program should go on; any other result is its exit status. */
#define OPTIONS_GO (-1)

/* The value of a count that is given as the word auto. */
#define OPTION_AUTO UINT64_MAX

#define OPTION_LIST_MAX 256

typedef enum option_kind {
    OPTION_FLAG,       /* bool */
    OPTION_TEXT,       /* const char * */
    OPTION_LIST,       /* option_list: the option may be given several times */
    OPTION_NUMBER,     /* double within limits */
    OPTION_COUNT,      /* uint64_t within limits */
    OPTION_COUNT_AUTO, /* the same, or the word auto */
    OPTION_SIZE,       /* uint64_t: bytes, with K, M, G or T for powers of 1024 */
    OPTION_CHOICE,     /* const char *, one of choices */
    OPTION_WORD,       /* an enum: the place of the word among choices */
    OPTION_OPTIONAL,   /* const char *, one of choices; "" where the value is left out */
    OPTION_SWITCH,     /* an enum: 1 where the value is left out, else 2 and on, by its place among choices; 0
                          where the option is not given */
    OPTION_CUSTOM      /* the type that the row's parse fills */
} option_kind;

typedef struct option_list {
    const char *items[OPTION_LIST_MAX];
    size_t count;
} option_list;

/* One option. Its value goes offset bytes into the struct of the table that the row stands in. */
typedef struct option_row {
    const char *name; /* without dashes */
    char letter;      /* 'o' for -o; 0: none */
    option_kind kind;
    size_t offset;
    const char *argument; /* the name of the value in --help; NULL for a choice: its words */
    const char *preset;   /* the value of an option that is not given, as a user would write it; NULL: none */
    const char *otherwise; /* --help where there is no preset: what the program takes then */
    const char *unit;
    double least, most;  /* limits; both 0: none, most at or below least: no upper limit */
    bool above, below;   /* the value must lie above least, below most */
    const char *choices; /* "rays|hemicube" */
    lam_status (*parse)(const char *text, void *field, lam_error *error);
    const char *not_with; /* "rays|sky": options that it cannot be given together with; NULL: any. A pair
                             stands in the row of one of the two */
    const char *settled;  /* why an input that settles it already does not go together with it; NULL: it does
                             (options_refuse_settled) */
    const char *help;     /* NULL: stands in another table with this name */
} option_row;

/* Rows that several commands have. place is the offset of the field; further members, such as the help,
 * follow. -o, --output: a const char *, with the name of its value; --seed: a uint64_t. */
#define OPTION_ROW_OUTPUT(place, value, ...)                                                                 \
    {.name = "output",                                                                                       \
     .letter = 'o',                                                                                          \
     .kind = OPTION_TEXT,                                                                                    \
     .offset = (place),                                                                                      \
     .argument = (value),                                                                                    \
     __VA_ARGS__}
#define OPTION_ROW_SEED(place, ...)                                                                          \
    {.name = "seed", .kind = OPTION_COUNT, .offset = (place), .argument = "S", .preset = "1", __VA_ARGS__}

/* Rows under one heading, and the struct that they fill. Several tables may fill one struct; one name may
 * stand in several tables, and each of them gets the value. */
typedef struct option_table {
    const char *heading;    /* of --help; NULL for the first, "" to go on under the one before */
    const option_row *rows; /* the last row has no name */
    void *fields;
} option_table;

/* An option that earlier versions had, "subdivide", or one of its values, "keep-form-factors=compressed". */
typedef struct option_gone {
    const char *word;
    const char *instead; /* "give --elements N" */
} option_gone;

typedef struct option_command {
    const char *name;      /* "lambertd", or "lambert solve" of a verb; messages begin with it */
    const char *arguments; /* "STORE", for --help */
    const char *choices;   /* "box|city": the words that may be the first argument; NULL: it is a file */
    const char *summary;
    const char *notes; /* paragraphs after the options; may be NULL */
    size_t least_arguments, most_arguments;
    const option_gone *gone; /* refused with advice, and in no help; NULL: none. The last has no word */
} option_command;

/* A verb of a program, with options of its own. */
typedef struct option_verb {
    const char *name;
    int (*run)(int argc, char **argv); /* argv[0] is the verb; returns the exit status */
    const char *summary;
} option_verb;

#define OPTIONS_GIVEN_MAX 128

typedef struct option_result {
    char **arguments; /* they stand in argv */
    size_t n_arguments;
    const char *given[OPTIONS_GIVEN_MAX]; /* names of options of the command line */
    size_t n_given;
} option_result;

/* Fills the structs of the tables (the last has no rows) with presets and then from argv; a field without a
 * preset keeps its value. Texts stay in argv, whose order changes. Wrong usage is one line on standard error
 * and 2; --help goes to standard output and gives 0. For installers, --print-manual prints the manual page,
 * or the section of a verb, and --print-completion=SHELL the completion of the command line. */
int options_parse(const option_command *command, const option_table *tables, int argc, char **argv,
                  option_result *result);

/* Runs the verb argv[1] of a program, from a list that ends with a row without name. `help VERB` prints the
 * verb's --help; --help, --version, --print-manual and --print-completion are those of the whole program. */
int options_run_verb(const option_command *program, const option_verb *verbs, int argc, char **argv);

/* Wrong usage, 2, where an option was given whose row says that the input settles it; else OPTIONS_GO.
 * instead: the end of the message, "precompute from its scene instead". */
int options_refuse_settled(const option_command *command, const option_table *tables,
                           const option_result *result, const char *instead);

/* True if the option was on the command line. */
bool options_given(const option_result *result, const char *name);

/* Prints "NAME: ..." as one line on standard error; returns 2, the status of wrong usage. */
int options_usage(const char *name, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Strict readers: the whole text must be a finite number. A message begins with the text `what`. */
lam_status option_number(const char *what, const char *text, double *value, lam_error *error);
lam_status option_count(const char *what, const char *text, uint64_t *value, lam_error *error);
lam_status option_size(const char *what, const char *text, uint64_t *bytes, lam_error *error);

/* Exactly count, or at least 1 and at most count, numbers between commas; *found is how many. */
lam_status option_numbers(const char *what, const char *text, size_t count, bool exactly, double *values,
                          size_t *found, lam_error *error);

/* Reads text as the value of a row into field, within the row's limits. */
lam_status option_read(const option_row *row, const char *text, void *field, lam_error *error);

/* True if word is one of the words of "a|b|c". */
bool option_among(const char *word, const char *words);

/* True where the value of an option may be left out. */
static inline bool option_may_stand_alone(const option_row *row) {
    return row->kind == OPTION_OPTIONAL || row->kind == OPTION_SWITCH;
}

/* The place of a word among the words of "a|b|c"; their number where it is none of them. */
unsigned option_place(const char *word, const char *words);

/* The word at a place, cut to fit. */
enum { OPTION_WORD_BYTES = 32 };
void option_word(unsigned place, const char *words, char word[OPTION_WORD_BYTES]);

#endif
