/* The description of a store is one JSON object, put together from the attributes of /, /mesh, /operator,
 * /error, /sky, /luminaires, /sensors and /form_factors, and from groups, emitters and cameras
 * (store/FORMAT.md; deploy/docs/api.md). A whole number is written as an integer, and one that is not finite
 * as null. */
#include "solver/codec/describe.h"

#include "solver/base/scene/scene_buried.h"
#include "solver/base/scene/scene_cameras.h"
#include "solver/base/scene/scene_faces.h"
#include "solver/base/scene/scene_glass.h"
#include "solver/codec/headline.h"
#include "solver/codec/stated_notes.h"
#include "solver/operator/operator.h"
#include "solver/operator/stated/error_figures.h"
#include "store/groups.h"
#include "store/status.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

json_t *describe_number(double x) {
    if (!isfinite(x)) return json_null();
    return fabs(x) < 0x1p53 && x == floor(x) ? json_integer((json_int_t)x) : json_real(x);
}

static void add_attribute(void *context, const char *name, const char *text, double number) {
    json_t *object = context;
    json_object_set_new(object, name, text != NULL ? json_string(text) : describe_number(number));
}

/* All attributes of a group as one object. */
static lam_status attributes_of(store *s, const char *group, json_t **out, lam_error *error) {
    json_t *object = json_object();
    lam_status status = store_each_attribute(s, group, add_attribute, object, error);
    if (status == LAM_OK)
        *out = object;
    else
        json_decref(object);
    return status;
}

/* Copies a member of one object to another, null where it is missing. */
static void copy_member(json_t *to, const char *name, const json_t *from, const char *from_name) {
    json_t *value = json_object_get(from, from_name);
    json_object_set_new(to, name, value != NULL ? json_incref(value) : json_null());
}

/* Adds {"glass":{"transmittance":T,"faces":N}} to groups that are panes, and the law of these to out. */
static lam_status add_glass(store *s, json_t *groups, json_t *out, lam_error *error) {
    const size_t n_groups = json_array_size(groups);
    scene_glass glass;
    const lam_status status = scene_glass_load(s, n_groups, &glass, error);
    if (status != LAM_OK || glass.of == NULL) return status;
    for (size_t g = 0; g < n_groups; g++)
        if (glass.of[g].transmittance > 0)
            json_object_set_new(json_array_get(groups, g), "glass",
                                json_pack("{s:o, s:o}", "transmittance",
                                          describe_number(glass.of[g].transmittance), "faces",
                                          describe_number(glass.of[g].faces)));
    json_object_set_new(out, "glass_law", json_string(glass_law_word(&glass)));
    free(glass.of);
    return LAM_OK;
}

/* Adds to groups, by the numbers of elements' groups, {"buried":{"elements":N,"area":m2}} where they have
 * elements that figures leave out. */
static lam_status add_buried(store *s, size_t n, const uint32_t *group, json_t *groups, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n_groups = json_array_size(groups);
    bool *buried = NULL;
    void *area = NULL;
    size_t *counts = NULL;
    double *sums = NULL;
    TRY(scene_buried_load(s, n, &buried, error));
    if (buried == NULL) goto done;
    TRY(store_read(s, STORE_MESH "/area", STORE_F64, 1, (size_t[]){n}, &area, error));
    counts = memory_allocate(n_groups, sizeof *counts, "group sizes", error);
    sums = memory_allocate(n_groups, sizeof *sums, "group sizes", error);
    if (counts == NULL || sums == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) {
        if (!buried[i]) continue;
        counts[group[i]]++;
        sums[group[i]] += ((const double *)area)[i];
    }
    for (size_t g = 0; g < n_groups; g++)
        if (counts[g] > 0)
            json_object_set_new(
                json_array_get(groups, g), "buried",
                json_pack("{s:I, s:o}", "elements", (json_int_t)counts[g], "area", describe_number(sums[g])));
done:
    free(buried);
    free(area);
    free(counts);
    free(sums);
    return status;
}

