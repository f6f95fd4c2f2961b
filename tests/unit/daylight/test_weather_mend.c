/* Weather that is missing: values that cannot matter, and --gaps fill and skip. */
#include "solver/daylight/weather_mend.h"
#include "support/suite.h"
#include "support/weather_text.h"

#include <math.h>
#include <string.h>
#include <unistd.h>

/* A made-up day that is the same each day: W/m2 at an hour. */
static double diffuse_at(double hour) {
    return hour > 6 && hour < 18 ? 20 * (6 - fabs(hour - 12)) : 0;
}

/* Rows of days of June; `row` writes what they hold. */
typedef struct text {
    FILE *stream;
    char path[32];
    bool epw;
    int per_hour;
} text;

static text begin(bool epw, const char *periods, int per_hour) {
    text t = {.epw = epw, .per_hour = per_hour};
    char stated[128];
    snprintf(stated, sizeof stated, "1,1,Data,Sunday,%s", periods != NULL ? periods : "");
    t.stream = weather_text_begin(epw, stated, t.path);
    return t;
}

/* A row by its number from the midnight before 1 June. */
static void row(text *t, int k, const char *direct, const char *diffuse) {
    const int a_day = 24 * t->per_hour, day = 1 + k / a_day, part = k % a_day;
    if (t->epw)
        fprintf(t->stream, "2001,6,%d,%d,%d,?9?9,15.0,999,60,101300,0,0,300,400,%s,%s,0,0\n", day,
                part / t->per_hour + 1, 60 / t->per_hour * (part % t->per_hour + 1), direct, diffuse);
    else
        fprintf(t->stream, "6 %d %.3f %s %s\n", day, (part + .5) / t->per_hour, direct, diffuse);
}

/* The made-up light of a row. */
static void good(text *t, int k) {
    char diffuse[32];
    const int a_day = 24 * t->per_hour;
    const double value = diffuse_at((k % a_day + .5) / t->per_hour);
    snprintf(diffuse, sizeof diffuse, "%.3f", value);
    row(t, k, value > 0 ? "100" : "0", diffuse);
}

static void good_rows(text *t, int from, int to) {
    for (int k = from; k < to; k++) good(t, k);
}

static lam_status end(text *t, weather_gaps gaps, weather *w, lam_error *error) {
    ck_assert_int_eq(fclose(t->stream), 0);
    const lam_status status = weather_read(t->path, gaps, w, error);
    unlink(t->path);
    return status;
}

static weather must_read(text *t, weather_gaps gaps) {
    weather w = {0};
    lam_error error = {0};
    ck_assert_msg(end(t, gaps, &w, &error) == LAM_OK, "%s", error.message);
    return w;
}

static void check_refused(text *t, weather_gaps gaps, const char *wanted) {
    weather w = {.n = 77};
    lam_error error = {0};
    ck_assert_msg(end(t, gaps, &w, &error) == LAM_ERR_FORMAT, "was read: %s", wanted);
    ck_assert_msg(strstr(error.message, wanted) != NULL, "\"%s\" lacks \"%s\"", error.message, wanted);
    ck_assert_uint_eq(w.n, 77); /* untouched */
}

/* The rows of w are those of the made-up days, n of them from row `from` on. */
static void check_days(const weather *w, int from, int n, int per_hour) {
    ck_assert_uint_eq(w->n, (size_t)n);
    for (int i = 0; i < n; i++) {
        const weather_hour *h = &w->hours[i];
        const int k = from + i, a_day = 24 * per_hour;
        ck_assert_int_eq(h->month, 6);
        ck_assert_int_eq(h->day, 1 + k / a_day);
        ck_assert_double_eq_tol(h->hour, (k % a_day + .5) / per_hour, 2e-3);
        ck_assert_double_eq_tol(h->diffuse, diffuse_at((k % a_day + .5) / per_hour), .06);
        ck_assert_double_eq(h->direct, h->diffuse > 0 ? 100 : 0);
    }
}

