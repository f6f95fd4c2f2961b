/* The errors of answers (scene.h): of their own emission where the store states errors by group. */
#include "server/scene/direct_light.h"
#include "server/scene/request_light.h"

#include "solver/operator/emitters.h"
#include "solver/operator/luminaire_light.h"
#include "solver/operator/stated/whole_law.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* True where the store was built for receivers and the request asks for nothing else. */
static bool asks_receivers(const scene *s, const radiosity_request *request) {
    const reduce_request *r = &request->reduce;
    if (s->errors.read == NULL) return false;
    /* Sensors gather from all elements that they see. */
    if (request->at_sensors) return s->errors.sensors;
    if (!r->on)
        return stated_errors_others(&s->errors, request->select ? request->n_selected : s->n,
                                    request->select ? request->selected : NULL) == 0;
    for (size_t k = 0; k < r->n_names; k++)
        for (size_t g = 0; g < r->names[k].n_groups; g++)
            if (!s->group_read[r->names[k].groups[g]]) return false;
    return true;
}

/* True where the store was built for sources and something else emits. */
static bool has_strange_light(const scene *s, const radiosity_request *request) {
    const size_t C = s->n_channels, rows = (request->E != NULL ? request->n_dense : 0) * C;
    const side_rows *sky = &request->sky;
    if (s->errors.emits == NULL) return false;
    for (size_t k = 0; k < request->n_spots; k++) {
        const emission_spot *spot = &request->spots[k];
        bool lit = false;
        for (size_t c = 0; c < C; c++) lit = lit || request->colours[k * C + c] != 0;
        if (lit && !(spot->whole_group ? s->group_emits : s->errors.emits)[spot->where]) return true;
    }
    for (size_t k = 0; sky->values != NULL && k < sky->n * C * lam_sky_tiles(s->sky); k++)
        if (sky->values[k] > 0) return true;
    for (size_t k = 0; !s->errors.luminaires && k < request->luminaires.n * C * scene_luminaires(s); k++)
        if (request->luminaires.values[k] > 0) return true;
    for (size_t k = 0; k < request->n_suns * C; k++)
        if (request->sunlight[k] > 0) return true;
    return stated_errors_is_strange(&s->errors, rows, request->E);
}

void scene_note_error(const scene *s, const radiosity_request *request, answer_notes *notes) {
    const answer_scope scope = {.receivers_only = asks_receivers(s, request),
                                .strange = has_strange_light(s, request),
                                .sky = request->sky.values != NULL && request->luminaires.values == NULL &&
                                       request->E == NULL && request->n_spots == 0};
    stated_errors_note(&s->errors, scope, notes);
    if (s->base != NULL)
        notes->head.advice = "errors were measured for the reflectances of the store: precompute with these";
}

error_scene scene_for_errors(const scene *s) {
    return (error_scene){.n = s->n,
                         .n_channels = s->n_channels,
                         .area = s->area,
                         .reflectance = s->reflectance,
                         .n_groups = s->groups.n_groups,
                         .start = s->groups.start,
                         .members = s->groups.elements,
                         .read = s->errors.read,
                         .emits = s->errors.emits,
                         .buried = s->groups.buried};
}

static bool is_larger(double a, double b) {
    return a > b || isnan(a);
}

/* Takes the larger of each figure of vectors of a batch. */
static void take_error(const answer_error *one, answer_notes *notes) {
    if (is_larger(one->indirect, notes->indirect_mean)) {
        notes->indirect_mean = one->indirect;
        notes->emitters = one->emitters;
    }
    if (is_larger(one->relative, notes->relative_mean)) notes->relative_mean = one->relative;
    headline_raise(&notes->head, &one->parts);
}

/* Takes a name of one vector: its mean as the error of the answer, and the larger figures for the name. A
 * name that no light reaches has an error and no light that this could be a share of: it says nothing of the
 * answer unless all are so. */
