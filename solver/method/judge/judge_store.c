/* Measured errors in a store. */
#include "solver/method/judge/judge.h"
#include "store/groups.h"

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
    if (g->operator_probes == 0) goto done;
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
    TRY(save_group(s, STORE_ERROR "/single", &report->single, report->has_total, error));
    TRY(save_group(s, STORE_ERROR "/lights", &report->lights, report->has_total, error));
    TRY(save_group(s, STORE_ERROR "/random", &report->random, report->has_total, error));
    TRY(save_group(s, STORE_ERROR "/whole", &report->whole, report->has_total, error));
    TRY(save_group(s, STORE_ERROR STORE_SKY, &report->sky, report->has_total, error));
done:
    return status;
}

lam_status judge_save_groups(const group_errors *e, store *s, lam_error *error) {
    static const char *const names[GROUP_FIGURES] = {[GROUP_MEAN_ONE] = "mean_one",
                                                     [GROUP_MEAN_MANY] = "mean_many",
                                                     [GROUP_MEAN_EVEN] = "mean_even",
                                                     [GROUP_RMS_ONE] = "rms_one",
                                                     [GROUP_RMS_MANY] = "rms_many",
                                                     [GROUP_RMS_EVEN] = "rms_even",
                                                     [GROUP_UNIFORM] = "uniform",
                                                     [GROUP_UNIFORM_LARGEST] = "uniform_largest",
                                                     [GROUP_NEAR] = "near",
                                                     [GROUP_NEAR_LARGEST] = "near_largest",
                                                     [GROUP_FAR] = "far",
                                                     [GROUP_FAR_LARGEST] = "far_largest"};
    static const char *const of_sky[SKY_FIGURES] = {
        [SKY_MEAN_TILES] = "sky_mean_tiles",     [SKY_MEAN_EVEN] = "sky_mean_even",
        [SKY_MEAN_BOUNCED] = "sky_mean_bounced", [SKY_RMS_TILES] = "sky_rms_tiles",
        [SKY_RMS_EVEN] = "sky_rms_even",         [SKY_RMS_BOUNCED] = "sky_rms_bounced"};
    lam_status status = LAM_OK;
    char path[64];
    for (int k = 0; k < GROUP_FIGURES && e->n_rows > 0; k++) {
        snprintf(path, sizeof path, STORE_ERROR "/by_group/%s", names[k]);
        TRY(store_write(s, path, STORE_F64, 2, (size_t[]){e->n_rows, e->n_groups}, e->of[k], error));
    }
    for (int k = 0; k < SKY_FIGURES && e->sky[k] != NULL; k++) {
        snprintf(path, sizeof path, STORE_ERROR "/by_group/%s", of_sky[k]);
        TRY(store_write(s, path, STORE_F64, 2, (size_t[]){e->n_rows, e->n_groups}, e->sky[k], error));
    }
    if (e->sky[0] != NULL)
        TRY(store_set_number(s, STORE_ERROR "/by_group", "sky_direct", e->sky_direct, error));
    const struct {
        const char *name;
        size_t rows;
        const double *numbers;
    } of_tiles[] = {{"sky_power", e->n_channels, e->sky_power},
                    {"sky_first", e->n_groups, e->sky_first},
                    {"sky_power_off", e->n_channels, e->sky_power_off},
                    {"sky_elements_off", e->n_groups, e->sky_elements_off},
                    {"sky_means_off", e->n_groups, e->sky_means_off}};
    for (size_t k = 0; k < sizeof of_tiles / sizeof *of_tiles; k++) {
        if (of_tiles[k].numbers == NULL) continue;
        snprintf(path, sizeof path, STORE_ERROR "/by_group/%s", of_tiles[k].name);
        TRY(store_write(s, path, STORE_F64, 2, (size_t[]){of_tiles[k].rows, e->n_tiles}, of_tiles[k].numbers,
                        error));
    }
done:
    return status;
}
