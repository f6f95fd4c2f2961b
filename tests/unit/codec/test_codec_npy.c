/* NPY in and out: hostile headers, layouts, half precision; and which encoding an Accept header asks for. */
#include "solver/base/half.h"
#include "solver/codec/media.h"
#include "solver/codec/npy.h"
#include "solver/codec/request.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>

enum { N = 3 };

static const codec_scene colour = {.n = N, .n_channels = 2, .max_batch = 4, .max_bytes = 4096};

/* As status_of in test_codec_json.c: in memory of its very size. */
static unsigned status_of(const char *bytes, size_t length, radiosity_request *request) {
    radiosity_request own = {0};
    problem why;
    char *exact = malloc(length > 0 ? length : 1);
    ck_assert_ptr_nonnull(exact);
    memcpy(exact, bytes, length);
    bool good = codec_read_npy(&colour, exact, length, request == NULL ? &own : request, &why);
    ck_assert_int_eq(good, why.status == 0);
    radiosity_request_free(&own);
    free(exact);
    return why.status;
}

static buffer make(npy_type type, size_t rank, const size_t *shape, size_t count) {
    buffer b = {0};
    float values[64];
    for (size_t i = 0; i < count; i++) values[i] = (float)i + 1;
    ck_assert(npy_write_header(&b, type, rank, shape) && npy_write_values(&b, type, values, count));
    return b;
}

/* The reported rounding is that of the array itself, the largest of all values written. */
START_TEST(doubles_tell_their_rounding) {
    const double values[] = {1, 1.0 / 3, -2e-3, 700.1, 0};
    enum { COUNT = sizeof values / sizeof *values };
    double rounding = 0;
    buffer wide = {0}, single = {0}, half = {0};
    ck_assert(npy_write_doubles(&wide, NPY_F8, values, COUNT, &rounding));
    ck_assert_uint_eq(wide.length, sizeof values);
    ck_assert_mem_eq(wide.bytes, values, sizeof values);
    ck_assert(rounding == 0);
    ck_assert(npy_write_doubles(&single, NPY_F4, values, COUNT, &rounding));
    double worst = 0;
    for (size_t i = 0; i < COUNT; i++) {
        float kept;
        memcpy(&kept, single.bytes + i * sizeof kept, sizeof kept);
        ck_assert(kept == (float)values[i]);
        worst = fmax(worst, fabs((double)kept - values[i]));
    }
    ck_assert(worst > 0 && rounding == worst);
    ck_assert(npy_write_doubles(&half, NPY_F2, values, COUNT, &rounding));
    ck_assert_uint_eq(half.length, 2 * COUNT);
    ck_assert_double_eq_tol(rounding, .1, .001); /* 700.1 is 700 there, half a unit being .25 */
    const double before = rounding;
    ck_assert(npy_write_doubles(&half, NPY_F4, values, COUNT, &rounding) && rounding == before);
    buffer_free(&wide);
    buffer_free(&single);
    buffer_free(&half);
}
END_TEST

START_TEST(written_arrays_are_read) {
    for (int type = NPY_F4; type <= NPY_F8; type++) {
        static const struct {
            size_t rank, shape[3], n_rhs;
            bool batch;
        } cases[] = {
            {1, {N}, 1, false}, {2, {2, N}, 1, false}, {3, {1, 2, N}, 1, true}, {3, {4, 2, N}, 4, true}};
        for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
            size_t count = 1;
            for (size_t d = 0; d < cases[i].rank; d++) count *= cases[i].shape[d];
            buffer b = make((npy_type)type, cases[i].rank, cases[i].shape, count);
            radiosity_request request = {0};
            ck_assert_uint_eq(status_of(b.bytes, b.length, &request), 0);
            ck_assert_uint_eq(request.n_rhs, cases[i].n_rhs);
            ck_assert_int_eq(request.batch, cases[i].batch);
            for (size_t v = 0; v < request.n_rhs * 2 * N; v++)
                ck_assert(request.E[v] == (float)(cases[i].rank == 1 ? v % N : v) + 1);
            radiosity_request_free(&request);
            buffer_free(&b);
        }
    }
}
END_TEST

