/* Elements for the backs of faces, behind all fronts, with groups of their own. */
#include "solver/base/array_grow.h"
#include "solver/base/scene/scene_backs.h"
#include "solver/scene/glass.h"
#include "solver/scene/tables.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The elements that get a back, [m->n_backs after]. */
typedef struct back_list {
    size_t n;
    uint32_t *front;
} back_list;

/* An array [rows][m->n] of size-byte values with the entries of the backs behind each row; NULL on failure.
 */
static void *with_backs(const mesh *m, const back_list *backs, const void *data, size_t rows, size_t size,
                        lam_error *error) {
    const size_t n = m->n + backs->n;
    size_t row;
    if (!size_multiply(n, size, &row)) return NULL;
    char *out = memory_allocate(rows, row, "two-sided mesh", error), *to = out;
    for (size_t r = 0; out != NULL && r < rows && row > 0; r++) {
        const char *from = (const char *)data + r * m->n * size;
        memcpy(to, from, m->n * size);
        to += m->n * size;
        for (size_t k = 0; k < backs->n; k++, to += size) memcpy(to, from + backs->front[k] * size, size);
    }
    return out;
}

static lam_status list_backs(const mesh *m, back_list *out, lam_error *error) {
    size_t n = 0;
    for (size_t i = 0; i < m->n; i++) n += m->has_back[i];
    if (n > MESH_NO_VERTEX - 1 - m->n)
        return status_fail(error, LAM_ERR_ARGUMENT,
                           "mesh: %zu elements are too many to give %zu of them backs", m->n, n);
    out->front = memory_allocate(n, sizeof *out->front, "two-sided mesh", error);
    if (out->front == NULL) return LAM_ERR_MEMORY;
    for (uint32_t i = 0; i < m->n; i++)
        if (m->has_back[i]) out->front[out->n++] = i;
    return LAM_OK;
}

/* The index of a new name in names: NAME.back, or, where that is another group's already, NAME.back-2 and so
 * on. */
static lam_status add_back_name(name_table *names, uint32_t group, char **text, size_t *capacity,
                                uint32_t *index, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t length = strlen(name_table_get(names, group)), before = names->n;
    const size_t room = length + sizeof SCENE_BACK + 12;
    TRY(array_grow(text, capacity, room, 1, "group names", error));
    memcpy(*text, name_table_get(names, group), length);
    strcpy(*text + length, SCENE_BACK);
    TRY(name_table_add(names, *text, strlen(*text), index, error));
    for (unsigned k = 2; names->n == before; k++) {
        snprintf(*text + length, room - length, SCENE_BACK "-%u", k);
        TRY(name_table_add(names, *text, strlen(*text), index, error));
    }
done:
    return status;
}

/* An array [n_groups] of size-byte values with those of the groups of backs, of which group g has of[g] or
 * TABLE_NONE, behind them: [n_all]. NULL on failure. */
static void *with_back_groups(const void *data, size_t size, size_t n_groups, size_t n_all,
                              const uint32_t *of, lam_error *error) {
    char *out = memory_allocate(n_all, size, "groups of backs", error);
    if (out == NULL) return NULL;
    memcpy(out, data, n_groups * size);
    for (size_t g = 0; g < n_groups; g++)
        if (of[g] != TABLE_NONE) memcpy(out + of[g] * size, (const char *)data + g * size, size);
    return out;
}

/* Moves the last m->n_backs elements to groups of their own, behind the others. A mesh whose groups have no
 * names yet keeps them as they are. */
