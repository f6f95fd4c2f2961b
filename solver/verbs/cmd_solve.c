/* lambert solve: lights a store and writes the answer. */
#include "solver/base/atomic_file.h"
#include "solver/base/terminal.h"
#include "solver/codec/request.h"
#include "solver/codec/stated_notes.h"
#include "solver/light/emission_refine.h"
#include "solver/output/output.h"
#include "solver/render/smooth.h"
#include "solver/verbs/own_error.h"
#include "solver/verbs/sensor_files.h"
#include "solver/verbs/sensor_own_error.h"
#include "solver/verbs/solve_faces.h"
#include "solver/verbs/solve_options.h"
#include "solver/verbs/solve_probes.h"
#include "solver/verbs/solve_sensors.h"
#include "solver/verbs/solve_texels.h"
#include "solver/verbs/store_error.h"
#include "solver/verbs/verbs.h"
#include "solver/verbs/year_error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define A_LEAP_YEAR (24. * 366)

static const option_command verb = {
    .name = "lambert solve",
    .arguments = "STORE",
    .summary = "Light a store and write its radiosity, irradiance or indirect light, element by element.",
    .least_arguments = 1,
    .most_arguments = 1,
};

/* Replaces the batch by figures of the year; *values is freed with free(). */
static lam_status solve_year(const annual_options *annual, const emission *light, const lam_operator *op,
                             const lam_sky *sky, size_t n_selected, const uint32_t *selected, terminal *t,
                             solution *out, float **values, lam_error *error) {
    lam_status status = LAM_OK;
    const progress steps = terminal_progress(t);
    annual_summary sum = {0};
    TRY(annual_apply(annual, light, op, sky, out->quantity, n_selected, selected, &steps, values, &sum,
                     error));
    terminal_log(t, "a year of %s: %zu vectors of %g h, %zu with light", codec_quantity_name(out->quantity),
                 sum.n, annual->hours, sum.lit);
    if (annual_has_shares(annual) || annual_has_sun(annual))
        terminal_log(t, "shares are of %zu vectors", sum.counted);
    if (annual->middle == NULL && (double)sum.n * annual->hours > A_LEAP_YEAR)
        terminal_warn(t, "%zu vectors of %g h are %.4g days; --hours-per-vector says how long each lasts",
                      sum.n, annual->hours, (double)sum.n * annual->hours / 24);
    if (sum.lit == 0) terminal_warn(t, "no vector has any light");
    out->n_vectors = annual->n_figures;
    out->batch = true;
done:
    return status;
}

/* Takes the times of weather for figures of a year. */
static lam_status take_span(const weather_span *span, const char *path, double given, annual_options *year,
                            lam_error *error) {
    lam_status status = LAM_OK;
    if (given > 0 && !span->apart && fabs(given - span->step) > .01 * span->step)
        FAIL(error, LAM_ERR_ARGUMENT,
             "--hours-per-vector %g: the rows of %s are %.4g h apart, which counts; leave the option out",
             given, path, span->step);
    if (given == 0 || !span->apart) year->hours = span->step;
    year->middle = span->middle;
done:
    return status;
}

static weather_hours hours_of(const weather_span *span) {
    const weather_mended *m = &span->mended;
    return (weather_hours){.counted = (double)span->n * span->step,
                           .left_out = m->skipped,
                           .filled = m->between + m->by_days + m->dark};
}

/* Puts refined values and their certificates into the solution, and the largest into the log. */
static void take_refined(const refined_light *refined, solution *out, double tolerance, terminal *t) {
    double certificate = 0;
    size_t iterations = 0;
    out->refined = refined->values;
    out->certificates = refined->certificates;
    out->iterations = refined->iterations;
    for (size_t v = 0; v < out->n_vectors; v++) {
        certificate = fmax(certificate, refined->certificates[v]);
        if (refined->iterations[v] > iterations) iterations = refined->iterations[v];
    }
    terminal_log(t,
                 "refined to %g: no %s is further than %.3g from that of the store's form factors; %zu "
                 "iteration%s%s",
                 tolerance, codec_quantity_name(out->quantity), certificate, iterations,
                 iterations == 1 ? "" : "s", out->n_vectors > 1 ? " at most" : "");
}

/* The answers at the corners of elements, *corners freed with free(). Emission varies from element to element
 * where it is given so, and not inside of one. */
