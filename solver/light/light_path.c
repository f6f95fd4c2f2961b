/* The JSON of a moving light is read, and every member is checked. Frames stand at equal lengths of the cubic
 * of Catmull and Rom with points a, b, e, f, b + t/2 (e - a + t (2 a - 5 b + 4 e - f + t (3 (b - e) + f -
 * a))) from b to e; quaternions between two points follow slerp (Shoemake 1985). */
#include "solver/light/light_path.h"

#include "solver/base/file_text.h"
#include "solver/base/options/options.h"
#include "solver/base/vector3.h"
#include "solver/codec/json_mark.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NAME_BYTES = 64, CORNERS_MOST = 4096 };

/* A position as a file has it: move in metres, turn a unit quaternion (x, y, z, w). */
typedef struct waypoint {
    double move[3], turn[4];
} waypoint;

/* The place in the file that is read: "FILE: positions[3]". */
typedef struct place {
    char text[320];
} place;

static place member(const char *file, const char *name, size_t k) {
    place at;
    if (k == SIZE_MAX)
        snprintf(at.text, sizeof at.text, "%.200s: %s", file, name);
    else
        snprintf(at.text, sizeof at.text, "%.200s: %s[%zu]", file, name, k);
    return at;
}

/* Fails for members that nobody reads: they are mistakes of spelling. */
static lam_status check_members(json_t *object, const char *const names[], const place *at,
                                lam_error *error) {
    lam_status status = LAM_OK;
    const char *key;
    json_t *value;
    if (!json_is_object(object)) FAIL(error, LAM_ERR_ARGUMENT, "%s must be an object {...}", at->text);
    json_object_foreach(object, key, value) {
        bool known = false;
        for (size_t k = 0; names[k] != NULL; k++) known = known || strcmp(names[k], key) == 0;
        if (!known)
            FAIL(error, LAM_ERR_ARGUMENT, "%s has a member \"%.60s\", which is none of %s, %s%s%s", at->text,
                 key, names[0], names[1], names[2] != NULL ? ", " : "", names[2] != NULL ? names[2] : "");
    }
done:
    return status;
}

static lam_status read_number(const json_t *value, const char *what, const place *at, double *out,
                              lam_error *error) {
    lam_status status = LAM_OK;
    if (!json_is_number(value)) FAIL(error, LAM_ERR_ARGUMENT, "%s: %s must be a number", at->text, what);
    *out = json_number_value(value);
    if (!(fabs(*out) <= 1e30))
        FAIL(error, LAM_ERR_ARGUMENT, "%s: %s = %g, must be finite, 1e30 at most", at->text, what, *out);
done:
    return status;
}

static lam_status read_three(const json_t *value, const char *what, const place *at, double out[3],
                             lam_error *error) {
    lam_status status = LAM_OK;
    if (!json_is_array(value) || json_array_size(value) != 3)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: %s must be an array of three numbers", at->text, what);
    for (size_t d = 0; d < 3; d++) TRY(read_number(json_array_get(value, d), what, at, &out[d], error));
done:
    return status;
}

/* "800lm" or "300,200,100 lm": the exitance of the polygon. */
static lam_status read_light_text(const json_t *value, const place *at, const moving_light *l, light_kind to,
                                  bool *converted, double E[3], lam_error *error) {
    lam_status status = LAM_OK;
    const char *text = json_string_value(value);
    char numbers[128], what[sizeof at->text + 16];
    given_unit unit;
    size_t found = 0;
    const size_t length = given_unit_split(text, json_string_length(value), &unit);
    if (unit == GIVEN_PLAIN || length >= sizeof numbers || memchr(text, 0, length) != NULL)
        FAIL(error, LAM_ERR_ARGUMENT,
             "%s: emission = \"%.60s\", must be a number, three of them, or a text of numbers and a "
             "unit: " GIVEN_UNIT_WORDS,
             at->text, text);
    memcpy(numbers, text, length);
    numbers[length] = '\0';
    snprintf(what, sizeof what, "%s: emission", at->text);
    TRY(option_numbers(what, numbers, 3, false, E, &found, error));
    if (found == 2) FAIL(error, LAM_ERR_ARGUMENT, "%s has 2 numbers, must have 1 or 3", what);
    for (size_t d = found; d < 3; d++) E[d] = E[0];
    for (size_t d = 0; d < 3; d++) E[d] *= given_unit_exitance(unit, l->area, to);
    *converted = given_unit_kind(unit, to) != to;
done:
    return status;
}

