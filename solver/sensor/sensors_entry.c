/* One set of sensors of a list in JSON: every member is checked, and it becomes its receivers. */
#include "solver/base/vector3.h"
#include "solver/sensor/sensors_parts.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The kinds: the receivers that they are made of, the member that turns these, and the area that they may
 * lie over. A preset direction is up, or, over an area, its normal. */
typedef struct kind_row {
    receiver_kind receiver;
    const char *direction; /* NULL: none */
    bool needs_direction, at_points, over_areas;
} kind_row;

static const kind_row kinds[SENSOR_SET_KINDS] = {
    [SENSOR_POINTS] = {RECEIVER_PLANE, "normal", false, true, false},
    [SENSOR_GRIDS] = {RECEIVER_PLANE, "normal", false, false, true},
    [SENSOR_EYES] = {RECEIVER_PLANE, "view", true, true, false},
    [SENSOR_CYLINDERS] = {RECEIVER_CYLINDER, "axis", false, true, true},
    [SENSOR_SEMICYLINDERS] = {RECEIVER_SEMICYLINDER, "axis", false, true, true},
    [SENSOR_SPHERES] = {RECEIVER_SPHERE, NULL, false, true, true},
    [SENSOR_CUBES] = {RECEIVER_PLANE, NULL, false, true, true}};

/* A set while it is read. */
typedef struct entry {
    sensors_reading *r;
    json_t *value;
    const kind_row *kind;
    char place[SENSORS_PLACE];
    sensor_set set;
    receiver made;  /* but its place and, where it has none, its direction */
    bool is_turned; /* it has one */
} entry;

static lam_status read_point(const entry *e, const char *what, const json_t *value, double out[3],
                             lam_error *error) {
    const lam_status status = list_vector(e->place, what, value, out, error);
    for (int d = 0; d < 3 && status == LAM_OK; d++) out[d] *= e->r->unit;
    return status;
}

/* The way that a semi-cylinder looks, across its axis. */
static lam_status turn_look(const entry *e, receiver *one, lam_error *error) {
    const json_t *value = json_object_get(e->value, "look");
    lam_status status = list_direction(e->place, "look", value, one->look, error);
    if (status != LAM_OK) return status;
    const double along = dot3(one->look, one->axis);
    for (int d = 0; d < 3; d++) one->look[d] -= along * one->axis[d];
    if (!(dot3(one->look, one->look) > 1e-12))
        return list_wrong(e->place, "look", value, "must not lie along the axis", error);
    (void)list_normalize(one->look);
    return LAM_OK;
}

/* A receiver of the set; preset: its direction where none is stated, number: its place among those of `at`.
 */
static lam_status set_receiver(const entry *e, const double at[3], const double preset[3], size_t number,
                               receiver *out, lam_error *error) {
    lam_status status = LAM_OK;
    const char *word = e->kind->direction;
    const json_t *value = word != NULL ? json_object_get(e->value, word) : NULL;
    *out = (receiver){.kind = e->kind->receiver, .at = {at[0], at[1], at[2]}};
    if (out->kind == RECEIVER_SPHERE) return LAM_OK;
    memcpy(out->axis, preset, sizeof out->axis);
    if (json_is_array(json_array_get(value, 0))) value = json_array_get(value, number);
    if (value != NULL) TRY(list_direction(e->place, word, value, out->axis, error));
    if (out->kind == RECEIVER_SEMICYLINDER) TRY(turn_look(e, out, error));
done:
    return status;
}

