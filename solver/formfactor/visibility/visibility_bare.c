/* The speed of Embree alone. */
#include "solver/base/clock.h"
#include "solver/formfactor/visibility/visibility_private.h"

#include <stdlib.h>

/* One packet of the bare loop; with count, returns how many rays hit their own facet. */
static size_t cast_bare(const visibility *v, const ray_packet *rays, const float nearest[VISIBILITY_PACKET],
                        uint32_t self, bool count) {
    static const int active[VISIBILITY_PACKET]
        __attribute__((aligned(32))) = {-1, -1, -1, -1, -1, -1, -1, -1};
    struct RTCRayHit8 packet __attribute__((aligned(32)));
    embree_query query;
    size_t own = 0;
    embree_query_init(&query);
    packet_set(&packet, rays);
    memcpy(packet.ray.tnear, nearest, sizeof packet.ray.tnear);
    embree_intersect(active, v->scene, &query, &packet);
    for (size_t i = 0; i < VISIBILITY_PACKET && count; i++)
        own += packet.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID &&
               facet_of(v, packet.hit.geomID[i], packet.hit.primID[i]) == v->facets.of_element[self];
    return own;
}

lam_status visibility_bare_seconds(const visibility *v, const ray_packet *packets, const uint32_t *self,
                                   size_t n_packets, double *seconds, size_t *own, lam_error *error) {
    float(*nearest)[VISIBILITY_PACKET] = memory_allocate(n_packets, sizeof *nearest, "rays", error);
    if (nearest == NULL) return LAM_ERR_MEMORY;
#pragma omp parallel for schedule(static)
    for (size_t p = 0; p < n_packets; p++)
        for (size_t i = 0; i < VISIBILITY_PACKET && self != NULL; i++) {
            const float cosine = along_normal(v, v->facets.of_element[self[p]], packets[p].direction[0][i],
                                              packets[p].direction[1][i], packets[p].direction[2][i]);
            nearest[p][i] = 2 * v->rounding / fmaxf(cosine, 1e-3f);
        }
    const double started = clock_seconds();
#pragma omp parallel for schedule(dynamic, 256)
    for (size_t p = 0; p < n_packets; p++) cast_bare(v, &packets[p], nearest[p], 0, false);
    *seconds = clock_seconds() - started;
    if (own != NULL) {
        size_t count = 0;
#pragma omp parallel for schedule(dynamic, 256) reduction(+ : count)
        for (size_t p = 0; p < n_packets; p++) count += cast_bare(v, &packets[p], nearest[p], self[p], true);
        *own = count;
    }
    free(nearest);
    return LAM_OK;
}
