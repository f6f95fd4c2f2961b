#include "solver/verbs/solve_eyes.h"

#include "solver/base/photometry.h"
#include "solver/figures/glare.h"
#include "solver/operator/sensor_light.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Light beside that of luminaires is none below this part of it: values are in single precision. */
static const double no_light = 1e-5;

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
    free(e->direct);
    free(e->dimmer);
}

/* The luminance of values of C channels, `apart` numbers from each other. */
static double luminance(size_t C, const float *x, size_t apart) {
    return C == 3 ? luminance_of((double)x[0], (double)x[apart], (double)x[2 * apart]) : (double)x[0];
}

/* The direct light and the dimmers of a vector. */
static void take_vector(eyes_asked *e, size_t vector) {
    const emission *light = e->light;
    const size_t C = lam_sensors_channels(e->all), q = e->n_luminaires,
                 at = light->steady ? 0 : vector * C * q;
    const sensor_eyes eyes = sensors_eyes(e->all);
    if (light->D == NULL || e->vector == vector) return;
    sensors_direct(e->all, 1, light->D + at, e->direct);
    for (size_t k = 0; k < q && eyes.n > 0; k++) {
        double by[3] = {0};
        for (size_t c = 0; c < C && c < 3; c++)
            by[c] = (double)light->D[at + c * q + k] * eyes.colours[c * q + k];
        e->dimmer[k] = C == 3 ? luminance_of(by[0], by[1], by[2]) : by[0];
    }
    e->vector = vector;
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
    e->direct = memory_allocate(lam_sensors_channels(all), lam_sensors_count(all) * sizeof *e->direct,
                                "figures of eyes", error);
    e->dimmer = memory_allocate(e->n_luminaires, sizeof *e->dimmer, "figures of eyes", error);
    if (e->direct == NULL || e->dimmer == NULL) TRY(LAM_ERR_MEMORY);
    if (suns != NULL) TRY(eye_sun_create(m, &e->sight, error));
done:
    return status;
}

/* The place of a receiver among the eyes, or their number. */
static size_t eye_of(const sensor_eyes *eyes, size_t receiver) {
    size_t low = 0, high = eyes->n;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (eyes->eyes[middle] < receiver)
            low = middle + 1;
        else
            high = middle;
    }
    return low < eyes->n && eyes->eyes[low] == receiver ? low : eyes->n;
}

static glare_source source_of(const sensor_eyes *eyes, size_t luminaire, size_t eye) {
    const float *x = eyes->seen + (luminaire * eyes->n + eye) * SENSOR_SEEN;
    return (glare_source){.intensity = (double)x[0],
                          .area = (double)x[1],
                          .distance = (double)x[2],
                          .position = (double)x[3],
                          .seen = (double)x[4]};
}

/* sum L^2 w / p^2 of all that are lit, and whether there is a rating at all. */
static double sum_glare(const eyes_asked *e, size_t eye, eye_figures *out) {
    const sensor_eyes eyes = sensors_eyes(e->all);
    double sum = 0;
    for (size_t k = 0; k < e->n_luminaires; k++) {
        const glare_source source = source_of(&eyes, k, eye);
        const glare_verdict verdict = glare_judge(&source);
        if (!(e->dimmer[k] > 0)) continue;
        if (glare_forbids(verdict)) {
            out->reason = UGR_FORBIDDEN;
            out->luminaire = k;
            return 0;
        }
        if (verdict == GLARE_COUNTS) sum += glare_weight(&source, e->dimmer[k]);
    }
    if (!(sum > 0)) out->reason = UGR_NONE_COUNTS;
    return sum;
}

eye_figures eyes_rate(eyes_asked *e, const solution *s, size_t vector, size_t receiver) {
    eye_figures out = {.reason = is_in_lux(s) ? UGR_NO_VALUE : UGR_NO_LUX,
                       .ugr = (double)NAN,
                       .background = (double)NAN,
                       .dgps = (double)NAN};
    const size_t C = s->m->n_channels, count = lam_sensors_count(e->all);
    const sensor_eyes eyes = sensors_eyes(e->all);
    const size_t eye = eye_of(&eyes, receiver);
    if (out.reason == UGR_NO_LUX || !lam_sensors_has_value(e->all, receiver)) return out;
    take_vector(e, vector);
    const double all = luminance(C, s->values + vector * C * count + receiver, count),
                 direct = e->light->D != NULL
                              ? luminance(lam_sensors_channels(e->all), e->direct + receiver, count)
                              : 0;
    const double others = all - direct > no_light * all ? all - direct : 0;
    out.background = others / M_PI;
    if (e->light->L != NULL) out.dgps = glare_simplified(all);
    if (e->suns != NULL) {
        const sensor_shown at = sensors_shown(e->all, receiver);
        out.sun = eye_sun_is_seen(e->sight, at.at, at.axis, e->suns[vector]);
    }
    out.reason = e->light->D == NULL || eye == eyes.n ? UGR_NO_LUMINAIRE : UGR_RATED;
    if (out.reason != UGR_RATED) return out;
    const double sum = sum_glare(e, eye, &out);
    if (out.reason == UGR_RATED && !(others > 0)) out.reason = UGR_NO_BACKGROUND;
    if (out.reason == UGR_RATED) out.ugr = glare_rating(sum, out.background);
    return out;
}

