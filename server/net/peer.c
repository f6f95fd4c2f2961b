/* The fields Forwarded (RFC 7239) and X-Forwarded-For are read as lists of hops; the last hop that is no
 * trusted proxy is the client. Its key is SipHash-2-4 (Aumasson and Bernstein 2012), under a random seed, of
 * the IPv4 address, of the first 64 bits of an IPv6 address, or of the name that a proxy gave. */
#include "server/net/peer.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/random.h>
#include <time.h>

/* Proxies behind each other, at most; of a longer list the last ones count. */
#define MOST_HOPS 32

/* Bytes of a made-up name (RFC 7239, 6.3) that are kept. */
#define NAME_MOST 63

static const unsigned char mapped[12] = {[10] = 0xff, [11] = 0xff};

static uint64_t rotate(uint64_t x, int bits) {
    return x << bits | x >> (64 - bits);
}

static void sip_rounds(uint64_t v[4], int count) {
    while (count-- > 0) {
        v[0] += v[1];
        v[2] += v[3];
        v[1] = rotate(v[1], 13) ^ v[0];
        v[3] = rotate(v[3], 16) ^ v[2];
        v[0] = rotate(v[0], 32);
        v[2] += v[1];
        v[0] += v[3];
        v[1] = rotate(v[1], 17) ^ v[2];
        v[3] = rotate(v[3], 21) ^ v[0];
        v[2] = rotate(v[2], 32);
    }
}

uint64_t peer_hash(const uint64_t seed[2], const unsigned char *bytes, size_t length) {
    /* The constants are "somepseudorandomlygeneratedbytes" (section 2.1). */
    uint64_t v[4] = {seed[0] ^ 0x736f6d6570736575u, seed[1] ^ 0x646f72616e646f6du,
                     seed[0] ^ 0x6c7967656e657261u, seed[1] ^ 0x7465646279746573u};
    uint64_t word = 0;
    for (size_t i = 0; i < length; i++) {
        word |= (uint64_t)bytes[i] << 8 * (i % 8);
        if (i % 8 != 7) continue;
        v[3] ^= word;
        sip_rounds(v, 2);
        v[0] ^= word;
        word = 0;
    }
    word |= (uint64_t)length << 56;
    v[3] ^= word;
    sip_rounds(v, 2);
    v[0] ^= word;
    v[2] ^= 0xff;
    sip_rounds(v, 4);
    return v[0] ^ v[1] ^ v[2] ^ v[3];
}

/* True if the text, without brackets, is an address. */
static bool read_address(const char *text, size_t length, peer_address *out) {
    char copy[INET6_ADDRSTRLEN];
    *out = (peer_address){.is_unix = false};
    if (length >= sizeof copy) return false;
    memcpy(copy, text, length);
    copy[length] = '\0';
    if (strlen(copy) != length) return false;
    if (inet_pton(AF_INET6, copy, out->bytes) == 1) return true;
    memcpy(out->bytes, mapped, sizeof mapped);
    return inet_pton(AF_INET, copy, out->bytes + sizeof mapped) == 1;
}

static bool is_mapped(const peer_address *a) {
    return memcmp(a->bytes, mapped, sizeof mapped) == 0;
}

lam_status peer_rules_read(const option_list *proxies, peer_rules *rules, lam_error *error) {
    lam_status status = LAM_OK;
    struct timespec now;
    *rules = (peer_rules){.n_trusted = 0};
    if (getrandom(rules->seed, sizeof rules->seed, GRND_NONBLOCK) != (ssize_t)sizeof rules->seed) {
        clock_gettime(CLOCK_REALTIME, &now);
        rules->seed[0] = (uint64_t)now.tv_nsec;
        rules->seed[1] = (uint64_t)(uintptr_t)rules;
    }
    for (size_t i = 0; i < proxies->count; i++) {
        const char *text = proxies->items[i], *slash = strchr(text, '/');
        struct peer_network one = {.bits = 128};
        uint64_t bits = 0;
        if (i == sizeof rules->trusted / sizeof rules->trusted[0])
            FAIL(error, LAM_ERR_ARGUMENT, "--trusted-proxy %s: given more than %zu times", text, i);
        if (strcmp(text, "unix") == 0)
            one.address.is_unix = true;
        else if (!read_address(text, slash == NULL ? strlen(text) : (size_t)(slash - text), &one.address))
            FAIL(error, LAM_ERR_ARGUMENT, "--trusted-proxy %s: must be an address, ADDRESS/BITS or unix",
                 text);
        if (slash != NULL) {
            const unsigned most = is_mapped(&one.address) ? 32 : 128;
            TRY(option_count("--trusted-proxy", slash + 1, &bits, error));
            if (bits > most)
                FAIL(error, LAM_ERR_ARGUMENT, "--trusted-proxy %s: the prefix must have 0 to %u bits", text,
                     most);
            one.bits = (unsigned)bits + 128 - most;
        }
        rules->trusted[rules->n_trusted++] = one;
    }
done:
    return status;
}

