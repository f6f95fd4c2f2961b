#include "server/scene/row_cache.h"

#include "store/status.h"

#include <pthread.h>
#include <stdlib.h>

struct row_cache {
    pthread_mutex_t lock; /* held for a walk over the list, never while anything is computed */
    adjoint_row *first;
    uint64_t uses;
    size_t bytes, max_bytes;
    memory_ledger *ledger;
    emitter_weights *weights;   /* once set, for good; NULL: not yet, or not worth it */
    luminaire_sums *luminaires; /* likewise */
};

lam_status row_cache_create(size_t max_bytes, memory_ledger *ledger, row_cache **out, lam_error *error) {
    row_cache *rows = memory_allocate(1, sizeof *rows, "adjoint rows", error);
    if (rows == NULL) return LAM_ERR_MEMORY;
    pthread_mutex_init(&rows->lock, NULL);
    rows->max_bytes = max_bytes;
    rows->ledger = ledger;
    *out = rows;
    return LAM_OK;
}

static void drop_weights(memory_ledger *ledger, emitter_weights *weights) {
    if (weights == NULL) return;
    memory_ledger_give_back(ledger, weights->bytes);
    emitter_weights_free(weights);
}

static void drop_luminaires(memory_ledger *ledger, luminaire_sums *sums) {
    if (sums == NULL) return;
    memory_ledger_give_back(ledger, sums->bytes);
    luminaire_sums_free(sums);
}

void row_cache_destroy(row_cache *rows) {
    if (rows == NULL) return;
    for (adjoint_row *row = rows->first, *next; row != NULL; row = next) {
        next = row->next;
        adjoint_row_free(row);
    }
    memory_ledger_give_back(rows->ledger, rows->bytes);
    drop_weights(rows->ledger, rows->weights);
    drop_luminaires(rows->ledger, rows->luminaires);
    pthread_mutex_destroy(&rows->lock);
    free(rows);
}

size_t row_cache_held(row_cache *rows) {
    pthread_mutex_lock(&rows->lock);
    const size_t held = rows->bytes + (rows->weights != NULL ? rows->weights->bytes : 0) +
                        (rows->luminaires != NULL ? rows->luminaires->bytes : 0);
    pthread_mutex_unlock(&rows->lock);
    return held;
}

/* The caller holds the lock. Names of the same groups share a row. */
static adjoint_row *find_locked(row_cache *rows, const reduce_name *name, lam_quantity quantity) {
    for (adjoint_row *row = rows->first; row != NULL; row = row->next)
        if (row->groups == name->groups && row->n_groups == name->n_groups && row->quantity == quantity) {
            row->references++;
            row->used = ++rows->uses;
            return row;
        }
    return NULL;
}

/* The caller holds the lock. */
static void release_locked(adjoint_row *row) {
    if (row != NULL && --row->references == 0) adjoint_row_free(row);
}

/* Drops the least recently used row of a list that is not empty; its last user frees it. The caller holds
 * the lock. */
static void evict_locked(row_cache *rows) {
    adjoint_row **oldest = &rows->first;
    for (adjoint_row **at = oldest; *at != NULL; at = &(*at)->next)
        if ((*at)->used < (*oldest)->used) oldest = at;
    adjoint_row *gone = *oldest;
    *oldest = gone->next;
    rows->bytes -= gone->bytes;
    memory_ledger_give_back(rows->ledger, gone->bytes);
    release_locked(gone);
}

void row_cache_clear(row_cache *rows) {
    pthread_mutex_lock(&rows->lock);
    while (rows->first != NULL) evict_locked(rows);
    pthread_mutex_unlock(&rows->lock);
}

/* Makes room for a row by dropping others; false if the ledger has none. The caller holds the lock. A single
 * row may exceed max_bytes. */
static bool make_room_locked(row_cache *rows, size_t bytes) {
    while (rows->first != NULL && rows->bytes + bytes > rows->max_bytes) evict_locked(rows);
    while (!memory_ledger_take(rows->ledger, bytes)) {
        if (rows->first == NULL) return false;
        evict_locked(rows);
    }
    return true;
}

adjoint_row *row_cache_publish(row_cache *rows, adjoint_row *made, const reduce_name *name) {
    pthread_mutex_lock(&rows->lock);
    adjoint_row *known = find_locked(rows, name, made->quantity);
    if (known == NULL) {
        const bool kept = make_room_locked(rows, made->bytes);
        made->references = kept ? 2 : 1;
        made->used = ++rows->uses;
        if (kept) {
            made->next = rows->first;
            rows->first = made;
            rows->bytes += made->bytes;
        }
    }
    pthread_mutex_unlock(&rows->lock);
    if (known == NULL) return made;
    adjoint_row_free(made);
    return known;
}

void row_cache_release(row_cache *rows, size_t count, adjoint_row **released) {
    pthread_mutex_lock(&rows->lock);
    for (size_t k = 0; k < count; k++) release_locked(released[k]);
    pthread_mutex_unlock(&rows->lock);
}

bool row_cache_find(row_cache *rows, size_t count, const reduce_name *names, lam_quantity quantity,
                    adjoint_row **found) {
    bool all = true;
    pthread_mutex_lock(&rows->lock);
    for (size_t k = 0; k < count; k++) {
        found[k] = find_locked(rows, &names[k], quantity);
        all = all && found[k] != NULL;
    }
    pthread_mutex_unlock(&rows->lock);
    return all;
}

size_t row_cache_limit(const row_cache *rows) {
    return rows->max_bytes;
}

const emitter_weights *row_cache_weights(row_cache *rows) {
    pthread_mutex_lock(&rows->lock);
    const emitter_weights *weights = rows->weights;
    pthread_mutex_unlock(&rows->lock);
    return weights;
}

const emitter_weights *row_cache_set_weights(row_cache *rows, emitter_weights *made) {
    pthread_mutex_lock(&rows->lock);
    if (rows->weights == NULL) {
        rows->weights = made;
        made = NULL;
    }
    const emitter_weights *weights = rows->weights;
    pthread_mutex_unlock(&rows->lock);
    drop_weights(rows->ledger, made);
    return weights;
}

const luminaire_sums *row_cache_luminaires(row_cache *rows) {
    pthread_mutex_lock(&rows->lock);
    const luminaire_sums *sums = rows->luminaires;
    pthread_mutex_unlock(&rows->lock);
    return sums;
}

const luminaire_sums *row_cache_set_luminaires(row_cache *rows, luminaire_sums *made) {
    pthread_mutex_lock(&rows->lock);
    if (rows->luminaires == NULL) {
        rows->luminaires = made;
        made = NULL;
    }
    const luminaire_sums *sums = rows->luminaires;
    pthread_mutex_unlock(&rows->lock);
    drop_luminaires(rows->ledger, made);
    return sums;
}