static lam_status find_corners(const solution *s, const emission *light, float **corners, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t C = s->m->n_channels, all = C * s->m->n;
    const bool emits = s->quantity == LAM_RADIOSITY && s->names == NULL && light->E != NULL;
    smooth_nodes nodes = {0};
    float *made = memory_allocate(s->n_vectors, 4 * all * sizeof *made, "values at corners", error);
    if (made == NULL) TRY(LAM_ERR_MEMORY);
    TRY(smooth_nodes_create(s->m, &nodes, error));
    for (size_t v = 0; v < s->n_vectors; v++) {
        const float *E = emits ? light->E + (light->steady ? 0 : v * all) : NULL;
        TRY(terminal_check(error));
        TRY(smooth_corners(&nodes, s->m, C, s->values + v * all, E, made + 4 * v * all, error));
    }
    *corners = made;
    made = NULL;
done:
    smooth_nodes_free(&nodes);
    free(made);
    return status;
}

/* Adds the light of --weather to the light: of the elements selected, or of all. */
static lam_status add_weather(const solve_options *f, store *s, const mesh *m, size_t n_selected,
                              const uint32_t *selected, terminal *t, lit_store *lit, sunlight *sun,
                              sun_way *way, weather_span *span, lam_error *error) {
    /* Few emitters are refined by the light of their tiles alone. */
    const bool in_tiles = !f->sun_given && f->tolerance > 0 && lam_operator_emitters(lit->op) > 0;
    double north = 0;
    const lam_status status = sky_options_north(&f->light.at, s, &north, error);
    if (status != LAM_OK) return status;
    const light_kind kind = sky_options_kind(&f->light.at, NULL, m->lights);
    const weather_options hours = {.path = f->weather,
                                   .photometric = kind == LIGHT_PHOTOMETRIC,
                                   .exact = f->sun == SUN_EXACT && !in_tiles,
                                   .at_sensors = f->sensors != NULL && !f->sun_given && f->annual.count > 0,
                                   .sun_points = f->sun_points > 0     ? (size_t)f->sun_points
                                                 : f->annual.count > 0 ? SUN_POINTS_YEAR
                                                                       : SUN_POINTS,
                                   .gaps = f->gaps,
                                   .at = sky_options_moment(&f->light.at),
                                   .north = north,
                                   .way = way};
    const lam_status added = weather_light_add(&hours, s, m, lit->op, lit->sky, n_selected, selected, t,
                                               &lit->light, sun, span, error);
    if (added == LAM_OK) light_units_meet_sky(&lit->light, &lit->scene, kind);
    return added;
}

/* The arrays of an answer. */
typedef struct answers {
    annual_mean mean; /* of a year, where its sum alone is asked for */
    float *values, *corners;
    size_t *limited;
    refined_light refined;
    name_error *name_errors;
} answers;

static void answers_free(answers *a) {
    free(a->values);
    free(a->corners);
    free(a->limited);
    refined_light_free(&a->refined);
    free(a->name_errors);
    annual_mean_free(&a->mean);
}

/* The answers, and how many elements of each were limited. */
static lam_status answer(const solve_options *f, const lit_store *lit, size_t n_selected,
                         const uint32_t *selected, terminal *t, solution *out, answers *made,
                         lam_error *error) {
    lam_status status = LAM_OK;
    made->limited = memory_allocate(lit->light.n_vectors, sizeof *made->limited, "the solution", error);
    if (made->limited == NULL) TRY(LAM_ERR_MEMORY);
    TRY(emission_apply(&lit->light, lit->op, lit->sky, out->quantity, n_selected, selected, terminal_check,
                       &made->values, made->limited, error));
    if (!f->linear) out->limited = made->limited;
    light_log_limited(lit->light.n_vectors, made->limited, t);
done:
    return status;
}

/* True where the sum of a year is all that is asked for: it is linear in the light, and so has its error. */
static bool is_sum(const annual_options *year) {
    return year->n_figures == 1 && year->figures[0].is_sum;
}

/* The answers to each light, refined, or figures of a year, as the options ask for. */
static lam_status find_answers(const char *path, const solve_options *f, const annual_options *year,
                               const lit_store *lit, size_t n_selected, const uint32_t *selected, terminal *t,
                               solution *out, answers *made, lam_error *error) {
    lam_status status = LAM_OK;
    if (year->n_figures > 0) {
        annual_options figures = *year;
        const progress steps = terminal_progress(t);
        if (is_sum(year)) {
            TRY(annual_mean_find(&lit->light, lit->op, lit->sky, &steps, &made->mean, error));
            figures.mean = &made->mean.light;
        }
        TRY(solve_year(&figures, &lit->light, lit->op, lit->sky, n_selected, selected, t, out, &made->values,
                       error));
    } else if (f->tolerance > 0) {
        TRY(emission_refine(&lit->light, path, lit->op, lit->sky, out->quantity, f->tolerance, terminal_check,
                            &made->refined, error));
        take_refined(&made->refined, out, f->tolerance, t);
    } else {
        TRY(answer(f, lit, n_selected, selected, t, out, made, error));
    }
    out->values = made->values;
done:
    return status;
}

