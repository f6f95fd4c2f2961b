#include "server/scene/luminaire_places.h"

#include "solver/codec/json_writer.h"
#include "solver/operator/luminaire_light.h"
#include "store/status.h"

#include <stdlib.h>

/* The luminaires of a group, and their lumens. */
typedef struct group_sum {
    size_t count;
    double lumens;
} group_sum;

static bool write_vector(buffer *b, const char *name, const double v[3], double sign) {
    /* -0 becomes 0. */
    const double turned[3] = {sign * v[0] + 0, sign * v[1] + 0, sign * v[2] + 0};
    return buffer_printf(b, ",\"%s\":", name) && json_write_doubles(b, turned, 3);
}

static bool write_number(buffer *b, const char *name, double value) {
    return buffer_printf(b, ",\"%s\":", name) && json_write_double(b, value);
}

static bool write_luminaire(buffer *b, const luminaire_shown *l) {
    return buffer_append_text(b, "{\"name\":") && json_write_text(b, l->name) &&
           buffer_append_text(b, ",\"group\":") &&
           (l->group != NULL ? json_write_text(b, l->group) : buffer_append_text(b, "null")) &&
           write_vector(b, "at", l->at, 1) && write_vector(b, "aim", l->z, -1) &&
           write_vector(b, "c0", l->x, 1) && write_number(b, "dim", l->dimmer) &&
           write_number(b, "lumens", l->lumens) && write_vector(b, "colour", l->colour, 1) &&
           buffer_printf(b, ",\"opening\":{\"shape\":\"%s\"", luminaire_shape_name(l->shape)) &&
           write_vector(b, "size", l->size, 1) && buffer_append_text(b, "}}");
}

static bool write_group(buffer *b, const char *name, const group_sum *sum) {
    return buffer_append_text(b, "{\"name\":") && json_write_text(b, name) &&
           buffer_printf(b, ",\"luminaires\":%zu", sum->count) && write_number(b, "lumens", sum->lumens) &&
           buffer_append_text(b, "}");
}

/* groups [n_groups], zeroed. */
static bool write_all(const lam_luminaires *l, group_sum *groups, buffer *b) {
    const size_t k = lam_luminaires_count(l), q = luminaires_groups(l);
    double lumens = 0;
    bool written = buffer_append_text(b, "{\"luminaires\":[");
    for (size_t j = 0; written && j < k; j++) {
        const luminaire_shown shown = luminaires_shown(l, j);
        const uint32_t group = luminaires_group_of(l, j);
        lumens += shown.lumens;
        if (group != LUMINAIRE_NO_GROUP) {
            groups[group].count++;
            groups[group].lumens += shown.lumens;
        }
        written = buffer_append_text(b, j > 0 ? "," : "") && write_luminaire(b, &shown);
    }
    written = written && buffer_append_text(b, "],\"groups\":[");
    for (size_t g = 0; written && g < q; g++)
        written = buffer_append_text(b, g > 0 ? "," : "") &&
                  write_group(b, luminaires_group_name(l, g), &groups[g]);
    return written && buffer_append_text(b, "]") && write_number(b, "lumens", lumens) &&
           buffer_append_text(b, "}\n");
}

lam_status luminaire_places_write(const lam_luminaires *luminaires, buffer *out, lam_error *error) {
    static const char of[] = "the luminaires of a scene";
    buffer written = {0};
    if (luminaires == NULL) return LAM_OK;
    group_sum *groups = memory_allocate(luminaires_groups(luminaires), sizeof *groups, of, error);
    if (groups == NULL) return LAM_ERR_MEMORY;
    const bool good = write_all(luminaires, groups, &written);
    free(groups);
    if (!good) {
        buffer_free(&written);
        return status_fail(error, LAM_ERR_MEMORY, "not enough memory for %s", of);
    }
    buffer_trim(&written);
    *out = written;
    return LAM_OK;
}
