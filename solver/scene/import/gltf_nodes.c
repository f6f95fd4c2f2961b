#include "solver/scene/import/gltf_nodes.h"

#include "store/status.h"

#include <stdlib.h>

/* The way from the roots. */
typedef struct walk {
    const json_t *list; /* of nodes */
    gltf_nodes *out;
    bool *seen;    /* [n] */
    size_t *stack; /* [n] */
    size_t n_stack, n_ordered;
} walk;

static const gltf_transform identity = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

static gltf_transform product(const gltf_transform *x, const gltf_transform *y) {
    gltf_transform out;
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
static gltf_transform transform_of(const json_t *node) {
    double m[16], t[3] = {0, 0, 0}, q[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1};
    gltf_transform out;
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

static void push_node(walk *w, size_t index, size_t parent) {
    if (index >= w->out->n || w->seen[index]) return;
    const gltf_transform own = transform_of(json_array_get(w->list, index));
    w->seen[index] = true;
    w->stack[w->n_stack++] = index;
    w->out->parent[index] = parent;
    w->out->placed[index] = product(parent == SIZE_MAX ? &identity : &w->out->placed[parent], &own);
}

/* Puts the nodes of a list on the stack, the first on top. */
static void push(walk *w, const json_t *list, size_t parent) {
    for (size_t k = json_array_size(list); k-- > 0;) {
        const json_t *which = json_array_get(list, k);
        if (json_is_integer(which)) push_node(w, (size_t)json_integer_value(which), parent);
    }
}

/* Puts all that hangs on the stack into the order. */
static void follow(walk *w) {
    while (w->n_stack > 0) {
        const size_t index = w->stack[--w->n_stack];
        w->out->order[w->n_ordered++] = index;
        push(w, json_object_get(json_array_get(w->list, index), "children"), index);
    }
}

/* True where a node is a child of another one. */
static void mark_children(const walk *w, bool *is_child) {
    size_t i, k;
    json_t *node, *which;
    json_array_foreach(w->list, i, node) json_array_foreach(json_object_get(node, "children"), k, which) {
        const size_t index = (size_t)json_integer_value(which);
        if (json_is_integer(which) && index < w->out->n) is_child[index] = true;
    }
}

size_t gltf_scene_read(const json_t *root) {
    const json_t *which = json_object_get(root, "scene");
    return json_is_integer(which) ? (size_t)json_integer_value(which) : 0;
}

lam_status gltf_nodes_place(const json_t *root, gltf_nodes *out, lam_error *error) {
    lam_status status = LAM_OK;
    gltf_nodes made = {.n = json_array_size(json_object_get(root, "nodes"))};
    walk w = {.list = json_object_get(root, "nodes"), .out = &made};
    bool *is_child = memory_allocate(made.n, sizeof *is_child, "nodes", error);
    w.seen = memory_allocate(made.n, sizeof *w.seen, "nodes", error);
    w.stack = memory_allocate(made.n, sizeof *w.stack, "nodes", error);
    made.order = memory_allocate(made.n, sizeof *made.order, "nodes", error);
    made.parent = memory_allocate(made.n, sizeof *made.parent, "nodes", error);
    made.placed = memory_allocate(made.n, sizeof *made.placed, "nodes", error);
    if (is_child == NULL || w.seen == NULL || w.stack == NULL || made.order == NULL || made.parent == NULL ||
        made.placed == NULL)
        TRY(LAM_ERR_MEMORY);
    const json_t *scene = json_array_get(json_object_get(root, "scenes"), gltf_scene_read(root));
    push(&w, json_object_get(scene, "nodes"), SIZE_MAX);
    follow(&w);
    made.n_read = w.n_ordered;
    mark_children(&w, is_child);
    for (int of_a_ring = 0; of_a_ring < 2; of_a_ring++)
        for (size_t i = 0; i < made.n; i++) {
            if (of_a_ring == 0 && is_child[i]) continue;
            push_node(&w, i, SIZE_MAX);
            follow(&w);
        }
    *out = made;
    made = (gltf_nodes){.n = 0};
done:
    free(is_child);
    free(w.seen);
    free(w.stack);
    gltf_nodes_free(&made);
    return status;
}

void gltf_nodes_free(gltf_nodes *nodes) {
    free(nodes->order);
    free(nodes->parent);
    free(nodes->placed);
    *nodes = (gltf_nodes){.n = 0};
}
