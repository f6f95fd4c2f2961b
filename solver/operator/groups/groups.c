#include "solver/operator/groups/groups.h"

#include "solver/base/nearest.h"
#include "solver/base/scene/scene_backs.h"
#include "solver/base/scene/scene_buried.h"
#include "store/groups.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int compare_names(const void *a, const void *b, void *names) {
    char **all = names;
    return strcmp(all[*(const uint32_t *)a], all[*(const uint32_t *)b]);
}

/* Elements of a group are in mesh order, and backs are the last of a mesh. */
static void sort_groups(group_index *index, size_t n_fronts) {
    const size_t n = index->n_groups;
    for (size_t g = 0; g < n; g++)
        index->n_backs +=
            index->start[g] < index->start[g + 1] && index->elements[index->start[g]] >= n_fronts;
    uint32_t *front = index->sorted, *back = index->sorted + (n - index->n_backs);
    for (size_t g = 0; g < n; g++) {
        const bool is_back =
            index->start[g] < index->start[g + 1] && index->elements[index->start[g]] >= n_fronts;
        *(is_back ? back++ : front++) = (uint32_t)g;
    }
    qsort_r(index->sorted, n - index->n_backs, sizeof *index->sorted, compare_names, index->names);
    qsort_r(index->sorted + (n - index->n_backs), index->n_backs, sizeof *index->sorted, compare_names,
            index->names);
}

lam_status group_index_make(size_t n, size_t n_backs, const uint32_t *group, size_t n_groups, char **names,
                            group_index *out, lam_error *error) {
    lam_status status = LAM_OK;
    group_index index = {.n_groups = n_groups, .names = names};
    index.start = memory_allocate(n_groups + 1, sizeof *index.start, "groups", error);
    index.elements = memory_allocate(n, sizeof *index.elements, "groups", error);
    index.sorted = memory_allocate(n_groups, sizeof *index.sorted, "groups", error);
    if (index.start == NULL || index.elements == NULL || index.sorted == NULL) {
        status = LAM_ERR_MEMORY;
        goto done;
    }
    for (size_t i = 0; i < n; i++) {
        if (group[i] >= n_groups)
            FAIL(error, LAM_ERR_FORMAT, STORE_MESH "/group[%zu] = %u, must be below the %zu names", i,
                 group[i], n_groups);
        index.start[group[i] + 1]++;
    }
    for (size_t g = 0; g < n_groups; g++) index.start[g + 1] += index.start[g];
    /* start[g] serves as the place of the next element of g, which leaves it one group ahead. */
    for (size_t i = 0; i < n; i++) index.elements[index.start[group[i]]++] = (uint32_t)i;
    memmove(index.start + 1, index.start, n_groups * sizeof *index.start);
    index.start[0] = 0;
    sort_groups(&index, n - n_backs);
    *out = index;
done:
    if (status != LAM_OK) group_index_free(&index);
    return status;
}

lam_status group_index_load(store *s, size_t n, group_index *out, lam_error *error) {
    lam_status status = LAM_OK;
    void *group = NULL;
    char **names = NULL;
    size_t n_groups = 0, n_backs = 0;
    bool two_sided;
    lam_error cause;
    group_index made = {.n_groups = 0};
    TRY(scene_backs_load(s, n, &n_backs, &two_sided, error));
    TRY(store_read(s, STORE_MESH "/group", STORE_U32, 1, (size_t[]){n}, &group, error));
    TRY(store_read_texts(s, STORE_MESH "/group_names", &n_groups, &names, error));
    status = group_index_make(n, n_backs, group, n_groups, names, &made, &cause);
    if (status != LAM_OK) FAIL(error, status, "%s: %s", store_path(s), cause.message);
    TRY(scene_buried_load(s, n, &made.buried, error));
    *out = made;
    made = (group_index){.n_groups = 0};
done:
    group_index_free(&made);
    free(group);
    return status;
}

lam_status group_index_measure(group_index *index, const double *area, lam_error *error) {
    index->area = memory_allocate(index->n_groups, sizeof *index->area, "areas of groups", error);
    if (index->area == NULL) return LAM_ERR_MEMORY;
    for (size_t g = 0; g < index->n_groups; g++)
        for (uint32_t e = index->start[g]; e < index->start[g + 1]; e++)
            if (group_index_counts(index, index->elements[e])) index->area[g] += area[index->elements[e]];
    return LAM_OK;
}

double group_index_area(const group_index *index, size_t n_groups, const uint32_t *groups) {
    double sum = 0;
    for (size_t k = 0; k < n_groups; k++) sum += index->area[groups[k]];
    return sum;
}

lam_status group_index_of_names(size_t count, name_at *name, const void *of, const char *noun,
                                group_index *out, lam_error *error) {
    lam_status status = LAM_OK;
    size_t bytes = count * sizeof(char *);
    uint32_t *own = NULL;
    *out = (group_index){.n_groups = 0};
    if (count == 0) return LAM_OK;
    for (size_t k = 0; k < count; k++) bytes += strlen(name(of, k)) + 1;
    char **names = memory_allocate(bytes, 1, noun, error);
    own = memory_allocate(count, sizeof *own, noun, error);
    if (names == NULL || own == NULL) {
        free(names);
        TRY(LAM_ERR_MEMORY);
    }
    char *text = (char *)(names + count);
    for (size_t k = 0; k < count; k++) {
        own[k] = (uint32_t)k;
        names[k] = text;
        text = stpcpy(text, name(of, k)) + 1;
    }
    TRY(group_index_make(count, 0, own, count, names, out, error));
    out->noun = noun;
done:
    free(own);
    return status;
}

static const char *emitter_name(const void *of, size_t k) {
    return lam_operator_emitter_name(of, k);
}

