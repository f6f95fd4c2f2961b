/* lambert render: draws a picture of a store under any light. */
#include "solver/base/atomic_file.h"
#include "solver/base/terminal.h"
#include "solver/codec/request.h"
#include "solver/light/emission_apply.h"
#include "solver/render/picture.h"
#include "solver/render/store_view.h"
#include "solver/verbs/light_options.h"
#include "solver/verbs/verbs.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

typedef struct camera_option {
    bool given;
    double eye[3], target[3], fov;
} camera_option;

typedef struct size_option {
    size_t width, height;
} size_option;

typedef struct fields {
    light_options light;
    const char *quantity;
    camera_option camera;
    size_option size;
    double exposure;
    bool false_color;
    bool smooth;
    const char *output;
} fields;

static lam_status parse_camera(const char *text, void *field, lam_error *error) {
    lam_status status = LAM_OK;
    camera_option *option = field;
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
    size_option *option = field;
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
    *option = (size_option){width, height};
done:
    return status;
}

#define FIELD(member) offsetof(fields, member)
static const option_row rows[] = {
    OPTION_ROW_OUTPUT(FIELD(output), "IMAGE.png", .help = "Where the picture goes"),
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

static float luminance_of(const mesh *m, const float *values, size_t i) {
    float channels[3] = {0, 0, 0};
    for (size_t c = 0; c < m->n_channels && c < 3; c++) channels[c] = values[c * m->n + i];
    return tone_luminance(channels, m->n_channels);
}

/* Marks the elements that have any light, and those whose own emission is most of what they show. */
static void mark(const mesh *m, const float *values, const float *E, bool emission_shows, bool *lit,
                 bool *glows) {
    float largest = 0;
    for (size_t i = 0; i < m->n; i++) largest = fmaxf(largest, luminance_of(m, values, i));
    for (size_t i = 0; i < m->n; i++) {
        const float shown = luminance_of(m, values, i);
        lit[i] = shown > 1e-6f * largest;
        glows[i] = emission_shows && luminance_of(m, E, i) > .5f * shown;
    }
}

/* The next larger number whose quarters have few digits, for the legend. */
static double round_up(double x) {
    static const double steps[] = {1, 1.2, 1.6, 2, 2.4, 2.8, 3.2, 4, 4.8, 6, 8, 10};
    if (!(x > 0)) return 1;
    const double unit = pow(10, floor(log10(x)));
    size_t i = 0;
    while (i + 1 < sizeof steps / sizeof steps[0] && steps[i] * unit < x) i++;
    return steps[i] * unit;
}

/* The columns of the picture that show the scene. */
static size_t view_width(const fields *f) {
    return f->size.width - (f->false_color ? picture_legend_width(f->size.width, f->size.height) : 0);
}

/* A store, the values that its elements show, and the camera. */
typedef struct view {
    store *s;
    mesh m;
    float *values; /* [1 or 3][n] */
    bool *lit;     /* [n]: elements that a chosen camera is to show */
    bool *glows;   /* [n]: see picture_scene */
    visibility *seen;
    shade *shown;
    picture_scene scene;
    camera camera;
} view;

static void view_close(view *v) {
    shade_destroy(v->shown);
    visibility_destroy(v->seen);
    free(v->lit);
    free(v->glows);
    free(v->values);
    mesh_free(&v->m);
    store_close(v->s);
}

/* Loads all but the values of the elements, which is cheap. */
static lam_status view_open(const char *path, const fields *f, view *v, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(atomic_file_check(f->output, error));
    TRY(store_open(path, &v->s, error));
    TRY(mesh_load(v->s, &v->m, NULL, error));
    v->lit = memory_allocate(v->m.n, sizeof *v->lit, "lit elements", error);
    v->glows = memory_allocate(v->m.n, sizeof *v->glows, "glowing elements", error);
    if (v->lit == NULL || v->glows == NULL) TRY(LAM_ERR_MEMORY);
done:
    return status;
}

/* Makes the scene and the camera of a view that has values. */
/* E: of the values, or NULL. */
static lam_status view_aim(const fields *f, size_t n_channels, bool smooth, const float *E, view *v,
                           lam_error *error) {
    lam_status status = LAM_OK;
    const double aspect = (double)view_width(f) / (double)f->size.height;
    const camera_option *given = &f->camera;
    TRY(visibility_create(&v->m, &v->seen, error));
    TRY(shade_create(&v->m, n_channels, v->values, E, smooth, &v->shown, error));
    v->scene = (picture_scene){.mesh = &v->m, .visibility = v->seen, .shade = v->shown, .glows = v->glows};
    if (given->given)
        TRY(camera_look(given->eye, given->target, given->fov, aspect, v->m.up, &v->camera, error));
    else
        TRY(camera_choose(&v->m, v->seen, v->lit, aspect, &v->camera, error));
done:
    return status;
}

/* The exposure, or the range of colours, that fits the light in view. */
static picture_options options_of_light(const fields *f, const view *v) {
    tone_histogram histogram = {0};
    picture_options style = {.width = view_width(f)};
    picture_measure(&v->scene, &v->camera, &histogram);
    if (f->false_color)
        style.range = round_up(tone_histogram_quantile(&histogram, .99) / exp2(f->exposure));
    else
        style.exposure = tone_exposure(&histogram) * exp2(f->exposure);
    return style;
}

static lam_status draw(const fields *f, const view *v, const picture_options *style, terminal *t,
                       lam_error *error) {
    lam_status status = LAM_OK;
    const progress how = terminal_progress(t);
    const camera *c = &v->camera;
    image picture = {0};
    const size_t channels = style->range > 0 || shade_channels(v->shown) == 3 ? 3 : 1;
    TRY(image_create(f->size.width, f->size.height, channels, &picture, error));
    TRY(picture_draw(&v->scene, c, style, &how, &picture, error));
    if (style->range > 0) picture_legend(style->range, &picture);
    TRY(image_write_png(&picture, f->output, error));
    terminal_log(t, "camera %.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.4g", c->eye[0], c->eye[1], c->eye[2],
                 c->eye[0] + c->forward[0], c->eye[1] + c->forward[1], c->eye[2] + c->forward[2],
                 2 * atan(c->tan_y) * 180 / M_PI);
done:
    image_free(&picture);
    return status;
}

static lam_status render(const char *path, const fields *f, terminal *t, lam_error *error) {
    lam_status status = LAM_OK;
    view v = {.s = NULL};
    lit_store lit = {0};
    lam_quantity quantity = LAM_RADIOSITY;

    codec_quantity_find(f->quantity, strlen(f->quantity), &quantity);
    TRY(view_open(path, f, &v, error));
    TRY(light_open(v.s, &v.m, &f->light, false, &lit, error));
    light_log(&lit, t);
    if (lit.light.n_vectors != 1)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: holds %zu emissions, a picture shows exactly 1",
             f->light.emission != NULL ? f->light.emission : f->light.sky, lit.light.n_vectors);
    TRY(terminal_check(error));
    TRY(emission_apply(&lit.light, lit.op, lit.sky, quantity, 0, NULL, NULL, &v.values, error));
    mark(&v.m, v.values, lit.light.E, quantity == LAM_RADIOSITY, v.lit, v.glows);
    if (lit.own && memchr(v.glows, true, v.m.n) == NULL && memchr(v.lit, true, v.m.n) == NULL)
        FAIL(error, LAM_ERR_ARGUMENT,
             "%s: the scene has no light of its own; give --emit GROUP=V, --emission or --sky", path);
    TRY(view_aim(f, v.m.n_channels, f->smooth, quantity == LAM_RADIOSITY ? lit.light.E : NULL, &v, error));
    const picture_options style = options_of_light(f, &v);
    TRY(draw(f, &v, &style, t, error));
    if (f->false_color)
        terminal_log(t, "colours from 0 to %g W/m2", style.range);
    else
        terminal_log(t, "white is about %.3g W/m2", 1 / style.exposure);
done:
    view_close(&v);
    light_close(&lit);
    return status;
}