static void take_name(const name_error *one, double number, name_error *kept, answer_notes *notes) {
    const answer_error mean = {one->relative, one->mean, number, one->parts};
    headline of_name = {.known = true, .parts = kept->parts};
    const bool any_lit = notes->indirect_mean >= 0 && headline_has_light(&notes->head.parts),
               is_lit = headline_has_light(&one->parts);
    if (is_lit && !any_lit) {
        notes->relative_mean = notes->indirect_mean = -1;
        notes->head.parts = (stated_parts){.mesh = -1};
    }
    if (is_lit || !any_lit) take_error(&mean, notes);
    headline_raise(&of_name, &one->parts);
    kept->parts = of_name.parts;
    if (is_larger(one->mean, kept->mean)) kept->mean = one->mean;
    if (is_larger(one->elements, kept->elements)) kept->elements = one->elements;
}

/* The notes of an error of the answer's own emission, before any vector is taken. */
static void begin_own(const reduce_request *reduce, name_error *names, answer_notes *notes) {
    notes->error_light = "own";
    notes->relative_mean = notes->indirect_mean = -1;
    notes->head.parts = (stated_parts){.mesh = -1};
    notes->n_name_errors = reduce->on ? reduce->n_names : 0;
    notes->name_errors = names;
    for (size_t k = 0; k < notes->n_name_errors; k++)
        names[k] = (name_error){.name = reduce_text(reduce, k), .parts = {.mesh = -1}};
}

bool scene_note_own_error(const scene *s, const radiosity_request *request, const float *H0, const float *sun,
                          const float *W, const float *values, answer_notes *notes, name_error **names) {
    const error_scene about = scene_for_errors(s);
    const reduce_request *reduce = &request->reduce;
    const size_t C = s->n_channels, vector = C * s->n;
    const size_t count = request->select ? request->n_selected : s->n;
    answer_notes made = *notes;
    *names = NULL;
    if (!request_has_own_error(s, request, notes)) return true;
    name_error *const kept = memory_allocate(reduce->n_names, 2 * sizeof *kept, "errors", NULL);
    float *const own = memory_allocate(W != NULL ? light_of_weights_room(s) : 0, sizeof *own, "errors", NULL);
    sent_light sent;
    bool good = sent_light_allocate(s, request, sun != NULL, &sent) && kept != NULL && own != NULL;
    if (good) begin_own(reduce, kept, &made);
    for (size_t v = 0; good && v < request->n_rhs; v++) {
        vector_light light = {request->E + v * vector, H0 != NULL ? H0 + v * vector : NULL,
                              request_sky(s, request, v)};
        answer_error one;
        good = W == NULL || light_of_weights(s, W + v * C * s->n_emitters, own, &light);
        if (!good) break;
        error_answer of = {.quantity = request->quantity,
                           .E = light.E,
                           .H0 = light.H0,
                           .count = count,
                           .selected = request->select ? request->selected : NULL,
                           .values = values + v * C * count,
                           .L = light.L,
                           .luminaires = lit_luminaires_of(s->luminaires, request_dimmers(s, request, v))};
        sent_light_size(s, request, v, of.E, sun, &sent, &of);
        of.sky = request_sky_size(s, light.L);
        if (reduce->on) {
            good = name_errors_of(&s->errors.by_group, &about, &of, reduce->n_names, reduce->names,
                                  kept + reduce->n_names);
            const emission_size both = emission_size_sum(&of.size, &of.sky);
            for (size_t k = 0; good && k < reduce->n_names; k++)
                take_name(&kept[reduce->n_names + k], emission_size_number(&both), &kept[k], &made);
        } else {
            good = answer_error_of(&s->errors.by_group, &about, &of, &one);
            if (good) take_error(&one, &made);
        }
    }
    if (good) *notes = made;
    if (good) *names = kept;
    if (!good) free(kept);
    free(own);
    sent_light_free(&sent);
    return good;
}

static bool is_in_name(const reduce_name *name, size_t group) {
    for (size_t g = 0; g < name->n_groups; g++)
        if (name->groups[g] == group) return true;
    return false;
}

