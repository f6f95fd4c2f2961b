/* The list of methods, their options together, and the build by one of them. */
#include "solver/method/choice.h"
#include "solver/method/method.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* The list of methods: adding one is a line here. auto weighs them in this order: a method that asks for the
 * cost of others stands behind them. */
#define METHOD_LIST(METHOD)                                                                                  \
    METHOD(emitters)                                                                                         \
    METHOD(exact)                                                                                            \
    METHOD(hierarchical)                                                                                     \
    METHOD(low_rank)                                                                                         \
    METHOD(two_mesh)                                                                                         \
    METHOD(sparse)

#define METHOD_DECLARE(name) extern const build_method method_##name;
METHOD_LIST(METHOD_DECLARE)
#define METHOD_ADDRESS(name) &method_##name,
static const build_method *const methods[] = {METHOD_LIST(METHOD_ADDRESS)};
enum { METHODS = sizeof methods / sizeof *methods };
_Static_assert((int)METHODS <= (int)METHODS_MOST, "build_options has room for the options of each method");

const build_method *method_at(size_t k) {
    return k < METHODS ? methods[k] : NULL;
}

const build_method *method_find(const char *name) {
    for (size_t k = 0; k < METHODS; k++)
        if (strcmp(methods[k]->name, name) == 0) return methods[k];
    return NULL;
}

const build_method *method_fallback(void) {
    return &method_low_rank;
}

void method_choices(char words[METHOD_CHOICES_BYTES]) {
    size_t length = (size_t)sprintf(words, "auto");
    for (size_t k = 0; k < METHODS; k++) {
        length += (size_t)snprintf(words + length, METHOD_CHOICES_BYTES - length, "|%s", methods[k]->name);
        assert(length < METHOD_CHOICES_BYTES);
    }
}

bool method_has_option(const build_method *method, const char *option) {
    for (size_t k = 0; method == NULL && k < METHODS; k++)
        if (method_has_option(methods[k], option)) return true;
    for (const option_row *row = method != NULL ? method->rows : NULL; row != NULL && row->name != NULL;
         row++)
        if (strcmp(row->name, option) == 0) return true;
    return false;
}

static size_t index_of(const build_method *method) {
    size_t k = 0;
    while (methods[k] != method) k++;
    return k;
}

void *method_own(build_options *options, const build_method *method) {
    return &options->of[index_of(method)];
}

const void *method_own_const(const build_options *options, const build_method *method) {
    return &options->of[index_of(method)];
}

const option_row build_rows[] = {
    {.name = "epsilon",
     .kind = OPTION_NUMBER,
     .offset = offsetof(build_options, epsilon),
     .argument = "X",
     .preset = ".05",
     .least = 0,
     .most = 1,
     .above = true,
     .help =
         "low-rank: bound on the error of the factorization in the 2-norm; hierarchical: the "
         "stated indirect error of the scene's own lights, which up to three trials keep where it is given "
         "and measured (--probes), begun with coefficients above a fiftieth of it; auto: the error at which "
         "methods are compared; others: where it is given, form factors follow it (--quality)"},
    {.name = "store-precision",
     .kind = OPTION_CHOICE,
     .offset = offsetof(build_options, precision),
     .preset = "f32",
     .choices = "f32|f16|i8",
     .help = "Format of the large arrays of an operator of low rank; f16 takes half of the memory and time, "
             "i8 a quarter"},
    {0},
};

static lam_status take_presets(const option_row *rows, void *fields, lam_error *error) {
    lam_status status = LAM_OK;
    for (const option_row *row = rows; row != NULL && row->name != NULL; row++)
        if (row->preset != NULL) TRY(option_read(row, row->preset, (char *)fields + row->offset, error));
done:
    return status;
}

build_options build_presets(const char *method) {
    build_options made = {.method = method, .seed = 1};
    lam_error error = {.message = ""};
    (void)take_presets(build_rows, &made, &error);
    for (size_t k = 0; k < METHODS; k++) (void)take_presets(methods[k]->rows, &made.of[k], &error);
    return made;
}

