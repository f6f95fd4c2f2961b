#include "solver/verbs/store_lines.h"

#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

static size_t count_of(const json_t *about, const char *name) {
    return (size_t)json_integer_value(json_object_get(about, name));
}

static void say_scene(const json_t *about, size_t faces, char *line) {
    const char *const name = json_string_value(json_object_get(about, "name"));
    const size_t n = count_of(about, "elements"), groups = json_array_size(json_object_get(about, "groups"));
    char elements[128];
    if (faces == n)
        snprintf(elements, sizeof elements, "%zu face%s, one element each,", n, n == 1 ? "" : "s");
    else if (faces > 0)
        snprintf(elements, sizeof elements, "%zu face%s, %s %zu elements", faces, faces == 1 ? "" : "s",
                 n > faces ? "divided into" : "joined to", n);
    else
        snprintf(elements, sizeof elements, "%zu element%s", n, n == 1 ? "" : "s");
    snprintf(line, STORE_LINE_BYTES, "scene  %.200s: %s in %zu group%s", name != NULL ? name : "?", elements,
             groups, groups == 1 ? "" : "s");
}

/* The words of the light that the headline is of. */
static const char *words_of(const char *light) {
    if (light != NULL && strcmp(light, "lights") == 0) return "the scene's own lights";
    if (light != NULL && strcmp(light, "sky") == 0) return "skies";
    if (light != NULL && strcmp(light, "groups") == 0) return "one group that is lit alone";
    return "light that all elements emit";
}

/* The part by name with the largest error. */
static const char *largest_part(json_t *parts) {
    const char *name, *largest = "operator";
    double error = -1;
    json_t *value;
    json_object_foreach(parts, name, value) {
        if (!(json_number_value(value) > error)) continue;
        error = json_number_value(value);
        largest = strcmp(name, "form_factors") == 0 ? "form factors" : name;
    }
    return largest;
}

static void say_error(const json_t *figures, char *line) {
    const json_t *const stated = json_object_get(figures, "stated"), *const advice =
                                                                         json_object_get(figures, "advice");
    if (!json_is_number(stated)) {
        snprintf(line, STORE_LINE_BYTES, "error  not measured; precompute without --probes 0 measures it");
        return;
    }
    snprintf(line, STORE_LINE_BYTES,
             "error  %.2g of the light that surfaces reflect, of %s; most of it by the %s%s%s",
             json_number_value(stated), words_of(json_string_value(json_object_get(figures, "light"))),
             largest_part(json_object_get(figures, "parts")), json_is_string(advice) ? ": coarse; " : "",
             json_is_string(advice) ? json_string_value(advice) : "");
}

static void say_file(const char *path, char *line) {
    static const char *const units[] = {"bytes", "kB", "MB", "GB", "TB"};
    struct stat about;
    double bytes = stat(path, &about) == 0 ? (double)about.st_size : 0;
    size_t unit = 0;
    for (; bytes >= 1000 && unit < 4; unit++) bytes /= 1000;
    snprintf(line, STORE_LINE_BYTES, "store  %.200s, %.3g %s; to look at it: lambert view %.200s", path,
             bytes, units[unit], path);
}

void store_lines_make(const json_t *about, const char *path, size_t faces,
                      char lines[STORE_LINES][STORE_LINE_BYTES]) {
    say_scene(about, faces, lines[0]);
    say_error(json_object_get(about, "error"), lines[1]);
    say_file(path, lines[2]);
}
