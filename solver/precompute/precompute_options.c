/* The options of lambert precompute: every row with its preset, limits and help. A method keeps its own rows
 * in its own table. */
#include "solver/daylight/sky_tiles.h"
#include "solver/formfactor/recipe.h"
#include "solver/precompute/precompute.h"
#include "solver/precompute/trial.h"
#include "solver/scene/import/import.h"
#include "solver/scene/mesh_options.h"
#include "solver/scene/size_question.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* NULL: none. */
static lam_status parse_sky(const char *text, void *field, lam_error *error) {
    lam_status status = LAM_OK;
    sky_tiling tiling = {0};
    const char **sky = field;
    lam_error why = {0};
    *sky = NULL;
    if (strcmp(text, "none") == 0) return LAM_OK;
    status = sky_tiling_create(text, 'z', &tiling, &why);
    if (status != LAM_OK) FAIL(error, status, "--sky %s", why.message);
    *sky = text;
done:
    sky_tiling_free(&tiling);
    return status;
}

/* A number of metres, or the name of a unit. */
static lam_status parse_unit(const char *text, void *field, lam_error *error) {
    lam_status status = LAM_OK;
    lam_error ignored;
    double metres = 0;
    const length_unit *named = length_unit_find(text);
    if (named != NULL)
        metres = named->metres;
    else if (option_number("--unit", text, &metres, &ignored) != LAM_OK || !(metres > 0))
        FAIL(error, LAM_ERR_ARGUMENT,
             "--unit %s: must be the metres of a unit, above 0, or one of " LENGTH_UNIT_WORDS, text);
    *(double *)field = metres;
done:
    return status;
}

const char precompute_quality_words[] = "draft|normal|high";

const option_gone precompute_gone[] = {
    {"keep-form-factors=compressed",
     "give --keep-form-factors, and --form-factors blocks where rows take too much memory"},
    {"subdivide", "give --elements N or --max-edge METRES"},
    {0},
};

/* Why a store as the input settles some of them. */
static const char fixed_mesh[] = "the mesh of a store is fixed", kept_sky[] = "a store keeps the sky it has",
                  found_factors[] = "a store has its form factors already";

#define FIELD(member) offsetof(precompute_options, member)
static const option_row output_rows[] = {
    OPTION_ROW_OUTPUT(FIELD(output), "STORE.h5", .help = "Where the store goes"),
    {0},
};

