/* The exchange areas g_ij = (c_ij + c_ji) / rays A_i A_j / (A_i + A_j), j > i, are merged panel by panel from
 * one-sided rows, whose entries below the diagonal are transposed first. upper_expand() replaces them by F_ij
 * = min(g_ij / A_i, 1), and upper_gather() is its exact inverse. */
#include "solver/formfactor/rows/upper.h"

#include "solver/base/array_grow.h"

#include <stdlib.h>
#include <string.h>

/* The most entries of a panel, the rows that are merged or expanded at once: some tens of megabytes. */
enum { PANEL_LEAST = 1 << 16, PANEL_MOST = 1 << 21, PANELS = 64 };

static size_t panel_entries(size_t all) {
    const size_t some = all / PANELS;
    return some < PANEL_LEAST ? PANEL_LEAST : some > PANEL_MOST ? PANEL_MOST : some;
}

typedef struct transpose_entry {
    uint32_t column, row;
    float value;
} transpose_entry;

/* The entries of some consecutive rows, row by row. */
typedef struct transpose_slice {
    transpose_entry *entries;
    size_t count, capacity;
    bool failed; /* out of memory: entries are missing */
} transpose_slice;

static void transpose_push_grown(transpose_slice *slice, transpose_entry entry) {
    if (slice->failed || array_grow(&slice->entries, &slice->capacity, slice->count + 1,
                                    sizeof *slice->entries, "form factor rows", NULL) != LAM_OK) {
        slice->failed = true;
        return;
    }
    slice->entries[slice->count++] = entry;
}

static inline void transpose_push(transpose_slice *slice, uint32_t column, uint32_t row, float value) {
    const transpose_entry entry = {column, row, value};
    if (slice->count < slice->capacity)
        slice->entries[slice->count++] = entry;
    else
        transpose_push_grown(slice, entry);
}

enum { TRANSPOSE_SLICES = 32 };

/* Columns first ... last-1 of a sparse matrix: column j has the entries start[j-first] ...
 * start[j-first+1]-1, rows ascending. */
typedef struct transpose {
    size_t first, last;
    size_t *start;
    uint32_t *rows;
    float *values;
    size_t start_capacity, entry_capacity;
    transpose_slice slices[TRANSPOSE_SLICES];
    size_t *next; /* [TRANSPOSE_SLICES][last - first] */
} transpose;

/* Pushes the entries of one row that lie in columns first ... last-1. Called from many threads, once for each
 * row. */
typedef void transpose_source(void *context, size_t row, size_t first, size_t last, transpose_slice *to);

static void transpose_free(transpose *c) {
    for (size_t s = 0; s < TRANSPOSE_SLICES; s++) free(c->slices[s].entries);
    free(c->start);
    free(c->rows);
    free(c->values);
    free(c->next);
    *c = (transpose){0};
}

static lam_status reserve_columns(transpose *c, size_t width, lam_error *error) {
    if (width + 1 <= c->start_capacity) return LAM_OK;
    free(c->start);
    free(c->next);
    c->start_capacity = 0;
    c->start = memory_allocate(width + 1, sizeof *c->start, "form factors", error);
    c->next = memory_allocate(width, TRANSPOSE_SLICES * sizeof *c->next, "form factors", error);
    if (c->start == NULL || c->next == NULL) return LAM_ERR_MEMORY;
    c->start_capacity = width + 1;
    return LAM_OK;
}

static lam_status reserve_entries(transpose *c, size_t count, lam_error *error) {
    if (count <= c->entry_capacity) return LAM_OK;
    free(c->rows);
    free(c->values);
    c->entry_capacity = 0;
    count += count / 4;
    c->rows = memory_allocate(count, sizeof *c->rows, "form factors", error);
    c->values = memory_allocate(count, sizeof *c->values, "form factors", error);
    if (c->rows == NULL || c->values == NULL) return LAM_ERR_MEMORY;
    c->entry_capacity = count;
    return LAM_OK;
}

/* Transposes columns first ... last-1 of rows row_first ... row_last-1 into c, whose memory is used again.
 * The same for any number of threads. Memory: 20 bytes per entry. Errors: LAM_ERR_MEMORY. */
