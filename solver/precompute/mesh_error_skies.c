#include "solver/precompute/mesh_error_skies.h"

#include "solver/base/random.h"
#include "solver/base/weighted.h"
#include "solver/precompute/mesh_error_lights.h"
#include "solver/precompute/precompute.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SKIES = 2 };

/* Tiles that shine alone are looked at in rounds, so many at once at most. */
enum { TILE_ROUNDS = 4, TILES_AT_ONCE = 4 };

/* Clouds are this bright at least, relative to the brightest, as those by which skies are judged. */
static const double darkest_cloud = .2;

/* The scene that skies are judged in, and room for n_skies of them. */
typedef struct sky_work {
    const precompute_job *job;
    const precompute_scene *scene;
    const sky_bounce *sky;
    const made_operator *made;
    size_t row;   /* n_tiles + 1 */
    double *L;    /* [n_skies][row], radiances of tiles, and of the ground that they light */
    float *E, *B; /* [n_skies][C][n] */
    float *W;     /* [n_skies][C][s], of emitters, the first of which are the tiles; NULL: the operator
                     answers E */
    double *H0;   /* [n] */
    void *work;   /* of the operator, bytes */
    size_t bytes;
} sky_work;

static void sky_work_free(sky_work *w) {
    free(w->L);
    free(w->E);
    free(w->B);
    free(w->W);
    free(w->H0);
    free(w->work);
}

static lam_status sky_work_begin(size_t n_skies, sky_work *w, lam_error *error) {
    const size_t vector = w->scene->m.n * w->scene->m.n_channels;
    w->bytes = lam_operator_work_bytes(w->made->op, n_skies);
    w->L = memory_allocate(n_skies, w->row * sizeof *w->L, "the error of the mesh", error);
    w->E = memory_allocate(n_skies, vector * sizeof *w->E, "the error of the mesh", error);
    w->B = memory_allocate(n_skies, vector * sizeof *w->B, "the error of the mesh", error);
    w->H0 = memory_allocate(w->scene->m.n, sizeof *w->H0, "the error of the mesh", error);
    w->work = memory_allocate(w->bytes, 1, "the error of the mesh", error);
    if (w->L == NULL || w->E == NULL || w->B == NULL || w->H0 == NULL || w->work == NULL)
        return LAM_ERR_MEMORY;
    const size_t s = emitter_list_count(&w->scene->emitters);
    if (s == 0) return LAM_OK;
    w->W =
        memory_allocate(n_skies, w->scene->m.n_channels * s * sizeof *w->W, "the error of the mesh", error);
    return w->W == NULL ? LAM_ERR_MEMORY : LAM_OK;
}

/* True where emitter t is tile t of the sky, of radiance 1, and nothing else. */
static bool emitters_are_tiles(const precompute_scene *scene, size_t n_tiles) {
    const emitter_list *list = &scene->emitters;
    const size_t each = scene->m.n_channels * n_tiles, vector = scene->m.n_channels * scene->m.n;
    if (list->s != n_tiles || list->light.L == NULL) return false;
    for (size_t k = 0; k < n_tiles * each; k++)
        if (list->light.L[k] != (k % n_tiles == k / each)) return false;
    for (size_t k = 0; list->light.E != NULL && k < n_tiles * vector; k++)
        if (list->light.E[k] != 0) return false;
    return true;
}

/* B of the skies of radiances w->L. */
static lam_status answer_skies(const sky_work *w, size_t n_skies, lam_error *error) {
    const size_t tiles = w->row - 1, C = w->scene->m.n_channels;
    const size_t s = emitter_list_count(&w->scene->emitters);
    for (size_t k = 0; w->W != NULL && k < n_skies * C * tiles; k++) /* luminaires behind them are dark */
        w->W[k / tiles * s + k % tiles] = (float)w->L[k / (C * tiles) * w->row + k % tiles];
    const float *E = w->W != NULL ? NULL : w->E;
    return mesh_error_answers(w->scene, w->made, n_skies, w->W, E, w->B, w->work, w->bytes, error);
}

