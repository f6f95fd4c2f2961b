#include "solver/lightmap/lightmap_light.h"

#include "solver/base/random.h"
#include "solver/formfactor/visibility/openings.h"
#include "solver/sensor/sensor_luminaires.h"
#include "solver/sensor/sensor_rows.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char what[] = "a lightmap";

/* Texels whose rows are made at once, and numbers of the sky that these may have. */
enum { AT_ONCE = 16384, SKY_AT_ONCE = 1 << 22 };

void lightmap_free(lightmap *map) {
    free(map->values);
    *map = (lightmap){.values = NULL};
}

/* The work of all blocks. */
typedef struct gathering {
    const mesh *m;
    const lightmap_light *light;
    face_openings openings; /* of the mesh, where there is a sky */
    bool *sources;          /* [n_groups], those that emit */
    size_t n_wanted;
    size_t *wanted;      /* [n_wanted], luminaires that shine */
    size_t most;         /* texels of a block */
    receiver *receivers; /* [most] */
    float *H;            /* [n_wanted][most] */
    bool *inside;        /* [most] */
} gathering;

static void gathering_free(gathering *g) {
    face_openings_free(&g->openings);
    free(g->sources);
    free(g->wanted);
    free(g->receivers);
    free(g->H);
    free(g->inside);
}

static lam_status gathering_make(const mesh *m, const lightmap_light *light, size_t n, gathering *g,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    const size_t C = light->n_channels, tiles = light->L != NULL ? light->sky->tiling.n_tiles : 0,
                 luminaires = light->D != NULL ? light->placed->n : 0;
    *g = (gathering){.m = m, .light = light, .most = n < AT_ONCE ? n : AT_ONCE};
    if (tiles > 0 && SKY_AT_ONCE / tiles < g->most) g->most = SKY_AT_ONCE / tiles;
    if (g->most < 1) g->most = 1;
    g->sources = memory_allocate(m->n_groups, sizeof *g->sources, what, error);
    g->wanted = memory_allocate(luminaires, sizeof *g->wanted, what, error);
    g->receivers = memory_allocate(g->most, sizeof *g->receivers, what, error);
    g->inside = memory_allocate(g->most, sizeof *g->inside, what, error);
    if (g->sources == NULL || g->wanted == NULL || g->receivers == NULL || g->inside == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < C * m->n && light->E != NULL; k++)
        if (light->E[k] > 0) g->sources[m->group[k % m->n]] = true;
    for (size_t k = 0; k < luminaires; k++) {
        bool shines = false;
        for (size_t c = 0; c < C; c++) shines = shines || light->D[c * luminaires + k] != 0;
        if (shines) g->wanted[g->n_wanted++] = k;
    }
    g->H = memory_allocate(g->n_wanted, g->most * sizeof *g->H, what, error);
    if (g->H == NULL) TRY(LAM_ERR_MEMORY);
    if (tiles > 0) TRY(face_openings_find(m, openings_crack_width(m), &g->openings, error));
done:
    return status;
}

/* The values of one texel of a block, number k, on an element; false where no light reaches it. */
static bool gather(const gathering *g, const sensor_rows *rows, size_t k, size_t element, float *values) {
    const lightmap_light *light = g->light;
    const mesh *m = g->m;
    const size_t n = m->n, C = light->n_channels;
    const double *colour = light->D != NULL ? luminaires_factors(light->luminaires) : NULL;
    bool lit = false;
    for (size_t c = 0; c < C; c++) {
        double sum = 0;
        for (uint64_t i = rows->start[k]; i < rows->start[k + 1]; i++)
            sum += (double)rows->weight[i] * (double)light->B[c * n + rows->element[i]];
        for (size_t t = 0; t < rows->n_tiles; t++)
            sum += (double)rows->sky[t * rows->n_receivers + k] * (double)light->L[c * rows->n_tiles + t];
        for (size_t l = 0; l < g->n_wanted; l++) {
            const size_t at = c * light->placed->n + g->wanted[l];
            sum += (double)light->D[at] * colour[at] * (double)g->H[l * rows->n_receivers + k];
        }
        sum = fmax(sum, 0);
        lit = lit || sum > 0;
        if (light->radiosity)
            sum = (light->E != NULL ? (double)light->E[c * n + element] : 0) +
                  (double)m->reflectance[c * n + element] * sum;
        values[c] = (float)sum;
    }
    return lit;
}

