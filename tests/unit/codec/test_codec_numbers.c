/* Numbers as text: what is written reads back as the same bits, whoever reads it; what is read is rounded
 * right. */
#include "solver/codec/json_reader.h"
#include "solver/codec/json_writer.h"
#include "support/request_text.h"
#include "support/suite.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* A sanitizer looks at how a number is read, not at which: some of them are enough for it. */
#ifdef LAMBERT_FEW_CASES
enum { SHARE = 8 };
#else
enum { SHARE = 1 };
#endif

/* Its shortest decimal, 7.038531e-26, is read through a double as the next float. */
static const float rounded_twice = 0x1.5c87fap-84f;

static float from_bits(uint32_t bits) {
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static uint32_t to_bits(float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static float read_float(const char *text) {
    json_reader r;
    float value = NAN;
    json_begin(&r, text, strlen(text));
    ck_assert_msg(json_read_float(&r, &value) && json_finish(&r), "%s is not taken for a number", text);
    json_end(&r);
    return value;
}

static double read_double(const char *text) {
    json_reader r;
    double value = NAN;
    json_begin(&r, text, strlen(text));
    ck_assert_msg(json_read_double(&r, &value) && json_finish(&r), "%s is not taken for a number", text);
    json_end(&r);
    return value;
}

/* Significant digits of a decimal text. */
static int count_digits(const char *text) {
    int count = 0, zeros = 0;
    bool point = false;
    for (; *text != '\0' && *text != 'e'; text++) {
        point |= *text == '.';
        if (*text < '0' || *text > '9' || (count == 0 && *text == '0')) continue;
        count++;
        zeros = *text == '0' ? zeros + 1 : 0;
    }
    return point ? count : count - zeros;
}

static void write_float(char text[JSON_FLOAT_ROOM + 1], float value) {
    char *const end = json_write_numbers(text, &value, 1);
    ck_assert_int_le(end - text, JSON_FLOAT_MAX + 1);
    ck_assert_int_eq(end[-1], ',');
    end[-1] = '\0';
}

/* Fewer digits do not give the number back, and these are the nearest to it. */
static void check_shortest(float value, const char *text) {
    char nearest[40], fewer[40];
    const int digits = count_digits(text);
    snprintf(nearest, sizeof nearest, "%.*e", digits - 1, (double)value);
    snprintf(fewer, sizeof fewer, "%.*e", digits - 2, (double)value);
    if (digits > 1)
        ck_assert_msg(strtof(fewer, NULL) != value, "%a is written %s, longer than %s", (double)value, text,
                      fewer);
    /* Beside the next power of two below, the nearest of so many digits may round to another number. */
    if (strtof(nearest, NULL) == value)
        ck_assert_msg(strtod(text, NULL) == strtod(nearest, NULL), "%a is written %s, not %s", (double)value,
                      text, nearest);
}

/* The number comes back from its text, however it is read. */
static void check_round_trip(float value) {
    char text[JSON_FLOAT_ROOM + 1];
    write_float(text, value);
    ck_assert_msg(strtof(text, NULL) == value, "%a is written %s, which is %a as float", (double)value, text,
                  (double)strtof(text, NULL));
    ck_assert_msg((float)strtod(text, NULL) == value, "%a is written %s, which is another through double",
                  (double)value, text);
    ck_assert_msg(read_float(text) == value, "%a is written %s, which we read as %a", (double)value, text,
                  (double)read_float(text));
    if (value != 0 && fabsf(value) != rounded_twice) check_shortest(value, text);
}

START_TEST(every_exponent_round_trips) {
    static const uint32_t fractions[] = {0,        1,        2,        3,        0x3FFFFF, 0x400000,
                                         0x400001, 0x7FFFFE, 0x7FFFFF, 0x2AAAAA, 0x555555};
    for (uint32_t exponent = 0; exponent < 255; exponent++)
        for (size_t i = 0; i < sizeof fractions / sizeof fractions[0]; i++)
            for (uint32_t sign = 0; sign < 2; sign++)
                check_round_trip(from_bits(sign << 31 | exponent << 23 | fractions[i]));
    for (uint32_t bits = 0; bits < 100000 / SHARE; bits++)
        check_round_trip(from_bits(bits)); /* the smallest of all */
}
END_TEST

START_TEST(random_floats_round_trip) {
    uint64_t state = 42;
    const int count = 300000 / SHARE;
    for (int i = 0; i < count; i++) {
        uint32_t bits = (uint32_t)request_text_random(&state);
        if ((bits & 0x7F800000u) != 0x7F800000u) check_round_trip(from_bits(bits));
    }
    for (int i = 0; i < count; i++) check_round_trip((float)(request_text_random(&state) % 1000000) * 1e-3f);
}
END_TEST

START_TEST(texts_are_plain) {
    static const struct {
        float value;
        const char *text;
    } cases[] = {{0.0f, "0"},
                 {-0.0f, "0"},
                 {1.0f, "1"},
                 {-1.5f, "-1.5"},
                 {0.1f, "0.1"},
                 {100.0f, "100"},
                 {123456.0f, "123456"},
                 {0.001f, "0.001"},
                 {1e-7f, "1e-7"},
                 {1.5e-5f, "1.5e-5"},
                 {1e10f, "1e10"},
                 {16777216.0f, "16777216"},
                 {3.4028235e38f, "3.4028235e38"},
                 {1e-45f, "1e-45"},
                 {0.3f, "0.3"},
                 {299792458.0f, "299792450"},
                 {999999999.0f, "1e9"},
                 {99999992.0f, "99999990"},
                 {0x1.5c87fap-84f, "7.0385307e-26"},
                 {-FLT_MIN, "-1.1754944e-38"},
                 {-0.0012345678f, "-0.0012345678"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char text[JSON_FLOAT_ROOM + 1];
        write_float(text, cases[i].value);
        ck_assert_str_eq(text, cases[i].text);
    }
    buffer b = {0};
    const float row[] = {1, 0.5f, 3};
    ck_assert(json_write_floats(&b, row, 3) && json_write_floats(&b, row, 0));
    ck_assert_str_eq(b.bytes, "[1,0.5,3][]");
    buffer_free(&b);
}
END_TEST

START_TEST(doubles_round_trip) {
    uint64_t state = 7;
    for (int i = 0; i < 100000 / SHARE; i++) {
        uint64_t bits = request_text_random(&state);
        double value;
        memcpy(&value, &bits, sizeof value);
        if (!isfinite(value)) continue;
        buffer b = {0};
        ck_assert(json_write_double(&b, value));
        ck_assert_msg(read_double(b.bytes) == value, "%a is written %s", value, b.bytes);
        buffer_free(&b);
    }
    buffer b = {0};
    ck_assert(json_write_double(&b, 0.1) && json_write_double(&b, 5));
    ck_assert_str_eq(b.bytes, "0.15");
    buffer_free(&b);
}
END_TEST

/* JSON has no other word for them, and a program must not end over what a file holds. */
START_TEST(numbers_that_are_not_finite_are_null) {
    buffer b = {0};
    ck_assert(json_write_double(&b, (double)INFINITY) && json_write_double(&b, (double)NAN));
    ck_assert(json_write_floats(&b, (const float[]){1, -INFINITY, NAN, 2}, 4));
    ck_assert_str_eq(b.bytes, "nullnull[1,null,null,2]");
    buffer_free(&b);
}
END_TEST

/* No fewer digits give the number back, tried one by one: of any bits, of few digits, near the least of
 * doubles. */
START_TEST(doubles_are_as_short_as_can_be) {
    uint64_t state = 17;
    for (int i = 0; i < 30000 / SHARE; i++) {
        uint64_t bits = request_text_random(&state);
        double value;
        char text[40];
        memcpy(&value, &bits, sizeof value);
        if (i % 3 == 1) value = ldexp((double)(bits % 1000000), -(int)(bits >> 32 & 31));
        if (i % 3 == 2) value = (double)(bits % 512) * 0x1p-1074 * (bits & 1 << 20 ? 1 : 0x1p60);
        if (!isfinite(value)) continue;
        for (int digits = 1; digits <= 17; digits++) {
            snprintf(text, sizeof text, "%.*g", digits, value);
            if (strtod(text, NULL) == value) break;
        }
        /* The same digits, without an exponent where 15 digits need none. */
        if (strlen(text) < 15 && fabs(value) > 1e-290) snprintf(text, sizeof text, "%.15g", value);
        buffer b = {0};
        ck_assert(json_write_double(&b, value));
        if (strcmp(b.bytes, text) != 0) ck_abort_msg("%a is written %s, not %s", value, b.bytes, text);
        buffer_free(&b);
    }
    buffer b = {0};
    ck_assert(json_write_doubles(&b, (const double[]){1, .5, -3e300}, 3) && json_write_doubles(&b, NULL, 0));
    ck_assert_str_eq(b.bytes, "[1,0.5,-3e+300][]");
    buffer_free(&b);
}
END_TEST

/* Decimals of any length and size, many of them at the middle of two floats: the C library is the judge. */
START_TEST(decimals_are_rounded_right) {
    uint64_t state = 99;
    char text[128];
    for (int i = 0; i < 500000 / SHARE; i++) {
        int digits = 1 + (int)(request_text_random(&state) % 25);
        size_t at = 0;
        if (request_text_random(&state) % 2) text[at++] = '-';
        text[at++] = (char)('1' + request_text_random(&state) % 9);
        for (int d = 1; d < digits; d++) {
            if (d == 1) text[at++] = '.';
            text[at++] = (char)('0' + request_text_random(&state) % 10);
        }
        snprintf(text + at, sizeof text - at, "e%d", (int)(request_text_random(&state) % 700) - 350);
        ck_assert_msg(read_double(text) == strtod(text, NULL), "%s", text);
        float f = read_float(text);
        ck_assert_msg(to_bits(f) == to_bits(strtof(text, NULL)), "%s is read as %a", text, (double)f);
    }
    for (int i = 0; i < 100000 / SHARE; i++) {
        uint32_t bits = (uint32_t)(request_text_random(&state) % 0x7F7FFFFFu);
        double middle = ((double)from_bits(bits) + (double)from_bits(bits + 1)) / 2;
        snprintf(text, sizeof text, "%.*g", 17 + (int)(request_text_random(&state) % 30), middle);
        ck_assert_msg(read_float(text) == strtof(text, NULL), "%s is read as %a", text,
                      (double)read_float(text));
    }
}
END_TEST

/* An array read the quick way where that goes and one by one where it does not: every value is the C
 * library's, and the reader stands where the slow way would. */
START_TEST(plain_numbers_are_the_same_numbers) {
    enum { COUNT = 64, ARRAYS = 4000 / SHARE };
    static const char *const spaces[] = {"", "", "", " ", "\n  ", "\t"};
    uint64_t state = 5;
    size_t quick = 0;
    for (int a = 0; a < ARRAYS; a++) {
        char text[COUNT * 64] = "[", number[64];
        float wanted[COUNT];
        size_t at = 1;
        for (int k = 0; k < COUNT; k++) {
            const uint64_t form = request_text_random(&state) % 8;
            const uint32_t bits = (uint32_t)(request_text_random(&state) % 0x7F7FFFFFu);
            const double value = (double)from_bits(bits);
            if (form < 3)
                snprintf(number, sizeof number, "%.9g", value);
            else if (form == 3)
                snprintf(number, sizeof number, "%.*f", (int)(request_text_random(&state) % 20),
                         (double)(request_text_random(&state) % 1000000) / 7);
            else if (form == 4)
                snprintf(number, sizeof number, "%.*g", 15 + (int)(request_text_random(&state) % 12),
                         (value + (double)from_bits(bits + 1)) / 2);
            else if (form == 5)
                snprintf(number, sizeof number, "%lluE%+d",
                         (unsigned long long)(request_text_random(&state) >> 3),
                         (int)(request_text_random(&state) % 60) - 45);
            else if (form == 6)
                snprintf(number, sizeof number, "-%u", (unsigned)(bits % 100));
            else
                snprintf(number, sizeof number, "0.%08u",
                         (unsigned)(request_text_random(&state) % 100000000));
            wanted[k] = strtof(number, NULL);
            at += (size_t)snprintf(text + at, sizeof text - at, "%s%s%s%s", k > 0 ? "," : "",
                                   spaces[request_text_random(&state) % 6], number,
                                   spaces[request_text_random(&state) % 6]);
        }
        snprintf(text + at, sizeof text - at, "]");
        json_reader r;
        json_begin(&r, text, strlen(text));
        float values[COUNT + 1] = {0};
        ck_assert(json_enter_array(&r));
        size_t found = json_read_plain_floats(&r, values, COUNT);
        quick += found;
        while (json_next_element(&r)) {
            ck_assert(found < COUNT);
            ck_assert(json_read_float(&r, &values[found++]));
            const size_t more = json_read_plain_floats(&r, values + found, COUNT - found);
            quick += more;
            found += more;
        }
        ck_assert(json_finish(&r) && found == COUNT);
        for (int k = 0; k < COUNT; k++)
            ck_assert_msg(values[k] == wanted[k], "%d: %a, must be %a: %s", k, (double)values[k],
                          (double)wanted[k], text);
        json_end(&r);
    }
    /* Both ways had work: blanks before a comma and exponents beyond 22 are the slow one's. */
    ck_assert_uint_gt(quick, (size_t)ARRAYS * COUNT / 8);
    ck_assert_uint_lt(quick, (size_t)ARRAYS * COUNT * 7 / 8);
}
END_TEST

/* Texts that the quick way must leave to the slow one: not numbers, what is written otherwise, what is too
 * large.
 */
START_TEST(what_is_not_plain_is_left) {
    static const char *const left[] = {"[-1]",     "[01]",
                                       "[1.]",     "[.5]",
                                       "[1e]",     "[+1]",
                                       "[NaN]",    "[]",
                                       "[1e39]",   "[1e100]",
                                       "[1e-100]", "[\"1\"]",
                                       "[1e+]",    "[1.e5]",
                                       "[null]",   "[1234567890123456789]",
                                       "[",        "[0.1234567890123456789]"};
    for (size_t k = 0; k < sizeof left / sizeof *left; k++) {
        json_reader r;
        float value = 7;
        json_begin(&r, left[k], strlen(left[k]));
        ck_assert(json_enter_array(&r));
        ck_assert_msg(json_read_plain_floats(&r, &value, 1) == 0 && r.at == left[k] + 1, "%s", left[k]);
        json_end(&r);
    }
    json_reader r;
    float values[4];
    const char *text = "[1,2,3,4]";
    json_begin(&r, text, strlen(text));
    ck_assert(json_enter_array(&r));
    ck_assert_uint_eq(json_read_plain_floats(&r, values, 2), 2);
    ck_assert(json_next_element(&r) && json_read_float(&r, &values[2]) && values[2] == 3);
    /* Without a comma between them the second is not taken. */
    text = "[1 2]";
    json_begin(&r, text, strlen(text));
    ck_assert(json_enter_array(&r));
    ck_assert_uint_eq(json_read_plain_floats(&r, values, 2), 1);
    ck_assert(!json_next_element(&r) && r.fault != NULL);
}
END_TEST

START_TEST(numbers_at_the_edge) {
    ck_assert(isinf(read_double("1e999")) && isinf(read_double("-1e999")) && isinf(read_float("1e39")));
    ck_assert(read_double("1e-999") == 0 && read_float("1e-60") == 0);
    ck_assert(read_double("0e999999999999999999999") == 0 && read_double("1e-99999999999999999999999") == 0);
    ck_assert(isinf(read_double("1e99999999999999999999999")));
    ck_assert(read_float("3.4028235e38") == FLT_MAX && isinf(read_float("3.4028236e38")));
    ck_assert(read_double("9007199254740993") == 9007199254740992.0);
    char text[2048] = "0.";
    memset(text + 2, '0', 1000);
    strcpy(text + 1002, "25e1002");
    ck_assert(read_double(text) == 250.0 / 10);
    memset(text, '7', 400);
    strcpy(text + 400, "e-399");
    ck_assert(read_float(text) == strtof(text, NULL));
}
END_TEST

/* Written by several threads, in pieces and in groups of pieces, an array has the text of its numbers. */
START_TEST(long_arrays) {
    static const size_t counts[] = {4095, 32767, 32768, 40000, 262144, 262145, 600001};
    const size_t most = counts[sizeof counts / sizeof *counts - 1];
    float *const values = malloc(most * sizeof *values);
    char *const wanted = malloc(most * (JSON_FLOAT_MAX + 1) + JSON_FLOAT_ROOM + 2);
    uint32_t state = 1;
    ck_assert(values != NULL && wanted != NULL);
    for (size_t i = 0; i < most; i++) {
        state = state * 1664525u + 1013904223u;
        memcpy(&values[i], &state, sizeof state); /* of any length and sign, NaN among them */
    }
    for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) {
        buffer b = {0};
        char *at = wanted;
        *at++ = '[';
        for (size_t i = 0; i < counts[k]; i++) at = json_write_numbers(at, &values[i], 1);
        at[-1] = ']';
        ck_assert(buffer_append(&b, "x", 1) && json_write_floats(&b, values, counts[k]));
        ck_assert_uint_eq(b.length, 1 + (size_t)(at - wanted));
        ck_assert_int_eq(memcmp(b.bytes + 1, wanted, b.length - 1), 0);
        ck_assert_int_eq(b.bytes[b.length], 0);
        buffer_free(&b);
    }
    free(values);
    free(wanted);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("codec_numbers");
    TCase *tcase = tcase_create("codec_numbers");
    tcase_set_timeout(tcase, 300);
    tcase_add_test(tcase, every_exponent_round_trips);
    tcase_add_test(tcase, random_floats_round_trip);
    tcase_add_test(tcase, texts_are_plain);
    tcase_add_test(tcase, doubles_round_trip);
    tcase_add_test(tcase, numbers_that_are_not_finite_are_null);
    tcase_add_test(tcase, doubles_are_as_short_as_can_be);
    tcase_add_test(tcase, decimals_are_rounded_right);
    tcase_add_test(tcase, numbers_at_the_edge);
    tcase_add_test(tcase, plain_numbers_are_the_same_numbers);
    tcase_add_test(tcase, what_is_not_plain_is_left);
    tcase_add_test(tcase, long_arrays);
    suite_add_tcase(suite, tcase);
    return suite_run(suite);
}
