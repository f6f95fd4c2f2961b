#include "server/route/eye_figures.h"

#include "server/route/request_memory.h"
#include "server/scene/direct_light.h"
#include "solver/base/clock.h"
#include "solver/base/photometry.h"
#include "solver/codec/json_writer.h"
#include "solver/figures/eye_rating.h"
#include "solver/operator/sensor_light.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The most characters of a number and of the words beside it. */
#define NUMBER_TEXT ((size_t)48)

/* Numbers of an eye, and of a luminaire that counts. */
enum { EYE_NUMBERS = 2, PART_NUMBERS = 5 };

struct eye_figures {
    const lam_sensors *sensors;
    const lam_luminaires *luminaires;
    const float *D; /* [n_rhs][C][luminaires] of the request, or NULL */
    size_t n_rhs, n_luminaires, n_eyes;
    bool parts;
    size_t *start;       /* [n_names + 1]: the eyes of a name among those below */
    uint32_t *receivers; /* [n_eyes] */
    double *all;         /* [n_rhs][n_eyes], NAN where an eye has no value */
    double *dimmer;      /* [luminaires], of `vector` */
    glare_part *part;    /* [luminaires], work */
    size_t vector, next; /* next: eye to write */
};

/* The eyes of name k. */
static size_t count_eyes(const scene *s, const reduce_name *name) {
    size_t count = 0;
    for (size_t g = 0; g < name->n_groups; g++)
        count += s->sensor_sets.start[name->groups[g] + 1] - s->sensor_sets.start[name->groups[g]];
    return count;
}

/* Characters of the parts of all luminaires that the request's only vector lights. */
static size_t parts_text(const scene *s, const radiosity_request *request) {
    const size_t C = s->n_channels, q = scene_luminaires(s);
    size_t length = 0;
    for (size_t k = 0; request->luminaires.values != NULL && k < q; k++) {
        bool lit = false;
        for (size_t c = 0; c < C; c++) lit = lit || request->luminaires.values[c * q + k] > 0;
        /* An escape has up to six letters. */
        if (lit) length += 6 * strlen(lam_luminaires_name(s->luminaires, k)) + PART_NUMBERS * NUMBER_TEXT;
    }
    return length;
}

size_t eye_figures_bytes(const scene *s, const radiosity_request *request) {
    const reduce_request *r = &request->reduce;
    size_t eyes = 0;
    if (!r->of_sensors || !reduce_has_ugr(r)) return 0;
    for (size_t k = 0; k < r->n_names; k++) eyes += count_eyes(s, &r->names[k]);
    const size_t text = EYE_NUMBERS * NUMBER_TEXT + EYE_REASON_TEXT +
                        (request->batch ? 0 : parts_text(s, request)),
                 of_eyes = bytes_times(
                     eyes, bytes_plus(sizeof(uint32_t), bytes_times(request->n_rhs, sizeof(double) + text)));
    return bytes_plus(of_eyes, (r->n_names + 1) * sizeof(size_t) +
                                   scene_luminaires(s) * (sizeof(double) + sizeof(glare_part)));
}

static bool allocate(size_t n_names, eye_figures *e) {
    e->start = memory_allocate(n_names + 1, sizeof *e->start, "eyes", NULL);
    e->receivers = memory_allocate(e->n_eyes, sizeof *e->receivers, "eyes", NULL);
    e->all = memory_allocate(e->n_rhs, e->n_eyes * sizeof *e->all, "eyes", NULL);
    e->dimmer = memory_allocate(e->n_luminaires, sizeof *e->dimmer, "eyes", NULL);
    e->part = memory_allocate(e->n_luminaires, sizeof *e->part, "eyes", NULL);
    return e->start != NULL && e->receivers != NULL && e->all != NULL && e->dimmer != NULL && e->part != NULL;
}

bool eye_figures_create(const scene *s, const radiosity_request *request, eye_figures **out) {
    const reduce_request *r = &request->reduce;
    const group_index *sets = &s->sensor_sets;
    *out = NULL;
    if (!r->of_sensors || !reduce_has_ugr(r)) return true;
    eye_figures *e = memory_allocate(1, sizeof *e, "eyes", NULL);
    if (e == NULL) return false;
    *e = (eye_figures){.sensors = s->sensors,
                       .luminaires = s->luminaires,
                       .D = request->luminaires.values,
                       .n_rhs = request->n_rhs,
                       .n_luminaires = lam_sensors_luminaires(s->sensors),
                       .parts = !request->batch,
                       .vector = SIZE_MAX};
    for (size_t k = 0; k < r->n_names; k++) e->n_eyes += count_eyes(s, &r->names[k]);
    if (!allocate(r->n_names, e)) {
        eye_figures_free(e);
        return false;
    }
    for (size_t k = 0, at = 0; k < r->n_names; k++) {
        for (size_t g = 0; g < r->names[k].n_groups; g++)
            for (uint32_t i = sets->start[r->names[k].groups[g]]; i < sets->start[r->names[k].groups[g] + 1];
                 i++)
                e->receivers[at++] = sets->elements[i];
        e->start[k + 1] = at;
    }
    *out = e;
    return true;
}

