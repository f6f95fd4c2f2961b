#include "solver/base/cpu.h"

#include <stdatomic.h>
#include <stdbool.h>

#if defined(__x86_64__)
#include <cpuid.h>

/* Not every compiler's __builtin_cpu_supports knows F16C. */
static bool has_f16c(void) {
    unsigned a, b, c, d;
    return __get_cpuid(1, &a, &b, &c, &d) != 0 && (c & bit_F16C) != 0;
}

static cpu_level find_best(void) {
    if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma") || !has_f16c()) return CPU_PORTABLE;
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
                   __builtin_cpu_supports("avx512dq")
               ? CPU_AVX512
               : CPU_AVX2;
}
#else
static cpu_level find_best(void) {
    return CPU_PORTABLE;
}
#endif

cpu_level cpu_best(void) {
    /* Level + 1, or 0 before the first call; cpuid is slow in a virtual machine. */
    static _Atomic unsigned char known;
    unsigned char level = atomic_load_explicit(&known, memory_order_relaxed);
    if (level == 0) {
        level = (unsigned char)(find_best() + 1);
        atomic_store_explicit(&known, level, memory_order_relaxed);
    }
    return (cpu_level)(level - 1);
}
