/* POST /v1/sun: the positions of the sun at a place, at hours of a year, by solver/daylight. Nothing is kept.
 */
#include "server/route/routes.h"
#include "solver/codec/json_writer.h"
#include "solver/codec/sky_request.h"
#include "solver/daylight/moment.h"
#include "solver/daylight/sun.h"

#include <math.h>
#include <stdlib.h>

#define DEGREE (M_PI / 180)

enum { HEAD_BYTES = 64, NUMBER_BYTES = 17 };

/* Sets azimuth [n] and altitude [n], degrees. */
static void find_positions(const sun_request *request, float *azimuth, float *altitude) {
    for (size_t k = 0; k < request->n_hours; k++) {
        /* The end of the year is that of its last day. */
        const moment at = moment_of_hour(fmin(request->hours[k], nextafter(8760, 0)));
        const sun_position sun = sun_at(request->place.latitude, request->place.longitude,
                                        request->place.zone, (int)request->year, at.month, at.day, at.hour);
        azimuth[k] = (float)(sun.azimuth / DEGREE);
        altitude[k] = (float)(sun.altitude / DEGREE);
    }
}

static bool write_positions(buffer *b, const float *azimuth, const float *altitude, size_t n) {
    return buffer_append_text(b, "{\"azimuth\":") && json_write_floats(b, azimuth, n) &&
           buffer_append_text(b, ",\"altitude\":") && json_write_floats(b, altitude, n) &&
           buffer_append_text(b, "}\n");
}

void post_sun(call *in, answer *out) {
    problem why = {0};
    buffer b = {0};
    sun_request request = {.n_hours = 0};
    float *angles = NULL;
    const codec_scene about = {.n_channels = 1};
    bool good = in->body_type == MEDIA_JSON ||
                problem_set(&why, PROBLEM_MEDIA_TYPE, "Content-Type must be application/json");
    if (good) request.hours = call_allocate(in, SUN_REQUEST_MOST * sizeof *request.hours, "hours", &why);
    good = good && request.hours != NULL && codec_read_sun_json(&about, in->body, in->length, &request, &why);
    const size_t n = request.n_hours, bytes = 2 * n * NUMBER_BYTES + HEAD_BYTES;
    if (good) angles = call_allocate(in, 2 * n * sizeof *angles, "positions of the sun", &why);
    good = good && angles != NULL && request_memory_take(in->memory, bytes, &why) &&
           (buffer_reserve(&b, bytes) ||
            problem_set(&why, PROBLEM_NO_MEMORY, "not enough memory for the answer"));
    if (good) {
        find_positions(&request, angles, angles + n);
        answer_json(out, &b, write_positions(&b, angles, angles + n, n));
    } else {
        answer_problem(out, &why);
    }
    buffer_free(&b);
    free(request.hours);
    free(angles);
}