lam_status group_index_of_emitters(const lam_operator *op, group_index *out, lam_error *error) {
    return group_index_of_names(lam_operator_emitters(op), emitter_name, op, "emitter", out, error);
}

void group_index_free(group_index *index) {
    free(index->names);
    free(index->start);
    free(index->elements);
    free(index->sorted);
    free(index->buried);
    free(index->area);
    *index = (group_index){0};
}

void group_index_extent(const group_index *index, size_t group, const double *area, group_extent *counted,
                        group_extent *buried) {
    *counted = *buried = (group_extent){0};
    for (uint32_t at = index->start[group]; at < index->start[group + 1]; at++) {
        const uint32_t i = index->elements[at];
        group_extent *const to = group_index_counts(index, i) ? counted : buried;
        to->elements++;
        to->area += area[i];
    }
}

/* The part of a group's name that must agree with name[0..length): all of it; its beginning, with a '.'
 * behind that; its beginning. */
typedef enum name_part { NAME_WHOLE, NAME_OBJECT, NAME_BEGINNING } name_part;

static int compare(const char *group, const char *name, size_t length, name_part part) {
    int order = strncmp(group, name, length);
    if (order != 0 || part == NAME_BEGINNING) return order;
    unsigned char next = (unsigned char)group[length], wanted = part == NAME_OBJECT ? '.' : '\0';
    return next < wanted ? -1 : next > wanted;
}

/* A stretch of sorted: groups of fronts, or of backs alone. */
typedef struct group_range {
    size_t first, end;
} group_range;

/* The first place in a range whose name is not before (or, with beyond, is after) the wanted one. */
static size_t bound(const group_index *index, group_range in, const char *name, size_t length, name_part part,
                    bool beyond) {
    size_t low = in.first, high = in.end;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        int order = compare(index->names[index->sorted[middle]], name, length, part);
        if (order < 0 || (beyond && order == 0))
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* The groups of a range whose names agree with this one in that part. */
static size_t find_in(const group_index *index, group_range in, const char *name, size_t length,
                      name_part part, const uint32_t **groups) {
    const size_t first = bound(index, in, name, length, part, false);
    const size_t last = bound(index, in, name, length, part, true);
    if (first < last) *groups = index->sorted + first;
    return last - first;
}

size_t group_index_find(const group_index *index, const char *name, size_t length, const uint32_t **groups) {
    const size_t suffix = sizeof SCENE_BACK - 1, n_fronts = index->n_groups - index->n_backs;
    const group_range fronts = {0, n_fronts}, backs = {n_fronts, index->n_groups};
    if (memchr(name, '\0', length) != NULL) return 0;
    size_t found = find_in(index, fronts, name, length, NAME_WHOLE, groups);
    if (found == 0) found = find_in(index, backs, name, length, NAME_WHOLE, groups);
    if (found == 0) found = find_in(index, fronts, name, length, NAME_OBJECT, groups);
    const bool of_backs = length > suffix && memcmp(name + length - suffix, SCENE_BACK, suffix) == 0;
    if (found == 0 && of_backs) found = find_in(index, backs, name, length - suffix, NAME_OBJECT, groups);
    const size_t beginning = of_backs ? length - suffix : length;
    if (found == 0 && beginning > 0 && name[beginning - 1] == '*')
        found = find_in(index, of_backs ? backs : fronts, name, beginning - 1, NAME_BEGINNING, groups);
    return found;
}

/* The name of a group, or of an object of several materials, that is nearest to word, if it is nearer than
 * found, which is "" where none was near. */
static void find_nearest(const group_index *index, const char *word, char found[NEAREST_LENGTH_MAX + 1]) {
    const char *nearest = NULL;
    for (size_t g = 0; g < index->n_groups; g++) {
        char object[NEAREST_LENGTH_MAX + 1] = "";
        const size_t length = strcspn(index->names[g], ".");
        if (length <= NEAREST_LENGTH_MAX) memcpy(object, index->names[g], length);
        nearest = nearest_word(word, 3, (const char *const[]){found, index->names[g], object});
        if (nearest != NULL && nearest != found) strcpy(found, nearest);
    }
}

void group_index_miss(const group_index *index, const char *name, size_t length, char text[GROUP_MISS]) {
    group_index_miss_beside(index, NULL, name, length, text);
}

void group_index_miss_beside(const group_index *index, const group_index *beside, const char *name,
                             size_t length, char text[GROUP_MISS]) {
    enum { SHOWN = 80 };
    const char *cut = length > SHOWN ? "..." : "";
    char word[NEAREST_LENGTH_MAX + 1] = "", nearest[NEAREST_LENGTH_MAX + 1] = "";
    size_t at =
        (size_t)snprintf(text, GROUP_MISS, "no %s \"%.*s%s\"", index->noun != NULL ? index->noun : "group",
                         length > SHOWN ? SHOWN : (int)length, name, cut);
    if (length <= NEAREST_LENGTH_MAX) {
        memcpy(word, name, length);
        find_nearest(index, word, nearest);
        if (beside != NULL) find_nearest(beside, word, nearest);
    }
    if (nearest[0] != '\0') {
        snprintf(text + at, GROUP_MISS - at, "; did you mean \"%s\"?", nearest);
        return;
    }
    at += (size_t)snprintf(text + at, GROUP_MISS - at, "; there %s:", index->n_groups == 1 ? "is" : "are");
    for (size_t g = 0; g < index->n_groups; g++) {
        if (at + strlen(index->names[g]) + sizeof "  ..." > GROUP_MISS) {
            strcpy(text + at, " ...");
            return;
        }
        at += (size_t)sprintf(text + at, " %s", index->names[g]);
    }
}