static lam_status put_out(const solution *out, const solve_options *f, lam_error *error) {
    if (f->output != NULL) return output_write(out, f->output, error);
    if (f->json) return output_print_json(out, error);
    output_print(out);
    return LAM_OK;
}

/* The names and units of an answer. */
typedef struct answer_words {
    const char *names[ANNUAL_MOST], *units[ANNUAL_MOST];
    char converted[LIGHT_CONVERSION_TEXT];
} answer_words;

/* Tells them to the solution, whose quantity is set: figures of a year have names and units of their own. */
static void take_words(const annual_options *year, const char *figure, const light_conversion *told,
                       answer_words *words, solution *out) {
    const bool leaves = out->quantity != LAM_IRRADIANCE;
    light_conversion_text(told, words->converted);
    out->converted_by = words->converted;
    out->unit = figure != NULL ? "%" : light_conversion_unit(told, leaves);
    if (annual_has_sum(year)) out->sum_unit = light_conversion_year(told, leaves);
    for (size_t k = 0; k < year->n_figures; k++) {
        words->names[k] = year->figures[k].name;
        words->units[k] = year->figures[k].is_sum                                ? out->sum_unit
                          : year->figures[k].is_sun && year->figures[k].most < 0 ? "h"
                                                                                 : "";
    }
    if (figure != NULL) {
        words->names[0] = "daylight_factor";
        words->units[0] = out->unit;
        out->named_as = "figures";
    }
    if (year->n_figures == 0 && figure == NULL) return;
    out->names = words->names;
    out->units = words->units;
}

/* Lets the solution see one channel of its mesh, which is that of the luminance. */
static void show_luminance(mesh *view, solution *out) {
    *view = *out->m;
    view->n_channels = 1;
    out->materials = out->m;
    out->m = view;
}

/* The answers in three channels become their luminance. */
static void take_luminance(size_t n, answers *made, mesh *view, solution *out) {
    if (made->values != NULL) answer_luminance(out->n_vectors, n, made->values);
    if (made->corners != NULL) answer_luminance(out->n_vectors, 4 * n, made->corners);
    if (made->refined.values != NULL)
        answer_luminance_double(out->n_vectors, n, made->refined.values, made->refined.certificates);
    show_luminance(view, out);
}

/* Views of both. */
static error_scene error_scene_of(const mesh *m, const emission_scene *scene) {
    return (error_scene){.n = m->n,
                         .n_channels = m->n_channels,
                         .n_groups = scene->groups.n_groups,
                         .area = m->area,
                         .reflectance = m->reflectance,
                         .start = scene->groups.start,
                         .members = scene->groups.elements,
                         .buried = scene->groups.buried};
}

/* Says that the scene's own light was taken; fails where it has none. */
static lam_status check_own(const char *path, const lit_store *lit, terminal *t, lam_error *error) {
    const mesh *m = lit->scene.m;
    if (!lit->own) return LAM_OK;
    if (emission_is_dark(&lit->light, m->n, m->n_channels, 1))
        return status_fail(error, LAM_ERR_ARGUMENT,
                           "%s: the scene has no light of its own; give --emit GROUP=V, --emission FILE%s%s",
                           path, lit->luminaires != NULL ? ", --dim NAME=V" : "",
                           lit->sky != NULL ? ", --sky FILE or --weather FILE" : "");
    terminal_log(t, "no --emit, --emission, --dim, --sky or --weather: the scene's own light");
    return LAM_OK;
}

/* A year needs more than one light. */
static lam_status check_batch(const annual_options *year, const emission *light, lam_error *error) {
    if (year->n_figures == 0 || light->batch) return LAM_OK;
    return status_fail(error, LAM_ERR_ARGUMENT,
                       "--annual is of a batch, one vector an hour, and this is one light; give --sky "
                       "[hours][tiles] or --weather");
}

/* Checks that the file or the folder of the answer can be written. */
static lam_status check_output(const solve_options *f, lam_error *error) {
    if (f->output == NULL) return LAM_OK;
    return f->sensors != NULL && sensor_results_named(f->output) ? sensor_results_check(f->output, error)
                                                                 : atomic_file_check(f->output, error);
}