static lam_status add_groups(store *s, size_t n, json_t *out, lam_error *error) {
    lam_status status = LAM_OK;
    void *data = NULL;
    char **names = NULL;
    size_t *counts = NULL, n_groups = 0;
    json_t *groups = NULL;
    TRY(store_read(s, STORE_MESH "/group", STORE_U32, 1, (size_t[]){n}, &data, error));
    TRY(store_read_texts(s, STORE_MESH "/group_names", &n_groups, &names, error));
    counts = memory_allocate(n_groups, sizeof *counts, "group sizes", error);
    if (counts == NULL) TRY(LAM_ERR_MEMORY);
    const uint32_t *group = data;
    for (size_t i = 0; i < n; i++) {
        if (group[i] >= n_groups)
            FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/group[%zu] = %u, must be below %zu", store_path(s), i,
                 group[i], n_groups);
        counts[group[i]]++;
    }
    groups = json_array();
    for (size_t g = 0; g < n_groups; g++)
        if (json_array_append_new(
                groups, json_pack("{s:s, s:I}", "name", names[g], "elements", (json_int_t)counts[g])) != 0)
            FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/group_names[%zu] is not UTF-8", store_path(s), g);
    TRY(add_buried(s, n, group, groups, error));
    TRY(add_glass(s, groups, out, error));
    json_object_set(out, "groups", groups);
done:
    json_decref(groups);
    free(counts);
    free(names);
    free(data);
    return status;
}

/* A store states a rank or a density; the density of a kind that stores everything is 1. */
static void add_size_figure(json_t *out, const json_t *operator_attributes, const char *kind) {
    const operator_kind *known = operator_kind_find(kind);
    if (json_object_get(operator_attributes, "rank") != NULL)
        copy_member(out, "rank", operator_attributes, "rank");
    else if (json_object_get(operator_attributes, "density") != NULL)
        copy_member(out, "density", operator_attributes, "density");
    else if (known != NULL && known->whole)
        json_object_set_new(out, "density", json_integer(1));
}

/* The figures that the method reported: attributes of /operator beside those with a member of their own. */
static void add_report(json_t *out, json_t *operator_attributes) {
    static const char *const shown[] = {"kind",    "form",      "layout", "method", "reason",
                                        "epsilon", "precision", "rank",   "density"};
    json_t *report = json_object(), *value;
    const char *name;
    json_object_foreach(operator_attributes, name, value) {
        size_t k = 0;
        while (k < sizeof shown / sizeof *shown && strcmp(shown[k], name) != 0) k++;
        if (k == sizeof shown / sizeof *shown) json_object_set(report, name, value);
    }
    json_object_set_new(out, "report", report);
}

/* Groups whose errors are described: a city has thousands. */
enum { GROUPS_DESCRIBED = 32 };

/* The group with the largest figure that is not taken yet; n: none. */
static size_t worst_group(const double *figure, const bool *taken, size_t n) {
    size_t worst = n;
    for (size_t g = 0; g < n; g++)
        if (!taken[g] && isfinite(figure[g]) && (worst == n || figure[g] > figure[worst])) worst = g;
    return worst;
}

/* The errors of the means of groups, those with the largest one by uniform light first. */
static lam_status add_error_by_group(store *s, json_t *figures, const json_t *groups, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = json_array_size(groups);
    group_errors of = {.n_groups = 0};
    bool *taken = NULL;
    json_t *list = NULL;
    TRY(group_errors_load_shown(s, n, &of, error));
    if (of.n_rows == 0) goto done;
    taken = memory_allocate(n, sizeof *taken, "errors of groups", error);
    if (taken == NULL) TRY(LAM_ERR_MEMORY);
    list = json_array();
    for (size_t count = 0; count < GROUPS_DESCRIBED; count++) {
        const size_t g = worst_group(of.of[GROUP_UNIFORM], taken, n);
        if (g == n) break;
        taken[g] = true;
        json_t *one = json_object();
        copy_member(one, "name", json_array_get(groups, g), "name");
        for (int k = GROUP_UNIFORM; k < GROUP_FIGURES; k++)
            json_object_set_new(one, group_figure_name(k), describe_number(of.of[k][g]));
        json_array_append_new(list, one);
    }
    json_object_set(figures, "by_group", list);
done:
    group_errors_free(&of);
    free(taken);
    json_decref(list);
    return status;
}

/* An error that is no number becomes null. */
static json_t *list_numbers(size_t count, const double *numbers) {
    json_t *list = json_array();
    for (size_t i = 0; i < count; i++)
        json_array_append_new(list, isfinite(numbers[i]) ? json_real(numbers[i]) : json_null());
    return list;
}

