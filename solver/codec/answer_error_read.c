/* The laws of errors by group as a store has them (/error/by_group, FORMAT.md), and what their formulas need
 * of its mesh. */
#include "solver/codec/answer_error.h"
#include "store/groups.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define GROUP STORE_ERROR "/by_group"

/* Figures by bin of a law: names in a store, and where they go. */
enum { LAW_FIGURES = 6, SKY_LAW_FIGURES = 6, SKY_FIGURES_OF_BEFORE = 4 };
typedef struct law_figure {
    const char *name;
    double **to;
} law_figure;

static void figures_of(error_by_group *e, law_figure law[LAW_FIGURES], law_figure sky[SKY_LAW_FIGURES]) {
    const law_figure all[LAW_FIGURES] = {{"rms_one", &e->law.one},         {"rms_many", &e->law.many},
                                         {"rms_even", &e->law.even},       {"mean_one", &e->law.mean_one},
                                         {"mean_many", &e->law.mean_many}, {"mean_even", &e->law.mean_even}};
    const law_figure of_sky[SKY_LAW_FIGURES] = {
        {"sky_rms_tiles", &e->sky.tiles},       {"sky_rms_even", &e->sky.even},
        {"sky_mean_tiles", &e->sky.mean_tiles}, {"sky_mean_even", &e->sky.mean_even},
        {"sky_rms_bounced", &e->sky.bounced},   {"sky_mean_bounced", &e->sky.mean_bounced}};
    memcpy(law, all, sizeof all);
    memcpy(sky, of_sky, sizeof of_sky);
}

void error_by_group_free(error_by_group *e) {
    law_figure law[LAW_FIGURES], sky[SKY_LAW_FIGURES];
    figures_of(e, law, sky);
    for (size_t k = 0; k < LAW_FIGURES; k++) free(*law[k].to);
    for (size_t k = 0; k < SKY_LAW_FIGURES; k++) free(*sky[k].to);
    free(e->sky_power);
    free(e->sky_first);
    free(e->elements_off);
    free(e->means_off);
    free(e->power_off);
    free(e->area);
    free(e->squares);
    free(e->reflectance);
    free(e->of_group);
    free(e->bin);
    free(e->overlap);
    *e = (error_by_group){.n_bins = 0};
}

/* Reads numbers, [dims[0]][dims[1]]. One that is negative or not finite is no number of ours. */
static lam_status read_numbers(store *s, const char *name, size_t dims[2], double **out, lam_error *error) {
    lam_status status = LAM_OK;
    char path[64];
    void *data = NULL;
    snprintf(path, sizeof path, GROUP "/%s", name);
    TRY(store_read(s, path, STORE_F64, 2, dims, &data, error));
    *out = data;
    for (size_t k = 0; k < dims[0] * dims[1]; k++)
        if (!((*out)[k] >= 0 && isfinite((*out)[k])))
            FAIL(error, LAM_ERR_FORMAT, "%s: %s[%zu] = %g, must be at least 0", store_path(s), path, k,
                 (*out)[k]);
done:
    return status;
}

static lam_status read_figures(store *s, size_t count, const law_figure *figures, error_by_group *e,
                               lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t k = 0; k < count; k++) {
        size_t dims[2] = {e->n_bins > 0 ? e->n_bins / e->n_groups : SIZE_MAX, e->n_groups};
        TRY(read_numbers(s, figures[k].name, dims, figures[k].to, error));
        if (dims[0] < 1 || dims[0] > 2)
            FAIL(error, LAM_ERR_FORMAT, "%s: " GROUP "/%s has %zu rows, must have 1 or 2", store_path(s),
                 figures[k].name, dims[0]);
        e->n_bins = dims[0] * dims[1];
    }
done:
    return status;
}

/* The errors of single tiles. */
static lam_status read_tiles(store *s, size_t n_tiles, error_by_group *e, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(read_numbers(s, "sky_power_off", (size_t[]){e->n_channels, n_tiles}, &e->power_off, error));
    if (!store_has(s, GROUP "/sky_elements_off")) return LAM_OK;
    TRY(read_numbers(s, "sky_elements_off", (size_t[]){e->n_groups, n_tiles}, &e->elements_off, error));
    TRY(read_numbers(s, "sky_means_off", (size_t[]){e->n_groups, n_tiles}, &e->means_off, error));
done:
    return status;
}

