/* Luminaires of --luminaires, of a glTF or of a store, and the direct light of each of them on the elements.
 * A column that a store has is taken over where its luminaire is the same. */
#include "solver/base/array_grow.h"
#include "solver/direct/luminaire_sight.h"
#include "solver/luminaire/placed_store.h"
#include "solver/method/emitters_options.h"
#include "solver/operator/luminaire_light.h"
#include "solver/precompute/stages.h"
#include "store/groups.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void luminaire_columns_free(luminaire_columns *c) {
    placed_free(&c->placed);
    placed_free(&c->before);
    lam_luminaires_close(c->light_before);
    free(c->H);
    free(c->elements_off);
    free(c->means_off);
    free(c->scale);
    free(c->ignoring);
    *c = (luminaire_columns){.n_ignoring = 0};
}

void scene_warn(const precompute_job *job, const luminaire_warnings *w) {
    for (const char *line = w->text; *line != '\0';) {
        const size_t length = strcspn(line, "\n");
        terminal_warn(job->t, "%.*s", (int)length, line);
        line += length + (line[length] == '\n');
    }
    if (w->omitted > 0) terminal_warn(job->t, "%llu warnings more", (unsigned long long)w->omitted);
}

/* Luminaires make a store photometric, which a scene with lamps in W/m2 cannot be. */
static lam_status settle_lights(const precompute_job *job, mesh *m, lam_error *error) {
    const precompute_options *o = job->options;
    bool emits = false;
    if (m->lights == LIGHT_PHOTOMETRIC) return LAM_OK;
    if (o->lights != NULL)
        return status_fail(error, LAM_ERR_ARGUMENT, "--lights %s: luminaires count in lm; give --lights lm",
                           o->lights);
    for (size_t i = 0; i < m->n * m->n_channels && !emits; i++) emits = m->emission[i] > 0;
    if (emits)
        return status_fail(error, LAM_ERR_ARGUMENT,
                           "%.200s: its emission is in W/m2, and luminaires count in lm: give --lights lm if "
                           "its numbers are lm/m2",
                           o->input);
    m->lights = LIGHT_PHOTOMETRIC;
    terminal_log(job->t, "luminaires: emission and answers of the store are in lm/m2 and lx");
    return LAM_OK;
}

/* A store of positions of a light has the light of these alone, as it is found by walks: luminaires are
 * refused, lights of a file left out. */
static lam_status leave_out(const precompute_job *job, const mesh *m, bool *out, lam_error *error) {
    const precompute_options *o = job->options;
    *out = emitters_are_positions(emitters_options_of(&o->build));
    if (!*out) return LAM_OK;
    if (o->luminaires != NULL)
        return status_fail(error, LAM_ERR_ARGUMENT,
                           "--luminaires: a store of positions of a light has no light of luminaires; leave "
                           "out --positions or --path, or --luminaires");
    if (m->n_punctual > 0)
        terminal_warn(job->t, "%s: its %zu lights are left out: the store answers for its positions alone",
                      o->input, m->n_punctual);
    return LAM_OK;
}

lam_status scene_take_luminaires(const precompute_job *job, precompute_scene *scene, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = job->options;
    mesh *const m = &scene->m;
    placed_luminaires *p = &scene->luminaires.placed;
    const placed_options how = {.up = m->up, .assets = o->assets};
    size_t from_list = 0, outside = 0;
    bool left_out = false;
    if (o->luminaires != NULL && strcmp(o->luminaires, LUMINAIRES_NONE) == 0) return LAM_OK;
    TRY(leave_out(job, m, &left_out, error));
    if (left_out) goto done;
    if (o->luminaires != NULL) TRY(placed_read(o->luminaires, &how, p, error));
    from_list = p->n;
    for (size_t f = 0; f < p->n_files; f++) scene_warn(job, &p->files[f].photometry.warnings);
    scene_warn(job, &p->warnings);
    if (m->n_punctual > 0) TRY(placed_from_lights(o->input, m->n_punctual, m->punctual, p, &outside, error));
    if (outside > 0)
        terminal_warn(
            job->t,
            "%s: %zu directional light%s from outside and %s no luminaire: make the store with --sky "
            "and give lambertd \"sun\":{\"azimuth\":A,\"altitude\":H,\"direct\":LX}, or solve --sky clear",
            o->input, outside, outside == 1 ? " comes" : "s come", outside == 1 ? "is" : "are");
    if (p->n == 0) goto done;
    TRY(settle_lights(job, m, error));
    double lumens = 0;
    for (size_t k = 0; k < p->n; k++) lumens += placed_lumens(p, &p->luminaires[k]);
    if (p->n > from_list)
        terminal_log(job->t, "%zu luminaires, %zu of them lights of the scene file: %.6g lm as dimmed", p->n,
                     p->n - from_list, lumens);
    else
        terminal_log(job->t, "%zu luminaire%s: %.6g lm as dimmed", p->n, p->n == 1 ? "" : "s", lumens);
done:
    return status;
}