/* 9999, -999 and offsets by night count as 0, whatever is asked for; offsets by day, too. */
START_TEST(values_that_cannot_matter) {
    for (int gaps = WEATHER_REFUSE; gaps <= WEATHER_SKIP; gaps++)
        for (int epw = 0; epw < 2; epw++) {
            text t = begin(epw, "6/1,6/1", 1);
            good_rows(&t, 0, 1);
            row(&t, 1, "9999", "9999");
            row(&t, 2, "-999", "-1");
            row(&t, 3, "0", "-10");
            good_rows(&t, 4, 12);
            row(&t, 12, "-2.5", "110");
            good_rows(&t, 13, 23);
            row(&t, 23, "99999", "-9999");
            weather w = must_read(&t, (weather_gaps)gaps);
            ck_assert_uint_eq(w.mended.night, 5);
            ck_assert_uint_eq(w.mended.below, 3);
            ck_assert_uint_eq(w.mended.no_dew, epw ? 24 : 0);
            ck_assert_double_eq(w.mended.skipped + w.mended.between + w.mended.by_days, 0);
            ck_assert_double_eq(w.hours[12].direct, 0);
            w.hours[12].direct = 100;
            check_days(&w, 0, 24, 1);
            for (int i = 0; i < 24; i++) ck_assert(isnan(w.hours[i].dew_point));
            weather_free(&w);
        }
    /* The sun rises at 4:50 here: a row that it shines in for a part is no night. */
    text t = begin(false, NULL, 1);
    good_rows(&t, 0, 4);
    row(&t, 4, "0", "9999");
    good_rows(&t, 5, 24);
    check_refused(&t, WEATHER_REFUSE, "line 11 (2001-06-01 04:30): diffuse horizontal radiation is missing");
}
END_TEST

START_TEST(values_by_day) {
    for (int epw = 0; epw < 2; epw++) {
        text t = begin(epw, "6/1,6/3", 1);
        good_rows(&t, 0, 33);
        row(&t, 33, "9999", "70");
        row(&t, 34, "100", "9999");
        good_rows(&t, 35, 72);
        check_refused(
            &t, WEATHER_REFUSE,
            epw ? "line 42 (2001-06-02 09:00): direct normal radiation (field 15) is missing by day, "
                  "the first of 2 rows; fill the gap, or give --gaps fill or --gaps skip"
                : "line 40 (2001-06-02 09:30): direct radiation is missing by day, the first of 2");
        t = begin(epw, "6/1,6/3", 1);
        good_rows(&t, 0, 33);
        row(&t, 33, "9999", "70");
        row(&t, 34, "100", "9999");
        good_rows(&t, 35, 72);
        weather w = must_read(&t, WEATHER_FILL);
        check_days(&w, 0, 72, 1);
        ck_assert_double_eq(w.mended.between, 1); /* half of two rows */
        weather_free(&w);
        t = begin(epw, "6/1,6/3", 1);
        good_rows(&t, 0, 33);
        row(&t, 33, "9999", "70");
        row(&t, 34, "100", "9999");
        good_rows(&t, 35, 72);
        w = must_read(&t, WEATHER_SKIP);
        ck_assert_uint_eq(w.n, 70);
        ck_assert_double_eq(w.mended.skipped, 2);
        weather_free(&w);
    }
    text t = begin(false, NULL, 1);
    for (int k = 0; k < 24; k++) row(&t, k, "9999", "9999");
    check_refused(&t, WEATHER_FILL, "radiation cannot be filled: the gap is longer than 3 h");
    t = begin(false, NULL, 1);
    for (int k = 10; k < 14; k++) row(&t, k, "9999", "9999");
    check_refused(&t, WEATHER_SKIP, "all of 4 rows lack their radiation by day");
}
END_TEST

