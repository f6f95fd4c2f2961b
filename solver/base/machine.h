/* Limits within which a program runs: processors, processor time, threads and memory, of the process and of
 * the control groups (version 1 or 2) that it is in. */
#ifndef LAMBERT_BASE_MACHINE_H
#define LAMBERT_BASE_MACHINE_H

#include <stddef.h>
#include <stdint.h>

typedef struct machine {
    size_t processors;    /* on line */
    size_t own;           /* of these, the ones that the process may run on */
    double quota;         /* processors' worth of time that its groups may use; INFINITY: all */
    uint64_t tasks_left;  /* threads and processes that its groups may still start; UINT64_MAX: any number */
    uint64_t memory_most; /* bytes that its groups may hold; UINT64_MAX: all */
    uint64_t
        memory_left; /* of these, the ones that nothing holds but files not read of late; UINT64_MAX: all */
} machine;

/* Reads the limits under root: "" for those of this system, of tests the folder that proc and sys are in. A
 * limit that cannot be read counts as none. */
void machine_read(const char *root, machine *out);

/* The threads that a program should compute with which has `beside` other threads and processes, at least 1.
 * why: the limit by which they are fewer than the processors, in words, or "". */
size_t machine_threads(const machine *m, size_t beside, char *why, size_t why_size);

#endif
