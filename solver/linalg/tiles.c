#include "solver/linalg/tiles.h"

#include "solver/base/array_grow.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

void tile_matrix_free(tile_matrix *m) {
    for (size_t d = 0; d < TILE_PLANES; d++) free(m->tiles[d]);
    *m = (tile_matrix){.count = {0}};
}

lam_status tile_matrix_append(tile_matrix *m, size_t plane, const tile_digits *t, size_t room[TILE_PLANES],
                              lam_error *error) {
    if (array_grow(&m->tiles[plane], &room[plane], m->count[plane] + 1, sizeof *t, "operator", error) !=
        LAM_OK)
        return LAM_ERR_MEMORY;
    m->tiles[plane][m->count[plane]++] = *t;
    return LAM_OK;
}

/* The numbers of a group's rows that no tile has yet. */
typedef struct heads {
    uint64_t at[TILE], end[TILE];
    size_t count; /* rows */
} heads;

/* The next group of columns with a number; n_groups: there is none. */
static size_t next_group(const csr *a, const uint32_t *group_of, size_t n_groups, const heads *h) {
    size_t next = n_groups;
    for (size_t r = 0; r < h->count; r++)
        if (h->at[r] < h->end[r] && group_of[a->indices[h->at[r]]] < next)
            next = group_of[a->indices[h->at[r]]];
    return next;
}

/* Adds the tile of integers q to the planes of its digits, from the lowest. */
static lam_status append_digits(tile_matrix *m, size_t row, size_t column, int64_t q[TILE][TILE],
                                size_t room[TILE_PLANES], lam_error *error) {
    bool left = true;
    for (size_t d = 0; d < TILE_PLANES && left; d++) {
        tile_digits t = {.row = (uint32_t)row, .column = (uint32_t)column};
        bool any = false;
        left = false;
        for (size_t r = 0; r < TILE; r++)
            for (size_t c = 0; c < TILE; c++) {
                const int64_t digit = ((q[r][c] + 128) & 255) - 128; /* -128 to 127 */
                t.values[r][c] = (int8_t)digit;
                q[r][c] = (q[r][c] - digit) / 256;
                any = any || digit != 0;
                left = left || q[r][c] != 0;
            }
        if (any && tile_matrix_append(m, d, &t, room, error) != LAM_OK) return LAM_ERR_MEMORY;
    }
    assert(!left);
    return LAM_OK;
}

lam_status tile_matrix_round(const csr *a, size_t n_groups, const tile_group *groups, const float *step,
                             tile_matrix *out, lam_error *error) {
    lam_status status = LAM_OK;
    tile_matrix made = {.count = {0}};
    size_t room[TILE_PLANES] = {0};
    uint32_t *group_of = memory_allocate(a->n, sizeof *group_of, "operator", error);
    if (group_of == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t g = 0; g < n_groups; g++)
        for (size_t r = 0; r < groups[g].size; r++) group_of[groups[g].first + r] = (uint32_t)g;
    for (size_t g = 0; g < n_groups; g++) {
        heads h = {.count = groups[g].size};
        for (size_t r = 0; r < h.count; r++) {
            h.at[r] = a->indptr[groups[g].first + r];
            h.end[r] = a->indptr[groups[g].first + r + 1];
        }
        for (size_t to; (to = next_group(a, group_of, n_groups, &h)) < n_groups;) {
            int64_t q[TILE][TILE] = {{0}};
            const double unit = (double)step[g] * (double)step[to];
            for (size_t r = 0; r < h.count; r++)
                for (; h.at[r] < h.end[r] && group_of[a->indices[h.at[r]]] == to; h.at[r]++) {
                    const size_t c = a->indices[h.at[r]] - groups[to].first;
                    q[r][c] = llrint((double)a->data[h.at[r]] / unit);
                    if (to == g) q[c][r] = q[r][c];
                }
            TRY(append_digits(&made, g, to, q, room, error));
        }
    }
    *out = made;
    made = (tile_matrix){.count = {0}};
done:
    free(group_of);
    tile_matrix_free(&made);
    return status;
}

static bool has_digit(const tile_matrix *m, size_t plane, size_t at, const tile_digits *like, size_t bit) {
    if (at == m->count[plane]) return false;
    const tile_digits *t = &m->tiles[plane][at];
    return t->row == like->row && t->column == like->column && t->values[bit / TILE][bit % TILE] != 0;
}

size_t tile_matrix_numbers(const tile_matrix *m) {
    size_t numbers = 0;
    for (size_t d = 0; d < TILE_PLANES; d++) {
        size_t at[TILE_PLANES] = {0}; /* the tile of each lower plane that is not before t */
        for (size_t k = 0; k < m->count[d]; k++) {
            const tile_digits *t = &m->tiles[d][k];
            for (size_t e = 0; e < d; e++)
                for (const tile_digits *f = m->tiles[e]; at[e] < m->count[e]; at[e]++)
                    if (f[at[e]].row > t->row || (f[at[e]].row == t->row && f[at[e]].column >= t->column))
                        break;
            for (size_t bit = 0; bit < TILE * TILE; bit++) {
                bool is_new = t->values[bit / TILE][bit % TILE] != 0;
                for (size_t e = 0; e < d; e++) is_new = is_new && !has_digit(m, e, at[e], t, bit);
                numbers += (size_t)is_new * (t->row == t->column ? 1 : 2);
            }
        }
    }
    return numbers;
}
