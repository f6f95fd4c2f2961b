#include "server/route/routes.h"

#include "server/route/escapes.h"

#include <stdio.h>
#include <string.h>

/* An answer that is kept. */
#define KEPT(text) .keeps = (text), .steps = &send_kept, .shortcut = quick_kept

/* Routes of one pattern follow each other. */
static const route routes[] = {
    {.method = "GET", .pattern = "/healthz", .handle = get_healthz, .open = true, .any_host = true},
    {.method = "GET", .pattern = "/readyz", .handle = get_readyz, .open = true, .any_host = true},
    {.method = "GET", .pattern = "/metrics", .handle = get_metrics, .open = true, .right = TOKEN_METRICS},
    {.method = "GET", .pattern = "/v1/scenes", KEPT(keeps_scenes)},
    {.method = "GET", .pattern = "/v1/scenes/{name}", KEPT(keeps_scene), .also_built = true},
    {.method = "DELETE",
     .pattern = "/v1/scenes/{name}",
     .handle = delete_scene,
     .also_built = true,
     .right = TOKEN_VARY},
    {.method = "GET", .pattern = "/v1/scenes/{name}/mesh", KEPT(keeps_mesh), .with_query = true},
    {.method = "GET", .pattern = "/v1/scenes/{name}/elements", KEPT(keeps_elements), .with_query = true},
    {.method = "GET", .pattern = "/v1/scenes/{name}/groups", KEPT(keeps_groups)},
    {.method = "GET", .pattern = "/v1/scenes/{name}/sky", KEPT(keeps_sky)},
    {.method = "GET", .pattern = "/v1/scenes/{name}/luminaires", KEPT(keeps_luminaires)},
    {.method = "GET", .pattern = "/v1/scenes/{name}/sensors", KEPT(keeps_sensors)},
    {.method = "GET", .pattern = "/v1/scenes/{name}/weather", KEPT(keeps_weather)},
    {.method = "POST", .pattern = "/v1/scenes/{name}/weather", .handle = post_weather, .with_body = true},
    {.method = "POST",
     .pattern = "/v1/scenes/{name}/radiosity",
     .steps = &post_radiosity,
     .shortcut = quick_radiosity,
     .with_body = true,
     .with_query = true},
    {.method = "POST",
     .pattern = "/v1/scenes/{name}/adjoint",
     .steps = &post_adjoint,
     .with_body = true,
     .with_query = true},
    {.method = "POST", .pattern = "/v1/scenes/{name}/jacobian", .steps = &post_jacobian, .with_body = true},
    {.method = "POST", .pattern = "/v1/scenes/{name}/skies", .handle = post_skies, .with_body = true},
    {.method = "PUT",
     .pattern = "/v1/scenes/{name}/reflectance",
     .handle = put_reflectance,
     .with_body = true,
     .right = TOKEN_VARY},
    {.method = "DELETE",
     .pattern = "/v1/scenes/{name}/reflectance",
     .handle = delete_reflectance,
     .with_body = true,
     .also_built = true,
     .right = TOKEN_VARY},
    {.method = "POST", .pattern = "/v1/sun", .handle = post_sun, .with_body = true},
    {.method = "POST", .pattern = "/v1/weather", .handle = post_weather, .with_body = true},
    {.method = "GET", .pattern = "/v1/openapi.json", KEPT(keeps_openapi)},
    /* The type of a problem is a relative reference, which resolves beside the path that was asked for. */
    {.method = "GET", .pattern = "/deploy/docs/api.md", KEPT(keeps_manual), .open = true, .below_any = true},
    {.method = "GET", .pattern = "/", .handle = get_viewer_page, .open = true},
    {.method = "GET", .pattern = "/viewer.js", .handle = get_viewer_script, .open = true},
    {.method = "GET", .pattern = "/viewer.css", .handle = get_viewer_style, .open = true},
    {.method = "GET", .pattern = "/viewer.svg", .handle = get_viewer_icon, .open = true},
    {.method = "GET", .pattern = "/viewer.txt", .handle = get_viewer_licences, .open = true},
};
#define N_ROUTES (sizeof routes / sizeof routes[0])

