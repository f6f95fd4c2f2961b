#include "server/net/origin.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <string.h>
#include <strings.h>

/* The bytes of the host in HOST[:PORT] or [HOST][:PORT]; 0 where it is not of this form. */
static size_t host_length(const char *authority, size_t length) {
    const char *end = authority + length, *colon = NULL;
    if (length > 0 && authority[0] == '[') {
        const char *bracket = memchr(authority, ']', length);
        if (bracket == NULL || (bracket + 1 < end && bracket[1] != ':')) return 0;
        colon = bracket + 1 < end ? bracket + 1 : NULL;
    } else {
        colon = memchr(authority, ':', length);
    }
    if (colon == NULL) return length;
    for (const char *digit = colon + 1; digit < end; digit++)
        if (*digit < '0' || *digit > '9') return 0;
    return (size_t)(colon - authority);
}

static bool is_equal(const char *text, size_t length, const char *wanted) {
    return length > 0 && length == strlen(wanted) && strncasecmp(text, wanted, length) == 0;
}

/* True for an address in digits, that of IPv6 in brackets. */
static bool is_literal(const char *host, size_t length) {
    char copy[INET6_ADDRSTRLEN + 2];
    struct in6_addr six;
    struct in_addr four;
    if (length < 2 || length >= sizeof copy) return false;
    memcpy(copy, host, length);
    copy[length] = '\0';
    if (copy[0] != '[') return inet_pton(AF_INET, copy, &four) == 1;
    copy[length - 1] = '\0';
    return inet_pton(AF_INET6, copy + 1, &six) == 1;
}

/* A name or address as --allow-host has it: letters, digits, dots, hyphens, underscores, or an IPv6 address
 * in brackets. */
static bool is_name(const char *text) {
    static const char letters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-_";
    const size_t length = strlen(text);
    if (length > 0 && text[0] == '[') return is_literal(text, length);
    return length > 0 && length < 256 && strspn(text, letters) == length;
}

/* SCHEME://HOST[:PORT] as browsers write it. */
static bool is_origin(const char *text) {
    const char *authority = strstr(text, "://");
    if (authority == NULL || authority == text ||
        strspn(text, "abcdefghijklmnopqrstuvwxyz") != (size_t)(authority - text))
        return false;
    authority += 3;
    const size_t length = strlen(authority), host = host_length(authority, length);
    char copy[256];
    if (host == 0 || host >= sizeof copy || host + 1 == length) return false;
    memcpy(copy, authority, host);
    copy[host] = '\0';
    return is_name(copy);
}

/* The host between the scheme and the port of a URL, or before the port of HOST:PORT. */
static void copy_host(const char *text, char *out, size_t size) {
    const char *scheme = strstr(text, "://"), *host = scheme == NULL ? text : scheme + 3;
    const size_t length = host_length(host, strlen(host));
    if (length >= size) return;
    memcpy(out, host, length);
    out[length] = '\0';
}

lam_status origin_rules_read(const option_list *hosts, const option_list *origins, const char *address,
                             const char *where, origin_rules *rules, lam_error *error) {
    lam_status status = LAM_OK;
    *rules = (origin_rules){.hosts = hosts, .origins = origins, .is_local = address == NULL};
    /* No page of a browser reaches a Unix socket, and few clients of one have a name to write. */
    rules->any_host = address == NULL && hosts->count == 0;
    for (size_t i = 0; i < hosts->count; i++)
        if (!is_name(hosts->items[i]))
            FAIL(error, LAM_ERR_ARGUMENT, "--allow-host %s: must be a name or an address, without a port",
                 hosts->items[i]);
    for (size_t i = 0; i < origins->count; i++)
        if (!is_origin(origins->items[i]))
            FAIL(error, LAM_ERR_ARGUMENT, "--allow-origin %s: must be SCHEME://HOST or SCHEME://HOST:PORT",
                 origins->items[i]);
    if (address != NULL) {
        copy_host(address, rules->asked, sizeof rules->asked);
        copy_host(where, rules->bound, sizeof rules->bound);
        rules->any_literal = strcmp(rules->bound, "0.0.0.0") == 0 || strcmp(rules->bound, "[::]") == 0;
        rules->any_host = rules->any_literal && hosts->count == 0;
        rules->is_local = strncmp(rules->bound, "127.", 4) == 0 || strcmp(rules->bound, "[::1]") == 0;
    }
done:
    return status;
}

bool origin_host_allowed(const origin_rules *rules, const char *authority, size_t length) {
    static const char *const own[] = {"localhost", "127.0.0.1", "[::1]"};
    const size_t host = host_length(authority, length);
    if (rules->any_host) return true;
    if (host == 0) return false;
    for (size_t i = 0; i < sizeof own / sizeof own[0]; i++)
        if (is_equal(authority, host, own[i])) return true;
    if (is_equal(authority, host, rules->asked) || is_equal(authority, host, rules->bound)) return true;
    for (size_t i = 0; i < rules->hosts->count; i++)
        if (is_equal(authority, host, rules->hosts->items[i])) return true;
    return rules->any_literal && is_literal(authority, host);
}

const char *origin_listed(const origin_rules *rules, const char *origin) {
    for (size_t i = 0; i < rules->origins->count; i++)
        if (strcasecmp(origin, rules->origins->items[i]) == 0) return rules->origins->items[i];
    return NULL;
}

bool origin_is_own(const char *origin, const char *authority, size_t length) {
    const char *host = strstr(origin, "://");
    return host != NULL && length > 0 && strlen(host + 3) == length &&
           strncasecmp(host + 3, authority, length) == 0;
}
