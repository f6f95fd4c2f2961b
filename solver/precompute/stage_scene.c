/* The first stages of a precompute: what comes in, its mesh, and whether memory holds what is to come. */
#include "solver/base/atomic_file.h"
#include "solver/method/classify.h"
#include "solver/precompute/precompute_state.h"
#include "solver/scene/import/import.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* Above this many elements a probe is dear: fewer are measured at defaults. */
enum { PROBES = 200, PROBES_OF_LARGE = 32, LARGE = 10240 };

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

lam_status work_load_scene(work *w, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = w->options;
    const import_options how = {.unit = o->unit, .up = o->up, .reflectance = o->reflectance};
    import_report report = {0};
    TRY(scene_import(o->input, &how, &w->m, &report, error));
    log_warnings(w->t, report.warnings);
    if (report.dropped_faces > 0)
        terminal_log(w->t, "%zu faces of zero area were dropped", report.dropped_faces);
    if (report.clamped > 0)
        terminal_log(w->t, "%zu materials reflected all light or more: set below 1", report.clamped);
done:
    return status;
}

/* About how many elements there will be; never fewer than now. */
static double elements_after(const mesh *m, const precompute_options *o) {
    const mesh_refinement *how = &o->refinement;
    double n = (double)m->n, area = 0;
    if (how->subdivide_levels > 0) n *= pow(4, how->subdivide_levels);
    if (how->max_edge > 0) {
        for (size_t i = 0; i < m->n; i++) area += m->area[i];
        n = fmax(n, area / (how->max_edge * how->max_edge));
    }
    if (o->two_sided) n *= 2;
    return fmax(n, (double)how->elements);
}

bool work_is_low_rank(const precompute_options *o) {
    return o->rank > 0 || o->keep_factors || o->precision != PANEL_F32 || strcmp(o->factorizer, "auto") != 0;
}

/* Whether the operator is going to be a hierarchical one: auto takes another one of large scenes where F is
 * sparse and well known alone. */
static bool is_hierarchical(const precompute_options *o, double n) {
    if (strcmp(o->method, "auto") != 0) return strcmp(o->method, "hierarchical") == 0;
    return n > CLASSIFY_SMALL && o->emitters == NULL && !work_is_low_rank(o);
}

/* Bytes of rows from which on they are rather found twice, where a judge needs them, than held. */
static const double held_most = 0x1p26;

/* Whether nobody but a hierarchical operator asks for rows of n elements, and they would take much memory. */
static bool streams(const work *w, double n) {
    const precompute_options *o = w->options;
    const double bytes = 8 * n * fmin(n, 2 * (double)w->recipe.rays);
    const bool kept = o->keep_form_factors || o->compress_form_factors || o->from_store || o->scratch != NULL;
    if (kept || w->holds || !ray_rows_can(&w->recipe) || !(bytes > held_most)) return false;
    if (strcmp(o->method, "auto") != 0) return strcmp(o->method, "hierarchical") == 0;
    /* What auto would take without a look at F: the whole inverse is too large, a sparse one would be noise.
     */
    return is_hierarchical(o, n) && n > CLASSIFY_EXACT_MOST && o->threshold == 0 &&
           recipe_noise(&w->recipe) > o->epsilon;
}

/* What was asked for, and what the method makes of it. */
static choice_request asked_of(const precompute_options *o, double n) {
    choice_request asked = o->form_factors;
    asked.filtered = is_hierarchical(o, n);
    return asked;
}

recipe work_judge_recipe(const work *w, uint64_t seed) {
    const choice_request asked = asked_of(w->options, (double)w->m.n);
    const recipe *of = &w->recipe;
    recipe r = recipe_of_judge(of, choice_rays(&asked), seed);
    if (w->options->from_store && r.method == RECIPE_RAYS && asked.rays != CHOICE_AUTO)
        r.rays = (size_t)asked.rays;
    return r;
}

/* Columns of the operator where they are known before: the patches of 2msc without its options are. */
static size_t likely_rank(const precompute_options *o, double n) {
    const bool by_size = o->coherence <= 0 && o->min_area <= 0;
    if (o->rank > 0 || strcmp(o->method, "2msc") != 0 || !by_size) return o->rank;
    return (size_t)ceil(n / 16);
}

forecast work_forecast(const work *w, double n) {
    const precompute_options *o = w->options;
    return (forecast){.n = (size_t)n,
                      .n_channels = w->m.n_channels,
                      .sky_tiles = w->sky_tiles,
                      .recipe = w->recipe,
                      .judge_recipe = work_judge_recipe(w, 0),
                      .probes = o->probes == PRECOMPUTE_AUTO ? PROBES_OF_LARGE : o->probes,
                      .from_store = o->from_store,
                      .scratch = o->scratch != NULL,
                      .large = w->large,
                      .keep = o->keep_form_factors,
                      .compress = o->compress_form_factors,
                      .exact = strcmp(o->method, "exact") == 0,
                      .rank = likely_rank(o, n),
                      .emitters = w->emitters.s,
                      .sparse = strcmp(o->method, "sparse") == 0,
                      .hierarchical = is_hierarchical(o, n),
                      .streamed = w->streamed,
                      .epsilon = o->epsilon,
                      .precision = o->precision};
}

