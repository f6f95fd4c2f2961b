/* emitters: where only a few things can shine, the light of each of them is all there is to know (Aguerre
 * 2016, section 4.4.3). */
#include "solver/operator/emitters.h"
#include "solver/operator/luminaire_light.h"

#include "solver/base/clock.h"
#include "solver/method/choice.h"
#include "solver/method/emitters_options.h"
#include "solver/method/many_lights.h"
#include "solver/operator/sky_light.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FRAMES_MOST = 65536 };

/* Options of precompute that are about form factors, which walks find none of. */
#define NO_FORM_FACTORS "sky|portal|keep-form-factors|receivers|importance|sources|group-error|time"

static const option_row rows[] = {
    {.name = "emitters",
     .kind = OPTION_TEXT,
     .offset = offsetof(emitters_options, emitters),
     .argument = "FILE|group=NAME|sky|luminaires",
     .help = "The emissions that the store answers: each of a .json or .npy file, each of the groups "
             "NAME,NAME, every tile of --sky, or luminaires alone, which come beside all others too; "
             "--method auto then takes emitters"},
    {.name = "positions",
     .kind = OPTION_TEXT,
     .offset = offsetof(emitters_options, positions),
     .argument = "FILE.json",
     .not_with = "emitters|path|" NO_FORM_FACTORS,
     .help = "The positions of a light that is no part of the scene, an emitter each: found by random walks, "
             "without form factors"},
    {.name = "path",
     .kind = OPTION_TEXT,
     .offset = offsetof(emitters_options, path),
     .argument = "FILE.json",
     .not_with = "emitters|" NO_FORM_FACTORS,
     .help = "The same of a light that moves along a curve, in --frames positions"},
    {.name = "frames",
     .kind = OPTION_COUNT,
     .offset = offsetof(emitters_options, frames),
     .argument = "N",
     .otherwise = "it has to be given with --path",
     .least = 2,
     .most = FRAMES_MOST,
     .help = "Positions along --path, evenly by its length"},
    {.name = "reuse",
     .kind = OPTION_CHOICE,
     .offset = offsetof(emitters_options, reuse),
     .preset = "E",
     .choices = "A|B|C|D|E",
     .help =
         "Walks serve their own position (A) or every one: by a ray to each position (B), by maps of what "
         "each sees (C), or by hemicubes (D), all from the light; or from the elements that its direct "
         "light comes to, which rays find (E). A, B and E are unbiased; C and D are off where shadows "
         "have edges"},
    {.name = "paths",
     .kind = OPTION_COUNT,
     .offset = offsetof(emitters_options, paths),
     .argument = "N",
     .preset = "100000",
     .least = 1,
     .most = 1e9,
     .help = "Random walks from each position; the error falls with their square root"},
    {0},
};

static const char missing[] = "--method emitters: give --emitters FILE, group=NAME, sky or luminaires, or "
                              "--positions FILE, or --path FILE";

/* Residual at which the light of an emitter counts as converged: a few units of single precision. */
static const double tolerance = 1e-6;

/* Names of emitters, and those of luminaires behind them. */
static lam_status gather_names(const emitter_source *from, emitter_arrays *a, lam_error *error) {
    const char **all = memory_allocate(a->s, sizeof *all, "names of emitters", error);
    if (all == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < a->s; k++) all[k] = k < from->s ? from->names[k] : from->luminaires[k - from->s];
    const lam_status status = emitter_names_copy(a->s, all, &a->names, error);
    free(all);
    return status;
}

/* The emission of the elements themselves, without the zeros. */
static lam_status gather_emission(const build_problem *problem, emitter_arrays *a, lam_error *error) {
    const size_t n = problem->n, C = problem->n_channels, s = a->s, n_sent = problem->emitters->s;
    const float *E = problem->emitters->E;
    uint64_t entries = 0, at = 0;
    for (size_t k = 0; k < n_sent * C * n; k++) entries += E[k] > 0;
    a->ends = memory_allocate(C * s + 1, sizeof *a->ends, "emissions", error);
    a->elements = memory_allocate((size_t)entries, sizeof *a->elements, "emissions", error);
    a->values = memory_allocate((size_t)entries, sizeof *a->values, "emissions", error);
    if (a->ends == NULL || a->elements == NULL || a->values == NULL) return LAM_ERR_MEMORY;
    for (size_t row = 0; row < C * s; row++) {
        const float *of_one = E + (row % s * C + row / s) * n;
        for (size_t i = 0; row % s < n_sent && i < n; i++) {
            if (!(of_one[i] > 0)) continue;
            a->elements[at] = (uint32_t)i;
            a->values[at++] = of_one[i];
        }
        a->ends[row + 1] = at;
    }
    return LAM_OK;
}

/* The sky's radiances with the channels first, and the sky. */
static lam_status gather_sky(const build_problem *problem, emitter_arrays *a, lam_error *error) {
    const emitter_source *from = problem->emitters;
    const size_t C = problem->n_channels, s = a->s, m = from->n_tiles;
    if (from->L == NULL) return LAM_OK;
    a->n_tiles = m;
    a->L = memory_allocate(C * s, m * sizeof *a->L, "radiances", error);
    if (a->L == NULL) return LAM_ERR_MEMORY;
    for (size_t row = 0; row < C * s; row++) /* the radiances of luminaires stay 0 */
        if (row % s < from->s)
            memcpy(a->L + row * m, from->L + (row % s * C + row / s) * m, m * sizeof *a->L);
    return sky_create(m, problem->n, from->first_bounce, &a->sky, error);
}

