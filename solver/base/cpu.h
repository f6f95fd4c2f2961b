/* What this CPU can do that __builtin_cpu_supports does not know everywhere. */
#ifndef LAMBERT_BASE_CPU_H
#define LAMBERT_BASE_CPU_H

#include <stdbool.h>

#if defined(__x86_64__)
#include <cpuid.h>

static inline bool cpu_has_f16c(void) {
    unsigned a, b, c, d;
    return __get_cpuid(1, &a, &b, &c, &d) != 0 && (c & bit_F16C) != 0;
}

/* With which AVX2 kernels of ours are compiled. */
static inline bool cpu_has_avx2_set(void) {
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && cpu_has_f16c();
}
#endif

#endif
