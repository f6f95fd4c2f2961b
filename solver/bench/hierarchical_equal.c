/* What other kinds of operator take for the error of a hierarchical one. */
#include "solver/bench/bench_hierarchical.h"

#include <math.h>
#include <string.h>

const table_column hierarchical_equal_columns[] = {
    {"scene", NULL, "which"},
    {"elements", "", "n"},
    {"light", NULL, "what shines"},
    {"epsilon", "", "of the hierarchical operator"},
    {"error", "", "its total indirect error, mean"},
    {"stored_mb", "MB", "it takes in a store"},
    {"least_kind", NULL, "the other kind that takes least for as small an error; -: none has it"},
    {"least_mb", "MB", "what that takes, between two of its settings by powers"},
    {"stored_share", "", "hierarchical over that"},
    {"mb", "MB", "that a query reads"},
    {"mb_share", "", "over that of the other kind that reads least"},
    {"query_ms", "ms", "of one radiosity, one thread"},
    {"query_share", "", "over that of the fastest other kind"},
    {"build_s", "s", "without form factors"},
    {"build_share", "", "over that of the other kind that is built fastest"},
};
const size_t hierarchical_equal_width =
    sizeof hierarchical_equal_columns / sizeof *hierarchical_equal_columns;

static double cost_of(const kind_point *p, size_t offset) {
    return *(const double *)((const char *)p + offset);
}

/* The least cost of a kind for an error of at most `error`: that of a setting, or between one that is rougher
 * and the next; infinite where no setting is fine enough. */
static double least_cost(const kind_curve *c, size_t light, double error, size_t offset) {
    double least = INFINITY;
    for (size_t k = 0; k < c->n; k++) {
        const double now = c->at[k].error[light], cost = cost_of(&c->at[k], offset);
        if (!(now <= error)) continue;
        least = fmin(least, cost);
        const double before = k > 0 ? c->at[k - 1].error[light] : NAN;
        if (!(before > error && now > 0)) continue;
        const double part = log(before / error) / log(before / now);
        least =
            fmin(least, cost_of(&c->at[k - 1], offset) * pow(cost / cost_of(&c->at[k - 1], offset), part));
    }
    return least;
}

/* Of all kinds that answer for any light but hierarchical. */
static double least_of_others(const kind_curve curves[KINDS], size_t light, double error, size_t offset,
                              const char **kind) {
    double least = INFINITY;
    *kind = "-";
    for (size_t k = 1; k < KINDS; k++) {
        if (strcmp(hierarchical_kinds[k], "emitters") == 0) continue;
        const double cost = least_cost(&curves[k], light, error, offset);
        if (!(cost < least)) continue;
        least = cost;
        *kind = hierarchical_kinds[k];
    }
    return least;
}

void hierarchical_at_equal_error(const lowrank_scene *s, const kind_curve curves[KINDS], table *out) {
    static const size_t offsets[] = {offsetof(kind_point, mb), offsetof(kind_point, query_ms),
                                     offsetof(kind_point, build_s)};
    for (size_t light = 0; light < LIGHTS; light++)
        for (size_t k = 0; k < curves[0].n; k++) {
            const kind_point *own = &curves[0].at[k];
            const double error = own->error[light];
            const char *kind, *unused;
            if (!isfinite(error)) continue;
            const double least =
                least_of_others(curves, light, error, offsetof(kind_point, stored_mb), &kind);
            table_text(out, s->name);
            table_number(out, (double)s->m.n);
            table_text(out, hierarchical_lights[light]);
            table_number(out, own->setting);
            table_number(out, error);
            table_number(out, own->stored_mb);
            table_text(out, kind);
            table_number(out, least);
            table_number(out, isfinite(least) ? own->stored_mb / least : NAN);
            for (size_t o = 0; o < sizeof offsets / sizeof *offsets; o++) {
                const double cost = cost_of(own, offsets[o]);
                const double other = least_of_others(curves, light, error, offsets[o], &unused);
                table_number(out, cost);
                table_number(out, isfinite(other) ? cost / other : NAN);
            }
        }
}
