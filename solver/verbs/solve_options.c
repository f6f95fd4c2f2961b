#include "solver/verbs/solve_options.h"

#include "solver/base/atomic_file.h"
#include "solver/verbs/sensor_files.h"
#include "solver/verbs/solve_texels.h"

#include "solver/output/output.h"

#include <stdlib.h>
#include <string.h>

#define FIELD(member) offsetof(solve_options, member)
const option_row solve_weather_rows[] = {
    {.name = "weather",
     .kind = OPTION_TEXT,
     .offset = FIELD(weather),
     .argument = "FILE.epw|.wea",
     .help = "The hours of a weather file in place of --sky, as `lambert sky` converts them to the tiles of "
             "the store"},
    {.name = "sun",
     .kind = OPTION_WORD,
     .offset = FIELD(sun),
     .choices = "tiles|exact",
     .preset = "exact",
     .help = "Sun of --weather. exact: the sun itself and its shadows, by rays at the mesh of the store; a "
             "store of few emitters then has exact direct light and takes the bounces from the tile. tiles: "
             "the light of the tile that holds the sun, which is quicker, and 3 to 40 % off on walls"},
    {.name = "sun-points",
     .kind = OPTION_COUNT,
     .offset = FIELD(sun_points),
     .argument = "N",
     .otherwise = "16, or 4 with --annual",
     .least = 1,
     .most = SUN_RAYS_MOST,
     .help =
         "--sun exact: points of an element that are tested for the sun in each hour; from 16 on, elements "
         "that the sun reaches a part of are tested by 8 times as many"},
    OPTION_ROW_GAPS(FIELD(gaps)),
    {0},
};
const option_row solve_answer_rows[] = {
    {.name = "quantity",
     .kind = OPTION_CHOICE,
     .offset = FIELD(quantity),
     .choices = "radiosity|irradiance|indirect",
     .otherwise = "radiosity; irradiance with --annual",
     .argument = "NAME",
     .help = "radiosity, irradiance or indirect"},
    {.name = "figure",
     .kind = OPTION_CHOICE,
     .offset = FIELD(figure),
     .choices = "daylight-factor",
     .not_with = "tolerance|annual|emit|emission|weather|lux-outside|unit-out",
     .help = "daylight-factor: per cent of the illuminance outside that reaches each element under --sky "
             "overcast, "
             "which it implies; 100 H / H outside"},
    {.name = "reduce",
     .kind = OPTION_LIST,
     .offset = FIELD(reduce),
     .argument = "GROUP=FIGURE",
     .help = "mean, sum, min, max, uniformity or variance of a group, or of all whose names begin so "
             "('desk*'); may be repeated"},
    {.name = "at",
     .kind = OPTION_WORD,
     .offset = FIELD(at),
     .choices = "elements|faces|texels",
     .preset = "elements",
     .help = "The places of values. faces: means by area over the fronts of each face of the scene file, in "
             "its order (.npy: NaN, .json: null, .csv: nothing for a face without an element), into "
             ".npy, .json, .csv, or as a table. texels: a lightmap of irradiance, each texel gathered at its "
             "point as at a sensor, into .glb (MOZ_lightmap) or .exr; one light, with the sun of its tile"},
    {.name = "texel",
     .kind = OPTION_NUMBER,
     .offset = FIELD(texel),
     .argument = "X",
     .unit = "m",
     .otherwise = "half the root of the mean area of elements, or longer where that makes more than 65536 "
                  "texels",
     .least = 0,
     .above = true,
     .help = "--at texels: the longest side of a texel; a lightmap has at most 4194304, borders included. "
             "Each takes .5 to 3 ms of a processor"},
    {.name = "emissive",
     .kind = OPTION_FLAG,
     .offset = FIELD(emissive),
     .help = "--at texels: into .glb as emissive texture of black surfaces, which every viewer shows: the "
             "radiosity, in place of the irradiance"},
    {.name = "sensors",
     .kind = OPTION_TEXT,
     .offset = FIELD(sensors),
     .argument = "NAME,...|all",
     .not_with = "reduce|at|smooth|tolerance",
     .help = "Irradiance at sets of sensors of the store, gathered at each point, in place of elements: a "
             "table of each set, or .csv, .json, .npy, .vtu, or a folder, NAME/, as Honeybee reads results: "
             ".ill and sun-up-hours.txt of --weather, .res of one light; of probes nine coefficients of the "
             "radiance (.json, .npy). The sun itself comes to each point (--sun tiles: that of its tile); "
             "with --annual its reflected light is that of its tile, unless --sun exact is given"},
    {.name = "at-least",
     .kind = OPTION_TEXT,
     .offset = FIELD(at_least),
     .argument = "X,...",
     .help = "--sensors: the share of the points of each set with at least X, in the unit of the answer "
             "(300,500 lx; of figures of a year their own, 0.5)"},
    {.name = "smooth",
     .kind = OPTION_FLAG,
     .offset = FIELD(smooth),
     .help = "Write the light at the corners of elements, which neighbours give it, beside the mean (.ply, "
             ".vtu) or in its place (.glb; .npy: one more dimension, 4, NaN where a triangle has no corner)"},
    {.name = "linear",
     .kind = OPTION_FLAG,
     .offset = FIELD(linear),
     .help = "Leave light below zero, which else is raised to zero with the means of groups kept"},
    {.name = "json",
     .kind = OPTION_FLAG,
     .offset = FIELD(json),
     .help = "Print JSON in place of a table, without -o"},
    {.name = "verbose",
     .kind = OPTION_FLAG,
     .offset = FIELD(verbose),
     .help = "Print the parts of the stated error, too"},
    {.name = "tolerance",
     .kind = OPTION_NUMBER,
     .offset = FIELD(tolerance),
     .argument = "X",
     .least = 0,
     .most = 1,
     .above = true,
     .below = true,
     .help = "Refine the answer in double until its certified error is at most X times the largest indirect "
             "light, and write double; the store must keep its form factors"},
    {0},
};
const option_row solve_year_rows[] = {
    {.name = "annual",
     .kind = OPTION_LIST,
     .offset = FIELD(annual),
     .argument = "FIGURE",
     .help = "sum: over all hours, in 1000 h (kWh/m2 from W/m2, klx h from lx); autonomy=X: share of the "
             "hours (0 to 1) with at least X; useful=LOW,HIGH: share of the hours with LOW to HIGH, both "
             "included (100,2000 lx); daylit=X: of a whole year, hours with at least X over those of "
             "daylight, half of the year; sun=X: hours with more than X by the sun itself; sun=X,HOURS: 1 "
             "where these are more than so many (sun=1000,250), else 0; may be repeated. X, LOW and HIGH are "
             "in the unit of the answer: lx with --photometric, --unit-out lx or a store in lm"},
    {.name = "occupied",
     .kind = OPTION_TEXT,
     .offset = FIELD(occupied),
     .argument = "FROM-TO",
     .otherwise = "all",
     .help = "Hours of the day in standard time that shares refer to, such as 8-18; the batch must be whole "
             "days from midnight on, or rows of --weather, which have their times"},
    {.name = "hours-per-vector",
     .kind = OPTION_NUMBER,
     .offset = FIELD(hours),
     .argument = "H",
     .otherwise = "1, or the step of the rows of --weather",
     .least = 0,
     .above = true,
     .most = 8784,
     .help =
         "Duration of each vector of the batch. With --weather it must be that of the rows, unless no two "
         "rows are neighbours"},
    {0},
};

