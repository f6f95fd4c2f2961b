/* Checks of the operator: finite, linear, energy, and its error measured again. */
#include "solver/base/random.h"
#include "solver/formfactor/source.h"
#include "solver/operator/emitters.h"
#include "solver/precompute/forecast/forecast.h"
#include "solver/precompute/judging.h"
#include "solver/precompute/precompute.h"
#include "solver/verify/verify.h"
#include "store/groups.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Rounding of a single-precision product over n terms, relative to the largest value. */
static const double rounding = 1e-5;

size_t examination_inputs(const examination *e) {
    const size_t s = lam_operator_emitters(e->op);
    return e->m.n_channels * (s > 0 ? s : e->m.n);
}

lam_status examination_apply(const examination *e, size_t m, lam_quantity quantity, const float *E,
                             float **out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t bytes = lam_operator_work_bytes(e->op, m);
    float *values = memory_allocate(e->m.n * e->m.n_channels, m * sizeof *values, "a solution", error);
    void *area = memory_allocate(bytes, 1, "the work area of a solve", error);
    if (values == NULL || area == NULL) TRY(LAM_ERR_MEMORY);
    if (lam_operator_emitters(e->op) > 0)
        TRY(lam_operator_apply_emitters(e->op, m, quantity, E, 0, NULL, values, area, bytes, error));
    else
        TRY(lam_operator_apply(e->op, m, quantity, E, values, area, bytes, error));
    *out = values;
    values = NULL;
done:
    free(values);
    free(area);
    return status;
}

bool examination_skips(const examination *e, check *c) {
    if (e->has_mesh && e->op != NULL) return false;
    check_say(c, VERDICT_SKIPPED, "no operator to test");
    return true;
}

lam_status verify_operator(examination *e, check *c, lam_error *error) {
    static const lam_quantity quantities[] = {LAM_RADIOSITY, LAM_IRRADIANCE, LAM_INDIRECT};
    lam_status status = LAM_OK;
    float *E = NULL, *out = NULL;
    operator_description about;
    char detail[256];
    if (!e->has_mesh) {
        check_say(c, VERDICT_SKIPPED, "no mesh to light");
        return LAM_OK;
    }
    error_report_load(e->s, &e->stated);
    TRY(importance_load(e->s, e->m.n, &e->importance, error));
    TRY(operator_load(e->s, &e->op, error));
    operator_describe(e->op, &about);
    check_say(c, VERDICT_OK, "%s, %s, %zu bytes, finite", lam_operator_kind(e->op),
              about.precision != NULL ? about.precision : "f32", about.bytes);
    if (e->op->kind->check != NULL && !e->op->kind->check(e->op, e->m.area, detail, sizeof detail))
        check_say(c, VERDICT_BROKEN, "%s", detail);
    /* Uniform emission: a value that is not finite anywhere in the operator shows in the answer. */
    const size_t count = e->m.n * e->m.n_channels, inputs = examination_inputs(e);
    E = memory_allocate(inputs, sizeof *E, "an emission", error);
    if (E == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < inputs; i++) E[i] = 1;
    for (size_t q = 0; q < 3 && c->verdict == VERDICT_OK; q++) {
        free(out);
        out = NULL;
        TRY(examination_apply(e, 1, quantities[q], E, &out, error));
        for (size_t i = 0; i < count && c->verdict == VERDICT_OK; i++)
            if (!isfinite(out[i]))
                check_say(c, VERDICT_BROKEN, "the answer of element %zu is not finite", i % e->m.n);
    }
done:
    free(E);
    free(out);
    return check_failed(c, status, error);
}