/* A texel is of a face that people see, and shows what the element there has, also where it faces the backs
 * of thin walls: only in a body nearly all of its rays meet backs. */
static const double backs_most = .9;

/* Gathers at texels first ... first + count - 1; state [pixels]. */
static lam_status gather_block(gathering *g, const lightmap_texel *texels, size_t first, size_t count,
                               uint8_t *state, lightmap *map, lam_error *error) {
    lam_status status = LAM_OK;
    const lightmap_light *light = g->light;
    sensor_rows rows = {.n = 0};
    const uint64_t seed = random_hash(light->seed ^ random_hash(first + 1));
    const sensor_rows_options how = {.rays = LIGHTMAP_RAYS,
                                     .pair_factor = 1. / LIGHTMAP_PAIRS,
                                     .seed = seed,
                                     .sources = g->sources,
                                     .sky = light->L != NULL ? light->sky : NULL,
                                     .openings = light->L != NULL ? &g->openings : NULL};
    for (size_t k = 0; k < count; k++) {
        receiver *to = &g->receivers[k];
        *to = (receiver){.kind = RECEIVER_PLANE};
        memcpy(to->at, texels[first + k].at, sizeof to->at);
        for (int d = 0; d < 3; d++) to->axis[d] = (double)g->m->normal[texels[first + k].element][d];
    }
    memset(g->inside, 0, count * sizeof *g->inside);
    TRY(sensor_rows_make(g->m, count, g->receivers, &how, &rows, error));
    if (g->n_wanted > 0) {
        const direct_options direct = {.seed = seed, .n_wanted = g->n_wanted, .wanted = g->wanted};
        TRY(sensor_luminaires_make(g->m, light->placed, &direct, count, g->receivers, g->H, g->inside,
                                   error));
    }
#pragma omp parallel for schedule(static)
    for (size_t k = 0; k < count; k++) {
        const lightmap_texel *of = &texels[first + k];
        const bool hidden = g->inside[k] || (double)rows.backs[k] > backs_most;
        float *to = map->values + of->pixel * map->n_channels;
        const bool lit = gather(g, &rows, k, of->element, to);
        for (size_t c = 0; c < map->n_channels && hidden; c++) to[c] = 0;
        state[of->pixel] = hidden ? LIGHTMAP_EMPTY : lit ? LIGHTMAP_LIT : LIGHTMAP_DARK;
    }
    for (size_t k = 0; k < count; k++) map->hidden += state[texels[first + k].pixel] == LIGHTMAP_EMPTY;
done:
    sensor_rows_free(&rows);
    return status;
}

static void measure(const lightmap_texels *t, const uint8_t *state, lightmap *map) {
    const size_t C = map->n_channels;
    double area = 0, sum = 0;
    for (size_t k = 0; k < t->n; k++) {
        const lightmap_texel *of = &t->texels[k];
        if (state[of->pixel] == LIGHTMAP_EMPTY) continue;
        area += of->area;
        for (size_t c = 0; c < C; c++) {
            const double x = (double)map->values[of->pixel * C + c];
            sum += of->area * x / (double)C;
            map->most = fmax(map->most, x);
        }
    }
    map->mean = area > 0 ? sum / area : 0;
}

lam_status lightmap_make(const mesh *m, const lightmap_charts *c, const lightmap_texels *t,
                         const lightmap_light *light, const progress *steps, lightmap *out,
                         lam_error *error) {
    lam_status status = LAM_OK;
    const size_t pixels = c->width * c->height;
    gathering g = {.most = 0};
    lightmap map = {.width = c->width, .height = c->height, .n_channels = light->n_channels};
    uint8_t *state = memory_allocate(pixels, sizeof *state, what, error);
    map.values = memory_allocate(pixels, light->n_channels * sizeof *map.values, what, error);
    if (state == NULL || map.values == NULL) TRY(LAM_ERR_MEMORY);
    TRY(gathering_make(m, light, t->n, &g, error));
    for (size_t first = 0; first < t->n; first += g.most) {
        const size_t count = t->n - first < g.most ? t->n - first : g.most;
        if (progress_cancelled(steps)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
        TRY(gather_block(&g, t->texels, first, count, state, &map, error));
        progress_report(steps, "lightmap", (double)(first + count) / (double)t->n);
    }
    measure(t, state, &map);
    TRY(lightmap_fill(c, state, &map, error));
    *out = map;
    map.values = NULL;
done:
    gathering_free(&g);
    lightmap_free(&map);
    free(state);
    return status;
}
