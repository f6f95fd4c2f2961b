/* lambert render: draws a picture of a store under any light. */
#include "solver/base/atomic_file.h"
#include "solver/base/terminal.h"
#include "solver/codec/request.h"
#include "solver/light/emission_apply.h"
#include "solver/render/store_view.h"
#include "solver/render/video.h"
#include "solver/verbs/animate.h"
#include "solver/verbs/light_options.h"
#include "solver/verbs/verbs.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

static lam_status parse_camera(const char *text, void *field, lam_error *error) {
    lam_status status = LAM_OK;
    render_camera *option = field;
    double numbers[7];
    camera ignored;
    TRY(option_numbers("--camera", text, 7, true, numbers, NULL, error));
    TRY(camera_look(numbers, numbers + 3, numbers[6], 1, 'z', &ignored, error));
    option->given = true;
    memcpy(option->eye, numbers, sizeof option->eye);
    memcpy(option->target, numbers + 3, sizeof option->target);
    option->fov = numbers[6];
done:
    return status;
}

static lam_status parse_size(const char *text, void *field, lam_error *error) {
    lam_status status = LAM_OK;
    render_size *option = field;
    const char *x = strchr(text, 'x');
    char width_text[24];
    uint64_t width, height;
    if (x == NULL || (size_t)(x - text) >= sizeof width_text)
        FAIL(error, LAM_ERR_ARGUMENT, "--size %s: must be WxH pixels, such as 640x480", text);
    memcpy(width_text, text, (size_t)(x - text));
    width_text[x - text] = '\0';
    if (option_count("--size", width_text, &width, NULL) != LAM_OK ||
        option_count("--size", x + 1, &height, NULL) != LAM_OK)
        FAIL(error, LAM_ERR_ARGUMENT, "--size %s: must be WxH pixels, such as 640x480", text);
    TRY(image_check_size(width, height, error));
    *option = (render_size){width, height};
done:
    return status;
}

#define FIELD(member) offsetof(render_options, member)
static const option_row rows[] = {
    OPTION_ROW_OUTPUT(FIELD(output), "IMAGE.png",
                      .help =
                          "Where the picture goes; with --animate the name of numbered pictures, or a video: "
                          ".mp4, .webm or .gif"),
    {0},
};
static const option_row frame_rows[] = {
    {.name = "animate",
     .kind = OPTION_TEXT,
     .offset = FIELD(light.frames),
     .argument = "FRAMES.npy|.json|emitters|sky",
     .help =
         "One light a frame: emissions [f][n] or [f][C][n], or weights [f][s] or [f][C][s] of the s emitters "
         "of a store; or `emitters`, each emitter of the store alone, in order; or `sky`, the skies of --sky "
         "beside other light. Writes IMAGE-0001.png and so on with one camera and one exposure for all"},
    {.name = "fps",
     .kind = OPTION_NUMBER,
     .offset = FIELD(fps),
     .argument = "N",
     .preset = "30",
     .least = .01,
     .most = 1000,
     .help = "Frames in a second of a video (-o FILE.mp4, .webm or .gif), which ffmpeg makes where it is "
             "installed; "
             "its numbered pictures stay beside it"},
    {0},
};
static const option_row view_rows[] = {
    {.name = "quantity",
     .kind = OPTION_CHOICE,
     .offset = FIELD(quantity),
     .argument = "NAME",
     .choices = "radiosity|irradiance|indirect|coherence|patch|visible",
     .preset = "radiosity",
     .help = "radiosity, irradiance or indirect light; or, without any light, of a store of --method 2msc: "
             "coherence, from black for the least coherent patch to white for 1, or patch, with a colour for "
             "each; of a store with form factors: visible, the number of elements that each element sees"},
    {.name = "camera",
     .kind = OPTION_CUSTOM,
     .offset = FIELD(camera),
     .argument = "EYE,TARGET,FOV",
     .otherwise = "a camera that shows the whole scene",
     .parse = parse_camera,
     .help = "x,y,z,x,y,z,degrees: position of the eye, point that it looks at, vertical field of view"},
    {.name = "size",
     .kind = OPTION_CUSTOM,
     .offset = FIELD(size),
     .argument = "WxH",
     .preset = "640x640",
     .unit = "pixels",
     .parse = parse_size,
     .help = "Size of the picture"},
    {.name = "exposure",
     .kind = OPTION_NUMBER,
     .offset = FIELD(exposure),
     .argument = "EV",
     .preset = "0",
     .least = -60,
     .most = 60,
     .help = "Each step of 1 doubles the brightness"},
    {.name = "false-color",
     .kind = OPTION_FLAG,
     .offset = FIELD(false_color),
     .help = "Draw values as colours, with a legend"},
    {.name = "smooth",
     .kind = OPTION_FLAG,
     .offset = FIELD(smooth),
     .help = "Draw light that varies inside elements, linear between "
             "the corners of a surface: nearer to a finer mesh, too"},
    {0},
};

