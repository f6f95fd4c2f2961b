/* The luminaires of a store by name, alone or by group: names mean the same in both programs. */
#ifndef LAMBERT_CODEC_LUMINAIRE_NAMES_H
#define LAMBERT_CODEC_LUMINAIRE_NAMES_H

#include "solver/operator/groups/groups.h"

/* Starts zeroed; freed by luminaire_names_free. Zeroed it has no names. */
typedef struct luminaire_names {
    group_index each;   /* luminaire k is group k of element k */
    group_index groups; /* group g of luminaires is group g of element g */
    uint32_t *start;    /* [groups + 1], into members */
    uint32_t *members;  /* the luminaires of group groups.sorted[0], then those of groups.sorted[1], ... */
} luminaire_names;

/* Names those of a store, which need not outlive the names; NULL: it has none. O(k groups). Errors:
 * LAM_ERR_MEMORY. */
lam_status luminaire_names_make(const lam_luminaires *luminaires, luminaire_names *out, lam_error *error);

void luminaire_names_free(luminaire_names *names);

/* Luminaires with a name. */
static inline size_t luminaire_names_count(const luminaire_names *names) {
    return names->each.n_groups;
}

/* The luminaires that a name means: the one of exactly this name; or else those of the group of this name; or
 * else luminaires called `name.something`, or `beginning*`; or else those of groups called so. Returns how
 * many; *found points at their numbers, owned by names. O(log k). */
size_t luminaire_names_find(const luminaire_names *names, const char *name, size_t length,
                            const uint32_t **found);

/* group_index_miss for a name that luminaire_names_find does not know: `no luminaire "dsk"; did you mean
 * "desk"?`, where "desk" may be a group of them. O(k). */
void luminaire_names_miss(const luminaire_names *names, const char *name, size_t length,
                          char text[GROUP_MISS]);

#endif
