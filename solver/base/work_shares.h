/* Shares pieces of work among the threads of a team by where their data are: a thread begins with the same
 * part of them at every call, which its caches still hold, and then takes those that others have left. The
 * result must not depend on the thread that does a piece. */
#ifndef LAMBERT_BASE_WORK_SHARES_H
#define LAMBERT_BASE_WORK_SHARES_H

#include <stdbool.h>
#include <stddef.h>

/* Parts, at most; bytes from one part's counter to the next, a line of the cache. */
enum { WORK_PARTS = 64, WORK_PART_BYTES = 64 };

/* Part p of n_parts begins at count p / n_parts; its first piece that is not taken is next. */
typedef struct work_part {
    _Alignas(WORK_PART_BYTES) size_t next;
} work_part;

typedef struct work_shares {
    size_t count, at_once, n_parts;
    work_part parts[WORK_PARTS];
} work_shares;

static inline size_t work_part_begin(const work_shares *s, size_t part) {
    return s->count / s->n_parts * part + s->count % s->n_parts * part / s->n_parts;
}

/* Pieces 0 to count - 1, of which a thread takes at_once at a time, for n_threads threads. */
static inline void work_shares_begin(work_shares *s, size_t count, size_t at_once, size_t n_threads) {
    s->count = count;
    s->at_once = at_once;
    s->n_parts = n_threads == 0 ? 1 : n_threads < WORK_PARTS ? n_threads : WORK_PARTS;
    for (size_t p = 0; p < s->n_parts; p++) s->parts[p].next = work_part_begin(s, p);
}

/* The pieces that a thread takes next, *first to *last - 1; false: all are taken. *tried: parts that the
 * thread has found taken, 0 at first. Any number of threads call it at a time, of any numbers `thread`. */
static inline bool work_shares_take(work_shares *s, size_t thread, size_t *tried, size_t *first,
                                    size_t *last) {
    for (; *tried < s->n_parts; ++*tried) {
        const size_t p = (thread + *tried) % s->n_parts, end = work_part_begin(s, p + 1);
        *first = __atomic_fetch_add(&s->parts[p].next, s->at_once, __ATOMIC_RELAXED);
        if (*first >= end) continue;
        *last = end - *first < s->at_once ? end : *first + s->at_once;
        return true;
    }
    return false;
}

#endif
