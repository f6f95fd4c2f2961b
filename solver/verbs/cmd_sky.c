/* lambert sky: turns a weather file, a sky matrix of Radiance or the name of a sky into the radiance of the
 * tiles of a sky, hour by hour. */
#include "solver/base/atomic_file.h"
#include "solver/base/options/options.h"
#include "solver/base/photometry.h"
#include "solver/base/terminal.h"
#include "solver/daylight/sky_matrix.h"
#include "solver/light/sky_options.h"
#include "solver/light/weather_light.h"
#include "solver/output/output.h"
#include "solver/verbs/verbs.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct fields {
    const char *output, *tiles, *model;
    weather_gaps gaps;
    sky_options at;
} fields;

static lam_status parse_tiles(const char *text, void *field, lam_error *error) {
    lam_status status = LAM_OK;
    sky_tiling tiling = {0};
    const char **tiles = field;
    lam_error why = {0};
    if (strcmp(text, "tregenza") != 0 && strncmp(text, "reinhart:", 9) != 0 && strncmp(text, "grid:", 5) != 0)
        FAIL(error, LAM_ERR_ARGUMENT, "--tiles %.60s: must be tregenza, reinhart:MF or grid:AxB", text);
    status = sky_tiling_create(text, 'z', &tiling, &why);
    if (status != LAM_OK) FAIL(error, status, "--tiles %s", why.message);
    *tiles = text;
done:
    sky_tiling_free(&tiling);
    return status;
}

#define FIELD(member) offsetof(fields, member)
static const option_row rows[] = {
    OPTION_ROW_OUTPUT(
        FIELD(output), "SKY.npy",
        .help =
            "Where the skies go: float32 [rows][tiles], W/(m2 sr), the batch that `lambert solve --sky` "
            "takes for a store of one channel. A store of three channels takes [rows][3][tiles], every row "
            "three times; a matrix whose components differ is written so"),
    {.name = "tiles",
     .kind = OPTION_CUSTOM,
     .offset = FIELD(tiles),
     .argument = "tregenza|reinhart:MF|grid:AxB",
     .otherwise = "tregenza, or the tiles of the matrix, which cannot be changed",
     .parse = parse_tiles,
     .help = "Tiles of the --sky of the store: 145, 144 MF^2 + 1, or A sectors by B bands"},
    {.name = "model",
     .kind = OPTION_CHOICE,
     .offset = FIELD(model),
     .choices = "perez",
     .preset = "perez",
     .help = "The all-weather sky of Perez, Seals and Michalsky 1993"},
    OPTION_ROW_GAPS(FIELD(gaps)),
    {0},
};

static const option_command verb = {
    .name = "lambert sky",
    .arguments = "WEATHER.epw|.wea|MATRIX.mtx|NAME -o SKY.npy",
    .summary =
        "Turn the weather of a year, a sky matrix of Radiance, or a sky by name (even, overcast, clear, "
        "turbidity:T), into the radiance of the tiles of a sky, row by row.",
    .notes =
        "The sky of a row is as bright as the diffuse light in the file, and the one tile that holds the "
        "sun has the direct light: a horizontal plane receives exactly what the file states. The sun stands "
        "where it is in the middle of what the row covers; direct light of a sun that is below the horizon "
        "then is left out. Rows may be an hour apart or less: the step comes from their times, and is one "
        "for "
        "the whole file. Rows that are missing, repeated or out of order are refused, but for --gaps. A .wea "
        "file is of the "
        "year 2001, or of 2000 if it has a 29 February.\n"
        "A sky matrix of Radiance (gendaymtx, genskyvec) is taken as it is: ascii, float or double, with a "
        "row for the ground and for each patch, and a column for each time. The row of the ground is left "
        "out: --ground-albedo of the store takes its place.",
    .least_arguments = 1,
    .most_arguments = 1,
};

static lam_status make_skies(const char *path, const fields *f, terminal *t, lam_error *error) {
    lam_status status = LAM_OK;
    sky_tiling tiling = {0};
    weather_skies made = {0};
    atomic_file file = {0};
    TRY(atomic_file_check(f->output, error));
    TRY(sky_tiling_create(f->tiles != NULL ? f->tiles : "tregenza", 'z', &tiling, error));
    const year_options year = {.photometric = f->at.photometric,
                               .sun_in_tiles = true,
                               .north = isnan(f->at.north) ? 0 : f->at.north};
    TRY(weather_skies_read(path, f->gaps, sky_options_moment(&f->at), &tiling, &year, t, &made, error));
    TRY(atomic_file_open(f->output, &file, error));
    TRY(output_array(file.stream, 2, (const size_t[2]){made.n, tiling.n_tiles}, made.L, NULL, error));
    TRY(atomic_file_commit(&file, error));
    printf("%s: %zu skies of %zu tiles (%s), %s\n", f->output, made.n, tiling.n_tiles, tiling.name,
           f->at.photometric ? "cd/m2" : "W/(m2 sr)");
    /* An array holds no times. */
    if (made.span.step != 1)
        terminal_log(t, "figures of a year of this array need --hours-per-vector %.10g", made.span.step);
done:
    atomic_file_abort(&file);
    weather_skies_free(&made);
    sky_tiling_free(&tiling);
    return status;
}