/* A set at points: one [x, y, z], or an array of them. */
static lam_status read_points(entry *e, const json_t *at, lam_error *error) {
    lam_status status = LAM_OK;
    const char *word = e->kind->direction;
    const json_t *direction = word != NULL ? json_object_get(e->value, word) : NULL;
    const bool many = json_is_array(json_array_get(at, 0));
    const size_t n = many ? json_array_size(at) : 1;
    double up[3];
    sensors_up(e->r->up, up);
    if (json_is_array(json_array_get(direction, 0)) && json_array_size(direction) != n) {
        char limit[96];
        snprintf(limit, sizeof limit, "must be one direction, or %zu, as many as points", n);
        TRY(list_wrong(e->place, word, direction, limit, error));
    }
    TRY(sensors_begin(e->r, &e->set, e->place, error));
    for (size_t k = 0; k < n; k++) {
        receiver one;
        double point[3];
        TRY(read_point(e, many ? "a point of at" : "at", many ? json_array_get(at, k) : at, point, error));
        TRY(set_receiver(e, point, up, k, &one, error));
        TRY(sensors_add(e->r, &one, SENSOR_NO_CELL, e->place, error));
    }
done:
    return status;
}

static lam_status read_polygon(const entry *e, const json_t *value, double (**out)[3], size_t *n_corners,
                               lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = json_array_size(value);
    double(*corner)[3] = NULL;
    char limit[64];
    snprintf(limit, sizeof limit, "must be an array of 3 to %d corners [x, y, z]", SENSOR_CORNERS_MOST);
    if (n < 3 || n > SENSOR_CORNERS_MOST) TRY(list_wrong(e->place, "polygon", value, limit, error));
    corner = memory_allocate(n, sizeof *corner, e->r->name, error);
    if (corner == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n; k++)
        TRY(read_point(e, "a corner of polygon", json_array_get(value, k), corner[k], error));
    *out = corner;
    *n_corners = n;
    corner = NULL;
done:
    free(corner);
    return status;
}

/* Height, border and spacing. */
static lam_status read_sizes(const entry *e, sensors_area *area, lam_error *error) {
    lam_status status = LAM_OK;
    const json_t *height = json_object_get(e->value, "height"), *border = json_object_get(e->value, "border"),
                 *spacing = json_object_get(e->value, "spacing");
    const bool by_standard = json_is_string(spacing) && strcmp(json_string_value(spacing), "en12464") == 0;
    if (height != NULL)
        TRY(list_number(e->place, "height", height, -LIST_LENGTH_MOST, LIST_LENGTH_MOST, false, &area->height,
                        error));
    if (border != NULL)
        TRY(list_number(e->place, "border", border, 0, LIST_LENGTH_MOST, false, &area->border, error));
    if (json_is_string(spacing) && !by_standard)
        TRY(list_wrong(e->place, "spacing", spacing, "must be a length above 0 or \"en12464\"", error));
    if (spacing != NULL && !by_standard)
        TRY(list_number(e->place, "spacing", spacing, 0, LIST_LENGTH_MOST, true, &area->spacing, error));
    area->height *= e->r->unit;
    area->border *= e->r->unit;
    area->spacing *= e->r->unit;
done:
    return status;
}

/* A set over a group or a polygon. */
static lam_status read_area(entry *e, const json_t *over, const json_t *corners, lam_error *error) {
    lam_status status = LAM_OK;
    sensors_area area = {.place = e->place, .group = json_string_value(over)};
    sensors_cells cells = {.n = 0};
    double(*corner)[3] = NULL;
    if (over != NULL && area.group == NULL)
        TRY(list_wrong(e->place, "over", over, "must be the name of a group of the scene", error));
    if (corners != NULL) TRY(read_polygon(e, corners, &corner, &area.n_corners, error));
    area.corner = (const double(*)[3])corner;
    TRY(read_sizes(e, &area, error));
    TRY(sensors_cells_find(e->r, &area, &cells, error));
    e->set.rows = cells.rows;
    e->set.columns = cells.columns;
    memcpy(e->set.spacing, cells.spacing, sizeof cells.spacing);
    TRY(sensors_begin(e->r, &e->set, e->place, error));
    for (size_t k = 0; k < cells.n; k++) {
        receiver one;
        TRY(set_receiver(e, cells.at[k], cells.normal, 0, &one, error));
        TRY(sensors_add(e->r, &one, cells.cell[k], e->place, error));
    }
done:
    free(corner);
    free(cells.at);
    free(cells.cell);
    return status;
}

