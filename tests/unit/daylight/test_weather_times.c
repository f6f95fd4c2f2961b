/* Times of weather: the step between rows, and rows that are missing, repeated or out of order. */
#include "solver/daylight/weather.h"
#include "support/suite.h"
#include "support/weather_text.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const int days_of[12] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};

/* A file that is made row by row. */
typedef struct text {
    FILE *stream;
    char path[32];
    bool epw;
} text;

static text begin(bool epw, const char *periods) {
    text t = {.epw = epw};
    t.stream = weather_text_begin(epw, periods, t.path);
    return t;
}

static lam_status end(text *t, weather *w, lam_error *error) {
    ck_assert_int_eq(fclose(t->stream), 0);
    const lam_status status = weather_read(t->path, WEATHER_REFUSE, w, error);
    unlink(t->path);
    return status;
}

static void wea_row(text *t, int month, int day, double hour) {
    fprintf(t->stream, "%d %d %.3f 100 50\n", month, day, hour);
}

static void epw_row(text *t, int year, int month, int day, int hour, int minute) {
    fprintf(t->stream, "%d,%d,%d,%d,%d,?9?9,15.0,8.5,60,101300,0,0,300,400,100,50,0,0\n", year, month, day,
            hour, minute);
}

/* The rows of a day from one hour to another, `per_hour` an hour, in the middle of what they cover. */
static void wea_day(text *t, int month, int day, int from, int to, int per_hour) {
    for (int k = from * per_hour; k < to * per_hour; k++) wea_row(t, month, day, (k + .5) / per_hour);
}

/* The same with the minute at `place` of a part: 1 its end, 0 its beginning, .5 its middle. */
static void epw_day(text *t, int year, int month, int day, int from, int to, int per_hour, double place) {
    for (int k = from * per_hour; k < to * per_hour; k++)
        epw_row(t, year, month, day, k / per_hour + 1, (int)(60 / per_hour * (k % per_hour + place)));
}

/* Rows of whole days, from one date to another of a year without a leap day unless `leap`. */
static void days_between(text *t, int year, int month, int day, int to_month, int to_day, bool leap) {
    for (;;) {
        if (t->epw)
            epw_day(t, year, month, day, 0, 24, 1, 1);
        else
            wea_day(t, month, day, 0, 24, 1);
        if (month == to_month && day == to_day) return;
        if (++day <= days_of[month - 1] + (leap && month == 2)) continue;
        day = 1;
        month = month % 12 + 1;
    }
}

static void check_taken(text *t, size_t n, double step, size_t stretches) {
    weather w = {0};
    lam_error error = {0};
    ck_assert_msg(end(t, &w, &error) == LAM_OK, "%s", error.message);
    ck_assert_uint_eq(w.n, n);
    ck_assert_double_eq_tol(w.step, step, 1e-12);
    ck_assert_uint_eq(w.stretches, stretches);
    for (size_t i = 0; i < w.n; i++) ck_assert(w.hours[i].hour >= 0 && w.hours[i].hour <= 24);
    weather_free(&w);
}

static void check_refused(text *t, const char *wanted) {
    weather w = {.n = 77};
    lam_error error = {0};
    ck_assert_msg(end(t, &w, &error) == LAM_ERR_FORMAT, "was read: %s", wanted);
    ck_assert_msg(strstr(error.message, wanted) != NULL, "\"%s\" lacks \"%s\"", error.message, wanted);
    ck_assert_uint_eq(w.n, 77); /* untouched */
}