/* The figures of --annual and their options. */
static lam_status read_year(const solve_options *f, annual_options *year, lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t i = 0; i < f->annual.count; i++) TRY(annual_add(year, f->annual.items[i], error));
    if (f->annual.count == 0 && f->hours > 0)
        FAIL(error, LAM_ERR_ARGUMENT, "--hours-per-vector is for --annual");
    if (!annual_has_shares(year) && !annual_has_sun(year) && f->occupied != NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "--occupied is for --annual autonomy=X, useful=LOW,HIGH and sun=X");
    if (annual_has_sun(year) && f->quantity != NULL && strcmp(f->quantity, "irradiance") != 0)
        FAIL(error, LAM_ERR_ARGUMENT, "--annual sun=X: the sun gives irradiance, not %s", f->quantity);
    if (f->hours > 0) year->hours = f->hours;
    if (f->occupied != NULL) TRY(annual_parse_occupied(f->occupied, year, error));
done:
    return status;
}

/* Checks the options of --at texels, which take no sun itself but that of its tile, and of sensors. */
static lam_status check_places(solve_options *f, lam_error *error) {
    lam_status status = LAM_OK;
    const bool texels = f->at == AT_TEXELS;
    if (!texels && (f->texel > 0 || f->emissive))
        FAIL(error, LAM_ERR_ARGUMENT, "--%s is for --at texels", f->texel > 0 ? "texel" : "emissive");
    if (texels && f->output == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "--at texels is for -o FILE.glb or FILE.exr");
    if (texels && (f->reduce.count > 0 || f->smooth || f->tolerance > 0 || f->annual.count > 0 || f->linear))
        FAIL(error, LAM_ERR_ARGUMENT, "--at texels is of single texels of one light: leave out --%s",
             f->reduce.count > 0   ? "reduce"
             : f->smooth           ? "smooth"
             : f->tolerance > 0    ? "tolerance"
             : f->annual.count > 0 ? "annual"
                                   : "linear");
    if (texels && f->quantity == NULL) f->quantity = f->emissive ? "radiosity" : "irradiance";
    if (texels && strcmp(f->quantity, "indirect") == 0)
        FAIL(error, LAM_ERR_ARGUMENT, "--at texels: texels have irradiance or radiosity, not indirect light");
    char extension[16] = "";
    if (texels) atomic_file_extension(f->output, extension);
    if (strcmp(extension, "glb") == 0 && f->emissive != (strcmp(f->quantity, "radiosity") == 0))
        FAIL(error, LAM_ERR_ARGUMENT, "-o %s: %s", f->output,
             f->emissive ? "--emissive shows --quantity radiosity"
                         : "radiosity goes into a .glb by --emissive, or into .exr");
    if (f->sensors != NULL && f->quantity == NULL) f->quantity = "irradiance";
    if (texels && !f->sun_given) { /* no sun itself comes to texels yet */
        f->sun = SUN_TILES;
        f->light.at.sun_in_tiles = true;
    }
    if (f->sensors != NULL && strcmp(f->quantity, "irradiance") != 0)
        FAIL(error, LAM_ERR_ARGUMENT, "--sensors: receive irradiance, not %s", f->quantity);
done:
    return status;
}