/* sums [n_groups][1 + C] of values [C][count] of the elements selected, or of all: A, and A times each. */
static void sum_by_group(const scene *s, const radiosity_request *request, const float *values,
                         double *sums) {
    const size_t C = s->n_channels, count = request->select ? request->n_selected : s->n;
    const emitters_error *e = &s->errors.emitters;
    memset(sums, 0, e->figures.n_groups * (1 + C) * sizeof *sums);
    for (size_t k = 0; k < count; k++) {
        const size_t i = request->select ? request->selected[k] : k;
        double *const own = sums + e->group[i] * (1 + C);
        own[0] += s->area[i];
        for (size_t c = 0; c < C; c++) own[1 + c] += s->area[i] * (double)values[c * count + k];
    }
}

/* The means [C] over a name. */
static void mean_of_name(size_t n_channels, const reduce_name *name, const double *sums, double *mean) {
    double area = 0;
    for (size_t c = 0; c < n_channels; c++) mean[c] = 0;
    for (size_t g = 0; g < name->n_groups; g++) {
        const double *own = sums + name->groups[g] * (1 + n_channels);
        area += own[0];
        for (size_t c = 0; c < n_channels; c++) mean[c] += own[1 + c];
    }
    for (size_t c = 0; area > 0 && c < n_channels; c++) mean[c] /= area;
}

bool scene_note_emitters_error(const scene *s, const radiosity_request *request, const float *W,
                               const float *values, answer_notes *notes, name_error **names) {
    const error_scene about = scene_for_errors(s);
    const emitters_error *e = &s->errors.emitters;
    const reduce_request *reduce = &request->reduce;
    const size_t C = s->n_channels, vector = C * s->n, count = request->select ? request->n_selected : s->n;
    answer_notes made = *notes;
    *names = NULL;
    if (e->figures.s == 0 || !notes->has_error ||
        ((request->select || reduce->on) && !emitters_error_knows_groups(e)))
        return true;
    float *light = memory_allocate(2, vector * sizeof *light, "errors", NULL);
    double *mean = memory_allocate(C + e->figures.n_groups * (1 + C), sizeof *mean, "errors", NULL);
    name_error *const kept = memory_allocate(reduce->n_names, sizeof *kept, "errors", NULL);
    emitters_mix mix = {.W = NULL};
    bool good = light != NULL && mean != NULL && kept != NULL;
    if (good) begin_own(reduce, kept, &made);
    for (size_t v = 0; good && v < request->n_rhs; v++) {
        const float *weights = W + v * C * s->n_emitters, *own = values + v * C * count;
        emitters_mix_free(&mix);
        good = emitters_mix_create(e, C, weights, &mix);
        if (!good) break;
        if (reduce->on) sum_by_group(s, request, own, mean + C);
        for (size_t k = 0; reduce->on && k < reduce->n_names; k++) {
            mean_of_name(C, &reduce->names[k], mean + C, mean);
            const name_error one =
                emitters_error_of_name(e, C, request->quantity, &reduce->names[k], &mix, mean);
            take_name(&one, mix.emitters, &kept[k], &made);
        }
        if (reduce->on) continue;
        const error_answer of = {.quantity = request->quantity,
                                 .E = light,
                                 .H0 = light + vector,
                                 .count = count,
                                 .selected = request->select ? request->selected : NULL,
                                 .values = own};
        good = operator_emitters_light(s->op, 1, weights, light, light + vector, NULL) == LAM_OK;
        if (!good) break;
        const answer_error one = emitters_error_of(e, &about, &of, &mix);
        take_error(&one, &made);
    }
    if (good) *notes = made;
    if (good) *names = kept;
    if (!good) free(kept);
    emitters_mix_free(&mix);
    free(light);
    free(mean);
    return good;
}