void eye_figures_free(eye_figures *e) {
    if (e == NULL) return;
    free(e->start);
    free(e->receivers);
    free(e->all);
    free(e->dimmer);
    free(e->part);
    free(e);
}

size_t eye_figures_numbers(const eye_figures *e) {
    return e == NULL ? 0
                     : bytes_times(e->n_rhs * e->n_eyes,
                                   EYE_NUMBERS + (e->parts ? PART_NUMBERS * e->n_luminaires : 0));
}

size_t eye_figures_work(const eye_figures *e) {
    /* The dimmers of a vector, its direct light at an eye, and the sum of glare. */
    return e == NULL ? 0 : bytes_times(e->n_rhs * (e->n_eyes + 1), 4 * e->n_luminaires);
}

static double value_at(reduce_values x, size_t i) {
    return x.doubles != NULL ? x.doubles[i] : (double)x.floats[i];
}

void eye_figures_take(eye_figures *e, size_t first, size_t count, size_t n_channels, reduce_values x) {
    for (size_t v = 0; e != NULL && v < count; v++)
        for (size_t k = 0; k < e->n_eyes; k++) {
            const size_t receiver = e->receivers[k], apart = lam_sensors_count(e->sensors),
                         at = v * n_channels * apart + receiver;
            double *all = &e->all[(first + v) * e->n_eyes + k];
            if (!lam_sensors_has_value(e->sensors, receiver))
                *all = (double)NAN;
            else if (n_channels == 3)
                *all = luminance_of(value_at(x, at), value_at(x, at + apart), value_at(x, at + 2 * apart));
            else
                *all = value_at(x, at);
        }
}

static bool write_part(const eye_figures *e, const eye_view *view, const glare_part *part, buffer *b) {
    const glare_source source = eye_source(view, part->luminaire);
    const double luminance = source.intensity * e->dimmer[part->luminaire] / source.area;
    return buffer_append_text(b, "{\"name\":") &&
           json_write_text(b, lam_luminaires_name(e->luminaires, part->luminaire)) &&
           buffer_append_text(b, ",\"part\":") && json_write_double(b, part->part) &&
           buffer_append_text(b, ",\"luminance\":") && json_write_double(b, luminance) &&
           buffer_append_text(b, ",\"solid_angle\":") && json_write_double(b, glare_solid_angle(&source)) &&
           buffer_append_text(b, ",\"position\":") && json_write_double(b, source.position) &&
           buffer_append_text(b, ",\"seen\":") && json_write_double(b, source.seen) &&
           buffer_append(b, "}", 1);
}

static bool write_parts(eye_figures *e, const eye_view *view, buffer *b) {
    const size_t n = eye_parts(view, e->part);
    bool written = buffer_append_text(b, ",\"luminaires\":[");
    for (size_t k = 0; written && k < n; k++)
        written = (k == 0 || buffer_append(b, ",", 1)) && write_part(e, view, &e->part[k], b);
    return written && buffer_append(b, "]", 1);
}

static bool write_reason(const eye_figures *e, const eye_view *view, const eye_rating *r, buffer *b) {
    char why[EYE_REASON_TEXT];
    eye_reason_text(view, r,
                    r->reason == UGR_FORBIDDEN ? lam_luminaires_name(e->luminaires, r->luminaire) : "", why);
    return buffer_append_text(b, ",\"why\":") && json_write_text(b, why);
}

static bool write_eye(eye_figures *e, bool in_lux, size_t vector, size_t k, buffer *b) {
    const size_t receiver = e->receivers[k];
    const eye_view view = {e->n_luminaires, sensors_seen(e->sensors, receiver),
                           sensors_eyes(e->sensors).n * SENSOR_SEEN, e->dimmer};
    const eye_rating r = eye_rate(&view, in_lux, e->all[vector * e->n_eyes + k],
                                  sensors_direct(e->sensors, e->dimmer, receiver));
    return buffer_append_text(b, "{\"ugr\":") && json_write_double(b, r.ugr) &&
           buffer_append_text(b, ",\"background\":") && json_write_double(b, r.background) &&
           (r.reason != UGR_RATED ? write_reason(e, &view, &r, b)
            : e->parts            ? write_parts(e, &view, b)
                                  : true) &&
           buffer_append(b, "}", 1);
}

bool eye_figures_write(eye_figures *e, bool in_lux, size_t name, size_t vector, double until, bool *whole,
                       buffer *b) {
    const size_t C = lam_sensors_channels(e->sensors), q = e->n_luminaires, first = e->start[name],
                 count = e->start[name + 1] - first;
    bool written = e->next > 0 || buffer_append(b, "[", 1);
    if (e->vector != vector)
        eye_dimmers(C, q, e->D != NULL ? e->D + vector * C * q : NULL, sensors_eyes(e->sensors).colours,
                    e->dimmer);
    e->vector = vector;
    for (bool late = false; written && !late && e->next < count; late = clock_ms() >= until) {
        written =
            (e->next == 0 || buffer_append(b, ",", 1)) && write_eye(e, in_lux, vector, first + e->next, b);
        e->next++;
    }
    *whole = e->next >= count;
    if (!*whole || !written) return written;
    e->next = 0;
    return buffer_append(b, "]", 1);
}
