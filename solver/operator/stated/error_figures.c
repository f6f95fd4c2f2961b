/* The figures under /error of a store, saved and loaded by the same lists of names. */
#include "solver/operator/stated/error_figures.h"

#include "store/groups.h"
#include "store/status.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define BY_GROUP STORE_ERROR "/by_group"
#define EMITTERS STORE_ERROR "/emitters"

enum { PATH_BYTES = 64, REPORT_GROUPS = 5, MESH_GROUP = REPORT_GROUPS, OWN_GROUP };

const figures_group figures_groups[] = {{"single", STORE_ERROR "/single"},
                                        {"lights", STORE_ERROR "/lights"},
                                        {"random", STORE_ERROR "/random"},
                                        {"whole", STORE_ERROR "/whole"},
                                        {"sky", STORE_ERROR "/sky"},
                                        [MESH_GROUP] = {"mesh", STORE_ERROR "/mesh"},
                                        [OWN_GROUP] = {"own", STORE_ERROR "/own"},
                                        {NULL, NULL}};

/* The groups of a report in that order. */
static void groups_of(error_report *r, error_group *out[REPORT_GROUPS]) {
    error_group *const groups[REPORT_GROUPS] = {&r->single, &r->lights, &r->random, &r->whole, &r->sky};
    for (int k = 0; k < REPORT_GROUPS; k++) out[k] = groups[k];
}

/* An attribute of a group of probes: where it is, and when it is stated. */
typedef enum figure_when { ALWAYS, WITH_TOTAL, WITH_OPERATOR, WITH_RECEIVERS, WITH_BOTH } figure_when;
enum { ATTRIBUTES = 24 };
typedef struct attribute {
    const char *name;
    figure_when when;
    double *number; /* one of these three */
    size_t *count;
    bool *flag;
} attribute;

static void attributes_of(error_group *g, attribute out[ATTRIBUTES]) {
    receiver_figures *r = &g->receivers;
    const attribute all[ATTRIBUTES] = {
        {"probes", ALWAYS, .count = &g->probes},
        {"total_relative_mean", WITH_TOTAL, .number = &g->total_relative.mean},
        {"total_relative_std", WITH_TOTAL, .number = &g->total_relative.std},
        {"total_relative_max", WITH_TOTAL, .number = &g->total_relative.max},
        {"total_indirect_mean", WITH_TOTAL, .number = &g->total_indirect.mean},
        {"total_indirect_std", WITH_TOTAL, .number = &g->total_indirect.std},
        {"total_indirect_max", WITH_TOTAL, .number = &g->total_indirect.max},
        {"reference_noise", WITH_TOTAL, .number = &g->reference_noise},
        {"probes_noise", WITH_TOTAL, .number = &g->probes_noise},
        {"total_is_bound", WITH_TOTAL, .flag = &g->is_bound},
        {"operator_probes", WITH_OPERATOR, .count = &g->operator_probes},
        {"operator_relative_mean", WITH_OPERATOR, .number = &g->operator_relative.mean},
        {"operator_relative_std", WITH_OPERATOR, .number = &g->operator_relative.std},
        {"operator_relative_max", WITH_OPERATOR, .number = &g->operator_relative.max},
        {"operator_indirect_mean", WITH_OPERATOR, .number = &g->operator_indirect.mean},
        {"operator_indirect_std", WITH_OPERATOR, .number = &g->operator_indirect.std},
        {"operator_indirect_max", WITH_OPERATOR, .number = &g->operator_indirect.max},
        {"negative_share", WITH_OPERATOR, .number = &g->negative_share},
        {"energy_balance", WITH_OPERATOR, .number = &g->energy_balance},
        {"receivers_operator_indirect", WITH_RECEIVERS, .number = &r->operator_indirect},
        {"receivers_relative", WITH_BOTH, .number = &r->total_relative},
        {"receivers_indirect", WITH_BOTH, .number = &r->total_indirect},
        {"receivers_noise", WITH_BOTH, .number = &r->noise},
        {"receivers_is_bound", WITH_BOTH, .flag = &r->is_bound}};
    for (int k = 0; k < ATTRIBUTES; k++) out[k] = all[k];
}

