/* Bytes of an answer that several requests and a scene share: immutable, and freed with the last reference.
 * Any thread. */
#ifndef LAMBERT_SERVER_SCENE_KEPT_BYTES_H
#define LAMBERT_SERVER_SCENE_KEPT_BYTES_H

#include "solver/codec/buffer.h"

#include <stdatomic.h>
#include <stdlib.h>

typedef struct kept_bytes {
    atomic_size_t references;
    buffer content;
    void (*give_back)(void *ledger, size_t bytes); /* of its content, when it is freed */
    void *ledger;                                  /* outlives it */
    size_t taken;
} kept_bytes;

/* Takes content over, of whose memory `taken` bytes were taken of the ledger. One reference, the caller's;
 * NULL, with nothing taken over, if memory is short. */
static inline kept_bytes *kept_bytes_create(buffer *content, void (*give_back)(void *ledger, size_t bytes),
                                            void *ledger, size_t taken) {
    kept_bytes *made = calloc(1, sizeof *made);
    if (made == NULL) return NULL;
    atomic_init(&made->references, 1);
    made->content = *content;
    made->give_back = give_back;
    made->ledger = ledger;
    made->taken = taken;
    *content = (buffer){0};
    return made;
}

/* NULL is allowed, here and below. */
static inline kept_bytes *kept_bytes_hold(kept_bytes *b) {
    if (b != NULL) atomic_fetch_add(&b->references, 1);
    return b;
}

static inline void kept_bytes_release(kept_bytes *b) {
    if (b == NULL || atomic_fetch_sub(&b->references, 1) != 1) return;
    b->give_back(b->ledger, b->taken);
    buffer_free(&b->content);
    free(b);
}

#endif