lam_status verify_linearity(examination *e, check *c, lam_error *error) {
    lam_status status = LAM_OK;
    float *E = NULL, *out = NULL;
    if (examination_skips(e, c)) return LAM_OK;
    const size_t count = e->m.n * e->m.n_channels, inputs = examination_inputs(e);
    uint64_t state = 1;
    E = memory_allocate(inputs, 3 * sizeof *E, "emissions", error);
    if (E == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < inputs; i++) {
        E[i] = random_to_float(precompute_seed(state, SEED_LINEAR_FIRST));
        E[inputs + i] = random_to_float(precompute_seed(state, SEED_LINEAR_SECOND));
        E[2 * inputs + i] = E[i] + 2 * E[inputs + i];
        state++;
    }
    TRY(examination_apply(e, 3, LAM_RADIOSITY, E, &out, error));
    double worst = 0, largest = 0;
    for (size_t i = 0; i < count; i++) {
        const double expected = (double)out[i] + 2 * (double)out[count + i];
        worst = fmax(worst, fabs((double)out[2 * count + i] - expected));
        largest = fmax(largest, fabs(expected));
    }
    check_say(c, worst <= rounding * largest ? VERDICT_OK : VERDICT_BROKEN,
              "M(E1 + 2 E2) = M E1 + 2 M E2 within %.2g of the largest (at most %g)",
              largest > 0 ? worst / largest : 0, rounding);
done:
    free(E);
    free(out);
    return check_failed(c, status, error);
}

/* Largest imbalance of the power; negative when the store states none. For the scene's own light the store
 * states it; for uniform emission it follows from the error of random emissions: an error h of H is an
 * imbalance of sum A (1 - rho s) h <= |A|^1/2 |h|, twice because the stated error weighs H by the
 * reflectance. */
static double allowed_imbalance(const error_report *stated, bool own, double emitted, double area,
                                double received) {
    const double value = own ? stated->lights.energy_balance : stated->random.operator_indirect.max;
    if (value < 0) return -1;
    return own ? (1.1 * value + rounding) * emitted : 2 * value * sqrt(area * received) + rounding * emitted;
}

/* The light whose energy is tested: the scene's own, or uniform emission, both of sources alone where the
 * operator is for these, or all emitters at once. Their sky
 * counts by the light that the elements reflect of it (E + rho H0), and is taken out of their irradiance. */
typedef struct lit {
    bool own;
    const char *name;
    float *input, *E, *H0; /* H0 NULL: no sky */
} lit;

static lam_status light_up(const examination *e, lit *l, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &e->m;
    const size_t count = m->n * m->n_channels, inputs = examination_inputs(e);
    l->E = memory_allocate(count, sizeof *l->E, "an emission", error);
    l->input = memory_allocate(inputs, sizeof *l->input, "an emission", error);
    if (l->E == NULL || l->input == NULL) TRY(LAM_ERR_MEMORY);
    if (lam_operator_emitters(e->op) > 0) {
        l->name = "all emitters";
        l->H0 = memory_allocate(count, sizeof *l->H0, "an emission", error);
        if (l->H0 == NULL) TRY(LAM_ERR_MEMORY);
        for (size_t k = 0; k < inputs; k++) l->input[k] = 1;
        TRY(operator_emitters_light(e->op, 1, l->input, l->E, l->H0, error));
        for (size_t i = 0; i < count; i++) l->E[i] += m->reflectance[i] * l->H0[i];
        goto done;
    }
    const float *emits = e->importance.emits;
    for (size_t i = 0; i < count; i++)
        l->own = l->own || (m->emission[i] > 0 && (emits == NULL || emits[i % m->n] > 0));
    for (size_t i = 0; i < count; i++) {
        const float share = emits != NULL ? emits[i % m->n] : 1;
        l->input[i] = l->E[i] = share * (l->own ? m->emission[i] : 1);
    }
    if (emits != NULL)
        l->name = l->own ? "the light of the sources" : "uniform emission of the sources";
    else
        l->name = l->own ? "the scene's own light" : "uniform emission";
done:
    return status;
}