/* Every step, by decimals of hours and by minutes of all three places, also under a header that is wrong. */
START_TEST(steps) {
    static const int per_hour[] = {1, 2, 3, 4, 5, 6, 10, 12, 15, 20, 30, 60};
    for (size_t k = 0; k < sizeof per_hour / sizeof per_hour[0]; k++) {
        const int N = per_hour[k];
        text t = begin(false, NULL);
        wea_day(&t, 6, 21, 0, 24, N);
        check_taken(&t, (size_t)(24 * N), 1. / N, 1);
        t = begin(false, NULL); /* as ladybug writes parts of hours: from midnight on */
        for (int i = 0; i < 24 * N; i++) wea_row(&t, 6, 21, (double)i / N);
        check_taken(&t, (size_t)(24 * N), 1. / N, 1);
        for (int place = 0; place < 3; place++) {
            weather w = {0};
            lam_error error = {0};
            t = begin(true, place == 1 ? "1,7,Data,Sunday,6/21,6/21" : "1,1,Data,Sunday,6/21,6/21");
            epw_day(&t, 2001, 6, 21, 0, 24, N, .5 * place);
            ck_assert_msg(end(&t, &w, &error) == LAM_OK, "%d at %d: %s", N, place, error.message);
            ck_assert_double_eq_tol(w.step, 1. / N, 1e-12);
            for (size_t i = 0; i < w.n; i++)
                ck_assert_double_eq_tol(w.hours[i].hour, ((double)i + .5) / N, 1e-9);
            ck_assert_uint_eq(w.stated_steps, place == 1 ? 7 : 1);
            weather_free(&w);
        }
    }
    /* Minutes of rows that are an hour apart say nothing, and need not be numbers. */
    text t = begin(true, "1,1,Data,Sunday,6/21,6/21");
    for (int hour = 1; hour <= 24; hour++)
        fprintf(t.stream, "2001,6,21,%d,%s,?,15.0,8.5,60,101300,0,0,300,400,100,50,0\n", hour,
                hour % 2 ? "" : "17");
    check_taken(&t, 24, 1, 1);
    /* Days of three hours, and noons of which each can only be an hour. */
    t = begin(false, NULL);
    for (int month = 3; month <= 12; month += 3)
        for (int hour = 0; hour < 24; hour += 3) wea_row(&t, month, 21, hour + 1.5);
    check_taken(&t, 32, 3, 4);
    t = begin(false, NULL);
    for (int day = 1; day <= 9; day++) wea_row(&t, 6, day, 12);
    check_taken(&t, 9, 1, 9);
}
END_TEST

START_TEST(mixed_steps) {
    text t = begin(false, NULL);
    wea_day(&t, 6, 21, 0, 12, 1);
    wea_day(&t, 6, 21, 12, 24, 2);
    check_refused(&t,
                  "line 8 (2001-06-21 01:30) is 1 h after the row before it, but most rows are 0.5 h apart");
    t = begin(true, "1,1,Data,Sunday,6/20,6/22");
    epw_day(&t, 2001, 6, 20, 0, 24, 1, 1);
    epw_day(&t, 2001, 6, 21, 0, 24, 1, 1);
    epw_day(&t, 2001, 6, 22, 0, 12, 2, 1);
    epw_day(&t, 2001, 6, 22, 12, 24, 1, 1);
    check_refused(&t,
                  "is 0.5 h after the row before it, but most rows are 1 h apart; a file must keep to one");
    t = begin(true, "1,2,Data,Sunday,6/20,6/21");
    epw_day(&t, 2001, 6, 20, 0, 24, 2, 1);
    epw_day(&t, 2001, 6, 21, 0, 24, 1, 1);
    check_refused(&t, "is 1 h after the row before it, but most rows are 0.5 h apart");
    t = begin(false, NULL);
    for (int k = 0; k < 60; k++) wea_row(&t, 6, 21, .2 + .4 * k);
    check_refused(&t,
                  "line 8 (2001-06-21 00:36) is 0.4 h after the row before it; a step must be an hour over");
    t = begin(true, "1,2,Data,Sunday,6/21,6/21");
    epw_day(&t, 2001, 6, 21, 0, 24, 2, 1);
    fprintf(t.stream, "2001,6,21,24,x,?9,15.0,8.5,60,101300,0,0,300,400,100,50,0,0\n");
    check_refused(&t, "line 57: minute (field 5) must be a whole number from 0 to 60");
}
END_TEST

