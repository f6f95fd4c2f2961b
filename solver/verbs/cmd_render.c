/* lambert render: draws a picture of a store under any light. */
#include "solver/base/terminal.h"
#include "solver/codec/request.h"
#include "solver/light/emission_apply.h"
#include "solver/render/store_view.h"
#include "solver/verbs/animate.h"
#include "solver/verbs/light_options.h"
#include "solver/verbs/verbs.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const option_command verb = {
    .name = "lambert render",
    .arguments = "STORE -o IMAGE.png|.exr",
    .summary = "Draw the answer of a store: the radiosity of every element, seen by a camera. Back faces are "
               "transparent.",
    .least_arguments = 1,
    .most_arguments = 1,
};

/* Draws, and says where the camera stands. */
static lam_status draw(const render_options *f, const render_view *v, const shade *light,
                       const picture_options *style, const char *unit, terminal *t, lam_error *error) {
    lam_status status = LAM_OK;
    const progress how = terminal_progress(t);
    render_sheet sheet = {.picture = {0}};
    size_t clamped;
    TRY(render_sheet_create(f, style, shade_channels(light), &sheet, error));
    if (v->exr)
        TRY(picture_values_draw(&v->pixels, light, &how, &sheet.values, error));
    else
        TRY(picture_draw(&v->pixels, light, style, &how, &sheet.picture, error));
    TRY(render_sheet_write(f, style, unit, &sheet, f->output, &clamped, error));
    render_log_camera(&v->camera, t);
    render_log_clamped(clamped, t);
done:
    render_sheet_free(&sheet);
    return status;
}

static lam_status render(const char *path, const render_options *f, terminal *t, lam_error *error) {
    lam_status status = LAM_OK;
    render_view v = {.s = NULL};
    lit_store lit = {0};
    shade *shown = NULL;
    raster coarse = {.n_tiles = 0};
    picture_light *sum = NULL;
    bool *lit_elements = NULL, *glows = NULL;
    float *values = NULL;
    lam_quantity quantity = LAM_RADIOSITY;

    if (!render_needs_no_light(f)) quantity = (lam_quantity)f->quantity;
    TRY(render_view_open(path, f, &v, error));
    TRY(light_open(v.s, &v.m, &f->light, false, &lit, error));
    TRY(light_convert(&f->light, &lit.sun, NULL, &lit, error));
    light_log(&lit, t);
    if (lit.light.n_vectors != 1)
        FAIL(error, LAM_ERR_ARGUMENT,
             "%s: holds %zu emissions, a picture shows exactly 1; give them to --animate",
             f->light.emission != NULL ? f->light.emission : f->light.sky, lit.light.n_vectors);
    TRY(terminal_check(error));
    sum = memory_allocate(1, sizeof *sum, "the exposure", error);
    lit_elements = memory_allocate(v.m.n, sizeof *lit_elements, "lit elements", error);
    glows = memory_allocate(v.m.n, sizeof *glows, "glowing elements", error);
    if (sum == NULL || lit_elements == NULL || glows == NULL) TRY(LAM_ERR_MEMORY);
    TRY(emission_apply(&lit.light, lit.op, lit.sky, quantity, 0, NULL, NULL, &values, NULL, error));
    const float *E = quantity == LAM_RADIOSITY ? lit.light.E : NULL;
    render_mark_lit(&v.m, values, lit_elements);
    render_mark_glowing(&v.m, values, E, glows);
    if (lit.own && memchr(lit_elements, true, v.m.n) == NULL)
        FAIL(error, LAM_ERR_ARGUMENT,
             "%s: the scene has no light of its own; give --emit GROUP=V, --emission or --sky", path);
    TRY(render_view_aim(f, f->smooth, lit_elements, &v, error));
    TRY(render_view_shade(&v, v.m.n_channels, values, E, &shown, error));
    const raster_view measured = picture_coarse(&v.pixels);
    TRY(raster_create(&measured, NULL, &coarse, error));
    picture_measure(&coarse, shown, glows, sum);
    const picture_options style = render_style(f, sum, &v.nodes);
    TRY(draw(f, &v, shown, &style, render_unit(f, &lit), t, error));
    render_log_style(f, &style, render_unit(f, &lit), t);
done:
    raster_free(&coarse);
    shade_destroy(shown);
    free(sum);
    free(lit_elements);
    free(glows);
    free(values);
    render_view_close(&v);
    light_close(&lit);
    return status;
}

/* The values of --quantity visible, in colours up to the largest. */
static lam_status visible_values(const render_options *f, store *s, size_t n, terminal *t, float **values,
                                 picture_options *style, lam_error *error) {
    lam_status status = LAM_OK;
    double mean, most;
    TRY(store_view_visible(s, n, values, &mean, &most, error));
    *style = (picture_options){.scale = render_scale(f, most)};
    terminal_log(t, "an element sees %.3g others on average, %.6g at most; colours from %g to %g", mean, most,
                 style->scale.low, style->scale.high);
done:
    return status;
}