/* Negative: not stated. */
static double number_of(store *s, const char *path, const char *name) {
    double x = -1;
    const bool found =
        store_has_attribute(s, path, name) && store_get_number(s, path, name, &x, NULL) == LAM_OK;
    return found ? x : -1;
}

static lam_status save_group(store *s, const char *path, error_group *g, bool has_total, lam_error *error) {
    lam_status status = LAM_OK;
    const bool of_operator = g->operator_probes > 0, receivers = of_operator && g->receivers.known;
    const bool stated[] = {[ALWAYS] = true,
                           [WITH_TOTAL] = has_total,
                           [WITH_OPERATOR] = of_operator,
                           [WITH_RECEIVERS] = receivers,
                           [WITH_BOTH] = receivers && has_total};
    attribute all[ATTRIBUTES];
    if (g->probes == 0) return LAM_OK;
    attributes_of(g, all);
    for (const attribute *a = all; a < all + ATTRIBUTES; a++) {
        if (!stated[a->when] || (a->number == &g->probes_noise && *a->number < 0)) continue;
        if (a->number != NULL)
            TRY(store_set_number(s, path, a->name, *a->number, error));
        else
            TRY(store_set_integer(s, path, a->name, a->count != NULL ? (int64_t)*a->count : *a->flag, error));
    }
done:
    return status;
}

static void load_group(store *s, const char *path, error_group *g) {
    attribute all[ATTRIBUTES];
    attributes_of(g, all);
    for (const attribute *a = all; a < all + ATTRIBUTES; a++) {
        const double x = number_of(s, path, a->name);
        if (a->number != NULL) *a->number = x;
        if (a->count != NULL) *a->count = x > 0 && x < 0x1p53 ? (size_t)x : 0;
        if (a->flag != NULL) *a->flag = x > 0;
    }
    g->receivers.known = g->receivers.operator_indirect >= 0;
}

void error_report_load(store *s, error_report *out) {
    error_group *groups[REPORT_GROUPS];
    *out = (error_report){.seconds = 0};
    groups_of(out, groups);
    for (int k = 0; k < REPORT_GROUPS; k++) {
        load_group(s, figures_groups[k].path, groups[k]);
        out->has_total = out->has_total || groups[k]->total_indirect.mean >= 0;
    }
}

/* Writes figures of the mesh, or reads them: one that is no finite number is not known. */
static lam_status pass_mesh_numbers(store *s, bool saves, mesh_figures *m, lam_error *error) {
    lam_status status = LAM_OK;
    const char *const path = figures_groups[MESH_GROUP].path;
    const struct {
        const char *name;
        double *number;
        bool *has;
    } all[] = {{"lights", &m->lights, &m->has_lights},
               {"even", &m->even, &m->has_even},
               {"sky_even", &m->sky_even, &m->has_skies},
               {"sky_cloudy", &m->sky_cloudy, &m->has_skies},
               {"single", &m->single, &m->has_single},
               {"groups", &m->groups, &m->has_groups},
               {"sky_tile", &m->sky_tile, &m->has_tiles},
               {"luminaires", &m->luminaires, &m->has_luminaires},
               {"luminaire", &m->luminaire, &m->has_luminaire},
               {"luminaires_number", &m->luminaires_number, NULL},
               {"even_emitters", &m->even_emitters, NULL},
               {"groups_emitters", &m->groups_emitters, NULL},
               {"groups_together", &m->groups_together, NULL},
               {"even_light", m->light_of + MESH_OF_EVEN, NULL},
               {"single_light", m->light_of + MESH_OF_SINGLE, NULL},
               {"sky_even_light", m->light_of + MESH_OF_SKY_EVEN, NULL},
               {"sky_tile_light", m->light_of + MESH_OF_SKY_TILE, NULL},
               {"luminaires_light", m->light_of + MESH_OF_LUMINAIRES, NULL},
               {"luminaire_light", m->light_of + MESH_OF_LUMINAIRE, NULL}};
    for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
        const double x = saves ? -1 : number_of(s, path, all[k].name);
        const bool has = all[k].has != NULL ? *all[k].has : *all[k].number > 0;
        if (saves && has) TRY(store_set_number(s, path, all[k].name, *all[k].number, error));
        if (!(x >= 0 && isfinite(x))) continue;
        *all[k].number = x;
        if (all[k].has != NULL) *all[k].has = true;
    }
