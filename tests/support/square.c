#include "support/square.h"

#include "solver/base/random.h"

square square_make(size_t n, row_kind kind, uint64_t seed) {
    square s = {.n = n,
                .values = calloc(n * n, sizeof(float)),
                .area = malloc(n * sizeof(double)),
                .bytes = malloc(n * n * ROW_ENTRY_MOST)};
    ck_assert(s.values != NULL && s.area != NULL && s.bytes != NULL);
    s.found = (packed_rows){.n = n, .kind = kind, .rows = calloc(n, sizeof *s.found.rows)};
    ck_assert_ptr_nonnull(s.found.rows);
    uint8_t *to = s.bytes;
    for (size_t i = 0; i < n; i++) {
        uint8_t *const from = to;
        uint32_t next = 0;
        s.area[i] = .1 + (double)((random_lcg(&seed) >> 33) % 1000);
        for (size_t j = 0; j < n; j++) {
            /* Some rows are empty, some columns are full. */
            if (i == j || i % 7 == 3 || ((random_lcg(&seed) >> 33) % 4 != 0 && j % 11 != 0)) continue;
            const uint64_t count = 1 + (random_lcg(&seed) >> 33) % 5;
            s.values[i * n + j] = kind == ROW_COUNTS ? (float)count : (float)count / 1e3f;
            to = row_put(kind, to, (uint32_t)j - next, s.values[i * n + j]);
            next = (uint32_t)j + 1;
            s.found.rows[i].n_entries++;
        }
        s.found.rows[i].bytes = from;
        s.found.rows[i].n_bytes = (uint32_t)(to - from);
    }
    return s;
}

void square_free(square *s) {
    free(s->values);
    free(s->area);
    free(s->bytes);
    packed_rows_free(&s->found);
}

void same_rows(const csr *a, const csr *b) {
    ck_assert_uint_eq(a->n, b->n);
    ck_assert_mem_eq(a->indptr, b->indptr, (a->n + 1) * sizeof *a->indptr);
    ck_assert_mem_eq(a->indices, b->indices, a->indptr[a->n] * sizeof *a->indices);
    ck_assert_mem_eq(a->data, b->data, a->indptr[a->n] * sizeof *a->data);
}

void same_form_factors(const form_factors *a, const form_factors *b) {
    same_rows(&a->F, &b->F);
    ck_assert_mem_eq(a->row_sums, b->row_sums, a->F.n * sizeof *a->row_sums);
    ck_assert_mem_eq(a->leaving, b->leaving, a->F.n * sizeof *a->leaving);
    ck_assert_mem_eq(a->absorbed, b->absorbed, a->F.n * sizeof *a->absorbed);
}