/* The ground below the horizon sends back what the tiles of a sky send to it. */
static void light_ground(const sky_bounce *sky, double *L) {
    const size_t tiles = sky->tiling.n_tiles;
    double light = 0;
    for (size_t t = 0; t < tiles; t++) light += L[t] * sky->tiling.tiles[t].cosine;
    L[tiles] = sky->ground_albedo * light / M_PI;
}

/* An even sky and a cloudy one. */
static void set_skies(const sky_work *w, uint64_t seed) {
    for (size_t s = 0; s < SKIES; s++) {
        for (size_t t = 0; t + 1 < w->row; t++)
            w->L[s * w->row + t] = s == 0 ? 1 : darkest_cloud + (1 - darkest_cloud) * random_unit(&seed);
        light_ground(w->sky, w->L + s * w->row);
    }
}

/* H0 = sum_t L_t first_bounce_t of one sky, tile by tile that shines. */
static void add_up_tiles(const sky_work *w, const double *L) {
    const size_t n = w->scene->m.n;
    memset(w->H0, 0, n * sizeof *w->H0);
    for (size_t t = 0; t + 1 < w->row; t++) {
        const float *first = w->sky->first_bounce + t * n;
        for (size_t i = 0; L[t] > 0 && i < n; i++) w->H0[i] += L[t] * (double)first[i];
    }
}

/* E = rho H0 [n_skies][C][n]; true where any of it is light. */
static bool light_by_skies(const sky_work *w, size_t n_skies) {
    const mesh *m = &w->scene->m;
    const size_t n = m->n, vector = m->n_channels * n;
    bool lit = false;
    for (size_t s = 0; s < n_skies; s++) {
        add_up_tiles(w, w->L + s * w->row);
        for (size_t i = 0; i < n; i++) lit = lit || w->H0[i] > 0;
        for (size_t k = 0; k < vector; k++)
            w->E[s * vector + k] = (float)(w->H0[k % n] * (double)m->reflectance[k]);
    }
    return lit;
}

/* Judges the skies of radiances w->L: errors and mesh_error_light [n_skies]; *lit: they light the scene, else
 * nothing is found. */
static lam_status judge_skies(const sky_work *w, size_t n_skies, uint64_t seed, double *found, double *light,
                              mesh_error_groups *groups, bool *lit, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &w->scene->m;
    const size_t vector = m->n_channels * m->n;
    const gather_sky skies = {.tiling = &w->sky->tiling, .L = w->L};
    *lit = light_by_skies(w, n_skies);
    if (!*lit) return LAM_OK;
    TRY(answer_skies(w, n_skies, error));
    for (size_t s = 0; s < n_skies; s++)
        light[s] = mesh_error_light(m, w->E + s * vector, w->B + s * vector, true);
    memset(w->E, 0, n_skies * vector * sizeof *w->E);
    TRY(mesh_error(m, n_skies, w->E, w->B, false, &skies, NULL, seed, &w->job->progress, found, groups,
                   error));
done:
    return status;
}

static lam_status add_wide(sky_work *w, uint64_t seed, mesh_figures *figures, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &w->scene->m;
    double found[SKIES], light[SKIES];
    mesh_error_groups groups = {.fewer = 0};
    TRY(mesh_error_groups_begin(m, SKIES, &groups, error));
    set_skies(w, seed);
    TRY(judge_skies(w, SKIES, seed, found, light, &groups, &figures->has_skies, error));
    if (!figures->has_skies) goto done;
    TRY(mesh_error_take(&groups, 0, MESH_OF_SKY_EVEN, m->n_groups, figures, error));
    TRY(mesh_error_take(&groups, 1, MESH_OF_SKY_CLOUDY, m->n_groups, figures, error));
    figures->sky_even = found[0];
    figures->sky_cloudy = found[1];
    figures->light_of[MESH_OF_SKY_EVEN] = light[0];
done:
    mesh_error_groups_free(&groups);
    return status;
}