static bool is_visible(const fields *f) {
    return strcmp(f->quantity, "visible") == 0;
}

static bool needs_no_light(const fields *f) {
    return strcmp(f->quantity, "coherence") == 0 || strcmp(f->quantity, "patch") == 0 || is_visible(f);
}

/* The values of --quantity visible, in colours up to the largest. */
static lam_status visible_values(const fields *f, store *s, size_t n, terminal *t, float **values,
                                 picture_options *style, lam_error *error) {
    lam_status status = LAM_OK;
    double mean, most;
    TRY(store_view_visible(s, n, values, &mean, &most, error));
    *style = (picture_options){.width = view_width(f), .range = most > 0 ? round_up(most) : 1};
    terminal_log(t, "an element sees %.3g others on average, %.6g at most; colours from 0 to %g", mean, most,
                 style->range);
done:
    return status;
}

/* The values of --quantity coherence or patch, one channel or three, and how to show them. The least coherent
 * patch is a little above black, so that it is seen. */
static lam_status patch_values(const fields *f, store *s, size_t n, terminal *t, float **values,
                               picture_options *style, lam_error *error) {
    lam_status status = LAM_OK;
    float smallest;
    size_t n_patches;
    *style = (picture_options){.width = view_width(f), .plain = true};
    if (strcmp(f->quantity, "patch") == 0) {
        TRY(store_view_patches(s, values, &n_patches, error));
        terminal_log(t, "%zu patches", n_patches);
        return LAM_OK;
    }
    TRY(store_view_coherence(s, values, &smallest, error));
    if (f->false_color) {
        *style = (picture_options){.width = view_width(f), .range = 1};
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

static lam_status render_unlit(const char *path, const fields *f, terminal *t, lam_error *error) {
    lam_status status = LAM_OK;
    view v = {.s = NULL};
    picture_options style;
    TRY(view_open(path, f, &v, error));
    if (is_visible(f))
        TRY(visible_values(f, v.s, v.m.n, t, &v.values, &style, error));
    else
        TRY(patch_values(f, v.s, v.m.n, t, &v.values, &style, error));
    memset(v.lit, true, v.m.n);
    TRY(view_aim(f, strcmp(f->quantity, "patch") == 0 ? 3 : 1, false, NULL, &v, error));
    TRY(draw(f, &v, &style, t, error));
done:
    view_close(&v);
    return status;
}

/* Logs the given options that a picture without light does not use. */
static void log_unused(const fields *f, const option_result *given, terminal *t) {
    static const char *const of_light[] = {"emit", "emission", "sky", "exposure", "smooth", "false-color"};
    const size_t count = strcmp(f->quantity, "coherence") == 0 ? 5 : 6;
    for (size_t i = 0; i < count; i++)
        if (options_given(given, of_light[i]))
            terminal_log(t, "--quantity %s does not use --%s", f->quantity, of_light[i]);
}

int cmd_render(int argc, char **argv) {
    fields f = {0};
    option_result result = {0};
    lam_error error = {0};
    terminal t;
    char extension[16];
    const option_table tables[] = {
        {NULL, rows, &f}, {LIGHT_HEADING, light_rows, &f.light}, {"view", view_rows, &f}, {0}};
    int go = options_parse(&verb, tables, argc, argv, &result);
    if (go != OPTIONS_GO) return go;
    if (f.output == NULL) return options_usage(verb.name, "give -o IMAGE.png");
    atomic_file_extension(f.output, extension);
    if (strcmp(extension, "png") != 0) return options_usage(verb.name, "-o %s: must end in .png", f.output);
    if (light_check(&f.light, &error) != LAM_OK) return options_usage(verb.name, "%s", error.message);
    terminal_open(&t, verb.name, false, false);
    if (needs_no_light(&f)) {
        if (strcmp(f.quantity, "patch") == 0) f.false_color = false; /* and no room for a legend */
        if (is_visible(&f)) f.false_color = true;
        if (render_unlit(result.arguments[0], &f, &t, &error) != LAM_OK) return terminal_fail(&t, &error);
        log_unused(&f, &result, &t);
        return 0;
    }
    return render(result.arguments[0], &f, &t, &error) == LAM_OK ? 0 : terminal_fail(&t, &error);
}
