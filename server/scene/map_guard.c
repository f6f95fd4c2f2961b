#include "server/scene/map_guard.h"

#include <errno.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdint.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

struct map_range {
    atomic_bool taken;
    atomic_uintptr_t begin;
    atomic_size_t bytes; /* 0: not in use */
    atomic_size_t lost;  /* 1 + offset of the first lost page that was read; 0: none */
};

static map_range ranges[MAP_GUARD_RANGES];
static atomic_size_t n_used; /* ranges from this one on were never used */
static size_t page_bytes;

/* Maps zeros from the page at fault to the end of its range: a truncated file has lost all of that. */
static bool mend(uintptr_t address) {
    const size_t count = atomic_load(&n_used);
    for (size_t i = 0; i < count; i++) {
        const size_t bytes = atomic_load(&ranges[i].bytes);
        const uintptr_t begin = atomic_load(&ranges[i].begin);
        if (bytes == 0 || address < begin || address - begin >= bytes) continue;
        const size_t page = (address - begin) / page_bytes * page_bytes;
        size_t none = 0;
        atomic_compare_exchange_strong(&ranges[i].lost, &none, page + 1);
        /* The system call itself: POSIX does not list mmap as safe in signal handlers, and a thread sanitizer
         * would report its wrapper as a race with readers. */
        return syscall(SYS_mmap, begin + page, bytes - page, PROT_READ,
                       MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED, -1, 0L) != -1;
    }
    return false;
}

static void on_fault(int number, siginfo_t *info, void *context) {
    (void)context;
    const int before = errno;
    /* Sent by a process, or outside all ranges: the access is repeated and ends the process. */
    if (info->si_code <= 0 || !mend((uintptr_t)info->si_addr)) signal(number, SIG_DFL);
    errno = before;
}

void map_guard_install(void) {
    struct sigaction action = {.sa_flags = SA_SIGINFO | SA_RESTART};
    page_bytes = (size_t)sysconf(_SC_PAGESIZE);
    action.sa_sigaction = on_fault;
    sigemptyset(&action.sa_mask);
    sigaction(SIGBUS, &action, NULL);
}

void map_guard_allow(void) {
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGBUS);
    pthread_sigmask(SIG_UNBLOCK, &set, NULL);
}

map_range *map_guard_add(const void *begin, size_t bytes) {
    for (size_t i = 0; i < MAP_GUARD_RANGES; i++) {
        bool taken = false;
        if (!atomic_compare_exchange_strong(&ranges[i].taken, &taken, true)) continue;
        atomic_store(&ranges[i].lost, 0);
        atomic_store(&ranges[i].begin, (uintptr_t)begin);
        atomic_store(&ranges[i].bytes, bytes);
        size_t used = atomic_load(&n_used);
        while (used < i + 1 && !atomic_compare_exchange_weak(&n_used, &used, i + 1)) continue;
        return &ranges[i];
    }
    return NULL;
}

void map_guard_remove(map_range *range) {
    if (range == NULL) return;
    atomic_store(&range->bytes, 0);
    atomic_store(&range->taken, false);
}

bool map_guard_lost(const map_range *range, size_t *offset) {
    const size_t lost = range != NULL ? atomic_load(&range->lost) : 0;
    if (lost > 0) *offset = lost - 1;
    return lost > 0;
}
