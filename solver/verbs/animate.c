#include "solver/verbs/animate.h"

#include "solver/base/clock.h"
#include "solver/codec/request.h"
#include "solver/light/emission_apply.h"
#include "solver/operator/emitters.h"
#include "solver/render/video.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Memory for the answers of a batch and the work on them, and the most frames of one. */
enum { BATCH_BYTES = 256 << 20, BATCH_MOST = 64 };

typedef struct animation {
    const render_options *f;
    render_view view;
    lit_store lit;
    lam_quantity quantity;
    emission_pass pass;
    float *values; /* [pass.most][C][n], the answers of a batch */
    size_t written, clamped;
    frame_names names;
    picture_options style;
    picture_light *sum; /* of the frames that were measured */
    raster coarse, pixels;
    double solving, measuring, drawing; /* seconds */
} animation;

static void animation_free(animation *a) {
    raster_free(&a->coarse);
    raster_free(&a->pixels);
    free(a->sum);
    free(a->values);
    emission_pass_free(&a->pass);
    light_close(&a->lit);
    render_view_close(&a->view);
}

/* The frame that one thread works on. Freed by frame_free, also after an error. */
typedef struct frame {
    const float *values; /* [C][n], borrowed */
    float *E, *H0;       /* [C][n], of a store of emitters; else NULL */
    bool *glows;
    shade *shown;
} frame;

static void frame_free(frame *at) {
    free(at->E);
    free(at->H0);
    free(at->glows);
    shade_destroy(at->shown);
}

/* Finds what elements emit by themselves in frame k, NULL in *E where that shows in no picture. Weights stand
 * for the emission of their emitters. */
static lam_status own_emission(const animation *a, size_t k, frame *at, const float **E, lam_error *error) {
    lam_status status = LAM_OK;
    const emission *light = &a->lit.light;
    const size_t n = a->view.m.n, C = a->view.m.n_channels, s = lam_operator_emitters(a->lit.op);
    *E = NULL;
    if (a->quantity != LAM_RADIOSITY) goto done;
    if (light->E != NULL) *E = light->E + (light->steady ? 0 : k * C * n);
    if (light->W == NULL) goto done;
    at->E = memory_allocate(C, n * sizeof *at->E, "the emission of a frame", error);
    at->H0 = memory_allocate(C, n * sizeof *at->H0, "the sky of a frame", error);
    if (at->E == NULL || at->H0 == NULL) TRY(LAM_ERR_MEMORY);
    TRY(operator_emitters_light(a->lit.op, 1, light->W + (light->steady ? 0 : k * C * s), at->E, at->H0,
                                error));
    for (size_t i = 0; *E != NULL && i < C * n; i++) at->E[i] += (*E)[i];
    *E = at->E;
done:
    return status;
}

/* Makes the light of frame k ready to be looked at. */
static lam_status frame_create(const animation *a, size_t k, const float *values, frame *at,
                               lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &a->view.m;
    const float *E;
    at->values = values;
    at->glows = memory_allocate(m->n, sizeof *at->glows, "glowing elements", error);
    if (at->glows == NULL) TRY(LAM_ERR_MEMORY);
    TRY(own_emission(a, k, at, &E, error));
    render_mark_glowing(m, values, E, at->glows);
    TRY(render_view_shade(&a->view, m->n_channels, values, E, &at->shown, error));
done:
    return status;
}

static bool is_dark(size_t count, const float *values) {
    for (size_t i = 0; i < count; i++)
        if (values[i] > 0) return false;
    return true;
}

/* Adds a frame to the light of the sequence. A dark one says nothing about exposure. */
static lam_status measure_frame(animation *a, size_t k, const frame *at, lam_error *error) {
    (void)k;
    picture_light *own = memory_allocate(1, sizeof *own, "the exposure", error);
    if (own == NULL) return LAM_ERR_MEMORY;
    if (!is_dark(a->view.m.n * a->view.m.n_channels, at->values))
        picture_measure(&a->coarse, at->shown, at->glows, own);
#pragma omp critical(animate_sum)
    picture_light_add(&a->sum[0], own);
    free(own);
    return LAM_OK;
}