/* emission [n_rhs][C]: means over the name. */
static void emission_of_name(const scene *s, const radiosity_request *request, const reduce_name *name,
                             const mean_errors *to, double *emission) {
    const size_t C = s->n_channels;
    const error_by_group *e = &s->errors.by_group;
    double all = 0;
    memset(emission, 0, request->n_rhs * C * sizeof *emission);
    for (size_t g = 0; g < name->n_groups; g++) {
        const uint32_t group = name->groups[g];
        for (size_t bin = group; bin < e->n_bins; bin += e->figures.n_groups) all += e->area[bin];
        for (size_t row = 0; row < request->n_dense * C; row++)
            for (uint32_t k = s->groups.start[group]; k < s->groups.start[group + 1]; k++) {
                const size_t i = s->groups.elements[k];
                emission[row] += s->area[i] * (double)request->E[row * s->n + i];
            }
        for (size_t row = 0; to->sums != NULL && row < request->n_rhs * C; row++)
            emission[row] += to->sums[row * s->groups.n_groups + group];
    }
    for (size_t k = 0; k < request->n_spots; k++) {
        const emission_spot *spot = &request->spots[k];
        const size_t group = spot->whole_group ? spot->where : e->bin[spot->where] % e->figures.n_groups;
        if (spot->vector < request->n_dense || !is_in_name(name, group)) continue;
        double area = spot->whole_group ? 0 : s->area[spot->where];
        for (size_t bin = group; spot->whole_group && bin < e->n_bins; bin += e->figures.n_groups)
            area += e->area[bin];
        for (size_t c = 0; c < C; c++)
            emission[spot->vector * C + c] += area * (double)request->colours[k * C + c];
    }
    for (size_t k = 0; all > 0 && k < request->n_rhs * C; k++) emission[k] /= all;
}

/* direct [n_rhs][C]: means of the direct light of skies and luminaires over the name. */
static void direct_of_name(const scene *s, const radiosity_request *request, const reduce_name *name,
                           const mean_errors *to, double *direct) {
    const size_t C = s->n_channels;
    const error_by_group *e = &s->errors.by_group;
    const float *L = to->L != NULL ? to->L : request->sky.values;
    const size_t rows = (to->L != NULL ? request->n_rhs : request->sky.n) * C;
    const luminaire_sums *sums = to->luminaires;
    const double *f = sums != NULL ? luminaires_factors(s->luminaires) : NULL;
    double all = 0;
    memset(direct, 0, request->n_rhs * C * sizeof *direct);
    for (size_t g = 0; (L != NULL || sums != NULL) && g < name->n_groups; g++) {
        double area = 0;
        for (size_t bin = name->groups[g]; bin < e->n_bins; bin += e->figures.n_groups) area += e->area[bin];
        all += area;
        for (size_t row = 0; L != NULL && row < rows; row++)
            for (size_t t = 0; t < e->figures.n_tiles; t++)
                direct[row] += area * e->figures.sky_first[name->groups[g] * e->figures.n_tiles + t] *
                               (double)L[row * e->figures.n_tiles + t];
        for (size_t row = 0; sums != NULL && row < request->luminaires.n * C; row++)
            for (size_t k = 0; k < sums->k; k++)
                direct[row] += area * sums->first[name->groups[g] * sums->k + k] * f[row % C * sums->k + k] *
                               (double)request->luminaires.values[row * sums->k + k];
    }
    for (size_t k = 0; all > 0 && k < request->n_rhs * C; k++) direct[k] /= all;
}

bool scene_mean_errors_begin(const scene *s, const radiosity_request *request, answer_notes *notes,
                             mean_errors *out) {
    const reduce_request *reduce = &request->reduce;
    mean_errors made = {.names = NULL};
    *out = made;
    if (emitters_error_knows_groups(&s->errors.emitters) && notes->has_error) {
        made.names = memory_allocate(reduce->n_names, sizeof *made.names, "errors", NULL);
        made.emission = memory_allocate(s->n_channels, sizeof *made.emission, "errors", NULL);
        if (made.names == NULL || made.emission == NULL) {
            mean_errors_free(&made);
            return false;
        }
        begin_own(reduce, made.names, notes);
        *out = made;
        return true;
    }
    if (!request_has_own_error(s, request, notes)) return true;
    if (request->luminaires.values != NULL) {
        if (!scene_luminaire_sums(s, &made.luminaires)) return false;
        if (made.luminaires == NULL) return true;
    }
    const size_t rows = request->n_rhs * s->n_channels;
    made.names = memory_allocate(reduce->n_names, sizeof *made.names, "errors", NULL);
    made.sizes = memory_allocate(request->n_rhs, sizeof *made.sizes, "errors", NULL);
    made.emission = memory_allocate(rows, 2 * sizeof *made.emission, "errors", NULL);
    made.whole = memory_allocate(request->n_rhs, sizeof *made.whole, "errors", NULL);
    made.n_vectors = request->n_rhs;
    bool good = made.names != NULL && made.sizes != NULL && made.emission != NULL && made.whole != NULL;
    if (request->emitters.values != NULL && s->n_emitters > 0) {
        const bool sky = request_has_sky_weights(s, request);
        made.E = memory_allocate(s->n_channels, s->n * sizeof *made.E, "errors", NULL);
        made.sums = memory_allocate(rows, s->groups.n_groups * sizeof *made.sums, "errors", NULL);
        if (sky)
            made.L =
                memory_allocate(rows, s->errors.by_group.figures.n_tiles * sizeof *made.L, "errors", NULL);
        good = good && made.E != NULL && made.sums != NULL && (!sky || made.L != NULL);
    }
    if (!good) {
        mean_errors_free(&made);
        return false;
    }
    if (!request_sizes(s, request, &made)) {
        mean_errors_free(&made);
        return false;
    }
    begin_own(reduce, made.names, notes);
    *out = made;
    return true;
}