/* The errors of every emitter, where they are stated. */
static lam_status add_emitter_errors(store *s, json_t *figures, lam_error *error) {
    emitter_figures of = {.s = 0};
    const lam_status status = emitter_figures_load_shown(s, &of, error);
    if (of.relative != NULL)
        json_object_set_new(figures, "emitters",
                            json_pack("{s:o, s:o}", "relative", list_numbers(of.s, of.relative), "indirect",
                                      list_numbers(of.s, of.indirect)));
    emitter_figures_free(&of);
    return status;
}

/* The error of the store in one number, with its parts: members as in answers (headline.h). */
static void add_headline(store *s, json_t *figures) {
    error_report report;
    mesh_figures mesh;
    own_figures own;
    headline_part parts[HEADLINE_PARTS];
    const char *light;
    size_t largest;
    error_report_load(s, &report);
    mesh_figures_load_shown(s, &mesh);
    own_figures_load(s, &own);
    const headline head = stated_headline(&report, &mesh, &own, &light);
    if (!head.known) return;
    json_object_set_new(figures, "stated", describe_number(headline_stated(&head)));
    json_object_set_new(figures, "light", json_string(light));
    const size_t n = headline_parts(&head, parts, &largest);
    if (headline_is_coarse(&head)) {
        json_object_set_new(figures, "coarse", json_true());
        json_object_set_new(figures, "advice", json_sprintf("precompute with %s", parts[largest].option));
    }
    json_t *list = json_object();
    for (size_t k = 0; k < n; k++) json_object_set_new(list, parts[k].name, describe_number(parts[k].error));
    json_object_set_new(figures, "parts", list);
}

static lam_status add_error(store *s, json_t *out, lam_error *error) {
    lam_status status = LAM_OK;
    json_t *figures = NULL;
    if (!store_has(s, STORE_ERROR)) {
        json_object_set_new(out, "error", json_object());
        return LAM_OK;
    }
    TRY(attributes_of(s, STORE_ERROR, &figures, error));
    add_headline(s, figures);
    for (const figures_group *g = figures_groups; g->name != NULL; g++) {
        json_t *group = NULL;
        if (!store_has(s, g->path)) continue;
        TRY(attributes_of(s, g->path, &group, error));
        json_object_set_new(figures, g->name, group);
    }
    TRY(add_emitter_errors(s, figures, error));
    TRY(add_error_by_group(s, figures, json_object_get(out, "groups"), error));
    json_object_set(out, "error", figures);
done:
    json_decref(figures);
    return status;
}

static lam_status add_provenance(store *s, const json_t *root, json_t *out, lam_error *error) {
    static const char *const members[] = {"tool", "command", "created", "seed", "unit"};
    lam_status status = LAM_OK;
    json_t *mesh = NULL, *form_factors = NULL, *provenance = json_object();
    for (size_t i = 0; i < sizeof members / sizeof members[0]; i++)
        copy_member(provenance, members[i], root, members[i]);
    TRY(attributes_of(s, STORE_MESH, &mesh, error));
    copy_member(provenance, "geometry_hash", mesh, "geometry_hash");
    if (store_has(s, STORE_FORM_FACTORS)) {
        TRY(attributes_of(s, STORE_FORM_FACTORS, &form_factors, error));
        json_object_set(provenance, "form_factors", form_factors);
    }
    json_object_set(out, "provenance", provenance);
done:
    json_decref(form_factors);
    json_decref(mesh);
    json_decref(provenance);
    return status;
}

/* The names of the emitters; null where the operator has none. */
static lam_status add_emitters(store *s, json_t *out, lam_error *error) {
    char **names = NULL;
    size_t count = 0;
    json_t *list = NULL;
    lam_status status = LAM_OK;
    if (store_has(s, STORE_OPERATOR "/names")) {
        TRY(store_read_texts(s, STORE_OPERATOR "/names", &count, &names, error));
        list = json_array();
        for (size_t k = 0; k < count; k++)
            if (json_array_append_new(list, json_string(names[k])) != 0)
                FAIL(error, LAM_ERR_FORMAT, "%s: /operator/names[%zu] is not UTF-8", store_path(s), k);
    }
    json_object_set(out, "emitters", list != NULL ? list : json_null());
done:
    json_decref(list);
    free(names);
    return status;
}

