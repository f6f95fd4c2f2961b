/* POST /v1/weather: the place, the times and the rows of a weather file whose text is sent. POST
 * /v1/scenes/NAME/weather: those of the file beside the store. Nothing is kept. */
#include "server/route/routes.h"
#include "server/route/weather_source.h"
#include "solver/codec/json_writer.h"
#include "solver/codec/sky_request.h"
#include "solver/daylight/weather_mend.h"

#include <stdlib.h>
#include <string.h>

/* A text of a weather file has at most so many bytes: a year of an EPW has 1.6 MB. */
enum { TEXT_MOST = 16 << 20 };
/* Bytes of the answer beside its rows, and of a row in seven columns with its day, at most. */
enum { HEAD_BYTES = 2048, ROW_BYTES = 7 * 17 + 10 };

static double of_row(const weather_hour *h, size_t column) {
    const double values[] = {h->year, h->month, h->day, h->hour, h->direct, h->diffuse, h->dew_point};
    return values[column];
}

static bool write_columns(const weather *w, float *narrow, buffer *b) {
    const char *const names[] = {
        "year",    "month",    "day", "hour", w->direct_is_horizontal ? "direct_horizontal" : "direct",
        "diffuse", "dew_point"};
    bool written = true;
    for (size_t column = 0; column < sizeof names / sizeof names[0] && written; column++) {
        for (size_t i = 0; i < w->n; i++) narrow[i] = (float)of_row(&w->hours[i], column);
        written = buffer_printf(b, ",\"%s\":", names[column]) && json_write_floats(b, narrow, w->n);
    }
    return written;
}

/* The days in the order of the rows; years may be of several. */
static bool write_days(const weather *w, buffer *b) {
    bool written = buffer_append_text(b, ",\"days\":[");
    const weather_hour *before = NULL;
    for (size_t i = 0; i < w->n && written; i++) {
        const weather_hour *h = &w->hours[i];
        if (before != NULL && h->month == before->month && h->day == before->day) continue;
        written = buffer_printf(b, "%s[%d,%d]", before != NULL ? "," : "", h->month, h->day);
        before = h;
    }
    return written && buffer_append_text(b, "]");
}

static bool write_mended(const weather_mended *m, buffer *b) {
    const struct {
        const char *name;
        double value;
    } told[] = {{"night", (double)m->night},
                {"below", (double)m->below},
                {"no_dew_point", (double)m->no_dew},
                {"repeated", (double)m->repeated},
                {"unordered", (double)m->unordered},
                {"filled", m->between + m->by_days},
                {"dark", m->dark},
                {"skipped", m->skipped}};
    bool written = buffer_append_text(b, ",\"mended\":{");
    for (size_t k = 0; k < sizeof told / sizeof told[0] && written; k++)
        written = buffer_printf(b, "%s\"%s\":", k > 0 ? "," : "", told[k].name) &&
                  json_write_double(b, told[k].value);
    return written && buffer_append_text(b, "}");
}

static bool write_weather(const weather *w, const char *format, float *narrow, buffer *b) {
    const struct {
        const char *name;
        double value;
    } told[] = {{"latitude", w->latitude},
                {"longitude", w->longitude},
                {"zone", w->time_zone},
                {"elevation", w->elevation},
                {"step", w->step}};
    bool written = buffer_printf(b, "{\"format\":\"%s\",\"place\":", format) && json_write_text(b, w->place);
    for (size_t k = 0; k < sizeof told / sizeof told[0] && written; k++)
        written = buffer_printf(b, ",\"%s\":", told[k].name) && json_write_double(b, told[k].value);
    return written && buffer_printf(b, ",\"rows\":%zu", w->n) && write_mended(&w->mended, b) &&
           write_days(w, b) && write_columns(w, narrow, b) && buffer_append_text(b, "}\n");
}

/* Reads the text of the body, or that beside the store. */
static bool read_weather(const call *in, weather_request *request, const char **format, weather *w,
                         problem *why) {
    const bool beside = in->scene != NULL;
    const codec_scene about = {.n_channels = 1};
    if (in->body_type != MEDIA_JSON)
        return problem_set(why, PROBLEM_MEDIA_TYPE, "Content-Type must be application/json");
    if (!(beside && in->length == 0) &&
        (!request_memory_take(in->memory, bytes_times(in->length, 2), why) ||
         !codec_read_weather_json(&about, beside, in->body, in->length, request, why)))
        return false;
    if (beside) {
        *format = (in->scene->base != NULL ? in->scene->base : in->scene)->weather.format;
        return weather_source_read_beside(in, request->gaps, "", w, why);
    }
    *format = weather_source_format(request->text, request->length);
    if (*format == NULL)
        return problem_set(why, PROBLEM_BAD_VALUE,
                           "text is neither an EPW nor a WEA: it begins with neither LOCATION nor place");
    if (request->length > TEXT_MOST)
        return problem_set(why, PROBLEM_TOO_MUCH, "text has %zu bytes, a weather file at most %d",
                           request->length, TEXT_MOST);
    const weather_source text = {.bytes = request->text, .length = request->length, .format = *format};
    return weather_source_read(in, &text, request->gaps, PROBLEM_BAD_VALUE, "", w, why);
}

void post_weather(call *in, answer *out) {
    weather w = {0};
    weather_request request = {.text = NULL};
    problem why = {0};
    buffer b = {0};
    float *narrow = NULL;
    const char *format = NULL;
    bool good = read_weather(in, &request, &format, &w, &why);
    const size_t bytes = bytes_plus(bytes_times(w.n, ROW_BYTES), HEAD_BYTES);
    if (good) narrow = call_allocate(in, bytes_times(w.n, sizeof *narrow), "rows of weather", &why);
    good = good && narrow != NULL && request_memory_take(in->memory, bytes, &why) &&
           (buffer_reserve(&b, bytes) ||
            problem_set(&why, PROBLEM_NO_MEMORY, "not enough memory for the answer"));
    if (good)
        answer_json(out, &b, write_weather(&w, format, narrow, &b));
    else
        answer_problem(out, &why);
    buffer_free(&b);
    weather_free(&w);
    free(request.text);
    free(narrow);
}