/* A morning, a day, and days at either end of what the header states. */
START_TEST(rows_are_filled) {
    static const struct {
        int from, to;
        double between, by_days;
    } gaps[] = {{31, 33, 2, 0}, {31, 34, 3, 0}, {33, 37, 0, 4},    {24, 48, 0, 16},  {24, 120, 0, 64},
                {0, 24, 0, 16}, {0, 9, 0, 5},   {144, 168, 0, 16}, {157, 168, 0, 7}, {24, 168, 0, 90}};
    for (size_t k = 0; k < sizeof gaps / sizeof gaps[0]; k++)
        for (int per_hour = 1; per_hour <= 4; per_hour += 3) {
            const int from = gaps[k].from * per_hour, to = gaps[k].to * per_hour;
            text t = begin(true, "6/1,6/7", per_hour);
            good_rows(&t, 0, from);
            good_rows(&t, to, 168 * per_hour);
            if (gaps[k].to - gaps[k].from == 144) { /* three days on one side are too few for six */
                check_refused(&t, WEATHER_FILL, "no day within 3 days has the value at this time");
                continue;
            }
            weather w = must_read(&t, WEATHER_FILL);
            check_days(&w, 0, 168 * per_hour, per_hour);
            ck_assert_double_eq_tol(w.mended.between, gaps[k].between, 1e-9);
            ck_assert_double_eq_tol(w.mended.between + w.mended.by_days + w.mended.dark,
                                    gaps[k].to - gaps[k].from, 1e-9);
            if (per_hour == 1) ck_assert_double_eq_tol(w.mended.by_days, gaps[k].by_days, 1e-9);
            weather_free(&w);
            t = begin(true, "6/1,6/7", per_hour);
            good_rows(&t, 0, from);
            good_rows(&t, to, 168 * per_hour);
            w = must_read(&t, WEATHER_SKIP);
            ck_assert_uint_eq(w.n, (size_t)(168 * per_hour - (to - from)));
            ck_assert_double_eq_tol(w.mended.skipped, gaps[k].to - gaps[k].from, 1e-9);
            weather_free(&w);
        }
    text t = begin(true, "6/1,6/20", 1);
    good_rows(&t, 0, 24);
    good_rows(&t, 24 * 9, 24 * 20);
    check_refused(&t, WEATHER_FILL,
                  "beside it 192 hours are missing, and at most 144 are filled; --gaps skip");
    t = begin(true, "6/1,6/30", 60); /* minutes of each fifth day: what is added stays bounded by the file */
    for (int day = 0; day < 30; day += 5) good_rows(&t, 1440 * day + 720, 1440 * day + 722);
    check_refused(&t, WEATHER_FILL,
                  "hours are missing beside 0.2 that are there, and at most 8 times as many");
    for (int how = WEATHER_FILL; how <= WEATHER_SKIP; how++) {
        t = begin(false, NULL, 1); /* the hours of a WEA are chosen: others are not missing */
        for (int day = 0; day < 20; day++)
            for (int hour = 8; hour < 18; hour++)
                if (day != 9 || (hour != 14 && hour != 17)) good(&t, 24 * day + hour);
        weather w = must_read(&t, (weather_gaps)how);
        ck_assert_uint_eq(w.n, how == WEATHER_FILL ? 200 : 198);
        ck_assert_double_eq(how == WEATHER_FILL ? w.mended.by_days + w.mended.between : w.mended.skipped, 2);
        if (how == WEATHER_FILL) ck_assert_double_eq_tol(w.hours[96].diffuse, diffuse_at(14.5), .01);
        weather_free(&w);
    }
}
END_TEST

START_TEST(rows_that_are_repeated) {
    for (int how = WEATHER_FILL; how <= WEATHER_SKIP; how++)
        for (int epw = 0; epw < 2; epw++) {
            text t = begin(epw, "6/1,6/4", 2);
            good_rows(&t, 48, 96); /* the second day is first, and once more, darker, at the end */
            good_rows(&t, 0, 48);
            good_rows(&t, 96, 192);
            for (int k = 48; k < 96; k++) row(&t, k, "1", "1");
            weather w = must_read(&t, (weather_gaps)how);
            ck_assert_uint_eq(w.mended.repeated, 48);
            ck_assert_uint_eq(w.mended.unordered, 48);
            ck_assert_double_eq(w.mended.skipped + w.mended.between + w.mended.by_days + w.mended.dark, 0);
            ck_assert_uint_eq(w.n, 192);
            double sum = 0;
            for (size_t i = 0; i < w.n; i++) sum += w.hours[i].diffuse;
            ck_assert_double_eq_tol(sum, 4 * 2 * 720, .1); /* 20 W/m2 times 36 h a day */
            weather_free(&w);
        }
}
END_TEST

/* A text in memory is read as a file is. */
START_TEST(from_memory) {
    static const char content[] =
        "place x\nlatitude 37.5\nlongitude 122.25\ntime_zone 120\nsite_elevation 2\n"
        "weather_data_file_units 1\n6 1 12.5 100 50\n";
    weather w = {0};
    lam_error error = {0};
    ck_assert_int_eq(weather_read_text("a.wea", content, sizeof content - 1, WEATHER_REFUSE, &w, &error),
                     LAM_OK);
    ck_assert_uint_eq(w.n, 1);
    ck_assert_double_eq(w.hours[0].diffuse, 50);
    weather_free(&w);
    ck_assert_int_eq(weather_read_text("a.epw", content, sizeof content - 1, WEATHER_REFUSE, &w, &error),
                     LAM_ERR_FORMAT);
    ck_assert_ptr_nonnull(strstr(error.message, "a.epw: line 1 begins with \"place x\""));
    ck_assert_int_eq(weather_read_text("a.wea", content, 0, WEATHER_REFUSE, &w, &error), LAM_ERR_FORMAT);
}
END_TEST

int main(void) {
    Suite *s = suite_create("weather_mend");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 60);
    tcase_add_test(c, values_that_cannot_matter);
    tcase_add_test(c, values_by_day);
    tcase_add_test(c, rows_are_filled);
    tcase_add_test(c, rows_that_are_repeated);
    tcase_add_test(c, from_memory);
    suite_add_tcase(s, c);
    return suite_run(s);
}
