#include "solver/method/judge/judge_sky_tiles.h"

#include "solver/base/weighted.h"
#include "solver/method/judge/judge_black.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Fewer of an element's own rays tell little of the light of a tile: their number varies as that of
 * independent ones does, by its root, and the errors of tiles that many rays meet say nothing of it. */
static const double few_rays = 8;

/* Pairs of an element and a tile that rays are aimed at, at most. */
enum { PAIRS_MOST = 8192 };

/* Means over groups are kept up to so many numbers. */
static const size_t means_most = (size_t)1 << 20;

static lam_status sums_begin(const judge_input *input, tile_sums *out, lam_error *error) {
    const size_t m = input->sky->n_tiles, G = input->n_groups;
    out->power =
        memory_allocate(input->problem->n_channels, m * sizeof *out->power, "errors of skies", error);
    if (out->power == NULL) return LAM_ERR_MEMORY;
    if (G > means_most / m) return LAM_OK;
    out->elements = memory_allocate(G, m * sizeof *out->elements, "errors of skies", error);
    out->means = memory_allocate(G, m * sizeof *out->means, "errors of skies", error);
    return out->elements != NULL && out->means != NULL ? LAM_OK : LAM_ERR_MEMORY;
}

static void sums_free(tile_sums *s) {
    free(s->elements);
    free(s->means);
    free(s->power);
    *s = (tile_sums){.power = NULL};
}

/* Adds a number of one element and tile. */
static void add(const tile_errors *t, size_t element, size_t tile, double number, tile_sums *to) {
    const build_problem *p = t->input->problem;
    const size_t m = t->input->sky->n_tiles, g = t->input->group[element];
    const double a = p->area[element];
    if (to->elements != NULL) {
        to->elements[g * m + tile] += a * number / t->area[g];
        to->means[g * m + tile] += a * a * number / (t->area[g] * t->area[g]);
    }
    for (size_t c = 0; c < p->n_channels; c++) {
        const double flux = a * judge_power_share(t->input, c, element);
        to->power[c * m + tile] += flux * flux * number;
    }
}

lam_status tile_errors_begin(const judge_input *input, tile_errors *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = input->problem->n;
    tile_errors t = {.input = input};
    t.area = memory_allocate(input->n_groups, sizeof *t.area, "errors of skies", error);
    if (t.area == NULL) TRY(LAM_ERR_MEMORY);
    TRY(sums_begin(input, &t.seen, error));
    TRY(sums_begin(input, &t.rare, error));
    for (size_t i = 0; i < n; i++) t.area[input->group[i]] += input->problem->area[i];
#pragma omp parallel for schedule(static, 4)
    for (size_t tile = 0; tile < input->sky->n_tiles; tile++)
        for (size_t i = 0; i < n; i++)
            if (input->sky->own[tile * n + i] > 0)
                add(&t, i, tile, (double)input->sky->own[tile * n + i], &t.seen);
    *out = t;
    t = (tile_errors){.input = NULL};
done:
    tile_errors_free(&t);
    return status;
}

void tile_errors_free(tile_errors *t) {
    free(t->area);
    sums_free(&t->seen);
    sums_free(&t->rare);
    *t = (tile_errors){.input = NULL};
}

typedef struct ranked {
    double flux; /* A rho, of the channel where that is largest */
    size_t element;
} ranked;

/* The largest first, and of equal ones the first. */
static int compare(const void *one, const void *other) {
    const ranked *a = one, *b = other;
    if (a->flux != b->flux) return a->flux > b->flux ? -1 : 1;
    return a->element < b->element ? -1 : a->element > b->element;
}

/* The elements in the order of their A rho, [n], those that see nothing of the sky at 0. */
static void rank(const judge_input *input, ranked *of) {
    const build_problem *p = input->problem;
    for (size_t i = 0; i < p->n; i++) {
        bool sees = false;
        of[i] = (ranked){.element = i};
        for (size_t t = 0; t < input->sky->n_tiles && !sees; t++) sees = input->sky->own[t * p->n + i] > 0;
        for (size_t c = 0; c < p->n_channels && sees; c++)
            of[i].flux = fmax(of[i].flux, p->area[i] * judge_reflectance(input, c, i));
    }
    qsort(of, p->n, sizeof *of, compare);
}

/* The first bounce of a tile by the operator's own rays, less that of the ground. */
static double own_light(const judged_sky *sky, size_t n, size_t element, size_t tile) {
    const double ground = sky->ground != NULL ? sky->ground[element] * sky->reflects[tile] : 0;
    return (double)sky->own[tile * n + element] - ground;
}

