/* The check of an operator by random walks, which share nothing with the form factors that it was built from.
 */
#include "solver/base/random.h"
#include "solver/formfactor/buried.h"
#include "solver/operator/emitters.h"
#include "solver/precompute/precompute.h"
#include "solver/verify/verify.h"
#include "solver/walk/walk.h"
#include "store/groups.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* At most so many groups or emitters shine alone; so many groups are compared, and so many elements. */
enum { ALONE_MOST = 8, GROUPS_MOST = 32, ELEMENTS = 8 };

/* A difference beyond the stated error counts where chance gives one as large less often than this. */
static const double certain = 1e-4;

/* Rounding of a mean of single-precision answers, relative to it. */
static const double rounding = 1e-6;

/* The emissions: uniform, groups or emitters alone, and a random mixture of all of them. */
typedef struct lights {
    size_t n;
    const char *names[ALONE_MOST + 2];
    float *input; /* [n][inputs of a channel], as the operator takes them */
    float *E;     /* [n][C][n], with what the elements reflect of a sky: E + rho H0 */
    float *H0;    /* [n][C][n], or NULL: no sky */
} lights;

static void lights_free(lights *l) {
    free(l->input);
    free(l->E);
    free(l->H0);
}

/* The largest values of an array, in their order: indices into it, at most `most`, none of a value 0. */
static size_t find_largest(const double *value, size_t n, size_t most, size_t *largest) {
    size_t found = 0;
    for (size_t i = 0; i < n; i++) {
        if (!(value[i] > 0)) continue;
        size_t at = found < most ? found++ : most;
        for (; at > 0 && value[largest[at - 1]] < value[i]; at--)
            if (at < most) largest[at] = largest[at - 1];
        if (at < most) largest[at] = i;
    }
    return found;
}

/* Per group its area, or, with power, the power that it emits; with emits [n] that of sources alone. */
static double *group_sums(const mesh *m, bool power, const float *emits, lam_error *error) {
    double *sums = memory_allocate(m->n_groups, sizeof *sums, "groups", error);
    for (size_t i = 0; i < m->n && sums != NULL; i++) {
        double of = power ? 0 : 1;
        if (emits != NULL && !(emits[i] > 0)) continue;
        for (size_t c = 0; c < m->n_channels && power; c++) of += (double)m->emission[c * m->n + i];
        sums[m->group[i]] += of * m->area[i];
    }
    return sums;
}

/* The groups that emit, or, where none does, the largest ones; of sources where there are any. */
static lam_status find_bright_groups(const mesh *m, const float *emits, size_t groups[ALONE_MOST],
                                     size_t *count, lam_error *error) {
    for (int by_area = 0; by_area < 2; by_area++) {
        double *sums = group_sums(m, by_area == 0, emits, error);
        if (sums == NULL) return LAM_ERR_MEMORY;
        *count = find_largest(sums, m->n_groups, ALONE_MOST, groups);
        free(sums);
        if (*count > 0) break;
    }
    return LAM_OK;
}

/* Sets the inputs of every light; source s of a channel is a group or an emitter, of_input says which one an
 * input belongs to. Where the operator is for some elements that emit, others are dark. */
static void fill_inputs(const examination *e, const size_t *alone, const uint32_t *of_input, size_t n_sources,
                        lights *l) {
    const size_t inputs = examination_inputs(e), per_channel = inputs / e->m.n_channels;
    for (size_t k = 0; k < inputs; k++) {
        const size_t source = of_input != NULL ? of_input[k % per_channel] : k % per_channel;
        l->input[k] = 1;
        for (size_t a = 0; a + 2 < l->n; a++) l->input[(1 + a) * inputs + k] = source == alone[a];
        l->input[(l->n - 1) * inputs + k] =
            random_to_float(random_hash(k / per_channel * n_sources + source + 1));
        const bool dark = e->importance.emits != NULL && !(e->importance.emits[k % per_channel] > 0);
        for (size_t a = 0; dark && a < l->n; a++) l->input[a * inputs + k] = 0;
    }
}

