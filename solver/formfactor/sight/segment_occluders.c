#include "solver/formfactor/sight/segment_occluders.h"

#include "solver/base/cpu.h"
#include "solver/base/vector3.h"
#include "solver/formfactor/exchange/lane_bits.h"
#include "store/status.h"

#include <string.h>

typedef float lanes __attribute__((vector_size(4 * VISIBILITY_PACKET), may_alias));
typedef int mask __attribute__((vector_size(4 * VISIBILITY_PACKET), may_alias));

static const mask bit_of_lane = {1, 2, 4, 8, 16, 32, 64, 128};
enum { ALL_BLOCKED = (1 << VISIBILITY_PACKET) - 1 };

lam_status segment_occluders_make(const occluders *o, const double centre[3], segment_occluder **out,
                                  lam_error *error) {
    segment_occluder *made = memory_allocate(o->n, sizeof *made, "occluders", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < o->n; k++) {
        const occluder *one = &o->of[k];
        made[k].n = one->n;
        made[k].pane = one->pane;
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

#define CPU_KERNELS "solver/formfactor/sight/segment_occluders_kernels.inc"
#include "solver/base/cpu_kernels.inc"

void segment_occluders_block(const segment_occluder *of, segment_list *list, const ray_packet *s, int packets,
                             unsigned *bits) {
    typedef void kernel(const segment_occluder *, segment_list *, const ray_packet *, unsigned *);
    static kernel *const one[] = CPU_TABLE(block_one_portable, block_one_avx2, block_one_avx512);
    static kernel *const all[] = CPU_TABLE(block_all_portable, block_all_avx2, block_all_avx512);
    if (packets == SEGMENT_PACKETS) {
        all[cpu_best()](of, list, s, bits);
        return;
    }
    for (int p = 0; p < packets; p++) one[cpu_best()](of, list, &s[p], &bits[p]);
}
