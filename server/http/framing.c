#include "server/http/framing.h"

#include <string.h>
#include <strings.h>

/* A byte of a token (RFC 9110, 5.6.2). */
static bool is_token_byte(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           (c != '\0' && strchr("!#$%&'*+-.^_`|~", c) != NULL);
}

/* A byte that no value may hold (RFC 9110, 5.5): a control character but for the tab. */
static bool is_control(char c) {
    const unsigned char byte = (unsigned char)c;
    return (byte < 0x20 && byte != '\t') || byte == 0x7f;
}

static bool is_named(const char *name, size_t size, const char *wanted) {
    return size == strlen(wanted) && strncasecmp(name, wanted, size) == 0;
}

/* libmicrohttpd 0.9.75 appends a line that begins with white space to the name of the field before it, not to
 * the value: "Content-Length: 1" and " 2" come as Content-Length2. */
static bool is_continued(const char *name, size_t size, const char *wanted) {
    const size_t length = strlen(wanted);
    return size > length && strncasecmp(name, wanted, length) == 0;
}

static void check_field(problem *first, const char *name, size_t name_size, const char *value,
                        size_t value_size) {
    size_t good = 0;
    if (first->status != 0) return;
    while (good < name_size && is_token_byte(name[good])) good++;
    if (good < name_size || name_size == 0) {
        problem_set(first, PROBLEM_MALFORMED_HEAD,
                    "the name of a header field after \"%.*s\" has a byte 0x%02x, must be a token",
                    good < 40 ? (int)good : 40, name, name_size == 0 ? ':' : (unsigned char)name[good]);
        return;
    }
    for (size_t i = 0; i < value_size; i++) {
        if (!is_control(value[i])) continue;
        problem_set(first, PROBLEM_MALFORMED_HEAD, "%.*s has the control character 0x%02x",
                    name_size < 40 ? (int)name_size : 40, name, (unsigned char)value[i]);
        return;
    }
}

void framing_add(framing *f, const char *name, size_t name_size, const char *value, size_t value_size) {
    if (value == NULL) value_size = 0;
    check_field(&f->first, name, name_size, value, value_size);
    f->continued = f->continued || is_continued(name, name_size, "Content-Length") ||
                   is_continued(name, name_size, "Transfer-Encoding");
    if (is_named(name, name_size, "Host")) {
        f->n_hosts++;
    } else if (is_named(name, name_size, "Content-Length")) {
        f->n_lengths++;
    } else if (is_named(name, name_size, "Transfer-Encoding")) {
        f->n_codings++;
        /* Only a value that libmicrohttpd takes for chunked, too: it knows none with white space behind it.
         */
        f->other_coding = f->other_coding || value == NULL || !is_named(value, value_size, "chunked");
    }
}

bool framing_check(const framing *f, const char *version, problem *why) {
    const bool old = strcmp(version, "HTTP/1.0") == 0;
    *why = f->first;
    if (why->status != 0) return false;
    if (f->n_hosts > 1)
        return problem_set(why, PROBLEM_MALFORMED_HEAD, "there are %u Host fields", f->n_hosts);
    if (f->n_hosts == 0 && !old) return problem_set(why, PROBLEM_MALFORMED_HEAD, "Host is missing");
    if (f->n_lengths > 1)
        return problem_set(why, PROBLEM_MALFORMED_HEAD, "there are %u Content-Length fields", f->n_lengths);
    if (f->continued)
        return problem_set(why, PROBLEM_MALFORMED_HEAD,
                           "the field with the length or the coding of the body must be one line");
    if (f->n_codings > 1)
        return problem_set(why, PROBLEM_MALFORMED_HEAD, "there are %u Transfer-Encoding fields",
                           f->n_codings);
    if (f->n_codings > 0 && f->n_lengths > 0)
        return problem_set(why, PROBLEM_MALFORMED_HEAD,
                           "Content-Length and Transfer-Encoding exclude each other");
    if (f->n_codings > 0 && old)
        return problem_set(why, PROBLEM_MALFORMED_HEAD, "HTTP/1.0 has no Transfer-Encoding");
    if (f->other_coding)
        return problem_set(why, PROBLEM_TRANSFER_CODING, "Transfer-Encoding must be chunked or left out");
    return true;
}

/* The bytes of the scheme of an absolute target, http:// or https://; 0 for others. */
static size_t scheme_length(const char *target) {
    static const char *const schemes[] = {"http://", "https://"};
    for (size_t i = 0; i < sizeof schemes / sizeof schemes[0]; i++)
        if (strncasecmp(target, schemes[i], strlen(schemes[i])) == 0) return strlen(schemes[i]);
    return 0;
}

const char *framing_path(const char *target) {
    const char *host = target + scheme_length(target), *path = host + strcspn(host, "/");
    /* A target without host is invalid (RFC 9110, 4.2.1), and no route has its name. */
    if (host == target || path == host) return target;
    return *path == '\0' ? "/" : path;
}

void framing_host(const char *target, const char **host, size_t *length) {
    const size_t scheme = scheme_length(target), count = strcspn(target + scheme, "/");
    if (scheme == 0 || count == 0) return;
    *host = target + scheme;
    *length = count;
}
