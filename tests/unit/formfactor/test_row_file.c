/* Rows as they are found: packed, kept in a scratch folder, continued. */
#include "solver/formfactor/rows/row_file.h"
#include "solver/formfactor/source.h"
#include "support/box.h"
#include "support/found.h"
#include "support/scene.h"
#include "support/square.h"
#include "support/suite.h"

#include <fcntl.h>
#include <omp.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

START_TEST(packed_rows_come_back) {
    static const uint32_t gaps[] = {0, 1, 62, 63, 64, 8190, 8191, 8192, 1 << 20, 0x7FFFFFF0};
    static const float counts[] = {1, 2, 3, 128, 129, 130, 16385, 1 << 24};
    const row_kind kind = _i == 0 ? ROW_COUNTS : ROW_WEIGHTS;
    uint8_t bytes[sizeof gaps / sizeof *gaps * sizeof counts / sizeof *counts * ROW_ENTRY_MOST], *to = bytes;
    uint32_t entries = 0;
    uint64_t columns = 0;
    for (size_t g = 0; g + 1 < sizeof gaps / sizeof *gaps; g++) {
        for (size_t c = 0; c < sizeof counts / sizeof *counts; c++, entries++) {
            uint8_t *const from = to;
            to = row_put(kind, to, gaps[g], kind == ROW_COUNTS ? counts[c] : 1 / counts[c]);
            ck_assert_int_le(to - from, ROW_ENTRY_MOST);
            columns += gaps[g] + 1;
        }
    }
    to = row_put(kind, to, gaps[9], 1);
    entries++;
    columns += (uint64_t)gaps[9] + 1;
    const uint8_t *at = bytes;
    for (uint32_t e = 0; e < entries; e++) {
        uint32_t gap;
        float value;
        const size_t c = e % (sizeof counts / sizeof *counts);
        at = row_get(kind, at, &gap, &value);
        ck_assert_uint_eq(gap, gaps[e / (sizeof counts / sizeof *counts)]);
        ck_assert(value == (e == entries - 1 ? 1 : kind == ROW_COUNTS ? counts[c] : 1 / counts[c]));
    }
    ck_assert_ptr_eq(at, to);
    const packed_row row = {bytes, (uint32_t)(to - bytes), entries};
    ck_assert(row_check(kind, &row, columns));
    ck_assert(!row_check(kind, &row, columns - 1));
    packed_row cut = row;
    for (cut.n_bytes = 0; cut.n_bytes < row.n_bytes; cut.n_bytes++)
        ck_assert(!row_check(kind, &cut, columns));
    cut = row;
    cut.n_entries--;
    ck_assert(!row_check(kind, &cut, columns));
}
END_TEST

enum { BLOCK_ROWS = 8, FILE_ROWS = 43 };

static row_file_contents contents_of(const square *s) {
    return (row_file_contents){.geometry = "0123456789abcdef0123456789abcdef",
                               .recipe = {.source = &source_rays, .rays = 512, .seed = 9},
                               .n = s->n,
                               .block_rows = BLOCK_ROWS,
                               .kind = s->found.kind};
}

/* One open row file with all that it takes. */
typedef struct opened {
    scratch *folder;
    row_file *file;
    uint32_t order[FILE_ROWS];
    double leaving[FILE_ROWS], absorbed[FILE_ROWS];
    lam_error error;
} opened;

static lam_status open_rows(opened *o, const char *folder, const row_file_contents *contents) {
    *o = (opened){.folder = NULL};
    for (uint32_t p = 0; p < FILE_ROWS; p++) o->order[p] = (p * 5 + 2) % FILE_ROWS;
    for (size_t i = 0; i < FILE_ROWS; i++) {
        o->leaving[i] = (double)i / 512;
        o->absorbed[i] = (double)(FILE_ROWS - i) / 512;
    }
    ck_assert_msg(scratch_open(folder, &o->folder, &o->error) == LAM_OK, "%s", o->error.message);
    return row_file_open(o->folder, "a.rows", contents, o->order, &o->file, &o->error);
}

static void close_rows(opened *o) {
    row_file_close(o->file);
    scratch_close(o->folder, false);
}

static void append_missing(opened *o, const square *s) {
    const size_t n_blocks = (FILE_ROWS + BLOCK_ROWS - 1) / BLOCK_ROWS;
    for (size_t k = 0; k < n_blocks; k++) {
        const size_t b = (k * 5 + 3) % n_blocks; /* not in their order */
        if (!row_file_has(o->file, b))
            ck_assert_int_eq(row_file_append(o->file, b, s->found.rows, o->leaving, o->absorbed, &o->error),
                             LAM_OK);
    }
}

