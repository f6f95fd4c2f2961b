/* lambert luminaire: prints what a file of a luminaire says, its intensities and its flux; or a list of
 * placed luminaires. */
#include "solver/base/atomic_file.h"
#include "solver/base/file_stem.h"
#include "solver/base/options/options.h"
#include "solver/base/terminal.h"
#include "solver/luminaire/luminaire.h"
#include "solver/luminaire/polar_curves.h"
#include "solver/verbs/json_print.h"
#include "solver/verbs/luminaire_list.h"
#include "solver/verbs/verbs.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct fields {
    uint64_t set;
    const char *output, *assets;
    option_list directions;
    bool json;
} fields;

#define FIELD(member) offsetof(fields, member)
static const option_row rows[] = {
    OPTION_ROW_OUTPUT(FIELD(output), "FILE.svg|.csv",
                      .help =
                          "Where its polar curves go: a picture of C0-C180 and C90-C270, or a table of all "
                          "planes, cd"),
    {.name = "candela",
     .kind = OPTION_LIST,
     .offset = FIELD(directions),
     .argument = "C,GAMMA",
     .help = "Print the intensity in a direction: its plane C and gamma from the axis, degrees; may be given "
             "several times"},
    {.name = "set",
     .kind = OPTION_COUNT,
     .offset = FIELD(set),
     .argument = "N",
     .least = 1,
     .most = 1000,
     .otherwise = "the first lamp set of the file",
     .help = "The lamp set of an EULUMDAT whose lumens its intensities have"},
    {.name = "assets",
     .kind = OPTION_TEXT,
     .offset = FIELD(assets),
     .argument = "DIR",
     .help =
         "Folder of files that a list of luminaires or TILT= of an LM-63 names and that do not lie in its "
         "own"},
    {.name = "json", .kind = OPTION_FLAG, .offset = FIELD(json), .help = "Print JSON, with all that it says"},
    {0},
};

static const option_command verb = {
    .name = "lambert luminaire",
    .arguments = "FILE.ies|.ldt|.json|.csv",
    .summary =
        "Print what a luminaire file says: IES LM-63 of 1986 to 2019, or EULUMDAT; or a list of luminaires.",
    .notes =
        "Intensities are absolute, in cd, linear in both angles of the file's table and 0 outside of it; "
        "lumens are their integral. C0 is x of the luminaire, C90 is y, gamma 0 is -z. The content of a "
        "file says its format, not its name. A list of luminaires, JSON or CSV, says of each its file, where "
        "it is (metres), how it is turned (degrees) and how much light it gives.",
    .least_arguments = 1,
    .most_arguments = 1,
};

/* A direction that --candela asks for. */
static lam_status read_direction(const char *text, double *C, double *gamma, lam_error *error) {
    lam_status status = LAM_OK;
    double values[2] = {0};
    size_t found = 0;
    TRY(option_numbers("--candela", text, 2, true, values, &found, error));
    if (!(fabs(values[0]) <= 360) || !(values[1] >= 0 && values[1] <= 180))
        FAIL(error, LAM_ERR_ARGUMENT, "--candela %s: C must be from -360 to 360, GAMMA from 0 to 180", text);
    *C = values[0];
    *gamma = values[1];
done:
    return status;
}

/* The maker and the name, which the formats have under other keys. */
static const char *maker_of(const luminaire *l) {
    return luminaire_find_word(l, l->format == EULUMDAT ? "company" : "MANUFAC");
}

static const char *name_of(const luminaire *l) {
    return luminaire_find_word(l, "luminaire");
}

static const char *number_of(const luminaire *l) {
    return luminaire_find_word(l, l->format == EULUMDAT ? "number" : "LUMCAT");
}

/* null for a number that is not stated, and a text that is empty. */
static json_t *number_or_null(double value) {
    return isfinite(value) ? json_real(value) : json_null();
}

static json_t *text_or_null(const char *text) {
    return text[0] != '\0' ? json_string(text) : json_null();
}

static json_t *json_of_opening(const luminaire_opening *o) {
    return json_pack("{s:s, s:[f,f,f], s:[f,f,f,f], s:f, s:f, s:f}", "shape", luminaire_shape_name(o->shape),
                     "size", o->size[0], o->size[1], o->size[2], "sides", o->side[0], o->side[1], o->side[2],
                     o->side[3], "width", o->width, "length", o->length, "height", o->height);
}

static json_t *json_of_lamps(const luminaire *l) {
    json_t *sets = json_array();
    for (size_t k = 0; k < l->n_sets; k++) {
        const luminaire_lamps *set = &l->sets[k];
        json_array_append_new(sets,
                              json_pack("{s:f, s:o, s:o, s:o, s:o, s:o}", "lamps", set->number, "type",
                                        text_or_null(set->type), "lumens", number_or_null(set->lumens),
                                        "colour", text_or_null(set->colour), "rendering",
                                        text_or_null(set->rendering), "watts", number_or_null(set->watts)));
    }
    return sets;
}

