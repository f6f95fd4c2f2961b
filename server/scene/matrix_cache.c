#include "server/scene/matrix_cache.h"

#include "store/status.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

/* A matrix and its question, in one block each; values NULL: the place is free. */
typedef struct kept_matrix {
    lam_quantity quantity;
    size_t n_by, n_elements, count, bytes;
    uint32_t *question; /* [n_by], kinds, and [n_elements] */
    float *values;      /* [count] */
    uint64_t used;
} kept_matrix;

struct matrix_cache {
    pthread_mutex_t lock;
    memory_ledger *ledger;
    uint64_t uses;
    size_t bytes;
    kept_matrix kept[MATRICES_KEPT];
};

lam_status matrix_cache_create(memory_ledger *ledger, matrix_cache **out, lam_error *error) {
    matrix_cache *made = memory_allocate(1, sizeof *made, "matrices of derivatives", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    pthread_mutex_init(&made->lock, NULL);
    made->ledger = ledger;
    *out = made;
    return LAM_OK;
}

/* The caller holds the lock, here and below. */
static void drop(matrix_cache *c, kept_matrix *m) {
    if (m->values == NULL) return;
    memory_ledger_give_back(c->ledger, m->bytes);
    c->bytes -= m->bytes;
    free(m->question);
    free(m->values);
    *m = (kept_matrix){.values = NULL};
}

static bool answers(const kept_matrix *m, const matrix_question *asked, size_t count) {
    if (m->values == NULL || m->quantity != asked->quantity || m->n_by != asked->n_by ||
        m->n_elements != asked->n_elements || m->count != count)
        return false;
    for (size_t k = 0; k < m->n_by; k++)
        if (m->question[k] != (uint32_t)asked->by[k]) return false;
    return memcmp(m->question + m->n_by, asked->elements, m->n_elements * sizeof *m->question) == 0;
}

static kept_matrix *find(matrix_cache *c, const matrix_question *asked, size_t count) {
    for (size_t k = 0; k < MATRICES_KEPT; k++)
        if (answers(&c->kept[k], asked, count)) return &c->kept[k];
    return NULL;
}

/* A place that is free, or the one used longest ago. */
static kept_matrix *oldest(matrix_cache *c) {
    kept_matrix *found = &c->kept[0];
    for (size_t k = 0; k < MATRICES_KEPT; k++) {
        if (c->kept[k].values == NULL) return &c->kept[k];
        if (c->kept[k].used < found->used) found = &c->kept[k];
    }
    return found;
}

/* The place used longest ago among those that are taken; NULL: all are free. */
static kept_matrix *oldest_taken(matrix_cache *c) {
    kept_matrix *found = NULL;
    for (size_t k = 0; k < MATRICES_KEPT; k++)
        if (c->kept[k].values != NULL && (found == NULL || c->kept[k].used < found->used))
            found = &c->kept[k];
    return found;
}

/* Takes bytes of the ledger for one more matrix, in place of others where it has no room. */
static bool take_room(matrix_cache *c, size_t bytes) {
    kept_matrix *gone;
    while (c->bytes + bytes > MATRIX_BYTES && (gone = oldest_taken(c)) != NULL) drop(c, gone);
    while (!memory_ledger_take(c->ledger, bytes)) {
        gone = oldest_taken(c);
        if (gone == NULL) return false;
        drop(c, gone);
    }
    return true;
}

static void put(matrix_cache *c, const matrix_question *asked, size_t count, const float *values,
                size_t bytes) {
    kept_matrix made = {.quantity = asked->quantity,
                        .n_by = asked->n_by,
                        .n_elements = asked->n_elements,
                        .count = count,
                        .bytes = bytes,
                        .used = ++c->uses};
    made.question = memory_allocate(asked->n_by + asked->n_elements, sizeof *made.question, "a matrix", NULL);
    made.values = memory_allocate(count, sizeof *made.values, "a matrix", NULL);
    if (made.question == NULL || made.values == NULL || !take_room(c, bytes)) {
        free(made.question);
        free(made.values);
        return;
    }
    for (size_t k = 0; k < asked->n_by; k++) made.question[k] = (uint32_t)asked->by[k];
    memcpy(made.question + asked->n_by, asked->elements, asked->n_elements * sizeof *made.question);
    memcpy(made.values, values, count * sizeof *values);
    kept_matrix *to = oldest(c);
    drop(c, to);
    *to = made;
    c->bytes += bytes;
}

bool matrix_cache_find(matrix_cache *c, const matrix_question *asked, size_t count, float *values) {
    if (c == NULL) return false;
    pthread_mutex_lock(&c->lock);
    kept_matrix *found = find(c, asked, count);
    if (found != NULL) {
        found->used = ++c->uses;
        memcpy(values, found->values, count * sizeof *values);
    }
    pthread_mutex_unlock(&c->lock);
    return found != NULL;
}

void matrix_cache_put(matrix_cache *c, const matrix_question *asked, size_t count, const float *values) {
    const size_t bytes = count * sizeof *values + (asked->n_by + asked->n_elements) * sizeof *asked->elements;
    if (c == NULL || count == 0 || bytes > MATRIX_BYTES) return;
    pthread_mutex_lock(&c->lock);
    if (find(c, asked, count) == NULL) put(c, asked, count, values, bytes);
    pthread_mutex_unlock(&c->lock);
}

void matrix_cache_clear(matrix_cache *c) {
    if (c == NULL) return;
    pthread_mutex_lock(&c->lock);
    for (size_t k = 0; k < MATRICES_KEPT; k++) drop(c, &c->kept[k]);
    pthread_mutex_unlock(&c->lock);
}

size_t matrix_cache_held(matrix_cache *c) {
    if (c == NULL) return 0;
    pthread_mutex_lock(&c->lock);
    const size_t held = c->bytes;
    pthread_mutex_unlock(&c->lock);
    return held;
}

void matrix_cache_destroy(matrix_cache *c) {
    if (c == NULL) return;
    matrix_cache_clear(c);
    pthread_mutex_destroy(&c->lock);
    free(c);
}