static lam_status write_frame(animation *a, size_t k, const frame *at, lam_error *error) {
    lam_status status = LAM_OK;
    render_sheet sheet = {.picture = {0}};
    size_t clamped;
    char *name = NULL;
    TRY(frame_name(&a->names, k + 1, &name, error));
    TRY(render_sheet_create(a->f, &a->style, shade_channels(at->shown), &sheet, error));
    if (a->view.exr)
        picture_values_fill(&a->pixels, at->shown, &sheet.values);
    else
        TRY(picture_fill(&a->pixels, at->shown, &a->style, &sheet.picture, error));
    TRY(render_sheet_write(a->f, &a->style, render_unit(a->f, &a->lit), &sheet, name, &clamped, error));
#pragma omp atomic
    a->written++;
#pragma omp atomic
    a->clamped += clamped;
done:
    render_sheet_free(&sheet);
    free(name);
    return status;
}

typedef lam_status frame_work(animation *a, size_t k, const frame *at, lam_error *error);

/* Does the work of the frames first ... first + now - 1, whose answers are there, each by one thread. */
static lam_status each_of_batch(animation *a, size_t first, size_t now, frame_work *work, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t row = a->view.m.n * a->view.m.n_channels;
#pragma omp parallel for schedule(dynamic)
    for (size_t k = 0; k < now; k++) {
        lam_error why = {.message = ""};
        frame at = {.values = NULL};
        lam_status went;
        bool stop;
#pragma omp critical(animate_status)
        stop = status != LAM_OK;
        if (stop) continue;
        went = terminal_check(&why);
        if (went == LAM_OK) went = frame_create(a, first + k, a->values + k * row, &at, &why);
        if (went == LAM_OK) went = work(a, first + k, &at, &why);
        frame_free(&at);
        if (went == LAM_OK) continue;
#pragma omp critical(animate_status)
        if (status == LAM_OK) {
            status = went;
            *error = why;
        }
    }
    return status;
}

/* Solves all frames, a batch at a time, and does the work of each. */
static lam_status each_frame(animation *a, const char *stage, frame_work *work, double *seconds, terminal *t,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const progress steps = terminal_progress(t);
    const size_t n_frames = a->lit.light.n_vectors;
    for (size_t first = 0; first < n_frames; first += a->pass.most) {
        const size_t left = n_frames - first, now = left < a->pass.most ? left : a->pass.most;
        size_t vectors[BATCH_MOST];
        double began = clock_seconds();
        for (size_t k = 0; k < now; k++) vectors[k] = first + k;
        progress_report(&steps, stage, (double)first / (double)n_frames);
        TRY(terminal_check(error));
        TRY(emission_pass_solve(&a->pass, now, vectors, a->values, error));
        a->solving += clock_seconds() - began;
        began = clock_seconds();
        TRY(each_of_batch(a, first, now, work, error));
        *seconds += clock_seconds() - began;
    }
done:
    return status;
}

/* The mean of n vectors [width], which is one vector. */
static lam_status mean_of(size_t n, size_t width, const float *from, float **out, lam_error *error) {
    if (from == NULL) return LAM_OK;
    float *mean = memory_allocate(width, sizeof *mean, "the mean of frames", error);
    if (mean == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < width; i++) {
        double sum = 0;
        for (size_t k = 0; k < n; k++) sum += (double)from[k * width + i];
        mean[i] = (float)(sum / (double)n);
    }
    *out = mean;
    return LAM_OK;
}

/* Marks the elements [n] that any frame lights: light is linear, so these are lit by the mean of the frames.
 */
static lam_status mark_lit(const animation *a, bool *lit, lam_error *error) {
    lam_status status = LAM_OK;
    const emission *all = &a->lit.light;
    const size_t C = a->view.m.n_channels, n = a->view.m.n, steady = all->steady ? 1 : all->n_vectors;
    const size_t m = all->L != NULL ? lam_sky_tiles(a->lit.sky) : 0;
    emission mean = {.n_vectors = 1, .limiter = all->limiter, .luminaires = all->luminaires};
    float *values = NULL;
    TRY(mean_of(steady, C * n, all->E, &mean.E, error));
    TRY(mean_of(steady, C * lam_operator_emitters(a->lit.op), all->W, &mean.W, error));
    TRY(mean_of(all->n_vectors, C * m, all->L, &mean.L, error));
    if (all->D != NULL)
        TRY(mean_of(steady, C * lam_luminaires_count(all->luminaires), all->D, &mean.D, error));
    TRY(emission_apply(&mean, a->lit.op, a->lit.sky, a->quantity, 0, NULL, NULL, &values, NULL, error));
    if (is_dark(C * n, values))
        FAIL(error, LAM_ERR_ARGUMENT, "--animate %s: no frame has any light", a->f->light.frames);
    render_mark_lit(&a->view.m, values, lit);
done:
    emission_free(&mean);
    free(values);
    return status;
}