/* The parts of a solve that tell the error of its answer. */
typedef struct error_asked {
    const stated_errors *stated;
    const error_scene *about;
    const lit_store *lit;
    const annual_options *year;
    const sun_way *way;
    size_t n_selected;
    const uint32_t *selected;
} error_asked;

/* The error of the light that was asked for, in place of that of the store: of one light or of a batch at
 * elements or sensors, or of the sum of a year at elements. */
static lam_status take_own_error(const error_asked *of, sensor_choice *sensors, solution *out, answers *made,
                                 lam_error *error) {
    const bool at_sensors = sensors->all != NULL;
    if (made->values != NULL && of->year->n_figures == 0)
        return at_sensors ? sensor_error_take(of->stated, of->about, of->lit, sensors, out, error)
                          : own_error_take(of->stated, of->about, of->lit, of->n_selected, of->selected, out,
                                           &made->name_errors, error);
    if (!is_sum(of->year) || at_sensors) return LAM_OK;
    return year_error_take(of->stated, of->about, of->lit, &made->mean.light, of->way,
                           (double)of->lit->light.n_vectors * of->year->hours / 1000, of->n_selected,
                           of->selected, out, &made->name_errors, error);
}

static lam_status open_sensors(store *s, const mesh *m, const solve_options *f, const annual_options *year,
                               sensor_choice *out, lam_error *error) {
    lam_status status = LAM_OK;
    const bool linear = f->figure == NULL && (year->n_figures == 0 || is_sum(year));
    TRY(sensor_choice_open(s, m, f->sensors, out, error));
    TRY(solve_probes_check(out, linear, f->output, error));
    if (f->at_least != NULL) TRY(sensor_choice_least(f->at_least, out, error));
done:
    return status;
}

/* An answer of which no error is known yet. */
static solution solution_of(const mesh *m, const lit_store *lit, const char *scene, lam_quantity quantity,
                            bool tells_parts) {
    return (solution){.m = m,
                      .by_luminance = lit->light.by_luminance,
                      .groups = &lit->scene.groups,
                      .scene = scene,
                      .quantity = quantity,
                      .n_vectors = lit->light.n_vectors,
                      .batch = lit->light.batch,
                      .relative = -1,
                      .indirect = -1,
                      .tells_parts = tells_parts};
}