size_t route_label_count(void) {
    return N_ROUTES + 1;
}

const char *route_label(size_t label) {
    return label < N_ROUTES ? routes[label].pattern : "other";
}

/* Resolves %XX; "" for a name that no scene can have. */
static void decode_name(const char *raw, size_t length, char name[ROUTE_NAME_MAX]) {
    size_t count = 0;
    for (size_t i = 0; i < length; i++) {
        char c = raw[i];
        if (c == '%') {
            const int byte = escape_byte(raw + i, length - i);
            c = byte < 0 ? '\0' : (char)byte;
            i += 2;
        }
        if (c == '\0' || count + 1 == ROUTE_NAME_MAX) {
            count = 0;
            break;
        }
        name[count++] = c;
    }
    name[count] = '\0';
}

/* True if a path matches a pattern; {name} is one segment, not empty. */
static bool match_path(const char *pattern, const char *path, route_match *match) {
    static const char hole[] = "{name}";
    match->has_name = false;
    for (; *pattern != '\0'; pattern++, path++) {
        if (strncmp(pattern, hole, sizeof hole - 1) != 0) {
            if (*pattern != *path) return false;
            continue;
        }
        size_t length = strcspn(path, "/");
        if (length == 0) return false;
        decode_name(path, length, match->name);
        match->has_name = true;
        pattern += sizeof hole - 2;
        path += length - 1;
    }
    return *path == '\0';
}

/* Makes the answer that names the methods. */
static void answer_options(const char *allow, answer *out) {
    *out = (answer){.status = 204};
    snprintf(out->allow, sizeof out->allow, "%s, OPTIONS", allow);
}

/* True if a path is that of a route, or ends with it where it may. */
static bool match_route(const route *to, const char *path, route_match *match) {
    const size_t length = strlen(path), end = strlen(to->pattern);
    return match_path(to->pattern, to->below_any && length > end ? path + length - end : path, match);
}

void route_find(const char *method, const char *path, route_match *match, answer *out) {
    /* HEAD is GET without the body, which the HTTP library leaves out. */
    const char *wanted = strcmp(method, "HEAD") == 0 ? "GET" : method;
    char allow[sizeof out->allow] = "";
    const bool asks_methods = strcmp(method, "OPTIONS") == 0;
    *match = (route_match){.label = N_ROUTES};
    if (asks_methods && strcmp(path, "*") == 0) {
        match->any_host = true;
        answer_options("GET, HEAD, POST, PUT, DELETE", out);
        return;
    }
    for (size_t i = 0; i < N_ROUTES; i++) {
        if (!match_route(&routes[i], path, match)) continue;
        /* Routes of one pattern share the label of the first. */
        if (match->label == N_ROUTES) match->label = i;
        match->with_token = !routes[i].open;
        match->any_host = routes[i].any_host;
        if (strcmp(routes[i].method, wanted) == 0) {
            match->route = &routes[i];
            return;
        }
        if (allow[0] != '\0') strcat(allow, ", ");
        strcat(allow, strcmp(routes[i].method, "GET") == 0 ? "GET, HEAD" : routes[i].method);
        if (i + 1 == N_ROUTES || strcmp(routes[i].pattern, routes[i + 1].pattern) != 0) break;
    }
    if (match->label == N_ROUTES) {
        answer_refuse(out, PROBLEM_NOT_FOUND, "%.120s: there is no such route", path);
    } else if (asks_methods) {
        answer_options(allow, out);
    } else {
        answer_refuse(out, PROBLEM_WRONG_METHOD, "%.120s: the method is %.20s, must be %s", path, method,
                      allow);
        memcpy(out->allow, allow, sizeof allow);
    }
}
