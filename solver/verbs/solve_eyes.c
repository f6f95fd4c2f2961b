#include "solver/verbs/solve_eyes.h"

#include "solver/base/photometry.h"
#include "solver/operator/sensor_light.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Luminaires that a table names at most. */
enum { NAMED = 4 };

bool eyes_are_rated(const solution *s) {
    return s->names == NULL;
}

/* True where values are illuminances, or channels of them. */
static bool is_in_lux(const solution *s) {
    const size_t C = s->m->n_channels;
    return (C == 1 || C == 3) && strcmp(output_unit(s, 0), "lx") == 0;
}

void eyes_free(eyes_asked *e) {
    eye_sun_free(e->sight);
    free(e->dimmer);
}

/* The luminance of values of C channels, `apart` numbers from each other. */
static double luminance(size_t C, const float *x, size_t apart) {
    return C == 3 ? luminance_of((double)x[0], (double)x[apart], (double)x[2 * apart]) : (double)x[0];
}

/* The dimmers of a vector. */
static void take_vector(eyes_asked *e, size_t vector) {
    const emission *light = e->light;
    const size_t C = lam_sensors_channels(e->all), q = e->n_luminaires,
                 at = light->steady ? 0 : vector * C * q;
    if (e->vector != vector)
        eye_dimmers(C, q, light->D != NULL ? light->D + at : NULL, sensors_eyes(e->all).colours, e->dimmer);
    e->vector = vector;
}

static eye_view view_of(const eyes_asked *e, size_t receiver) {
    return (eye_view){e->n_luminaires, sensors_seen(e->all, receiver), sensors_eyes(e->all).n * SENSOR_SEEN,
                      e->dimmer};
}

lam_status eyes_open(const lam_sensors *all, const mesh *m, const emission *light, const double (*suns)[3],
                     eyes_asked *out, lam_error *error) {
    lam_status status = LAM_OK;
    eyes_asked *e = out;
    *e = (eyes_asked){.all = all,
                      .light = light,
                      .suns = suns,
                      .n_luminaires = lam_sensors_luminaires(all),
                      .vector = SIZE_MAX};
    e->dimmer = memory_allocate(e->n_luminaires, sizeof *e->dimmer, "figures of eyes", error);
    if (e->dimmer == NULL) TRY(LAM_ERR_MEMORY);
    if (suns != NULL) TRY(eye_sun_create(m, &e->sight, error));
done:
    return status;
}

eye_figures eyes_rate(eyes_asked *e, const solution *s, size_t vector, size_t receiver) {
    const size_t C = s->m->n_channels, count = lam_sensors_count(e->all);
    const double all = lam_sensors_has_value(e->all, receiver)
                           ? luminance(C, s->values + vector * C * count + receiver, count)
                           : (double)NAN;
    take_vector(e, vector);
    const eye_view view = view_of(e, receiver);
    eye_figures out = {.rating =
                           eye_rate(&view, is_in_lux(s), all, sensors_direct(e->all, e->dimmer, receiver)),
                       .dgps = (double)NAN};
    if (isnan(out.rating.background)) return out;
    if (e->light->L != NULL) out.dgps = glare_simplified(all);
    if (e->suns != NULL) {
        const sensor_shown at = sensors_shown(e->all, receiver);
        out.sun = eye_sun_is_seen(e->sight, at.at, at.axis, e->suns[vector]);
    }
    return out;
}

static void reason_text(const eyes_asked *e, const eye_rating *r, size_t receiver,
                        char text[EYE_REASON_TEXT]) {
    const eye_view view = view_of(e, receiver);
    const char *name =
        r->reason == UGR_FORBIDDEN ? lam_luminaires_name(e->light->luminaires, r->luminaire) : "";
    eye_reason_text(&view, r, name, text);
}

/* Finds the luminaires that count for an eye, the largest part first; *out is [n], freed with free(), NULL
 * where memory is short. */
