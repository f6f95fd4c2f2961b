/* lambert generate: writes one of the known scenes. */
#include "solver/base/atomic_file.h"
#include "solver/base/options/options.h"
#include "solver/base/terminal.h"
#include "solver/scene/generate/generate.h"
#include "solver/scene/mesh_options.h"
#include "solver/verbs/verbs.h"

#include <stdio.h>
#include <string.h>

typedef struct fields {
    const char *output, *variant, *terrain;
    uint64_t divisions, elements, seed;
    double size[3];
    double reflectance;
    bool closed;
} fields;

static lam_status parse_size(const char *text, void *field, lam_error *error) {
    lam_status status = LAM_OK;
    double size[3];
    TRY(option_numbers("--size", text, 3, true, size, NULL, error));
    for (int axis = 0; axis < 3; axis++)
        if (!(size[axis] > 0))
            FAIL(error, LAM_ERR_ARGUMENT, "--size %s: every length must be above 0 metres", text);
    memcpy(field, size, sizeof size);
done:
    return status;
}

#define FIELD(member) offsetof(fields, member)
static const option_row rows[] = {
    OPTION_ROW_OUTPUT(FIELD(output), "SCENE.obj", .help = "Where the scene goes; its materials go beside it"),
    OPTION_ROW_ELEMENTS(FIELD(elements), 1e9, .help = "About this many faces"),
    OPTION_ROW_REFLECTANCE(FIELD(reflectance), .help = "Grey reflectance of every face"),
    OPTION_ROW_SEED(FIELD(seed), .help = "Seed of the random parts of city, rooms, maze and canopy"),
    {0},
};
static const option_row box_rows[] = {
    {.name = "divisions",
     .kind = OPTION_COUNT,
     .offset = FIELD(divisions),
     .argument = "M",
     .least = 1,
     .most = 10000,
     .not_with = "elements",
     .help = "Exactly 6 M^2 faces"},
    {.name = "size",
     .kind = OPTION_CUSTOM,
     .offset = FIELD(size),
     .argument = "X,Y,Z",
     .preset = "1,1,1",
     .unit = "m",
     .parse = parse_size,
     .help = "Lengths of the edges"},
    {0},
};
static const option_row cornell_rows[] = {
    {.name = "closed", .kind = OPTION_FLAG, .offset = FIELD(closed), .help = "Add a front wall"},
    {0},
};
static const option_row city_rows[] = {
    {.name = "variant",
     .kind = OPTION_CHOICE,
     .offset = FIELD(variant),
     .choices = "1|2|3",
     .preset = "1",
     .help = "1: flat houses; 2: houses up to middle height; 3: with skyscrapers"},
    {.name = "terrain",
     .kind = OPTION_CHOICE,
     .offset = FIELD(terrain),
     .choices = "flat|valley|hill",
     .preset = "flat",
     .help = "Shape of the ground"},
    {0},
};

/* The names of all scenes as "box|city". */
static void list_kinds(char choices[512]) {
    const char *name;
    choices[0] = '\0';
    for (size_t k = 0; (name = generate_kind(k)) != NULL && strlen(choices) + strlen(name) + 2 < 512; k++) {
        if (k > 0) strcat(choices, "|");
        strcat(choices, name);
    }
}

int cmd_generate(int argc, char **argv) {
    fields f = {0};
    option_result given = {0};
    lam_error error = {0};
    terminal term;
    size_t faces = 0;
    const option_table tables[] = {
        {NULL, rows, &f}, {"box", box_rows, &f}, {"cornell", cornell_rows, &f}, {"city", city_rows, &f}, {0}};
    char choices[512], arguments[600];
    list_kinds(choices);
    snprintf(arguments, sizeof arguments, "%s -o SCENE.obj", choices);
    const option_command verb = {
        .name = "lambert generate",
        .arguments = arguments,
        .choices = choices,
        .summary = "Write one of the known scenes as OBJ and MTL, z up, in metres.",
        .least_arguments = 1,
        .most_arguments = 1,
    };
    int code = options_parse(&verb, tables, argc, argv, &given);
    if (code != OPTIONS_GO) return code;
    const char *kind = given.arguments[0];
    if (f.output == NULL) return options_usage(verb.name, "no -o SCENE.obj given");
    if (options_given(&given, "closed") && strcmp(kind, "cornell") != 0)
        return options_usage(verb.name, "--closed: only for cornell");
    if (strcmp(kind, "box") != 0 && (options_given(&given, "size") || options_given(&given, "divisions")))
        return options_usage(verb.name, "--size and --divisions: only for box");
    if (strcmp(kind, "city") != 0 && (options_given(&given, "variant") || options_given(&given, "terrain")))
        return options_usage(verb.name, "--variant and --terrain: only for city");
    char extension[16];
    atomic_file_extension(f.output, extension);
    if (strcmp(extension, "obj") != 0) return options_usage(verb.name, "-o %s: must end in .obj", f.output);

    terminal_open(&term, verb.name, false, false);
    generate_options options = {.kind = kind,
                                .size = {f.size[0], f.size[1], f.size[2]},
                                .divisions = (unsigned)f.divisions,
                                .closed = f.closed,
                                .variant = (unsigned)(f.variant[0] - '0'),
                                .terrain = f.terrain,
                                .elements = f.elements,
                                .reflectance = options_given(&given, "reflectance") ? f.reflectance : -1,
                                .seed = f.seed};
    if (atomic_file_check(f.output, &error) != LAM_OK) return terminal_fail(&term, &error);
    lam_status status = scene_generate(&options, f.output, &faces, &error);
    if (status == LAM_ERR_ARGUMENT) return options_usage(verb.name, "%s", error.message);
    if (status != LAM_OK) return terminal_fail(&term, &error);
    printf("%s: %zu faces\n", f.output, faces);
    return 0;
}
