/* lambert info: prints the contents of a store, its size and its errors. */
#include "solver/base/options/options.h"
#include "solver/base/terminal.h"
#include "solver/codec/describe.h"
#include "solver/method/report.h"
#include "solver/verbs/json_print.h"
#include "solver/verbs/store_lines.h"
#include "solver/verbs/verbs.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct fields {
    bool json;
} fields;

static const option_row rows[] = {
    {.name = "json",
     .kind = OPTION_FLAG,
     .offset = offsetof(fields, json),
     .help = "Print JSON, the same as lambertd answers to GET /v1/scenes/NAME"},
    {0},
};

static const option_command verb = {
    .name = "lambert info",
    .arguments = "STORE",
    .summary = "Print the contents of a store, its size, its measured errors, and the reason for its method.",
    .least_arguments = 1,
    .most_arguments = 1,
};

static void write_value(const json_t *value) {
    if (json_is_string(value))
        printf("%s", json_string_value(value));
    else if (json_is_integer(value))
        printf("%" JSON_INTEGER_FORMAT, json_integer_value(value));
    else
        printf("%.4g", json_number_value(value));
}

static void print_value(const char *label, const json_t *value) {
    if (value == NULL || json_is_null(value)) return;
    printf("%-18s", label);
    write_value(value);
    puts("");
}

/* Prints the figures of the method and the recipe of its form factors, one on a line. A name without words of
 * its own is printed with spaces in the place of underscores. */
static void print_report(json_t *report) {
    const char *name, *head = "figures";
    json_t *value;
    json_object_foreach(report, name, value) {
        const report_words *words = report_words_of(name);
        printf("%-18s", head);
        head = "";
        for (const char *at = words != NULL ? words->label : name; *at != '\0'; at++)
            putchar(*at == '_' ? ' ' : *at);
        putchar(' ');
        write_value(value);
        printf("%s%s\n", words != NULL && words->unit[0] != '\0' ? " " : "",
               words != NULL ? words->unit : "");
    }
}

static void print_bytes(double bytes) {
    static const char *const units[] = {"bytes", "KiB", "MiB", "GiB", "TiB"};
    size_t unit = 0;
    for (; bytes >= 1024 && unit < 4; unit++) bytes /= 1024;
    printf("%-18s%.4g %s\n", "operator", bytes, units[unit]);
}

/* Adds the standard error of the mean total error, where the store states it. */
static void print_noise(const json_t *group) {
    static const char *const keys[] = {"reference_noise", "probes_noise"};
    static const char *const words[] = {"reference", "probes"};
    for (int i = 0; i < 2; i++) {
        const json_t *noise = json_object_get(group, keys[i]);
        if (json_is_number(noise))
            printf("%s%s %.2g", i == 0 ? "  +- " : ", ", words[i], json_number_value(noise));
    }
}

/* Prints the mean and the largest error of a group of probes on one line. */
static void print_figures(const char *name, const json_t *group, const char *against) {
    char key[64];
    double value[4];
    static const char *const figures[] = {"relative_mean", "relative_max", "indirect_mean", "indirect_max"};
    const bool total = strcmp(against, "total") == 0;
    for (int i = 0; i < 4; i++) {
        snprintf(key, sizeof key, "%s_%s", against, figures[i]);
        const json_t *figure = json_object_get(group, key);
        if (!json_is_number(figure)) return;
        value[i] = json_number_value(figure);
    }
    const bool bound = total && json_integer_value(json_object_get(group, "total_is_bound")) != 0;
    printf("  %-8s%-10s%12.3g%12.3g%12.3g%12.3g", name, against, value[0], value[1], value[2], value[3]);
    if (total) print_noise(group);
    puts(bound ? "  at most" : "");
}