done:
    return status;
}

void mesh_figures_load_shown(store *s, mesh_figures *out) {
    *out = (mesh_figures){.has_lights = false};
    pass_mesh_numbers(s, false, out, NULL);
}

void mesh_figures_free(mesh_figures *m) {
    for (int k = 0; k < MESH_FIGURES; k++) {
        free(m->variation[k]);
        free(m->reflected[k]);
    }
    free(m->lights_power);
    free(m->group_share);
    free(m->group_light);
    *m = (mesh_figures){.has_lights = false};
}

/* Writes an array of `group`, or reads it: numbers that are finite and at least `least`. */
static lam_status pass_array(store *s, bool saves, const char *group, const char *name, int rank,
                             size_t *dims, double least, double **numbers, lam_error *error) {
    lam_status status = LAM_OK;
    char path[PATH_BYTES];
    void *data = NULL;
    size_t count = 1;
    snprintf(path, sizeof path, "%s/%s", group, name);
    if (saves) return store_write(s, path, STORE_F64, rank, dims, *numbers, error);
    TRY(store_read(s, path, STORE_F64, rank, dims, &data, error));
    *numbers = data;
    for (int d = 0; d < rank; d++) count *= dims[d];
    for (size_t k = 0; k < count; k++)
        if (!((*numbers)[k] >= least && isfinite((*numbers)[k])))
            FAIL(error, LAM_ERR_FORMAT, "%s: %s[%zu] = %g, must be %s", store_path(s), path, k, (*numbers)[k],
                 least < 0 ? "finite" : "at least 0");
done:
    return status;
}

/* The same with the arrays by group, of which older stores have none. */
static lam_status pass_mesh(store *s, bool saves, mesh_figures *m, lam_error *error) {
    static const char *const names[MESH_FIGURES][2] = {
        [MESH_OF_LAMPS] = {"lights_variation", "lights_reflected"},
        [MESH_OF_EVEN] = {"even_variation", "even_reflected"},
        [MESH_OF_SKY_EVEN] = {"sky_even_variation", "sky_even_reflected"},
        [MESH_OF_SKY_CLOUDY] = {"sky_cloudy_variation", "sky_cloudy_reflected"},
        [MESH_OF_SINGLE] = {"single_variation", "single_reflected"},
        [MESH_OF_GROUPS] = {"groups_variation", "groups_reflected"},
        [MESH_OF_SKY_TILE] = {"sky_tile_variation", "sky_tile_reflected"},
        [MESH_OF_LUMINAIRES] = {"luminaires_variation", "luminaires_reflected"},
        [MESH_OF_LUMINAIRE] = {"luminaire_variation", "luminaire_reflected"}};
    lam_status status = LAM_OK;
    const char *const group = figures_groups[MESH_GROUP].path;
    TRY(pass_mesh_numbers(s, saves, m, error));
    for (int k = 0; k < 2 * MESH_FIGURES; k++) {
        const char *const name = names[k / 2][k % 2];
        double **numbers = &(k % 2 == 0 ? m->variation : m->reflected)[k / 2];
        char path[PATH_BYTES];
        snprintf(path, sizeof path, "%s/%s", group, name);
        if (saves ? *numbers == NULL : !store_has(s, path)) continue;
        TRY(pass_array(s, saves, group, name, 1, &m->n_groups, 0, numbers, error));
    }
    if (saves ? m->lights_power != NULL : store_has(s, STORE_ERROR "/mesh/lights_power"))
        TRY(pass_array(s, saves, group, "lights_power", 1, &m->n_groups, 0, &m->lights_power, error));
    if (saves ? m->group_light == NULL : !store_has(s, STORE_ERROR "/mesh/group_light")) goto done;
    TRY(pass_array(s, saves, group, "group_share", 1, &m->n_groups, 0, &m->group_share, error));
    TRY(pass_array(s, saves, group, "group_light", 1, &m->n_groups, 0, &m->group_light, error));
done:
    return status;
}

const char *group_figure_name(int figure) {
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
    return names[figure];
}