static bool is_trusted(const peer_rules *rules, const peer_address *a) {
    for (size_t i = 0; i < rules->n_trusted; i++) {
        const struct peer_network *one = &rules->trusted[i];
        const size_t whole = one->bits / 8, rest = one->bits % 8;
        if (one->address.is_unix != a->is_unix) continue;
        if (memcmp(one->address.bytes, a->bytes, whole) != 0) continue;
        if (rest == 0 || (one->address.bytes[whole] ^ a->bytes[whole]) >> (8 - rest) == 0) return true;
    }
    return false;
}

void peer_add_field(peer_fields *fields, const char *name, size_t name_size, const char *value,
                    size_t value_size) {
    static const char forwarded[] = "Forwarded", other[] = "X-Forwarded-For";
    const bool first = name_size == sizeof forwarded - 1 && strncasecmp(name, forwarded, name_size) == 0;
    if (!first && (name_size != sizeof other - 1 || strncasecmp(name, other, name_size) != 0)) return;
    struct peer_field *list = first ? fields->forwarded : fields->x_forwarded_for;
    size_t *count = first ? &fields->n_forwarded : &fields->n_x_forwarded_for;
    const size_t most = sizeof fields->forwarded / sizeof fields->forwarded[0];
    if (*count < most)
        list[*count] = (struct peer_field){value == NULL ? "" : value, value == NULL ? 0 : value_size};
    if (*count <= most) (*count)++;
}

/* A client as a proxy names it: an address, or a name that it made up. */
typedef struct hop {
    enum { HOP_UNKNOWN, HOP_ADDRESS, HOP_NAME } kind;
    peer_address address;
    char name[NAME_MOST + 1];
} hop;

/* The last hops of a list. */
typedef struct hops {
    hop ring[MOST_HOPS];
    size_t count; /* of all, also those that were pushed out */
} hops;

static bool is_port(const char *text, size_t length) {
    if (length < 2 || length > 6 || text[0] != ':') return false;
    for (size_t i = 1; i < length; i++)
        if (text[i] < '0' || text[i] > '9') return false;
    return true;
}

/* A node (RFC 7239, 6): an address with or without brackets and port, a made-up name, or "unknown". False for
 * anything else. */
static bool read_node(const char *text, size_t length, hop *out) {
    static const char letters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-";
    *out = (hop){.kind = HOP_ADDRESS};
    if (length > 0 && text[0] == '[') {
        const char *end = memchr(text, ']', length);
        if (end == NULL) return false;
        const size_t inside = (size_t)(end - text) - 1, after = length - inside - 2;
        return memchr(text, ':', inside) != NULL && (after == 0 || is_port(end + 1, after)) &&
               read_address(text + 1, inside, &out->address);
    }
    if (read_address(text, length, &out->address)) return true;
    const char *colon = memchr(text, ':', length);
    if (colon != NULL) {
        if (!is_port(colon, length - (size_t)(colon - text))) return false;
        length = (size_t)(colon - text);
        if (read_address(text, length, &out->address)) return true;
    }
    if (length == 7 && strncasecmp(text, "unknown", 7) == 0) {
        out->kind = HOP_UNKNOWN;
        return true;
    }
    if (length < 2 || length > NAME_MOST || text[0] != '_') return false;
    for (size_t i = 0; i < length; i++)
        if (text[i] == '\0' || strchr(letters, text[i]) == NULL) return false;
    out->kind = HOP_NAME;
    memcpy(out->name, text, length);
    return true;
}

static void push(hops *all, const hop *one) {
    all->ring[all->count++ % MOST_HOPS] = *one;
}

static bool is_space(char c) {
    return c == ' ' || c == '\t';
}

/* X-Forwarded-For: nodes between commas. Empty ones are passed over, as in every list of HTTP. */
static bool read_list(const struct peer_field *field, hops *all) {
    const char *at = field->text, *end = at + field->length;
    while (at < end) {
        const char *comma = memchr(at, ',', (size_t)(end - at)), *stop = comma == NULL ? end : comma;
        const char *last = stop;
        hop one;
        while (at < last && is_space(*at)) at++;
        while (last > at && is_space(last[-1])) last--;
        if (last > at) {
            if (!read_node(at, (size_t)(last - at), &one)) return false;
            push(all, &one);
        }
        at = comma == NULL ? end : comma + 1;
    }
    return true;
}

/* The value of a pair, with or without quotes: its text without escapes in copy. Returns the byte behind it,
 * or NULL where it has no end or is longer than any node. */
static const char *read_value(const char *at, const char *end, char copy[80], size_t *length) {
    *length = 0;
    if (at < end && *at == '"') {
        for (at++; at < end && *at != '"'; at++) {
            if (*at == '\\') at++;
            if (at == end) return NULL;
            if (*length < 79) copy[(*length)++] = *at;
        }
        if (at == end) return NULL;
        at++;
    } else {
        for (; at < end && strchr(",; \t", *at) == NULL; at++)
            if (*length < 79) copy[(*length)++] = *at;
    }
    copy[*length] = '\0';
    return at;
}

