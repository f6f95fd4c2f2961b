#include "server/scene/request_light.h"

#include "server/scene/direct_light.h"

#include "solver/operator/emitters.h"
#include "solver/operator/luminaire_light.h"
#include "solver/operator/stated/whole_law.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const float *request_sky(const scene *s, const radiosity_request *request, size_t v) {
    const side_rows *sky = &request->sky;
    return sky->values != NULL && v < sky->n ? sky->values + v * s->n_channels * lam_sky_tiles(s->sky) : NULL;
}

const float *request_sky_seen(const scene *s, const radiosity_request *request, size_t v) {
    const side_rows *seen = &request->seen_sky;
    if (seen->values == NULL) return request_sky(s, request, v);
    return seen->values + v * s->n_channels * lam_sky_tiles(s->sky);
}

const float *request_dimmers(const scene *s, const radiosity_request *request, size_t v) {
    const side_rows *side = &request->luminaires;
    return side->values != NULL && v < side->n ? side->values + v * s->n_channels * scene_luminaires(s)
                                               : NULL;
}

bool request_has_sky_weights(const scene *s, const radiosity_request *request) {
    return request->emitters.values != NULL && s->n_emitters > 0 && operator_emitters_of(s->op)->a.L != NULL;
}

bool light_of_weights(const scene *s, const float *weights, float *own, vector_light *out) {
    const size_t vector = s->n_channels * s->n;
    const bool sky = operator_emitters_of(s->op)->a.L != NULL, direct = sky || s->luminaires != NULL;
    if (operator_emitters_light(s->op, 1, weights, own, own + vector, NULL) != LAM_OK) return false;
    if (sky) operator_emitters_radiances(s->op, 1, weights, own + 2 * vector);
    *out = (vector_light){own, direct ? own + vector : NULL, sky ? own + 2 * vector : NULL};
    return true;
}

size_t light_of_weights_room(const scene *s) {
    return s->n_channels * (2 * s->n + operator_emitters_of(s->op)->a.n_tiles);
}

bool scene_states_errors(const scene *s, bool sky, bool luminaires) {
    return stated_errors_know(&s->errors, s->luminaires, scene_tiles(s), sky, luminaires);
}

bool request_has_own_error(const scene *s, const radiosity_request *request, const answer_notes *notes) {
    const bool whole =
        !request->reduce.linear || request->at_sensors || s->errors.by_group.figures.sky_first != NULL;
    const bool sky = request->sky.values != NULL || request_has_sky_weights(s, request);
    return notes->has_error && request->tolerance == 0 && (!sky || whole) &&
           scene_states_errors(s, sky, request->luminaires.values != NULL);
}

emission_size request_sky_size(const scene *s, const float *L) {
    return stated_sky_size(&s->errors, s->n_channels, L);
}

/* The light of the weights of emitters that a request has: adds the power and squares of what elements emit,
 * their sums over groups and the radiances of the sky. */
static void add_weights(const scene *s, const radiosity_request *request, double *power, double *lamps,
                        emission_size *size, mean_errors *to) {
    const size_t C = s->n_channels, row = C * s->n_emitters, G = s->groups.n_groups;
    const error_by_group *e = &s->errors.by_group;
    for (size_t v = 0; v < request->emitters.n; v++) {
        operator_emitters_emission(s->op, 1, request->emitters.values + v * row, to->E);
        for (size_t k = 0; k < C * s->n; k++) {
            const double flux = s->area[k % s->n] * (double)to->E[k];
            power[v * C + k / s->n] += flux;
            if (mesh_lamps_in(e, e->bin[k % s->n])) lamps[v * C + k / s->n] += flux;
            size[v].squares += flux * flux;
            to->sums[(v * C + k / s->n) * G + e->bin[k % s->n] % G] += flux;
        }
        if (to->L == NULL) continue;
        const size_t m = e->figures.n_tiles;
        const float *sky = request_sky(s, request, v);
        operator_emitters_radiances(s->op, 1, request->emitters.values + v * row, to->L + v * C * m);
        for (size_t k = 0; sky != NULL && k < C * m; k++) to->L[v * C * m + k] += sky[k];
    }
}