static lam_status transpose_collect(transpose *c, size_t row_first, size_t row_last, size_t first,
                                    size_t last, transpose_source *source, void *context, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t width = last - first, n_rows = row_last > row_first ? row_last - row_first : 0;
    TRY(reserve_columns(c, width, error));
    c->first = first;
    c->last = last;
    memset(c->next, 0, width * TRANSPOSE_SLICES * sizeof *c->next);
    /* next[slice][column]: first the number of entries, then the place of the next one. */
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t s = 0; s < TRANSPOSE_SLICES; s++) {
        transpose_slice *slice = &c->slices[s];
        size_t *count = c->next + s * width;
        slice->count = 0;
        slice->failed = false;
        const size_t end = row_first + (s + 1) * n_rows / TRANSPOSE_SLICES;
        for (size_t row = row_first + s * n_rows / TRANSPOSE_SLICES; row < end; row++)
            source(context, row, first, last, slice);
        for (size_t e = 0; e < slice->count; e++) count[slice->entries[e].column - first]++;
    }
    size_t total = 0;
    for (size_t j = 0; j < width; j++) {
        c->start[j] = total;
        for (size_t s = 0; s < TRANSPOSE_SLICES; s++) {
            const size_t count = c->next[s * width + j];
            c->next[s * width + j] = total;
            total += count;
        }
    }
    c->start[width] = total;
    for (size_t s = 0; s < TRANSPOSE_SLICES; s++)
        if (c->slices[s].failed)
            FAIL(error, LAM_ERR_MEMORY, "form factors: out of memory; use fewer --rays or a smaller scene");
    TRY(reserve_entries(c, total, error));
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t s = 0; s < TRANSPOSE_SLICES; s++) {
        const transpose_slice *slice = &c->slices[s];
        size_t *next = c->next + s * width;
        for (size_t e = 0; e < slice->count; e++) {
            const transpose_entry *entry = &slice->entries[e];
            const size_t at = next[entry->column - first]++;
            c->rows[at] = entry->row;
            c->values[at] = entry->value;
        }
    }
done:
    return status;
}

/* The place up to which a row has been read: below the diagonal a panel of columns at a time, then above it.
 */
typedef struct row_cursor {
    const uint8_t *at;
    uint32_t next, left; /* the smallest possible next column; entries not yet read */
} row_cursor;

typedef struct merge_run {
    const packed_rows *rows;
    row_cursor *cursors; /* [n] */
} merge_run;

/* The next entry's column; UINT32_MAX at the end. */
static inline uint32_t cursor_read(row_cursor *c, row_kind kind, float *value) {
    if (c->left == 0) return UINT32_MAX;
    uint32_t gap;
    c->at = row_get(kind, c->at, &gap, value);
    const uint32_t column = c->next + gap;
    c->next = column + 1;
    c->left--;
    return column;
}

/* c_ji of row j for the columns i < j of a panel. */
static void take_below(void *context, size_t row, size_t first, size_t last, transpose_slice *to) {
    const merge_run *run = context;
    const row_kind kind = run->rows->kind;
    const size_t end = last < row ? last : row;
    row_cursor c = run->cursors[row];
    (void)first; /* columns before it have been read */
    for (;;) {
        row_cursor ahead = c;
        float value = 0;
        const uint32_t column = cursor_read(&ahead, kind, &value);
        if (column >= end) break;
        transpose_push(to, column, (uint32_t)row, value);
        c = ahead;
    }
    run->cursors[row] = c;
}

/* Row i above the diagonal: c_ij + c_ji; returns the number of entries. */
static size_t merge_row(const merge_run *run, const transpose *below, size_t i, uint32_t *indices,
                        float *sums) {
    const row_kind kind = run->rows->kind;
    row_cursor c = run->cursors[i];
    size_t q = below->start[i - below->first], length = 0;
    const size_t q_end = below->start[i - below->first + 1];
    float value = 0;
    uint32_t own = cursor_read(&c, kind, &value);
    if (own == i) own = cursor_read(&c, kind, &value); /* F_ii = 0: elements are planar */
    while (own != UINT32_MAX || q < q_end) {
        const uint32_t other = q < q_end ? below->rows[q] : UINT32_MAX, j = own < other ? own : other;
        float sum = 0;
        if (other == j) sum += below->values[q++];
        if (own == j) {
            sum += value;
            own = cursor_read(&c, kind, &value);
        }
        indices[length] = j;
        sums[length++] = sum;
    }
    return length;
}

/* Room for the rows of a panel before they are copied to their place. */
typedef struct merge_room {
    size_t *start, *length; /* [width] */
    uint32_t *indices;
    float *data;
    size_t row_capacity, entry_capacity;
} merge_room;

static void room_free(merge_room *room) {
    free(room->start);
    free(room->length);
    free(room->indices);
    free(room->data);
}

static lam_status room_reserve(merge_room *room, size_t n_rows, size_t n_entries, lam_error *error) {
    if (n_rows > room->row_capacity) {
        free(room->start);
        free(room->length);
        room->row_capacity = 0;
        room->start = memory_allocate(n_rows, sizeof *room->start, "form factors", error);
        room->length = memory_allocate(n_rows, sizeof *room->length, "form factors", error);
        if (room->start == NULL || room->length == NULL) return LAM_ERR_MEMORY;
        room->row_capacity = n_rows;
    }
    if (n_entries > room->entry_capacity) {
        free(room->indices);
        free(room->data);
        room->entry_capacity = 0;
        n_entries += n_entries / 4;
        room->indices = memory_allocate(n_entries, sizeof *room->indices, "form factors", error);
        room->data = memory_allocate(n_entries, sizeof *room->data, "form factors", error);
        if (room->indices == NULL || room->data == NULL) return LAM_ERR_MEMORY;
        room->entry_capacity = n_entries;
    }
    return LAM_OK;
}

