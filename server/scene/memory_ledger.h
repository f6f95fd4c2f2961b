/* What --max-memory leaves for what scenes come to hold while they are served: form factors that a tolerance
 * takes, rows that a reduction keeps. Any thread. */
#ifndef LAMBERT_SERVER_SCENE_MEMORY_LEDGER_H
#define LAMBERT_SERVER_SCENE_MEMORY_LEDGER_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>

typedef struct memory_ledger {
    atomic_size_t room;  /* for all of it; SIZE_MAX: as much as there is */
    atomic_size_t taken; /* may be more than room once stores have come */
} memory_ledger;

/* Whether bytes may be held; they are then, until they are given back. ledger NULL: always. */
bool memory_ledger_take(memory_ledger *ledger, size_t bytes);
void memory_ledger_give_back(memory_ledger *ledger, size_t bytes);

#endif