/* The pairs of the largest elements and the tiles that few of their own rays met. */
static size_t choose(const judge_input *input, const ranked *of, size_t *elements, size_t *tiles) {
    const judged_sky *sky = input->sky;
    const size_t n = input->problem->n;
    size_t count = 0;
    for (size_t k = 0; k < n && of[k].flux > 0; k++)
        for (size_t t = 0; t < sky->n_tiles; t++) {
            if (own_light(sky, n, of[k].element, t) >= few_rays * sky->own_ray) continue;
            if (count == PAIRS_MOST) return count;
            elements[count] = of[k].element;
            tiles[count++] = t;
        }
    return count;
}

lam_status tile_errors_aim(tile_errors *t, lam_error *error) {
    lam_status status = LAM_OK;
    const judge_input *input = t->input;
    const judged_sky *sky = input->sky;
    const size_t n = input->problem->n;
    ranked *order = NULL;
    size_t *elements = NULL, *tiles = NULL;
    float *first[2] = {NULL};
    if (sky->pairs == NULL || !(sky->own_ray > 0)) return LAM_OK;
    order = memory_allocate(n, sizeof *order, "errors of skies", error);
    elements = memory_allocate(PAIRS_MOST, sizeof *elements, "errors of skies", error);
    tiles = memory_allocate(PAIRS_MOST, sizeof *tiles, "errors of skies", error);
    if (order == NULL || elements == NULL || tiles == NULL) TRY(LAM_ERR_MEMORY);
    rank(input, order);
    const size_t count = choose(input, order, elements, tiles);
    for (int k = 0; k < 2; k++) {
        if ((first[k] = memory_allocate(PAIRS_MOST, sizeof *first[k], "errors of skies", error)) == NULL)
            TRY(LAM_ERR_MEMORY);
        TRY(sky->pairs(sky->tiles_context, k, count, elements, tiles, first[k], error));
    }
    /* Few rays meet such a tile. The product of both samples has no noise on average, but is 0 where one of
     * them missed the tile, too; the square of their mean errs by the variance of that, and upwards. */
    for (size_t k = 0; k < count; k++) {
        const double own = (double)sky->own[tiles[k] * n + elements[k]];
        const double off = .5 * ((double)first[0][k] + (double)first[1][k]) - own;
        add(t, elements[k], tiles[k], off * off, &t->rare);
    }
done:
    free(order);
    free(elements);
    free(tiles);
    for (int k = 0; k < 2; k++) free(first[k]);
    return status;
}

tile_spread tile_errors_of_group(const tile_errors *t, size_t group, bool of_mean, const float *L,
                                 double mean) {
    const size_t m = t->input->sky->n_tiles;
    if (t->seen.elements == NULL) return (tile_spread){.seen = 0};
    return (tile_spread){
        weighted_spread(m, (of_mean ? t->seen.means : t->seen.elements) + group * m, L, mean),
        weighted_spread(m, (of_mean ? t->rare.means : t->rare.elements) + group * m, L, mean)};
}

tile_spread tile_errors_of_power(const tile_errors *t, size_t channel, const float *L, double mean) {
    const size_t m = t->input->sky->n_tiles;
    return (tile_spread){weighted_spread(m, t->seen.power + channel * m, L, mean),
                         weighted_spread(m, t->rare.power + channel * m, L, mean)};
}

/* [count] of direct^2 seen + rare; NULL where these are. */
static lam_status finish(size_t count, const double *seen, const double *rare, double direct2, double **out,
                         lam_error *error) {
    if (seen == NULL) return LAM_OK;
    *out = memory_allocate(count, sizeof **out, "errors of skies", error);
    if (*out == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < count; k++) (*out)[k] = direct2 * seen[k] + rare[k];
    return LAM_OK;
}

lam_status tile_errors_finish(const tile_errors *t, double direct2, group_errors *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t m = t->input->sky->n_tiles, n_means = t->input->n_groups * m;
    const tile_sums *seen = &t->seen, *rare = &t->rare;
    tile_sums made = {.power = NULL};
    TRY(finish(n_means, seen->elements, rare->elements, direct2, &made.elements, error));
    TRY(finish(n_means, seen->means, rare->means, direct2, &made.means, error));
    TRY(finish(t->input->problem->n_channels * m, seen->power, rare->power, direct2, &made.power, error));
    out->sky_elements_off = made.elements;
    out->sky_means_off = made.means;
    out->sky_power_off = made.power;
    made = (tile_sums){.power = NULL};
done:
    sums_free(&made);
    return status;
}