/* An array of [m][2][N], or of fewer axes, in Fortran order, with the value at `bad` (its number in C order,
 * or SIZE_MAX) replaced. */
static buffer make_fortran(bool wide, size_t rank, const size_t *shape, size_t bad, double value) {
    static const char *const texts[] = {"(%zu,)", "(%zu, %zu)", "(%zu, %zu, %zu)"};
    char given[64], header[160];
    snprintf(given, sizeof given, texts[rank - 1], shape[0], shape[1], shape[2]);
    const size_t length =
        (size_t)snprintf(header, sizeof header, "{'descr': '%s', 'fortran_order': True, 'shape': %s}\n",
                         wide ? "<f8" : "<f4", given);
    const unsigned char head[10] = {0x93, 'N', 'U', 'M', 'P', 'Y', 1, 0, (unsigned char)length, 0};
    size_t dims[3] = {1, 1, 1};
    for (size_t d = 0; d < rank; d++) dims[3 - rank + d] = shape[d];
    buffer b = {0};
    ck_assert(buffer_append(&b, head, sizeof head) && buffer_append(&b, header, length));
    for (size_t i = 0; i < dims[2]; i++)
        for (size_t c = 0; c < dims[1]; c++)
            for (size_t v = 0; v < dims[0]; v++) {
                const size_t number = (v * dims[1] + c) * dims[2] + i;
                const double one = number == bad ? value : 1.0 / (double)(number + 1);
                const float narrow = (float)one;
                ck_assert(buffer_append(&b, wide ? (const void *)&one : &narrow,
                                        wide ? sizeof one : sizeof narrow));
            }
    return b;
}

/* The vectors are those of the same array in C order, of any shape, and more elements than are read at a
 * time. */
START_TEST(fortran_order_is_read) {
    enum { LONG = 100, M = 5 };
    const codec_scene scenes[] = {{.n = LONG, .n_channels = 2, .max_batch = M, .max_bytes = 1 << 20},
                                  {.n = LONG, .n_channels = 1, .max_batch = M, .max_bytes = 1 << 20}};
    static const struct {
        size_t scene, rank, shape[3], n_rhs, rows;
    } cases[] = {{0, 1, {LONG, 0, 0}, 1, 1}, {0, 2, {2, LONG, 0}, 1, 2}, {0, 3, {M, 2, LONG}, M, 2},
                 {0, 3, {1, 2, LONG}, 1, 2}, {1, 1, {LONG, 0, 0}, 1, 1}, {1, 2, {M, LONG, 0}, M, 1},
                 {1, 3, {M, 1, LONG}, M, 1}};
    for (int wide = 0; wide <= 1; wide++)
        for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
            const codec_scene *scene = &scenes[cases[i].scene];
            radiosity_request request = {0};
            problem why;
            buffer b = make_fortran(wide == 1, cases[i].rank, cases[i].shape, SIZE_MAX, 0);
            ck_assert_msg(codec_read_npy(scene, b.bytes, b.length, &request, &why), "%s", why.detail);
            ck_assert_uint_eq(request.n_rhs, cases[i].n_rhs);
            for (size_t v = 0; v < request.n_rhs; v++)
                for (size_t c = 0; c < scene->n_channels; c++)
                    for (size_t e = 0; e < LONG; e++) {
                        const size_t row = c < cases[i].rows ? c : 0,
                                     number = (v * cases[i].rows + row) * LONG + e;
                        ck_assert(request.E[(v * scene->n_channels + c) * LONG + e] ==
                                  (float)(1.0 / (double)(number + 1)));
                    }
            ck_assert(!codec_read_npy(scene, b.bytes, b.length - 1, &request, &why) && why.status == 422);
            radiosity_request_free(&request);
            buffer_free(&b);
        }
}
END_TEST

