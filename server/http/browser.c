#include "server/http/browser.h"

#include "server/http/framing.h"

#include <string.h>

/* Fields of requests that a page may set, and those of answers that it may read, beside the usual ones. */
#define ASKED "Accept, Authorization, Content-Type, If-None-Match, Lambert-Timeout, X-Request-Id"
#define SHOWN                                                                                                \
    "ETag, Lambert-Certificate, Lambert-Converted-By, Lambert-Iterations, Lambert-Limited, Lambert-Scene, "  \
    "Lambert-Unit, "                                                                                         \
    "Location, Retry-After, Server-Timing, "                                                                 \
    "X-Request-Id"

/* Seconds that a browser may keep the answer to a preflight. */
#define PREFLIGHT_AGE "600"

/* A page of another origin may neither read nor write, unless it is listed. A browser leaves Origin out where
 * the page does not ask for an answer it could read; then Sec-Fetch-Site tells. That field, which no page can
 * write, also tells the daemon's own page behind a proxy that puts another Host in place of the one asked
 * for. */
static bool check_origin(request *r, const char *authority, size_t length) {
    const char *origin = http_header(r, MHD_HTTP_HEADER_ORIGIN), *site = http_header(r, "Sec-Fetch-Site");
    r->origin = origin != NULL ? origin_listed(&r->service->origins, origin) : NULL;
    if (r->origin != NULL) return true;
    const bool is_own = site != NULL && strcasecmp(site, "same-origin") == 0;
    if (origin != NULL && !is_own && !origin_is_own(origin, authority, length)) {
        answer_refuse(&r->answer, PROBLEM_WRONG_ORIGIN,
                      "pages of %.100s may not ask this daemon; --allow-origin %.100s would let them", origin,
                      origin);
        return false;
    }
    if (!r->match.with_token || site == NULL ||
        (strcasecmp(site, "cross-site") != 0 && strcasecmp(site, "same-site") != 0))
        return true;
    answer_refuse(&r->answer, PROBLEM_WRONG_ORIGIN,
                  "a page of another origin (Sec-Fetch-Site is %.20s) may not ask this daemon", site);
    return false;
}

bool browser_check(request *r, const char *target) {
    const char *host = http_header(r, MHD_HTTP_HEADER_HOST), *authority = host;
    size_t length = host != NULL ? strlen(host) : 0;
    if (r->match.any_host) return true;
    /* The host of an absolute target goes before that of the field (RFC 9112, 3.2.2). */
    framing_host(target, &authority, &length);
    if (authority != NULL && !origin_host_allowed(&r->service->origins, authority, length)) {
        answer_refuse(&r->answer, PROBLEM_WRONG_HOST,
                      "the host is %.*s, must be localhost, the address of --listen or one of --allow-host",
                      length < 100 ? (int)length : 100, authority);
        return false;
    }
    if (!check_origin(r, authority, length)) return false;
    if (r->origin == NULL || strcmp(r->method, "OPTIONS") != 0 || r->answer.allow[0] == '\0' ||
        http_header(r, "Access-Control-Request-Method") == NULL)
        return true;
    buffer_free(&r->answer.body);
    r->answer.status = 204;
    r->answer.type = NULL;
    r->preflight = true;
    return false;
}

bool browser_add_headers(const request *r, struct MHD_Response *response) {
    bool good = http_add_header(response, "X-Content-Type-Options", "nosniff") &&
                http_add_header(response, "Cross-Origin-Resource-Policy", "same-origin");
    if (r->service->origins.origins->count > 0)
        good = good && http_add_header(response, MHD_HTTP_HEADER_VARY, "Origin");
    if (r->origin == NULL) return good;
    good = good && http_add_header(response, MHD_HTTP_HEADER_ACCESS_CONTROL_ALLOW_ORIGIN, r->origin);
    if (!r->preflight)
        return good && http_add_header(response, "Access-Control-Expose-Headers", SHOWN) &&
               http_add_header(response, "Timing-Allow-Origin", r->origin);
    return good && http_add_header(response, "Access-Control-Allow-Methods", r->answer.allow) &&
           http_add_header(response, "Access-Control-Allow-Headers", ASKED) &&
           http_add_header(response, "Access-Control-Max-Age", PREFLIGHT_AGE);
}