/* Rows first ... last-1 of g, after all before them. */
static lam_status merge_panel(merge_run *run, transpose *below, merge_room *room, size_t first, size_t last,
                              size_t rays, const double *area, csr *g, lam_error *error) {
    lam_status status = LAM_OK;
    size_t n_entries = 0;
    TRY(transpose_collect(below, first + 1, g->n, first, last, take_below, run, error));
    TRY(room_reserve(room, last - first, 0, error));
    for (size_t i = first; i < last; i++) {
        room->start[i - first] = n_entries;
        n_entries += below->start[i - first + 1] - below->start[i - first] + run->cursors[i].left;
    }
    TRY(room_reserve(room, 0, n_entries > 0 ? n_entries : 1, error)); /* rows without entries point there */
#pragma omp parallel for schedule(dynamic, 16)
    for (size_t i = first; i < last; i++) {
        uint32_t *indices = room->indices + room->start[i - first];
        float *data = room->data + room->start[i - first];
        const size_t length = merge_row(run, below, i, indices, data);
        const double a = area[i];
        for (size_t p = 0; p < length; p++) {
            const double b = area[indices[p]];
            data[p] = (float)((double)data[p] / (double)rays * (a * b / (a + b)));
        }
        room->length[i - first] = length;
    }
    for (size_t i = first; i < last; i++) g->indptr[i + 1] = g->indptr[i] + room->length[i - first];
#pragma omp parallel for schedule(static)
    for (size_t i = first; i < last; i++) {
        const size_t from = room->start[i - first], length = room->length[i - first];
        if (length == 0) continue; /* the arrays may be NULL */
        memcpy(g->indices + g->indptr[i], room->indices + from, length * sizeof *g->indices);
        memcpy(g->data + g->indptr[i], room->data + from, length * sizeof *g->data);
    }
done:
    return status;
}

lam_status upper_merge(const packed_rows *rows, size_t rays, const double *area, const large_place *place,
                       csr *upper, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = rows->n;
    merge_run run = {.rows = rows};
    transpose below = {0};
    merge_room room = {0};
    csr g = {.n = n, .place = place};
    size_t n_found = 0;
    run.cursors = memory_allocate(n, sizeof *run.cursors, "form factors", error);
    g.indptr = memory_allocate(n + 1, sizeof *g.indptr, "form factors", error);
    if (run.cursors == NULL || g.indptr == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) {
        run.cursors[i] = (row_cursor){rows->rows[i].bytes, 0, rows->rows[i].n_entries};
        n_found += rows->rows[i].n_entries;
    }
    TRY(csr_reserve(&g, n_found, error)); /* an upper bound */
    const size_t panel = panel_entries(n_found);
    for (size_t first = 0, last; first < n; first = last) {
        size_t n_entries = 0;
        for (last = first; last < n && n_entries < panel; last++) n_entries += rows->rows[last].n_entries;
        TRY(merge_panel(&run, &below, &room, first, last, rays, area, &g, error));
    }
    TRY(csr_reserve(&g, g.indptr[n], error));
    *upper = g;
    g = (csr){0};
done:
    free(run.cursors);
    transpose_free(&below);
    room_free(&room);
    csr_free(&g);
    return status;
}

typedef struct expand_run {
    const csr *g;
    uint64_t *ends; /* [n], the end of a row's entries that no panel has taken yet */
} expand_run;

/* The entries of a row in the columns of a panel; panels come from the last to the first. */
static void take_last(void *context, size_t row, size_t first, size_t last, transpose_slice *to) {
    const expand_run *run = context;
    const csr *g = run->g;
    const uint64_t end = run->ends[row];
    uint64_t begin = end;
    (void)last; /* columns from there on have been taken */
    while (begin > g->indptr[row] && g->indices[begin - 1] >= first) begin--;
    for (uint64_t p = begin; p < end; p++) transpose_push(to, g->indices[p], (uint32_t)row, g->data[p]);
    run->ends[row] = begin;
}

