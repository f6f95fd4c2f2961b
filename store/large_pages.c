/* A hint to the kernel. memory.c, which gives it, may be replaced by a test. */
#include "store/status.h"

#include <stdint.h>
#include <sys/mman.h>
#include <unistd.h>

/* Bytes from which large pages are worth a call: a few of 2 MB. */
enum { LARGE = 8 << 20 };

void memory_large_pages(void *memory, size_t bytes) {
#ifdef MADV_HUGEPAGE
    if (memory == NULL || bytes < LARGE) return;
    const size_t page = (size_t)sysconf(_SC_PAGESIZE), before = (page - (uintptr_t)memory % page) % page;
    /* A kernel without large pages refuses, and all is as it was. */
    (void)madvise((char *)memory + before, (bytes - before) / page * page, MADV_HUGEPAGE);
#else
    (void)memory;
    (void)bytes;
#endif
}