/* sum A E = sum A [(1 - rho) H + B (1 - s)], s the row sums: emitted power is absorbed or leaves. */
lam_status verify_energy(examination *e, check *c, lam_error *error) {
    lam_status status = LAM_OK;
    float *B = NULL, *H = NULL;
    lit light = {.own = false};
    if (examination_skips(e, c)) return LAM_OK;
    if (e->row_sums == NULL) {
        check_say(c, VERDICT_SKIPPED, "the store knows no row sums: its light was found by random walks");
        return LAM_OK;
    }
    const mesh *m = &e->m;
    const size_t count = m->n * m->n_channels;
    double emitted = 0, accounted = 0, area = 0, received = 0;
    TRY(light_up(e, &light, error));
    TRY(examination_apply(e, 1, LAM_RADIOSITY, light.input, &B, error));
    TRY(examination_apply(e, 1, LAM_IRRADIANCE, light.input, &H, error));
    for (size_t i = 0; i < count; i++) {
        const double direct = light.H0 != NULL ? (double)light.H0[i] : 0;
        const double a = m->area[i % m->n], h = (double)H[i] - direct;
        emitted += a * (double)light.E[i];
        accounted += a * ((1 - (double)m->reflectance[i]) * h + (double)B[i] * (1 - e->row_sums[i % m->n]));
        area += a;
        received += a * h * h;
    }
    const double off = fabs(emitted - accounted);
    const double allowed = allowed_imbalance(&e->stated, light.own, emitted, area, received);
    if (allowed < 0)
        check_say(c, VERDICT_SKIPPED, "off by %.2g of the power; the store states no error to compare with",
                  off / emitted);
    else
        check_say(c, off <= allowed ? VERDICT_OK : VERDICT_BROKEN,
                  "emitted = absorbed + left within %.2g of %s (at most %.2g)", off / emitted, light.name,
                  allowed / emitted);
done:
    free(light.E);
    free(light.H0);
    free(light.input);
    free(B);
    free(H);
    return check_failed(c, status, error);
}

/* One figure, stated and measured again over n probes of another draw: means differ by the standard error of
 * either, lights (one probe) by the noise of the samples they were measured against. */
static void compare_figure(const char *group, const char *against, const error_figures *stated,
                           const error_figures *again, size_t probes, double noise, check *c) {
    if (stated->mean < 0 || stated->std < 0 || stated->max < 0) return;
    const double spread = fmax(stated->std, again->std) / sqrt(fmax(1, (double)probes));
    const double allowed = 1.1 * stated->mean + 6 * spread + 3 * noise + rounding;
    if (!(again->mean <= allowed))
        check_say(c, VERDICT_BROKEN, "%s: %s indirect error %.3g, stated %.3g (at most %.3g)", group, against,
                  again->mean, stated->mean, allowed);
}

/* The same of receivers, by the noise of both references: not of single elements, of which few may make most
 * of the light that receivers see. */
static void compare_receivers(const char *group, const receiver_figures *stated,
                              const receiver_figures *again, check *c) {
    if (!again->known || strcmp(group, "single") == 0 || stated->total_indirect < 0 || stated->noise < 0)
        return;
    const double allowed = 1.1 * stated->total_indirect + 3 * (stated->noise + again->noise) + rounding;
    if (!(again->total_indirect <= allowed))
        check_say(c, VERDICT_BROKEN, "%s: receivers' indirect error %.3g, stated %.3g (at most %.3g)", group,
                  again->total_indirect, stated->total_indirect, allowed);
}

/* A hemicube's judge takes as many rays as precompute does at defaults for the recorded epsilon: with other
 * options it may have taken others, and compare_figure allows for the noise that goes with the number. */
static size_t judge_rays(const examination *e) {
    double epsilon = .05;
    if (store_has_attribute(e->s, STORE_OPERATOR, "epsilon") &&
        store_get_number(e->s, STORE_OPERATOR, "epsilon", &epsilon, NULL) != LAM_OK)
        epsilon = .05;
    return recipe_auto_rays(epsilon, .25);
}

static bool has_form_factors(const examination *e) {
    return e->f.F.indptr != NULL || e->blocks.n > 0;
}

static lam_status read_recipe(examination *e, recipe *out, lam_error *error) {
    if (!has_form_factors(e)) return recipe_load(e->s, &recipe_of_operator, out, error);
    *out = e->f.recipe;
    return LAM_OK;
}

/* The samples are new to the operator and to the figures that the store states. */
static recipe recipe_again(const examination *e, const recipe *of, seed_purpose half) {
    return recipe_of_judge(of, judge_rays(e), precompute_seed(of->seed, half));
}

/* NULL: all is read, and emits. */
static importance *importance_of(examination *e) {
    return e->importance.n > 0 ? &e->importance : NULL;
}