static lam_status read_emission(const json_t *value, const place *at, light_kind to, moving_light *l,
                                bool *coloured, bool *converted, lam_error *error) {
    lam_status status = LAM_OK;
    double E[3] = {0, 0, 0};
    if (json_is_string(value)) {
        TRY(read_light_text(value, at, l, to, converted, E, error));
    } else if (json_is_array(value)) {
        TRY(read_three(value, "emission", at, E, error));
    } else {
        TRY(read_number(value, "emission", at, &E[0], error));
        E[1] = E[2] = E[0];
    }
    for (int d = 0; d < 3; d++)
        if (E[d] < 0) FAIL(error, LAM_ERR_ARGUMENT, "%s: emission %g is negative", at->text, E[d]);
    if (!(E[0] + E[1] + E[2] > 0)) FAIL(error, LAM_ERR_ARGUMENT, "%s: emission is 0: it is dark", at->text);
    *coloured = E[0] != E[1] || E[1] != E[2];
    memcpy(l->emission, E, sizeof E);
done:
    return status;
}

static lam_status read_light(const light_path_request *request, json_t *light, moving_light *l,
                             bool *coloured, bool *converted, lam_error *error) {
    static const char *const names[] = {"polygon", "emission", NULL};
    lam_status status = LAM_OK;
    const place at = member(request->path, "light", SIZE_MAX);
    lam_error why = {.message = ""};
    double(*corner)[3] = NULL;
    TRY(check_members(light, names, &at, error));
    const json_t *polygon = json_object_get(light, "polygon");
    const size_t n = json_array_size(polygon);
    if (n < 3 || n > CORNERS_MOST)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: polygon must be an array of 3 to %d corners [x, y, z]", at.text,
             CORNERS_MOST);
    corner = memory_allocate(n, sizeof *corner, "light", error);
    if (corner == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n; k++) {
        TRY(read_three(json_array_get(polygon, k), "a corner of polygon", &at, corner[k], error));
        for (int d = 0; d < 3; d++) corner[k][d] *= request->unit;
    }
    status = moving_light_create(n, corner, l, &why);
    corner = NULL;
    if (status != LAM_OK) FAIL(error, status, "%.200s: %s", request->path, why.message);
    TRY(read_emission(json_object_get(light, "emission"), &at, request->lights, l, coloured, converted,
                      error));
done:
    free(corner);
    return status;
}

/* {"axis": [x, y, z], "degrees": d}, as a quaternion. */
static lam_status read_turn(json_t *turn, const place *at, double q[4], lam_error *error) {
    static const char *const names[] = {"axis", "degrees", NULL};
    lam_status status = LAM_OK;
    place inside;
    double axis[3], degrees = 0;
    snprintf(inside.text, sizeof inside.text, "%.300s: turn", at->text);
    TRY(check_members(turn, names, &inside, error));
    TRY(read_three(json_object_get(turn, "axis"), "axis", &inside, axis, error));
    TRY(read_number(json_object_get(turn, "degrees"), "degrees", &inside, &degrees, error));
    const double length = sqrt(dot3(axis, axis)), half = remainder(degrees, 720) * (M_PI / 360);
    if (!(length > 0)) FAIL(error, LAM_ERR_ARGUMENT, "%s: axis has no length", inside.text);
    for (int d = 0; d < 3; d++) q[d] = axis[d] / length * sin(half);
    q[3] = cos(half);
done:
    return status;
}