/* A value that is none is named by its number in C order, which is that of NumPy's flat index. */
START_TEST(fortran_order_names_values_as_c_order) {
    const size_t shape[] = {4, 2, N};
    for (size_t bad = 0; bad < 4 * 2 * N; bad++) {
        radiosity_request request = {0};
        problem why;
        char wanted[32];
        buffer b = make_fortran(true, 3, shape, bad, bad % 2 == 0 ? -1.0 : 1e39);
        ck_assert(!codec_read_npy(&colour, b.bytes, b.length, &request, &why));
        ck_assert_uint_eq(why.status, 422);
        snprintf(wanted, sizeof wanted, "value %zu is ", bad);
        ck_assert_msg(strstr(why.detail, wanted) != NULL, "%s", why.detail);
        radiosity_request_free(&request);
        buffer_free(&b);
    }
}
END_TEST

START_TEST(cut_arrays_are_refused) {
    buffer b = make(NPY_F4, 2, (size_t[]){2, N}, 2 * N);
    size_t data = b.length - 4 * 2 * N;
    for (size_t cut = 0; cut < b.length; cut++)
        ck_assert_uint_eq(status_of(b.bytes, cut, NULL), cut < data ? 400 : 422);
    buffer_free(&b);
}
END_TEST

/* Headers of other types, orders, shapes and lengths, around one value of a single element. */
START_TEST(foreign_headers_are_refused) {
    static const struct {
        unsigned status;
        const char *header;
    } cases[] = {
        {0, "{'descr': '<f4', 'fortran_order': False, 'shape': (1,), }\n"},
        {0, "{'shape': (1,), 'fortran_order': False, 'descr': '<f4'}\n"},
        {422, "{'descr': '>f4', 'fortran_order': False, 'shape': (1,), }\n"},
        {422, "{'descr': '<i4', 'fortran_order': False, 'shape': (1,), }\n"},
        {0, "{'descr': '<f4', 'fortran_order': True, 'shape': (1,), }\n"},
        {422, "{'descr': '=f4', 'fortran_order': False, 'shape': (1,), }\n"},
        {422, "{'descr': '<f4', 'fortran_order': True, 'shape': (2,), }\n"},
        {422, "{'descr': '<f4', 'fortran_order': False, 'shape': (2,), }\n"},
        {422, "{'descr': '<f4', 'fortran_order': False, 'shape': (), }\n"},
        {422, "{'descr': '<f4', 'fortran_order': False, 'shape': (1,1,1,1), }\n"},
        {400, "{'descr': '<f4', 'fortran_order': False, 'shape': (1), }\n"},
        {400, "{'descr': '<f4', 'fortran_order': False, 'shape': (-1,), }\n"},
        {400, "{'descr': '<f4', 'fortran_order': False, 'shape': (18446744073709551616,), }\n"},
        {422, "{'descr': '<f4', 'fortran_order': False, 'shape': (4294967296,4294967296,4), }\n"},
        {400, "{'descr': '<f4', 'fortran_order': False, 'shape': (1,\n"},
        {400, "{'descr': '<f4', 'fortran_order': False}\n"},
        {400, "{'fortran_order': False, 'shape': (1,), }\n"},
        {400, "{'descr': '<f4', 'shape': (1,), }\n"},
        {400, "{'descr"},
        {400, ""},
    };
    const codec_scene one = {
        .n = 1, .n_channels = 1, .max_batch = 4, .max_bytes = 4096, .source = "the file"};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const size_t length = strlen(cases[i].header);
        const unsigned char head[10] = {0x93, 'N', 'U', 'M', 'P', 'Y', 1, 0, (unsigned char)length, 0};
        const float value = 1;
        buffer b = {0};
        problem why;
        radiosity_request request = {0};
        ck_assert(buffer_append(&b, head, sizeof head) && buffer_append(&b, cases[i].header, length) &&
                  buffer_append(&b, &value, sizeof value));
        codec_read_npy(&one, b.bytes, b.length, &request, &why);
        ck_assert_msg(why.status == cases[i].status, "%u: %s", why.status, cases[i].header);
        if (why.status == 400)
            ck_assert_msg(strstr(why.detail, "the file is not NPY") != NULL, "%s", why.detail);
        radiosity_request_free(&request);
        buffer_free(&b);
    }
    ck_assert_uint_eq(status_of("PK", 2, NULL), 400);
    ck_assert_uint_eq(status_of("\x93NUMPY\x09\x00\x00\x00", 10, NULL), 400);
}
END_TEST