/* The form factors that the operator was built from, where the store does not keep them. */
static lam_status find_again(examination *e, const recipe *from, const uint32_t *order, lam_error *error) {
    lam_status status = LAM_OK;
    const form_factor_options how = {.recipe = *from,
                                     .progress = e->progress,
                                     .stage = "form factors",
                                     .importance = importance_of(e),
                                     .row_sums = e->row_sums};
    if (has_form_factors(e)) return LAM_OK;
    if (!recipe_can(from, SOURCE_BLOCKS)) return form_factors_make(&e->m, order, &how, &e->f, error);
    TRY(form_factors_tree(&e->m, &e->tree, error));
    TRY(form_factors_make_blocks(&e->m, order, &e->tree, NULL, &how, &e->f, &e->blocks, error));
done:
    return status;
}

static lam_status measure_again(examination *e, const recipe *from, error_report *out, lam_error *error) {
    lam_status status = LAM_OK;
    const block_factors *const blocks = &e->blocks;
    uint32_t *order = memory_allocate(e->m.n, sizeof *order, "the order of the elements", error);
    if (order == NULL) TRY(LAM_ERR_MEMORY);
    TRY(mesh_z_order(&e->m, order, error));
    TRY(find_again(e, from, order, error));
    const build_problem problem = {.n = e->m.n,
                                   .n_channels = e->m.n_channels,
                                   .area = e->m.area,
                                   .reflectance = e->m.reflectance,
                                   .F = blocks->n > 0 ? NULL : &e->f.F,
                                   .blocks = blocks->n > 0 ? blocks : NULL,
                                   .order = order};
    const judging j = {
        .m = &e->m,
        .order = order,
        .problem = &problem,
        .f = &e->f,
        .importance = importance_of(e),
        .halves = {recipe_again(e, from, SEED_VERIFY_FIRST), recipe_again(e, from, SEED_VERIFY_SECOND)},
        .stages = {"form factors", "form factors"},
        .probes_seed = precompute_seed(from->seed, SEED_VERIFY_PROBES),
        .first_light_seed = precompute_seed(from->seed, SEED_VERIFY_FIRST_LIGHT),
        .probes = e->probes,
        .progress = e->progress};
    TRY(judging_run(&j, e->op, out, error));
done:
    free(order);
    return status;
}

lam_status verify_error(examination *e, check *c, lam_error *error) {
    lam_status status = LAM_OK;
    error_report again = {.seconds = 0};
    recipe from = {.rays = 0};
    if (examination_skips(e, c)) return LAM_OK;
    if (e->probes == 0 || e->stated.single.probes == 0) {
        check_say(c, VERDICT_SKIPPED, e->probes == 0 ? "not measured again (--probes 0)" : "none is stated");
        return LAM_OK;
    }
    if (e->row_sums == NULL) {
        check_say(c, VERDICT_SKIPPED, "stated by random walks; --walks N compares the answers with others");
        return LAM_OK;
    }
    if (e->probes > e->m.n) e->probes = e->m.n;
    TRY(read_recipe(e, &from, error));
    const uint64_t available = memory_available();
    const forecast f = {.n = e->m.n,
                        .n_channels = e->m.n_channels,
                        .recipe = from,
                        .judge_recipe = recipe_again(e, &from, SEED_VERIFY_FIRST),
                        .probes = e->probes};
    if (available > 0) TRY(forecast_check(&f, .7 * (double)available, error));
    TRY(measure_again(e, &from, &again, error));
    check_say(c, VERDICT_OK, "single elements: total indirect %.3g, operator indirect %.3g, as stated",
              again.single.total_indirect.mean, again.single.operator_indirect.mean);
    const struct {
        const char *name;
        const error_group *again, *stated;
    } groups[] = {{"single", &again.single, &e->stated.single},
                  {"lights", &again.lights, &e->stated.lights},
                  {"random", &again.random, &e->stated.random}};
    for (size_t i = 0; i < sizeof groups / sizeof groups[0]; i++) {
        const char *name = groups[i].name;
        const error_group *g = groups[i].again, *of = groups[i].stated;
        if (g->probes == 0) continue;
        compare_figure(name, "total", &of->total_indirect, &g->total_indirect, g->probes, g->reference_noise,
                       c);
        compare_figure(name, "operator", &of->operator_indirect, &g->operator_indirect, g->operator_probes, 0,
                       c);
        compare_receivers(name, &of->receivers, &g->receivers, c);
    }
done:
    return check_failed(c, status, error);
}
