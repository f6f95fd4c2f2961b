#include "solver/formfactor/blocks/candidates.h"

#include "solver/base/cpu.h"
#include "solver/base/vector3.h"

#include <math.h>
#include <string.h>

double candidates_place(const occluders *o, const flat_clusters *f, uint32_t a, uint32_t b,
                        const candidates *among) {
    if (among->count <= 0) return .5;
    const occluder *first = &o->of[among->of[0]];
    const double from = dot3(first->normal, f->of[a].centre) - first->level;
    const double to = dot3(first->normal, f->of[b].centre) - first->level;
    return from * to < 0 ? fmin(fmax(from / (from - to), .05), .95) : .5;
}

#define CPU_KERNELS "solver/formfactor/blocks/candidates_kernels.inc"
#include "solver/base/cpu_kernels.inc"

void candidates_block(const occluders *o, const candidates *among, const double origin[3],
                      const segment_lanes *s, float blocked[SEGMENT_LANES]) {
    typedef void kernel(const occluder *, int, const uint32_t *, const double[3], const segment_lanes *,
                        float[SEGMENT_LANES]);
    static kernel *const table[] = CPU_TABLE(block_lanes_portable, block_lanes_avx2, block_lanes_avx512);
    memset(blocked, 0, SEGMENT_LANES * sizeof *blocked);
    table[cpu_best()](o->of, among->count, among->of, origin, s, blocked);
}