START_TEST(changed_arrays_never_do_harm) {
    size_t counts[3] = {0};
    for (int version = 1; version <= 2; version++) {
        buffer b = make(NPY_F8, 2, (size_t[]){2, N}, 2 * N);
        if (version == 2) {
            /* Two more bytes of length. */
            ck_assert(buffer_append(&b, "xx", 2));
            memmove(b.bytes + 12, b.bytes + 10, b.length - 12);
            b.bytes[6] = 2;
            b.bytes[10] = b.bytes[11] = 0;
        }
        for (size_t at = 0; at < b.length; at++)
            for (int value = 0; value < 256; value++) {
                char before = b.bytes[at];
                b.bytes[at] = (char)value;
                unsigned status = status_of(b.bytes, b.length, NULL);
                ck_assert(status == 0 || status == 400 || status == 422);
                counts[status == 0 ? 0 : status == 400 ? 1 : 2]++;
                b.bytes[at] = before;
            }
        buffer_free(&b);
    }
    for (int i = 0; i < 3; i++) ck_assert_uint_gt(counts[i], 1000);
}
END_TEST

static double half_value(uint16_t half) {
    int exponent = half >> 10 & 31;
    double magnitude = exponent == 0 ? ldexp(half & 1023, -24) : ldexp(1024 + (half & 1023), exponent - 25);
    return half & 0x8000 ? -magnitude : magnitude;
}

START_TEST(halves_are_rounded_to_nearest_even) {
    for (uint32_t half = 0; half < 0x7C00; half++) {
        float value = (float)half_value((uint16_t)half);
        ck_assert_uint_eq(half_of_float(value), half);
        ck_assert_uint_eq(half_of_float(-value), half | 0x8000);
        /* The one above the greatest half would be 65536: what is nearer to that is infinite. */
        double above = half + 1 < 0x7C00 ? half_value((uint16_t)(half + 1)) : 65536.0;
        float middle = (float)((value + above) / 2); /* exact: a half has 13 bits less */
        ck_assert_uint_eq(half_of_float(middle), half % 2 == 0 ? half : half + 1);
        ck_assert_uint_eq(half_of_float(nextafterf(middle, 0.0f)), half);
        ck_assert_uint_eq(half_of_float(nextafterf(middle, INFINITY)), half + 1);
    }
    ck_assert_uint_eq(half_of_float(1e30f), 0x7C00);
    ck_assert_uint_eq(half_of_float(-INFINITY), 0xFC00);
    ck_assert_uint_eq(half_of_float(NAN) & 0x7FFF, 0x7E00);
    ck_assert_uint_eq(half_of_float(1e-30f), 0);
}
END_TEST

START_TEST(headers_are_aligned) {
    for (size_t n = 1; n < 1000000000; n *= 7) {
        buffer b = {0};
        ck_assert(npy_write_header(&b, NPY_F2, 3, (size_t[]){n, 3, n}));
        ck_assert_uint_eq(b.length % 64, 0);
        ck_assert_int_eq(b.bytes[b.length - 1], '\n');
        ck_assert_uint_eq(b.length, 10 + (unsigned char)b.bytes[8] + 256u * (unsigned char)b.bytes[9]);
        buffer_free(&b);
    }
}
END_TEST