static lam_status solve(const char *path, const solve_options *f, const annual_options *year,
                        reduction *reductions, size_t n_reductions, terminal *t, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    mesh m = {0};
    lit_store lit = {0};
    lam_quantity quantity = LAM_RADIOSITY;
    answers made = {.values = NULL};
    face_index faces = {.n_faces = 0};
    char *scene = NULL;
    uint32_t *selected = NULL;
    size_t n_selected = 0;
    stated_errors stated = {.n = 0};
    error_scene about = {.n = 0};
    sunlight sun = {0};
    sun_way way = {.n = 0};
    weather_span span = {0};
    weather_hours hours;
    mesh one_channel;
    answer_words words;
    annual_options figures = *year;
    sensor_choice sensors = {.all = NULL};
    TRY(check_output(f, error));
    TRY(store_open(path, &s, error));
    TRY(store_get_text(s, "/", "name", &scene, error));
    TRY(mesh_load(s, &m, NULL, error));
    if (f->at == AT_FACES) TRY(solve_faces_find(path, &m, &faces, error));
    TRY(light_open(s, &m, &f->light, f->weather != NULL, &lit, error));
    if (f->linear) lit.light.limiter = NULL;
    if (f->sensors != NULL) TRY(open_sensors(s, &m, f, year, &sensors, error));
    lit.light.sensors = sensors.all;
    TRY(reductions_bind(reductions, n_reductions, &lit.scene.groups, error));
    TRY(check_own(path, &lit, t, error));
    about = error_scene_of(&m, &lit.scene);
    /* With --reduce only figures are written, also with -o. */
    TRY(reductions_elements(&m, reductions, n_reductions, &n_selected, &selected, error));
    TRY(stated_errors_read(s, &about, lit.op, &stated, error));
    about.read = stated.read;
    about.emits = stated.emits;
    if (f->weather != NULL) {
        /* The error of an answer is told by all that the sun shines on. */
        const bool some = year->n_figures > 0;
        TRY(add_weather(f, s, &m, some ? n_selected : 0, some ? selected : NULL, t, &lit, &sun,
                        is_sum(year) && sensors.all == NULL ? &way : NULL, &span, error));
        TRY(take_span(&span, f->weather, f->hours, &figures, error));
        sensors.begins = span.begins;
    }
    TRY(light_convert(&f->light, f->weather != NULL ? &sun : &lit.sun, &way, &lit, error));
    if (sensors.all != NULL && lit.light.sun != NULL)
        TRY(sunlight_at_sensors(f->weather != NULL ? &sun : &lit.sun, s, &m, sensors.all, error));
    light_log(&lit, t);
    figures.luminance = lit.told.luminance && year->n_figures > 0 && !is_sum(year);
    TRY(check_batch(year, &lit.light, error));
    TRY(terminal_check(error));
    codec_quantity_find(f->quantity, strlen(f->quantity), &quantity);
    solution out = solution_of(&m, &lit, scene, quantity, f->verbose);
    out.reductions = reductions;
    out.n_reductions = n_reductions;
    hours = hours_of(&span);
    if (f->weather != NULL) out.hours = &hours;
    if (f->tolerance == 0 && (sensors.all == NULL || year->n_figures == 0) && f->at != AT_TEXELS)
        store_error_take(&stated, &lit.light, sensors.all != NULL, n_selected, selected, t, &out);
    take_words(year, f->figure, &lit.told, &words, &out);
    if (f->at == AT_TEXELS) {
        TRY(solve_texels(s, &m, &lit, f->texel, f->output, &out, t, error));
        goto done;
    }
    TRY(find_answers(path, f, &figures, &lit, n_selected, selected, t, &out, &made, error));
    if (figures.luminance) show_luminance(&one_channel, &out);
    TRY(take_own_error(&(error_asked){&stated, &about, &lit, &figures, &way, n_selected, selected}, &sensors,
                       &out, &made, error));
    if (f->smooth) TRY(find_corners(&out, &lit.light, &made.corners, error));
    out.corners = made.corners;
    if (f->at == AT_FACES) TRY(solve_faces_take(&faces, &made.values, &made.refined, &out, error));
    const size_t width = sensors.all != NULL ? lam_sensors_count(sensors.all) : output_width(&out);
    if (lit.told.luminance && !figures.luminance) take_luminance(width, &made, &one_channel, &out);
    TRY(reductions_fill(&out, error));
    TRY(sensors.all == NULL ? put_out(&out, f, error)
                            : solve_sensors_put(&sensors, &out, &lit.light, (const double(*)[3])span.suns,
                                                f->output, f->json, error));
done:
    free(scene);
    free(selected);
    stated_errors_free(&stated);
    answers_free(&made);
    face_index_free(&faces);
    sunlight_free(&sun);
    sun_way_free(&way);
    weather_span_free(&span);
    light_close(&lit);
    sensor_choice_free(&sensors);
    mesh_free(&m);
    store_close(s);
    return status;
}

int cmd_solve(int argc, char **argv) {
    solve_options f = {.light.signs = true, .light.at.north = NAN};
    option_result given = {0};
    lam_error error = {0};
    terminal term;
    annual_options year = {.hours = 1, .from = 0, .to = 24};
    char formats[OUTPUT_FORMATS], output_help[2 * OUTPUT_FORMATS];
    output_formats(OUTPUT_ELEMENTS, formats);
    snprintf(output_help, sizeof output_help,
             "%s, or .exr of --at texels; without it the mean of every group is printed", formats);
    const option_row output_rows[] = {
        OPTION_ROW_OUTPUT(offsetof(solve_options, output), "FILE", .help = output_help), {0}};
    const option_table tables[] = {
        {NULL, output_rows, &f},
        {LIGHT_HEADING, light_rows, &f.light},
        {"", solve_weather_rows, &f},
        {"", sky_time_rows, &f.light.at},
        {"", sky_named_rows, &f.light.at},
        {"answer", solve_answer_rows, &f},
        {"a year: figures of each element over a batch of skies or emissions, in place of the batch",
         solve_year_rows, &f},
        {0}};
    int code = options_parse(&verb, tables, argc, argv, &given);
    if (code != OPTIONS_GO) return code;
    if (solve_options_check(&f, &given, &year, &error) != LAM_OK)
        return options_usage(verb.name, "%s", error.message);
    reduction reductions[OPTION_LIST_MAX] = {0};
    size_t n_reductions = 0;
    lam_status status = LAM_OK;
    for (size_t i = 0; status == LAM_OK && i < f.reduce.count; i++)
        status = reductions_add(reductions, &n_reductions, f.reduce.items[i], &error);
    if (status != LAM_OK) {
        code = options_usage(verb.name, "%s", error.message);
    } else {
        terminal_open(&term, verb.name, false, false);
        status = solve(given.arguments[0], &f, &year, reductions, n_reductions, &term, &error);
        code = status == LAM_OK ? 0 : terminal_fail(&term, &error);
    }
    reductions_free(reductions, n_reductions);
    return code;
}
