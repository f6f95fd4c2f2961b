#include "server/scene/sensor_answer.h"

#include "server/scene/direct_light.h"
#include "server/scene/request_light.h"
#include "solver/operator/sensor_light.h"

#include <math.h>
#include <string.h>

size_t scene_sensors(const scene *s) {
    return s->sensors != NULL ? lam_sensors_count(s->sensors) : 0;
}

size_t sensor_values(const scene *s, const radiosity_request *request) {
    return request->reduce.on ? scene_sensors(s) : request->n_receivers;
}

const char *sensor_places_word(const radiosity_request *request) {
    return request->at_probes ? "probes" : "sensors";
}

/* lx is lm/m2, and lm/sr is cd. */
const char *probe_unit(const char *unit) {
    return strcmp(unit, "lx") == 0 ? "cd/m2" : strcmp(unit, "W/m2") == 0 ? "W/(m2 sr)" : NULL;
}

bool sensor_request_check(const scene *s, const radiosity_request *request, const char *unit, problem *why) {
    const reduce_request *r = &request->reduce;
    if (!request->at_sensors) return true;
    for (size_t k = 0; k < r->n_names; k++)
        for (size_t g = 0; g < r->names[k].n_groups; g++) {
            const sensor_set_shown set = sensors_set_shown(s->sensors, r->names[k].groups[g]);
            const bool probes = set.kind == SENSOR_SET_PROBES;
            if (probes && r->on)
                return problem_set(why, PROBLEM_NOT_IN_STORE,
                                   "reduce: %.100s is a set of probes, whose coefficients have no figures; "
                                   "select it as probes",
                                   set.name);
            if (r->on && set.kind != SENSOR_SET_EYES && reduce_has_ugr(r))
                return problem_set(
                    why, PROBLEM_NOT_IN_STORE,
                    "reduce: %.100s is no set of eyes, which alone have a UGR; name sets whose kind is eyes",
                    set.name);
            if (probes != request->at_probes)
                return problem_set(why, PROBLEM_NOT_IN_STORE, "select: %.100s is a set of %s", set.name,
                                   probes ? "probes; select it as probes" : "sensors; select it as sensors");
        }
    return !request->at_probes || probe_unit(unit) != NULL ||
           problem_set(why, PROBLEM_UNKNOWN_WORD,
                       "unit is %s, and coefficients of probes are in cd/m2 or W/(m2 sr); ask for lx or W/m2",
                       unit);
}

/* The receiver of value k. */
static size_t receiver_of(const radiosity_request *request, size_t k) {
    return request->reduce.on ? k : request->receivers[k];
}

void sensor_values_add_suns(const scene *s, const radiosity_request *request, size_t v, const float *sun,
                            float *values) {
    const size_t C = s->n_channels, all = scene_sensors(s);
    for (size_t k = 0; sun != NULL && k < request->n_suns; k++)
        for (size_t c = 0; request->suns[k].vector == v && c < C; c++)
            for (size_t r = 0; r < all; r++)
                values[c * all + r] += request->sunlight[k * C + c] * sun[k * all + r];
}

void sensor_values_find(const scene *s, const radiosity_request *request, size_t first, size_t count,
                        const float *B, const float *sun, float *work, float *out) {
    const size_t C = s->n_channels, all = scene_sensors(s), width = sensor_values(s, request);
    for (size_t v = 0; v < count; v++) {
        lam_sensors_gather(s->sensors, 1, B + v * C * s->n, request_sky_seen(s, request, first + v),
                           request_dimmers(s, request, first + v), work);
        sensor_values_add_suns(s, request, first + v, sun, work);
        for (size_t c = 0; c < C; c++)
            for (size_t k = 0; k < width; k++) {
                const size_t r = receiver_of(request, k);
                out[(v * C + c) * width + k] = lam_sensors_has_value(s->sensors, r) ? work[c * all + r] : NAN;
            }
    }
}

size_t sensor_values_work(const scene *s) {
    return scene_sensors(s) + scene_tiles(s) + scene_luminaires(s);
}

/* A row in double; NULL for NULL. */
static const double *widen(const float *row, size_t count, double *to) {
    for (size_t k = 0; row != NULL && k < count; k++) to[k] = (double)row[k];
    return row != NULL ? to : NULL;
}

/* The largest sum of a row's weights, of those whose values are asked for. */
static double largest_sum(const scene *s, const radiosity_request *request) {
    const sensor_weights rows = sensors_weights(s->sensors);
    double largest = 0;
    for (size_t k = 0; k < sensor_values(s, request); k++) {
        const size_t r = receiver_of(request, k);
        double sum = 0;
        for (uint64_t i = rows.start[r]; i < rows.start[r + 1]; i++) sum += fabs((double)rows.weight[i]);
        largest = fmax(largest, sum);
    }
    return largest;
}

void sensor_values_find_double(const scene *s, const radiosity_request *request, size_t first, size_t count,
                               const double *B, const float *sun, double *work, double *out,
                               double *certificates) {
    const size_t C = s->n_channels, all = scene_sensors(s), width = sensor_values(s, request),
                 m = scene_tiles(s), q = scene_luminaires(s);
    double *L = work + C * all, *D = L + C * m;
    const double most = largest_sum(s, request);
    for (size_t v = 0; v < count; v++) {
        double largest = 0;
        for (size_t i = 0; i < C * s->n; i++) largest = fmax(largest, fabs(B[v * C * s->n + i]));
        largest *= most;
        sensors_gather_double(s->sensors, 1, B + v * C * s->n,
                              widen(request_sky_seen(s, request, first + v), C * m, L),
                              widen(request_dimmers(s, request, first + v), C * q, D), work);
        for (size_t k = 0; sun != NULL && k < request->n_suns; k++)
            for (size_t r = 0; request->suns[k].vector == first + v && r < C * all; r++)
                work[r] += (double)request->sunlight[k * C + r / all] * (double)sun[k * all + r % all];
        for (size_t c = 0; c < C; c++)
            for (size_t k = 0; k < width; k++) {
                const size_t r = receiver_of(request, k);
                const bool has = lam_sensors_has_value(s->sensors, r);
                if (has) largest = fmax(largest, fabs(work[c * all + r]));
                out[(v * C + c) * width + k] = has ? work[c * all + r] : NAN;
            }
        /* A sum of N terms is rounded by less than N eps of the sum of their sizes. Direct light has one
         * sign, or, of a probe, at most four times the size of its first coefficient. */
        certificates[v] = certificates[v] * most + 4 * (double)(s->n + m + q) * 0x1p-53 * largest;
    }
}