/* Years of an EPW that are whole: calendar years, leap years, typical ones, and those that begin in July. */
START_TEST(whole_years) {
    text t = begin(true, "1,1,Data,Sunday, 1/ 1,12/31");
    days_between(&t, 2001, 1, 1, 12, 31, false);
    check_taken(&t, 8760, 1, 1);
    t = begin(true, "1,1,Data,Sunday,1/1/2004,12/31/2004");
    days_between(&t, 2004, 1, 1, 12, 31, true);
    check_taken(&t, 8784, 1, 1);
    t = begin(true, "1,1,Data,Sunday,1/1,12/31");
    days_between(&t, 2004, 1, 1, 12, 31, false); /* a leap year without its day, as many files have it */
    check_taken(&t, 8760, 1, 1);
    t = begin(true, "1,1,Data,Sunday,1/1,12/31");
    for (int month = 1; month <= 12; month++)
        days_between(&t, 1980 + 7 * month % 12, month, 1, month, days_of[month - 1], false);
    check_taken(&t, 8760, 1, 1);
    for (int k = 0; k < 3; k++) {
        static const char *const periods[] = {"1,1,Data,Sunday,7/1,6/30", "1,1,Data,Sunday,1/1,12/31",
                                              "1,1,Data,Sunday,7/1/2001,6/30/2002"};
        t = begin(true, periods[k]);
        days_between(&t, 2001, 7, 1, 12, 31, false);
        days_between(&t, 2002, 1, 1, 6, 30, false);
        check_taken(&t, 8760, 1, 1);
    }
    t = begin(true, "1,1,Data,Sunday,1,365"); /* days by number */
    days_between(&t, 2001, 1, 1, 12, 31, false);
    check_taken(&t, 8760, 1, 1);
    t = begin(true, "1,1,Data,Sunday,1/1/2001,12/31/2002");
    days_between(&t, 2001, 1, 1, 12, 31, false);
    days_between(&t, 2002, 1, 1, 12, 31, false);
    check_taken(&t, 17520, 1, 1);
    t = begin(true, "2,1,Cold,Sunday,1/10,1/12,Warm,Monday,7/10,7/12");
    days_between(&t, 2001, 1, 10, 1, 12, false);
    days_between(&t, 2001, 7, 10, 7, 12, false);
    check_taken(&t, 144, 1, 2);
    t = begin(true, "1,1"); /* nothing is stated */
    days_between(&t, 2001, 6, 21, 6, 22, false);
    check_taken(&t, 48, 1, 1);
    t = begin(false, NULL);
    days_between(&t, 0, 7, 1, 6, 30, false);
    check_taken(&t, 8760, 1, 1);
    t = begin(false, NULL);
    days_between(&t, 0, 1, 1, 12, 31, true);
    check_taken(&t, 8784, 1, 1);
}
END_TEST

/* Whole days of a period that is stated may be chosen, where they are at most half of those from the first to
 * the last. */
START_TEST(days_of_a_period) {
    for (int per_hour = 1; per_hour <= 2; per_hour++) {
        text t = begin(true, "1,1,Data,Sunday,3/21,12/21");
        for (int month = 3; month <= 12; month += 3) epw_day(&t, 2001, month, 21, 0, 24, per_hour, 1);
        check_taken(&t, (size_t)(96 * per_hour), 1. / per_hour, 4);
        t = begin(true, "1,1,Data,Sunday,3/21,12/21"); /* one of them is not whole */
        for (int month = 3; month <= 12; month += 3)
            epw_day(&t, 2001, month, 21, 0, month == 6 ? 23 : 24, per_hour, 1);
        check_refused(&t, "(2001-06-21 00:00): before it 2184 hours are missing");
    }
    text t = begin(true, "1,1,Data,Sunday,6/1,6/9"); /* five of nine are no choice, but holes */
    for (int day = 1; day <= 9; day += 2) epw_day(&t, 2001, 6, day, 0, 24, 1, 1);
    check_refused(&t, "(2001-06-03 00:00): before it 24 hours are missing, 96 in 4 gaps");
    t = begin(true, "1,1,Data,Sunday,6/1,6/30"); /* nor is an end that is cut off */
    for (int day = 1; day <= 10; day++) epw_day(&t, 2001, 6, day, 0, 24, 1, 1);
    check_refused(&t, ": 480 hours are missing");
}
END_TEST

