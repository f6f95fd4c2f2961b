/* The memory that --max-memory leaves for what scenes load or compute while they are served: form factors for
 * a tolerance, adjoint rows for reductions, meshes,
 * elements, corners. Any thread. */
#ifndef LAMBERT_SERVER_SCENE_MEMORY_LEDGER_H
#define LAMBERT_SERVER_SCENE_MEMORY_LEDGER_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>

typedef struct memory_ledger {
    atomic_size_t room;  /* bytes for all scenes; SIZE_MAX: no limit */
    atomic_size_t taken; /* may exceed room after more stores were read */
} memory_ledger;

/* Takes bytes until memory_ledger_give_back; false if there is no room. A NULL ledger has no limit. */
static inline bool memory_ledger_take(memory_ledger *ledger, size_t bytes) {
    if (ledger == NULL) return true;
    size_t taken = atomic_load(&ledger->taken);
    do {
        const size_t room = atomic_load(&ledger->room);
        if (taken > room || bytes > room - taken) return false;
    } while (!atomic_compare_exchange_weak(&ledger->taken, &taken, taken + bytes));
    return true;
}

static inline void memory_ledger_give_back(memory_ledger *ledger, size_t bytes) {
    if (ledger != NULL) atomic_fetch_sub(&ledger->taken, bytes);
}

#endif
