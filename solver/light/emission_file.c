/* Emissions and skies from files, which codec reads, and batches of the two side by side. */
#include "solver/base/atomic_file.h"
#include "solver/base/file_text.h"
#include "solver/base/photometry.h"
#include "solver/codec/request.h"
#include "solver/daylight/sky_matrix.h"
#include "solver/daylight/weather.h"
#include "solver/light/emission.h"
#include "solver/light/light_units.h"

#include <stdlib.h>
#include <string.h>

typedef bool codec_reader(const codec_scene *scene, const char *bytes, size_t length,
                          radiosity_request *request, problem *why);

/* The refusal of a file as one line. */
static lam_status refuse(const char *path, problem *why, lam_error *error) {
    const lam_status status = why->status == 503   ? LAM_ERR_MEMORY
                              : why->status == 400 ? LAM_ERR_FORMAT
                                                   : LAM_ERR_ARGUMENT;
    for (char *c = why->detail; *c != '\0'; c++)
        if ((unsigned char)*c < ' ' || *c == 0x7f) *c = '?';
    return status_fail(error, status, "%.200s: %s", path, why->detail);
}

/* Reads path against about, to which it adds what holds for every file. *kind is of its refusal. */
static lam_status read_kind(codec_reader *reader, const char *path, codec_scene about, radiosity_request *out,
                            problem_kind *kind, lam_error *error) {
    lam_status status = LAM_OK;
    problem why = {0};
    radiosity_request made = {0};
    char *bytes = NULL;
    size_t length = 0;
    about.source = "the file";
    about.max_batch = CODEC_BATCH_MOST;
    about.max_bytes = SIZE_MAX / 4;
    TRY(file_text(path, &bytes, &length, error));
    const bool good = reader(&about, bytes, length, &made, &why);
    *kind = why.kind;
    if (!good) TRY(refuse(path, &why, error));
    *out = made;
    made = (radiosity_request){0};
done:
    radiosity_request_free(&made);
    free(bytes);
    return status;
}

static lam_status read_with(codec_reader *reader, const char *path, codec_scene about, radiosity_request *out,
                            lam_error *error) {
    problem_kind ignored;
    return read_kind(reader, path, about, out, &ignored, error);
}

lam_status emission_read(const char *path, const emission_scene *scene, bool signs, emission *out,
                         lam_error *error) {
    lam_status status = LAM_OK;
    char extension[16];
    radiosity_request read = {0};
    const codec_scene about = {.n = scene->m->n,
                               .n_channels = scene->m->n_channels,
                               .lights = scene->m->lights,
                               .groups = &scene->groups,
                               .n_tiles = scene->n_tiles,
                               .n_emitters = scene->n_emitters,
                               .emitters = &scene->emitters,
                               .n_luminaires = luminaire_names_count(&scene->names),
                               .luminaires = &scene->names,
                               .signs = signs && scene->n_emitters == 0,
                               .no_sun = "a file of emissions has no sun here: lambertd answers one, and "
                                         "--weather or --sky clear has its own"};
    atomic_file_extension(path, extension);
    const bool npy = strcmp(extension, "npy") == 0;
    if (!npy && strcmp(extension, "json") != 0)
        FAIL(error, LAM_ERR_ARGUMENT, "--emission %s: must end in .npy or .json", path);
    TRY(read_with(npy ? codec_read_npy : codec_read_emissions, path, about, &read, error));
    *out = (emission){.n_vectors = read.n_rhs,
                      .batch = read.batch,
                      .E = read.E,
                      .L = read.sky.values,
                      .converted = read.told.lights,
                      .by_luminance = read.by_luminance,
                      .W = read.emitters.values,
                      .D = read.luminaires.values,
                      .luminaires = scene->luminaires};
    read.E = read.sky.values = read.emitters.values = read.luminaires.values = NULL;
done:
    radiosity_request_free(&read);
    return status;
}

/* The weights that let every emitter shine alone, in all channels alike. */
static lam_status every_emitter(const emission_scene *scene, emission *out, lam_error *error) {
    const size_t s = scene->n_emitters, C = scene->m->n_channels;
    float *W = NULL;
    if (s == 0)
        return status_fail(error, LAM_ERR_ARGUMENT,
                           "the store has no named emitters; precompute it with --emitters, or give a file");
    const lam_status status = emission_allocate("weights of emitters", C, s, s, &W, error);
    if (status != LAM_OK) return status;
    for (size_t row = 0; row < s * C; row++) W[row * s + row / C] = 1;
    *out = (emission){.n_vectors = s, .batch = true, .W = W};
    return LAM_OK;
}