static const char *const sky_names[SKY_FIGURES] = {
    [SKY_MEAN_TILES] = "sky_mean_tiles",     [SKY_MEAN_EVEN] = "sky_mean_even",
    [SKY_MEAN_BOUNCED] = "sky_mean_bounced", [SKY_RMS_TILES] = "sky_rms_tiles",
    [SKY_RMS_EVEN] = "sky_rms_even",         [SKY_RMS_BOUNCED] = "sky_rms_bounced"};

/* Numbers of tiles, [rows][n_tiles]; those of groups may be left out. */
enum { TILE_ARRAYS = 5 };
typedef struct tile_array {
    const char *name;
    size_t rows;
    double **numbers;
    bool of_groups;
} tile_array;

static void tile_arrays_of(group_errors *e, tile_array out[TILE_ARRAYS]) {
    const tile_array all[TILE_ARRAYS] = {{"sky_power", e->n_channels, &e->sky_power, false},
                                         {"sky_first", e->n_groups, &e->sky_first, true},
                                         {"sky_power_off", e->n_channels, &e->sky_power_off, false},
                                         {"sky_elements_off", e->n_groups, &e->sky_elements_off, true},
                                         {"sky_means_off", e->n_groups, &e->sky_means_off, true}};
    for (int k = 0; k < TILE_ARRAYS; k++) out[k] = all[k];
}

void group_errors_drop_whole(group_errors *e) {
    free(e->whole_groups);
    free(e->whole_rms);
    free(e->whole_mean);
    e->whole_groups = NULL;
    e->whole_rms = e->whole_mean = NULL;
    e->n_whole = 0;
}

void group_errors_free(group_errors *e) {
    tile_array tiles[TILE_ARRAYS];
    tile_arrays_of(e, tiles);
    for (int f = 0; f < GROUP_FIGURES; f++) free(e->of[f]);
    for (int f = 0; f < GROUP_FIGURES; f++) free(e->of_operator[f]);
    for (int f = 0; f < SKY_FIGURES; f++) free(e->sky[f]);
    for (int k = 0; k < TILE_ARRAYS; k++) free(*tiles[k].numbers);
    group_errors_drop_whole(e);
    *e = (group_errors){.n_groups = 0};
}

/* Writes the errors of whole groups, or reads them: older stores have none. */
static lam_status pass_whole(store *s, bool saves, group_errors *e, lam_error *error) {
    static const char path[] = BY_GROUP "/whole_groups";
    lam_status status = LAM_OK;
    void *groups = NULL;
    if (saves ? e->n_whole == 0 : !store_has(s, path)) return LAM_OK;
    if (saves) {
        TRY(store_write(s, path, STORE_U32, 1, &e->n_whole, e->whole_groups, error));
    } else {
        e->n_whole = SIZE_MAX;
        TRY(store_read(s, path, STORE_U32, 1, &e->n_whole, &groups, error));
        e->whole_groups = groups;
        for (size_t k = 0; k < e->n_whole; k++)
            if (e->whole_groups[k] >= e->n_groups)
                FAIL(error, LAM_ERR_FORMAT, "%s: %s[%zu] = %u, must be below %zu, the number of groups",
                     store_path(s), path, k, (unsigned)e->whole_groups[k], e->n_groups);
    }
    size_t dims[4] = {e->n_rows, e->n_groups, e->n_whole, e->n_whole};
    TRY(pass_array(s, saves, BY_GROUP, "whole_rms", 4, dims, -INFINITY, &e->whole_rms, error));
    TRY(pass_array(s, saves, BY_GROUP, "whole_mean", 4, dims, -INFINITY, &e->whole_mean, error));
done:
    return status;
}

