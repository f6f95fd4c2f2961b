#include "solver/codec/reflectance.h"

#include "solver/codec/json_mark.h"

#include <float.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* True when jansson was refused memory in this thread since the last parse began: its parser then says that
 * the text is wrong, or leaves out a byte of it. Its functions of allocation take no argument of ours. */
static _Thread_local bool memory_failed;

static void *allocate(size_t size) {
    void *memory = malloc(size);
    memory_failed = memory_failed || memory == NULL;
    return memory;
}

void reflectance_watch_memory(void) {
    json_set_alloc_funcs(allocate, free);
}

/* The most bytes of a variant's own name, behind the scene's. */
#define VARIANT_NAME_MOST 100

/* JSON pointer /groups/KEY or /groups/KEY/index; too long a key is left out. */
static void point(problem *why, const char *key, size_t index) {
    char *to = why->pointer;
    const char *end = to + sizeof why->pointer - 24;
    to += sprintf(to, "/groups/");
    for (; *key != '\0' && to < end - 2; key++) {
        const char *escape = *key == '~' ? "~0" : *key == '/' ? "~1" : NULL;
        if (escape != NULL)
            to += sprintf(to, "%s", escape);
        else
            *to++ = *key;
    }
    *to = '\0';
    if (*key != '\0') why->pointer[0] = '\0';
    if (*key == '\0' && index != SIZE_MAX) sprintf(to, "/%zu", index);
}

static bool read_one(const json_t *value, const char *group, size_t index, float *rho, problem *why) {
    if (!json_is_number(value)) {
        problem_set(why, PROBLEM_WRONG_KIND,
                    "the reflectance of %.200s must be a number, or one for each channel", group);
        point(why, group, index);
        return false;
    }
    const double given = json_number_value(value);
    *rho = (float)given;
    if (given >= 0 && *rho < FLT_MIN) *rho = 0; /* its reciprocal passes the range of single precision */
    if (given >= 0 && *rho < 1) return true;
    problem_set(why, PROBLEM_BAD_VALUE, "the reflectance of %.200s = %.9g, must be at least 0 and below 1",
                group, given);
    point(why, group, index);
    return false;
}

/* A number for all channels, or one each, over the elements of a group by its name; done[g] says which groups
 * have had theirs. */
static bool set_group(const reflectance_scene *s, const char *group, const json_t *value, bool *done,
                      float *reflectance, problem *why) {
    const group_index *groups = s->groups;
    const uint32_t *found = NULL;
    const size_t n_found = group_index_find(groups, group, strlen(group), &found);
    if (n_found == 0) {
        char miss[GROUP_MISS];
        group_index_miss(groups, group, strlen(group), miss);
        problem_set(why, PROBLEM_UNKNOWN_GROUP, "the scene has %s", miss);
        point(why, group, SIZE_MAX);
        return false;
    }
    if (json_is_array(value) && json_array_size(value) != s->n_channels) {
        problem_set(why, PROBLEM_WRONG_LENGTH,
                    "the reflectance of %.200s has %zu values, must be a number or %zu, one for each channel",
                    group, json_array_size(value), s->n_channels);
        point(why, group, SIZE_MAX);
        return false;
    }
    for (size_t k = 0; k < n_found; k++) {
        if (done[found[k]]) {
            problem_set(why, PROBLEM_GIVEN_TWICE, "the group %.200s is given twice", groups->names[found[k]]);
            point(why, group, SIZE_MAX);
            return false;
        }
        done[found[k]] = true;
    }
    for (size_t c = 0; c < s->n_channels; c++) {
        float rho;
        if (json_is_array(value) ? !read_one(json_array_get(value, c), group, c, &rho, why)
                                 : !read_one(value, group, SIZE_MAX, &rho, why))
            return false;
        for (size_t k = 0; k < n_found; k++)
            for (uint32_t i = groups->start[found[k]]; i < groups->start[found[k] + 1]; i++)
                reflectance[c * s->n + groups->elements[i]] = rho;
    }
    return true;
}

/* The reflectances of a scene but for the groups given; *reflectance [C][n] is the caller's. */
static bool read_reflectance(const reflectance_scene *s, json_t *groups, float **reflectance, problem *why) {
    const size_t count = s->n_channels * s->n;
    float *rho = malloc(count * sizeof *rho);
    bool *done = calloc(s->groups->n_groups > 0 ? s->groups->n_groups : 1, sizeof *done);
    bool good = rho != NULL && done != NULL;
    if (!good) problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the reflectances");
    if (good) memcpy(rho, s->reflectance, count * sizeof *rho);
    const char *group;
    json_t *value;
    json_object_foreach(groups, group, value) good = good && set_group(s, group, value, done, rho, why);
    free(done);
    if (good)
        *reflectance = rho;
    else
        free(rho);
    return good;
}

