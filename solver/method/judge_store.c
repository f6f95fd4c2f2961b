/* Measured errors in a store. */
#include "solver/method/judge.h"

#include <stdio.h>

static lam_status save_figures(store *s, const char *group, const char *what, const error_figures *f,
                               lam_error *error) {
    lam_status status = LAM_OK;
    char name[64];
    const char *const statistic[3] = {"mean", "std", "max"};
    const double value[3] = {f->mean, f->std, f->max};
    for (int i = 0; i < 3; i++) {
        snprintf(name, sizeof name, "%s_%s", what, statistic[i]);
        TRY(store_set_number(s, group, name, value[i], error));
    }
done:
    return status;
}

static lam_status save_receivers(store *s, const char *name, const receiver_figures *f, bool has_total,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    if (!f->known) return LAM_OK;
    TRY(store_set_number(s, name, "receivers_operator_indirect", f->operator_indirect, error));
    if (!has_total) goto done;
    TRY(store_set_number(s, name, "receivers_relative", f->total_relative, error));
    TRY(store_set_number(s, name, "receivers_indirect", f->total_indirect, error));
    TRY(store_set_number(s, name, "receivers_noise", f->noise, error));
    TRY(store_set_integer(s, name, "receivers_is_bound", f->is_bound, error));
done:
    return status;
}

static lam_status save_group(store *s, const char *name, const error_group *g, bool has_total,
                             lam_error *error) {
    lam_status status = LAM_OK;
    if (g->probes == 0) return LAM_OK;
    TRY(store_set_integer(s, name, "probes", (int64_t)g->probes, error));
    if (has_total) {
        TRY(save_figures(s, name, "total_relative", &g->total_relative, error));
        TRY(save_figures(s, name, "total_indirect", &g->total_indirect, error));
        TRY(store_set_number(s, name, "reference_noise", g->reference_noise, error));
        if (g->probes_noise >= 0) TRY(store_set_number(s, name, "probes_noise", g->probes_noise, error));
        TRY(store_set_integer(s, name, "total_is_bound", g->is_bound, error));
    }
    TRY(store_set_integer(s, name, "operator_probes", (int64_t)g->operator_probes, error));
    TRY(save_figures(s, name, "operator_relative", &g->operator_relative, error));
    TRY(save_figures(s, name, "operator_indirect", &g->operator_indirect, error));
    TRY(store_set_number(s, name, "negative_share", g->negative_share, error));
    TRY(store_set_number(s, name, "energy_balance", g->energy_balance, error));
    TRY(save_receivers(s, name, &g->receivers, has_total, error));
done:
    return status;
}

lam_status judge_save(const error_report *report, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(save_group(s, "/error/single", &report->single, report->has_total, error));
    TRY(save_group(s, "/error/lights", &report->lights, report->has_total, error));
    TRY(save_group(s, "/error/random", &report->random, report->has_total, error));
done:
    return status;
}