/* Writes what stands under by_group, or reads those of its figures that laws need. */
static lam_status pass_by_group(store *s, bool saves, group_errors *e, lam_error *error) {
    lam_status status = LAM_OK;
    size_t bins[2] = {saves ? e->n_rows : SIZE_MAX, e->n_groups}, n_tiles = saves ? e->n_tiles : SIZE_MAX;
    tile_array tiles[TILE_ARRAYS];
    if (saves ? e->n_rows == 0 : !store_has(s, BY_GROUP)) return LAM_OK;
    for (int k = 0; k < (saves ? GROUP_FIGURES : GROUP_UNIFORM); k++)
        TRY(pass_array(s, saves, BY_GROUP, group_figure_name(k), 2, bins, 0, &e->of[k], error));
    if (bins[0] < 1 || bins[0] > 2)
        FAIL(error, LAM_ERR_FORMAT, "%s: " BY_GROUP " has figures of %zu rows, must have 1 or 2",
             store_path(s), bins[0]);
    e->n_rows = bins[0];
    TRY(pass_whole(s, saves, e, error));
    if (saves ? e->sky[0] == NULL : !store_has(s, BY_GROUP "/sky_power")) goto done;
    for (int k = 0; k < SKY_FIGURES; k++)
        TRY(pass_array(s, saves, BY_GROUP, sky_names[k], 2, bins, 0, &e->sky[k], error));
    if (saves) TRY(store_set_number(s, BY_GROUP, "sky_direct", e->sky_direct, error));
    const bool of_groups = saves ? e->sky_first != NULL : store_has(s, BY_GROUP "/sky_first");
    tile_arrays_of(e, tiles);
    for (const tile_array *a = tiles; a < tiles + TILE_ARRAYS; a++) {
        size_t dims[2] = {a->rows, n_tiles};
        if (a->of_groups && !of_groups) continue;
        TRY(pass_array(s, saves, BY_GROUP, a->name, 2, dims, 0, a->numbers, error));
        e->n_tiles = n_tiles = dims[1];
    }
done:
    return status;
}

lam_status group_errors_load_shown(store *s, size_t n_groups, group_errors *out, lam_error *error) {
    lam_status status = LAM_OK;
    group_errors e = {.n_groups = n_groups};
    *out = e;
    if (!store_has(s, BY_GROUP)) return LAM_OK;
    for (int k = GROUP_UNIFORM; k < GROUP_FIGURES; k++) {
        char path[PATH_BYTES];
        void *data = NULL;
        size_t dims[2] = {SIZE_MAX, n_groups};
        snprintf(path, sizeof path, BY_GROUP "/%s", group_figure_name(k));
        TRY(store_read(s, path, STORE_F64, 2, dims, &data, error));
        e.of[k] = data;
        e.n_rows = dims[0];
        if (dims[0] == 0) FAIL(error, LAM_ERR_FORMAT, "%s: %s is empty", store_path(s), path);
    }
    *out = e;
    e = (group_errors){.n_groups = 0};
done:
    group_errors_free(&e);
    return status;
}

void emitter_figures_free(emitter_figures *e) {
    free(e->covariance);
    free(e->of_groups);
    free(e->of_means);
    free(e->relative);
    free(e->indirect);
    *e = (emitter_figures){.s = 0};
}

/* Writes what stands under emitters, or reads their covariances. */
static lam_status pass_emitters(store *s, bool saves, emitter_figures *e, lam_error *error) {
    lam_status status = LAM_OK;
    size_t dims[3] = {e->n_groups, e->s, e->s};
    const bool of_groups = saves ? e->of_groups != NULL : store_has(s, EMITTERS "/groups");
    TRY(pass_array(s, saves, EMITTERS, "covariance", 2, dims + 1, -INFINITY, &e->covariance, error));
    if (of_groups) {
        TRY(pass_array(s, saves, EMITTERS, "groups", 3, dims, -INFINITY, &e->of_groups, error));
        TRY(pass_array(s, saves, EMITTERS, "group_means", 3, dims, -INFINITY, &e->of_means, error));
    }
    if (saves) {
        TRY(pass_array(s, saves, EMITTERS, "relative", 1, dims + 1, 0, &e->relative, error));
        TRY(pass_array(s, saves, EMITTERS, "indirect", 1, dims + 1, 0, &e->indirect, error));
    }
done:
    return status;
}

lam_status emitter_figures_load_shown(store *s, emitter_figures *out, lam_error *error) {
    lam_status status = LAM_OK;
    emitter_figures e = {.s = SIZE_MAX};
    void *data = NULL;
    *out = (emitter_figures){.s = 0};
    if (!store_has(s, EMITTERS)) return LAM_OK;
    TRY(store_read(s, EMITTERS "/relative", STORE_F64, 1, &e.s, &data, error));
    e.relative = data;
    TRY(store_read(s, EMITTERS "/indirect", STORE_F64, 1, &e.s, &data, error));
    e.indirect = data;
    *out = e;
    e = (emitter_figures){.s = 0};
done:
    emitter_figures_free(&e);
    return status;
}

