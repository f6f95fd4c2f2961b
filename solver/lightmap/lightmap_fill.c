/* Texels without a value of their own: layers that grow from the lit texels of a chart, so that neither
 * bilinear filtering nor rounding of coordinates meets a dark texel. */
#include "solver/lightmap/lightmap_light.h"

#include <stdlib.h>
#include <string.h>

/* The rectangle of a chart with its border, from and up to these columns and rows. */
typedef struct chart_room {
    size_t x, y, end_x, end_y;
} chart_room;

/* The mean of the lit neighbours of a texel; false where there are none. */
static bool mean_of_neighbours(const chart_room *r, const uint8_t *state, const lightmap *map, size_t x,
                               size_t y, float *mean) {
    const size_t C = map->n_channels;
    size_t n = 0;
    for (size_t c = 0; c < C; c++) {
        double sum = 0;
        n = 0;
        for (size_t j = y > r->y ? y - 1 : y; j <= y + 1 && j < r->end_y; j++)
            for (size_t i = x > r->x ? x - 1 : x; i <= x + 1 && i < r->end_x; i++) {
                if (state[j * map->width + i] != LIGHTMAP_LIT) continue;
                sum += (double)map->values[(j * map->width + i) * C + c];
                n++;
            }
        if (n > 0) mean[c] = (float)(sum / (double)n);
    }
    return n > 0;
}

/* One layer: all texels beside lit ones, whose pixels queue gets, become lit. left: those that are not; gives
 * how many still are. */
static size_t grow(const chart_room *r, uint8_t *state, lightmap *map, uint32_t *left, size_t n_left,
                   uint32_t *queue) {
    size_t n = 0, still = 0;
    for (size_t k = 0; k < n_left; k++) {
        const size_t pixel = left[k];
        float *to = map->values + pixel * map->n_channels;
        if (mean_of_neighbours(r, state, map, pixel % map->width, pixel / map->width, to))
            queue[n++] = left[k];
        else
            left[still++] = left[k];
    }
    for (size_t k = 0; k < n; k++) state[queue[k]] = LIGHTMAP_LIT;
    return still;
}

lam_status lightmap_fill(const lightmap_charts *c, uint8_t *state, lightmap *map, lam_error *error) {
    lam_status status = LAM_OK;
    size_t most = 0;
    uint32_t *left = NULL, *queue = NULL;
    for (size_t k = 0; k < c->n; k++) {
        const lightmap_chart *chart = &c->charts[k];
        const size_t texels = (chart->width + 2 * LIGHTMAP_BORDER) * (chart->height + 2 * LIGHTMAP_BORDER);
        if (texels > most) most = texels;
    }
    left = memory_allocate(most, sizeof *left, "a lightmap", error);
    queue = memory_allocate(most, sizeof *queue, "a lightmap", error);
    if (left == NULL || queue == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < c->n; k++) {
        const lightmap_chart *chart = &c->charts[k];
        const chart_room r = {.x = chart->x - LIGHTMAP_BORDER,
                              .y = chart->y - LIGHTMAP_BORDER,
                              .end_x = chart->x + chart->width + LIGHTMAP_BORDER,
                              .end_y = chart->y + chart->height + LIGHTMAP_BORDER};
        size_t n = 0, still = 0;
        for (size_t y = r.y; y < r.end_y; y++)
            for (size_t x = r.x; x < r.end_x; x++)
                if (state[y * map->width + x] != LIGHTMAP_LIT) left[n++] = (uint32_t)(y * map->width + x);
        for (int layer = 0; layer < LIGHTMAP_BORDER; layer++) n = grow(&r, state, map, left, n, queue);
        for (size_t i = 0; i < n; i++)
            if (state[left[i]] == LIGHTMAP_DARK)
                state[left[i]] = LIGHTMAP_LIT;
            else
                left[still++] = left[i];
        for (size_t before = 0; still > 0 && still != before;) {
            before = still;
            still = grow(&r, state, map, left, still, queue);
        }
    }
done:
    free(left);
    free(queue);
    return status;
}