/* The error of receivers, which has no largest one. */
static void print_receivers(const char *name, const json_t *group) {
    const json_t *relative = json_object_get(group, "receivers_relative"),
                 *indirect = json_object_get(group, "receivers_indirect"),
                 *noise = json_object_get(group, "receivers_noise");
    if (!json_is_number(relative) || !json_is_number(indirect)) return;
    printf("  %-8s%-10s%12.3g%12s%12.3g%12s  +- reference %.2g%s\n", name, "receivers",
           json_number_value(relative), "", json_number_value(indirect), "", json_number_value(noise),
           json_integer_value(json_object_get(group, "receivers_is_bound")) != 0 ? "  at most" : "");
}

/* The error that no accuracy of the operator lowers. */
static void print_mesh(const json_t *figures) {
    static const char *const names[] = {"lights",   "even",       "sky_even", "sky_cloudy",
                                        "sky_tile", "luminaires", "luminaire"};
    static const char *const words[] = {"lights",   "even",       "even sky",     "cloudy sky",
                                        "one tile", "luminaires", "one luminaire"};
    if (json_object_size(figures) == 0) return;
    printf("  mesh   ");
    for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
        const json_t *figure = json_object_get(figures, names[k]);
        if (json_is_number(figure)) printf("  %s %.3g", words[k], json_number_value(figure));
    }
    puts("  indirect, of constants on elements, beside the errors above");
}

/* Prints the groups whose means have the largest errors: all probes together, and the largest. */
static void print_error_by_group(const json_t *groups) {
    enum { MOST = 8 };
    static const char *const figures[] = {"uniform", "uniform_largest", "near", "near_largest",
                                          "far",     "far_largest"};
    const size_t count = json_array_size(groups), shown = count < MOST ? count : MOST;
    if (shown == 0) return;
    printf("errors of means   %10s%10s%10s%10s%10s%10s\n", "uniform", "largest", "near", "largest", "far",
           "largest");
    for (size_t g = 0; g < shown; g++) {
        const json_t *one = json_array_get(groups, g);
        printf("  %-16.16s", json_string_value(json_object_get(one, "name")));
        for (size_t k = 0; k < sizeof figures / sizeof *figures; k++) {
            const json_t *figure = json_object_get(one, figures[k]);
            if (json_is_number(figure))
                printf("%10.2g", json_number_value(figure));
            else
                printf("%10s", "-");
        }
        putchar('\n');
    }
    puts("  of a group's mean over the reflected light there, groups with the largest first; uniform: random "
         "emission;\n"
         "  near, far: single elements that light the group more, or less, than the whole scene");
}

/* sources: probes emitted in these alone. */
static void print_error(const json_t *figures, bool sources) {
    static const char *const names[] = {"single", "lights", "random", "whole", "sky"};
    bool receivers = false;
    if (json_object_size(figures) == 0) {
        puts("errors            not measured (--probes 0)");
        return;
    }
    printf("errors            %12s%12s%12s%12s\n", "relative", "largest", "indirect", "largest");
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        const json_t *group = json_object_get(figures, names[i]);
        print_figures(names[i], group, "total");
        print_figures(names[i], group, "operator");
        print_receivers(names[i], group);
        receivers = receivers || json_object_get(group, "receivers_indirect") != NULL;
    }
    print_mesh(json_object_get(figures, "mesh"));
    if (receivers)
        puts("  receivers: of the light that is read, all probes together; total: of the light of all "
             "elements");
    if (sources) puts("  single, lights, random: of emissions of the sources alone");
    if (json_object_get(figures, "emitters") != NULL) {
        puts("  total: standard errors of random walks, of each position, of all together and of mixtures");
        return;
    }
    puts("  total: against an independent sample of the form factors; at most: its noise is more than a "
         "third\n"
         "  operator: against the sample that it was built from\n"
         "  +-: standard errors of the mean indirect error, by the noise of that sample and by the choice of "
         "probes");
    print_error_by_group(json_object_get(figures, "by_group"));
}

