/* Memory that fails when told to, in place of store/memory.c, in the programs that include this. */
#ifndef LAMBERT_TESTS_FAILING_MEMORY_H
#define LAMBERT_TESTS_FAILING_MEMORY_H

/* Number of allocations that succeed from now on; negative: all. */
extern long allocations_left;

#endif