static lam_status part_groups(mesh *m, lam_error *error) {
    lam_status status = LAM_OK;
    name_table names = {0};
    char *text = NULL, **block = NULL;
    size_t capacity = 0;
    uint32_t index, *of = NULL;
    double *overlap = NULL;
    struct group_glass *glass = NULL;
    if (m->group_names == NULL) return LAM_OK;
    of = memory_allocate(m->n_groups, sizeof *of, "group names", error);
    if (of == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t g = 0; g < m->n_groups; g++) {
        TRY(name_table_add(&names, m->group_names[g], strlen(m->group_names[g]), &index, error));
        of[g] = TABLE_NONE;
    }
    for (size_t i = m->n - m->n_backs; i < m->n; i++) of[m->group[i]] = 0;
    for (uint32_t g = 0; g < m->n_groups; g++)
        if (of[g] != TABLE_NONE) TRY(add_back_name(&names, g, &text, &capacity, &of[g], error));
    block = name_table_block(&names, error);
    if (block == NULL) TRY(LAM_ERR_MEMORY);
    /* A back lies under the same faces as its front, and lets the same light pass. */
    if (m->overlap != NULL) {
        overlap = with_back_groups(m->overlap, sizeof *overlap, m->n_groups, names.n, of, error);
        if (overlap == NULL) TRY(LAM_ERR_MEMORY);
    }
    if (m->glass != NULL) {
        glass = with_back_groups(m->glass, sizeof *glass, m->n_groups, names.n, of, error);
        if (glass == NULL) TRY(LAM_ERR_MEMORY);
    }
    if (overlap != NULL) {
        free(m->overlap);
        m->overlap = overlap;
        overlap = NULL;
    }
    if (glass != NULL) {
        free(m->glass);
        m->glass = glass;
        m->n_glass = names.n;
        glass = NULL;
    }
    for (size_t i = m->n - m->n_backs; i < m->n; i++) m->group[i] = of[m->group[i]];
    free(m->group_names);
    m->group_names = block;
    m->n_groups = names.n;
done:
    free(of);
    free(text);
    free(overlap);
    free(glass);
    name_table_free(&names);
    return status;
}

lam_status mesh_make_backs(mesh *m, lam_error *error) {
    lam_status status = LAM_OK;
    mesh wide = {0};
    back_list backs = {.n = 0};
    if (m->has_back == NULL) return LAM_OK;
    TRY(list_backs(m, &backs, error));
    wide.elements = with_backs(m, &backs, m->elements, 1, sizeof *m->elements, error);
    wide.area = with_backs(m, &backs, m->area, 1, sizeof *m->area, error);
    wide.normal = with_backs(m, &backs, m->normal, 1, sizeof *m->normal, error);
    wide.group = with_backs(m, &backs, m->group, 1, sizeof *m->group, error);
    wide.reflectance = with_backs(m, &backs, m->reflectance, m->n_channels, sizeof *m->reflectance, error);
    wide.emission = with_backs(m, &backs, m->emission, m->n_channels, sizeof *m->emission, error);
    if (m->textured_face != NULL) {
        wide.textured_face = with_backs(m, &backs, m->textured_face, 1, sizeof *m->textured_face, error);
        if (wide.textured_face == NULL) TRY(LAM_ERR_MEMORY);
    }
    if (m->faces.of != NULL) {
        wide.faces.of = with_backs(m, &backs, m->faces.of, 1, sizeof *m->faces.of, error);
        if (wide.faces.of == NULL) TRY(LAM_ERR_MEMORY);
    }
    if (wide.elements == NULL || wide.area == NULL || wide.normal == NULL || wide.group == NULL ||
        wide.reflectance == NULL || wide.emission == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < backs.n; k++) {
        const uint32_t *front = m->elements[backs.front[k]];
        uint32_t *back = wide.elements[m->n + k];
        const size_t last = corner_count(front) - 1;
        for (size_t c = 0; c <= last; c++) back[c] = front[last - c];
        for (int d = 0; d < 3; d++) wide.normal[m->n + k][d] = -wide.normal[m->n + k][d];
    }
#define MESH_EXCHANGE(member)                                                                                \
    free(m->member);                                                                                         \
    m->member = wide.member;                                                                                 \
    wide.member = NULL
    MESH_EXCHANGE(elements);
    MESH_EXCHANGE(area);
    MESH_EXCHANGE(normal);
    MESH_EXCHANGE(group);
    MESH_EXCHANGE(reflectance);
    MESH_EXCHANGE(emission);
    MESH_EXCHANGE(textured_face);
    MESH_EXCHANGE(faces.of);
    MESH_EXCHANGE(has_back);
#undef MESH_EXCHANGE
    m->two_sided = backs.n == m->n;
    m->n += backs.n;
    m->n_backs = backs.n;
    TRY(part_groups(m, error));
done:
    free(backs.front);
    mesh_free(&wide);
    return status;
}

lam_status mesh_mark_two_sided(mesh *m, lam_error *error) {
    if (m->n_backs > 0) return LAM_OK;
    if (m->has_back == NULL)
        m->has_back = memory_allocate(m->n, sizeof *m->has_back, "two-sided mesh", error);
    if (m->has_back == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < m->n; i++) m->has_back[i] = true;
    return LAM_OK;
}

lam_status mesh_make_two_sided(mesh *m, lam_error *error) {
    const lam_status status = mesh_mark_two_sided(m, error);
    return status == LAM_OK ? mesh_make_backs(m, error) : status;
}
