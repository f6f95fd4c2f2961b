#include "server/scene/memory_ledger.h"

bool memory_ledger_take(memory_ledger *ledger, size_t bytes) {
    if (ledger == NULL) return true;
    size_t taken = atomic_load(&ledger->taken);
    do {
        const size_t room = atomic_load(&ledger->room);
        if (taken > room || bytes > room - taken) return false;
    } while (!atomic_compare_exchange_weak(&ledger->taken, &taken, taken + bytes));
    return true;
}

void memory_ledger_give_back(memory_ledger *ledger, size_t bytes) {
    if (ledger != NULL) atomic_fetch_sub(&ledger->taken, bytes);
}
