/* The lights of a glTF or GLB that are no faces, read from its JSON. Runs in the child. Source:
 * KHR_lights_punctual; glTF 2.0, 3.5.3. */
#include "solver/base/array_grow.h"
#include "solver/scene/import/gltf_nodes.h"
#include "solver/scene/import/imported_faces.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PUNCTUAL "KHR_lights_punctual"

/* By so much an angle may be off that a writer rounded to single precision, rad: half a turn of 180 degrees
 * is 4e-8 above pi/2 then, and a spot without an edge has two angles that should be the same. */
static const double rounding = 1e-6;

typedef struct light_reading {
    const char *path;
    const json_t *root, *list; /* of the lights of the file */
    imported_faces *s;
    name_table names;
    uint32_t *tries; /* of a name: the number that it got last */
    size_t tries_capacity;
    size_t n_of[PUNCTUAL_KINDS], n_ranges;
    size_t n_unread; /* of nodes that are not in the scene */
} light_reading;

static const json_t *extension_of(const json_t *owner) {
    return json_object_get(json_object_get(owner, "extensions"), PUNCTUAL);
}

/* A number of a light of the list, within limits, which stays as it is where the file does not give it. */
static lam_status read_amount(const light_reading *r, size_t light, const char *what, const json_t *value,
                              double least, double most, double *out, lam_error *error) {
    lam_status status = LAM_OK;
    if (value == NULL) goto done;
    if (!json_is_number(value))
        FAIL(error, LAM_ERR_FORMAT, "%s: lights[%zu] of " PUNCTUAL ": %s must be a number", r->path, light,
             what);
    const double number = json_number_value(value);
    if (!(number >= least && number <= most))
        FAIL(error, LAM_ERR_FORMAT,
             "%s: lights[%zu] of " PUNCTUAL ": %s = %.10g, must be from %.10g to %.10g", r->path, light, what,
             number, least, most);
    *out = number;
done:
    return status;
}

static lam_status read_colour(const light_reading *r, size_t light, const json_t *value, double colour[3],
                              lam_error *error) {
    lam_status status = LAM_OK;
    if (value == NULL) goto done;
    if (json_array_size(value) != 3)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: lights[%zu] of " PUNCTUAL ": color must be an array of three numbers", r->path, light);
    for (size_t c = 0; c < 3; c++)
        TRY(read_amount(r, light, "color", json_array_get(value, c), 0, PUNCTUAL_COLOUR_MOST, &colour[c],
                        error));
done:
    return status;
}

static lam_status read_kind(const light_reading *r, size_t light, const json_t *value, punctual_kind *kind,
                            lam_error *error) {
    const char *word = json_string_value(value);
    char shown[PUNCTUAL_NAME];
    for (int k = 0; word != NULL && k < PUNCTUAL_KINDS; k++)
        if (strcmp(word, punctual_kind_name((punctual_kind)k)) == 0) {
            *kind = (punctual_kind)k;
            return LAM_OK;
        }
    punctual_name(word != NULL ? word : "", sizeof shown, shown);
    return status_fail(error, LAM_ERR_FORMAT,
                       "%s: lights[%zu] of " PUNCTUAL ": type = '%s', must be point, spot or directional",
                       r->path, light, shown);
}

static lam_status read_spot(const light_reading *r, size_t light, const json_t *spot, punctual_light *out,
                            lam_error *error) {
    lam_status status = LAM_OK;
    if (spot != NULL && !json_is_object(spot))
        FAIL(error, LAM_ERR_FORMAT, "%s: lights[%zu] of " PUNCTUAL ": spot must be an object", r->path,
             light);
    TRY(read_amount(r, light, "outerConeAngle", json_object_get(spot, "outerConeAngle"), PUNCTUAL_OUTER_LEAST,
                    PUNCTUAL_OUTER_MOST + rounding, &out->outer, error));
    TRY(read_amount(r, light, "innerConeAngle", json_object_get(spot, "innerConeAngle"), 0,
                    PUNCTUAL_OUTER_MOST + rounding, &out->inner, error));
    out->outer = fmin(out->outer, PUNCTUAL_OUTER_MOST);
    if (out->inner > out->outer + rounding)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: lights[%zu] of " PUNCTUAL ": innerConeAngle = %.10g, must be at most outerConeAngle, %.10g",
             r->path, light, out->inner, out->outer);
    out->inner = fmin(out->inner, out->outer);
done:
    return status;
}

/* A light of the list, without name and place. */
static lam_status read_light(const light_reading *r, size_t light, punctual_light *out, lam_error *error) {
    lam_status status = LAM_OK;
    const json_t *given = json_array_get(r->list, light);
    *out = (punctual_light){
        .intensity = 1, .colour = {1, 1, 1}, .inner = PUNCTUAL_INNER, .outer = PUNCTUAL_OUTER};
    TRY(read_kind(r, light, json_object_get(given, "type"), &out->kind, error));
    TRY(read_amount(r, light, "intensity", json_object_get(given, "intensity"), 0, PUNCTUAL_INTENSITY_MOST,
                    &out->intensity, error));
    TRY(read_colour(r, light, json_object_get(given, "color"), out->colour, error));
    if (out->kind == PUNCTUAL_SPOT) TRY(read_spot(r, light, json_object_get(given, "spot"), out, error));
    out->has_range = json_object_get(given, "range") != NULL;
done:
    return status;
}

