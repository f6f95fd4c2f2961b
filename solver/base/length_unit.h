/* Units of length by name. The only place of these numbers. */
#ifndef LAMBERT_BASE_LENGTH_UNIT_H
#define LAMBERT_BASE_LENGTH_UNIT_H

typedef struct length_unit {
    const char *word, *name; /* "mm", "millimetres" */
    double metres;
} length_unit;

/* The unit of a word, or NULL; the words as "mm|cm|m|in|ft". */
const length_unit *length_unit_find(const char *word);
#define LENGTH_UNIT_WORDS "mm|cm|m|in|ft"

#endif