static json_t *json_of_words(const luminaire *l) {
    json_t *words = json_array();
    for (size_t k = 0; k < l->n_words; k++)
        json_array_append_new(words,
                              json_pack("{s:s, s:s}", "key", l->words[k].key, "text", l->words[k].text));
    return words;
}

static json_t *json_of_tilt(const luminaire_tilt *tilt) {
    if (tilt->n == 0) return json_null();
    json_t *angles = json_array(), *factors = json_array();
    for (size_t k = 0; k < tilt->n; k++) {
        json_array_append_new(angles, json_real(tilt->angles[k]));
        json_array_append_new(factors, json_real(tilt->factors[k]));
    }
    return json_pack("{s:i, s:o, s:o}", "geometry", tilt->geometry, "angles", angles, "factors", factors);
}

static json_t *json_of_warnings(const luminaire *l) {
    json_t *lines = json_array();
    for (const char *line = l->warnings.text; *line != '\0';) {
        const size_t length = strcspn(line, "\n");
        json_array_append_new(lines, json_stringn(line, length));
        line += length + (line[length] == '\n');
    }
    if (l->warnings.omitted > 0)
        json_array_append_new(lines,
                              json_sprintf("%llu more warnings", (unsigned long long)l->warnings.omitted));
    return lines;
}

static json_t *json_of_candela(const luminaire *l, const fields *f) {
    json_t *all = json_array();
    for (size_t k = 0; k < f->directions.count; k++) {
        double C = 0, gamma = 0;
        if (read_direction(f->directions.items[k], &C, &gamma, NULL) != LAM_OK) continue;
        json_array_append_new(all, json_pack("{s:f, s:f, s:f}", "C", C, "gamma", gamma, "candela",
                                             luminaire_candela(l, C, gamma)));
    }
    return all;
}

static lam_status print_json(const luminaire *l, const char *path, const fields *f, lam_error *error) {
    double C = 0, gamma = 0;
    const double peak = luminaire_peak(l, &C, &gamma);
    json_t *about = json_pack(
        "{s:s, s:s, s:s, s:o, s:o, s:o, s:f, s:{s:f, s:f, s:f}, s:s, s:I, s:I, s:o, s:I, s:o, s:o, s:f, s:o, "
        "s:o, s:o}",
        "format", luminaire_format_name(l->format), "type", luminaire_type_name(l->type), "photometry",
        l->absolute ? "absolute" : "relative", "maker", text_or_null(maker_of(l)), "luminaire",
        text_or_null(name_of(l)), "number", text_or_null(number_of(l)), "lumens", luminaire_lumens(l), "peak",
        "candela", peak, "C", C, "gamma", gamma, "symmetry", luminaire_symmetry_name(l->symmetry), "planes",
        (json_int_t)l->n_planes, "angles", (json_int_t)l->n_angles, "opening", json_of_opening(&l->opening),
        "lamp_set", (json_int_t)l->set + 1, "lamp_sets", json_of_lamps(l), "output_ratio",
        number_or_null(l->output_ratio), "measured_tilt", isfinite(l->measured_tilt) ? l->measured_tilt : 0.,
        "tilt", json_of_tilt(&l->tilt), "words", json_of_words(l), "warnings", json_of_warnings(l));
    if (about != NULL && f->directions.count > 0)
        json_object_set_new(about, "candela", json_of_candela(l, f));
    const lam_status status = json_print(path, about, 10, error);
    json_decref(about);
    return status;
}

static void print_opening(const luminaire_opening *o) {
    static const char *const axes[] = {"along C0-C180", "along C90-C270", "high"};
    const char *mark = ", ";
    printf("%-18s%s", "opening", luminaire_shape_name(o->shape));
    for (int d = 0; d < 3; d++) {
        if (o->size[d] == 0) continue;
        printf("%s%.4g m %s", mark, o->size[d], axes[d]);
        mark = " x ";
    }
    putchar('\n');
}

static void print_lamps(const luminaire *l) {
    enum { MOST = 20 };
    char head[32];
    for (size_t k = 0; k < l->n_sets && k < MOST; k++) {
        const luminaire_lamps *set = &l->sets[k];
        snprintf(head, sizeof head, "lamp set %zu%s", k + 1, l->n_sets > 1 && k == l->set ? " *" : "");
        printf("%-18s%.6g%s%s", l->n_sets > 1 ? head : "lamps", fabs(set->number),
               set->type[0] != '\0' ? " x " : "", set->type);
        if (isfinite(set->lumens)) printf(", %.6g lm", set->lumens);
        if (set->colour[0] != '\0') printf(", colour %s", set->colour);
        if (set->rendering[0] != '\0') printf(", rendering %s", set->rendering);
        if (isfinite(set->watts)) printf(", %.6g W", set->watts);
        putchar('\n');
    }
    if (l->n_sets > MOST) printf("%-18sand %zu more (--json has all)\n", "", l->n_sets - MOST);
}

