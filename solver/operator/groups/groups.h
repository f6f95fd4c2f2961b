/* The groups of a scene by name, and the elements of each: group names mean the same in both programs. */
#ifndef LAMBERT_OPERATOR_GROUPS_GROUPS_H
#define LAMBERT_OPERATOR_GROUPS_GROUPS_H

#include "store/status.h"
#include "store/store.h"

#include <stdbool.h>
#include <stdint.h>

typedef struct group_index {
    const char *noun; /* static: of what messages speak */
    size_t n_groups;
    char **names;       /* [n_groups], one block, owned */
    uint32_t *start;    /* [n_groups + 1], into elements */
    uint32_t *elements; /* [n]: those of group 0 in mesh order, of group 1, ... */
    uint32_t *sorted;   /* [n_groups]: groups in the order of their names, those of backs alone at the end */
    size_t n_backs;     /* groups of backs alone */
    bool *buried;       /* [n], owned: elements that figures leave out (scene_buried.h); NULL: none */
    double *area;       /* [n_groups], m^2, after group_index_measure; else NULL */
} group_index;

/* Takes over names, also on an error. group is [n], of which the last n_backs elements are the backs of
 * others. Errors: LAM_ERR_FORMAT (a group that has no name). */
lam_status group_index_make(size_t n, size_t n_backs, const uint32_t *group, size_t n_groups, char **names,
                            group_index *out, lam_error *error);

/* Loads the groups of a store of n elements, buried ones included. Errors: LAM_ERR_FORMAT, LAM_ERR_DAMAGED,
 * LAM_ERR_MEMORY; each names the path. */
lam_status group_index_load(store *s, size_t n, group_index *out, lam_error *error);

/* Sums up the areas of the elements that figures take in, of area [n], by group. Errors: LAM_ERR_MEMORY. */
lam_status group_index_measure(group_index *index, const double *area, lam_error *error);

/* Things by name: thing k of `count`, whose name is name(of, k), is group k of element k. noun: static. Of
 * none it is empty. Errors: LAM_ERR_MEMORY. */
typedef const char *name_at(const void *of, size_t k);
lam_status group_index_of_names(size_t count, name_at *name, const void *of, const char *noun,
                                group_index *out, lam_error *error);

/* The emitters of an operator of few emitters; of another operator it is empty. Errors: LAM_ERR_MEMORY. */
lam_status group_index_of_emitters(const lam_operator *op, group_index *out, lam_error *error);

void group_index_free(group_index *index);

/* True where the figures of its groups take an element in. */
static inline bool group_index_counts(const group_index *index, size_t element) {
    return index->buried == NULL || !index->buried[element];
}

/* Elements and their area, m^2. */
typedef struct group_extent {
    size_t elements;
    double area;
} group_extent;

/* Measures the part of a group that its figures take in, and the part that they leave out. O(elements of the
 * group). */
void group_index_extent(const group_index *index, size_t group, const double *area, group_extent *counted,
                        group_extent *buried);

/* The groups that a name means: those of exactly this name, or else all called `name.something` (an object of
 * several materials), of which none has backs alone; or else, of `name.back`, those of backs called
 * `name.something`; or else, of `beginning*`, all whose names begin so, and of `beginning*.back` such backs.
 * Returns how many; *groups points at their numbers, owned by index. O(log g). */
size_t group_index_find(const group_index *index, const char *name, size_t length, const uint32_t **groups);

/* The area of some groups together, m^2; index is measured. */
double group_index_area(const group_index *index, size_t n_groups, const uint32_t *groups);

/* For a name that group_index_find does not know, writes `no group "lmap"; did you mean "lamp"?`, or the
 * first names there are where none is near. O(g). */
#define GROUP_MISS 256
void group_index_miss(const group_index *index, const char *name, size_t length, char text[GROUP_MISS]);

/* The same of a name that might be one of another index too, or with beside NULL not. */
void group_index_miss_beside(const group_index *index, const group_index *beside, const char *name,
                             size_t length, char text[GROUP_MISS]);

#endif
