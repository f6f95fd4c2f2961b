/* The two hash tables that scenes are made with: names and points, each entry kept once. Private to
 * solver/scene. */
#ifndef LAMBERT_SCENE_TABLES_H
#define LAMBERT_SCENE_TABLES_H

#include "store/status.h"

#include <stdint.h>

/* No entry: a face without an object name or a material. */
#define TABLE_NONE 0xFFFFFFFFu

/* Open addressing: slot -> index + 1 of an entry, 0 when free. */
typedef struct table_slots {
    uint32_t *slots;
    size_t n_slots; /* a power of two, or 0 */
} table_slots;

/* Texts, one after the other in text with their NULs; start[i] is where text i begins. */
typedef struct name_table {
    size_t n;
    size_t *start;
    size_t start_capacity;
    char *text;
    size_t text_bytes, text_capacity;
    table_slots slots;
} name_table;

/* *index = the entry that equals the first length bytes of name, added when it is new. */
lam_status name_table_add(name_table *t, const char *name, size_t length, uint32_t *index, lam_error *error);
const char *name_table_get(const name_table *t, size_t index);
void name_table_free(name_table *t);

/* The texts as one block, freed by the caller with free(): [n] pointers, then the texts. NULL on failure. */
char **name_table_block(const name_table *t, lam_error *error);

/* Points; two are the same when all coordinates are equal (-0 equals 0). */
typedef struct point_table {
    size_t n;
    double (*points)[3];
    size_t capacity;
    table_slots slots;
} point_table;

lam_status point_table_add(point_table *t, const double point[3], uint32_t *index, lam_error *error);
void point_table_free(point_table *t);

/* place[v] = the first of n points that is the same as point v. Cost: O(n). Errors: LAM_ERR_MEMORY. */
lam_status points_weld(size_t n, const double (*points)[3], uint32_t *place, lam_error *error);

#endif