static lam_status read_waypoint(json_t *value, const place *at, double unit, waypoint *out,
                                lam_error *error) {
    static const char *const names[] = {"move", "turn", "name", NULL};
    lam_status status = LAM_OK;
    waypoint w = {.turn = {0, 0, 0, 1}};
    TRY(check_members(value, names, at, error));
    json_t *move = json_object_get(value, "move"), *turn = json_object_get(value, "turn");
    if (move != NULL) TRY(read_three(move, "move", at, w.move, error));
    if (turn != NULL) TRY(read_turn(turn, at, w.turn, error));
    for (int d = 0; d < 3; d++) w.move[d] *= unit;
    *out = w;
done:
    return status;
}

/* The matrix of a unit quaternion. */
static void turn_matrix(const double q[4], double out[3][3]) {
    for (int a = 0; a < 3; a++) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        out[a][a] = 1 - 2 * (q[b] * q[b] + q[c] * q[c]);
        out[a][b] = 2 * (q[a] * q[b] - q[c] * q[3]);
        out[a][c] = 2 * (q[a] * q[c] + q[b] * q[3]);
    }
}

static lam_status set_pose(const waypoint *w, const char *name, size_t k, light_pose *p, lam_error *error) {
    turn_matrix(w->turn, p->turn);
    memcpy(p->move, w->move, sizeof p->move);
    p->name = memory_allocate(NAME_BYTES, 1, "names of positions", error);
    if (p->name == NULL) return LAM_ERR_MEMORY;
    if (name != NULL)
        snprintf(p->name, NAME_BYTES, "%s", name);
    else
        snprintf(p->name, NAME_BYTES, "pose-%zu", k);
    return LAM_OK;
}

/* *name: NULL where the file gives none. */
static lam_status read_name(const json_t *position, const place *at, const char **name, lam_error *error) {
    lam_status status = LAM_OK;
    const json_t *value = json_object_get(position, "name");
    *name = NULL;
    if (value == NULL) return LAM_OK;
    if (!json_is_string(value)) FAIL(error, LAM_ERR_ARGUMENT, "%s: name must be a text", at->text);
    const char *text = json_string_value(value);
    const size_t length = json_string_length(value);
    if (length == 0 || length >= NAME_BYTES || strlen(text) != length)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: name must have 1 to %d bytes, none of them 0", at->text,
             NAME_BYTES - 1);
    for (const char *c = text; *c != '\0'; c++)
        if ((unsigned char)*c < ' ' || *c == 0x7f || *c == '=')
            FAIL(error, LAM_ERR_ARGUMENT, "%s: name must have no control character and no '='", at->text);
    *name = text;
done:
    return status;
}

static int by_name(const void *a, const void *b) {
    return strcmp((*(const light_pose *const *)a)->name, (*(const light_pose *const *)b)->name);
}

static lam_status check_names(const char *file, const moving_light *l, lam_error *error) {
    lam_status status = LAM_OK;
    const light_pose **sorted = memory_allocate(l->n, sizeof *sorted, "names of positions", error);
    if (sorted == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < l->n; k++) sorted[k] = &l->pose[k];
    qsort(sorted, l->n, sizeof *sorted, by_name);
    for (size_t k = 1; k < l->n; k++)
        if (strcmp(sorted[k]->name, sorted[k - 1]->name) == 0)
            FAIL(error, LAM_ERR_ARGUMENT, "%.200s: positions[%td] and positions[%td] have the same name %s",
                 file, sorted[k - 1] - l->pose, sorted[k] - l->pose, sorted[k]->name);
done:
    free(sorted);
    return status;
}

