/* The first stages of a precompute: input, mesh, and a recipe for which memory suffices. */
#include "solver/base/atomic_file.h"
#include "solver/formfactor/facing.h"
#include "solver/operator/refine/form_factor_rows.h"
#include "solver/precompute/precompute_state.h"
#include "solver/scene/import/import.h"
#include "solver/scene/import/picture_files.h"
#include "store/groups.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* Single elements by which an operator is judged at most, unless --probes gives their number. */
enum { PROBES = 200 };

bool precompute_takes_as_store(const char *path) {
    static const unsigned char signature[8] = {0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};
    unsigned char start[8] = {0};
    char extension[16];
    struct stat about;
    atomic_file_extension(path, extension);
    if (strcmp(extension, "h5") == 0) return true;
    if (stat(path, &about) != 0 || !S_ISREG(about.st_mode)) return false;
    FILE *stream = fopen(path, "rb");
    if (stream == NULL) return false;
    const bool whole = fread(start, 1, sizeof start, stream) == sizeof start;
    fclose(stream);
    return whole && memcmp(start, signature, sizeof start) == 0;
}

static void log_warnings(terminal *t, const char *warnings) {
    while (*warnings != '\0') {
        const size_t length = strcspn(warnings, "\n");
        if (length > 0) terminal_warn(t, "%.*s", (int)length, warnings);
        warnings += length + (warnings[length] == '\n');
    }
}

static void warn_of_coincident(terminal *t, const coincident_report *found) {
    if (found->dropped > 0) terminal_warn(t, "%s", found->dropped_line);
    if (found->overlapping > 0) terminal_warn(t, "%s", found->overlap_line);
}

/* Turns faces; the hash of the source stays that of the file. Faces that lay back to back may be twins
 * then. */
static lam_status orient(precompute_state *state, lam_error *error) {
    lam_status status = LAM_OK;
    facing_turned turned;
    coincident_report found;
    TRY(facing_orient(&state->m, &state->progress, &turned, error));
    terminal_log(state->t, "%zu of %zu faces turned; for %zu the side was not decided", turned.turned,
                 state->m.n, turned.undecided);
    TRY(mesh_settle_coincident(&state->m, state->options->two_sided == SIDES_BOTH, &found, error));
    if (turned.turned > 0) warn_of_coincident(state->t, &found);
done:
    return status;
}

/* Settles which faces get a back, by --two-sided or by the materials, and says what these ask for. */
static lam_status choose_backs(precompute_state *state, lam_error *error) {
    const sides_asked asked = state->options->two_sided;
    mesh *const m = &state->m;
    size_t n = 0;
    if (asked == SIDES_BOTH) return mesh_mark_two_sided(m, error);
    for (size_t i = 0; m->has_back != NULL && i < m->n; i++) n += m->has_back[i];
    if (asked == SIDES_FRONTS || n == 0) {
        free(m->has_back);
        m->has_back = NULL;
        return LAM_OK;
    }
    terminal_log(state->t,
                 "%zu of %zu faces get a back, as their materials are double-sided; --two-sided=no leaves "
                 "these backs out",
                 n, m->n);
    return LAM_OK;
}

lam_status stage_load_scene(precompute_state *state, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = state->options;
    const import_options how = {.unit = o->unit,
                                .up = o->up != NULL ? o->up[0] : 0,
                                .reflectance = o->reflectance,
                                .two_sided = o->two_sided == SIDES_BOTH,
                                .assets = o->assets};
    import_report report = {0};
    TRY(scene_import(o->input, &how, &state->m, &report, error));
    log_warnings(state->t, report.warnings);
    if (report.dropped_faces > 0)
        terminal_log(state->t, "%zu face%s of zero area dropped", report.dropped_faces,
                     report.dropped_faces == 1 ? "" : "s");
    if (report.clamped > 0)
        terminal_log(state->t, "%zu material%s reflected all light or more, or nearly: set to .9999",
                     report.clamped, report.clamped == 1 ? "" : "s");
    warn_of_coincident(state->t, &report.coincident);
    TRY(state_take_portals(state, error));
    if (o->orient) TRY(orient(state, error));
    TRY(state_find_openings(state, error));
    TRY(choose_backs(state, error));
done:
    return status;
}