/* Two arrays [s][n] of one channel: what is emitted, and what the sky and luminaires give directly. */
static void light_of_channel(const build_problem *problem, const emitter_arrays *a, size_t c, float *E,
                             float *H0) {
    const emitter_source *from = problem->emitters;
    const size_t n = problem->n, s = a->s;
    memset(E, 0, s * n * sizeof *E);
    for (size_t k = 0; k < from->s; k++)
        memcpy(E + k * n, from->E + (k * problem->n_channels + c) * n, n * sizeof *E);
    if (H0 == NULL) return;
    memset(H0, 0, s * n * sizeof *H0);
    if (a->L != NULL) lam_sky_irradiance(a->sky, s, a->L + c * s * a->n_tiles, H0);
    for (size_t k = 0; k < from->n_luminaires; k++)
        for (size_t i = 0; i < n; i++)
            H0[(from->s + k) * n + i] =
                (float)(from->factors[c * from->n_luminaires + k] * (double)from->H[k * n + i]);
}

static lam_status build(const build_problem *problem, const build_options *options, const void *own,
                        lam_operator **op, build_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n, C = problem->n_channels;
    const double started = clock_seconds();
    emitter_arrays a = {.s = 0};
    float *E = NULL, *H0 = NULL;
    double residual = 0;
    size_t sweeps = 0;
    (void)own;
    if (problem->emitters == NULL) FAIL(error, LAM_ERR_ARGUMENT, "%s", missing);
    const emitter_source *from = problem->emitters;
    const size_t s = a.s = emitter_source_count(from);
    TRY(gather_names(from, &a, error));
    TRY(gather_emission(problem, &a, error));
    TRY(gather_sky(problem, &a, error));
    if (from->n_luminaires > 0)
        TRY(luminaires_create(from->n_luminaires, n, C, from->H, from->factors, &a.luminaires, error));
    a.T = memory_allocate(C * s, n * sizeof *a.T, "light of emitters", error);
    E = memory_allocate(s, n * sizeof *E, "emissions", error);
    if (a.T == NULL || E == NULL) TRY(LAM_ERR_MEMORY);
    if (a.L != NULL || a.luminaires != NULL) {
        H0 = memory_allocate(s, n * sizeof *H0, "direct light", error);
        if (H0 == NULL) TRY(LAM_ERR_MEMORY);
    }
    for (size_t c = 0; c < C; c++) {
        many_lights_report made;
        light_of_channel(problem, &a, c, E, H0);
        const many_lights_input columns = {.n = n,
                                           .F = problem->F,
                                           .area = problem->area,
                                           .rho = problem->reflectance + c * n,
                                           .m = s,
                                           .E = E,
                                           .H0 = H0,
                                           .progress = options->progress,
                                           .stage = "emitters"};
        TRY(many_lights_solve(&columns, tolerance, a.T + c * s * n, &made, error));
        residual = made.residual > residual ? made.residual : residual;
        sweeps = made.sweeps > sweeps ? made.sweeps : sweeps;
    }
    TRY(operator_emitters_create(n, C, problem->reflectance, &a, op, error));
    report_number(report, "residual", residual);
    report_count(report, "sweeps", (double)sweeps);
    report_step_add(report, "invert", clock_seconds() - started);
    snprintf(report->detail, sizeof report->detail,
             "%zu asked for by --emitters%s, each converged to %.2g in %zu sweeps", s,
             from->n_luminaires > 0 ? " and --luminaires" : "", residual, sweeps);
done:
    emitter_arrays_free(&a);
    free(E);
    free(H0);
    return status;
}

static lam_status check(const void *own, lam_error *error) {
    lam_status status = LAM_OK;
    const emitters_options *o = own;
    if (o->path != NULL && o->frames == 0)
        FAIL(error, LAM_ERR_ARGUMENT, "--path: give --frames N too, the number of positions along it");
    if (o->path == NULL && o->frames > 0)
        FAIL(error, LAM_ERR_ARGUMENT, "--frames: is for --path FILE.json, which is not given");
    if (o->emitters == NULL && o->positions == NULL && o->path == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "%s", missing);
done:
    return status;
}

/* Light, emissions and what the sky gives of every emitter, and the vectors of a block that iterates. */
static void forecast(const method_scale *scale, const void *own, method_forecast *out) {
    const double n = scale->n, s = scale->n_emitters, C = scale->n_channels;
    (void)own;
    *out = (method_forecast){
        .building = 4 * n * (s * (3 * C + 2) + 7 * 32), .loaded = 4 * n * s * C, .stored = 4 * n * s * C};
}

static lam_status weigh(const decision *so_far, void *own, candidate *out, lam_error *error) {
    const build_problem *p = so_far->problem;
    (void)error;
    const emitters_options *o = own;
    if (p->emitters == NULL && o->emitters == NULL && !emitters_are_positions(o)) return LAM_OK;
    out->claim = CLAIM_INPUT;
    if (p->emitters == NULL) return LAM_OK;
    const size_t s = emitter_source_count(p->emitters);
    out->cost = (double)p->n * (double)s;
    if (p->emitters->n_luminaires > 0)
        snprintf(out->found, sizeof out->found, "--emitters names %zu, with %zu luminaires", s,
                 p->emitters->n_luminaires);
    else
        snprintf(out->found, sizeof out->found, "--emitters names %zu", s);
    return LAM_OK;
}

const build_method method_emitters = {
    .name = "emitters",
    .summary = "answers for the emitters of --emitters only",
    .kind = &operator_emitters,
    .rows = rows,
    .check = check,
    .forecast = forecast,
    .weigh = weigh,
    .build = build,
};
_Static_assert(sizeof(emitters_options) <= METHOD_OPTIONS_BYTES, "they fit");

const emitters_options *emitters_options_of(const build_options *options) {
    return method_own_const(options, &method_emitters);
}
