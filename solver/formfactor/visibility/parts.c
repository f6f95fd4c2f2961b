#include "solver/formfactor/visibility/parts.h"

#include "solver/base/random.h"
#include "solver/base/union_find.h"
#include "solver/formfactor/visibility/sample.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Ray number `round` of an element: from its centroid, cosine-weighted. */
static void set_ray(const mesh *m, const visibility *v, size_t i, size_t round, size_t lane, ray_packet *to) {
    element_frame frame;
    double centre[3];
    float from[3];
    uint64_t state = random_stream(i, round);
    const float r = sqrtf(random_to_float(random_next(&state)));
    const float turn = 6.2831853f * random_to_float(random_next(&state));
    const float x = r * cosf(turn), y = r * sinf(turn), z = sqrtf(1 - r * r);
    element_frame_init(&frame, m, i);
    mesh_centroid(m, i, centre);
    visibility_recentre(v, centre, from);
    for (int d = 0; d < 3; d++) {
        to->origin[d][lane] = from[d];
        to->direction[d][lane] = x * frame.tangent[d] + y * frame.bitangent[d] + z * frame.normal[d];
    }
}

/* met [count]: the elements whose fronts ray `round` of each of some elements meets, or VISIBILITY_NOTHING.
 */
static void cast_round(const mesh *m, const visibility *v, size_t round, const uint32_t *elements,
                       size_t count, uint32_t *met) {
#pragma omp parallel for schedule(dynamic, 64)
    for (size_t first = 0; first < count; first += VISIBILITY_PACKET) {
        const size_t n = count - first < VISIBILITY_PACKET ? count - first : VISIBILITY_PACKET;
        uint32_t self[VISIBILITY_PACKET];
        ray_packet rays;
        hit_packet hits;
        memset(&rays, 0, sizeof rays);
        for (size_t k = 0; k < VISIBILITY_PACKET; k++) {
            self[k] = elements[first + (k < n ? k : 0)];
            set_ray(m, v, self[k], round, k, &rays);
        }
        visibility_cast(v, &rays, n, self, 0, &hits);
        for (size_t k = 0; k < n; k++) met[first + k] = hits.back[k] ? VISIBILITY_NOTHING : hits.element[k];
    }
}

/* A member of the largest part; of several, of the first. sizes [n] is overwritten. */
static uint32_t member_of_largest(uint32_t *parent, size_t n, uint32_t *sizes) {
    uint32_t best = 0;
    memset(sizes, 0, n * sizeof *sizes);
    for (size_t i = 0; i < n; i++) sizes[union_find_root(parent, (uint32_t)i)]++;
    for (size_t i = 0; i < n; i++)
        if (sizes[i] > sizes[best]) best = (uint32_t)i;
    return best;
}

lam_status visibility_parts(const mesh *m, const visibility *v, uint32_t *part, size_t *count,
                            lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = m->n;
    uint32_t *left = memory_allocate(n, sizeof *left, "parts of the scene", error), largest = 0;
    uint32_t *met = memory_allocate(n, sizeof *met, "parts of the scene", error), *const sizes = met;
    size_t n_left = n;
    if (left == NULL || met == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) part[i] = left[i] = (uint32_t)i;
    for (size_t round = 0; round < PARTS_RAYS && n_left > 0; round++) {
        cast_round(m, v, round, left, n_left, met);
        for (size_t k = 0; k < n_left; k++)
            if (met[k] != VISIBILITY_NOTHING) (void)union_find_join(part, left[k], met[k]);
        /* After 1, 2, 4, ... rounds: it takes a pass over all elements. */
        if ((round & (round + 1)) == 0) largest = member_of_largest(part, n, sizes);
        size_t kept = 0;
        for (size_t k = 0; k < n_left; k++)
            if (union_find_root(part, left[k]) != union_find_root(part, largest)) left[kept++] = left[k];
        n_left = kept;
    }
    *count = union_find_number(part, n);
    union_find_mark_alone(part, n, *count, sizes);
done:
    free(left);
    free(met);
    return status;
}