START_TEST(rows_outside_of_the_header) {
    weather w = {0};
    lam_error error = {0};
    text t = begin(true, "1,1,Data,Sunday,6/21,6/21");
    days_between(&t, 2001, 6, 20, 6, 23, false);
    ck_assert_msg(end(&t, &w, &error) == LAM_OK, "%s", error.message);
    ck_assert_uint_eq(w.outside, 72);
    weather_free(&w);
}
END_TEST

START_TEST(rows_that_are_missing) {
    text t = begin(true, "1,1,Data,Sunday,6/20,6/22");
    days_between(&t, 2001, 6, 20, 6, 20, false);
    days_between(&t, 2001, 6, 22, 6, 22, false);
    check_refused(&t, "line 33 (2001-06-22 00:00): before it 24 hours are missing; fill the gap");
    t = begin(true, "1,1,Data,Sunday,1/1,12/31"); /* a year without 5 March */
    days_between(&t, 2001, 1, 1, 3, 4, false);
    days_between(&t, 2001, 3, 6, 12, 31, false);
    check_refused(&t, "line 1521 (2001-03-06 00:00): before it 24 hours are missing; fill the gap");
    t = begin(true, "1,1,Data,Sunday,1/1,12/31"); /* and without a day in summer */
    days_between(&t, 2001, 1, 1, 3, 4, false);
    days_between(&t, 2001, 3, 6, 7, 1, false);
    days_between(&t, 2001, 7, 3, 12, 31, false);
    check_refused(&t, "(2001-03-06 00:00): before it 24 hours are missing, 48 in 2 gaps of the file;");
    t = begin(true, "1,2,Data,Sunday,6/21,6/21");
    epw_day(&t, 2001, 6, 21, 0, 12, 2, 1);
    epw_day(&t, 2001, 6, 21, 13, 24, 2, 1);
    check_refused(&t, "line 33 (2001-06-21 13:00): before it 1 hour is missing");
    /* The header shows that rows are cut off. */
    t = begin(true, "1,1,Data,Sunday,1/1,12/31");
    days_between(&t, 2001, 1, 1, 12, 30, false);
    epw_day(&t, 2001, 12, 31, 0, 23, 1, 1);
    check_refused(&t, "line 8 states 1/1 to 12/31, but rows are from line 9 (2001-01-01 00:00) to line 8767 "
                      "(2001-12-31 22:00): 1 hour is missing");
    t = begin(true, "1,1,Data,Sunday,6/20,6/22");
    days_between(&t, 2001, 6, 20, 6, 21, false);
    check_refused(&t, ": 24 hours are missing; fill the gap or state what the file holds, or give --gaps");
    t = begin(true, "1,1,Data,Sunday,6/20,6/22");
    epw_day(&t, 2001, 6, 20, 3, 24, 1, 1);
    days_between(&t, 2001, 6, 21, 6, 22, false);
    check_refused(&t, ": 3 hours are missing; fill the gap or state");
    t = begin(true, "2,1,Cold,Sunday,1/10,1/12,Warm,Monday,7/10,7/12");
    days_between(&t, 2001, 1, 10, 1, 12, false);
    check_refused(&t, "line 8 states 1/10 to 7/12, but rows are from");
    t = begin(true, "2,1,Cold,Sunday,1/10,1/12,Warm,Monday,7/10,7/12");
    days_between(&t, 2001, 1, 10, 1, 11, false);
    days_between(&t, 2001, 7, 10, 7, 12, false);
    check_refused(&t, "(2001-07-10 00:00): before it");
    t = begin(true, "1,1,Data,Sunday,1/1/2001,12/31/2002");
    days_between(&t, 2001, 1, 1, 12, 31, false);
    days_between(&t, 2002, 1, 1, 11, 30, false);
    check_refused(&t, "(2002-11-30 23:00): 744 hours are missing");
    t = begin(true, "1,1,Data,Sunday,1/1,12/31"); /* half of a leap day */
    days_between(&t, 2004, 1, 1, 2, 28, true);
    epw_day(&t, 2004, 2, 29, 0, 12, 1, 1);
    days_between(&t, 2004, 3, 1, 12, 31, true);
    check_refused(&t, "(2004-03-01 00:00): before it 12 hours are missing");
    t = begin(true, "1,1,Data,Sunday,13/1,12/31");
    check_refused(&t, "line 8: date of a data period (field 6) is \"13/1\", must be MONTH/DAY");
    t = begin(true, "0,1");
    check_refused(&t, "line 8: data periods (field 2) = 0");
}
END_TEST