/* About how many elements there will be; never fewer than now. */
static double elements_after(const mesh *m, const precompute_options *o) {
    double n = (double)m->n, area = 0;
    if (o->max_edge > 0) {
        for (size_t i = 0; i < m->n; i++) area += m->area[i];
        n = fmax(n, area / (o->max_edge * o->max_edge));
    }
    size_t backs = 0;
    for (size_t i = 0; m->has_back != NULL && i < m->n; i++) backs += m->has_back[i];
    n *= 1 + (double)backs / (double)m->n;
    /* With --mesh-error they are the most, and nobody knows yet how many it takes. */
    return o->mesh_error > 0 ? n : fmax(n, (double)o->elements);
}

/* The options that decide. */
typedef struct choice_request {
    factor_quality quality;
    double epsilon;
    uint64_t rays;     /* OPTION_AUTO */
    size_t resolution; /* of hemicubes in place of rays; 0: none */
    uint64_t seed;
    size_t least_rays; /* of rays that are not given */
    bool plain;        /* no pairs */
    bool sky;          /* light that leaves the scene matters too */
    bool filtered;     /* the method takes out most of the noise of rays: few are enough */
    bool rounded;      /* all pairs follow epsilon */
} choice_request;

/* Above this number of elements all pairs take too long. */
enum { CHOICE_PAIRS_MOST = 32768 };

/* The accuracy that a quality stands for. */
typedef struct quality_level {
    double noise_share; /* of rays: part of epsilon that their noise may be */
    double filtered;    /* the same where the method takes most of it out again */
    double accuracy;    /* of pairs: standard error of a factor that is partly hidden; 0: plain rays */
} quality_level;

static const quality_level levels[] = {
    [QUALITY_DRAFT] = {1. / 2, 2.5, 0},
    [QUALITY_NORMAL] = {1. / 4, 1.25, 7e-5},
    /* A third of the 2e-4 that a partly hidden factor of .1 may be off by. */
    [QUALITY_HIGH] = {1. / 8, .625, 7e-6},
};

double state_finest_accuracy(void) {
    return levels[QUALITY_HIGH].accuracy;
}

/* Rays that keep the noise of the samples the quality's part below epsilon, or the number given. */
static size_t choice_rays(const choice_request *asked) {
    if (asked->rays != OPTION_AUTO) return (size_t)asked->rays;
    const quality_level *const level = &levels[asked->quality];
    const size_t rays =
        recipe_auto_rays(asked->epsilon, asked->filtered ? level->filtered : level->noise_share);
    return rays > asked->least_rays ? rays : asked->least_rays;
}

/* The recipe: hemicubes where they are asked for, plain rays where their number is given or at draft, else
 * pairs, all where that is affordable and else the near ones. */
static recipe choice_recipe(const choice_request *asked, bool all_pairs) {
    const quality_level *const level = &levels[asked->quality];
    recipe r = {.source = &source_rays, .rays = choice_rays(asked), .seed = asked->seed};
    if (asked->resolution > 0)
        return (recipe){.source = &source_hemicube, .resolution = asked->resolution, .seed = asked->seed};
    if (asked->rays != OPTION_AUTO || level->accuracy == 0 || asked->plain) return r;
    r.source = all_pairs ? &source_pairs : &source_near_pairs;
    r.accuracy = level->accuracy;
    if (all_pairs && asked->rounded) r.accuracy *= recipe_coarser(asked->epsilon);
    if (all_pairs && !asked->sky) r.rays = RECIPE_RAYS_FEW;
    return r;
}

bool state_keeps(const precompute_options *o) {
    return o->keep_form_factors;
}

/* Rows of more bytes than these are computed a second time for the judge, not held. */
static const double held_most = 0x1p26;

/* The method that n elements are going to get, as far as it is known before their form factors are; *final:
 * nothing in them can change it. A sky and the emitters of a file are not read yet. */