/* Checks the light of the sky, and its sun. */
static lam_status check_sky(solve_options *f, const option_result *given, lam_error *error) {
    lam_status status = LAM_OK;
    if (f->light.sky != NULL && f->weather != NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "give --sky or --weather, not both");
    if (f->light.sky != NULL && weather_is_named(f->light.sky)) {
        f->weather = f->light.sky;
        f->light.sky = NULL;
    }
    f->light.weather = f->weather != NULL;
    if (f->figure != NULL) {
        if (f->light.sky == NULL) f->light.sky = "overcast";
        if (strcmp(f->light.sky, "overcast") != 0)
            FAIL(error, LAM_ERR_ARGUMENT, "--figure daylight-factor is of --sky overcast");
        if (f->quantity != NULL && strcmp(f->quantity, "irradiance") != 0)
            FAIL(error, LAM_ERR_ARGUMENT, "--figure daylight-factor is of --quantity irradiance");
        f->quantity = "irradiance";
        f->light.at.lux_outside = 100; /* of which answers are per cent */
    }
    TRY(light_check(&f->light, error));
    if (f->weather != NULL && !weather_is_named(f->weather))
        FAIL(error, LAM_ERR_ARGUMENT, "--weather %s: must end in .epw or .wea", f->weather);
    static const char *const of_weather[] = {"gaps", "sun", "sun-points"};
    const bool named = light_named_sky(&f->light) != NULL;
    for (size_t k = 0; f->weather == NULL && k < (named ? 1 : sizeof of_weather / sizeof of_weather[0]); k++)
        if (options_given(given, of_weather[k]))
            FAIL(error, LAM_ERR_ARGUMENT, "--%s is for --weather%s", of_weather[k],
                 k > 0 ? " and named skies" : "");
    if (sky_options_moment(&f->light.at) != NULL && f->annual.count > 0)
        FAIL(error, LAM_ERR_ARGUMENT, "--annual is of all rows: leave out --date and --hour");
    f->light.at.sun_in_tiles = f->sun == SUN_TILES;
    f->light.at.sun_points = (size_t)f->sun_points;
    f->sun_given = options_given(given, "sun");
    if (f->sun != SUN_EXACT && options_given(given, "sun-points"))
        FAIL(error, LAM_ERR_ARGUMENT, "--sun-points is for --sun exact");
done:
    return status;
}