START_TEST(rows_that_are_repeated) {
    text t = begin(true, "1,1,Data,Sunday,1/1,12/31"); /* four days twice: as many rows as a leap year */
    days_between(&t, 2001, 1, 1, 3, 4, false);
    days_between(&t, 2001, 3, 1, 12, 31, false);
    check_refused(&t, "line 1521 (2001-03-01 00:00) has the time of line 1425: 96 hours are there twice");
    t = begin(true, "1,1,Data,Sunday,1/1,12/31"); /* months out of order */
    days_between(&t, 2001, 2, 1, 2, 28, false);
    days_between(&t, 2001, 1, 1, 1, 31, false);
    days_between(&t, 2001, 3, 1, 12, 31, false);
    check_refused(&t, "line 681 (2001-01-01 00:00) is before the row above it: 744 hours are out of order");
    t = begin(true, "1,1,Data,Sunday,1/1,12/31"); /* a year twice */
    days_between(&t, 2001, 1, 1, 12, 31, false);
    days_between(&t, 2001, 1, 1, 12, 31, false);
    check_refused(&t, "line 8769 (2001-01-01 00:00) has the time of line 9: 8760 hours are there twice");
    t = begin(true, "1,1,Data,Sunday,6/21,6/21"); /* one row twice, and rows that change places */
    epw_day(&t, 2001, 6, 21, 0, 12, 1, 1);
    epw_day(&t, 2001, 6, 21, 11, 24, 1, 1);
    check_refused(&t, "line 21 (2001-06-21 11:00) has the time of line 20: 1 hour is there twice");
    t = begin(false, NULL);
    wea_day(&t, 6, 21, 0, 12, 2);
    wea_day(&t, 6, 21, 13, 14, 2);
    wea_day(&t, 6, 21, 12, 13, 2);
    wea_day(&t, 6, 21, 14, 24, 2);
    check_refused(&t, "line 33 (2001-06-21 12:15) is before the row above it: 1 hour is out of order");
    t = begin(false, NULL);
    days_between(&t, 0, 1, 1, 12, 31, false);
    wea_day(&t, 1, 1, 0, 24, 1);
    check_refused(&t, "line 8767 (2001-01-01 00:30) has the time of line 7: 24 hours are there twice");
    t = begin(false, NULL); /* nothing but one time */
    wea_row(&t, 6, 21, .5);
    wea_row(&t, 6, 21, .5);
    check_refused(&t, "line 8 (2001-06-21 00:30) has the time of line 7: 1 hour is there twice");
    t = begin(false, NULL);
    wea_row(&t, 6, 21, .5);
    wea_row(&t, 6, 21, .501);
    check_refused(&t, "line 8 (2001-06-21 00:30) is 0.001 h after the row before it");
}
END_TEST