static lam_status lights_create(const examination *e, lights *l, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &e->m;
    const size_t count = m->n * m->n_channels, inputs = examination_inputs(e);
    const size_t n_emitters = lam_operator_emitters(e->op);
    size_t alone[ALONE_MOST], n_alone = n_emitters < ALONE_MOST ? n_emitters : ALONE_MOST;
    for (size_t a = 0; a < n_alone; a++) alone[a] = a;
    if (n_emitters == 0) TRY(find_bright_groups(m, e->importance.emits, alone, &n_alone, error));
    l->n = n_alone + 2;
    l->names[0] = "uniform";
    for (size_t a = 0; a < n_alone; a++)
        l->names[1 + a] =
            n_emitters > 0 ? lam_operator_emitter_name(e->op, alone[a]) : m->group_names[alone[a]];
    l->names[l->n - 1] = "mixture";
    l->input = memory_allocate(inputs, l->n * sizeof *l->input, "emissions", error);
    l->E = memory_allocate(count, l->n * sizeof *l->E, "emissions", error);
    if (l->input == NULL || l->E == NULL) TRY(LAM_ERR_MEMORY);
    fill_inputs(e, alone, n_emitters > 0 ? NULL : m->group, n_emitters > 0 ? n_emitters : m->n_groups, l);
    if (n_emitters == 0) {
        for (size_t k = 0; k < l->n * count; k++) l->E[k] = l->input[k];
        goto done;
    }
    l->H0 = memory_allocate(count, l->n * sizeof *l->H0, "emissions", error);
    if (l->H0 == NULL) TRY(LAM_ERR_MEMORY);
    TRY(operator_emitters_light(e->op, l->n, l->input, l->E, l->H0, error));
    for (size_t k = 0; k < l->n * count; k++) l->E[k] += m->reflectance[k % count] * l->H0[k];
done:
    return status;
}

/* Targets of walks: groups, or single elements. */
typedef struct targets {
    size_t n;
    const char *groups[GROUPS_MOST]; /* NULL: the target is an element */
    size_t elements[ELEMENTS];
    uint32_t *of; /* [n of the mesh] */
    double area[GROUPS_MOST];
} targets;

static void choose_elements(const mesh *m, targets *t) {
    t->n = m->n < ELEMENTS ? m->n : ELEMENTS;
    for (size_t i = 0; i < m->n; i++) t->of[i] = WALK_NO_TARGET;
    for (size_t k = 0; k < t->n; k++) {
        const size_t element = (2 * k + 1) * m->n / (2 * t->n);
        t->groups[k] = NULL;
        t->elements[k] = element;
        t->area[k] = m->area[element];
        t->of[element] = (uint32_t)k;
    }
}

/* All other groups are target n, which nothing is compared with: it counts what comes to them. */
static lam_status choose_groups(const mesh *m, targets *t, lam_error *error) {
    size_t groups[GROUPS_MOST];
    double *area = group_sums(m, false, NULL, error);
    if (area == NULL) return LAM_ERR_MEMORY;
    t->n = find_largest(area, m->n_groups, GROUPS_MOST, groups);
    for (size_t i = 0; i < m->n; i++) t->of[i] = (uint32_t)t->n;
    for (size_t k = 0; k < t->n; k++) {
        t->groups[k] = m->group_names[groups[k]];
        t->area[k] = area[groups[k]];
        for (size_t i = 0; i < m->n; i++)
            if (m->group[i] == groups[k]) t->of[i] = (uint32_t)k;
    }
    free(area);
    return LAM_OK;
}

/* An answer of the operator, and the difference from walks that the store allows it. */
typedef struct judgement {
    const lights *l;
    float *H;      /* [n lights][C][n of the mesh] */
    bool *dark;    /* [n lights]: no walk came from it to any element */
    double *error; /* [n lights]: the stated error of H in the area norm */
    bool known;    /* the store states all of them */
} judgement;

