/* Faults under a program: loaded before it (LD_PRELOAD), it lets one allocation fail, counts what is
 * held, and sets the clock on the wall. A test steers it through the file that the variable FAULTS names,
 * which holds one struct controls and is shared by every process that has it.
 *
 * OpenMP's runtime ends the program when it gets no memory, whatever the program does, so its requests are
 * left alone. */
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <link.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

struct controls {
    atomic_int_least64_t left;  /* allocations until one fails; negative: none does */
    atomic_int_least64_t held;  /* allocated and not freed */
    atomic_int_least64_t shift; /* s that the clock on the wall is wrong by */
};

static struct controls none = {.left = -1}, *now = &none;
static uintptr_t runtime_begin, runtime_end;

/* glibc's own, by the names that it keeps for those who put others before them. */
void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *old, size_t size);
void *__libc_memalign(size_t alignment, size_t size);
void __libc_free(void *memory);

void *memalign(size_t alignment, size_t size);

static int find_runtime(struct dl_phdr_info *info, size_t size, void *nothing) {
    (void)size, (void)nothing;
    if (strstr(info->dlpi_name, "libgomp") == NULL) return 0;
    runtime_begin = info->dlpi_addr;
    for (int i = 0; i < info->dlpi_phnum; i++) {
        const uintptr_t end = info->dlpi_addr + info->dlpi_phdr[i].p_vaddr + info->dlpi_phdr[i].p_memsz;
        if (end > runtime_end) runtime_end = end;
    }
    return 1;
}

__attribute__((constructor)) static void begin(void) {
    const char *path = getenv("FAULTS");
    const int fd = path != NULL ? open(path, O_RDWR | O_CLOEXEC) : -1;
    dl_iterate_phdr(find_runtime, NULL);
    if (fd < 0) return;
    void *shared = mmap(NULL, sizeof *now, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    if (shared != MAP_FAILED) now = shared;
    close(fd);
}

static int fails(const void *caller) {
    const uintptr_t at = (uintptr_t)caller;
    if (at >= runtime_begin && at < runtime_end) return 0;
    int_least64_t left = atomic_load(&now->left);
    while (left >= 0 && !atomic_compare_exchange_weak(&now->left, &left, left - 1)) {
    }
    if (left != 0) return 0;
    errno = ENOMEM;
    return 1;
}

static void *counted(void *memory) {
    if (memory != NULL) atomic_fetch_add(&now->held, 1);
    return memory;
}

#define CALLER __builtin_return_address(0)

void *malloc(size_t size) {
    return fails(CALLER) ? NULL : counted(__libc_malloc(size));
}

void *calloc(size_t count, size_t size) {
    return fails(CALLER) ? NULL : counted(__libc_calloc(count, size));
}

void *realloc(void *old, size_t size) {
    if (old != NULL && size == 0) {
        free(old);
        return NULL;
    }
    if (fails(CALLER)) return NULL;
    void *memory = __libc_realloc(old, size);
    return old == NULL ? counted(memory) : memory;
}

void *memalign(size_t alignment, size_t size) {
    return fails(CALLER) ? NULL : counted(__libc_memalign(alignment, size));
}

void *aligned_alloc(size_t alignment, size_t size) {
    return fails(CALLER) ? NULL : counted(__libc_memalign(alignment, size));
}

int posix_memalign(void **memory, size_t alignment, size_t size) {
    void *made = fails(CALLER) ? NULL : counted(__libc_memalign(alignment, size));
    if (made == NULL) return ENOMEM;
    *memory = made;
    return 0;
}

void free(void *memory) {
    if (memory != NULL) atomic_fetch_sub(&now->held, 1);
    __libc_free(memory);
}

int clock_gettime(clockid_t clock, struct timespec *time) {
    const int failed = (int)syscall(SYS_clock_gettime, clock, time);
    if (failed == 0 && clock == CLOCK_REALTIME) time->tv_sec += (time_t)atomic_load(&now->shift);
    return failed;
}

time_t time(time_t *out) {
    struct timespec t = {0};
    clock_gettime(CLOCK_REALTIME, &t);
    if (out != NULL) *out = t.tv_sec;
    return t.tv_sec;
}

int gettimeofday(struct timeval *restrict out, void *restrict zone) {
    struct timespec t = {0};
    (void)zone;
    clock_gettime(CLOCK_REALTIME, &t);
    out->tv_sec = t.tv_sec;
    out->tv_usec = t.tv_nsec / 1000;
    return 0;
}