/* An array of emissions, else one of weights where there are emitters. */
static lam_status read_arrays(const char *path, const emission_scene *scene, emission *out,
                              lam_error *error) {
    lam_status status = LAM_OK;
    codec_scene about = {.n = scene->m->n, .n_channels = scene->m->n_channels, .frames = true};
    radiosity_request read = {0};
    lam_error why = {.message = ""}, other = {.message = ""};
    problem_kind kind = PROBLEM_NONE, other_kind = PROBLEM_NONE;
    status = read_kind(codec_read_npy, path, about, &read, &kind, &why);
    const bool weights = kind == PROBLEM_WRONG_LENGTH && scene->n_emitters > 0;
    if (weights) {
        radiosity_request_free(&read);
        read = (radiosity_request){0};
        about.n = scene->n_emitters;
        about.item = "emitter";
        status = read_kind(codec_read_npy, path, about, &read, &other_kind, &other);
        if (other_kind == PROBLEM_WRONG_LENGTH)
            FAIL(error, status, "%s; or weights of the %zu emitters", why.message, about.n);
    }
    if (status != LAM_OK) FAIL(error, status, "%s", weights ? other.message : why.message);
    *out = (emission){.n_vectors = read.n_rhs};
    if (weights)
        out->W = read.E;
    else
        out->E = read.E;
    read.E = NULL;
done:
    radiosity_request_free(&read);
    return status;
}

lam_status emission_read_frames(const char *path, const emission_scene *scene, emission *out,
                                lam_error *error) {
    lam_status status = LAM_OK;
    char extension[16];
    if (strcmp(path, EMISSION_EMITTERS) == 0) return every_emitter(scene, out, error);
    atomic_file_extension(path, extension);
    if (strcmp(extension, "npy") == 0)
        TRY(read_arrays(path, scene, out, error));
    else if (strcmp(extension, "json") == 0)
        TRY(emission_read(path, scene, false, out, error));
    else
        FAIL(error, LAM_ERR_ARGUMENT, "%s: must end in .npy or .json", path);
    out->batch = true;
done:
    return status;
}

/* Makes count copies of the first vector of *values. */
static lam_status repeat(const char *path, size_t n_channels, size_t width, size_t count, float **values,
                         lam_error *error) {
    float *many = NULL;
    const lam_status status = emission_allocate(path, n_channels, width, count, &many, error);
    if (status != LAM_OK) return status;
    for (size_t v = 0; v < count; v++)
        memcpy(many + v * n_channels * width, *values, n_channels * width * sizeof *many);
    free(*values);
    *values = many;
    return LAM_OK;
}

/* Puts e under n_skies skies L [n_skies][C][n_tiles], which are taken over and NULL then. */
static lam_status put_under(emission *e, const char *path, size_t n_channels, size_t n_tiles, size_t n_skies,
                            float **L, lam_error *error) {
    lam_status status = LAM_OK;
    if (e->L != NULL) FAIL(error, LAM_ERR_ARGUMENT, "%s: the emission has a sky of its own", path);
    if (n_skies != e->n_vectors && n_skies != 1 && e->n_vectors != 1)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: %zu skies beside %zu emissions, must be as many, or one", path,
             n_skies, e->n_vectors);
    e->steady = e->n_vectors < n_skies;
    if (e->steady) e->n_vectors = n_skies;
    if (n_skies < e->n_vectors) TRY(repeat(path, n_channels, n_tiles, e->n_vectors, L, error));
    e->L = *L;
    *L = NULL;
done:
    return status;
}

/* Puts [n_skies][3][n_tiles] into one channel: the luminance of Radiance's colours. */
static void take_luminance(size_t n_skies, size_t n_tiles, float *L) {
    for (size_t v = 0; v < n_skies; v++)
        for (size_t t = 0; t < n_tiles; t++) {
            const float *from = L + 3 * v * n_tiles + t;
            /* It lies at or before all that is read later. */
            L[v * n_tiles + t] = (float)luminance_of_radiance((double)from[0], (double)from[n_tiles],
                                                              (double)from[2 * n_tiles]);
        }
}

