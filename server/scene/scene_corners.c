#include "server/scene/scene_corners.h"

#include "server/scene/scene_store.h"

#include <pthread.h>
#include <stdlib.h>

struct scene_corners {
    const scene *of;
    memory_ledger *ledger;
    pthread_mutex_t lock; /* of the plan */
    bool made;
    corner_plan plan;
    atomic_size_t held; /* of the ledger */
};

lam_status scene_corners_create(const scene *of, memory_ledger *ledger, scene_corners **out,
                                lam_error *error) {
    scene_corners *made = memory_allocate(1, sizeof *made, "the corners of a scene", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    made->of = of;
    made->ledger = ledger;
    pthread_mutex_init(&made->lock, NULL);
    *out = made;
    return LAM_OK;
}

void scene_corners_destroy(scene_corners *c) {
    if (c == NULL) return;
    if (c->made) corner_plan_free(&c->plan);
    memory_ledger_give_back(c->ledger, atomic_load(&c->held));
    pthread_mutex_destroy(&c->lock);
    free(c);
}

size_t scene_corners_held(scene_corners *c) {
    return c == NULL ? 0 : atomic_load(&c->held);
}

/* Corners of elements, edges, polygons, elements around nodes and weights take less than this of an element,
 * T-junctions included. */
#define BYTES_OF_ELEMENT ((size_t)1024)
#define BYTES_OF_VERTEX ((size_t)64)

size_t corner_work_bytes(size_t n, size_t n_vertices) {
    size_t of_elements, of_vertices, bytes;
    return size_multiply(n, BYTES_OF_ELEMENT, &of_elements) &&
                   size_multiply(n_vertices, BYTES_OF_VERTEX, &of_vertices) &&
                   !__builtin_add_overflow(of_elements, of_vertices, &bytes)
               ? bytes
               : SIZE_MAX;
}

static lam_status make_plan(scene_corners *c, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    corner_arrays arrays = {.n = 0};
    corner_nodes nodes = {.n_nodes = 0};
    TRY(scene_store_open(c->of, &s, error));
    TRY(corner_arrays_read(s, c->of->n, &arrays, error));
    const corner_mesh m = corner_arrays_mesh(&arrays);
    TRY(corner_nodes_create(&m, &nodes, error));
    TRY(corner_plan_create(&m, &nodes, &c->plan, error));
    c->made = true;
done:
    store_close(s);
    corner_arrays_free(&arrays);
    corner_nodes_free(&nodes);
    return status;
}

/* The same within the memory that the ledger has. */
static lam_status take_plan(scene_corners *c, lam_error *error) {
    const size_t most = corner_work_bytes(c->of->n, scene_mesh_vertices(c->of->mesh));
    if (!memory_ledger_take(c->ledger, most))
        return status_fail(error, LAM_ERR_MEMORY,
                           "%s: finding its corners takes %zu bytes, more than --max-memory leaves",
                           c->of->path, most);
    const lam_status status = make_plan(c, error);
    const size_t kept = status == LAM_OK ? corner_plan_bytes(&c->plan) : 0;
    if (kept <= most) memory_ledger_give_back(c->ledger, most - kept);
    atomic_store(&c->held, kept < most ? kept : most);
    return status;
}

lam_status scene_corners_get(scene_corners *c, const corner_plan **plan, lam_error *error) {
    lam_status status = LAM_OK;
    pthread_mutex_lock(&c->lock);
    if (!c->made) status = take_plan(c, error);
    if (status == LAM_OK) *plan = &c->plan;
    pthread_mutex_unlock(&c->lock);
    return status;
}
