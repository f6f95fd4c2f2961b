#include "solver/codec/luminaire_names.h"

#include "solver/operator/luminaire_light.h"

#include <stdlib.h>
#include <string.h>

static const char *name_of(const void *of, size_t k) {
    return lam_luminaires_name(of, k);
}

static const char *name_of_group(const void *of, size_t k) {
    return luminaires_group_name(of, k);
}

/* Lays the luminaires of groups out in the order of the groups' names, so that those of all groups that a
 * name means stand side by side. */
static lam_status find_members(const lam_luminaires *l, luminaire_names *names, lam_error *error) {
    const size_t k = lam_luminaires_count(l), q = names->groups.n_groups;
    names->start = memory_allocate(q + 1, sizeof *names->start, "names of luminaires", error);
    names->members = memory_allocate(k, sizeof *names->members, "names of luminaires", error);
    if (names->start == NULL || names->members == NULL) return LAM_ERR_MEMORY;
    uint32_t n_members = 0;
    for (size_t at = 0; at < q; at++) {
        for (size_t j = 0; j < k; j++)
            if (luminaires_group_of(l, j) == names->groups.sorted[at])
                names->members[n_members++] = (uint32_t)j;
        names->start[at + 1] = n_members;
    }
    return LAM_OK;
}

lam_status luminaire_names_make(const lam_luminaires *luminaires, luminaire_names *out, lam_error *error) {
    lam_status status = LAM_OK;
    luminaire_names made = {.start = NULL};
    *out = made;
    if (luminaires == NULL) return LAM_OK;
    TRY(group_index_of_names(lam_luminaires_count(luminaires), name_of, luminaires, "luminaire", &made.each,
                             error));
    TRY(group_index_of_names(luminaires_groups(luminaires), name_of_group, luminaires, "group of luminaires",
                             &made.groups, error));
    TRY(find_members(luminaires, &made, error));
    *out = made;
    made = (luminaire_names){.start = NULL};
done:
    luminaire_names_free(&made);
    return status;
}

void luminaire_names_free(luminaire_names *names) {
    group_index_free(&names->each);
    group_index_free(&names->groups);
    free(names->start);
    free(names->members);
    *names = (luminaire_names){.start = NULL};
}

static bool is_whole(const group_index *index, size_t n_found, const uint32_t *found, const char *name,
                     size_t length) {
    return n_found == 1 && strlen(index->names[*found]) == length &&
           memcmp(index->names[*found], name, length) == 0;
}

/* The luminaires of groups that stand side by side in the order of their names. */
static size_t members_of(const luminaire_names *names, size_t n_groups, const uint32_t *groups,
                         const uint32_t **found) {
    const size_t first = (size_t)(groups - names->groups.sorted);
    *found = names->members + names->start[first];
    return names->start[first + n_groups] - names->start[first];
}

size_t luminaire_names_find(const luminaire_names *names, const char *name, size_t length,
                            const uint32_t **found) {
    const uint32_t *each = NULL, *groups = NULL;
    const size_t n_each = group_index_find(&names->each, name, length, &each);
    const size_t n_groups = group_index_find(&names->groups, name, length, &groups);
    const bool of_group = is_whole(&names->groups, n_groups, groups, name, length);
    if (n_each > 0 && (!of_group || is_whole(&names->each, n_each, each, name, length))) {
        *found = each;
        return n_each;
    }
    return n_groups == 0 ? 0 : members_of(names, n_groups, groups, found);
}

void luminaire_names_miss(const luminaire_names *names, const char *name, size_t length,
                          char text[GROUP_MISS]) {
    group_index_miss_beside(&names->each, &names->groups, name, length, text);
}