static lam_status expect_method(const precompute_state *state, double n, double noise,
                                const build_method **method, bool *final, lam_error *error) {
    lam_status status = LAM_OK;
    const build_problem problem = {.n = (size_t)n, .n_channels = state->m.n_channels, .noise = noise};
    decision d = {.n_candidates = 0};
    TRY(choose_method(&problem, &state->options->build, false, &d, error));
    *method = d.taken->method;
    *final = d.final;
done:
    decision_free(&d);
    return status;
}

static bool is_hemicube(const precompute_options *o) {
    return o->form_factors == FACTORS_HEMICUBE;
}

/* Rows that are kept are for other operators, too; and what an element sees of a sky is what its row leaves
 * of 1, on which all errors of the row fall. */
bool state_pairs_follow_epsilon(const precompute_state *state, const build_method *method) {
    const precompute_options *o = state->options;
    return !state_keeps(o) && !o->from_store && o->sky == NULL &&
           (method_has_option(method, "epsilon") || state->trial.asked > 0);
}

/* The request for a recipe. Beside hemicubes only the judge casts rays, and --quality is not about the judge.
 */
static choice_request request_of(const precompute_state *state) {
    const precompute_options *o = state->options;
    const bool hemicube = is_hemicube(o);
    return (choice_request){.quality = hemicube ? QUALITY_NORMAL : o->quality,
                            .epsilon = o->build.epsilon,
                            .rays = hemicube && !o->from_store ? OPTION_AUTO : o->rays,
                            .resolution = hemicube && !o->from_store ? (size_t)o->resolution : 0,
                            .seed = o->seed,
                            .least_rays = state->least_rays,
                            .plain = state->plain,
                            .sky = o->sky != NULL,
                            .filtered = (state->expected->flags & METHOD_FILTERS_NOISE) != 0,
                            .rounded = state_pairs_follow_epsilon(state, state->expected)};
}

/* Sets streamed where only a method that can use a stream asks for rows of n elements, and they would take
 * much memory. */
static lam_status choose_stream(precompute_state *state, double n, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = state->options;
    const double bytes = 8 * n * fmin(n, 2 * (double)state->recipe.rays);
    const bool kept = state_keeps(o) || o->from_store || o->scratch != NULL;
    const build_method *method;
    bool final;
    state->streamed = false;
    if (kept || state->holds || !ray_rows_can(&state->recipe) || !(bytes > held_most)) return LAM_OK;
    TRY(expect_method(state, n, recipe_noise(&state->recipe), &method, &final, error));
    state->streamed = final && (method->flags & METHOD_STREAMS);
done:
    return status;
}

recipe state_near_recipe(const precompute_state *state) {
    const choice_request asked = request_of(state);
    return choice_recipe(&asked, false);
}

recipe state_pairs_recipe(const precompute_state *state) {
    const choice_request asked = request_of(state);
    return choice_recipe(&asked, true);
}

recipe state_judge_recipe(const precompute_state *state, uint64_t seed) {
    const choice_request asked = request_of(state);
    recipe of = state->recipe;
    if (state->options->from_store && recipe_source(&of) == &source_rays && asked.rays != OPTION_AUTO)
        of.rays = (size_t)asked.rays;
    return recipe_of_judge(&of, choice_rays(&asked), seed);
}

/* Channels whose reflectances no earlier one has. */
static size_t count_own_channels(const mesh *m) {
    size_t own = 0;
    for (size_t c = 0; c < m->n_channels; c++) own += operator_like_channel(m->n, m->reflectance, c) == c;
    return own;
}

forecast state_forecast(const precompute_state *state, double n) {
    const precompute_options *o = state->options;
    panel_precision precision = PANEL_F32;
    (void)panel_precision_find(o->build.precision, &precision); /* one of the choices of the row */
    return (forecast){.n = (size_t)n,
                      .n_planes = state->tree.n_frames,
                      .n_channels = state->m.n_channels,
                      .n_own_channels = count_own_channels(&state->m),
                      .sky_tiles = state->sky_tiles,
                      .recipe = state->recipe,
                      .judge_recipe = state_judge_recipe(state, 0),
                      .cost = state->cost,
                      .probes = o->probes == OPTION_AUTO ? PROBES : o->probes,
                      .probes_least = o->probes == OPTION_AUTO ? PROBES_LEAST : 0,
                      .from_store = o->from_store,
                      .scratch = o->scratch != NULL,
                      .large = state->large,
                      .keep = state_keeps(o),
                      .streamed = state->streamed,
                      .emitters = state->emitters.s,
                      .method = state->expected,
                      .build = &o->build,
                      .precision = precision};
}