static void check_all(opened *o, const square *s) {
    packed_rows back = {.n = s->n, .kind = s->found.kind, .rows = calloc(s->n, sizeof *back.rows)};
    double leaving[FILE_ROWS], absorbed[FILE_ROWS];
    ck_assert_ptr_nonnull(back.rows);
    ck_assert_msg(row_file_map(o->file, &back, leaving, absorbed, &o->error) == LAM_OK, "%s",
                  o->error.message);
    csr is = found_unpack(&back), wanted = found_unpack(&s->found);
    same_rows(&is, &wanted);
    ck_assert_mem_eq(leaving, o->leaving, sizeof leaving);
    ck_assert_mem_eq(absorbed, o->absorbed, sizeof absorbed);
    csr_free(&is);
    csr_free(&wanted);
    packed_rows_free(&back);
}

static size_t file_size(const char *path) {
    struct stat about;
    ck_assert_int_eq(stat(path, &about), 0);
    return (size_t)about.st_size;
}

static void read_whole(const char *path, uint8_t *bytes, size_t size) {
    FILE *stream = fopen(path, "rb");
    ck_assert_ptr_nonnull(stream);
    ck_assert_uint_eq(fread(bytes, 1, size, stream), size);
    fclose(stream);
}

static void write_whole(const char *path, const uint8_t *bytes, size_t size) {
    FILE *stream = fopen(path, "wb");
    ck_assert_ptr_nonnull(stream);
    ck_assert_uint_eq(fwrite(bytes, 1, size, stream), size);
    ck_assert_int_eq(fclose(stream), 0);
}

/* A file of all blocks; its bytes (freed by the caller) and where its last block begins. */
static uint8_t *whole_file(const char *folder, const char *path, const square *s, size_t *size,
                           size_t *last) {
    const row_file_contents contents = contents_of(s);
    opened o;
    ck_assert_msg(open_rows(&o, folder, &contents) == LAM_OK, "%s", o.error.message);
    ck_assert_uint_eq(row_file_kept(o.file), 0);
    const size_t n_blocks = (FILE_ROWS + BLOCK_ROWS - 1) / BLOCK_ROWS;
    for (size_t b = 0; b < n_blocks; b++) {
        *last = file_size(path);
        ck_assert_int_eq(row_file_append(o.file, b, s->found.rows, o.leaving, o.absorbed, &o.error), LAM_OK);
    }
    check_all(&o, s);
    close_rows(&o);
    *size = file_size(path);
    uint8_t *bytes = malloc(*size);
    ck_assert_ptr_nonnull(bytes);
    read_whole(path, bytes, *size);
    return bytes;
}

/* Cut anywhere: what is whole is there, the rest is made again, and all rows are right. */
START_TEST(torn_files_keep_whole_blocks) {
    char folder[64], path[128];
    folder_make(folder);
    snprintf(path, sizeof path, "%s/a.rows", folder);
    square s = square_make(FILE_ROWS, _i == 0 ? ROW_COUNTS : ROW_WEIGHTS, 7);
    const row_file_contents contents = contents_of(&s);
    size_t size, last, kept_most = 0;
    uint8_t *bytes = whole_file(folder, path, &s, &size, &last);
    for (size_t length = 0; length <= size; length += length >= last ? 1 : 61) {
        opened o;
        write_whole(path, bytes, length);
        ck_assert_msg(open_rows(&o, folder, &contents) == LAM_OK, "%s", o.error.message);
        const size_t kept = row_file_kept(o.file);
        ck_assert_uint_ge(kept, kept_most);
        kept_most = kept;
        if (length >= last)
            ck_assert_uint_eq(kept, length == size ? FILE_ROWS : FILE_ROWS - FILE_ROWS % BLOCK_ROWS);
        append_missing(&o, &s);
        check_all(&o, &s);
        close_rows(&o);
    }
    ck_assert_uint_eq(kept_most, FILE_ROWS);
    free(bytes);
    square_free(&s);
    folder_remove(folder);
}
END_TEST

