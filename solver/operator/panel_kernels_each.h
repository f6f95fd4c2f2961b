/* What panel_kernels.c compiles for one instruction set: panel_products.h once for each precision, and flush.
 * Beside what that header wants, with one load for each precision, NAME(name) is what their names end in. */

#define KERNEL(name) NAME(name##_f32)
#define VALUE float
#define LANE_LOAD(p) LOAD_F32(p)
#include "solver/operator/panel_products.h"

#define KERNEL(name) NAME(name##_f16)
#define VALUE uint16_t
#define LANE_LOAD(p) LOAD_F16(p)
#include "solver/operator/panel_products.h"

#define KERNEL(name) NAME(name##_bf16)
#define VALUE uint16_t
#define LANE_LOAD(p) LOAD_BF16(p)
#include "solver/operator/panel_products.h"

#define KERNEL(name) NAME(name##_i8)
#define VALUE int8_t
#define LANE_LOAD(p) LOAD_I8(p)
#include "solver/operator/panel_products.h"

TARGET static void NAME(flush)(size_t count, float *restrict part, double *restrict total) {
#pragma omp simd
    for (size_t j = 0; j < count; j++) {
        total[j] += (double)part[j];
        part[j] = 0.0f;
    }
}

static const panel_kernels NAME(kernels) = {
    .name = LABEL,
    .project = {NAME(project_f32), NAME(project_f16), NAME(project_bf16), NAME(project_i8)},
    .expand = {NAME(expand_f32), NAME(expand_f16), NAME(expand_bf16), NAME(expand_i8)},
    .expand_row = {NAME(expand_row_f32), NAME(expand_row_f16), NAME(expand_row_bf16), NAME(expand_row_i8)},
    .flush = NAME(flush),
};

#undef NAME
#undef LABEL
#undef TARGET
#undef lane
#undef LANE_SET
#undef LANE_FMA
#undef LANE_SUM
#undef LOAD_F32
#undef LOAD_F16
#undef LOAD_BF16
#undef LOAD_I8
#undef ROW_TILE
#undef VECTOR_TILE
#undef PROJECT_TILE
