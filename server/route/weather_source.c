#include "server/route/weather_source.h"

#include "solver/daylight/weather_mend.h"
#include "solver/daylight/weather_times.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

/* A row of a WEA has 10 bytes or more, five numbers; one of an EPW 32, sixteen fields. */
enum { WEA_ROW_BYTES = 10, EPW_ROW_BYTES = 32 };

const char *weather_source_format(const char *bytes, size_t length) {
    static const char epw[] = "LOCATION,", wea[] = "place";
    if (length >= 3 && memcmp(bytes, "\xEF\xBB\xBF", 3) == 0) { /* a byte order mark */
        bytes += 3;
        length -= 3;
    }
    if (length >= sizeof epw - 1 && strncasecmp(bytes, epw, sizeof epw - 1) == 0) return "epw";
    return length >= sizeof wea - 1 && memcmp(bytes, wea, sizeof wea - 1) == 0 ? "wea" : NULL;
}

static bool find_gaps(const char *word, weather_gaps *gaps) {
    static const char *const words[] = {"refuse", "fill", "skip"};
    *gaps = WEATHER_REFUSE;
    if (word[0] == '\0') return true;
    for (size_t k = 0; k < 3; k++)
        if (strcmp(word, words[k]) == 0) {
            *gaps = (weather_gaps)k;
            return true;
        }
    return false;
}

bool weather_source_read(const call *in, const weather_source *text, const char *gaps, problem_kind wrong,
                         const char *what, weather *out, problem *why) {
    weather_gaps way;
    char name[16];
    lam_error error = {.message = ""};
    if (!find_gaps(gaps, &way))
        return problem_set(why, PROBLEM_UNKNOWN_WORD, "%sgaps must be refuse, fill or skip", what);
    const size_t row = strcmp(text->format, "epw") == 0 ? EPW_ROW_BYTES : WEA_ROW_BYTES;
    const size_t times = way == WEATHER_FILL ? 1 + WEATHER_FILL_MOST : 1;
    const size_t bytes =
        bytes_times(text->length / row + 1, times * (sizeof(weather_hour) + sizeof(weather_row)));
    if (!request_memory_take(in->memory, bytes, why)) return false;
    snprintf(name, sizeof name, "weather.%s", text->format);
    const lam_status status = weather_read_text(name, text->bytes, text->length, way, out, &error);
    return status == LAM_OK || problem_set(why, status == LAM_ERR_MEMORY ? PROBLEM_NO_MEMORY : wrong, "%s%s",
                                           what, error.message);
}

bool weather_source_read_beside(const call *in, const char *gaps, const char *what, weather *out,
                                problem *why) {
    const scene *s = in->scene->base != NULL ? in->scene->base : in->scene;
    if (s->texts.weather == NULL) return problem_set(why, PROBLEM_NOT_IN_STORE, "%s%s", what, s->weather.why);
    kept_bytes *kept = kept_forms_find(s->texts.weather, 0);
    if (kept == NULL) return problem_set(why, PROBLEM_NO_MEMORY, "the weather of the scene is not there");
    const weather_source text = {.bytes = (const char *)kept->content.bytes,
                                 .length = kept->content.length,
                                 .format = s->weather.format};
    const bool read = weather_source_read(in, &text, gaps, PROBLEM_NOT_IN_STORE, what, out, why);
    kept_bytes_release(kept);
    return read;
}
