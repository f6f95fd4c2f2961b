#include "solver/verbs/render_options.h"

#include "solver/base/atomic_file.h"
#include "solver/render/camera.h"
#include "solver/render/image.h"
#include "solver/render/video.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

static lam_status parse_camera(const char *text, void *field, lam_error *error) {
    lam_status status = LAM_OK;
    render_camera *option = field;
    double numbers[7];
    camera ignored;
    /* Names of cameras rarely look like numbers with commas between them. */
    if (strchr(text, ',') == NULL || strspn(text, "+-.0123456789") == 0) {
        *option = (render_camera){.given = true, .name = text};
        return LAM_OK;
    }
    TRY(option_numbers("--camera", text, 7, true, numbers, NULL, error));
    TRY(camera_look(numbers, numbers + 3, numbers[6], 1, 'z', &ignored, error));
    *option = (render_camera){.given = true};
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

static lam_status parse_range(const char *text, void *field, lam_error *error) {
    lam_status status = LAM_OK;
    render_range *option = field;
    double ends[2];
    TRY(option_numbers("--range", text, 2, true, ends, NULL, error));
    if (!(ends[0] >= 0 && ends[1] - ends[0] > 1e-4 * ends[1] && ends[1] < 1e30))
        FAIL(error, LAM_ERR_ARGUMENT,
             "--range %s: must be LO,HI with 0 <= LO < HI, apart by a ten-thousandth or more", text);
    *option = (render_range){ends[0], ends[1]};
done:
    return status;
}

#define FIELD(member) offsetof(render_options, member)
const option_row render_output_rows[] = {
    OPTION_ROW_OUTPUT(
        FIELD(output), "IMAGE.png|.exr",
        .help = "Where the picture goes: an 8-bit PNG as eyes see it, or an OpenEXR of the values "
                "themselves, without exposure or tone curve, in channels Y, or R, G, B, or channel0, "
                "channel1 and so on; with --animate the name of numbered pictures, or a video: .mp4, "
                ".webm or .gif"),
    {.name = "float",
     .kind = OPTION_FLAG,
     .offset = FIELD(single),
     .help = "Values of IMAGE.exr in 32 bits; without it in 16, which end at 65504"},
    {0},
};
const option_row render_color_rows[] = {
    {.name = "false-color",
     .kind = OPTION_FLAG,
     .offset = FIELD(false_color),
     .help = "Draw values as colours, with a legend; each of the following does so, too"},
    {.name = "palette",
     .kind = OPTION_CHOICE,
     .offset = FIELD(palette),
     .argument = "NAME",
     .choices = PALETTE_NAMES,
     .preset = "viridis",
     .help =
         "The colours: viridis or inferno, whose lightness rises evenly, or turbo, which tells more values "
         "apart"},
    {.name = "range",
     .kind = OPTION_CUSTOM,
     .offset = FIELD(range),
     .argument = "LO,HI",
     .otherwise =
         "0, or with --log the darkest hundredth and at most three decades, to the brightest hundredth, "
         "moved by --exposure",
     .parse = parse_range,
     .help = "Values of the first and the last colour, in the unit of the answer"},
    {.name = "log",
     .kind = OPTION_FLAG,
     .offset = FIELD(logarithmic),
     .help = "Colours by the logarithm of values"},
    {.name = "iso-lines",
     .kind = OPTION_COUNT,
     .offset = FIELD(iso_lines),
     .argument = "N",
     .least = 1,
     .most = 1000,
     .help = "Draw N lines of equal value, at equal steps from LO, the last at HI (of the logarithm with "
             "--log); light "
             "is smoothed for them, as by --smooth"},
    {0},
};
const option_row render_frame_rows[] = {
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
static const char quantity_words[] = "radiosity|irradiance|indirect|coherence|patch|visible";

const option_row render_view_rows[] = {
    {.name = "quantity",
     .kind = OPTION_WORD,
     .offset = FIELD(quantity),
     .argument = "NAME",
     .choices = quantity_words,
     .preset = "radiosity",
     .help = "radiosity, irradiance or indirect light; or, without any light, of a store of --method 2msc: "
             "coherence, from black for the least coherent patch to white for 1, or patch, with a colour for "
             "each; of a store with form factors: visible, the number of elements that each element sees"},
    {.name = "camera",
     .kind = OPTION_CUSTOM,
     .offset = FIELD(camera),
     .argument = "EYE,TARGET,FOV|NAME",
     .otherwise = "a camera that shows the whole scene",
     .parse = parse_camera,
     .help = "x,y,z,x,y,z,degrees: position of the eye, point that it looks at, vertical field of view; or "
             "the name of "
             "a camera that came with the scene, a glTF, which `lambert info` lists"},
    {.name = "size",
     .kind = OPTION_CUSTOM,
     .offset = FIELD(size),
     .argument = "WxH",
     .preset = "640x640",
     .unit = "pixels",
     .parse = parse_size,
     .help = "Size of the picture"},
    {.name = "samples",
     .kind = OPTION_CHOICE,
     .offset = FIELD(samples),
     .choices = "1|4|16|64",
     .preset = "16",
     .help =
         "Rays of a pixel. Their colours are averaged in linear light after the tone curve, so that the edge "
         "of a lamp is as smooth as others; of an EXR and its values, before"},
    {.name = "exposure",
     .kind = OPTION_NUMBER,
     .offset = FIELD(exposure),
     .argument = "EV",
     .preset = "0",
     .least = -60,
     .most = 60,
     .help = "Each step of 1 doubles the brightness"},
    {.name = "smooth",
     .kind = OPTION_FLAG,
     .offset = FIELD(smooth),
     .help = "Draw light that varies inside elements, linear between "
             "the corners of a surface: nearer to a finer mesh, too"},
    {0},
};

const char *render_quantity_name(const render_options *f, char name[OPTION_WORD_BYTES]) {
    option_word(f->quantity, quantity_words, name);
    return name;
}

bool render_is_visible(const render_options *f) {
    return f->quantity == SHOW_VISIBLE;
}

bool render_is_patch(const render_options *f) {
    return f->quantity == SHOW_PATCH;
}

bool render_needs_no_light(const render_options *f) {
    return f->quantity >= SHOW_COHERENCE;
}

bool render_is_exr(const render_options *f) {
    char extension[16];
    atomic_file_extension(f->output, extension);
    return strcmp(extension, "exr") == 0;
}

/* Checks the name of the output and the options that are of one kind of it. */
static lam_status check_output(const render_options *f, const option_result *given, lam_error *error) {
    lam_status status = LAM_OK;
    char extension[16];
    const bool video = f->light.frames != NULL && video_is_named(f->output);
    atomic_file_extension(f->output, extension);
    if (strcmp(extension, "png") != 0 && !render_is_exr(f) && !video)
        FAIL(error, LAM_ERR_ARGUMENT, "-o %s: must end in .png or .exr%s", f->output,
             f->light.frames != NULL ? ", or .mp4, .webm or .gif" : "");
    if (options_given(given, "fps") && !video)
        FAIL(error, LAM_ERR_ARGUMENT, "--fps is for --animate with -o FILE.mp4, .webm or .gif");
    if (f->single && !render_is_exr(f)) FAIL(error, LAM_ERR_ARGUMENT, "--float is for -o IMAGE.exr");
    if (f->false_color && render_is_exr(f))
        FAIL(error, LAM_ERR_ARGUMENT, "-o %s: holds the values themselves; false colour is for .png",
             f->output);
done:
    return status;
}

static lam_status check_frames(const render_options *f, lam_error *error) {
    lam_status status = LAM_OK;
    const char *frames = f->light.frames;
    char name[OPTION_WORD_BYTES];
    if (frames == NULL) goto done;
    if (render_needs_no_light(f))
        FAIL(error, LAM_ERR_ARGUMENT, "--quantity %s shows no light: there is none to animate",
             render_quantity_name(f, name));
    if (strcmp(frames, ANIMATE_SKY) == 0) {
        if (f->light.sky == NULL || light_named_sky(&f->light) != NULL)
            FAIL(error, LAM_ERR_ARGUMENT, "--animate sky is of the skies of --sky FILE");
        goto done;
    }
    if (f->light.emission != NULL || f->light.emit.count > 0)
        FAIL(error, LAM_ERR_ARGUMENT, "give --animate %s, or --emit or --emission, not both", frames);
done:
    return status;
}

lam_status render_options_check(render_options *f, const option_result *given, lam_error *error) {
    static const char *const colored[] = {"palette", "range", "log", "iso-lines"};
    lam_status status = LAM_OK;
    for (size_t k = 0; k < sizeof colored / sizeof *colored; k++)
        f->false_color = f->false_color || options_given(given, colored[k]);
    if (f->logarithmic && f->range.high > 0 && !(f->range.low > 0))
        FAIL(error, LAM_ERR_ARGUMENT, "--range %g,%g: must begin above 0 with --log", f->range.low,
             f->range.high);
    TRY(check_output(f, given, error));
    TRY(check_frames(f, error));
    TRY(light_check(&f->light, error));
    if (render_is_patch(f)) f->false_color = false; /* and no room for a legend */
    if (render_is_visible(f) && !render_is_exr(f)) f->false_color = true;
    if (f->iso_lines > 0) f->smooth = true;
done:
    return status;
}