/* The first names of emitters, and how many there are. */
static void print_emitters(const json_t *emitters) {
    enum { MOST = 6 };
    const size_t count = json_array_size(emitters);
    if (count == 0) return;
    printf("%-18s%zu:", "emitters", count);
    for (size_t k = 0; k < count && k < MOST; k++)
        printf("%s %s", k > 0 ? "," : "", json_string_value(json_array_get(emitters, k)));
    puts(count > MOST ? ", ... (--json names them all)" : "");
}

/* The first names of the scene's cameras, and how many there are. */
static void print_cameras(const json_t *cameras) {
    enum { MOST = 6 };
    const size_t count = json_array_size(cameras);
    if (count == 0) return;
    printf("%-18s%zu:", "cameras", count);
    for (size_t k = 0; k < count && k < MOST; k++)
        printf("%s %s", k > 0 ? "," : "",
               json_string_value(json_object_get(json_array_get(cameras, k), "name")));
    puts(count > MOST ? ", ... (--json has them all)" : "");
}

/* The part of a group below bodies that stand on it. */
static void print_buried(const json_t *buried) {
    if (buried == NULL) return;
    printf("; %" JSON_INTEGER_FORMAT " of these, %.4g m2, lie below a body: figures leave them out",
           json_integer_value(json_object_get(buried, "elements")),
           json_number_value(json_object_get(buried, "area")));
}

/* The part of light that a group of panes lets pass, by its law. */
static void print_glass(const json_t *glass, const json_t *law) {
    if (glass == NULL) return;
    const double faces = json_number_value(json_object_get(glass, "faces"));
    printf("; a pane, T = %g", json_number_value(json_object_get(glass, "transmittance")));
    if (faces > 1) printf(" of %g faces together", faces);
    printf(strcmp(json_string_value(law), "angle") == 0 ? " at normal incidence" : " at any angle");
}

/* Prints as many groups as fit on a screen: a city has hundreds of them. */
static void print_groups(const json_t *groups, const json_t *law) {
    enum { MOST = 20 };
    const size_t count = json_array_size(groups), shown = count <= MOST ? count : MOST - 1;
    for (size_t i = 0; i < shown; i++) {
        const json_t *group = json_array_get(groups, i);
        const json_int_t elements = json_integer_value(json_object_get(group, "elements"));
        printf("%-18s%s, %" JSON_INTEGER_FORMAT " element%s", i == 0 ? "groups" : "",
               json_string_value(json_object_get(group, "name")), elements, elements == 1 ? "" : "s");
        print_glass(json_object_get(group, "glass"), law);
        print_buried(json_object_get(group, "buried"));
        putchar('\n');
    }
    if (shown < count) printf("%-18sand %zu more (--json names them)\n", "", count - shown);
}

static void print_overlap(const json_t *area) {
    if (json_is_number(area))
        printf("%-18s%.4g m2 of faces in one plane count twice; stated errors contain it\n", "overlap",
               json_number_value(area));
}

static void print_sky(const json_t *sky) {
    if (!json_is_object(sky)) return;
    const char *tiling = json_string_value(json_object_get(sky, "tiling"));
    const double north = json_number_value(json_object_get(sky, "north"));
    char turned[48] = "";
    if (north != 0) snprintf(turned, sizeof turned, ", north at %g degrees", north);
    printf("%-18s%s, %" JSON_INTEGER_FORMAT " tiles, ground albedo %g%s\n", "sky",
           tiling != NULL ? tiling : "?", json_integer_value(json_object_get(sky, "tiles")),
           json_number_value(json_object_get(sky, "ground_albedo")), turned);
}

static void print_luminaires(const json_t *luminaires) {
    if (!json_is_object(luminaires)) return;
    printf("%-18s%" JSON_INTEGER_FORMAT ", %.5g lm\n", "luminaires",
           json_integer_value(json_object_get(luminaires, "count")),
           json_number_value(json_object_get(luminaires, "lumens")));
}

