#include "server/route/routes.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* Emission vectors of one request, in bytes: a short sparse text may ask for many long ones. */
#define LEAST_EMISSION_LIMIT ((size_t)1 << 30)

static const route routes[] = {
    {"GET", "/healthz", get_healthz, NULL, BODY_NONE, OPEN, SERVED, NULL},
    {"GET", "/readyz", get_readyz, NULL, BODY_NONE, OPEN, SERVED, NULL},
    {"GET", "/metrics", get_metrics, NULL, BODY_NONE, OPEN, SERVED, NULL},
    {"GET", "/v1/scenes", get_scenes, NULL, BODY_NONE, WITH_TOKEN, SERVED, NULL},
    {"GET", "/v1/scenes/{name}", get_scene, NULL, BODY_NONE, WITH_TOKEN, SERVED_OR_BUILT, NULL},
    {"DELETE", "/v1/scenes/{name}", delete_scene, NULL, BODY_NONE, WITH_TOKEN, SERVED_OR_BUILT, NULL},
    {"GET", "/v1/scenes/{name}/mesh", not_yet, NULL, BODY_NONE, WITH_TOKEN, SERVED, NULL},
    {"POST", "/v1/scenes/{name}/radiosity", NULL, &post_radiosity, BODY_OF_SOLVE, WITH_TOKEN, SERVED,
     quick_radiosity},
    {"POST", "/v1/scenes/{name}/adjoint", post_adjoint, NULL, BODY_OF_SOLVE, WITH_TOKEN, SERVED, NULL},
    {"PUT", "/v1/scenes/{name}/reflectance", put_reflectance, NULL, BODY_OF_SOLVE, WITH_TOKEN, SERVED, NULL},
    {"DELETE", "/v1/scenes/{name}/reflectance", delete_reflectance, NULL, BODY_OF_SOLVE, WITH_TOKEN,
     SERVED_OR_BUILT, NULL},
    {"GET", "/v1/openapi.json", get_openapi, NULL, BODY_NONE, WITH_TOKEN, SERVED, NULL},
    {"GET", "/", not_yet, NULL, BODY_NONE, OPEN, SERVED, NULL},
};
#define N_ROUTES (sizeof routes / sizeof routes[0])

size_t route_label_count(void) {
    return N_ROUTES + 1;
}

const char *route_label(size_t label) {
    return label < N_ROUTES ? routes[label].pattern : "other";
}

static int hex_digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

/* Resolves %XX; "" for what no scene can be called. */
static void decode_name(const char *raw, size_t length, char name[ROUTE_NAME_MAX]) {
    size_t count = 0;
    for (size_t i = 0; i < length; i++) {
        char c = raw[i];
        if (c == '%') {
            int high = i + 2 < length ? hex_digit(raw[i + 1]) : -1;
            int low = high < 0 ? -1 : hex_digit(raw[i + 2]);
            c = low < 0 ? '\0' : (char)(high * 16 + low);
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

/* Whether a path follows a pattern; {name} is one segment, not empty. */
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

void route_find(const char *method, const char *path, route_match *match, answer *out) {
    /* HEAD is GET without the body, which the HTTP library leaves out. */
    const char *wanted = strcmp(method, "HEAD") == 0 ? "GET" : method;
    char allow[sizeof out->allow] = "";
    *match = (route_match){.label = N_ROUTES};
    for (size_t i = 0; i < N_ROUTES; i++) {
        if (!match_path(routes[i].pattern, path, match)) continue;
        /* Routes of one pattern follow each other and share the label of the first. */
        if (match->label == N_ROUTES) match->label = i;
        match->with_token = routes[i].access == WITH_TOKEN;
        if (strcmp(routes[i].method, wanted) == 0) {
            match->route = &routes[i];
            return;
        }
        if (allow[0] != '\0') strcat(allow, ", ");
        strcat(allow, strcmp(routes[i].method, "GET") == 0 ? "GET, HEAD" : routes[i].method);
        if (i + 1 == N_ROUTES || strcmp(routes[i].pattern, routes[i + 1].pattern) != 0) break;
    }
    if (match->label == N_ROUTES) {
        answer_refuse(out, 404, "%.120s: there is no such route", path);
    } else {
        answer_refuse(out, 405, "%.120s: the method is %.20s, must be %s", path, method, allow);
        memcpy(out->allow, allow, sizeof allow);
    }
}

/* --- answers ------------------------------------------------------------------------------------------ */

void answer_problem(answer *out, const problem *what) {
    buffer_free(&out->body);
    out->status = what->status;
    out->type = "application/problem+json";
    out->retry_after = what->status == 503 ? 1 : 0;
    if (problem_write(what, &out->body)) return;
    /* No memory for a body: the status has to do. */
    buffer_free(&out->body);
    out->status = 503;
    out->retry_after = 1;
}

void answer_refuse(answer *out, unsigned status, const char *format, ...) {
    problem what = {.status = status};
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(what.detail, sizeof what.detail, format, arguments);
    va_end(arguments);
    answer_problem(out, &what);
}

void answer_json(answer *out, buffer *b, bool written) {
    if (!written) {
        buffer_free(b);
        answer_refuse(out, 503, "not enough memory for the answer");
        return;
    }
    *out = (answer){.status = 200, .type = "application/json", .body = *b};
    *b = (buffer){0};
}

/* --- calls -------------------------------------------------------------------------------------------- */

codec_scene call_codec_scene(const call *in) {
    const scene *s = in->scene;
    const config *c = in->service->config;
    return (codec_scene){.n = s->n,
                         .n_channels = s->n_channels,
                         .groups = &s->groups,
                         .n_tiles = s->sky != NULL ? lam_sky_tiles(s->sky) : 0,
                         .n_emitters = s->n_emitters,
                         .max_batch = c->max_batch,
                         .max_bytes =
                             4 * c->max_body > LEAST_EMISSION_LIMIT ? 4 * c->max_body : LEAST_EMISSION_LIMIT,
                         .max_rows = adjoint_rows_capacity(s)};
}

answer_notes call_notes(const call *in) {
    const scene *s = in->scene;
    return (answer_notes){.scene = s->name,
                          .has_error = s->has_error,
                          .relative_mean = s->relative_mean,
                          .indirect_mean = s->indirect_mean};
}

double call_now_ms(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}
