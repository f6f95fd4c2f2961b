/* Segments between two points, of elements or in the open: which of them are blocked. */
#include "solver/formfactor/visibility/visibility_private.h"

/* The data of the filter of segments: the facets at both ends, by lane, which is the segment's id. */
typedef struct segment_context {
    embree_query query; /* first: the filter gets a pointer to it */
    const visibility *visibility;
    uint32_t from[VISIBILITY_PACKET], to[VISIBILITY_PACKET]; /* facets */
} segment_context;

/* Rejects hits on the facets at both ends of a segment and on faces in their planes at the ends. */
static void refuse_both_ends(const struct RTCFilterFunctionNArguments *args) {
    const segment_context *context = (const segment_context *)args->context;
    const visibility *v = context->visibility;
    const size_t n = args->N;
    const float *direction = (const float *)args->ray + RAY_DIRECTION * n;
    const float *distance = (const float *)args->ray + RAY_DISTANCE * n;
    const unsigned *lane = (const unsigned *)args->ray + RAY_ID * n;
    const unsigned *id = (const unsigned *)args->hit + HIT_PRIMITIVE * n;
    const unsigned *geometry = (const unsigned *)args->hit + HIT_GEOMETRY * n;
    for (size_t i = 0; i < n; i++) {
        if (args->valid[i] == 0) continue;
        const uint32_t facet = facet_of(v, geometry[i], id[i]);
        const uint32_t from = context->from[lane[i]], to = context->to[lane[i]];
        const float along =
            fabsf(along_normal(v, facet, direction[i], direction[n + i], direction[2 * n + i]));
        if (facet == from || facet == to || in_own_plane(v, facet, from, distance[i] * along) ||
            in_own_plane(v, facet, to, (1 - distance[i]) * along))
            args->valid[i] = 0;
    }
}

/* Moves both ends above their elements' planes, and what rises above these, by more than rounding: nearly all
 * segments then meet neither of these elements, and the filter is not called for them, which would take a
 * fifth of all time. */
static void lift_ends(const visibility *v, uint32_t from, uint32_t to, size_t lane,
                      struct RTCRayHit8 *packet) {
    const float height = 2 * v->rounding;
    const float *n = v->mesh->normal[from], *m = v->mesh->normal[to];
    packet->ray.org_x[lane] += height * n[0];
    packet->ray.org_y[lane] += height * n[1];
    packet->ray.org_z[lane] += height * n[2];
    packet->ray.dir_x[lane] += height * (m[0] - n[0]);
    packet->ray.dir_y[lane] += height * (m[1] - n[1]);
    packet->ray.dir_z[lane] += height * (m[2] - n[2]);
    if (v->rise == NULL) return;
    const float more = (float)visibility_rise(v, from), end = (float)visibility_rise(v, to);
    packet->ray.org_x[lane] += more * n[0];
    packet->ray.org_y[lane] += more * n[1];
    packet->ray.org_z[lane] += more * n[2];
    packet->ray.dir_x[lane] += end * m[0] - more * n[0];
    packet->ray.dir_y[lane] += end * m[1] - more * n[1];
    packet->ray.dir_z[lane] += end * m[2] - more * n[2];
}

unsigned visibility_blocked(const visibility *v, const ray_packet *segments, size_t n_segments,
                            const uint32_t *from, const uint32_t *to) {
    struct RTCRayHit8 packet __attribute__((aligned(32)));
    int active[VISIBILITY_PACKET] __attribute__((aligned(32)));
    segment_context context = {.visibility = v};
    embree_query_init(&context.query);
    context.query.filter = refuse_both_ends;
    packet_set(&packet, segments);
    for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
        active[i] = i < n_segments ? -1 : 0;
        packet.ray.tfar[i] = 1;
        packet.ray.id[i] = (unsigned)i;
        if (i >= n_segments) continue;
        lift_ends(v, from[i], to[i], i, &packet);
        context.from[i] = v->facets.of_element[from[i] < v->n_fronts ? from[i] : from[i] - v->n_fronts];
        context.to[i] = v->facets.of_element[to[i] < v->n_fronts ? to[i] : to[i] - v->n_fronts];
    }
    embree_occluded(active, v->scene, &context.query, &packet.ray);
    unsigned blocked = 0;
    for (size_t i = 0; i < n_segments; i++) blocked |= (unsigned)(packet.ray.tfar[i] < 0) << i;
    return blocked;
}

unsigned visibility_between(const visibility *v, const ray_packet *segments, size_t n_segments) {
    struct RTCRayHit8 packet __attribute__((aligned(32)));
    int active[VISIBILITY_PACKET] __attribute__((aligned(32)));
    embree_query query;
    unsigned blocked = 0;
    embree_query_init(&query);
    query.coherent = true;
    packet_set(&packet, segments);
    for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
        active[i] = i < n_segments ? -1 : 0;
        packet.ray.tfar[i] = 1;
    }
    embree_occluded(active, v->scene, &query, &packet.ray);
    for (size_t i = 0; i < n_segments; i++) blocked |= (unsigned)(packet.ray.tfar[i] < 0) << i;
    return blocked;
}
