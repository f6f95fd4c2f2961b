/* Fields of a head that name a client, a host or a page: lines of Forwarded, X-Forwarded-For, Host and
 * Origin. */
#include "fuzz/fuzz.h"
#include "server/net/origin.h"
#include "server/net/peer.h"

#include <netinet/in.h>

/* The next line, in memory of its exact length; text has a NUL behind it instead. */
static uint8_t *next_line(const uint8_t **data, size_t *size, size_t *length, char **text) {
    const uint8_t *end = *size > 0 ? memchr(*data, '\n', *size) : NULL;
    *length = end != NULL ? (size_t)(end - *data) : *size;
    uint8_t *exact = malloc(*length > 0 ? *length : 1);
    FUZZ_CHECK(exact != NULL);
    if (*length > 0) memcpy(exact, *data, *length);
    *text = fuzz_text(*data, *length);
    const size_t taken = *length + (end != NULL);
    *data += taken;
    *size -= taken;
    return exact;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static const char *const names[] = {"Forwarded", "x-forwarded-for"};
    static const option_list proxies = {.items = {"unix", "10.0.0.0/8", "2001:db8::/32"}, .count = 3};
    static const option_list hosts = {.items = {"a.example"}, .count = 1};
    static const option_list origins = {.items = {"https://a.example"}, .count = 1};
    peer_rules rules;
    origin_rules pages;
    peer_fields fields = {.n_forwarded = 0};
    peer first, second;
    uint8_t *exact[2];
    char *unused[2], *host, *origin;
    size_t length;
    FUZZ_CHECK(peer_rules_read(&proxies, &rules, NULL) == LAM_OK);
    FUZZ_CHECK(origin_rules_read(&hosts, &origins, "0.0.0.0:1", "http://0.0.0.0:1", &pages, NULL) == LAM_OK);
    for (size_t i = 0; i < 2; i++) {
        exact[i] = next_line(&data, &size, &length, &unused[i]);
        peer_add_field(&fields, names[i], strlen(names[i]), (const char *)exact[i], length);
    }
    peer_find(&rules, NULL, &fields, &first);
    FUZZ_CHECK(memchr(first.text, '\0', sizeof first.text) != NULL && first.text[0] != '\0');
    for (const char *c = first.text; *c != '\0'; c++) FUZZ_CHECK(*c > ' ' && *c < 0x7f);
    /* A socket that is no proxy's is believed itself. */
    const struct sockaddr_in stranger = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(0xc0000207)};
    peer_find(&rules, (const struct sockaddr *)(const void *)&stranger, &fields, &second);
    FUZZ_CHECK(strcmp(second.text, "192.0.2.7") == 0);
    free(next_line(&data, &size, &length, &host));
    (void)origin_host_allowed(&pages, host, strlen(host));
    free(next_line(&data, &size, &length, &origin));
    const char *listed = origin_listed(&pages, origin);
    FUZZ_CHECK(listed == NULL || strcasecmp(listed, origin) == 0);
    if (origin_is_own(origin, host, strlen(host))) FUZZ_CHECK(strlen(origin) > strlen(host));
    for (size_t i = 0; i < 2; i++) {
        free(exact[i]);
        free(unused[i]);
    }
    free(host);
    free(origin);
    return 0;
}
