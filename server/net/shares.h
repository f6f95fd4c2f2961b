/* The shares of clients in something that they take from all together: bytes, connections. Clients that meet
 * in a place of the table count as one; their keys are hashes that nobody can choose (server/net/peer.h).
 *
 * A client may have SHARES_FREE times as much as is then free (dynamic thresholds: Choudhury and Hahne 1998),
 * so three quarters where it is alone, and three sevenths where another one has as much. Some is always left
 * for a client that comes later. */
#ifndef LAMBERT_SERVER_NET_SHARES_H
#define LAMBERT_SERVER_NET_SHARES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { SHARES_CLIENTS = 256, SHARES_FREE = 3 };

/* The caller locks. */
typedef struct shares {
    size_t room, taken;
    size_t of[SHARES_CLIENTS]; /* of taken, by client */
} shares;

static inline size_t shares_place(uint64_t key) {
    return (size_t)(key * UINT64_C(0x9E3779B97F4A7C15) >> 56);
}

/* The bytes, or connections, that a client has. */
static inline size_t shares_of(const shares *s, uint64_t key) {
    return s->of[shares_place(key)];
}

static inline void shares_add(shares *s, uint64_t key, size_t count) {
    s->taken += count;
    s->of[shares_place(key)] += count;
}

static inline void shares_subtract(shares *s, uint64_t key, size_t count) {
    s->taken -= count;
    s->of[shares_place(key)] -= count;
}

/* The most that a client may have. */
static inline size_t shares_most(const shares *s) {
    return s->room / (SHARES_FREE + 1) * SHARES_FREE;
}

/* True if so much more is free, and within the client's share. */
static inline bool shares_allow(const shares *s, uint64_t key, size_t more) {
    if (s->taken > s->room || more > s->room - s->taken) return false;
    return (shares_of(s, key) + more) / SHARES_FREE <= s->room - s->taken - more;
}

#endif
