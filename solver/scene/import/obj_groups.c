/* The group of a face whose `g` line has several names: the one of them that has the fewest faces of the
 * file, the first of equals. Programs write the part first or last, and the whole that it belongs to beside
 * it. Runs in the child. */
#include "solver/scene/import/obj_groups.h"

#include "solver/base/array_grow.h"

#include <stdlib.h>
#include <string.h>

void obj_groups_free(obj_groups *g) {
    name_table_free(&g->lines);
    free(g->of);
    *g = (obj_groups){.n = 0};
}

lam_status obj_groups_add(obj_groups *g, const char *line, size_t n_polygons, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t index;
    TRY(name_table_add(&g->lines, line, strlen(line), &index, error));
    TRY(array_grow(&g->of, &g->capacity, n_polygons, sizeof *g->of, "groups", error));
    while (g->n + 1 < n_polygons) g->of[g->n++] = TABLE_NONE; /* faces without a group */
    g->of[g->n++] = index;
done:
    return status;
}

/* The next name of a line, *length letters; NULL behind the last. */
static const char *next_name(const char *line, size_t *length) {
    static const char blanks[] = " \t\r\v\f";
    line += strspn(line, blanks);
    *length = strcspn(line, blanks);
    return *length == 0 ? NULL : line;
}

/* The names of lines and their faces. */
typedef struct group_names {
    name_table names;
    size_t *faces; /* [capacity] */
    size_t capacity;
} group_names;

static lam_status count_names(const obj_groups *g, group_names *out, lam_error *error) {
    lam_status status = LAM_OK;
    size_t *of_lines = memory_allocate(g->lines.n, sizeof *of_lines, "groups", error), length;
    if (of_lines == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < g->n; i++)
        if (g->of[i] != TABLE_NONE) of_lines[g->of[i]]++;
    for (size_t l = 0; l < g->lines.n; l++)
        for (const char *name = name_table_get(&g->lines, l); (name = next_name(name, &length)) != NULL;
             name += length) {
            uint32_t index;
            const size_t before = out->names.n;
            TRY(name_table_add(&out->names, name, length, &index, error));
            TRY(array_grow(&out->faces, &out->capacity, out->names.n, sizeof *out->faces, "groups", error));
            if (out->names.n > before) out->faces[index] = 0;
            out->faces[index] += of_lines[l];
        }
done:
    free(of_lines);
    return status;
}

/* The name of a line that has the fewest faces; *several becomes true where it has more than one. */
static lam_status smallest_name(group_names *all, const char *line, uint32_t *out, bool *several,
                                lam_error *error) {
    lam_status status = LAM_OK;
    size_t length;
    *out = TABLE_NONE;
    *several = false;
    for (const char *name = line; (name = next_name(name, &length)) != NULL; name += length) {
        uint32_t index;
        TRY(name_table_add(&all->names, name, length, &index, error)); /* it is known */
        *several = *several || (*out != TABLE_NONE && index != *out);
        if (*out == TABLE_NONE || all->faces[index] < all->faces[*out]) *out = index;
    }
done:
    return status;
}

lam_status obj_groups_settle(const obj_groups *g, const char *path, imported_faces *s, lam_error *error) {
    lam_status status = LAM_OK;
    group_names all = {.capacity = 0};
    uint32_t *object = memory_allocate(g->lines.n, sizeof *object, "groups", error);
    size_t n_several = 0, example = 0;
    if (object == NULL) TRY(LAM_ERR_MEMORY);
    TRY(count_names(g, &all, error));
    for (size_t l = 0; l < g->lines.n; l++) object[l] = TABLE_NONE;
    for (size_t i = 0; i < g->n; i++) {
        const uint32_t line = g->of[i];
        if (line == TABLE_NONE) continue;
        if (object[line] == TABLE_NONE) {
            uint32_t name;
            bool several;
            TRY(smallest_name(&all, name_table_get(&g->lines, line), &name, &several, error));
            const char *text = name_table_get(&all.names, name);
            TRY(imported_faces_add_object(s, text, strlen(text), &object[line], error));
            if (several && n_several++ == 0) example = i;
        }
        s->polygons[i].object = object[line];
    }
    if (n_several > 0)
        import_warn(
            &s->warnings,
            "%s: %zu lines g name several groups; a face counts to the smallest of them: to '%.60s' of "
            "'%.120s'",
            path, n_several, name_table_get(&s->objects, object[g->of[example]]),
            name_table_get(&g->lines, g->of[example]));
done:
    free(object);
    free(all.faces);
    name_table_free(&all.names);
    return status;
}