/* The name of the node, or of the light, or light-INDEX; with a number behind where another light has it. */
static lam_status name_light(light_reading *r, const json_t *node, size_t light, char out[PUNCTUAL_NAME],
                             lam_error *error) {
    lam_status status = LAM_OK;
    char name[PUNCTUAL_NAME] = "", number[16];
    uint32_t first = 0, index = 0;
    const json_t *const named[] = {node, json_array_get(r->list, light)};
    for (int k = 0; k < 2 && name[0] == '\0'; k++) {
        const char *own = json_string_value(json_object_get(named[k], "name"));
        if (own != NULL) punctual_name(own, sizeof name, name);
    }
    if (name[0] == '\0') snprintf(name, sizeof name, "light-%zu", light);
    memcpy(out, name, sizeof name);
    for (size_t before = r->names.n;; before = r->names.n) {
        TRY(name_table_add(&r->names, out, strlen(out), &index, error));
        if (r->names.n > before) {
            TRY(array_grow(&r->tries, &r->tries_capacity, r->names.n, sizeof *r->tries, "lights", error));
            r->tries[index] = 1;
            break;
        }
        if (strcmp(out, name) == 0) first = index;
        const int length = snprintf(number, sizeof number, "-%u", ++r->tries[first]);
        punctual_name(name, PUNCTUAL_NAME - (size_t)length, out);
        memcpy(out + strlen(out), number, (size_t)length + 1);
    }
done:
    return status;
}

/* A light shines along -z of its node, which may scale it to any length. */
static lam_status add_light(light_reading *r, size_t index, const gltf_transform *t, lam_error *error) {
    lam_status status = LAM_OK;
    const json_t *node = json_array_get(json_object_get(r->root, "nodes"), index);
    const json_t *extension = extension_of(node), *which = json_object_get(extension, "light");
    const size_t n = json_array_size(r->list);
    imported_faces *s = r->s;
    punctual_light made;
    if (extension == NULL) goto done;
    if (!json_is_integer(which))
        FAIL(error, LAM_ERR_FORMAT, "%s: nodes[%zu]: light of " PUNCTUAL " must be the number of a light",
             r->path, index);
    if (json_integer_value(which) < 0 || (size_t)json_integer_value(which) >= n)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: nodes[%zu]: light of " PUNCTUAL " = %lld, but the file has %zu lights", r->path, index,
             (long long)json_integer_value(which), n);
    if (s->n_punctual == PUNCTUAL_MOST)
        FAIL(error, LAM_ERR_FORMAT, "%s: nodes[%zu]: with it the scene has more than %d lights of " PUNCTUAL,
             r->path, index, PUNCTUAL_MOST);
    const size_t light = (size_t)json_integer_value(which);
    TRY(read_light(r, light, &made, error));
    TRY(name_light(r, node, light, made.name, error));
    for (int d = 0; d < 3; d++) {
        made.at[d] = t->a[d][3];
        made.direction[d] = -t->a[d][2];
    }
    if (!punctual_light_settle(&made)) {
        import_warn(&s->warnings, "%s: the light '%s' is left out: its place or its direction is not usable",
                    r->path, made.name);
        goto done;
    }
    TRY(array_grow(&s->punctual, &s->punctual_capacity, s->n_punctual + 1, sizeof *s->punctual, "lights",
                   error));
    s->punctual[s->n_punctual++] = made;
    r->n_of[made.kind]++;
    r->n_ranges += made.has_range;
done:
    return status;
}

static void tell_lights(const light_reading *r) {
    const size_t n = r->s->n_punctual;
    char kinds[128] = "";
    for (size_t k = 0, used = 0; k < PUNCTUAL_KINDS; k++)
        if (r->n_of[k] > 0)
            used += (size_t)snprintf(kinds + used, sizeof kinds - used, "%s%zu %s", used > 0 ? ", " : "",
                                     r->n_of[k], punctual_kind_name((punctual_kind)k));
    if (n > 0)
        import_warn(&r->s->warnings, "%s: its %zu light%s (" PUNCTUAL ") %s read: %s", r->path, n,
                    n == 1 ? "" : "s", n == 1 ? "is" : "are", kinds);
    if (r->n_ranges > 0)
        import_warn(&r->s->warnings, "%s: the range of %zu light%s is left out: light ends at surfaces alone",
                    r->path, r->n_ranges, r->n_ranges == 1 ? "" : "s");
    if (r->n_unread > 0)
        import_warn(&r->s->warnings,
                    "%s: %zu light%s (" PUNCTUAL ") %s left out: not in the scene that is read", r->path,
                    r->n_unread, r->n_unread == 1 ? "" : "s", r->n_unread == 1 ? "is" : "are");
}

lam_status gltf_read_lights(const char *path, const char *bytes, size_t length, imported_faces *s,
                            lam_error *error) {
    static const char member[] = "\"" PUNCTUAL "\"";
    lam_status status = LAM_OK;
    gltf_nodes nodes = {.n = 0};
    gltf_find_json(&bytes, &length);
    if (memmem(bytes, length, member, sizeof member - 1) == NULL) return LAM_OK;
    json_t *root = json_loadb(bytes, length, 0, NULL);
    light_reading r = {
        .path = path, .root = root, .list = json_object_get(extension_of(root), "lights"), .s = s};
    TRY(gltf_nodes_place(root, &nodes, error));
    for (size_t k = 0; k < nodes.n_read; k++)
        TRY(add_light(&r, nodes.order[k], &nodes.placed[nodes.order[k]], error));
    for (size_t k = nodes.n_read; k < nodes.n; k++)
        r.n_unread += extension_of(json_array_get(json_object_get(root, "nodes"), nodes.order[k])) != NULL;
    tell_lights(&r);
done:
    gltf_nodes_free(&nodes);
    name_table_free(&r.names);
    free(r.tries);
    json_decref(root);
    return status;
}