static const option_command verb = {
    .name = "lambert render",
    .arguments = "STORE -o IMAGE.png",
    .summary = "Draw the answer of a store: the radiosity of every element, seen by a camera. Back faces are "
               "transparent.",
    .least_arguments = 1,
    .most_arguments = 1,
};

/* Draws, and says where the camera stands. */
static lam_status draw(const render_options *f, const render_view *v, const shade *light,
                       const picture_options *style, terminal *t, lam_error *error) {
    lam_status status = LAM_OK;
    const progress how = terminal_progress(t);
    image picture = {0};
    TRY(render_image(f, style, shade_channels(light), &picture, error));
    TRY(picture_draw(&v->pixels, light, style, &how, &picture, error));
    if (style->range > 0) picture_legend(style->range, &picture);
    TRY(image_write_png(&picture, f->output, error));
    render_log_camera(&v->camera, t);
done:
    image_free(&picture);
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

    codec_quantity_find(f->quantity, strlen(f->quantity), &quantity);
    TRY(render_view_open(path, f, &v, error));
    TRY(light_open(v.s, &v.m, &f->light, false, &lit, error));
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
    TRY(emission_apply(&lit.light, lit.op, lit.sky, quantity, 0, NULL, NULL, &values, error));
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
    const picture_options style = render_style(f, sum);
    TRY(draw(f, &v, shown, &style, t, error));
    render_log_style(&style, t);
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

static bool is_visible(const render_options *f) {
    return strcmp(f->quantity, "visible") == 0;
}

static bool needs_no_light(const render_options *f) {
    return strcmp(f->quantity, "coherence") == 0 || strcmp(f->quantity, "patch") == 0 || is_visible(f);
}

/* The values of --quantity visible, in colours up to the largest. */
static lam_status visible_values(store *s, size_t n, terminal *t, float **values, picture_options *style,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    double mean, most;
    TRY(store_view_visible(s, n, values, &mean, &most, error));
    *style = (picture_options){.range = most > 0 ? render_round_up(most) : 1};
    terminal_log(t, "an element sees %.3g others on average, %.6g at most; colours from 0 to %g", mean, most,
                 style->range);
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
    if (strcmp(f->quantity, "patch") == 0) {
        TRY(store_view_patches(s, values, &n_patches, error));
        terminal_log(t, "%zu patches", n_patches);
        return LAM_OK;
    }
    TRY(store_view_coherence(s, values, &smallest, error));
    if (f->false_color) {
        *style = (picture_options){.range = 1};
        terminal_log(t, "colours from coherence 0 to 1");
        return LAM_OK;
    }
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
    if (is_visible(f))
        TRY(visible_values(v.s, v.m.n, t, &values, &style, error));
    else
        TRY(patch_values(f, v.s, v.m.n, t, &values, &style, error));
    all = memory_allocate(v.m.n, sizeof *all, "lit elements", error);
    if (all == NULL) TRY(LAM_ERR_MEMORY);
    memset(all, true, v.m.n);
    TRY(render_view_aim(f, false, all, &v, error));
    TRY(render_view_shade(&v, strcmp(f->quantity, "patch") == 0 ? 3 : 1, values, NULL, &shown, error));
    TRY(draw(f, &v, shown, &style, t, error));
done:
    shade_destroy(shown);
    free(all);
    free(values);
    render_view_close(&v);
    return status;
}

/* Logs the given options that a picture without light does not use. */
static void log_unused(const render_options *f, const option_result *given, terminal *t) {
    static const char *const of_light[] = {"emit", "emission", "sky", "exposure", "smooth", "false-color"};
    const size_t count = strcmp(f->quantity, "coherence") == 0 ? 5 : 6;
    for (size_t i = 0; i < count; i++)
        if (options_given(given, of_light[i]))
            terminal_log(t, "--quantity %s does not use --%s", f->quantity, of_light[i]);
}

/* Checks what goes together, and where the light of frames comes from: that of skies is --emit or --emission.
 */
static lam_status check_frames(render_options *f, bool fps_given, lam_error *error) {
    lam_status status = LAM_OK;
    char extension[16];
    const char *frames = f->light.frames;
    const bool video = frames != NULL && video_is_named(f->output), others = needs_no_light(f);
    atomic_file_extension(f->output, extension);
    if (strcmp(extension, "png") != 0 && !video)
        FAIL(error, LAM_ERR_ARGUMENT, "-o %s: must end in .png%s", f->output,
             frames != NULL ? ", .mp4, .webm or .gif" : "");
    if (fps_given && !video)
        FAIL(error, LAM_ERR_ARGUMENT, "--fps is for --animate with -o FILE.mp4, .webm or .gif");
    if (frames == NULL) goto done;
    if (others)
        FAIL(error, LAM_ERR_ARGUMENT, "--quantity %s shows no light: there is none to animate", f->quantity);
    if (strcmp(frames, ANIMATE_SKY) == 0) {
        if (f->light.sky == NULL)
            FAIL(error, LAM_ERR_ARGUMENT, "--animate sky is of the skies of --sky FILE");
        goto done;
    }
    if (f->light.emission != NULL || f->light.emit.count > 0)
        FAIL(error, LAM_ERR_ARGUMENT, "give --animate %s, or --emit or --emission, not both", frames);
done:
    return status;
}

int cmd_render(int argc, char **argv) {
    render_options f = {0};
    option_result result = {0};
    lam_error error = {0};
    terminal t;
    char nothing[80];
    const option_table tables[] = {{NULL, rows, &f},
                                   {LIGHT_HEADING, light_rows, &f.light},
                                   {"view", view_rows, &f},
                                   {"animation", frame_rows, &f},
                                   {0}};
    int go = options_parse(&verb, tables, argc, argv, &result);
    if (go != OPTIONS_GO) return go;
    if (f.output == NULL) return options_usage(verb.name, "give -o IMAGE.png");
    if (check_frames(&f, options_given(&result, "fps"), &error) != LAM_OK ||
        light_check(&f.light, &error) != LAM_OK)
        return options_usage(verb.name, "%s", error.message);
    terminal_open(&t, verb.name, false, false);
    if (f.light.frames != NULL)
        return animate(result.arguments[0], &f, &t, nothing, &error) == LAM_OK ? 0
                                                                               : terminal_fail(&t, &error);
    if (needs_no_light(&f)) {
        if (strcmp(f.quantity, "patch") == 0) f.false_color = false; /* and no room for a legend */
        if (is_visible(&f)) f.false_color = true;
        if (render_unlit(result.arguments[0], &f, &t, &error) != LAM_OK) return terminal_fail(&t, &error);
        log_unused(&f, &result, &t);
        return 0;
    }
    return render(result.arguments[0], &f, &t, &error) == LAM_OK ? 0 : terminal_fail(&t, &error);
}
