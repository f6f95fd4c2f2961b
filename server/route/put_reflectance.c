/* PUT /v1/scenes/NAME/reflectance: a variant of a scene, built in the background under other reflectances. */
#include "server/route/routes.h"
#include "solver/codec/reflectance.h"
#include "solver/operator/operator.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Longest body: every group of a large scene by a long name. */
#define BODY_MOST ((size_t)8 << 20)

/* Whatever does not depend on the body. */
static bool check_scene(const call *in, problem *why) {
    const scene *s = in->scene;
    if (in->service->config->max_variants == 0)
        return problem_set(why, 403, "this daemon makes no variants; start it with --max-variants N");
    if (in->service->token.length == 0)
        return problem_set(why, 403, "variants need a token; start the daemon with --token-file FILE");
    if (s->base != NULL)
        return problem_set(why, 409, "%.200s is a variant itself; PUT to /v1/scenes/%.200s/reflectance",
                           s->name, s->base->name);
    if (!operator_keeps_factors(s->op))
        return problem_set(why, 409,
                           "%.200s keeps no factors (%s); precompute it with --method low-rank or 2msc and "
                           "--keep-factors",
                           s->name, lam_operator_kind(s->op));
    if (in->body_type != MEDIA_JSON) return problem_set(why, 415, "Content-Type must be application/json");
    if (in->length > BODY_MOST) return problem_set(why, 413, "the body is longer than %zu bytes", BODY_MOST);
    return true;
}

/* What stands in a URL as it is: letters, digits and these. */
static bool is_plain(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           (c != '\0' && strchr("-._~@", c) != NULL);
}

/* The path of a scene; NULL when memory is short. */
static char *path_of(const char *name) {
    static const char before[] = "/v1/scenes/";
    char *path = malloc(sizeof before + 3 * strlen(name)), *to = path;
    if (path == NULL) return NULL;
    to += sprintf(to, "%s", before);
    for (; *name != '\0'; name++)
        to += is_plain(*name) ? sprintf(to, "%c", *name)
                              : sprintf(to, "%%%02X", (unsigned)(unsigned char)*name);
    return path;
}

/* The scene as the snapshot has it, to be held. */
static scene *scene_of(const call *in) {
    size_t i = 0;
    while (in->snapshot->scenes[i] != in->scene) i++;
    return in->snapshot->scenes[i];
}

/* The reflectances of request are handed on. */
static bool put(const call *in, reflectance_request *request, char **location, problem *why) {
    char name[ROUTE_NAME_MAX];
    float *reflectance = request->reflectance;
    if (snprintf(name, sizeof name, "%s@%s", in->scene->name, request->variant) >= ROUTE_NAME_MAX)
        return problem_set(why, 422, "%.100s: with the scene's name it is longer than the %d bytes of a name",
                           request->variant, ROUTE_NAME_MAX - 1);
    *location = path_of(name);
    if (*location == NULL) return problem_set(why, 503, "not enough memory for a variant");
    request->reflectance = NULL;
    return variants_put(in->service->variants, scene_of(in), name, reflectance, request->groups, why);
}

void put_reflectance(call *in, answer *out) {
    const scene *s = in->scene;
    problem why = {0};
    reflectance_request request = {0};
    char *location = NULL;
    buffer b = {0};
    bool good = check_scene(in, &why);
    if (good) {
        const reflectance_scene about = {
            .n = s->n, .n_channels = s->n_channels, .groups = &s->groups, .reflectance = s->op->reflectance};
        good = codec_read_reflectance(&about, in->body, in->length, &request, &why);
    }
    if (good && !buffer_append_text(&b, "{\"status\":\"building\"}\n"))
        good = problem_set(&why, 503, "not enough memory for the answer");
    good = good && put(in, &request, &location, &why);
    if (good) {
        answer_json(out, &b, true);
        out->status = 202;
        out->location = location;
    } else {
        free(location);
        answer_problem(out, &why);
        if (why.status == 429) out->retry_after = 1;
    }
    buffer_free(&b);
    reflectance_request_free(&request);
}