static const option_row mesh_rows[] = {
    {.name = "mesh",
     .kind = OPTION_WORD,
     .offset = FIELD(mesh),
     .preset = "light",
     .choices = "light|faces",
     .not_with = "max-edge|elements|mesh-error",
     .settled = fixed_mesh,
     .help =
         "light: divide the faces until constants on elements leave at most .05 of the reflected light of "
         "the scene's lamps, of light that all elements emit, with --sky of an even sky, and without lamps "
         "and sky of its windows and largest groups, lit alone: evenly, or where light changes, into at most "
         "40,000 elements, or a quarter more than there are faces; faces that are fine enough stay. faces: "
         "every face is one element"},
    {.name = "max-edge",
     .kind = OPTION_NUMBER,
     .offset = FIELD(max_edge),
     .argument = "METRES",
     .above = true,
     .not_with = "elements",
     .settled = fixed_mesh,
     .help = "Divide until no edge is longer than this"},
    OPTION_ROW_ELEMENTS(FIELD(elements), 4e9, .settled = fixed_mesh, .help = "Divide into about N elements"),
    {.name = "mesh-error",
     .kind = OPTION_NUMBER,
     .offset = FIELD(mesh_error),
     .argument = "X",
     .least = 0,
     .most = 1,
     .above = true,
     .settled = fixed_mesh,
     .help = "Join faces of one material that lie in one plane and divide them where light changes, until "
             "constants on elements leave at most this share of the reflected light, of each light that "
             "--mesh names; at most --elements, else 40,000"},
    {.name = "format",
     .kind = OPTION_CHOICE,
     .offset = FIELD(format),
     .otherwise = "by the extension",
     .choices = IMPORT_FORMATS,
     .settled = fixed_mesh,
     .help = "Format of the scene; - reads it from standard input"},
    {.name = "unit",
     .kind = OPTION_CUSTOM,
     .offset = FIELD(unit),
     .argument = "METRES|" LENGTH_UNIT_WORDS,
     .otherwise = "m",
     .parse = parse_unit,
     .settled = fixed_mesh,
     .help = "Length of the unit of the file"},
    {.name = "up",
     .kind = OPTION_CHOICE,
     .offset = FIELD(up),
     .otherwise = "y for glTF, z for other formats",
     .choices = "x|y|z",
     .settled = fixed_mesh,
     .help = "Axis that points up"},
    {.name = "two-sided",
     .kind = OPTION_SWITCH,
     .offset = FIELD(two_sided),
     .choices = "no",
     .settled = fixed_mesh,
     .help = "Make two elements of every face: first all fronts, then all backs, whose groups are called "
             "GROUP.back. no: of none. Without it, of those whose glTF material is double-sided"},
    {.name = "orient",
     .kind = OPTION_FLAG,
     .offset = FIELD(orient),
     .settled = fixed_mesh,
     .help = "Turn faces to the side that the light is on, where rays decide which that is"},
    {.name = "fix",
     .kind = OPTION_FLAG,
     .offset = FIELD(fix),
     .settled = fixed_mesh,
     .help =
         "Take the unit and the axis that the scene looks like, where they are not given, turn faces as "
         "--orient does, and all of them where a room is seen from outside and no sky lights it; say what "
         "was done"},
    {.name = "closed",
     .kind = OPTION_SWITCH,
     .offset = FIELD(closed),
     .choices = "no",
     .settled = fixed_mesh,
     .help = "No light leaves the scene, whatever rays find: what they lose goes back to the row. no: light "
             "leaves through every gap. Without it, light leaves through gaps wider than the diagonal of the "
             "scene over 800, and narrower ones are cracks"},
    {.name = "glass",
     .kind = OPTION_LIST,
     .offset = FIELD(glass),
     .argument = "GROUP=T[,FACES]",
     .otherwise = "materials of the file that let light pass",
     .settled = fixed_mesh,
     .help = "Light passes the faces of a group, straight on: the part T of it, from 0 to 1, at normal "
             "incidence. FACES: the faces that a ray crosses one behind the other, of a pane with two sides "
             "or of several panes, which pass T together (1). May be repeated"},
    {.name = "glass-law",
     .kind = OPTION_WORD,
     .offset = FIELD(glass_law),
     .preset = "angle",
     .choices = "angle|none",
     .settled = fixed_mesh,
     .help = "angle: panes pass T min(1, 1.018 cos t (1 + sin^3 t)) of light at the angle t to their "
             "normals, as clear glass does. none: T at any angle"},
    OPTION_ROW_REFLECTANCE(FIELD(reflectance),
                           .help = "Grey reflectance of every face, in place of that in the file"),
    OPTION_ROW_ASSETS(FIELD(assets)),
    {.name = "luminaires",
     .kind = OPTION_TEXT,
     .offset = FIELD(luminaires),
     .argument = "FILE.json|.csv",
     .otherwise = "lights of a glTF; those of a store",
     .not_with = "positions|path",
     .help =
         "Luminaires of the scene, with the files of their light (`lambert luminaire` shows both): their "
         "direct light is found by geometry, and each has a dimmer. Of a store: in place of those that it "
         "has; none leaves these out"},
    {.name = "sensors",
     .kind = OPTION_TEXT,
     .offset = FIELD(sensors),
     .argument = "FILE.json|.csv|.pts",
     .otherwise = "those of a store",
     .not_with = "positions|path",
     .help =
         "Points, grids, eyes, cylinders, spheres, cubes and probes at which light is read: it is gathered "
         "there, by 256, 1,024 or 4,096 rays each (--quality) and segments to lamps, luminaires and the sky. "
         "Of a store: in place of those that it has; none leaves these out"},
    {.name = "probes-grid",
     .kind = OPTION_NUMBER,
     .offset = FIELD(probes_grid),
     .argument = "SPACING",
     .otherwise = "none",
     .unit = "m",
     .above = true,
     .most = 1e9,
     .not_with = "positions|path",
     .help = "A set of sensors of the name probes over the free space of the scene, with this spacing: light "
             "probes of games, nine coefficients of the radiance at each. Points in walls are left out. It "
             "stands beside other sensors"},
    {.name = "probes-y-up",
     .kind = OPTION_FLAG,
     .offset = FIELD(probes_y_up),
     .help = "Probes of --probes-grid are in the axes of glTF, three.js and Godot, which have y up, in place "
             "of those of the scene"},
    {.name = "lights",
     .kind = OPTION_CHOICE,
     .offset = FIELD(lights),
     .choices = LIGHT_KIND_WORDS,
     .otherwise = "lm for a glTF with lights, W for other scenes; that of a store",
     .help = "The light of the emission in the file and of answers: W/m2, or lm/m2, lx and cd/m2. Numbers "
             "stay as they are"},
    {0},
};

