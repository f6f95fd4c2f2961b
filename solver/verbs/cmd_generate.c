/* lambert generate: writes one of the known scenes. */
#include "solver/base/atomic_file.h"
#include "solver/console/options.h"
#include "solver/console/terminal.h"
#include "solver/scene/generate/generate.h"
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
    {.name = "output",
     .letter = 'o',
     .kind = OPTION_TEXT,
     .offset = FIELD(output),
     .value = "SCENE.obj",
     .doc = "Where the scene goes; its materials go beside it"},
    {.name = "elements",
     .kind = OPTION_COUNT,
     .offset = FIELD(elements),
     .value = "N",
     .doc = "About this many faces",
     .low = 1,
     .high = 1e9},
    {.name = "reflectance",
     .kind = OPTION_NUMBER,
     .offset = FIELD(reflectance),
     .value = "X",
     .doc = "Of every face, grey",
     .low = 0,
     .high = 1,
     .high_open = true},
    {.name = "seed",
     .kind = OPTION_COUNT,
     .offset = FIELD(seed),
     .value = "S",
     .doc = "Of what is random in city, rooms, maze and canopy (1)"},
    {.kind = OPTION_HEADING, .doc = "box"},
    {.name = "divisions",
     .kind = OPTION_COUNT,
     .offset = FIELD(divisions),
     .value = "M",
     .doc = "Exactly 6 M^2 faces",
     .low = 1,
     .high = 10000},
    {.name = "size",
     .kind = OPTION_CUSTOM,
     .offset = FIELD(size),
     .value = "X,Y,Z",
     .doc = "Metres (1,1,1)",
     .parse = parse_size},
    {.kind = OPTION_HEADING, .doc = "cornell"},
    {.name = "closed", .kind = OPTION_FLAG, .offset = FIELD(closed), .doc = "With a front wall"},
    {.kind = OPTION_HEADING, .doc = "city"},
    {.name = "variant",
     .kind = OPTION_CHOICE,
     .offset = FIELD(variant),
     .value = "1|2|3",
     .doc = "Flat houses; up to middle-high; with skyscrapers (1)",
     .choices = "1|2|3"},
    {.name = "terrain",
     .kind = OPTION_CHOICE,
     .offset = FIELD(terrain),
     .value = "flat|valley|hill",
     .doc = "What it stands on (flat)",
     .choices = "flat|valley|hill"},
    {0},
};

static const option_verb verb = {
    .name = "generate",
    .arguments = "box|city|cornell|furnace|rooms|anechoic|patio|atrium|maze|canopy -o SCENE.obj",
    .summary = "Write one of the known scenes as OBJ and MTL, z up, in metres.",
    .options = rows,
    .min_arguments = 1,
    .max_arguments = 1,
};

int cmd_generate(int argc, char **argv) {
    fields f = {.size = {1, 1, 1}, .reflectance = -1, .seed = 1, .variant = "1", .terrain = "flat"};
    option_result given = {0};
    lam_error error = {0};
    terminal term;
    size_t faces = 0;
    int code = options_parse(&verb, argc, argv, &f, &given);
    if (code != OPTIONS_GO) return code;
    const char *kind = given.arguments[0];
    if (!option_among(kind, "box|city|cornell|furnace|rooms|anechoic|patio|atrium|maze|canopy"))
        return options_usage(verb.name,
                             "%s: no such scene; must be one of: box city cornell furnace rooms anechoic "
                             "patio atrium maze canopy",
                             kind);
    if (f.output == NULL) return options_usage(verb.name, "no -o SCENE.obj given");
    if (f.divisions != 0 && f.elements != 0)
        return options_usage(verb.name, "--divisions and --elements exclude each other");
    if (options_given(&verb, &given, "closed") && strcmp(kind, "cornell") != 0)
        return options_usage(verb.name, "--closed: only for cornell");
    if (strcmp(kind, "box") != 0 &&
        (options_given(&verb, &given, "size") || options_given(&verb, &given, "divisions")))
        return options_usage(verb.name, "--size and --divisions: only for box");
    if (strcmp(kind, "city") != 0 &&
        (options_given(&verb, &given, "variant") || options_given(&verb, &given, "terrain")))
        return options_usage(verb.name, "--variant and --terrain: only for city");
    char extension[16];
    output_file_extension(f.output, extension);
    if (strcmp(extension, "obj") != 0) return options_usage(verb.name, "-o %s: must end in .obj", f.output);

    terminal_open(&term, verb.name, false, false);
    generate_options options = {.kind = kind,
                                .size = {f.size[0], f.size[1], f.size[2]},
                                .divisions = (unsigned)f.divisions,
                                .closed = f.closed,
                                .variant = (unsigned)(f.variant[0] - '0'),
                                .terrain = f.terrain,
                                .elements = f.elements,
                                .reflectance = f.reflectance,
                                .seed = f.seed};
    if (output_file_check(f.output, &error) != LAM_OK) return terminal_fail(&term, &error);
    lam_status status = scene_generate(&options, f.output, &faces, &error);
    if (status == LAM_ERR_ARGUMENT) return options_usage(verb.name, "%s", error.message);
    if (status != LAM_OK) return terminal_fail(&term, &error);
    printf("%s: %zu faces\n", f.output, faces);
    return 0;
}