/* A changed bit anywhere: the file is refused, or the block is missing; never a wrong row. */
START_TEST(flipped_bits_are_found) {
    char folder[64], path[128];
    folder_make(folder);
    snprintf(path, sizeof path, "%s/a.rows", folder);
    square s = square_make(FILE_ROWS, ROW_COUNTS, 8);
    const row_file_contents contents = contents_of(&s);
    size_t size, last, refused = 0, missing = 0;
    uint8_t *bytes = whole_file(folder, path, &s, &size, &last);
    for (size_t at = 0; at < size; at += 7) {
        opened o;
        bytes[at] ^= (uint8_t)(1u << at % 8);
        write_whole(path, bytes, size);
        const lam_status status = open_rows(&o, folder, &contents);
        if (status != LAM_OK) {
            ck_assert_int_eq(status, LAM_ERR_ARGUMENT);
            refused++;
        } else {
            ck_assert_uint_lt(row_file_kept(o.file), FILE_ROWS);
            missing++;
            append_missing(&o, &s);
            check_all(&o, &s);
        }
        close_rows(&o);
        bytes[at] ^= (uint8_t)(1u << at % 8);
    }
    ck_assert_uint_gt(refused, 10);
    ck_assert_uint_gt(missing, 100);
    free(bytes);
    square_free(&s);
    folder_remove(folder);
}
END_TEST

START_TEST(foreign_files_are_refused_and_left) {
    char folder[64], path[128];
    folder_make(folder);
    snprintf(path, sizeof path, "%s/a.rows", folder);
    square s = square_make(FILE_ROWS, ROW_COUNTS, 9);
    const row_file_contents contents = contents_of(&s);
    size_t size, last;
    uint8_t *bytes = whole_file(folder, path, &s, &size, &last), *after = malloc(size);
    ck_assert_ptr_nonnull(after);
    row_file_contents other[5] = {contents, contents, contents, contents, contents};
    other[0].geometry[5] = '0';
    other[1].recipe.rays++;
    other[2].recipe.seed++;
    other[3].block_rows++;
    other[4].kind = ROW_WEIGHTS;
    for (size_t k = 0; k < 5; k++) {
        opened o;
        ck_assert_int_eq(open_rows(&o, folder, &other[k]), LAM_ERR_ARGUMENT);
        ck_assert_ptr_nonnull(strstr(o.error.message, path));
        ck_assert_ptr_nonnull(strstr(o.error.message, k == 0 ? "another scene" : "other options"));
        close_rows(&o);
    }
    ck_assert_uint_eq(file_size(path), size);
    read_whole(path, after, size);
    ck_assert_mem_eq(bytes, after, size);
    opened o;
    write_whole(path, (const uint8_t *)"my own notes", 12);
    ck_assert_int_eq(open_rows(&o, folder, &contents), LAM_ERR_ARGUMENT);
    ck_assert_uint_eq(file_size(path), 12);
    close_rows(&o);
    free(bytes);
    free(after);
    square_free(&s);
    folder_remove(folder);
}
END_TEST

START_TEST(a_folder_belongs_to_one_run) {
    char folder[64];
    folder_make(folder);
    scratch *one = NULL, *two = NULL;
    lam_error error = {0};
    ck_assert_int_eq(scratch_open(folder, &one, &error), LAM_OK);
    ck_assert_int_eq(scratch_open(folder, &two, &error), LAM_ERR_IO);
    ck_assert_ptr_nonnull(strstr(error.message, folder));
    ck_assert_ptr_null(two);
    scratch_close(one, false);
    ck_assert_int_eq(scratch_open(folder, &two, &error), LAM_OK);
    scratch_close(two, true);
    ck_assert_int_eq(access(folder, F_OK), 0); /* it was there before */
    folder_remove(folder);
}
END_TEST

/* Says stop after some questions. */
static bool stop_later(void *context) {
    int *left = context;
    return --*left < 0;
}

static const recipe recipes[] = {{.source = &source_rays, .rays = 1 << 15, .seed = 3},
                                 {.source = &source_hemicube, .resolution = 100}};

/* Stopped again and again, with another number of threads each time, on a full disk in between: the same bits
 * as in memory and undisturbed. */