lam_status solve_options_check(solve_options *f, const option_result *given, annual_options *year,
                               lam_error *error) {
    lam_status status = LAM_OK;
    TRY(check_sky(f, given, error));
    if (f->tolerance > 0 && f->annual.count > 0)
        FAIL(error, LAM_ERR_ARGUMENT, "--tolerance is not for --annual");
    if (f->tolerance > 0 && f->linear)
        FAIL(error, LAM_ERR_ARGUMENT, "--linear is not for --tolerance, whose answers are not below zero");
    if (f->json && f->output != NULL) FAIL(error, LAM_ERR_ARGUMENT, "give --json or -o, not both");
    if (f->smooth && (f->output == NULL || f->reduce.count > 0 || f->tolerance > 0))
        FAIL(error, LAM_ERR_ARGUMENT, "--smooth is for -o, without --reduce and --tolerance");
    if (f->at == AT_FACES && (f->reduce.count > 0 || f->smooth))
        FAIL(error, LAM_ERR_ARGUMENT, "--at faces is of single faces: leave out --%s",
             f->smooth ? "smooth" : "reduce");
    const output_content content = f->smooth             ? OUTPUT_CORNERS
                                   : f->at == AT_FACES   ? OUTPUT_FACES
                                   : f->reduce.count > 0 ? OUTPUT_GROUPS
                                                         : OUTPUT_ELEMENTS;
    if (f->sensors != NULL && f->output != NULL && sensor_results_named(f->output) && f->annual.count > 0)
        FAIL(error, LAM_ERR_ARGUMENT,
             "-o %s: results are of hours: figures of --annual go into .csv, .json, .npy or .vtu", f->output);
    if (f->output != NULL)
        TRY(f->sensors != NULL   ? solve_sensors_check(f->output, error)
            : f->at == AT_TEXELS ? solve_texels_check(f->output, error)
                                 : output_check(f->output, content, error));
    if (f->at_least != NULL) {
        sensor_choice read;
        if (f->sensors == NULL) FAIL(error, LAM_ERR_ARGUMENT, "--at-least is for --sensors");
        TRY(sensor_choice_least(f->at_least, &read, error));
    }
    TRY(check_places(f, error));
    TRY(read_year(f, year, error));
    /* Studies of daylight ask for the light that a place receives. */
    if (f->quantity == NULL) f->quantity = year->n_figures > 0 ? "irradiance" : "radiosity";
done:
    return status;
}