/* A WEA states nothing: days and hours that are chosen are taken, holes are not. */
START_TEST(chosen_rows) {
    text t = begin(false, NULL);
    for (int month = 1; month <= 12; month++) wea_day(&t, month, 21, 0, 24, 2);
    check_taken(&t, 12 * 48, .5, 12);
    t = begin(false, NULL); /* weeks of winter and of summer */
    days_between(&t, 0, 1, 10, 1, 16, false);
    days_between(&t, 0, 7, 10, 7, 16, false);
    check_taken(&t, 14 * 24, 1, 2);
    t = begin(false, NULL); /* hours of every day, with a pause */
    for (int day = 1; day <= 20; day++) {
        wea_day(&t, 6, day, 8, 12, 4);
        wea_day(&t, 6, day, 14, 18, 4);
    }
    check_taken(&t, 20 * 32, .25, 40);
    t = begin(false, NULL); /* hours with sun: days grow and shrink */
    for (int day = 1; day <= 31; day++)
        wea_day(&t, 12, day, day < 10 || day > 25 ? 7 : 8, day < 14 ? 17 : 16, 1);
    check_taken(&t, 9 * 10 + 4 * 9 + 12 * 8 + 6 * 9, 1, 31);
    t = begin(false, NULL);
    wea_day(&t, 6, 21, 9, 17, 1);
    check_taken(&t, 8, 1, 1);
    t = begin(false, NULL); /* some times of a day */
    wea_row(&t, 6, 21, 9.5);
    wea_day(&t, 6, 21, 14, 16, 1);
    check_taken(&t, 3, 1, 2);
}
END_TEST

START_TEST(holes_in_a_wea) {
    text t = begin(false, NULL);
    days_between(&t, 0, 1, 1, 3, 4, false);
    days_between(&t, 0, 3, 6, 12, 31, false);
    check_refused(&t, "line 1519 (2001-03-06 00:30): before it 24 hours are missing");
    t = begin(false, NULL);
    days_between(&t, 0, 6, 20, 6, 20, false);
    days_between(&t, 0, 6, 22, 6, 22, false);
    check_refused(&t, "line 31 (2001-06-22 00:30): before it 24 hours are missing");
    t = begin(false, NULL);
    wea_day(&t, 6, 21, 0, 12, 1);
    wea_day(&t, 6, 21, 13, 24, 1);
    check_refused(&t, "line 19 (2001-06-21 13:30): before it 1 hour is missing");
    t = begin(false, NULL); /* an hour of the night of a file of whole days */
    days_between(&t, 0, 6, 1, 6, 9, false);
    wea_day(&t, 6, 10, 1, 24, 1);
    days_between(&t, 0, 6, 11, 6, 20, false);
    check_refused(&t, "(2001-06-10 01:30): before it 1 hour is missing");
    t = begin(false, NULL); /* one row of hours that are chosen, at noon and at the end */
    for (int day = 1; day <= 20; day++)
        for (int hour = 8; hour < 18; hour++)
            if (day != 9 || hour != 13) wea_row(&t, 6, day, hour + .5);
    check_refused(&t, "(2001-06-09 14:30): before it 1 hour is missing");
    t = begin(false, NULL);
    for (int day = 1; day <= 20; day++) wea_day(&t, 6, day, 8, day == 9 ? 17 : 18, 1);
    check_refused(&t, "hours are missing");
    t = begin(false, NULL);
    wea_day(&t, 6, 20, 0, 24, 1);
    wea_day(&t, 6, 21, 12, 24, 1);
    check_refused(&t, "(2001-06-21 12:30): before it 12 hours are missing");
}
END_TEST

int main(void) {
    Suite *s = suite_create("weather_times");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 60);
    tcase_add_test(c, steps);
    tcase_add_test(c, mixed_steps);
    tcase_add_test(c, whole_years);
    tcase_add_test(c, days_of_a_period);
    tcase_add_test(c, rows_outside_of_the_header);
    tcase_add_test(c, rows_that_are_missing);
    tcase_add_test(c, rows_that_are_repeated);
    tcase_add_test(c, chosen_rows);
    tcase_add_test(c, holes_in_a_wea);
    suite_add_tcase(s, c);
    return suite_run(s);
}