static const option_row sample_rows[] = {
    {.name = "rays",
     .kind = OPTION_COUNT_AUTO,
     .offset = FIELD(rays),
     .argument = "N|auto",
     .preset = "auto",
     .least = 1,
     .most = 1 << 24,
     .help = "Rays from every element; auto follows from --epsilon and --quality"},
    {.name = "sky",
     .kind = OPTION_CUSTOM,
     .offset = FIELD(sky),
     .argument = "none|tregenza|reinhart:MF|grid:AxB",
     .preset = "none",
     .parse = parse_sky,
     .settled = kept_sky,
     .help = "Tiles of the sky that may light the store: 145, 144 MF^2 + 1, or A sectors by B bands"},
    {.name = "portal",
     .kind = OPTION_LIST,
     .offset = FIELD(portals),
     .argument = "GROUP",
     .otherwise = "the holes of the mesh, where little light leaves it",
     .settled = kept_sky,
     .help = "A group of faces in the plane of a window, at which rays for the sky are aimed; the faces "
             "neither block nor reflect light, and the store does not have them. May be repeated"},
    {0},
};

static const option_row form_factor_rows[] = {
    {.name = "resolution",
     .kind = OPTION_COUNT,
     .offset = FIELD(resolution),
     .argument = "PIXELS",
     .preset = "512",
     .least = HEMICUBE_RESOLUTION_LEAST,
     .most = HEMICUBE_RESOLUTION_MOST,
     .help = "Pixels along the top of a hemicube, an even number"},
    {.name = "quality",
     .kind = OPTION_WORD,
     .offset = FIELD(quality),
     .preset = "normal",
     .choices = precompute_quality_words,
     .help = "draft: rays whose noise is at most 1/2 of epsilon. normal and high: pair by pair, unoccluded "
             "factors by contour integrals and cubature, and rays for occlusion only, so many that they add "
             "little to the error of an operator of that epsilon; where there are too many pairs, near pairs "
             "so and other pairs by rays with a noise of 1/4 or 1/8 of epsilon"},
    {.name = "ground-albedo",
     .kind = OPTION_NUMBER,
     .offset = FIELD(ground_albedo),
     .argument = "X",
     .preset = "0",
     .least = 0,
     .most = 1,
     .settled = kept_sky,
     .help = "Share of the light of the sky that the ground below the horizon reflects"},
    {.name = "north",
     .kind = OPTION_NUMBER,
     .offset = FIELD(north),
     .argument = "DEGREES",
     .otherwise = "0, or that of the store",
     .least = -360,
     .most = 360,
     .help =
         "Where north is in the model, from +y (z up) or -z (y up) by east, that is clockwise from above: at "
         "90 it is +x. The store keeps it beside its --sky, and solve and lambertd turn sun and sky by it"},
    {.name = "keep-form-factors",
     .kind = OPTION_FLAG,
     .offset = FIELD(keep_form_factors),
     .help = "Keep the form factors in the store, for refined answers and for other operators of the same "
             "scene; blocks are kept as blocks, which other methods than hierarchical cannot use"},
    {0},
};

/* The help of these stands with the methods. */
static const option_row of_methods[] = {
    {.name = "emitters",
     .kind = OPTION_TEXT,
     .offset = FIELD(emitters),
     .argument = "FILE|group=NAME|sky|luminaires"},
    {.name = "receivers", .kind = OPTION_TEXT, .offset = FIELD(receivers), .argument = "GROUP|sensors,..."},
    {.name = "importance", .kind = OPTION_TEXT, .offset = FIELD(importance), .argument = "FILE"},
    {.name = "sources", .kind = OPTION_TEXT, .offset = FIELD(sources), .argument = "GROUP|luminaires,..."},
    {0},
};

static const option_row work_rows[] = {
    {.name = "threads",
     .kind = OPTION_COUNT,
     .offset = FIELD(threads),
     .argument = "T",
     .otherwise = "one per core",
     .least = 1,
     .most = 1024,
     .help = "Threads"},
    {.name = "memory",
     .kind = OPTION_SIZE,
     .offset = FIELD(memory),
     .argument = "SIZE",
     .otherwise = "70 % of the free memory",
     .help = "Memory to stay within, such as 500M or 16G"},
    OPTION_ROW_SEED(FIELD(seed), .help = "Seed of all sampling"),
    {.name = "quiet",
     .kind = OPTION_FLAG,
     .offset = FIELD(quiet),
     .help = "Print no log, no progress line and no outcome"},
    {.name = "progress",
     .kind = OPTION_FLAG,
     .offset = FIELD(progress),
     .help = "Print a progress line even if standard error is no terminal"},
    {0},
};