/* sum over channels of (sum A rho H0)^2 of luminaires. */
static double luminaires_power2(const luminaire_sums *sums, size_t n_channels, const lit_luminaires *lit) {
    double power2 = 0;
    for (size_t c = 0; c < n_channels; c++) {
        double power = 0;
        for (size_t k = c * lit->k; k < (c + 1) * lit->k; k++)
            power += (double)lit->dimmers[k] * sums->power[k];
        power2 += power * power;
    }
    return power2;
}

bool scene_mean_errors_add(const scene *s, const radiosity_request *request, size_t k, double buried,
                           const double *means, mean_errors *to, answer_notes *notes) {
    const reduce_name *name = &request->reduce.names[k];
    const size_t C = s->n_channels;
    if (to->names == NULL) return true;
    if (emitters_error_knows_groups(&s->errors.emitters)) {
        const emitters_error *e = &s->errors.emitters;
        for (size_t v = 0; v < request->emitters.n; v++) {
            emitters_mix mix;
            if (!emitters_mix_create(e, C, request->emitters.values + v * C * s->n_emitters, &mix))
                return false;
            /* The law is of all elements; no light reaches those that are buried. */
            for (size_t c = 0; c < C; c++) to->emission[c] = (1 - buried) * means[v * C + c];
            const name_error one = emitters_error_of_name(e, C, request->quantity, name, &mix, to->emission);
            take_name(&one, mix.emitters, &to->names[k], notes);
            emitters_mix_free(&mix);
        }
        return true;
    }
    double *const direct = to->emission + request->n_rhs * C;
    emission_of_name(s, request, name, to, to->emission);
    direct_of_name(s, request, name, to, direct);
    for (size_t v = 0; v < request->n_rhs; v++) {
        lit_luminaires lit = lit_luminaires_of(s->luminaires, request_dimmers(s, request, v));
        lit.power2 = luminaires_power2(to->luminaires, C, &lit);
        const float *L =
            to->L != NULL ? to->L + v * C * s->errors.by_group.figures.n_tiles : request_sky(s, request, v);
        const name_means of = {.quantity = request->quantity,
                               .size = to->sizes[v],
                               .whole = to->whole[v],
                               .luminaires = lit,
                               .sky = request_sky_size(s, L),
                               .L = L,
                               .buried = buried,
                               .value = means + v * C,
                               .emission = to->emission + v * C,
                               .direct = direct + v * C};
        const name_error one = name_error_of_means(&s->errors.by_group, name, &of);
        const emission_size both = emission_size_sum(&of.size, &of.sky);
        take_name(&one, emission_size_number(&both), &to->names[k], notes);
    }
    return true;
}

void mean_errors_free(mean_errors *e) {
    for (size_t v = 0; e->whole != NULL && v < e->n_vectors; v++) whole_light_free(&e->whole[v]);
    free(e->whole);
    free(e->names);
    free(e->sizes);
    free(e->emission);
    free(e->E);
    free(e->sums);
    free(e->L);
    *e = (mean_errors){.names = NULL};
}