static lam_status read_place(entry *e, lam_error *error) {
    lam_status status = LAM_OK;
    const kind_row *kind = e->kind;
    const json_t *at = json_object_get(e->value, "at"), *over = json_object_get(e->value, "over"),
                 *corners = json_object_get(e->value, "polygon");
    if ((at != NULL) + (over != NULL) + (corners != NULL) != 1)
        FAIL(error, LAM_ERR_ARGUMENT, "%s must have %s%s%s", e->place,
             kind->at_points ? "at, its points" : "",
             kind->at_points && kind->over_areas ? ", or one of " : "",
             kind->over_areas ? "over, a group, or polygon, corners, and not several of these" : "");
    if (at != NULL) {
        static const char *const sizes[] = {"height", "border", "spacing"};
        for (size_t k = 0; k < 3; k++)
            if (json_object_get(e->value, sizes[k]) != NULL)
                FAIL(error, LAM_ERR_ARGUMENT, "%s has at; %s is for one over a group or polygon", e->place,
                     sizes[k]);
        TRY(read_points(e, at, error));
    } else {
        const json_t *direction = kind->direction != NULL ? json_object_get(e->value, kind->direction) : NULL;
        if (json_is_array(json_array_get(direction, 0)))
            TRY(list_wrong(e->place, kind->direction, direction, "must be one direction", error));
        TRY(read_area(e, over, corners, error));
    }
done:
    return status;
}

lam_status sensors_set_name(const json_t *value, const char *place, sensor_set *set, lam_error *error) {
    lam_status status = LAM_OK;
    const char *limit;
    const json_t *name = json_object_get(value, "name");
    if (name == NULL) FAIL(error, LAM_ERR_ARGUMENT, "%s has no name: it must have one", place);
    if (!json_is_string(name)) TRY(list_wrong(place, "name", name, "must be a text", error));
    if (!sensors_is_name(json_string_value(name), json_string_length(name), &limit))
        TRY(list_wrong(place, "name", name, limit, error));
    memcpy(set->name, json_string_value(name), json_string_length(name) + 1);
done:
    return status;
}

static lam_status read_set(entry *e, lam_error *error) {
    lam_status status = LAM_OK;
    const char *members[9];
    size_t n = 0;
    members[n++] = "name";
    if (e->kind->at_points) members[n++] = "at";
    if (e->kind->over_areas) {
        static const char *const own[] = {"over", "polygon", "height", "border", "spacing"};
        for (size_t k = 0; k < sizeof own / sizeof *own; k++) members[n++] = own[k];
    }
    if (e->kind->direction != NULL) members[n++] = e->kind->direction;
    if (e->kind->receiver == RECEIVER_SEMICYLINDER) members[n++] = "look";
    TRY(list_members(e->value, n, members, e->place, error));
    TRY(sensors_set_name(e->value, e->place, &e->set, error));
    if (e->kind->needs_direction && json_object_get(e->value, e->kind->direction) == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "%s has no %s: it must have one", e->place, e->kind->direction);
    TRY(read_place(e, error));
done:
    return status;
}

lam_status sensors_array(sensors_reading *r, sensor_set_kind kind, const json_t *array, lam_error *error) {
    lam_status status = LAM_OK;
    char shown[LIST_SHOWN];
    if (array == NULL) return LAM_OK;
    if (!json_is_array(array)) {
        list_shown(array, shown);
        FAIL(error, LAM_ERR_ARGUMENT, "%.200s: %s = %s, must be an array", r->name, sensor_set_word(kind),
             shown);
    }
    for (size_t k = 0; k < json_array_size(array); k++) {
        entry e = {.r = r,
                   .value = json_array_get(array, k),
                   .kind = &kinds[kind],
                   .set = {.kind = kind, .entry = k}};
        snprintf(e.place, sizeof e.place, "%.200s: %s[%zu]", r->name, sensor_set_word(kind), k);
        TRY(kind == SENSOR_PROBES ? sensors_probe_set(r, e.value, e.place, &e.set, error)
                                  : read_set(&e, error));
    }
done:
    return status;
}