START_TEST(media_types) {
    static const struct {
        const char *accept;
        media_type type;
        npy_type npy;
    } cases[] = {
        {NULL, MEDIA_JSON, NPY_F4},
        {"", MEDIA_JSON, NPY_F4},
        {"application/x-npy", MEDIA_NPY, NPY_F4},
        {" application/X-NPY ; Dtype = \"<f2\" ; q=0.5", MEDIA_NPY, NPY_F2},
        {"application/x-npy;dtype=f8;q=2", MEDIA_NPY, NPY_F8},
        {"application/x-npy;dtype=f8;q=.2,application/x-npy;dtype=f2;q=.3", MEDIA_NPY, NPY_F2},
        {"application/x-npy;q=nan", MEDIA_JSON, NPY_F4},
        {"application/x-npy;;;", MEDIA_NPY, NPY_F4},
        {"application/x-npy;\"", MEDIA_NPY, NPY_F4},
        {"application/x-npyx, text/*", MEDIA_JSON, NPY_F4},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        media_accept chosen = media_choose(cases[i].accept);
        if (chosen.type == MEDIA_NPY && strcasestr(cases[i].accept, "dtype") == NULL)
            ck_assert(!chosen.npy_given);
        ck_assert_msg(chosen.type == cases[i].type, "%s", cases[i].accept);
        if (chosen.type == MEDIA_NPY) ck_assert_int_eq(chosen.npy, cases[i].npy);
    }
    static const struct {
        const char *accept;
        media_type type, of_table;
    } tables[] = {
        {"application/zip", MEDIA_JSON, MEDIA_ZIP},
        {"Application/ZIP;q=.1", MEDIA_JSON, MEDIA_ZIP},
        {"application/zip;q=0", MEDIA_JSON, MEDIA_JSON},
        {"application/json, application/zip", MEDIA_JSON, MEDIA_JSON},
        {"application/zip, application/json", MEDIA_JSON, MEDIA_ZIP},
        {"application/zip;q=.5, application/x-npy;q=.6", MEDIA_NPY, MEDIA_NPY},
        {"application/x-npy;q=.5, application/zip;q=.5", MEDIA_NPY, MEDIA_NPY},
        {"application/json;q=.9, application/x-npy;q=.5, application/zip", MEDIA_JSON, MEDIA_ZIP},
    };
    for (size_t i = 0; i < sizeof tables / sizeof tables[0]; i++) {
        ck_assert_msg(media_choose(tables[i].accept).type == tables[i].type, "%s", tables[i].accept);
        ck_assert_msg(media_choose_table(tables[i].accept).type == tables[i].of_table, "%s",
                      tables[i].accept);
    }
    ck_assert_int_eq(media_content_type("application/x-npy; a=b"), MEDIA_NPY);
    ck_assert_int_eq(media_content_type(NULL), MEDIA_JSON);
    ck_assert_int_eq(media_content_type(";"), MEDIA_OTHER);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("codec_npy");
    TCase *tcase = tcase_create("codec_npy");
    tcase_set_timeout(tcase, 300);
    tcase_add_test(tcase, doubles_tell_their_rounding);
    tcase_add_test(tcase, written_arrays_are_read);
    tcase_add_test(tcase, cut_arrays_are_refused);
    tcase_add_test(tcase, fortran_order_is_read);
    tcase_add_test(tcase, fortran_order_names_values_as_c_order);
    tcase_add_test(tcase, foreign_headers_are_refused);
    tcase_add_test(tcase, changed_arrays_never_do_harm);
    tcase_add_test(tcase, halves_are_rounded_to_nearest_even);
    tcase_add_test(tcase, headers_are_aligned);
    tcase_add_test(tcase, media_types);
    suite_add_tcase(suite, tcase);
    return suite_run(suite);
}
