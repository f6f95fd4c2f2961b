/* The peer that asks: the address of a client, for the access log and for shares. It is the address of the
 * socket or, where that belongs to a trusted proxy, the one that the proxy states in Forwarded (RFC 7239) or
 * X-Forwarded-For. Knows no HTTP library. */
#ifndef LAMBERT_SERVER_NET_PEER_H
#define LAMBERT_SERVER_NET_PEER_H

#include "solver/base/options/options.h"

#include <sys/socket.h>

/* A client. Equal keys mean one client: an IPv4 address (an IPv4-mapped one counts as IPv4), the /64 of an
 * IPv6 address, all of a Unix socket, or the name that a trusted proxy made up ("_hidden"). */
typedef struct peer {
    char text[64]; /* the whole address, "unix", or the name */
    uint64_t key;  /* a hash with a random seed, so that nobody can choose addresses that share a key */
} peer;

typedef struct peer_address {
    unsigned char bytes[16]; /* IPv4 as ::ffff:a.b.c.d */
    bool is_unix;
} peer_address;

/* The proxies that are believed, and the seed of the keys. */
typedef struct peer_rules {
    struct peer_network {
        peer_address address;
        unsigned bits; /* of the prefix, of 128 */
    } trusted[64];
    size_t n_trusted;
    uint64_t seed[2];
} peer_rules;

/* Reads ADDRESS, ADDRESS/BITS or "unix" for each proxy. Errors: LAM_ERR_ARGUMENT, which names the text. */
lam_status peer_rules_read(const option_list *proxies, peer_rules *rules, lam_error *error);

/* The fields of a head that may name a client, in their order; zero at the start. Texts are those of the
 * head. */
typedef struct peer_fields {
    struct peer_field {
        const char *text;
        size_t length;
    } forwarded[8], x_forwarded_for[8];
    size_t n_forwarded, n_x_forwarded_for; /* more than 8: too many, none is believed */
} peer_fields;

/* Takes the next field of the head; others than the two are passed over. */
void peer_add_field(peer_fields *fields, const char *name, size_t name_size, const char *value,
                    size_t value_size);

/* The client behind a socket with the address `from` (NULL: a Unix socket). Of what the fields state, the
 * last address that is not a trusted proxy's is the client's. Where both fields are given and disagree, or
 * one of them cannot be read, a client could have written it: the peer is then the proxy itself. O(bytes of
 * the fields), and without a trusted proxy O(1). */
void peer_find(const peer_rules *rules, const struct sockaddr *from, const peer_fields *fields, peer *out);

/* True if the socket with this address is that of a trusted proxy. */
bool peer_is_proxy(const peer_rules *rules, const struct sockaddr *from);

/* SipHash-2-4 of bytes under a key of 128 bits (Aumasson and Bernstein 2012). O(length). */
uint64_t peer_hash(const uint64_t seed[2], const unsigned char *bytes, size_t length);

#endif