/* power [n_tiles], added up from the first: what each tile sends into the scene, which reflects something. */
static void add_up_powers(const sky_work *w, double *power) {
    const mesh *m = &w->scene->m;
    double all = 0;
    for (size_t t = 0; t + 1 < w->row; t++) {
        const float *first = w->sky->first_bounce + t * m->n;
        for (size_t k = 0; k < m->n * m->n_channels; k++)
            all += m->area[k % m->n] * (double)m->reflectance[k] * (double)first[k % m->n];
        power[t] = all;
    }
}

/* Single tiles, at equal steps of the power that they send into the scene. */
static lam_status add_tiles(sky_work *w, size_t at_once, uint64_t seed, mesh_figures *figures,
                            lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &w->scene->m;
    const size_t tiles = w->row - 1, n = TILE_ROUNDS * at_once;
    double found[TILES_AT_ONCE], light[TILES_AT_ONCE], *before = NULL;
    mesh_error_groups groups = {.fewer = TILE_ROUNDS};
    mesh_light_sums sums = {.noise2 = NULL};
    uint64_t random = seed;
    bool lit;
    before = memory_allocate(tiles + 1, sizeof *before, "the error of the mesh", error);
    if (before == NULL) TRY(LAM_ERR_MEMORY);
    TRY(mesh_error_groups_begin(m, at_once, &groups, error));
    TRY(mesh_light_sums_begin(m, &sums, error));
    add_up_powers(w, before + 1);
    for (size_t round = 0; round < TILE_ROUNDS; round++) {
        memset(w->L, 0, at_once * w->row * sizeof *w->L);
        for (size_t s = 0; s < at_once; s++) {
            /* Tiles of one round lie far from each other. */
            const double place = ((double)(s * TILE_ROUNDS + round) + random_unit(&random)) / (double)n;
            w->L[s * w->row + weighted_part(before, tiles, place * before[tiles])] = 1;
            light_ground(w->sky, w->L + s * w->row);
        }
        TRY(judge_skies(w, at_once, random_mix(random), found, light, &groups, &lit, error));
        for (size_t s = 0; lit && s < at_once; s++) mesh_light_sums_add(&groups, s, m, light[s], &sums);
    }
    TRY(mesh_light_sums_state(&sums, m, MESH_OF_SKY_TILE, &figures->sky_tile, &figures->has_tiles, figures,
                              error));
done:
    free(before);
    mesh_error_groups_free(&groups);
    mesh_light_sums_free(&sums);
    return status;
}

lam_status mesh_error_add_skies(const precompute_job *job, const precompute_scene *scene,
                                const precompute_factors *factors, made_operator *made, lam_error *error) {
    lam_status status = LAM_OK;
    mesh_figures *figures = &made->errors_of_mesh;
    const sky_bounce *sky = &factors->f.sky;
    const uint64_t seed = precompute_seed(job->options->seed, SEED_MESH_ERROR);
    const size_t most = GATHER_VALUES_MOST / scene->m.n_channels;
    const size_t at_once = most < TILES_AT_ONCE ? most : TILES_AT_ONCE;
    sky_work w = {.job = job, .scene = scene, .sky = sky, .made = made, .row = sky->tiling.n_tiles + 1};
    if (sky->first_bounce == NULL || factors->f.closed) return LAM_OK;
    if (emitter_list_count(&scene->emitters) > 0 && !emitters_are_tiles(scene, sky->tiling.n_tiles))
        return LAM_OK;
    TRY(sky_work_begin(at_once > SKIES ? at_once : SKIES, &w, error));
    TRY(add_wide(&w, seed, figures, error));
    if (!figures->has_skies) goto done;
    TRY(add_tiles(&w, at_once, random_mix(seed), figures, error));
    terminal_log(job->t, "mesh     skies, even %.3g, cloudy %.3g, single tiles %.3g", figures->sky_even,
                 figures->sky_cloudy, figures->sky_tile);
done:
    sky_work_free(&w);
    return status;
}