void stated_figures_free(stated_figures *f) {
    group_errors_free(&f->by_group);
    emitter_figures_free(&f->emitters);
    mesh_figures_free(&f->mesh);
    *f = (stated_figures){.repair = 0};
}

static lam_status save_own(const own_figures *of, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const char *const path = figures_groups[OWN_GROUP].path;
    if (!of->known) return LAM_OK;
    TRY(store_set_number(s, path, "relative", of->relative, error));
    TRY(store_set_number(s, path, "indirect", of->indirect, error));
    TRY(store_set_number(s, path, "rest", of->rest, error));
    if (of->mesh >= 0) TRY(store_set_number(s, path, "mesh", of->mesh, error));
done:
    return status;
}

lam_status stated_figures_save(const stated_figures *of, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    stated_figures f = *of;
    error_group *groups[REPORT_GROUPS];
    groups_of(&f.report, groups);
    for (int k = 0; k < REPORT_GROUPS; k++)
        TRY(save_group(s, figures_groups[k].path, groups[k], f.report.has_total, error));
    if (f.emitters.s > 0) TRY(pass_emitters(s, true, &f.emitters, error));
    TRY(pass_mesh(s, true, &f.mesh, error));
    TRY(save_own(&f.own, s, error));
    if (f.repair > 0) TRY(store_set_number(s, STORE_ERROR, "repair", f.repair, error));
    TRY(pass_by_group(s, true, &f.by_group, error));
done:
    return status;
}

void own_figures_load(store *s, own_figures *out) {
    const char *const path = figures_groups[OWN_GROUP].path;
    *out = (own_figures){.known = store_has(s, path)};
    if (!out->known) return;
    out->relative = number_of(s, path, "relative");
    out->indirect = number_of(s, path, "indirect");
    out->rest = number_of(s, path, "rest");
    out->mesh = number_of(s, path, "mesh");
    out->known = out->rest >= 0;
}

bool figure_is_of_luminaires(const char *object, const char *named) {
    static const char word[] = "luminaire"; /* and luminaires */
    const char *group = figures_groups[MESH_GROUP].path;
    if (strcmp(object, figures_groups[OWN_GROUP].path) == 0) return true;
    const size_t length = strlen(group);
    if (strncmp(object, group, length) != 0) return false;
    const char *name = named != NULL ? named : object + length + (object[length] == '/');
    return (named == NULL || object[length] == '\0') && strncmp(name, word, strlen(word)) == 0;
}

bool mesh_figures_are_stated(store *s) {
    return store_has(s, figures_groups[MESH_GROUP].path);
}

lam_status stated_figures_load(store *s, const figures_shape *shape, stated_figures *out, lam_error *error) {
    lam_status status = LAM_OK;
    stated_figures f = {.by_group = {.n_groups = shape->n_groups, .n_channels = shape->n_channels}};
    error_report_load(s, &f.report);
    f.mesh.n_groups = shape->n_groups;
    TRY(pass_mesh(s, false, &f.mesh, error));
    if (store_has_attribute(s, STORE_ERROR, "repair"))
        TRY(store_get_number(s, STORE_ERROR, "repair", &f.repair, error));
    if (!(f.repair >= 0) || !isfinite(f.repair))
        FAIL(error, LAM_ERR_FORMAT, "%s: " STORE_ERROR " attribute repair is %g, must be at least 0",
             store_path(s), f.repair);
    TRY(pass_by_group(s, false, &f.by_group, error));
    if (shape->n_emitters > 0 && store_has(s, EMITTERS "/covariance")) {
        f.emitters = (emitter_figures){.s = shape->n_emitters, .n_groups = shape->n_groups};
        TRY(pass_emitters(s, false, &f.emitters, error));
    }
    *out = f;
    f = (stated_figures){.repair = 0};
done:
    stated_figures_free(&f);
    return status;
}