/* Chooses the recipe for n elements and sees that it fits. */
static lam_status check_memory(work *w, double n, lam_error *error) {
    const precompute_options *o = w->options;
    sky_tiling tiling = {.n_tiles = w->f.sky.tiling.n_tiles};
    if (o->sky != NULL) {
        const lam_status status = sky_tiling_create(o->sky, w->m.up, &tiling, error);
        if (status != LAM_OK) return status;
    }
    w->sky_tiles = tiling.n_tiles;
    sky_tiling_free(&tiling);
    if (n > 4e9)
        return status_fail(error, LAM_ERR_MEMORY, "%s: %.3g elements, must be below 4e9; refine less",
                           o->input, n);
    const choice_request asked = asked_of(o, n);
    forecast f;
    /* All pairs where they are affordable, or no more than the rays that would do, and the disk in place of
     * memory only where there is no other way. */
    const int disk_too = o->scratch != NULL,
              pairs_too = n <= CHOICE_PAIRS_MOST || n <= (double)choice_rays(&asked);
    for (int way = 0; way <= 2 * disk_too + 1; way++) {
        const bool all_pairs = way % 2 == 0;
        if (all_pairs && !pairs_too) continue;
        w->large = way >= 2;
        w->recipe = o->from_store ? w->f.recipe : choice_recipe(&asked, all_pairs);
        w->streamed = streams(w, n);
        f = work_forecast(w, n);
        if (forecast_bytes(&f) <= w->memory) break;
    }
    return forecast_check(&f, w->memory, error);
}

/* Rows go to the scratch folder as they are found, and whole samples where memory is too small for them. */
static lam_status open_scratch(work *w, lam_error *error) {
    if (w->scratch != NULL) return LAM_OK;
    w->t->nothing = w->options->continues;
    return scratch_open(w->options->scratch, &w->scratch, error);
}

/* A store has its rows: it needs the folder for the judge's only, or where memory is too small. */
lam_status work_take_scratch(work *w, lam_error *error) {
    const precompute_options *o = w->options;
    if (o->scratch == NULL) return LAM_OK;
    if (w->probes > 0 || !o->from_store || w->large) return open_scratch(w, error);
    terminal_log(w->t, "a store with form factors does not use --scratch");
    return LAM_OK;
}

const large_place *work_large_place(const work *w) {
    return w->large ? scratch_place(w->scratch) : NULL;
}

lam_status work_load_store(work *w, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    double *row_sums = NULL;
    TRY(store_open(w->options->input, &s, error));
    TRY(mesh_load(s, &w->m, &row_sums, error));
    if (store_has(s, "/form_factors")) {
        TRY(recipe_load(s, &recipe_of_form_factors, &w->f.recipe, error));
        TRY(check_memory(w, (double)w->m.n, error));
    }
    if (w->large) TRY(open_scratch(w, error));
    TRY(form_factors_load(s, &w->m, work_large_place(w), &w->f, error));
    TRY(form_factors_expand(&w->f, w->m.area, error));
    if (store_has(s, "/sky")) TRY(sky_bounce_load(s, w->m.n, &w->f.sky, error));
    if (w->options->reflectance >= 0)
        for (size_t i = 0; i < w->m.n * w->m.n_channels; i++)
            w->m.reflectance[i] = (float)w->options->reflectance;
done:
    free(row_sums);
    store_close(s);
    return status;
}

lam_status work_prepare_mesh(work *w, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = w->options;
    mesh_refinement refinement = o->refinement;
    /* --elements counts both sides. */
    if (o->two_sided) refinement.elements = (refinement.elements + 1) / 2;
    TRY(check_memory(w, elements_after(&w->m, o), error));
    if (refinement.subdivide_levels > 0 || refinement.max_edge > 0 || refinement.elements > 0)
        TRY(mesh_refine(&w->m, &refinement, error));
    if (o->two_sided) TRY(mesh_make_two_sided(&w->m, error));
    TRY(check_memory(w, (double)w->m.n, error));
    w->order = memory_allocate(w->m.n, sizeof *w->order, "the order of the elements", error);
    if (w->order == NULL) TRY(LAM_ERR_MEMORY);
    TRY(mesh_z_order(&w->m, w->order, error));
    w->probes = o->probes != PRECOMPUTE_AUTO ? o->probes : w->m.n > LARGE ? PROBES_OF_LARGE : PROBES;
    if (w->probes > w->m.n) w->probes = w->m.n;
    if (o->emitters != NULL) {
        TRY(emitter_wish_read(o->emitters, &w->m, w->sky_tiles, &w->emitters, error));
        TRY(check_memory(w, (double)w->m.n, error));
    }
    terminal_log(w->t, "%zu elements in %zu groups, %zu channel%s%s", w->m.n, w->m.n_groups, w->m.n_channels,
                 w->m.n_channels == 1 ? "" : "s", w->m.two_sided ? ", two-sided" : "");
done:
    return status;
}
