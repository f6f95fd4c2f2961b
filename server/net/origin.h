/* Names under which the daemon may be asked, and pages that may ask it. A page whose name is made to resolve
 * to this machine (DNS rebinding) has the daemon's origin for its browser, and only the Host of its requests
 * tells it from the daemon's own pages. Knows no HTTP library. */
#ifndef LAMBERT_SERVER_NET_ORIGIN_H
#define LAMBERT_SERVER_NET_ORIGIN_H

#include "solver/base/options/options.h"

typedef struct origin_rules {
    const option_list *hosts, *origins; /* --allow-host, --allow-origin */
    char asked[256], bound[64];         /* the host of --listen as written and as bound; "" with --unix */
    bool any_host;                      /* a wildcard address or a Unix socket without --allow-host */
    bool any_literal;                   /* a wildcard address: any address may be one of this machine */
    bool is_local;                      /* loopback or a Unix socket */
} origin_rules;

/* Rules of a daemon that listens on address (NULL: a Unix socket) and is bound to the URL `where`. The lists
 * outlive the rules. Errors: LAM_ERR_ARGUMENT for a --allow-host that is no name or address without port, and
 * a
 * --allow-origin that is not SCHEME://HOST[:PORT]. */
lam_status origin_rules_read(const option_list *hosts, const option_list *origins, const char *address,
                             const char *where, origin_rules *rules, lam_error *error);

/* True if an authority HOST[:PORT] of `length` bytes may be asked for: localhost, 127.0.0.1 and [::1] always,
 * the host of --listen, those of --allow-host; any address in digits on a wildcard address, as no name can be
 * made to resolve to anything else for its page. Ports are not compared. Any, also an empty one, where
 * any_host says so. */
bool origin_host_allowed(const origin_rules *rules, const char *authority, size_t length);

/* The item of --allow-origin that equals an Origin field; NULL if none does. */
const char *origin_listed(const origin_rules *rules, const char *origin);

/* True if an Origin field names the authority itself: the request comes from a page of the daemon. The scheme
 * is not compared, as a proxy may end TLS. */
bool origin_is_own(const char *origin, const char *authority, size_t length);

#endif
