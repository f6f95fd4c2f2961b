#include "server/scene/group_list.h"

#include "server/scene/scene.h"
#include "solver/codec/json_writer.h"
#include "store/groups.h"

#include <math.h>

/* means [C] of x [C][n] over the elements of a group that figures take in: sum A x / sum A. */
static void mean_of_group(const scene *of, size_t group, const float *x, double *means) {
    const group_index *groups = &of->groups;
    for (size_t c = 0; c < of->n_channels; c++) {
        double sum = 0;
        for (uint32_t at = groups->start[group]; at < groups->start[group + 1]; at++) {
            const uint32_t i = groups->elements[at];
            if (group_index_counts(groups, i)) sum += of->area[i] * (double)x[c * of->n + i];
        }
        means[c] = groups->area[group] > 0 ? sum / groups->area[group] : NAN;
    }
}

lam_status group_emission_read(store *s, const scene *of, double **out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t C = of->n_channels, n_groups = of->groups.n_groups;
    void *emission = NULL;
    double *made = NULL;
    TRY(store_read(s, STORE_MESH "/emission", STORE_F32, 2, (size_t[]){C, of->n}, &emission, error));
    made = memory_allocate(n_groups, C * sizeof *made, "emission of groups", error);
    if (made == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t g = 0; g < n_groups; g++) mean_of_group(of, g, emission, made + g * C);
    *out = made;
    made = NULL;
done:
    free(made);
    free(emission);
    return status;
}

/* means [C] is room for its reflectance. */
static bool write_group(const scene *of, size_t group, double *means, buffer *b) {
    const size_t C = of->n_channels;
    group_extent counted, buried;
    group_index_extent(&of->groups, group, of->area, &counted, &buried);
    mean_of_group(of, group, of->reflectance, means);
    return buffer_append_text(b, "{\"name\":") && json_write_text(b, of->groups.names[group]) &&
           buffer_append_text(b, ",\"area\":") && json_write_double(b, of->groups.area[group]) &&
           buffer_printf(b, ",\"elements\":%zu,\"reflectance\":", counted.elements + buried.elements) &&
           json_write_doubles(b, means, C) && buffer_append_text(b, ",\"emission\":") &&
           json_write_doubles(b, of->group_emission + group * C, C) &&
           buffer_printf(b, ",\"buried\":%zu}", buried.elements);
}

lam_status group_list_write(const scene *of, buffer *out, lam_error *error) {
    static const char what[] = "the groups of a scene";
    const char *unit = light_kind_word(of->lights);
    buffer b = {0};
    double *means = memory_allocate(of->n_channels, sizeof *means, what, error);
    if (means == NULL) return LAM_ERR_MEMORY;
    bool written = buffer_append_text(&b, "{\"scene\":") && json_write_text(&b, of->name) &&
                   buffer_printf(&b,
                                 ",\"elements\":%zu,\"channels\":%zu,\"lights\":\"%s\",\"units\":{\"area\":"
                                 "\"m2\",\"emission\":\"%s/m2\"},\"groups\":[",
                                 of->n, of->n_channels, unit, unit);
    for (size_t g = 0; written && g < of->groups.n_groups; g++)
        written = (g == 0 || buffer_append(&b, ",", 1)) && write_group(of, g, means, &b);
    written = written && buffer_append_text(&b, "]}\n");
    free(means);
    if (!written) {
        buffer_free(&b);
        return status_fail(error, LAM_ERR_MEMORY, "not enough memory for %s", what);
    }
    buffer_trim(&b);
    *out = b;
    return LAM_OK;
}