/* A spot has this area, and its elements have these squares. */
typedef struct spot_area {
    double area, squares;
} spot_area;

static spot_area area_of_spot(const error_by_group *e, const scene *s, const emission_spot *spot) {
    spot_area of = {0, 0};
    if (!spot->whole_group)
        return (spot_area){s->area[spot->where], s->area[spot->where] * s->area[spot->where]};
    of.squares = e->squares[spot->where];
    for (size_t bin = spot->where; bin < e->n_bins; bin += e->figures.n_groups) of.area += e->area[bin];
    return of;
}

/* Emissions of a request: their sizes. power, lamps [n_rhs][C], zeroed: of all, and of groups with lamps. */
static void size_of_spots(const scene *s, const radiosity_request *request, double *power, double *lamps,
                          emission_size *size, mean_errors *to) {
    const size_t C = s->n_channels;
    const error_by_group *e = &s->errors.by_group;
    for (size_t k = 0; k < request->n_spots; k++) {
        const emission_spot *spot = &request->spots[k];
        const spot_area of = area_of_spot(e, s, spot);
        const size_t home = spot->whole_group ? spot->where : e->bin[spot->where];
        for (size_t c = 0; c < C; c++) {
            const double value = fabs((double)request->colours[k * C + c]);
            power[spot->vector * C + c] += of.area * value;
            if (mesh_lamps_in(e, home)) lamps[spot->vector * C + c] += of.area * value;
            size[spot->vector].squares += of.squares * value * value;
        }
    }
    for (size_t v = 0; v < request->n_dense; v++) {
        size[v] = (emission_size){.power2 = 0};
        for (size_t c = 0; c < C; c++) power[v * C + c] = lamps[v * C + c] = 0;
        for (size_t k = v * C * s->n; k < (v + 1) * C * s->n; k++) {
            const double flux = s->area[k % s->n] * fabs((double)request->E[k]);
            power[k / s->n] += flux;
            if (mesh_lamps_in(e, e->bin[k % s->n])) lamps[k / s->n] += flux;
            size[v].squares += flux * flux;
        }
    }
    if (request->emitters.values != NULL && s->n_emitters > 0)
        add_weights(s, request, power, lamps, size, to);
    for (size_t v = 0; v < request->n_rhs; v++)
        for (size_t c = 0; c < C; c++) {
            size[v].power2 += power[v * C + c] * power[v * C + c];
            size[v].lamps2 += lamps[v * C + c] * lamps[v * C + c];
        }
}

/* Fills the whole groups of vectors that are spots, and the size of what else emits in them; power [n_rhs][C]
 * is work. */
static bool whole_of_spots(const scene *s, const radiosity_request *request, double *power, mean_errors *to) {
    const error_by_group *e = &s->errors.by_group;
    const size_t C = s->n_channels, w = e->figures.n_whole;
    memset(power, 0, request->n_rhs * C * sizeof *power);
    for (size_t v = request->n_dense; v < request->n_rhs; v++) {
        to->whole[v].weights = memory_allocate(w, C * sizeof *to->whole[v].weights, "errors", NULL);
        if (to->whole[v].weights == NULL) return false;
    }
    for (size_t k = 0; k < request->n_spots; k++) {
        const emission_spot *spot = &request->spots[k];
        const uint32_t place = spot->whole_group ? whole_place(e, spot->where) : WHOLE_NONE;
        const spot_area of = area_of_spot(e, s, spot);
        whole_light *to_vector = &to->whole[spot->vector];
        for (size_t c = 0; spot->vector >= request->n_dense && c < C; c++) {
            const double value = fabs((double)request->colours[k * C + c]);
            if (place != WHOLE_NONE) {
                to_vector->weights[c * w + place] += value;
                continue;
            }
            power[spot->vector * C + c] += of.area * value;
            to_vector->rest.squares += of.squares * value * value;
        }
    }
    for (size_t k = 0; k < request->n_rhs * C; k++) to->whole[k / C].rest.power2 += power[k] * power[k];
    for (size_t v = request->n_dense; v < request->n_rhs; v++) whole_light_set_mesh(e, &to->whole[v]);
    return true;
}