static const option_row resource_rows[] = {
    {.name = "scratch",
     .kind = OPTION_TEXT,
     .offset = FIELD(scratch),
     .argument = "DIR",
     .help = "Keep finished rows of form factors in this folder: the same command after a stop continues "
             "from them, and rows that do not fit into memory stay there"},
    {.name = "probes",
     .kind = OPTION_COUNT_AUTO,
     .offset = FIELD(probes),
     .argument = "P|auto",
     .preset = "auto",
     .least = 0,
     .most = 1e6,
     .help = "Single elements that the error is measured with; auto: 32 to 200, until the mean is certain or "
             "they take as long as the form factors; 0: no measurement"},
    {.name = "group-error",
     .kind = OPTION_NUMBER,
     .offset = FIELD(group_error),
     .argument = "X",
     .otherwise = "whatever --epsilon leaves",
     .most = 1,
     .above = true,
     .below = true,
     .help =
         "Largest stated error of the mean of any group over the light that is reflected there, by random "
         "emission and by single elements near and far, which up to --trials operators are built to "
         "keep"},
    {.name = "trials",
     .kind = OPTION_COUNT,
     .offset = FIELD(trials),
     .argument = "N",
     .preset = "3",
     .least = 1,
     .most = TRIALS_MOST,
     .help = "Operators that are built at most until the errors that --epsilon and --group-error ask for, or "
             "without both that of which precompute warns, are kept"},
    {.name = "time",
     .kind = OPTION_NUMBER,
     .offset = FIELD(time),
     .argument = "SECONDS",
     .otherwise = "as long as it takes",
     .above = true,
     .not_with = "epsilon|rays|quality|resolution|trials|emitters|scratch|group-error",
     .settled = found_factors,
     .help = "Take the form factors, rays and epsilon of the smallest error that is forecast to be ready "
             "within this time on this machine, the judge included, and log the options that stand for them"},
    {0},
};

static bool has_row(const option_row *rows, const char *name) {
    while (rows->name != NULL && strcmp(rows->name, name) != 0) rows++;
    return rows->name != NULL;
}

bool precompute_walks_ignore(const char *name) {
    const build_method *const made = method_find("emitters");
    return strcmp(name, "form-factors") == 0 || has_row(sample_rows, name) ||
           has_row(form_factor_rows, name) || has_row(resource_rows, name) || has_row(build_rows, name) ||
           (method_has_option(NULL, name) && !method_has_option(made, name));
}

static void add(precompute_tables *t, const char *heading, const option_row *rows, void *fields) {
    assert(t->n_tables + 1 < sizeof t->tables / sizeof *t->tables);
    t->tables[t->n_tables++] = (option_table){heading, rows, fields};
    t->tables[t->n_tables] = (option_table){.rows = NULL};
}

void precompute_tables_make(precompute_options *o, bool to_classify, precompute_tables *out) {
    *o = (precompute_options){.reflectance = -1, .north = NAN, .build = {.method = "auto"}};
    out->n_tables = 0;
    method_choices(out->methods);
    source_words(out->sources);
    out->source_rows[0] = (option_row){
        .name = "form-factors",
        .kind = OPTION_WORD,
        .offset = FIELD(form_factors),
        .preset = "auto",
        .choices = out->sources,
        .help = "Method that finds them. rays: pairs of elements, near ones or all, and rays, as "
                "--quality says. blocks: clusters of elements at a time, for scenes of large "
                "planes, or in which nothing hides anything. auto: blocks where the operator can "
                "be built from them and they cost less, by a sample of them, else rays"};
    out->source_rows[1] = (option_row){.name = NULL};
    out->method_rows[0] = (option_row){.name = "method",
                                       .kind = OPTION_CHOICE,
                                       .offset = FIELD(build.method),
                                       .preset = "auto",
                                       .choices = out->methods,
                                       .help = "Kind of operator"};
    out->method_rows[1] = (option_row){.name = NULL};
    if (!to_classify) add(out, NULL, output_rows, o);
    add(out, "mesh (preset: faces are divided until they fit the light)", mesh_rows, o);
    add(out, "form factors", sample_rows, o);
    if (!to_classify) {
        add(out, "", out->source_rows, o);
        add(out, "", form_factor_rows, o);
        add(out, "operator", out->method_rows, o);
    }
    add(out, to_classify ? "operator" : "", build_rows, &o->build);
    add(out, "", of_methods, o);
    for (size_t k = 0; method_at(k) != NULL; k++)
        if (method_at(k)->rows != NULL) add(out, method_at(k)->name, method_at(k)->rows, &o->build.of[k]);
    if (!to_classify) add(out, "resources", resource_rows, o);
    add(out, to_classify ? "resources" : "", work_rows, o);
}

void precompute_tables_add(precompute_tables *t, const option_row *rows, void *fields) {
    add(t, "", rows, fields);
}