START_TEST(continued_runs_have_the_same_bits) {
    char folder[64];
    folder_make(folder);
    const double size[3] = {1, 2, 1};
    mesh m = box_mesh(size, 4, .5f);
    uint32_t order[96];
    lam_error error = {0};
    form_factors plain = {0}, kept = {0};
    int left = 0, runs = 0;
    const progress stopping = {.cancelled = stop_later, .context = &left};
    form_factor_options how = {.recipe = recipes[_i]};
    for (uint32_t i = 0; i < 96; i++) order[i] = (i * 5 + 1) % 96;
    ck_assert_msg(form_factors_make(&m, order, &how, &plain, &error) == LAM_OK, "%s", error.message);
    how.progress = &stopping;
    how.scratch_name = "x.rows";
    struct rlimit limit;
    ck_assert_int_eq(getrlimit(RLIMIT_FSIZE, &limit), 0);
    const rlim_t soft = limit.rlim_cur;
    signal(SIGXFSZ, SIG_IGN);
    lam_status status = LAM_ERR_CANCELLED;
    for (; status != LAM_OK && runs < 20; runs++) {
        /* The disk is full in the second run: less than a block of 32 rows fits besides. */
        limit.rlim_cur = runs == 1 ? 3000 : soft;
        ck_assert_int_eq(setrlimit(RLIMIT_FSIZE, &limit), 0);
        omp_set_num_threads(1 + runs % 3);
        left = runs == 0 ? 1 : runs == 1 ? 1000 : 5;
        ck_assert_msg(scratch_open(folder, &how.scratch, &error) == LAM_OK, "%s", error.message);
        status = form_factors_make(&m, order, &how, &kept, &error);
        ck_assert_msg(status == LAM_OK || status == (runs == 1 ? LAM_ERR_IO : LAM_ERR_CANCELLED),
                      "run %d: %s", runs, error.message);
        scratch_close(how.scratch, status == LAM_OK);
    }
    ck_assert_int_eq(status, LAM_OK);
    ck_assert_int_ge(runs, 4);
    ck_assert_uint_gt(kept.rows_kept, 0);
    same_form_factors(&plain, &kept);
    char path[128];
    snprintf(path, sizeof path, "%s/x.rows", folder);
    ck_assert_int_ne(access(path, F_OK), 0); /* removed after success */
    form_factors_free(&plain);
    form_factors_free(&kept);
    mesh_free(&m);
    folder_remove(folder);
}
END_TEST

/* Pairs are found, then looked at: either is read back where a run before has left it. Without a sanitizer so
 * few are found before a block of them is written; how many were kept is not asked. */
START_TEST(continued_pairs_have_the_same_bits) {
    char folder[64];
    folder_make(folder);
    const double size[3] = {1, 2, 1};
    mesh m = box_mesh(size, 12, .5f);
    uint32_t *order = malloc(m.n * sizeof *order);
    lam_error error = {0};
    form_factors plain = {0}, kept = {0};
    int left = 0, runs = 0;
    const progress stopping = {.cancelled = stop_later, .context = &left};
    form_factor_options how = {.recipe = {.source = &source_pairs, .rays = 64, .accuracy = 1e-3, .seed = 3}};
    for (uint32_t i = 0; i < m.n; i++) order[i] = (i * 5 + 1) % (uint32_t)m.n;
    ck_assert_msg(form_factors_make(&m, order, &how, &plain, &error) == LAM_OK, "%s", error.message);
    how.progress = &stopping;
    how.scratch_name = "x.rows";
    lam_status status = LAM_ERR_CANCELLED;
    for (; status != LAM_OK && runs < 30; runs++) {
        left = 1 + (1 << runs) / 2;
        ck_assert_msg(scratch_open(folder, &how.scratch, &error) == LAM_OK, "%s", error.message);
        status = form_factors_make(&m, order, &how, &kept, &error);
        ck_assert_msg(status == LAM_OK || status == LAM_ERR_CANCELLED, "run %d: %s", runs, error.message);
        scratch_close(how.scratch, status == LAM_OK);
    }
    ck_assert_int_eq(status, LAM_OK);
    ck_assert_int_ge(runs, 2);
    same_form_factors(&plain, &kept);
    form_factors_free(&plain);
    form_factors_free(&kept);
    mesh_free(&m);
    free(order);
    folder_remove(folder);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("rows");
    TCase *cases = tcase_create("rows");
    tcase_set_timeout(cases, 300);
    tcase_add_loop_test(cases, packed_rows_come_back, 0, 2);
    tcase_add_loop_test(cases, torn_files_keep_whole_blocks, 0, 2);
    tcase_add_test(cases, flipped_bits_are_found);
    tcase_add_test(cases, foreign_files_are_refused_and_left);
    tcase_add_test(cases, a_folder_belongs_to_one_run);
    tcase_add_loop_test(cases, continued_runs_have_the_same_bits, 0, 2);
    tcase_add_test(cases, continued_pairs_have_the_same_bits);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