/* The largest error that a store states for any emission, or for one light alone; negative: none. It is the
 * relative error for dark emissions, else the indirect one. */
static double stated_error(const error_report *stated, bool dark, bool alone) {
    const error_group *const groups[] = {&stated->random, &stated->lights, &stated->single};
    double most = -1;
    for (size_t k = 0; k < (alone ? 3 : 1); k++) {
        const double x = dark ? groups[k]->total_relative.max : groups[k]->total_indirect.max;
        if (k == 0 && x < 0) return -1;
        most = fmax(most, x);
    }
    return most;
}

/* (sum A x^2)^1/2 over elements and channels, x [C][n]. */
static double area_norm(const mesh *m, const float *x) {
    double sum = 0;
    for (size_t k = 0; k < m->n_channels * m->n; k++) sum += m->area[k % m->n] * (double)x[k] * (double)x[k];
    return sqrt(sum);
}

/* Fills dark, error and known. The indirect error is relative to the light that is received. As for the
 * judge, it says nothing of a dark emission, which has none: that is held to the relative error, for which
 * the judge measures dark emissions too. It is relative to B, which is E there. */
static void allow(const examination *e, const walk_estimates *shot, judgement *j) {
    const size_t count = e->m.n * e->m.n_channels;
    j->known = true;
    for (size_t light = 0; light < j->l->n; light++) {
        const bool alone = light > 0 && light + 1 < j->l->n;
        uint64_t visits = 0;
        for (size_t t = 0; t < shot->n_targets; t++) visits += shot->visits[light * shot->n_targets + t];
        j->dark[light] = visits == 0;
        const double stated = stated_error(&e->stated, visits == 0, alone);
        j->known = j->known && stated >= 0;
        j->error[light] = stated * area_norm(&e->m, (visits == 0 ? j->l->E : j->H) + light * count);
    }
}

/* Adds the comparisons of some targets. The bound on a mean is that of verify_energy: an error h of H in the
 * area norm moves the mean over the area A by at most |h| / A^1/2, twice because the stated error weighs H by
 * the reflectance. */
static void compare(examination *e, const judgement *j, const targets *t, const walk_estimates *found) {
    const mesh *m = &e->m;
    const size_t channels = m->n_channels;
    for (size_t p = 0; p < j->l->n * t->n * channels; p++) {
        const size_t channel = p % channels, target = p / channels % t->n, light = p / channels / t->n;
        const size_t row = light * channels + channel, k = row * found->n_targets + target;
        double answer = 0;
        for (size_t i = 0; i < m->n; i++)
            if (t->of[i] == target) answer += m->area[i] * (double)j->H[row * m->n + i];
        answer /= t->area[target];
        const double score = walk_score(found, k, answer, rounding * answer);
        const double difference = fabs(answer - found->mean[k]);
        const double allowed = 2 * 1.1 * j->error[light] / sqrt(t->area[target]);
        e->compared[e->n_compared++] =
            (walk_comparison){.emission = j->l->names[light],
                              .dark = j->dark[light],
                              .group = t->groups[target],
                              .element = t->groups[target] == NULL ? t->elements[target] : 0,
                              .channel = channel,
                              .answer = answer,
                              .mean = found->mean[k],
                              .error = score != 0 ? difference / fabs(score) : found->error[k],
                              .score = score,
                              .beyond = difference > allowed ? fabs(score) * (1 - allowed / difference) : 0};
    }
}