/* Tiles of the sky of a scene, or of the store that was loaded. */
static lam_status count_tiles(precompute_state *state, lam_error *error) {
    lam_status status = LAM_OK;
    sky_tiling tiling = {.n_tiles = state->f.sky.tiling.n_tiles};
    if (state->options->sky != NULL) TRY(sky_tiling_create(state->options->sky, state->m.up, &tiling, error));
    state->sky_tiles = tiling.n_tiles;
done:
    if (state->options->sky != NULL) sky_tiling_free(&tiling);
    return status;
}

static bool fits(const precompute_state *state, double n) {
    const forecast f = state_forecast(state, n);
    return forecast_bytes(&f) <= state->memory;
}

/* Chooses the recipe for n elements: all pairs where they are affordable, or no more than the rays that would
 * do, else rays; in memory, or, where there is a scratch folder and no other way, on disk. */
static lam_status choose_recipe(precompute_state *state, double n, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = state->options;
    bool final;
    TRY(count_tiles(state, error));
    if (n > 4e9)
        FAIL(error, LAM_ERR_MEMORY, "%s: %.3g elements, must be below 4e9; refine less", o->input, n);
    TRY(expect_method(state, n, 0, &state->expected, &final, error));
    const choice_request asked = request_of(state);
    const int disk_too = o->scratch != NULL,
              pairs_too = !state->dear && (n <= CHOICE_PAIRS_MOST || n <= (double)choice_rays(&asked));
    for (int way = 0; way <= 2 * disk_too + 1; way++) {
        const bool all_pairs = way % 2 == 0;
        if (all_pairs && !pairs_too) continue;
        state->large = way >= 2;
        state->recipe = o->from_store ? state->f.recipe : choice_recipe(&asked, all_pairs);
        TRY(choose_stream(state, n, error));
        if (fits(state, n)) break;
    }
done:
    return status;
}

/* The same; fails where none fits. */
static lam_status choose_recipe_that_fits(precompute_state *state, double n, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(choose_recipe(state, n, error));
    const forecast f = state_forecast(state, n);
    TRY(forecast_check(&f, state->memory, error));
done:
    return status;
}

/* Blocks take less memory than rows. Before the mesh is refined, where blocks may come, only that memory is
 * checked which the coarsest of them need. */
static lam_status check_before_mesh(precompute_state *state, double n, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(choose_recipe(state, n, error));
    forecast f = state_forecast(state, n);
    if (!fits(state, n) && state_may_have_blocks(state, n))
        f.recipe = f.judge_recipe = (recipe){.source = &source_blocks, .rays = 1, .accuracy = 1};
    TRY(forecast_check(&f, state->memory, error));
done:
    return status;
}

/* Blocks in place of the recipe so far, unless memory has room for rows alone. */
static lam_status try_blocks(precompute_state *state, lam_error *error) {
    lam_status status = LAM_OK;
    const double n = (double)state->m.n;
    const bool rows_fit = fits(state, n), asked = state->options->form_factors == FACTORS_BLOCKS;
    const build_method *method;
    bool final;
    if (!state_may_have_blocks(state, n)) return LAM_OK;
    TRY(expect_method(state, n, 0, &method, &final, error));
    TRY(state_choose_blocks(state, method, final, error));
    if (rows_fit && !asked && !fits(state, n)) TRY(choose_recipe(state, n, error));
done:
    return status;
}

lam_status state_weigh_rows(precompute_state *state, lam_error *error) {
    lam_status status = LAM_OK;
    if (state->cost.seconds > 0) return LAM_OK;
    TRY(state_weigh_pairs(state, error));
    if (state->dear) TRY(choose_recipe(state, (double)state->m.n, error));
done:
    return status;
}

/* The recipe of the mesh as it is now. Blocks come first: to weigh all pairs or near ones costs more than
 * blocks do in most rooms. */
