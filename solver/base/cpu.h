/* The instruction sets that kernels are compiled for and the choice between them on the CPU at hand: every
 * file of kernels keeps one table, CPU_TABLE, and takes its entry of cpu_best(). */
#ifndef LAMBERT_BASE_CPU_H
#define LAMBERT_BASE_CPU_H

/* Each level has all instructions of the ones before: AVX2 with FMA and F16C (Haswell, Zen); AVX-512 F, VL
 * and DQ (Skylake-SP, Zen 4). */
typedef enum cpu_level { CPU_PORTABLE, CPU_AVX2, CPU_AVX512 } cpu_level;

/* The highest level of this CPU. */
cpu_level cpu_best(void);

/* The attribute of functions of a level, and the initializer of a table by level. Kernels beyond the portable
 * ones stand inside #ifdef CPU_AVX2_TARGET. */
#if defined(__x86_64__)
#define CPU_AVX2_TARGET __attribute__((target("avx2,fma,f16c")))
#define CPU_AVX512_TARGET __attribute__((target("avx512f,avx512vl,avx512dq,fma,f16c")))
#define CPU_TABLE(portable, avx2, avx512) {portable, avx2, avx512}
#else
#define CPU_TABLE(portable, avx2, avx512) {portable}
#endif

#endif
