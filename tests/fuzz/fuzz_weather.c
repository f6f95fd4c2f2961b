/* Weather files of both formats, with gaps refused, filled and left out. */
#include "fuzz/fuzz.h"
#include "solver/daylight/weather.h"

#include <math.h>

/* The last byte says which: its lowest bit the format, the rest what becomes of gaps. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (size == 0) return 0;
    const char *name = data[size - 1] % 2 == 0 ? "a.wea" : "a.epw";
    const weather_gaps gaps = (weather_gaps)(data[size - 1] / 2 % 3);
    char *text = fuzz_text(data, size - 1);
    weather w = {.n = 0};
    lam_error error = {.message = ""};
    if (weather_read_text(name, text, size - 1, gaps, &w, &error) == LAM_OK) {
        FUZZ_CHECK(w.n > 0 && w.step > 0 && w.step <= 6);
        for (size_t i = 0; i < w.n; i++) {
            const weather_hour *h = &w.hours[i];
            FUZZ_CHECK(h->hour >= 0 && h->hour <= 24.5 && h->month >= 1 && h->month <= 12 && h->day >= 1 &&
                       h->day <= 31);
            FUZZ_CHECK(h->direct >= 0 && h->direct <= 3000 && h->diffuse >= 0 && h->diffuse <= 3000);
        }
    } else {
        FUZZ_CHECK(w.n == 0 && error.message[0] != '\0');
    }
    weather_free(&w);
    free(text);
    return 0;
}
