/* What panel_kernels.c compiles for one instruction set: panel_products.h once for each precision and layout,
 * and flush. Beside what that header wants, with one load for each precision, NAME(name) is what their names
 * end in. */

#define VALUE float
#define LANE_LOAD(p) LOAD_F32(p)
#define BY_ROWS 0
#define KERNEL(name) NAME(name##_f32)
#include "solver/operator/panel_products.h"
#undef BY_ROWS
#undef KERNEL
#define BY_ROWS 1
#define KERNEL(name) NAME(name##_rows_f32)
#include "solver/operator/panel_products.h"
#undef BY_ROWS
#undef KERNEL
#undef VALUE
#undef LANE_LOAD

#define VALUE uint16_t
#define LANE_LOAD(p) LOAD_F16(p)
#define BY_ROWS 0
#define KERNEL(name) NAME(name##_f16)
#include "solver/operator/panel_products.h"
#undef BY_ROWS
#undef KERNEL
#define BY_ROWS 1
#define KERNEL(name) NAME(name##_rows_f16)
#include "solver/operator/panel_products.h"
#undef BY_ROWS
#undef KERNEL
#undef VALUE
#undef LANE_LOAD

#define VALUE uint16_t
#define LANE_LOAD(p) LOAD_BF16(p)
#define BY_ROWS 0
#define KERNEL(name) NAME(name##_bf16)
#include "solver/operator/panel_products.h"
#undef BY_ROWS
#undef KERNEL
#define BY_ROWS 1
#define KERNEL(name) NAME(name##_rows_bf16)
#include "solver/operator/panel_products.h"
#undef BY_ROWS
#undef KERNEL
#undef VALUE
#undef LANE_LOAD

#define VALUE int8_t
#define LANE_LOAD(p) LOAD_I8(p)
#define BY_ROWS 0
#define KERNEL(name) NAME(name##_i8)
#include "solver/operator/panel_products.h"
#undef BY_ROWS
#undef KERNEL
#define BY_ROWS 1
#define KERNEL(name) NAME(name##_rows_i8)
#include "solver/operator/panel_products.h"
#undef BY_ROWS
#undef KERNEL
#undef VALUE
#undef LANE_LOAD

TARGET static void NAME(flush)(size_t count, float *restrict part, double *restrict total) {
#pragma omp simd
    for (size_t j = 0; j < count; j++) {
        total[j] += (double)part[j];
        part[j] = 0.0f;
    }
}

#define OF_EACH(name)                                                                                        \
    {                                                                                                        \
        {NAME(name##_f32), NAME(name##_f16), NAME(name##_bf16), NAME(name##_i8)},                            \
            {NAME(name##_rows_f32), NAME(name##_rows_f16), NAME(name##_rows_bf16), NAME(name##_rows_i8)},    \
    }

static const panel_kernels NAME(kernels) = {
    .name = LABEL,
    .project = OF_EACH(project),
    .expand = OF_EACH(expand),
    .expand_row = OF_EACH(expand_row),
    .flush = NAME(flush),
};

#undef OF_EACH
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