static lam_status read_positions(const char *file, const json_t *list, double unit, moving_light *l,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = json_array_size(list);
    if (n < 1 || n > LIGHT_POSITIONS_MOST)
        FAIL(error, LAM_ERR_ARGUMENT,
             "%.200s: positions must be an array of 1 to %d positions; a file with a path is for --path",
             file, LIGHT_POSITIONS_MOST);
    l->pose = memory_allocate(n, sizeof *l->pose, "positions", error);
    if (l->pose == NULL) TRY(LAM_ERR_MEMORY);
    for (; l->n < n; l->n++) {
        const place at = member(file, "positions", l->n);
        json_t *position = json_array_get(list, l->n);
        waypoint w;
        const char *name;
        TRY(read_waypoint(position, &at, unit, &w, error));
        TRY(read_name(position, &at, &name, error));
        TRY(set_pose(&w, name, l->n, &l->pose[l->n], error));
    }
    TRY(check_names(file, l, error));
done:
    return status;
}

/* The curve of a path: between points k and k + 1 the cubic of Catmull and Rom. */
typedef struct curve {
    const waypoint *point;
    size_t n, segments;
    bool closed;
} curve;

static const waypoint *point_of(const curve *c, ptrdiff_t k) {
    const ptrdiff_t n = (ptrdiff_t)c->n;
    if (c->closed) return &c->point[(k + n) % n];
    return &c->point[k < 0 ? 0 : k >= n ? n - 1 : k];
}

/* The place at part t of segment k. An end of an open curve is followed by a point as far beyond. */
static void curve_place(const curve *c, size_t k, double t, double out[3]) {
    const ptrdiff_t at = (ptrdiff_t)k;
    const bool first = !c->closed && k == 0, last = !c->closed && k + 1 == c->segments;
    for (int d = 0; d < 3; d++) {
        const double b = point_of(c, at)->move[d], e = point_of(c, at + 1)->move[d];
        const double a = first ? 2 * b - e : point_of(c, at - 1)->move[d];
        const double f = last ? 2 * e - b : point_of(c, at + 2)->move[d];
        out[d] = b + t / 2 * (e - a + t * (2 * a - 5 * b + 4 * e - f + t * (3 * (b - e) + f - a)));
    }
}

/* The turn between two, about one axis and the shorter way (Shoemake 1985). */
static void slerp(const double a[4], const double b[4], double t, double out[4]) {
    double along = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3], length = 0;
    const double sign = along < 0 ? -1 : 1;
    const double angle = acos(fmin(along * sign, 1)), sine = sin(angle);
    const double of_a = sine > 1e-9 ? sin((1 - t) * angle) / sine : 1 - t;
    const double of_b = sign * (sine > 1e-9 ? sin(t * angle) / sine : t);
    for (int d = 0; d < 4; d++) {
        out[d] = of_a * a[d] + of_b * b[d];
        length += out[d] * out[d];
    }
    for (int d = 0; d < 4; d++) out[d] /= sqrt(length);
}

enum { CURVE_STEPS = 64 };

/* length [segments * CURVE_STEPS + 1]: of the curve up to each of its steps. */
static void measure_curve(const curve *c, double *length) {
    double before[3], now[3], step[3];
    curve_place(c, 0, 0, before);
    length[0] = 0;
    for (size_t k = 0; k < c->segments * CURVE_STEPS; k++) {
        curve_place(c, k / CURVE_STEPS, (double)(k % CURVE_STEPS + 1) / CURVE_STEPS, now);
        subtract3(now, before, step);
        length[k + 1] = length[k] + sqrt(dot3(step, step));
        memcpy(before, now, sizeof before);
    }
}