/* Adds the number of entries of each column to counts. */
static lam_status count_columns(const csr *g, uint64_t *counts, lam_error *error) {
    const size_t n = g->n;
    uint32_t *of_slices = memory_allocate(n, TRANSPOSE_SLICES * sizeof *of_slices, "form factors", error);
    if (of_slices == NULL) return LAM_ERR_MEMORY;
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t s = 0; s < TRANSPOSE_SLICES; s++) {
        uint32_t *count = of_slices + s * n;
        const uint64_t begin = g->indptr[n] * s / TRANSPOSE_SLICES,
                       end = g->indptr[n] * (s + 1) / TRANSPOSE_SLICES;
        for (uint64_t p = begin; p < end; p++) count[g->indices[p]]++;
    }
    for (size_t s = 0; s < TRANSPOSE_SLICES; s++)
        for (size_t j = 0; j < n; j++) counts[j] += of_slices[s * n + j];
    free(of_slices);
    return LAM_OK;
}

lam_status upper_expand(csr *upper, const double *area, double *row_sums, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = upper->n, nnz = upper->indptr[n];
    expand_run run = {.g = upper};
    transpose below = {0};
    merge_room room = {0};
    uint64_t *indptr = memory_allocate(n + 1, sizeof *indptr, "form factors", error);
    run.ends = memory_allocate(n, sizeof *run.ends, "form factors", error);
    if (indptr == NULL || run.ends == NULL) TRY(LAM_ERR_MEMORY);
    TRY(count_columns(upper, indptr + 1, error));
    for (size_t i = 0; i < n; i++) {
        indptr[i + 1] += indptr[i] + upper->indptr[i + 1] - upper->indptr[i];
        run.ends[i] = upper->indptr[i + 1];
    }
    TRY(csr_reserve(upper, 2 * nnz, error));
    uint32_t *const indices = upper->indices;
    float *const data = upper->data;

    /* Row i of F begins at or behind the begin of row i of the triangle: from the last row to the first,
     * entries are read before they are overwritten. */
    const size_t panel = panel_entries(2 * nnz);
    for (size_t last = n, first; last > 0; last = first) {
        first = last - 1;
        while (first > 0 && indptr[last] - indptr[first - 1] <= panel) first--;
        TRY(transpose_collect(&below, 0, last, first, last, take_last, &run, error));
        const uint64_t begin = upper->indptr[first], count = upper->indptr[last] - begin;
        TRY(room_reserve(&room, 0, count, error));
        if (count > 0) memcpy(room.indices, indices + begin, count * sizeof *indices);
        if (count > 0) memcpy(room.data, data + begin, count * sizeof *data);
#pragma omp parallel for schedule(dynamic, 16)
        for (size_t i = first; i < last; i++) {
            const double a = area[i];
            double sum = 0;
            uint64_t p = indptr[i];
            for (size_t q = below.start[i - first]; q < below.start[i - first + 1]; q++, p++) {
                indices[p] = below.rows[q];
                data[p] = upper_factor(below.values[q], a);
                sum += (double)data[p];
            }
            for (uint64_t q = upper->indptr[i] - begin; q < upper->indptr[i + 1] - begin; q++, p++) {
                indices[p] = room.indices[q];
                data[p] = upper_factor(room.data[q], a);
                sum += (double)data[p];
            }
            row_sums[i] = sum;
        }
    }
    free(upper->indptr);
    upper->indptr = indptr;
    indptr = NULL;
done:
    free(indptr);
    free(run.ends);
    transpose_free(&below);
    room_free(&room);
    return status;
}

/* The g whose two quotients by upper_factor are exactly F_ij and F_ji. Two roundings leave it within two
 * floats of A_i F_ij. */
static float exchange_of(float forward, float backward, double area_i, double area_j) {
    const float middle = (float)((double)forward * area_i);
    float up = middle, down = middle;
    for (int step = 0; step < 3; step++) {
        if (upper_factor(up, area_i) == forward && upper_factor(up, area_j) == backward) return up;
        if (upper_factor(down, area_i) == forward && upper_factor(down, area_j) == backward) return down;
        up = nextafterf(up, INFINITY);
        down = nextafterf(down, 0);
    }
    return middle;
}

lam_status upper_gather(csr *F, const double *area, lam_error *error) {
    const size_t n = F->n;
    uint64_t used = 0, p = 0;
    /* mirror[j]: the next entry of row j below the diagonal; the rows above reach these entries in their
     * order. */
    uint64_t *mirror = memory_allocate(n, sizeof *mirror, "form factors", error);
    if (mirror == NULL) return LAM_ERR_MEMORY;
    memcpy(mirror, F->indptr, n * sizeof *mirror);
    for (size_t i = 0; i < n; i++) {
        const uint64_t end = F->indptr[i + 1];
        for (; p < end; p++) {
            const uint32_t j = F->indices[p];
            if (j <= i) continue;
            const uint64_t q = mirror[j]++;
            const float backward = F->indices[q] == i ? F->data[q] : -1; /* -1: F_ji is missing */
            F->data[used] = exchange_of(F->data[p], backward, area[i], area[j]);
            F->indices[used++] = j;
        }
        F->indptr[i + 1] = used;
    }
    free(mirror);
    return csr_reserve(F, used, error);
}
