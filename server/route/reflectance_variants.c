/* PUT /v1/scenes/NAME/reflectance builds a variant of a scene, under other reflectances, in the background.
 * DELETE of /v1/scenes/NAME@VARIANT, of the same path with /reflectance, or of /v1/scenes/NAME/reflectance
 * with
 * {"variant":...} takes it out of service. */
#include "server/route/routes.h"
#include "solver/codec/reflectance.h"
#include "solver/operator/operator.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Longest body: enough for every group of a large scene by a long name. */
#define BODY_MOST ((size_t)8 << 20)

/* The checks that do not depend on the body. */
static bool check_scene(const call *in, problem *why) {
    const scene *s = in->scene;
    if (in->service->config->max_variants == 0)
        return problem_set(why, PROBLEM_NOT_ALLOWED,
                           "this daemon makes no variants; start it with --max-variants N");
    if (in->service->tokens == NULL)
        return problem_set(why, PROBLEM_NOT_ALLOWED,
                           "variants need a token; start the daemon with --token-file FILE");
    if (s->base != NULL)
        return problem_set(why, PROBLEM_CONFLICT,
                           "%.200s is a variant itself; PUT to /v1/scenes/%.200s/reflectance", s->name,
                           s->base->name);
    if (!operator_keeps_factors(s->op))
        return problem_set(why, PROBLEM_CONFLICT,
                           "%.200s keeps no factors (%s); precompute it with --method low-rank or 2msc and "
                           "--keep-factors",
                           s->name, lam_operator_kind(s->op));
    if (in->body_type != MEDIA_JSON)
        return problem_set(why, PROBLEM_MEDIA_TYPE, "Content-Type must be application/json");
    if (in->length > BODY_MOST)
        return problem_set(why, PROBLEM_TOO_LONG, "the body is longer than %zu bytes", BODY_MOST);
    return true;
}

/* True for characters that need no escape in a path: letters, digits and these. */
static bool is_plain(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           (c != '\0' && strchr("-._~@", c) != NULL);
}

/* The path of a scene as that of another's reflectance leads to it, so that it holds below any path of a
 * proxy; NULL if memory is short. */
static char *path_of(const char *name) {
    static const char before[] = "../";
    char *path = malloc(sizeof before + 3 * strlen(name)), *to = path;
    if (path == NULL) return NULL;
    to += sprintf(to, "%s", before);
    for (; *name != '\0'; name++)
        to += is_plain(*name) ? sprintf(to, "%c", *name)
                              : sprintf(to, "%%%02X", (unsigned)(unsigned char)*name);
    return path;
}

/* The scene without const, to be held. */
static scene *scene_of(const call *in) {
    size_t i = 0;
    while (in->snapshot->scenes[i] != in->scene) i++;
    return in->snapshot->scenes[i];
}

/* Queues the variant; takes over the reflectances of request. */
static bool put(call *in, reflectance_request *request, char **location, problem *why) {
    char name[ROUTE_NAME_MAX];
    float *reflectance = request->reflectance;
    if (snprintf(name, sizeof name, "%s@%s", in->scene->name, request->variant) >= ROUTE_NAME_MAX)
        return problem_set(why, PROBLEM_TOO_MUCH,
                           "%.100s: with the scene's name it is longer than the %d bytes of a name",
                           request->variant, ROUTE_NAME_MAX - 1);
    *location = path_of(name);
    if (*location == NULL) return problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for a variant");
    in->changed = strdup(name);
    request->reflectance = NULL;
    return variants_put(in->service->variants, scene_of(in), name, reflectance, request->groups, why);
}

/* Memory of a tree of JSON for each letter of its text, at most: [] and a comma are an array with room for
 * eight. */
#define TREE_OF_LETTER 48

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
        /* All is given back with the answer; what the builder holds meanwhile is the variant's. */
        good = request_memory_take(in->memory,
                                   bytes_plus(bytes_times(in->length, TREE_OF_LETTER),
                                              bytes_times(s->n, s->n_channels * sizeof(float))),
                                   &why) &&
               codec_read_reflectance(&about, in->body, in->length, &request, &why);
    }
    if (good && !buffer_append_text(&b, "{\"status\":\"building\"}\n"))
        good = problem_set(&why, PROBLEM_NO_MEMORY, "not enough memory for the answer");
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

static void remove_variant(call *in, const char *name, answer *out) {
    problem why = {0};
    in->changed = strdup(name);
    if (variants_remove(in->service->variants, name, &why))
        *out = (answer){.status = 204};
    else
        answer_problem(out, &why);
}

/* True for a store, false for a variant, built or not. */
static bool is_of_store(const call *in) {
    return in->scene != NULL && in->scene->base == NULL;
}

void delete_scene(call *in, answer *out) {
    if (is_of_store(in)) {
        answer_refuse(out, PROBLEM_WRONG_METHOD,
                      "/v1/scenes/%.200s: the method is DELETE, must be GET, HEAD: it is a store, and only "
                      "variants can be deleted",
                      in->scene->name);
        snprintf(out->allow, sizeof out->allow, "GET, HEAD");
        return;
    }
    remove_variant(in, in->name, out);
}

void delete_reflectance(call *in, answer *out) {
    char name[ROUTE_NAME_MAX], *variant = NULL;
    problem why = {0};
    if (!is_of_store(in)) {
        remove_variant(in, in->name, out);
        return;
    }
    if (in->body_type != MEDIA_JSON)
        answer_refuse(out, PROBLEM_MEDIA_TYPE, "Content-Type must be application/json");
    else if (in->length == 0)
        answer_refuse(out, PROBLEM_WRONG_MEMBERS,
                      "which variant? DELETE /v1/scenes/%.200s@VARIANT/reflectance, or {\"variant\":...}",
                      in->scene->name);
    else if (!codec_read_variant(in->body, in->length, &variant, &why))
        answer_problem(out, &why);
    else if (snprintf(name, sizeof name, "%s@%s", in->scene->name, variant) >= ROUTE_NAME_MAX)
        answer_refuse(out, PROBLEM_NOT_FOUND, "there is no variant %.200s", variant);
    else
        remove_variant(in, name, out);
    free(variant);
}
