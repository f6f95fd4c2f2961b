/* The arrays of K in a store: tiles of signed bytes (tiles.h). */
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
    void *counts; /* [TILE_PLANES][n_groups] u16 or u32 */
    uint16_t *tiles;
    uint32_t *far;
    int8_t *digits;
    size_t n_tiles, n_far, n_digits;
} tile_codes;

static void codes_free(tile_codes *codes) {
    free(codes->counts);
    free(codes->tiles);
    free(codes->far);
    free(codes->digits);
}

/* counts [n_planes][n_groups], of tiles. */
static void encode_tiles(const tile_matrix *m, size_t n_planes, size_t n_groups, uint32_t *counts,
                         tile_codes *out) {
    for (size_t d = 0; d < n_planes; d++)
        for (size_t k = 0; k < m->count[d]; k++) {
            const tile_digits *t = &m->tiles[d][k];
            const bool follows = k > 0 && t[-1].row == t->row;
            const uint32_t gap = t->column - (follows ? t[-1].column : t->row);
            unsigned mask = 0;
            for (unsigned bit = 0; bit < MASK_BITS; bit++) {
                const size_t r = bit / TILE, c = bit % TILE;
                if (t->values[r][c] == 0 || (t->column == t->row && c < r)) continue;
                mask |= 1u << bit;
                out->digits[out->n_digits++] = t->values[r][c];
            }
            if (gap >= GAP_FAR) out->far[out->n_far++] = gap;
            out->tiles[out->n_tiles++] = (uint16_t)((gap < GAP_FAR ? gap : GAP_FAR) << MASK_BITS | mask);
            counts[d * n_groups + t->row]++;
        }
}

lam_status hierarchical_save_tiles(const tile_matrix *m, size_t n_groups, const char *group, store *s,
                                   lam_error *error) {
    lam_status status = LAM_OK;
    char name[64];
    size_t n_planes = 1, all = 0;
    tile_codes codes = {.n_tiles = 0};
    uint32_t *counts = NULL, most = 0;
    for (size_t d = 0; d < TILE_PLANES; d++) {
        all += m->count[d];
        if (m->count[d] > 0) n_planes = d + 1;
    }
    const size_t n_counts = n_planes * n_groups;
    counts = memory_allocate(n_counts, sizeof *counts, "operator", error);
    uint16_t *narrow = codes.counts = memory_allocate(n_counts, sizeof *narrow, "operator", error);
    codes.tiles = memory_allocate(all, sizeof *codes.tiles, "operator", error);
    codes.far = memory_allocate(all, sizeof *codes.far, "operator", error);
    codes.digits = memory_allocate(all, MASK_BITS * sizeof *codes.digits, "operator", error);
    if (counts == NULL || narrow == NULL || codes.tiles == NULL || codes.far == NULL || codes.digits == NULL)
        TRY(LAM_ERR_MEMORY);
    encode_tiles(m, n_planes, n_groups, counts, &codes);
    for (size_t k = 0; k < n_counts; k++) {
        narrow[k] = (uint16_t)counts[k];
        most = counts[k] > most ? counts[k] : most;
    }
    const bool wide = most > UINT16_MAX;
    snprintf(name, sizeof name, "%s/count", group);
    TRY(store_write(s, name, wide ? STORE_U32 : STORE_U16, 2, (const size_t[]){n_planes, n_groups},
                    wide ? (const void *)counts : (const void *)narrow, error));
    snprintf(name, sizeof name, "%s/tile", group);
    TRY(store_write(s, name, STORE_U16, 1, &codes.n_tiles, codes.tiles, error));
    snprintf(name, sizeof name, "%s/far", group);
    TRY(store_write(s, name, STORE_U32, 1, &codes.n_far, codes.far, error));
    snprintf(name, sizeof name, "%s/digit", group);
    TRY(store_write(s, name, STORE_I8, 1, &codes.n_digits, codes.digits, error));
done:
    free(counts);
    codes_free(&codes);
    return status;
}

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

lam_status hierarchical_save_groups(size_t n_groups, const tile_group *groups, const float *step, store *s,
                                    lam_error *error) {
    lam_status status = LAM_OK;
    TRY(store_write(s, STORE_OPERATOR "/groups/rows", STORE_U32, 2, (const size_t[]){n_groups, 2}, groups,
                    error));
    TRY(store_write(s, STORE_OPERATOR "/groups/step", STORE_F32, 1, &n_groups, step, error));
done:
    return status;
}

/* The largest step: a number of it and of four digits, and sums of them, are finite. */
static const float step_most = 0x1p40f;

lam_status hierarchical_load_groups(store *s, size_t n, size_t *n_groups, tile_group **groups, float **step,
                                    lam_error *error) {
    lam_status status = LAM_OK;
    void *rows = NULL, *steps = NULL;
    size_t dims[STORE_MAX_RANK] = {SIZE_MAX, 2}, end = 0;
    TRY(store_read(s, STORE_OPERATOR "/groups/rows", STORE_U32, 2, dims, &rows, error));
    TRY(store_read(s, STORE_OPERATOR "/groups/step", STORE_F32, 1, dims, &steps, error));
    const tile_group *const found = rows;
    for (size_t g = 0; g < dims[0]; g++) {
        const float by = ((float *)steps)[g];
        if (found[g].first < end || found[g].size < 1 || found[g].size > TILE ||
            (size_t)found[g].first + found[g].size > n)
            FAIL(error, LAM_ERR_NUMERIC,
                 "groups/rows[%zu] = %u, %u: must have 1 to %d rows of %zu behind those of the group before",
                 g, (unsigned)found[g].first, (unsigned)found[g].size, TILE, n);
        if (!(by > 0 && by <= step_most))
            FAIL(error, LAM_ERR_NUMERIC, "groups/step[%zu] = %g, must be above 0 and at most %g", g,
                 (double)by, (double)step_most);
        end = (size_t)found[g].first + found[g].size;
    }
    *n_groups = dims[0];
    *groups = rows;
    *step = steps;
    rows = steps = NULL;
done:
    free(rows);
    free(steps);
    return status;
}
