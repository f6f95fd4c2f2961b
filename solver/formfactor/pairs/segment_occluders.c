#include "solver/formfactor/pairs/segment_occluders.h"

#include "solver/base/cpu.h"
#include "solver/base/vector3.h"
#include "store/status.h"

#include <string.h>

typedef float lanes __attribute__((vector_size(4 * VISIBILITY_PACKET), may_alias));
typedef int mask __attribute__((vector_size(4 * VISIBILITY_PACKET), may_alias));

lam_status segment_occluders_make(const occluders *o, const double centre[3], segment_occluder **out,
                                  lam_error *error) {
    segment_occluder *made = memory_allocate(o->n, sizeof *made, "occluders", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < o->n; k++) {
        const occluder *one = &o->of[k];
        made[k].n = one->n;
        made[k].level = (float)(one->level - dot3(one->normal, centre));
        for (int d = 0; d < 3; d++) made[k].normal[d] = (float)one->normal[d];
        for (int e = 0; e < one->n; e++) {
            for (int d = 0; d < 3; d++) made[k].edge[e][d] = (float)one->edge[e][d];
            made[k].edge[e][3] = (float)(one->edge[e][3] + dot3(one->edge[e], centre) + o->slack);
        }
    }
    *out = made;
    return LAM_OK;
}

#define CPU_KERNELS "solver/formfactor/pairs/segment_occluders_kernels.inc"
#include "solver/base/cpu_kernels.inc"

unsigned segment_occluders_block(const segment_occluder *of, const segment_list *list, const ray_packet *s) {
    typedef unsigned kernel(const segment_occluder *, int, const uint32_t *, const ray_packet *);
    static kernel *const table[] =
        CPU_TABLE(block_segments_portable, block_segments_avx2, block_segments_avx512);
    return table[cpu_best()](of, list->count, list->of, s);
}
