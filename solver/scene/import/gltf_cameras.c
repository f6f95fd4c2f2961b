/* The perspective cameras of a glTF or GLB, read from its JSON: the library keeps one node for each camera,
 * and its field of view depends on the library's version. Runs in the child. Source: glTF 2.0, 3.5.3
 * and 3.10.3. */
#include "solver/base/utf8.h"
#include "solver/scene/import/imported_faces.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct transform {
    double a[3][4];
} transform;

/* The nodes of a scene, on the way from its roots. */
typedef struct walk {
    const json_t *nodes, *cameras;
    size_t n;
    bool *seen;        /* [n]: a node has one parent, and a ring of nodes ends */
    size_t *stack;     /* [n] */
    transform *placed; /* [n], of the nodes of the stack */
    size_t n_stack;
} walk;

static const transform identity = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

static transform product(const transform *x, const transform *y) {
    transform out;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++) {
            out.a[i][j] = j == 3 ? x->a[i][3] : 0;
            for (int k = 0; k < 3; k++) out.a[i][j] += x->a[i][k] * y->a[k][j];
        }
    return out;
}

/* Reads count numbers; false where the member is absent or another thing. */
static bool read_numbers(const json_t *object, const char *name, size_t count, double *out) {
    const json_t *array = json_object_get(object, name);
    if (json_array_size(array) != count) return false;
    for (size_t k = 0; k < count; k++) {
        const json_t *number = json_array_get(array, k);
        if (!json_is_number(number)) return false;
        out[k] = json_number_value(number);
    }
    return true;
}

/* The transform of a node: its matrix, which stands column by column, or T R S. */
static transform transform_of(const json_t *node) {
    double m[16], t[3] = {0, 0, 0}, q[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1};
    transform out;
    if (read_numbers(node, "matrix", 16, m)) {
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 4; j++) out.a[i][j] = m[4 * j + i];
        return out;
    }
    (void)read_numbers(node, "translation", 3, t);
    (void)read_numbers(node, "rotation", 4, q);
    (void)read_numbers(node, "scale", 3, s);
    const double x = q[0], y = q[1], z = q[2], w = q[3];
    const double r[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                            {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                            {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++) out.a[i][j] = j == 3 ? t[i] : r[i][j] * s[j];
    return out;
}

/* The name of a node, cut where it is too long, at a whole character; camera-INDEX where it has none. */
static void name_of(const json_t *node, size_t camera, char *out, size_t size) {
    const char *name = json_string_value(json_object_get(node, "name"));
    if (name == NULL || name[0] == '\0') {
        snprintf(out, size, "camera-%zu", camera);
        return;
    }
    snprintf(out, size, "%s", name);
    for (size_t length = strlen(out); length > 0 && !utf8_is_valid(out, length);) out[--length] = '\0';
}

/* A camera looks along -z of its node, with y upwards. */
static lam_status add_camera(const walk *w, size_t index, const transform *t, const char *path,
                             imported_faces *s, lam_error *error) {
    const json_t *node = json_array_get(w->nodes, index), *which = json_object_get(node, "camera");
    const size_t camera = (size_t)json_integer_value(which);
    const json_t *found = json_is_integer(which) ? json_array_get(w->cameras, camera) : NULL;
    const json_t *perspective = json_object_get(found, "perspective");
    scene_camera made = {.name = ""};
    if (found == NULL) return LAM_OK;
    name_of(node, camera, made.name, sizeof made.name);
    if (perspective == NULL) {
        import_warn(&s->warnings, "%s: the camera '%s' is left out: it is orthographic", path, made.name);
        return LAM_OK;
    }
    made.fov = json_number_value(json_object_get(perspective, "yfov")) * 180 / M_PI;
    for (int d = 0; d < 3; d++) {
        made.eye[d] = t->a[d][3];
        made.direction[d] = -t->a[d][2];
        made.up[d] = t->a[d][1];
    }
    return imported_faces_add_camera(s, path, &made, error);
}

/* Puts the nodes of a list on the stack, the first on top. */
static void push(walk *w, const json_t *list, const transform *parent) {
    for (size_t k = json_array_size(list); k-- > 0;) {
        const json_t *which = json_array_get(list, k);
        const size_t index = (size_t)json_integer_value(which);
        if (!json_is_integer(which) || index >= w->n || w->seen[index]) continue;
        const transform own = transform_of(json_array_get(w->nodes, index));
        w->seen[index] = true;
        w->stack[w->n_stack] = index;
        w->placed[w->n_stack++] = product(parent, &own);
    }
}

static lam_status read_tree(const json_t *root, const char *path, imported_faces *s, lam_error *error) {
    lam_status status = LAM_OK;
    const json_t *which = json_object_get(root, "scene");
    const json_t *scene = json_array_get(json_object_get(root, "scenes"),
                                         json_is_integer(which) ? (size_t)json_integer_value(which) : 0);
    walk w = {.nodes = json_object_get(root, "nodes"), .cameras = json_object_get(root, "cameras")};
    w.n = json_array_size(w.nodes);
    w.seen = memory_allocate(w.n, sizeof *w.seen, "nodes", error);
    w.stack = memory_allocate(w.n, sizeof *w.stack, "nodes", error);
    w.placed = memory_allocate(w.n, sizeof *w.placed, "nodes", error);
    if (w.seen == NULL || w.stack == NULL || w.placed == NULL) TRY(LAM_ERR_MEMORY);
    push(&w, json_object_get(scene, "nodes"), &identity);
    while (w.n_stack > 0) {
        const size_t index = w.stack[--w.n_stack];
        const transform t = w.placed[w.n_stack];
        TRY(add_camera(&w, index, &t, path, s, error));
        push(&w, json_object_get(json_array_get(w.nodes, index), "children"), &t);
    }
done:
    free(w.seen);
    free(w.stack);
    free(w.placed);
    return status;
}

lam_status gltf_read_cameras(const char *path, const char *bytes, size_t length, imported_faces *s,
                             lam_error *error) {
    static const char member[] = "\"cameras\"";
    lam_status status = LAM_OK;
    gltf_find_json(&bytes, &length);
    if (memmem(bytes, length, member, sizeof member - 1) == NULL) return LAM_OK;
    json_t *root = json_loadb(bytes, length, 0, NULL);
    if (json_array_size(json_object_get(root, "cameras")) > 0) status = read_tree(root, path, s, error);
    json_decref(root);
    return status;
}