/* One sky by name. */
static lam_status make_named(const char *name, const fields *f, terminal *t, lam_error *error) {
    lam_status status = LAM_OK;
    sky_tiling tiling = {0};
    atomic_file file = {0};
    double *L = NULL;
    float *narrow = NULL;
    year_sun sun;
    char said[SKY_SAID] = "";
    const bool lux = f->at.photometric || f->at.lux_outside > 0 || !f->at.place.given;
    TRY(atomic_file_check(f->output, error));
    TRY(sky_tiling_create(f->tiles != NULL ? f->tiles : "tregenza", 'z', &tiling, error));
    L = memory_allocate(tiling.n_tiles, sizeof *L, "the sky", error);
    narrow = memory_allocate(tiling.n_tiles, sizeof *narrow, "the sky", error);
    if (L == NULL || narrow == NULL) TRY(LAM_ERR_MEMORY);
    TRY(sky_options_make(&f->at, name, isnan(f->at.north) ? 0 : f->at.north, &tiling, true, L, &sun, said,
                         error));
    for (size_t k = 0; k < tiling.n_tiles; k++) narrow[k] = (float)L[k];
    terminal_log(t, "%s", said);
    TRY(atomic_file_open(f->output, &file, error));
    TRY(output_array(file.stream, 2, (const size_t[2]){1, tiling.n_tiles}, narrow, NULL, error));
    TRY(atomic_file_commit(&file, error));
    printf("%s: 1 sky of %zu tiles (%s), %s\n", f->output, tiling.n_tiles, tiling.name,
           lux ? "cd/m2" : "W/(m2 sr)");
done:
    atomic_file_abort(&file);
    free(L);
    free(narrow);
    sky_tiling_free(&tiling);
    return status;
}

/* Multiplies every radiance by a factor. received[c] += sum L cos over all hours: the light of channel c on a
 * horizontal plane. */
static void weigh(sky_matrix *m, double factor, double received[3], bool *lit) {
    const size_t n_tiles = m->tiling.n_tiles;
    for (size_t k = 0; k < m->n * m->n_channels * n_tiles; k++) {
        const double value = (double)m->L[k] * factor;
        m->L[k] = (float)value;
        received[k / n_tiles % m->n_channels] += value * m->tiling.tiles[k % n_tiles].cosine;
        *lit = *lit || value > 0;
    }
}

static lam_status convert_matrix(const char *path, const fields *f, terminal *t, lam_error *error) {
    lam_status status = LAM_OK;
    sky_matrix m = {0};
    atomic_file file = {0};
    const progress steps = terminal_progress(t);
    double received[3] = {0};
    bool lit = false;
    TRY(atomic_file_check(f->output, error));
    TRY(sky_matrix_read(path, f->tiles, &steps, &m, error));
    weigh(&m, f->at.photometric ? WHITE_EFFICACY : 1, received, &lit);
    terminal_clear(t);
    if (!lit) FAIL(error, LAM_ERR_ARGUMENT, "%s: the sky is dark in all %zu columns", path, m.n);
    for (size_t c = 0; c < m.n_channels; c++)
        terminal_log(t, "on a horizontal plane%s: %.1f %s, if a column is an hour",
                     m.n_channels == 1 ? ""
                     : c == 0          ? ", first component"
                     : c == 1          ? ", second"
                                       : ", third",
                     received[c] * 1e-3, f->at.photometric ? "klx h" : "kWh/m2");
    TRY(atomic_file_open(f->output, &file, error));
    if (m.n_channels == 1)
        TRY(output_array(file.stream, 2, (const size_t[2]){m.n, m.tiling.n_tiles}, m.L, NULL, error));
    else
        TRY(output_array(file.stream, 3, (const size_t[3]){m.n, m.n_channels, m.tiling.n_tiles}, m.L, NULL,
                         error));
    TRY(atomic_file_commit(&file, error));
    printf("%s: %zu skies of %zu tiles (%s), %s%s\n", f->output, m.n, m.tiling.n_tiles, m.tiling.name,
           m.n_channels == 1 ? "" : "three components, ", f->at.photometric ? "cd/m2" : "W/(m2 sr)");
done:
    atomic_file_abort(&file);
    sky_matrix_free(&m);
    return status;
}

int cmd_sky(int argc, char **argv) {
    fields f = {.at.north = NAN};
    option_result given = {0};
    lam_error error = {0};
    terminal term;
    char extension[16];
    const option_table tables[] = {
        {NULL, rows, &f}, {"", sky_time_rows, &f.at}, {"", sky_named_rows, &f.at}, {0}};
    int code = options_parse(&verb, tables, argc, argv, &given);
    if (code != OPTIONS_GO) return code;
    const char *path = given.arguments[0];
    if (f.output == NULL) return options_usage(verb.name, "no -o SKY.npy given");
    atomic_file_extension(f.output, extension);
    if (strcmp(extension, "npy") != 0) return options_usage(verb.name, "-o %s: must end in .npy", f.output);
    const bool matrix = sky_matrix_is_named(path), named = named_sky_is(path);
    if (!matrix && !named && !weather_is_named(path))
        return options_usage(verb.name, "%s: must end in .epw or .wea, or in .mtx or .smx, or name a sky",
                             path);
    if ((matrix || named) && options_given(&given, "gaps"))
        return options_usage(verb.name, "--gaps is for weather");
    /* A matrix is of a time and a place, and knows light in W alone. */
    sky_options at = f.at;
    if (matrix) at.photometric = false;
    if (sky_options_check(&at, named ? path : NULL, !matrix && !named, false, &error) != LAM_OK)
        return options_usage(verb.name, "%s", error.message);
    terminal_open(&term, verb.name, false, false);
    const lam_status status = (matrix  ? convert_matrix
                               : named ? make_named
                                       : make_skies)(path, &f, &term, &error);
    return status == LAM_OK ? 0 : terminal_fail(&term, &error);
}