/* Frames at equal lengths of the curve; a light that only turns has frames at equal parts of its segments. */
static lam_status make_frames(const curve *c, size_t frames, moving_light *l, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t steps = c->segments * CURVE_STEPS;
    double *length = memory_allocate(steps + 1, sizeof *length, "a path", error);
    l->pose = memory_allocate(frames, sizeof *l->pose, "positions", error);
    if (length == NULL || l->pose == NULL) TRY(LAM_ERR_MEMORY);
    measure_curve(c, length);
    if (!(length[steps] > 0))
        for (size_t k = 0; k <= steps; k++) length[k] = (double)k;
    size_t step = 0;
    for (; l->n < frames; l->n++) {
        const double parts = (double)(c->closed ? frames : frames - 1);
        const double wanted = length[steps] * (double)l->n / parts;
        while (step + 1 < steps && length[step + 1] < wanted) step++;
        const double width = length[step + 1] - length[step];
        const double inside = width > 0 ? fmin((wanted - length[step]) / width, 1) : 0;
        const double t = ((double)(step % CURVE_STEPS) + inside) / CURVE_STEPS;
        const size_t segment = step / CURVE_STEPS;
        waypoint w;
        curve_place(c, segment, t, w.move);
        slerp(point_of(c, (ptrdiff_t)segment)->turn, point_of(c, (ptrdiff_t)segment + 1)->turn, t, w.turn);
        TRY(set_pose(&w, NULL, l->n, &l->pose[l->n], error));
    }
done:
    free(length);
    return status;
}

static lam_status read_path(const light_path_request *request, const json_t *root, moving_light *l,
                            lam_error *error) {
    lam_status status = LAM_OK;
    const json_t *list = json_object_get(root, "path"), *closed = json_object_get(root, "closed");
    const size_t n = json_array_size(list);
    waypoint *points = NULL;
    if (n < 2 || n > LIGHT_POSITIONS_MOST)
        FAIL(error, LAM_ERR_ARGUMENT,
             "%.200s: path must be an array of 2 to %d points; a file with positions is for --positions",
             request->path, LIGHT_POSITIONS_MOST);
    if (closed != NULL && !json_is_boolean(closed))
        FAIL(error, LAM_ERR_ARGUMENT, "%.200s: closed must be true or false", request->path);
    points = memory_allocate(n, sizeof *points, "a path", error);
    if (points == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n; k++) {
        const place at = member(request->path, "path", k);
        TRY(read_waypoint(json_array_get(list, k), &at, request->unit, &points[k], error));
    }
    const bool around = json_is_true(closed);
    const curve c = {.point = points, .n = n, .segments = around ? n : n - 1, .closed = around};
    TRY(make_frames(&c, request->frames, l, error));
done:
    free(points);
    return status;
}

lam_status light_path_read(const light_path_request *request, moving_light *out, bool *coloured,
                           bool *converted, lam_error *error) {
    static const char *const of_positions[] = {"light", "positions", NULL}, *const of_path[] = {
                                                                                "light", "path", "closed",
                                                                                NULL};
    lam_status status = LAM_OK;
    const bool listed = request->frames == 0;
    const place at = member(request->path, "the file", SIZE_MAX);
    moving_light l = {.n_corners = 0};
    json_error_t where;
    json_t *root = NULL;
    char *bytes = NULL;
    size_t length = 0;
    TRY(file_text(request->path, &bytes, &length, error));
    const char *fault = NULL;
    const size_t mark = json_mark_length(bytes, length, &fault);
    if (fault != NULL) FAIL(error, LAM_ERR_FORMAT, "%.200s: %s", request->path, fault);
    root = json_loadb(bytes + mark, length - mark, JSON_REJECT_DUPLICATES, &where);
    if (root == NULL)
        FAIL(error, LAM_ERR_FORMAT, "%.200s: line %d, column %d: %.160s", request->path, where.line,
             where.column, where.text);
    if (!listed && json_object_get(root, "positions") != NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "%.200s: it lists positions, which are for --positions, not --path",
             request->path);
    if (listed && json_object_get(root, "path") != NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "%.200s: it has a path, which is for --path and --frames",
             request->path);
    TRY(check_members(root, listed ? of_positions : of_path, &at, error));
    TRY(read_light(request, json_object_get(root, "light"), &l, coloured, converted, error));
    if (listed)
        TRY(read_positions(request->path, json_object_get(root, "positions"), request->unit, &l, error));
    else
        TRY(read_path(request, root, &l, error));
    *out = l;
    l = (moving_light){.n_corners = 0};
done:
    json_decref(root);
    free(bytes);
    moving_light_free(&l);
    return status;
}