/* Loads the store and its frames, and points the camera. */
static lam_status open_sequence(const char *path, animation *a, terminal *t, lam_error *error) {
    lam_status status = LAM_OK;
    const render_options *f = a->f;
    light_options light = f->light;
    bool *lit = NULL;
    if (strcmp(light.frames, ANIMATE_SKY) == 0) light.frames = NULL;
    a->quantity = (lam_quantity)f->quantity; /* frames show light */
    TRY(render_view_open(path, f, &a->view, error));
    TRY(light_open(a->view.s, &a->view.m, &light, false, &a->lit, error));
    TRY(light_convert(&f->light, &a->lit.sun, NULL, &a->lit, error));
    light_log(&a->lit, t);
    a->names = frame_names_of(f->output, a->lit.light.n_vectors);
    lit = memory_allocate(a->view.m.n, sizeof *lit, "lit elements", error);
    a->sum = memory_allocate(1, sizeof *a->sum, "the exposure", error);
    if (lit == NULL || a->sum == NULL) TRY(LAM_ERR_MEMORY);
    TRY(mark_lit(a, lit, error));
    TRY(render_view_aim(f, f->smooth, lit, &a->view, error));
done:
    free(lit);
    return status;
}

/* Room for as many frames at a time as memory is meant for. */
static lam_status open_pass(animation *a, lam_error *error) {
    lam_status status = LAM_OK;
    const emission *light = &a->lit.light;
    const size_t row = a->view.m.n * a->view.m.n_channels;
    const size_t each = 3 * row * sizeof *a->values + lam_operator_work_bytes(a->lit.op, 1);
    size_t most = BATCH_BYTES / each + 1;
    if (most > BATCH_MOST) most = BATCH_MOST;
    if (most > light->n_vectors) most = light->n_vectors;
    TRY(emission_pass_create(light, a->lit.op, a->lit.sky, a->quantity, 0, NULL, most, &a->pass, error));
    a->values = memory_allocate(most, row * sizeof *a->values, "the answers of frames", error);
    if (a->values == NULL) TRY(LAM_ERR_MEMORY);
done:
    return status;
}

/* Warns where frames of a longer animation would follow these. */
static void warn_of_older(const frame_names *names, terminal *t) {
    char *next = NULL;
    if (frame_name(names, names->n + 1, &next, NULL) == LAM_OK && access(next, F_OK) == 0)
        terminal_warn(t, "%s is there, of an animation before this one", next);
    free(next);
}

lam_status animate(const char *path, const render_options *f, terminal *t, char nothing[80],
                   lam_error *error) {
    lam_status status = LAM_OK;
    const progress waiting = terminal_progress(t);
    animation a = {.f = f};
    char *first = NULL;
    double began;
    TRY(open_sequence(path, &a, t, error));
    TRY(open_pass(&a, error));
    const raster_view measured = picture_coarse(&a.view.pixels);
    TRY(raster_create(&measured, NULL, &a.coarse, error));
    TRY(each_frame(&a, "measuring", measure_frame, &a.measuring, t, error));
    a.style = render_style(f, a.sum, &a.view.nodes);
    began = clock_seconds();
    TRY(raster_create(&a.view.pixels, &waiting, &a.pixels, error));
    const double looking = clock_seconds() - began;
    TRY(each_frame(&a, "drawing", write_frame, &a.drawing, t, error));
    TRY(frame_name(&a.names, 1, &first, error));
    terminal_log(t,
                 "%zu frames from %s on: view %.2f s; a frame %.1f ms solving, %.1f measuring, %.1f drawing",
                 a.names.n, first, looking, 1e3 * a.solving / (double)a.names.n,
                 1e3 * a.measuring / (double)a.names.n, 1e3 * a.drawing / (double)a.names.n);
    warn_of_older(&a.names, t);
    render_log_camera(&a.view.camera, t);
    render_log_style(f, &a.style, render_unit(f, &a.lit), t);
    render_log_clamped(a.clamped, t);
    if (video_is_named(f->output)) TRY(video_write(&a.names, f->fps, &waiting, error));
done:
    if (a.written > 0) {
        snprintf(nothing, 80, "%zu of %zu frames were written", a.written, a.names.n);
        t->nothing = nothing;
    }
    free(first);
    animation_free(&a);
    return status;
}