static lam_status choose_final_recipe(precompute_state *state, lam_error *error) {
    lam_status status = LAM_OK;
    const double n = (double)state->m.n;
    TRY(choose_recipe(state, n, error));
    TRY(try_blocks(state, error));
    TRY(state_weigh_rows(state, error));
    const forecast f = state_forecast(state, n);
    TRY(forecast_check(&f, state->memory, error));
done:
    return status;
}

/* Rows go to the scratch folder as they are found, and whole samples where memory is too small for them. */
static lam_status open_scratch(precompute_state *state, lam_error *error) {
    if (state->scratch != NULL) return LAM_OK;
    state->t->nothing = state->options->continues;
    return scratch_open(state->options->scratch, &state->scratch, error);
}

/* A store has its rows: it needs the folder for the judge's only, or where memory is too small. */
lam_status stage_open_scratch(precompute_state *state, lam_error *error) {
    const precompute_options *o = state->options;
    if (o->scratch == NULL) return LAM_OK;
    if (state->probes > 0 || !o->from_store || state->large) return open_scratch(state, error);
    terminal_log(state->t, "a store with form factors does not use --scratch");
    return LAM_OK;
}

const large_place *state_large_place(const precompute_state *state) {
    return state->large ? scratch_place(state->scratch) : NULL;
}

lam_status stage_load_store(precompute_state *state, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    double *row_sums = NULL;
    form_factor_storage how = STORAGE_ROWS;
    TRY(store_open(state->options->input, &s, error));
    TRY(mesh_load(s, &state->m, &row_sums, error));
    if (store_has(s, STORE_FORM_FACTORS)) {
        TRY(form_factors_storage(s, &how, error));
        TRY(recipe_load(s, &recipe_of_form_factors, &state->f.recipe, error));
        TRY(choose_recipe_that_fits(state, (double)state->m.n, error));
    }
    if (state->large) TRY(open_scratch(state, error));
    if (how == STORAGE_BLOCKS && !state->holds) {
        TRY(state_load_blocks(state, s, error));
    } else {
        TRY(form_factors_load(s, &state->m, state_large_place(state), &state->f, error));
        TRY(form_factors_expand(&state->f, state->m.area, error));
    }
    if (store_has(s, STORE_SKY)) TRY(sky_bounce_load(s, state->m.n, &state->f.sky, error));
    if (state->options->reflectance >= 0) mesh_pictures_drop(&state->m);
    if (state->options->reflectance >= 0)
        for (size_t i = 0; i < state->m.n * state->m.n_channels; i++)
            state->m.reflectance[i] = (float)state->options->reflectance;
done:
    free(row_sums);
    store_close(s);
    return status;
}

lam_status stage_prepare_mesh(precompute_state *state, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = state->options;
    TRY(check_before_mesh(state, elements_after(&state->m, o), error));
    TRY(state_refine_mesh(state, error));
    state->order = memory_allocate(state->m.n, sizeof *state->order, "the order of the elements", error);
    if (state->order == NULL) TRY(LAM_ERR_MEMORY);
    TRY(mesh_z_order(&state->m, state->order, error));
    TRY(state_read_importance(state, error));
    if (o->time > 0) {
        TRY(stage_budget(state, error));
        o = state->options;
    }
    TRY(choose_final_recipe(state, error));
    if (recipe_source(&state->recipe) == &source_blocks && state->importance.n > 0 && state_keeps(o))
        FAIL(error, LAM_ERR_ARGUMENT,
             "--keep-form-factors: blocks that are found for %s serve nothing else; leave out one of "
             "both, or give --form-factors rays",
             state->importance.read != NULL ? "receivers" : "sources");
    const forecast f = state_forecast(state, (double)state->m.n);
    state->probes = forecast_probes(&f);
    if (state->probes > state->m.n) state->probes = state->m.n;
    if (o->emitters != NULL) {
        TRY(emitter_list_read(o->emitters, &state->m, state->sky_tiles, &state->emitters, error));
        TRY(choose_recipe_that_fits(state, (double)state->m.n, error));
    }
    state_log_mesh(state);
done:
    return status;
}