/* Gives the rows of this name the value; counts them. */
static lam_status set_rows(const option_row *rows, void *fields, const char *name, const char *value,
                           size_t *found, lam_error *error) {
    lam_status status = LAM_OK;
    for (const option_row *row = rows; row != NULL && row->name != NULL; row++) {
        if (strcmp(row->name, name) != 0) continue;
        TRY(option_read(row, value, (char *)fields + row->offset, error));
        ++*found;
    }
done:
    return status;
}

lam_status build_set(build_options *options, const char *name, const char *value, lam_error *error) {
    lam_status status = LAM_OK;
    size_t found = 0;
    TRY(set_rows(build_rows, options, name, value, &found, error));
    for (size_t k = 0; k < METHODS; k++)
        TRY(set_rows(methods[k]->rows, &options->of[k], name, value, &found, error));
    if (found == 0) FAIL(error, LAM_ERR_ARGUMENT, "--%s: no method has this option", name);
done:
    return status;
}

lam_status build_set_number(build_options *options, const char *name, double value, lam_error *error) {
    char text[32];
    snprintf(text, sizeof text, "%.17g", value);
    return build_set(options, name, text, error);
}

/* Numbers that did not come through option_read lie in their limits too; 0 without a preset is not given. */
static lam_status check_numbers(const option_row *rows, const void *fields, lam_error *error) {
    lam_status status = LAM_OK;
    for (const option_row *row = rows; row != NULL && row->name != NULL; row++) {
        double value, read;
        char text[32];
        if (row->kind != OPTION_NUMBER) continue;
        memcpy(&value, (const char *)fields + row->offset, sizeof value);
        if (value == 0 && row->preset == NULL) continue;
        snprintf(text, sizeof text, "%.17g", value);
        TRY(option_read(row, text, &read, error));
    }
done:
    return status;
}

lam_status method_build(const build_method *m, const build_problem *problem, const build_options *options,
                        const void *own, lam_operator **op, build_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(check_numbers(m->rows, own, error));
    if ((m->flags & METHOD_GEOMETRY) && (problem->centre == NULL || problem->normal == NULL))
        FAIL(error, LAM_ERR_ARGUMENT, "--method %s: needs centres and normals of the elements", m->name);
    report->method = m->name;
    report_text(report, "factorizer", "none");
    report_number(report, "rcond", 1);
    TRY(m->build(problem, options, own, op, report, error));
done:
    return status;
}

/* The candidate without error that an operator of this cost is no cheaper than; NULL: there is none. */
static const candidate *whole_instead(const decision *d, const build_problem *problem, double cost) {
    for (size_t k = 0; k < d->n_candidates; k++) {
        const candidate *c = &d->candidates[k];
        if (c != d->taken && c->certain && isfinite(c->cost) && cost >= c->cost * (double)problem->n_channels)
            return c;
    }
    return NULL;
}

lam_status build_operator(const build_problem *problem, const build_options *options, lam_operator **op,
                          build_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    lam_operator *made = NULL;
    decision d = {.n_candidates = 0};
    char why[sizeof d.reason + 128];
    *report = (build_report){.method = NULL};
    TRY(check_numbers(build_rows, options, error));
    TRY(choose_method(problem, options, false, &d, error));
    snprintf(why, sizeof why, "%s", d.reason);
    if (d.taken->op != NULL) {
        candidate *built = &d.candidates[d.taken - d.candidates];
        *report = built->built;
        made = built->op;
        built->op = NULL;
    } else {
        TRY(method_build(d.taken->method, problem, options, &d.taken->own, &made, report, error));
    }
    const candidate *whole = report->cost > 0 ? whole_instead(&d, problem, report->cost) : NULL;
    if (whole != NULL) {
        const build_report before = *report;
        lam_operator_close(made);
        made = NULL;
        *report = (build_report){.below_noise = before.below_noise};
        for (size_t k = 0; k < before.n_steps; k++)
            report_step_add(report, before.steps[k].name, before.steps[k].seconds);
        TRY(method_build(whole->method, problem, options, &whole->own, &made, report, error));
        snprintf(why, sizeof why, "%s with %s would take more memory", before.method, before.detail);
    }
    snprintf(report->reason, sizeof report->reason, "%s: %s%s%s", report->method, why,
             report->detail[0] != '\0' ? "; " : "", report->detail);
    *op = made;
    made = NULL;
done:
    lam_operator_close(made);
    decision_free(&d);
    return status;
}