/* Forwarded: elements between commas, of pairs between semicolons; an element without "for" names nobody. */
static bool read_elements(const struct peer_field *field, hops *all) {
    const char *at = field->text, *end = at + field->length;
    while (at < end) {
        hop one = {.kind = HOP_UNKNOWN};
        bool named = false, any = false;
        for (;;) {
            while (at < end && (is_space(*at) || *at == ';')) at++;
            if (at == end || *at == ',') break;
            const char *name = at;
            char value[80];
            size_t length;
            while (at < end && strchr("=,; \t\"", *at) == NULL) at++;
            const size_t name_length = (size_t)(at - name);
            if (at == end || *at != '=' || (at = read_value(at + 1, end, value, &length)) == NULL)
                return false;
            any = true;
            if (name_length != 3 || strncasecmp(name, "for", 3) != 0) continue;
            if (named || !read_node(value, length, &one)) return false;
            named = true;
        }
        if (any) push(all, &one);
        if (at < end) at++;
    }
    return true;
}

/* The client that a list of hops names, seen from the socket: the last that is no trusted proxy. */
static hop choose(const peer_rules *rules, const peer_address *from, const hops *all) {
    hop found = {.kind = HOP_ADDRESS, .address = *from};
    const size_t kept = all->count < MOST_HOPS ? all->count : MOST_HOPS;
    for (size_t i = 0; i < kept && found.kind == HOP_ADDRESS && is_trusted(rules, &found.address); i++) {
        const hop *next = &all->ring[(all->count - 1 - i) % MOST_HOPS];
        if (next->kind == HOP_UNKNOWN) break;
        found = *next;
    }
    return found;
}

static bool is_same(const hop *a, const hop *b) {
    return a->kind == b->kind && a->address.is_unix == b->address.is_unix &&
           memcmp(a->address.bytes, b->address.bytes, sizeof a->address.bytes) == 0 &&
           strcmp(a->name, b->name) == 0;
}

static void name_peer(const peer_rules *rules, const hop *who, peer *out) {
    unsigned char identity[NAME_MOST + 1] = {0};
    size_t length = 1;
    if (who->kind == HOP_NAME) {
        identity[0] = 'n';
        length += strlen(who->name);
        memcpy(identity + 1, who->name, length - 1);
        snprintf(out->text, sizeof out->text, "%s", who->name);
    } else if (who->address.is_unix) {
        identity[0] = 'u';
        strcpy(out->text, "unix");
    } else {
        const bool old = is_mapped(&who->address);
        identity[0] = old ? '4' : '6';
        length += old ? 4 : 8;
        memcpy(identity + 1, who->address.bytes + (old ? 12 : 0), length - 1);
        (void)inet_ntop(old ? AF_INET : AF_INET6, who->address.bytes + (old ? 12 : 0), out->text,
                        sizeof out->text);
    }
    out->key = peer_hash(rules->seed, identity, length);
}

static void read_socket(const struct sockaddr *from, peer_address *out) {
    *out = (peer_address){.is_unix = false};
    if (from != NULL && from->sa_family == AF_INET) {
        const struct sockaddr_in *four = (const struct sockaddr_in *)(const void *)from;
        memcpy(out->bytes, mapped, sizeof mapped);
        memcpy(out->bytes + sizeof mapped, &four->sin_addr, 4);
    } else if (from != NULL && from->sa_family == AF_INET6) {
        const struct sockaddr_in6 *six = (const struct sockaddr_in6 *)(const void *)from;
        memcpy(out->bytes, &six->sin6_addr, 16);
    } else {
        out->is_unix = true;
    }
}

/* The client that one of the two kinds of fields names; false where they cannot be read. */
static bool read_fields(const peer_rules *rules, const peer_address *from, const struct peer_field *fields,
                        size_t count, bool (*read)(const struct peer_field *, hops *), hop *found) {
    hops all = {.count = 0};
    if (count > 8) return false;
    for (size_t i = 0; i < count; i++)
        if (!read(&fields[i], &all)) return false;
    *found = choose(rules, from, &all);
    return true;
}

void peer_find(const peer_rules *rules, const struct sockaddr *from, const peer_fields *fields, peer *out) {
    hop who = {.kind = HOP_ADDRESS}, first, second;
    read_socket(from, &who.address);
    if (rules->n_trusted > 0 && fields->n_forwarded + fields->n_x_forwarded_for > 0 &&
        is_trusted(rules, &who.address)) {
        const bool good =
            read_fields(rules, &who.address, fields->forwarded, fields->n_forwarded, read_elements, &first) &&
            read_fields(rules, &who.address, fields->x_forwarded_for, fields->n_x_forwarded_for, read_list,
                        &second);
        if (good && fields->n_forwarded == 0)
            who = second;
        else if (good && (fields->n_x_forwarded_for == 0 || is_same(&first, &second)))
            who = first;
    }
    name_peer(rules, &who, out);
}

bool peer_is_proxy(const peer_rules *rules, const struct sockaddr *from) {
    peer_address address;
    read_socket(from, &address);
    return is_trusted(rules, &address);
}