/* Walks for groups are shot, for elements they are gathered. */
static lam_status walk_all(examination *e, judgement *j, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &e->m;
    walk_scene *scene = NULL;
    scene_closure closure;
    size_t buried;
    walk_estimates found = {.n_rhs = 0};
    targets t = {.of = memory_allocate(m->n, sizeof *t.of, "targets of walks", error)};
    e->compared = memory_allocate(j->l->n * m->n_channels, (GROUPS_MOST + ELEMENTS) * sizeof *e->compared,
                                  "comparisons", error);
    if (t.of == NULL || e->compared == NULL) TRY(LAM_ERR_MEMORY);
    TRY(recipe_load_closure(e->s, recipe_of_operator.group, &closure, error));
    TRY(buried_find(&e->m, &buried, error));
    TRY(walk_scene_create(m, closure, &scene, error));
    walk_problem problem = {.n_rhs = j->l->n,
                            .E = j->l->E,
                            .quantity = LAM_IRRADIANCE,
                            .target = t.of,
                            .walks = e->walks,
                            .seed = precompute_seed(0, SEED_VERIFY_WALKS),
                            .progress = e->progress};
    TRY(choose_groups(m, &t, error));
    problem.n_targets = t.n + 1;
    problem.stage = "walks from lights";
    TRY(walk_shoot(scene, &problem, &found, error));
    allow(e, &found, j);
    compare(e, j, &t, &found);
    walk_estimates_free(&found);
    choose_elements(m, &t);
    problem.n_targets = t.n;
    problem.stage = "walks from elements";
    TRY(walk_gather(scene, &problem, &found, error));
    compare(e, j, &t, &found);
done:
    walk_estimates_free(&found);
    walk_scene_free(scene);
    free(t.of);
    return status;
}

const char *walk_comparison_target(const walk_comparison *w, char text[32]) {
    if (w->group != NULL) return w->group;
    snprintf(text, 32, "element %zu", w->element);
    return text;
}

static void conclude(const examination *e, const judgement *j, check *c) {
    const walk_comparison *worst = &e->compared[0], *beyond = &e->compared[0];
    char at[32], end[256] = "within the stated error";
    for (size_t k = 1; k < e->n_compared; k++) {
        const walk_comparison *w = &e->compared[k];
        if (fabs(w->score) > fabs(worst->score)) worst = w;
        if (w->beyond > beyond->beyond) beyond = w;
    }
    const bool broken = j->known && walk_chance(beyond->beyond, e->n_compared) < certain;
    if (broken)
        snprintf(end, sizeof end, "%s under %s differs by more than the stated error",
                 walk_comparison_target(beyond, at), beyond->emission);
    if (!j->known) snprintf(end, sizeof end, "the store states no error to compare with");
    /* Below 1e-10 the chance is lost in rounding. */
    const double chance = fmax(1e-10, 100 * walk_chance(worst->score, e->n_compared));
    check_say(
        c,
        !j->known ? VERDICT_SKIPPED
        : broken  ? VERDICT_BROKEN
                  : VERDICT_OK,
        "largest |z| of %zu means is %.1f (%s under %s), by chance alone in at most %.*g %% of cases; %s",
        e->n_compared, fabs(worst->score), walk_comparison_target(worst, at), worst->emission,
        chance < 10 ? 1 : 3, chance, end);
}

lam_status verify_walks(examination *e, check *c, lam_error *error) {
    lam_status status = LAM_OK;
    lights l = {.n = 0};
    judgement j = {.l = &l};
    if (examination_skips(e, c)) return LAM_OK;
    if (e->walks == 0) {
        check_say(c, VERDICT_SKIPPED, "no random walks (--walks 0)");
        return LAM_OK;
    }
    const size_t count = e->m.n * e->m.n_channels;
    TRY(lights_create(e, &l, error));
    TRY(examination_apply(e, l.n, LAM_IRRADIANCE, l.input, &j.H, error));
    j.dark = memory_allocate(l.n, sizeof *j.dark, "a solution", error);
    j.error = memory_allocate(l.n, sizeof *j.error, "a solution", error);
    if (j.dark == NULL || j.error == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < l.n * count && l.H0 != NULL; k++) j.H[k] -= l.H0[k];
    TRY(walk_all(e, &j, error));
    conclude(e, &j, c);
done:
    lights_free(&l);
    free(j.H);
    free(j.dark);
    free(j.error);
    return check_failed(c, status, error);
}