/* Emitters are no groups, so that stores of them state none of these. */
static bool find_whole(const scene *s, const radiosity_request *request, double *power, mean_errors *to) {
    const error_by_group *e = &s->errors.by_group;
    const error_scene about = scene_for_errors(s);
    if (e->whole_of == NULL) return true;
    if (!whole_of_spots(s, request, power, to)) return false;
    for (size_t v = 0; v < request->n_dense; v++)
        if (!whole_light_find(e, &about, request->E + v * s->n_channels * s->n, &to->whole[v])) return false;
    return true;
}

/* Adds what is reflected of the direct light of luminaires, which is of no lamp and no whole group. */
static void add_reflected(const scene *s, const radiosity_request *request, mean_errors *to) {
    const size_t C = s->n_channels;
    for (size_t v = 0; to->luminaires != NULL && v < request->luminaires.n; v++) {
        const float *D = request_dimmers(s, request, v);
        emission_size reflected = {.power2 = 0};
        for (size_t c = 0; c < C; c++) {
            double power = 0;
            luminaire_sums_size(to->luminaires, c, D + c * to->luminaires->k, &power, &reflected.squares);
            reflected.power2 += power * power;
        }
        to->sizes[v] = emission_size_sum(&to->sizes[v], &reflected);
        to->whole[v].rest = emission_size_sum(&to->whole[v].rest, &reflected);
    }
}

bool request_sizes(const scene *s, const radiosity_request *request, mean_errors *to) {
    const size_t rows = request->n_rhs * s->n_channels;
    size_of_spots(s, request, to->emission, to->emission + rows, to->sizes, to);
    if (!find_whole(s, request, to->emission, to)) return false;
    add_reflected(s, request, to);
    return true;
}

void sent_light_free(sent_light *l) {
    free(l->luminaires);
    free(l->H);
    free(l->work);
}

bool sent_light_allocate(const scene *s, const radiosity_request *request, bool sun, sent_light *out) {
    const bool luminaires = request->luminaires.values != NULL;
    *out = (sent_light){.H = NULL};
    if (!sun && !luminaires) return true;
    out->H = memory_allocate(s->n, sizeof *out->H, "errors", NULL);
    out->work = memory_allocate(s->n, 2 * sizeof *out->work, "errors", NULL);
    if (luminaires)
        out->luminaires = memory_allocate(s->n_channels, s->n * sizeof *out->luminaires, "errors", NULL);
    return out->H != NULL && out->work != NULL && (!luminaires || out->luminaires != NULL);
}

void sent_light_size(const scene *s, const radiosity_request *request, size_t v, const float *E,
                     const float *sun, sent_light *l, error_answer *of) {
    const size_t n = s->n, C = s->n_channels;
    const error_scene about = scene_for_errors(s);
    if (l->luminaires != NULL) {
        memset(l->luminaires, 0, C * n * sizeof *l->luminaires);
        lam_luminaires_irradiance(s->luminaires, 1, request_dimmers(s, request, v), l->luminaires);
    }
    for (size_t c = 0; c < C; c++) {
        const float *lamps = l->luminaires != NULL ? l->luminaires + c * n : NULL;
        if (l->H != NULL) memset(l->H, 0, n * sizeof *l->H);
        for (size_t k = 0; sun != NULL && k < request->n_suns; k++) {
            const float direct = request->sunlight[k * C + c], *share = sun + k * n;
            if (request->suns[k].vector != v) continue;
            for (size_t i = 0; i < n; i++) l->H[i] += direct * share[i];
        }
        for (size_t i = 0; lamps != NULL && i < n; i++) l->H[i] += lamps[i];
        error_answer_add_channel(of, &about, c, E + c * n, l->H, lamps, l->work);
    }
}