static size_t find_parts(const eyes_asked *e, size_t receiver, glare_part **out) {
    const eye_view view = view_of(e, receiver);
    *out = memory_allocate(e->n_luminaires, sizeof **out, "parts of luminaires", NULL);
    return *out != NULL ? eye_parts(&view, *out) : 0;
}

static json_t *number(double x) {
    return isnan(x) ? json_null() : json_real(x);
}

/* [{"name", "part", "luminance", "solid_angle", "position", "seen"}, ...] */
static json_t *parts_json(const eyes_asked *e, size_t receiver) {
    const eye_view view = view_of(e, receiver);
    glare_part *parts;
    const size_t n = find_parts(e, receiver, &parts);
    json_t *out = parts != NULL ? json_array() : NULL;
    for (size_t i = 0; i < n; i++) {
        const size_t k = parts[i].luminaire;
        const glare_source source = eye_source(&view, k);
        json_array_append_new(
            out, json_pack("{s:s, s:f, s:f, s:f, s:f, s:f}", "name",
                           lam_luminaires_name(e->light->luminaires, k), "part", parts[i].part, "luminance",
                           source.intensity * e->dimmer[k] / source.area, "solid_angle",
                           glare_solid_angle(&source), "position", source.position, "seen", source.seen));
    }
    free(parts);
    return out;
}

json_t *eyes_json(eyes_asked *e, const solution *s, size_t vector, size_t receiver, bool parts) {
    const eye_figures f = eyes_rate(e, s, vector, receiver);
    char why[EYE_REASON_TEXT];
    reason_text(e, &f.rating, receiver, why);
    json_t *out =
        json_pack("{s:o, s:o}", "ugr", number(f.rating.ugr), "background", number(f.rating.background));
    if (f.rating.reason != UGR_RATED) json_object_set_new(out, "why", json_string(why));
    if (e->light->L != NULL) json_object_set_new(out, "dgps", number(f.dgps));
    if (e->suns != NULL) json_object_set_new(out, "sun_seen", json_boolean(f.sun));
    if (parts && f.rating.reason == UGR_RATED)
        json_object_set_new(out, "luminaires", parts_json(e, receiver));
    return out;
}

/* "row.0 61 %, row.1 39 %, 3 others 2 %" */
static void print_parts(const eyes_asked *e, size_t receiver) {
    glare_part *parts;
    const size_t n = find_parts(e, receiver, &parts);
    double rest = 0;
    for (size_t i = 0; i < n; i++) {
        if (i >= NAMED)
            rest += parts[i].part;
        else
            printf("%s%s %.3g %%", i > 0 ? ", " : "  ",
                   lam_luminaires_name(e->light->luminaires, parts[i].luminaire), 100 * parts[i].part);
    }
    if (n > NAMED) printf(", %zu other%s %.3g %%", n - NAMED, n == NAMED + 1 ? "" : "s", 100 * rest);
    free(parts);
}

void eyes_print(eyes_asked *e, const solution *s, const char *name, size_t first, size_t count) {
    char of[32] = "", why[EYE_REASON_TEXT];
    for (size_t vector = 0; vector < s->n_vectors; vector++)
        for (size_t i = first; i < first + count; i++) {
            const eye_figures f = eyes_rate(e, s, vector, i);
            if (s->batch) snprintf(of, sizeof of, "%zu", vector);
            reason_text(e, &f.rating, i, why);
            printf("%-24s %8zu %-24s", name, i - first, of);
            if (f.rating.reason == UGR_RATED)
                printf(" %10.4g %10.4g", f.rating.ugr, f.rating.background);
            else
                printf(" %10s %10.4g", "none", f.rating.background);
            if (e->light->L != NULL)
                printf(" %10.4g%s", f.dgps, e->suns == NULL ? "" : f.sun ? " sun" : "    ");
            if (f.rating.reason != UGR_RATED)
                printf("  %s", why);
            else if (!s->batch)
                print_parts(e, i);
            printf("\n");
        }
}