/* The cameras that came with the scene, in its axes and metres; the array may be empty. */
static lam_status add_cameras(store *s, json_t *out, lam_error *error) {
    static const char *const members[] = {"eye", "direction", "up"};
    lam_status status = LAM_OK;
    scene_camera *cameras = NULL;
    size_t n = 0;
    TRY(scene_cameras_load(s, &n, &cameras, error));
    json_t *list = json_array();
    for (size_t k = 0; k < n; k++) {
        const double *const vectors[] = {cameras[k].eye, cameras[k].direction, cameras[k].up};
        json_t *one = json_object();
        json_object_set_new(one, "name", json_string(cameras[k].name));
        for (size_t v = 0; v < 3; v++)
            json_object_set_new(one, members[v],
                                json_pack("[f, f, f]", vectors[v][0], vectors[v][1], vectors[v][2]));
        json_object_set_new(one, "fov", json_real(cameras[k].fov));
        json_array_append_new(list, one);
    }
    json_object_set_new(out, "cameras", list);
done:
    free(cameras);
    return status;
}

/* null where there is none. */
static lam_status add_sky(store *s, json_t *out, lam_error *error) {
    lam_status status = LAM_OK;
    json_t *attributes = NULL, *sky = NULL;
    size_t dims[STORE_MAX_RANK];
    store_type type;
    int rank;
    if (!store_has(s, STORE_SKY)) {
        json_object_set_new(out, "sky", json_null());
        return LAM_OK;
    }
    TRY(attributes_of(s, STORE_SKY, &attributes, error));
    TRY(store_array_info(s, STORE_SKY "/first_bounce", &type, &rank, dims, error));
    if (rank != 2)
        FAIL(error, LAM_ERR_FORMAT, "%s: /sky/first_bounce has %d dimensions, must have 2", store_path(s),
             rank);
    sky = json_object();
    copy_member(sky, "tiling", attributes, "tiling");
    json_object_set_new(sky, "tiles", json_integer((json_int_t)dims[0]));
    copy_member(sky, "ground_albedo", attributes, "ground_albedo");
    if (json_object_get(attributes, "north") != NULL) copy_member(sky, "north", attributes, "north");
    json_object_set(out, "sky", sky);
done:
    json_decref(attributes);
    json_decref(sky);
    return status;
}

/* The length of an array of one dimension. */
static lam_status length_of(store *s, const char *name, size_t *length, lam_error *error) {
    lam_status status = LAM_OK;
    size_t dims[STORE_MAX_RANK];
    store_type type;
    int rank;
    TRY(store_array_info(s, name, &type, &rank, dims, error));
    if (rank != 1)
        FAIL(error, LAM_ERR_FORMAT, "%s: %s has %d dimensions, must have 1", store_path(s), name, rank);
    *length = dims[0];
done:
    return status;
}

/* Their number, and their lumens at dimmers of 1; null where there are none. */
static lam_status add_luminaires(store *s, json_t *out, lam_error *error) {
    lam_status status = LAM_OK;
    void *lumens = NULL;
    size_t n = 0;
    double sum = 0;
    const char *const name = STORE_LUMINAIRES "/lumens";
    if (!store_has(s, STORE_LUMINAIRES)) {
        json_object_set_new(out, "luminaires", json_null());
        return LAM_OK;
    }
    TRY(length_of(s, name, &n, error));
    TRY(store_read(s, name, STORE_F64, 1, &n, &lumens, error));
    for (size_t k = 0; k < n; k++) sum += ((const double *)lumens)[k];
    json_object_set_new(out, "luminaires", json_pack("{s:I, s:f}", "count", (json_int_t)n, "lumens", sum));
done:
    free(lumens);
    return status;
}

/* Sets of sensors and receivers in them; null where there are none. */
static lam_status add_sensors(store *s, json_t *out, lam_error *error) {
    lam_status status = LAM_OK;
    size_t sets = 0, receivers = 0;
    if (!store_has(s, STORE_SENSORS)) {
        json_object_set_new(out, "sensors", json_null());
        return LAM_OK;
    }
    TRY(length_of(s, STORE_SENSORS "/kind", &sets, error));
    TRY(length_of(s, STORE_SENSORS "/receiver", &receivers, error));
    json_object_set_new(
        out, "sensors",
        json_pack("{s:I, s:I}", "sets", (json_int_t)sets, "receivers", (json_int_t)receivers));
done:
    return status;
}

/* The elements that the operator was built for, and the option that named them; null where it was built for
 * all. */