static bool refuse_text(const json_error_t *error, size_t mark, problem *why) {
    const enum json_error_code code = json_error_code(error);
    const bool number = code == json_error_numeric_overflow, again = code == json_error_duplicate_key;
    const bool nul = code == json_error_null_byte_in_key || code == json_error_null_character;
    const problem_kind kind = number  ? PROBLEM_BAD_VALUE
                              : again ? PROBLEM_GIVEN_TWICE
                              : nul   ? PROBLEM_WRONG_MEMBERS
                                      : PROBLEM_NOT_JSON;
    return problem_set(why, kind, "%s: %.160s at byte %zu",
                       number  ? "a number beyond double"
                       : again ? "a name is given twice"
                       : nul   ? "a name with a NUL"
                               : "the body is not JSON",
                       error->text, mark + (size_t)error->position);
}

static bool read_text(const char *text, size_t length, json_t **body, problem *why) {
    json_error_t error;
    const char *fault = NULL;
    const size_t mark = json_mark_length(text, length, &fault);
    if (fault != NULL) return problem_set(why, PROBLEM_NOT_JSON, "the body is not JSON: %s", fault);
    memory_failed = false;
    *body = json_loadb(text + mark, length - mark,
                       JSON_REJECT_DUPLICATES | JSON_DECODE_ANY | JSON_DECODE_INT_AS_REAL, &error);
    if (memory_failed) return problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the request");
    if (*body == NULL) return refuse_text(&error, mark, why);
    if (!json_is_object(*body)) return problem_set(why, PROBLEM_WRONG_KIND, "the body must be an object");
    return true;
}

static bool read_name(const json_t *body, char **variant, problem *why) {
    const char *name = json_string_value(json_object_get(body, "variant"));
    bool good = name != NULL && name[0] != '\0' && strlen(name) <= VARIANT_NAME_MOST;
    for (const char *c = name; good && *c != '\0'; c++)
        good = (unsigned char)*c > ' ' && *c != 0x7f && *c != '/' && *c != '@';
    if (!good) {
        problem_set(why, PROBLEM_WRONG_KIND,
                    "variant must be a text of 1 to %d bytes, without white space, / and @",
                    VARIANT_NAME_MOST);
        snprintf(why->pointer, sizeof why->pointer, "/variant");
        return false;
    }
    *variant = strdup(name);
    return *variant != NULL || problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the request");
}

/* Members other than these are mistakes. */
static bool check_members(json_t *body, bool with_groups, problem *why) {
    const char *key;
    json_t *value;
    json_object_foreach(body, key, value) {
        if (strcmp(key, "variant") == 0 || (with_groups && strcmp(key, "groups") == 0)) continue;
        return problem_set(why, PROBLEM_WRONG_MEMBERS, "%.100s is not known here; a variant has %s", key,
                           with_groups ? "variant and groups" : "the member variant");
    }
    if (!with_groups || json_is_object(json_object_get(body, "groups"))) return true;
    problem_set(why, PROBLEM_WRONG_KIND, "groups must be an object of group names and reflectances");
    snprintf(why->pointer, sizeof why->pointer, "/groups");
    return false;
}

void reflectance_request_free(reflectance_request *request) {
    free(request->variant);
    free(request->groups);
    free(request->reflectance);
    *request = (reflectance_request){0};
}

bool codec_read_reflectance(const reflectance_scene *scene, const char *text, size_t length,
                            reflectance_request *request, problem *why) {
    json_t *body = NULL;
    bool good = read_text(text, length, &body, why) && check_members(body, true, why) &&
                read_name(body, &request->variant, why) &&
                read_reflectance(scene, json_object_get(body, "groups"), &request->reflectance, why);
    if (good) {
        request->groups = json_dumps(json_object_get(body, "groups"), JSON_COMPACT);
        good = request->groups != NULL ||
               problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the request");
    }
    json_decref(body);
    return good;
}

bool codec_read_variant(const char *text, size_t length, char **variant, problem *why) {
    json_t *body = NULL;
    const bool good = read_text(text, length, &body, why) && check_members(body, false, why) &&
                      read_name(body, variant, why);
    json_decref(body);
    return good;
}
