/* The command line of `lambert render`: its options, and what goes together. */
#ifndef LAMBERT_VERBS_RENDER_OPTIONS_H
#define LAMBERT_VERBS_RENDER_OPTIONS_H

#include "solver/render/palette.h"
#include "solver/verbs/light_options.h"

/* The word of --animate for every sky of --sky as a frame. */
#define ANIMATE_SKY "sky"

typedef struct render_camera {
    bool given;
    const char *name; /* of one of the scene, or NULL: eye, target and fov */
    double eye[3], target[3], fov;
} render_camera;

typedef struct render_size {
    size_t width, height;
} render_size;

typedef struct render_range {
    double low, high; /* both 0: not given */
} render_range;

/* --quantity: those of light first (lam_quantity), then pictures of the store. */
typedef enum shown_quantity {
    SHOW_RADIOSITY = LAM_RADIOSITY,
    SHOW_IRRADIANCE = LAM_IRRADIANCE,
    SHOW_INDIRECT = LAM_INDIRECT,
    SHOW_COHERENCE,
    SHOW_PATCH,
    SHOW_VISIBLE
} shown_quantity;

typedef struct render_options {
    light_options light;
    shown_quantity quantity;
    render_camera camera;
    render_size size;
    const char *samples; /* rays of a pixel */
    double exposure;
    bool smooth;
    bool false_color;
    const char *palette;
    render_range range;
    bool logarithmic;
    uint64_t iso_lines;
    bool single; /* 32-bit values in an EXR */
    double fps;  /* of a video */
    const char *output;
} render_options;

/* The tables of rows that fill a render_options. */
extern const option_row render_output_rows[], render_view_rows[], render_color_rows[], render_frame_rows[];

/* Checks what goes together and sets what follows from other options; an error is wrong usage. Light of
 * frames that are skies is --emit or --emission. */
lam_status render_options_check(render_options *f, const option_result *given, lam_error *error);

/* True of coherence, patch and visible: a picture of the store, without light. */
bool render_needs_no_light(const render_options *f);
/* Returns name, the word of its quantity. */
const char *render_quantity_name(const render_options *f, char name[OPTION_WORD_BYTES]);

bool render_is_visible(const render_options *f);
bool render_is_patch(const render_options *f);

/* True where the output is an EXR, or numbered ones. */
bool render_is_exr(const render_options *f);

#endif
