/* The three lines that say of a store what a person wants to know first: the scene, how exact its light is,
 * and how to look at it. */
#ifndef LAMBERT_VERBS_STORE_LINES_H
#define LAMBERT_VERBS_STORE_LINES_H

#include "solver/codec/describe.h"

enum { STORE_LINES = 3, STORE_LINE_BYTES = 512 };

/* Makes them from the description of the store at a path; faces: of the file that was read, 0 where it is not
 * known. */
void store_lines_make(const json_t *about, const char *path, size_t faces,
                      char lines[STORE_LINES][STORE_LINE_BYTES]);

#endif
