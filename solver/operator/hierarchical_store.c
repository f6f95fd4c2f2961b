/* The tiles of K in older stores, of which one triangle is kept, without zeros (tiles.h). */
#include "solver/operator/hierarchical.h"
#include "store/groups.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A tile is a number of 16 bits: a bit for each of its digits that is not 0, row by row, and the distance in
 * groups from the tile before it; GAP_FAR: the next number of `far` is the distance. */
enum { MASK_BITS = TILE * TILE, GAP_FAR = UINT16_MAX >> MASK_BITS };

/* The steps of the upper triangle's tiles from one to the next, and their digits. */
typedef struct tile_codes {
    const uint16_t *tiles;
    const uint32_t *far;
    const int8_t *digits;
    size_t n_tiles, n_far, n_digits;
} tile_codes;

/* Widens counts [dims[0]][dims[1]] where they are stored narrow. */
static lam_status read_counts(store *s, const char *name, size_t *dims, uint32_t **out, lam_error *error) {
    lam_status status = LAM_OK;
    store_type type;
    int rank;
    size_t shape[STORE_MAX_RANK];
    void *read = NULL;
    uint32_t *counts = NULL;
    TRY(store_array_info(s, name, &type, &rank, shape, error));
    TRY(store_read(s, name, type == STORE_U16 ? STORE_U16 : STORE_U32, 2, dims, &read, error));
    const size_t count = dims[0] * dims[1];
    counts = memory_allocate(count, sizeof *counts, "operator", error);
    if (counts == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < count; i++)
        counts[i] = type == STORE_U16 ? ((uint16_t *)read)[i] : ((uint32_t *)read)[i];
    *out = counts;
    counts = NULL;
done:
    free(read);
    free(counts);
    return status;
}

/* Where the next tile's distance and digits are. */
typedef struct tile_reader {
    const char *group;
    const tile_codes *codes;
    const tile_group *groups;
    size_t n_groups, tile, far, digit;
} tile_reader;

/* The tile after `before` in its row; before = NULL: the first. */
static lam_status read_tile(tile_reader *from, size_t row, const tile_digits *before, tile_digits *out,
                            lam_error *error) {
    lam_status status = LAM_OK;
    const tile_codes *codes = from->codes;
    const unsigned code = codes->tiles[from->tile], mask = code & ((1u << MASK_BITS) - 1);
    size_t gap = code >> MASK_BITS;
    if (gap == GAP_FAR) {
        if (from->far == codes->n_far)
            FAIL(error, LAM_ERR_NUMERIC, "%s/far has %zu numbers, its tiles want more", from->group,
                 codes->n_far);
        gap = codes->far[from->far++];
    }
    const size_t column = (before != NULL ? before->column : row) + gap;
    if (column >= from->n_groups || (before != NULL && gap == 0))
        FAIL(error, LAM_ERR_NUMERIC, "%s: row %zu steps to column %zu, must be ascending and below %zu",
             from->group, row, column, from->n_groups);
    *out = (tile_digits){.row = (uint32_t)row, .column = (uint32_t)column};
    for (unsigned bit = 0; bit < MASK_BITS; bit++) {
        const size_t r = bit / TILE, c = bit % TILE;
        if ((mask >> bit & 1) == 0) continue;
        if (r >= from->groups[row].size || c >= from->groups[column].size || (column == row && c < r))
            FAIL(error, LAM_ERR_NUMERIC, "%s/tile[%zu] = %u has a number beyond its groups' sizes",
                 from->group, from->tile, code);
        if (from->digit == codes->n_digits)
            FAIL(error, LAM_ERR_NUMERIC, "%s/digit has %zu numbers, its tiles want more", from->group,
                 codes->n_digits);
        out->values[r][c] = codes->digits[from->digit++];
        if (column == row) out->values[c][r] = out->values[r][c];
    }
    from->tile++;
done:
    return status;
}

lam_status hierarchical_load_tiles(store *s, const char *group, size_t n_groups, const tile_group *groups,
                                   tile_matrix *out, lam_error *error) {
    lam_status status = LAM_OK;
    char name[64];
    size_t planes[STORE_MAX_RANK] = {SIZE_MAX, n_groups}, n_tiles[STORE_MAX_RANK] = {SIZE_MAX},
           n_far[STORE_MAX_RANK] = {SIZE_MAX}, n_digits[STORE_MAX_RANK] = {SIZE_MAX}, total = 0;
    uint32_t *counts = NULL;
    void *tiles = NULL, *far = NULL, *digits = NULL;
    tile_matrix made = {.count = {0}};
    snprintf(name, sizeof name, "%s/count", group);
    TRY(read_counts(s, name, planes, &counts, error));
    snprintf(name, sizeof name, "%s/tile", group);
    TRY(store_read(s, name, STORE_U16, 1, n_tiles, &tiles, error));
    snprintf(name, sizeof name, "%s/far", group);
    TRY(store_read(s, name, STORE_U32, 1, n_far, &far, error));
    snprintf(name, sizeof name, "%s/digit", group);
    TRY(store_read(s, name, STORE_I8, 1, n_digits, &digits, error));
    if (planes[0] < 1 || planes[0] > TILE_PLANES)
        FAIL(error, LAM_ERR_FORMAT, "%s: %s/count has %zu planes, must have 1 to %d", store_path(s), group,
             planes[0], TILE_PLANES);
    for (size_t k = 0; k < planes[0] * n_groups; k++) total += counts[k];
    if (total != n_tiles[0])
        FAIL(error, LAM_ERR_FORMAT, "%s: %s has %zu tiles, its rows want %zu", store_path(s), group,
             n_tiles[0], total);
    const tile_codes codes = {.tiles = tiles,
                              .far = far,
                              .digits = digits,
                              .n_tiles = n_tiles[0],
                              .n_far = n_far[0],
                              .n_digits = n_digits[0]};
    tile_reader from = {.group = group, .codes = &codes, .groups = groups, .n_groups = n_groups};
    for (size_t d = 0; d < planes[0]; d++) {
        const uint32_t *of_row = counts + d * n_groups;
        size_t count = 0;
        for (size_t g = 0; g < n_groups; g++) count += of_row[g];
        made.tiles[d] = memory_allocate(count, sizeof *made.tiles[d], "operator", error);
        if (made.tiles[d] == NULL) TRY(LAM_ERR_MEMORY);
        for (size_t g = 0; g < n_groups; g++)
            for (size_t k = 0; k < of_row[g]; k++, made.count[d]++) {
                tile_digits *const at = &made.tiles[d][made.count[d]];
                TRY(read_tile(&from, g, k > 0 ? at - 1 : NULL, at, error));
            }
    }
    if (from.far != codes.n_far || from.digit != codes.n_digits)
        FAIL(error, LAM_ERR_FORMAT, "%s: %s has %zu digits and %zu far distances, its tiles want %zu and %zu",
             store_path(s), group, codes.n_digits, codes.n_far, from.digit, from.far);
    *out = made;
    made = (tile_matrix){.count = {0}};
done:
    free(counts);
    free(tiles);
    free(far);
    free(digits);
    tile_matrix_free(&made);
    return status;
}