/* The values of --quantity coherence or patch, one channel or three, and how to show them. The least coherent
 * patch is a little above black, so that it is seen. */
static lam_status patch_values(const render_options *f, store *s, size_t n, terminal *t, float **values,
                               picture_options *style, lam_error *error) {
    lam_status status = LAM_OK;
    float smallest;
    size_t n_patches;
    *style = (picture_options){.plain = true};
    if (render_is_patch(f)) {
        TRY(store_view_patches(s, values, &n_patches, error));
        terminal_log(t, "%zu patches", n_patches);
        return LAM_OK;
    }
    TRY(store_view_coherence(s, values, &smallest, error));
    if (f->false_color) {
        *style = (picture_options){.scale = render_scale(f, 1)};
        terminal_log(t, "colours from coherence %g to %g", style->scale.low, style->scale.high);
        return LAM_OK;
    }
    if (render_is_exr(f)) return LAM_OK;
    for (size_t i = 0; i < n; i++) {
        const float share = smallest < 1 ? ((*values)[i] - smallest) / (1 - smallest) : 1;
        (*values)[i] = tone_decode(.06f + .94f * share);
    }
    terminal_log(t, "black is coherence %.3g, white 1", (double)smallest);
done:
    return status;
}

static lam_status render_unlit(const char *path, const render_options *f, terminal *t, lam_error *error) {
    lam_status status = LAM_OK;
    render_view v = {.s = NULL};
    picture_options style;
    shade *shown = NULL;
    bool *all = NULL;
    float *values = NULL;
    TRY(render_view_open(path, f, &v, error));
    if (render_is_visible(f))
        TRY(visible_values(f, v.s, v.m.n, t, &values, &style, error));
    else
        TRY(patch_values(f, v.s, v.m.n, t, &values, &style, error));
    all = memory_allocate(v.m.n, sizeof *all, "lit elements", error);
    if (all == NULL) TRY(LAM_ERR_MEMORY);
    memset(all, true, v.m.n);
    TRY(render_view_aim(f, false, all, &v, error));
    TRY(render_view_shade(&v, render_is_patch(f) ? 3 : 1, values, NULL, &shown, error));
    TRY(draw(f, &v, shown, &style, "", t, error));
done:
    shade_destroy(shown);
    free(all);
    free(values);
    render_view_close(&v);
    return status;
}

/* Logs the given options that a picture without light does not use. */
static void log_unused(const render_options *f, const option_result *given, terminal *t) {
    static const char *const unused[] = {"emit",    "emission",  "sky",      "exposure",
                                         "smooth",  "iso-lines", "unit-out", "false-color",
                                         "palette", "range",     "log"};
    char name[OPTION_WORD_BYTES];
    const size_t all = sizeof unused / sizeof *unused, count = f->false_color ? 7 : all;
    for (size_t i = 0; i < count; i++)
        if (options_given(given, unused[i]))
            terminal_log(t, "--quantity %s does not use --%s", render_quantity_name(f, name), unused[i]);
}

int cmd_render(int argc, char **argv) {
    render_options f = {.light.at.north = NAN};
    option_result result = {0};
    lam_error error = {0};
    terminal t;
    char nothing[80];
    const option_table tables[] = {
        {NULL, render_output_rows, &f},       {LIGHT_HEADING, light_rows, &f.light},
        {"", sky_time_rows, &f.light.at},     {"", sky_named_rows, &f.light.at},
        {"view", render_view_rows, &f},       {"false colour", render_color_rows, &f},
        {"animation", render_frame_rows, &f}, {0}};
    int go = options_parse(&verb, tables, argc, argv, &result);
    if (go != OPTIONS_GO) return go;
    if (f.output == NULL) return options_usage(verb.name, "give -o IMAGE.png");
    if (render_options_check(&f, &result, &error) != LAM_OK)
        return options_usage(verb.name, "%s", error.message);
    terminal_open(&t, verb.name, false, false);
    if (f.light.frames != NULL)
        return animate(result.arguments[0], &f, &t, nothing, &error) == LAM_OK ? 0
                                                                               : terminal_fail(&t, &error);
    if (render_needs_no_light(&f)) {
        if (render_unlit(result.arguments[0], &f, &t, &error) != LAM_OK) return terminal_fail(&t, &error);
        log_unused(&f, &result, &t);
        return 0;
    }
    return render(result.arguments[0], &f, &t, &error) == LAM_OK ? 0 : terminal_fail(&t, &error);
}