static lam_status add_elements(store *s, const char *group, const char *member, json_t *out,
                               lam_error *error) {
    lam_status status = LAM_OK;
    json_t *attributes = NULL;
    size_t dims[STORE_MAX_RANK];
    store_type type;
    int rank;
    char path[64];
    if (!store_has(s, group)) {
        json_object_set_new(out, member, json_null());
        return LAM_OK;
    }
    snprintf(path, sizeof path, "%s/elements", group);
    TRY(attributes_of(s, group, &attributes, error));
    TRY(store_array_info(s, path, &type, &rank, dims, error));
    if (rank != 1)
        FAIL(error, LAM_ERR_FORMAT, "%s: %s has %d dimensions, must have 1", store_path(s), path, rank);
    json_object_set_new(attributes, "elements", json_integer((json_int_t)dims[0]));
    json_object_set(out, member, attributes);
done:
    json_decref(attributes);
    return status;
}

/* The faces of the scene file; null where the store does not know them. */
static lam_status add_faces(store *s, json_t *out, lam_error *error) {
    size_t n = 0;
    const lam_status status = scene_faces_count(s, &n, error);
    if (status == LAM_OK)
        json_object_set_new(out, "faces", n > 0 ? json_integer((json_int_t)n) : json_null());
    return status;
}

lam_status describe_store(store *s, json_t **out, lam_error *error) {
    lam_status status = LAM_OK;
    json_t *root = NULL, *operator_attributes = NULL, *mesh = NULL, *made = json_object();
    size_t dims[STORE_MAX_RANK];
    store_type type;
    int rank;
    uint64_t bytes = 0;
    TRY(attributes_of(s, "/", &root, error));
    TRY(attributes_of(s, STORE_OPERATOR, &operator_attributes, error));
    TRY(attributes_of(s, STORE_MESH, &mesh, error));
    TRY(store_array_info(s, STORE_MESH "/reflectance", &type, &rank, dims, error));
    if (rank != 2)
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/reflectance has %d dimensions, must have 2", store_path(s),
             rank);
    TRY(store_group_bytes(s, STORE_OPERATOR, &bytes, error));
    copy_member(made, "name", root, "name");
    json_object_set_new(made, "elements", json_integer((json_int_t)dims[1]));
    TRY(add_faces(s, made, error));
    json_object_set_new(made, "channels", json_integer((json_int_t)dims[0]));
    /* Older stores do not say it, and count in W. */
    const json_t *lights = json_object_get(mesh, "lights");
    json_object_set_new(made, "lights", lights != NULL ? json_deep_copy(lights) : json_string("W"));
    const json_t *kind = json_object_get(operator_attributes, "kind");
    if (!json_is_string(kind))
        FAIL(error, LAM_ERR_FORMAT, "%s: /operator has no attribute \"kind\"", store_path(s));
    copy_member(made, "kind", operator_attributes, "kind");
    copy_member(made, "method", operator_attributes, "method");
    copy_member(made, "reason", operator_attributes, "reason");
    copy_member(made, "epsilon", operator_attributes, "epsilon");
    add_size_figure(made, operator_attributes, json_string_value(kind));
    /* Only kinds that have a choice say it. */
    const json_t *precision = json_object_get(operator_attributes, "precision");
    json_object_set_new(made, "precision",
                        precision != NULL ? json_deep_copy(precision) : json_string("f32"));
    json_object_set_new(made, "bytes", json_integer((json_int_t)bytes));
    add_report(made, operator_attributes);
    if (json_object_get(mesh, "overlap_area") != NULL)
        copy_member(made, "overlap_area", mesh, "overlap_area");
    TRY(add_groups(s, dims[1], made, error));
    TRY(add_emitters(s, made, error));
    TRY(add_cameras(s, made, error));
    TRY(add_sky(s, made, error));
    TRY(add_luminaires(s, made, error));
    TRY(add_sensors(s, made, error));
    TRY(add_elements(s, STORE_IMPORTANCE, "importance", made, error));
    TRY(add_elements(s, STORE_SOURCES, "sources", made, error));
    TRY(add_error(s, made, error));
    TRY(add_provenance(s, root, made, error));
    *out = json_incref(made);
done:
    json_decref(made);
    json_decref(root);
    json_decref(mesh);
    json_decref(operator_attributes);
    return status;
}
