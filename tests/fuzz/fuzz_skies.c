/* Requests for skies, for the sun and for rows of weather as a client may send them. */
#include "fuzz/fuzz.h"
#include "solver/codec/sky_request.h"

#include <math.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    const codec_scene scene = {.n = 1, .n_channels = 1};
    sky_request *skies = malloc(SKY_REQUEST_MOST * sizeof *skies);
    char *text = fuzz_text(data, size);
    size_t n = 0;
    problem why = {0};
    if (skies != NULL && codec_read_skies_json(&scene, text, size, skies, &n, &why)) {
        FUZZ_CHECK(n >= 1 && n <= SKY_REQUEST_MOST);
        for (size_t k = 0; k < n; k++) FUZZ_CHECK(!isinf(skies[k].diffuse) && !isinf(skies[k].hour));
    } else if (skies != NULL) {
        fuzz_check_problem(&why);
    }
    free(skies);
    problem why_sun = {0}, why_weather = {0};
    sun_request sun = {.hours = malloc(SUN_REQUEST_MOST * sizeof *sun.hours)};
    weather_request weather;
    if (sun.hours != NULL && codec_read_sun_json(&scene, text, size, &sun, &why_sun)) {
        FUZZ_CHECK(sun.n_hours <= SUN_REQUEST_MOST && sun.year >= 1900 && sun.year <= 2100);
        for (size_t k = 0; k < sun.n_hours; k++) FUZZ_CHECK(sun.hours[k] >= 0 && sun.hours[k] <= 8760);
    } else if (sun.hours != NULL) {
        fuzz_check_problem(&why_sun);
    }
    if (codec_read_weather_json(&scene, false, text, size, &weather, &why_weather))
        FUZZ_CHECK(weather.text != NULL && weather.length > 0 && weather.length <= size);
    else
        fuzz_check_problem(&why_weather);
    free(weather.text);
    free(sun.hours);
    free(text);
    return 0;
}