static void print_sensors(const json_t *sensors) {
    if (!json_is_object(sensors)) return;
    printf("%-18s%" JSON_INTEGER_FORMAT " in %" JSON_INTEGER_FORMAT " sets\n", "sensors",
           json_integer_value(json_object_get(sensors, "receivers")),
           json_integer_value(json_object_get(sensors, "sets")));
}

/* The elements that are read, or that emit, and what others are. */
static void print_elements(const char *label, const json_t *elements, const char *others) {
    if (!json_is_object(elements)) return;
    const char *option = json_string_value(json_object_get(elements, "option"));
    printf("%-18s%" JSON_INTEGER_FORMAT " elements, by %s; %s\n", label,
           json_integer_value(json_object_get(elements, "elements")), option != NULL ? option : "?", others);
}

static void print_text(const json_t *about) {
    static const char *const plain[] = {"name", "elements", "faces",  "channels", "lights",
                                        "kind", "method",   "reason", "epsilon"};
    for (size_t i = 0; i < sizeof plain / sizeof plain[0]; i++)
        print_value(plain[i], json_object_get(about, plain[i]));
    print_value("rank", json_object_get(about, "rank"));
    print_value("density", json_object_get(about, "density"));
    print_value("precision", json_object_get(about, "precision"));
    print_bytes(json_number_value(json_object_get(about, "bytes")));
    print_report(json_object_get(about, "report"));
    print_groups(json_object_get(about, "groups"), json_object_get(about, "glass_law"));
    print_overlap(json_object_get(about, "overlap_area"));
    print_emitters(json_object_get(about, "emitters"));
    print_cameras(json_object_get(about, "cameras"));
    print_sky(json_object_get(about, "sky"));
    print_luminaires(json_object_get(about, "luminaires"));
    print_sensors(json_object_get(about, "sensors"));
    print_elements("read", json_object_get(about, "importance"), "the light of others is only roughly right");
    print_elements("emit", json_object_get(about, "sources"),
                   "light that others emit is only roughly right, and no error is stated for it");
    print_error(json_object_get(about, "error"), json_is_object(json_object_get(about, "sources")));
    const json_t *provenance = json_object_get(about, "provenance");
    const json_t *form_factors = json_object_get(provenance, "form_factors");
    static const char *const origin[] = {"tool", "command", "created", "seed", "unit", "geometry_hash"};
    for (size_t i = 0; i < sizeof origin / sizeof origin[0]; i++)
        print_value(origin[i], json_object_get(provenance, origin[i]));
    if (form_factors == NULL) return;
    print_value("form factors", json_object_get(form_factors, "method"));
    if (json_integer_value(json_object_get(form_factors, "rays")) > 0)
        print_value("rays", json_object_get(form_factors, "rays"));
    print_value("resolution", json_object_get(form_factors, "resolution"));
    print_value("kept as", json_object_get(form_factors, "storage"));
}

static lam_status info(const char *path, bool as_json, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    json_t *about = NULL;
    char lines[STORE_LINES][STORE_LINE_BYTES];
    TRY(store_open(path, &s, error));
    TRY(describe_store(s, &about, error));
    if (as_json) {
        TRY(json_print(path, about, 0, error));
    } else {
        store_lines_make(about, path, 0, lines);
        for (size_t k = 0; k < STORE_LINES; k++) puts(lines[k]);
        puts("");
        print_text(about);
    }
done:
    json_decref(about);
    store_close(s);
    return status;
}

int cmd_info(int argc, char **argv) {
    fields f = {0};
    option_result given = {0};
    lam_error error = {0};
    terminal term;
    const option_table tables[] = {{NULL, rows, &f}, {0}};
    int code = options_parse(&verb, tables, argc, argv, &given);
    if (code != OPTIONS_GO) return code;
    terminal_open(&term, verb.name, false, false);
    if (info(given.arguments[0], f.json, &error) != LAM_OK) return terminal_fail(&term, &error);
    return 0;
}