lam_status scene_load_luminaires(const precompute_job *job, store *s, precompute_scene *scene,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    luminaire_columns *c = &scene->luminaires;
    const mesh *m = &scene->m;
    bool left_out = false;
    TRY(leave_out(job, m, &left_out, error));
    if (left_out) goto done;
    TRY(placed_load(s, m->n_groups, m->group_names, &c->before, error));
    TRY(luminaires_load(s, m->n, m->n_channels, &c->light_before, error));
    if (job->options->luminaires != NULL) {
        TRY(scene_take_luminaires(job, scene, error));
    } else if (c->before.n > 0) {
        TRY(placed_load(s, m->n_groups, m->group_names, &c->placed, error));
    }
done:
    return status;
}

/* Reserves the arrays of the columns. */
static lam_status reserve(const mesh *m, luminaire_columns *c, lam_error *error) {
    const size_t k = c->placed.n;
    size_t size;
    if (!size_multiply(k, m->n, &size))
        return status_fail(error, LAM_ERR_MEMORY, "%zu luminaires for %zu elements are too many for memory",
                           k, m->n);
    c->H = memory_allocate(size, sizeof *c->H, "light of luminaires", error);
    c->elements_off = memory_allocate(k, m->n_groups * sizeof *c->elements_off, "light of luminaires", error);
    c->means_off = memory_allocate(k, m->n_groups * sizeof *c->means_off, "light of luminaires", error);
    c->scale = memory_allocate(k, sizeof *c->scale, "light of luminaires", error);
    return c->H == NULL || c->elements_off == NULL || c->means_off == NULL || c->scale == NULL
               ? LAM_ERR_MEMORY
               : LAM_OK;
}

static lam_status add_ignoring(luminaire_columns *c, size_t k, const ignored_groups *groups,
                               lam_error *error) {
    lam_status status = LAM_OK;
    TRY(array_grow(&c->ignoring, &c->ignoring_capacity, c->n_ignoring + groups->n, sizeof *c->ignoring,
                   "groups that hide no luminaire", error));
    for (size_t g = 0; g < groups->n; g++)
        c->ignoring[c->n_ignoring++] = (placed_ignoring){(uint32_t)k, groups->groups[g]};
done:
    return status;
}

/* True where a luminaire of the store before ignores these groups and no others. */
static bool ignores_same(const mesh *m, const placed_luminaires *before, size_t j,
                         const ignored_groups *groups) {
    const placed_luminaire *l = &before->luminaires[j];
    if (l->n_ignored != groups->n) return false;
    for (size_t g = 0; g < groups->n; g++)
        if (strcmp(before->ignored[l->ignored + g].text, m->group_names[groups->groups[g]]) != 0)
            return false;
    return true;
}

/* The luminaire of the store before that has the light of luminaire k, or its number if there is none. */
static size_t find_before(const mesh *m, const luminaire_columns *c, size_t k, const ignored_groups *groups) {
    const placed_luminaires *before = &c->before;
    if (k < before->n && placed_lights_alike(&c->placed, k, before, k) && ignores_same(m, before, k, groups))
        return k; /* the list is mostly as it was */
    for (size_t j = 0; j < before->n; j++)
        if (placed_lights_alike(&c->placed, k, before, j) && ignores_same(m, before, j, groups)) return j;
    return before->n;
}