/* Stores of before have other figures of skies, which are not read, or fewer. */
static lam_status read_sky(store *s, const law_figure *figures, error_by_group *e, lam_error *error) {
    lam_status status = LAM_OK;
    size_t dims[2] = {e->n_channels, SIZE_MAX};
    if (!store_has(s, GROUP "/sky_power") || !store_has_attribute(s, GROUP, "sky_direct")) return LAM_OK;
    const bool of_before = !store_has(s, GROUP "/sky_power_off");
    TRY(read_figures(s, of_before ? SKY_FIGURES_OF_BEFORE : SKY_LAW_FIGURES, figures, e, error));
    TRY(read_numbers(s, "sky_power", dims, &e->sky_power, error));
    TRY(store_get_number(s, GROUP, "sky_direct", &e->sky.direct, error));
    if (!(e->sky.direct >= 0 && isfinite(e->sky.direct)))
        FAIL(error, LAM_ERR_FORMAT, "%s: " GROUP " attribute sky_direct is %g, must be at least 0",
             store_path(s), e->sky.direct);
    if (store_has(s, GROUP "/sky_first"))
        TRY(read_numbers(s, "sky_first", (size_t[]){e->n_groups, dims[1]}, &e->sky_first, error));
    if (!of_before) TRY(read_tiles(s, dims[1], e, error));
    e->n_tiles = dims[1];
done:
    return status;
}

/* The areas of bins, the squares of groups, and their mean reflectances. */
static void find_sums(const error_scene *scene, error_by_group *e) {
    const group_index *groups = scene->groups;
    for (size_t g = 0; g < groups->n_groups; g++) {
        double area = 0;
        for (uint32_t k = groups->start[g]; k < groups->start[g + 1]; k++) {
            const size_t i = groups->elements[k];
            const bool other = scene->read != NULL && !scene->read[i] && e->n_bins > e->n_groups;
            const size_t bin = g + (other ? e->n_groups : 0);
            e->bin[i] = (uint32_t)bin;
            e->area[bin] += scene->area[i];
            e->squares[g] += scene->area[i] * scene->area[i];
            area += scene->area[i];
            for (size_t c = 0; c < scene->n_channels; c++)
                e->reflectance[c * e->n_groups + g] +=
                    scene->area[i] * (double)scene->reflectance[c * scene->n + i];
        }
        for (size_t c = 0; area > 0 && c < scene->n_channels; c++)
            e->reflectance[c * e->n_groups + g] /= area;
    }
}

/* Of groups, whose bins of row 0 have their numbers. */
static lam_status find_reflecting(const error_scene *scene, error_by_group *e, lam_error *error) {
    uint32_t *group = memory_allocate(scene->n, sizeof *group, "errors of groups", error);
    if (group == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < scene->n; i++) group[i] = (uint32_t)(e->bin[i] % e->n_groups);
    const lam_status status = reflecting_make(scene->n, scene->n_channels, scene->area, scene->reflectance,
                                              e->n_groups, group, &e->of_group, error);
    free(group);
    return status;
}

/* The share of light by which faces that count twice, and repaired rows, are off. */
static lam_status read_overlap(store *s, error_by_group *e, lam_error *error) {
    lam_status status = LAM_OK;
    void *data = NULL;
    if (store_has_attribute(s, STORE_ERROR, "repair"))
        TRY(store_get_number(s, STORE_ERROR, "repair", &e->repair, error));
    if (!(e->repair >= 0) || !isfinite(e->repair))
        FAIL(error, LAM_ERR_FORMAT, "%s: /error attribute repair is %g, must be at least 0", store_path(s),
             e->repair);
    if (!store_has(s, STORE_MESH "/overlap")) return LAM_OK;
    TRY(store_read(s, STORE_MESH "/overlap", STORE_F64, 1, &e->n_groups, &data, error));
    e->overlap = data;
    for (size_t g = 0; g < e->n_groups; g++)
        if (!(e->overlap[g] >= 0 && e->overlap[g] <= 1))
            FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/overlap[%zu] = %g, must be from 0 to 1", store_path(s), g,
                 e->overlap[g]);
done:
    return status;
}

lam_status error_by_group_read(store *s, const error_scene *scene, error_by_group *out, lam_error *error) {
    lam_status status = LAM_OK;
    error_by_group e = {.n_groups = scene->groups->n_groups, .n_channels = scene->n_channels};
    law_figure law[LAW_FIGURES], sky[SKY_LAW_FIGURES];
    if (!store_has(s, GROUP)) return LAM_OK;
    figures_of(&e, law, sky);
    TRY(read_figures(s, LAW_FIGURES, law, &e, error));
    TRY(read_sky(s, sky, &e, error));
    TRY(read_overlap(s, &e, error));
    e.area = memory_allocate(e.n_bins, sizeof *e.area, "errors of groups", error);
    e.squares = memory_allocate(e.n_groups, sizeof *e.squares, "errors of groups", error);
    e.reflectance =
        memory_allocate(e.n_groups, e.n_channels * sizeof *e.reflectance, "errors of groups", error);
    e.bin = memory_allocate(scene->n, sizeof *e.bin, "errors of groups", error);
    if (e.area == NULL || e.squares == NULL || e.reflectance == NULL || e.bin == NULL) TRY(LAM_ERR_MEMORY);
    find_sums(scene, &e);
    TRY(find_reflecting(scene, &e, error));
    *out = e;
    e = (error_by_group){.n_bins = 0};
done:
    error_by_group_free(&e);
    return status;
}