/* The sky of a matrix, whose patches must be the tiles of the scene. */
static lam_status add_matrix(emission *e, const char *path, const emission_scene *scene, bool photometric,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const size_t C = scene->m->n_channels, m = scene->n_tiles;
    sky_matrix read = {.n = 0};
    float *L = NULL;
    TRY(sky_matrix_read(path, NULL, NULL, &read, error));
    /* Tregenza's tiles are Reinhart's with MF 1. */
    const bool same = strcmp(read.tiling.name, scene->tiling) == 0 ||
                      (strcmp(read.tiling.name, "tregenza") == 0 && strcmp(scene->tiling, "reinhart:1") == 0);
    if (!same)
        FAIL(error, LAM_ERR_ARGUMENT, "--sky %.200s: has the patches of %s, the store has the tiles of %s",
             path, read.tiling.name, scene->tiling);
    if (read.n_channels != 1 && C != 1 && read.n_channels != C)
        FAIL(error, LAM_ERR_ARGUMENT, "--sky %.200s: has %zu components, the store %zu channels", path,
             read.n_channels, C);
    if (read.n_channels > C) {
        take_luminance(read.n, m, read.L);
        e->by_luminance = true;
        read.n_channels = 1;
    }
    TRY(emission_allocate(path, C, m, read.n, &L, error));
    for (size_t row = 0; row < read.n * C; row++)
        memcpy(L + row * m, read.L + (read.n_channels == C ? row : row / C) * m, m * sizeof *L);
    TRY(put_under(e, path, C, m, read.n, &L, error));
    e->batch = true;
    /* Matrices are in W, whatever the answer is to be in. */
    if (photometric) light_units_meet_sky(e, scene, LIGHT_PHOTOMETRIC);
    light_units_meet_sky(e, scene, LIGHT_RADIOMETRIC);
done:
    free(L);
    sky_matrix_free(&read);
    return status;
}

lam_status emission_add_sky(emission *e, const char *path, const emission_scene *scene, bool photometric,
                            lam_error *error) {
    lam_status status = LAM_OK;
    radiosity_request sky = {0};
    codec_scene about = {.n = scene->n_tiles, .n_channels = scene->m->n_channels, .item = "tile of the sky"};
    lam_error other = {.message = ""};
    if (scene->n_tiles == 0)
        FAIL(error, LAM_ERR_ARGUMENT, "--sky %s: the store has no sky; precompute it with --sky", path);
    if (weather_is_named(path))
        FAIL(error, LAM_ERR_ARGUMENT, "--sky %s: hours of a weather file are for lambert solve", path);
    if (sky_matrix_is_named(path)) return add_matrix(e, path, scene, photometric, error);
    status = read_with(codec_read_npy, path, about, &sky, error);
    if (status == LAM_ERR_ARGUMENT && about.n_channels == 1) { /* of another shape: perhaps a coloured one */
        about.n_channels = 3;
        if (read_with(codec_read_npy, path, about, &sky, &other) != LAM_OK) goto done;
        status = LAM_OK;
        take_luminance(sky.n_rhs, about.n, sky.E);
        e->by_luminance = true;
    }
    TRY(status);
    TRY(put_under(e, path, scene->m->n_channels, about.n, sky.n_rhs, &sky.E, error));
    e->batch = e->batch || sky.batch;
    if (photometric) light_units_meet_sky(e, scene, LIGHT_PHOTOMETRIC);
done:
    radiosity_request_free(&sky);
    return status;
}

lam_status emission_add_skies(emission *e, const char *path, const mesh *m, size_t n_tiles, size_t n_skies,
                              const float *L, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t C = m->n_channels;
    float *skies = NULL;
    TRY(emission_allocate(path, C, n_tiles, n_skies, &skies, error));
    for (size_t row = 0; row < n_skies * C; row++)
        memcpy(skies + row * n_tiles, L + row / C * n_tiles, n_tiles * sizeof *L);
    TRY(put_under(e, path, C, n_tiles, n_skies, &skies, error));
    e->batch = true;
done:
    free(skies);
    return status;
}