/* Takes column j of the store before over, with the factor that its luminaire has now. */
static void take_before(const mesh *m, luminaire_columns *c, size_t k, size_t j) {
    const placed_luminaire *l = &c->before.luminaires[j];
    const placed_file *f = &c->before.files[l->file];
    const double before = f->lumens > 0 ? l->flux / f->lumens : c->scale[k];
    const double factor = before > 0 ? c->scale[k] / before : 0;
    const float *H = luminaires_irradiance(c->light_before) + j * m->n;
    const double *elements = luminaires_elements_off(c->light_before),
                 *means = luminaires_means_off(c->light_before);
    for (size_t i = 0; i < m->n; i++)
        c->H[k * m->n + i] = factor == 1 ? H[i] : (float)(factor * (double)H[i]);
    for (size_t g = 0; elements != NULL && g < m->n_groups; g++) {
        c->elements_off[k * m->n_groups + g] = factor * factor * elements[j * m->n_groups + g];
        c->means_off[k * m->n_groups + g] = factor * factor * means[j * m->n_groups + g];
    }
}

/* Finds the light of the luminaires that are wanted. */
static lam_status find_light(const precompute_job *job, const mesh *m, luminaire_columns *c, size_t n_wanted,
                             const size_t *wanted, lam_error *error) {
    lam_status status = LAM_OK;
    direct_light made = {.n = 0};
    char line[DIRECT_LINE];
    const direct_options how = {.seed = precompute_seed(job->options->seed, SEED_LUMINAIRES),
                                .progress = &job->progress,
                                .stage = "luminaires",
                                .n_wanted = n_wanted,
                                .wanted = wanted};
    if (n_wanted == 0) return LAM_OK;
    TRY(direct_light_make(m, &c->placed, &how, &made, error));
    for (size_t w = 0; w < n_wanted; w++) {
        const size_t k = wanted[w];
        memcpy(c->H + k * m->n, made.H + w * m->n, m->n * sizeof *c->H);
        for (size_t g = 0; g < m->n_groups; g++) {
            c->elements_off[k * m->n_groups + g] = (double)made.elements_off[w * m->n_groups + g];
            c->means_off[k * m->n_groups + g] = (double)made.means_off[w * m->n_groups + g];
        }
        direct_report_line(m, &c->placed, &made.reports[w], line);
        if (line[0] != '\0') terminal_warn(job->t, "%s", line);
    }
done:
    direct_light_free(&made);
    return status;
}

lam_status stage_luminaires(const precompute_job *job, precompute_scene *scene, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &scene->m;
    luminaire_columns *c = &scene->luminaires;
    double(*boxes)[2][3] = NULL;
    size_t *wanted = NULL, n_wanted = 0;
    if (c->placed.n == 0) return LAM_OK;
    TRY(reserve(m, c, error));
    TRY(group_boxes_make(m, &boxes, error));
    wanted = memory_allocate(c->placed.n, sizeof *wanted, "light of luminaires", error);
    if (wanted == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < c->placed.n; k++) {
        const placed_luminaire *l = &c->placed.luminaires[k];
        ignored_groups groups = {.n = 0};
        placed_source source;
        placed_source_set(&c->placed, l, m->up, &source);
        c->scale[k] = source.factor;
        TRY(ignored_groups_find(m, (const double(*)[2][3])boxes, &c->placed, l, &groups, error));
        const size_t j = find_before(m, c, k, &groups);
        status = add_ignoring(c, k, &groups, error);
        free(groups.groups);
        TRY(status);
        if (j < c->before.n)
            take_before(m, c, k, j);
        else
            wanted[n_wanted++] = k;
    }
    TRY(find_light(job, m, c, n_wanted, wanted, error));
    if (c->before.n > 0)
        terminal_log(job->t, "%zu of %zu luminaires have the light that the store had",
                     c->placed.n - n_wanted, c->placed.n);
done:
    free(boxes);
    free(wanted);
    return status;
}

lam_status luminaires_save(const luminaire_columns *c, const mesh *m, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t k = c->placed.n;
    if (k == 0) return LAM_OK;
    TRY(placed_save(&c->placed, c->scale, c->n_ignoring, c->ignoring, s, error));
    TRY(store_write(s, STORE_LUMINAIRES "/irradiance", STORE_F32, 2, (size_t[]){k, m->n}, c->H, error));
    TRY(store_write(s, STORE_LUMINAIRES "/elements_off", STORE_F64, 2, (size_t[]){k, m->n_groups},
                    c->elements_off, error));
    TRY(store_write(s, STORE_LUMINAIRES "/means_off", STORE_F64, 2, (size_t[]){k, m->n_groups}, c->means_off,
                    error));
done:
    return status;
}