/* The reason in words, or "". */
enum { WHY = 256 };
static void reason_text(const eyes_asked *e, const eye_figures *f, size_t receiver, char text[WHY]) {
    static const char *const words[UGR_REASONS] = {
        [UGR_RATED] = "",
        [UGR_NO_LUX] = "the answer is not in lx",
        [UGR_NO_VALUE] = "the eye lies in a wall or in a luminaire",
        [UGR_NO_LUMINAIRE] = "no luminaire of the store is lit",
        [UGR_NONE_COUNTS] = "no luminaire that is lit is seen at 3e-4 sr or more",
        [UGR_NO_BACKGROUND] = "no light comes to the eye but from luminaires directly"};
    const sensor_eyes eyes = sensors_eyes(e->all);
    snprintf(text, WHY, "%s", words[f->reason] != NULL ? words[f->reason] : "");
    if (f->reason == UGR_NO_LUMINAIRE && e->light->D != NULL)
        snprintf(text, WHY,
                 "the store does not hold how eyes see its luminaires: precompute its sensors again");
    if (f->reason != UGR_FORBIDDEN) return;
    const char *name = lam_luminaires_name(e->light->luminaires, f->luminaire);
    const glare_source source = source_of(&eyes, f->luminaire, eye_of(&eyes, receiver));
    if (glare_judge(&source) == GLARE_NO_OPENING)
        snprintf(text, WHY, "luminaire %.64s has no luminous area", name);
    else
        snprintf(text, WHY, "luminaire %.64s fills %.2g sr, must be at most 0.1 sr", name,
                 glare_solid_angle(&source));
}

/* A luminaire that counts, and its part of the sum. */
typedef struct glare_part {
    size_t luminaire;
    double part;
} glare_part;

static int by_part(const void *a, const void *b) {
    const glare_part *first = a, *second = b;
    if (first->part != second->part) return first->part > second->part ? -1 : 1;
    return (first->luminaire > second->luminaire) - (first->luminaire < second->luminaire);
}

/* Finds the luminaires that count for an eye, the largest part first; *out is [n], freed with free(), NULL
 * where memory is short. */
static size_t find_parts(const eyes_asked *e, size_t receiver, glare_part **out) {
    const sensor_eyes eyes = sensors_eyes(e->all);
    const size_t eye = eye_of(&eyes, receiver);
    double sum = 0;
    size_t n = 0;
    *out = memory_allocate(e->n_luminaires, sizeof **out, "parts of luminaires", NULL);
    for (size_t k = 0; *out != NULL && k < e->n_luminaires; k++) {
        const glare_source source = source_of(&eyes, k, eye);
        if (!(e->dimmer[k] > 0) || glare_judge(&source) != GLARE_COUNTS) continue;
        (*out)[n] = (glare_part){k, glare_weight(&source, e->dimmer[k])};
        sum += (*out)[n++].part;
    }
    for (size_t i = 0; i < n; i++) (*out)[i].part /= sum;
    if (n > 0) qsort(*out, n, sizeof **out, by_part);
    return n;
}

static json_t *number(double x) {
    return isnan(x) ? json_null() : json_real(x);
}

/* [{"name", "part", "luminance", "solid_angle", "position", "seen"}, ...] */
static json_t *parts_json(const eyes_asked *e, size_t receiver) {
    const sensor_eyes eyes = sensors_eyes(e->all);
    const size_t eye = eye_of(&eyes, receiver);
    glare_part *parts;
    const size_t n = find_parts(e, receiver, &parts);
    json_t *out = parts != NULL ? json_array() : NULL;
    for (size_t i = 0; i < n; i++) {
        const size_t k = parts[i].luminaire;
        const glare_source source = source_of(&eyes, k, eye);
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
    char why[WHY];
    reason_text(e, &f, receiver, why);
    json_t *out = json_pack("{s:o, s:o}", "ugr", number(f.ugr), "background", number(f.background));
    if (f.reason != UGR_RATED) json_object_set_new(out, "why", json_string(why));
    if (e->light->L != NULL) json_object_set_new(out, "dgps", number(f.dgps));
    if (e->suns != NULL) json_object_set_new(out, "sun_seen", json_boolean(f.sun));
    if (parts && f.reason == UGR_RATED) json_object_set_new(out, "luminaires", parts_json(e, receiver));
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
    char of[32] = "", why[WHY];
    for (size_t vector = 0; vector < s->n_vectors; vector++)
        for (size_t i = first; i < first + count; i++) {
            const eye_figures f = eyes_rate(e, s, vector, i);
            if (s->batch) snprintf(of, sizeof of, "%zu", vector);
            reason_text(e, &f, i, why);
            printf("%-24s %8zu %-24s", name, i - first, of);
            if (f.reason == UGR_RATED)
                printf(" %10.4g %10.4g", f.ugr, f.background);
            else
                printf(" %10s %10.4g", "none", f.background);
            if (e->light->L != NULL)
                printf(" %10.4g%s", f.dgps, e->suns == NULL ? "" : f.sun ? " sun" : "    ");
            if (f.reason != UGR_RATED)
                printf("  %s", why);
            else if (!s->batch)
                print_parts(e, i);
            printf("\n");
        }
}