static void print_words(const luminaire *l) {
    enum { MOST = 20 };
    for (size_t k = 0; k < l->n_words && k < MOST; k++)
        if (l->words[k].text[0] != '\0') printf("%-18s%s\n", l->words[k].key, l->words[k].text);
    if (l->n_words > MOST) printf("%-18sand %zu more (--json has all)\n", "", l->n_words - MOST);
}

static void print_text(const luminaire *l, const char *path, const fields *f) {
    double C = 0, gamma = 0;
    const double peak = luminaire_peak(l, &C, &gamma), lamps = l->sets[l->set].lumens;
    printf("%s: %s, type %s, %s photometry\n\n", path, luminaire_format_name(l->format),
           luminaire_type_name(l->type), l->absolute ? "absolute" : "relative");
    print_words(l);
    printf("%-18s%.6g lm", "lumens", luminaire_lumens(l));
    if (!l->absolute && lamps > 0) printf(" of lamps of %.6g lm", lamps);
    printf("\n%-18s%.6g cd at C %.6g, gamma %.6g\n", "peak", peak, C, gamma);
    printf("%-18s%s, %zu plane%s of %zu angles\n", "symmetry", luminaire_symmetry_name(l->symmetry),
           l->n_planes, l->n_planes == 1 ? "" : "s", l->n_angles);
    print_opening(&l->opening);
    print_lamps(l);
    if (l->tilt.n > 0)
        printf("%-18sfactors of %zu angles, geometry %d, for a luminaire that is tilted\n", "tilt", l->tilt.n,
               l->tilt.geometry);
    for (size_t k = 0; k < f->directions.count; k++) {
        if (read_direction(f->directions.items[k], &C, &gamma, NULL) != LAM_OK) continue;
        printf("%-18sC %.6g, gamma %.6g: %.6g cd\n", k == 0 ? "candela" : "", C, gamma,
               luminaire_candela(l, C, gamma));
    }
}

static void warn(terminal *t, const luminaire *l, const char *path) {
    for (const char *line = l->warnings.text; *line != '\0';) {
        const size_t length = strcspn(line, "\n");
        terminal_warn(t, "%s: %.*s", path, (int)length, line);
        line += length + (line[length] == '\n');
    }
    if (l->warnings.omitted > 0)
        terminal_warn(t, "%s: %llu more warnings", path, (unsigned long long)l->warnings.omitted);
}

static lam_status write_curves(const luminaire *l, const char *path, const char *output, bool picture,
                               lam_error *error) {
    lam_status status = LAM_OK;
    atomic_file file = {0};
    char *stem = file_stem(path);
    if (stem == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory for its name", path);
    TRY(atomic_file_open(output, &file, error));
    TRY(picture ? polar_curves_svg(l, name_of(l)[0] != '\0' ? name_of(l) : stem, file.stream, error)
                : polar_curves_csv(l, file.stream, error));
    TRY(atomic_file_commit(&file, error));
done:
    atomic_file_abort(&file);
    free(stem);
    return status;
}

int cmd_luminaire(int argc, char **argv) {
    lam_status status = LAM_OK;
    fields f = {0};
    option_result given = {0};
    lam_error error = {0};
    luminaire l = {0};
    terminal term;
    char extension[16] = "";
    double C, gamma;
    const option_table tables[] = {{NULL, rows, &f}, {0}};
    int code = options_parse(&verb, tables, argc, argv, &given);
    if (code != OPTIONS_GO) return code;
    const char *path = given.arguments[0];
    for (size_t k = 0; k < f.directions.count; k++)
        if (read_direction(f.directions.items[k], &C, &gamma, &error) != LAM_OK)
            return options_usage(verb.name, "%s", error.message);
    if (f.output != NULL) atomic_file_extension(f.output, extension);
    const bool picture = strcmp(extension, "svg") == 0;
    if (f.output != NULL && !picture && strcmp(extension, "csv") != 0)
        return options_usage(verb.name, "-o %s: must end in .svg or .csv", f.output);
    terminal_open(&term, verb.name, false, false);
    const luminaire_options options = {.set = (size_t)f.set, .assets = f.assets};
    if (f.output != NULL) TRY(atomic_file_check(f.output, &error));
    if (placed_is_list(path)) {
        if (f.output != NULL || f.directions.count > 0 || f.set > 0)
            return options_usage(verb.name, "%s: is a list of luminaires, which %s is not for", path,
                                 f.output != NULL ? "-o"
                                 : f.set > 0      ? "--set"
                                                  : "--candela");
        TRY(luminaire_list_print(path, f.assets, f.json, &term, &error));
        goto done;
    }
    TRY(luminaire_read(path, &options, &l, &error));
    if (f.output != NULL) TRY(write_curves(&l, path, f.output, picture, &error));
    if (f.json) {
        TRY(print_json(&l, path, &f, &error));
    } else {
        print_text(&l, path, &f);
        warn(&term, &l, path);
    }
done:
    luminaire_free(&l);
    return status == LAM_OK ? 0 : terminal_fail(&term, &error);
}
