/* Weather files: values are read; every wrong line is refused with its place and the allowed range. */
#include "solver/daylight/weather.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>
#include <unistd.h>

#define WEA_HEAD                                                                                             \
    "place Somewhere_XX\nlatitude 37.5\nlongitude 122.25\ntime_zone 120\nsite_elevation 2.0\n"               \
    "weather_data_file_units 1\n"
#define EPW_PLACE "LOCATION,Some Where,CA,USA,TMY3,724930,37.5,-122.25,-8.0,2.0\n"
#define EPW_MIDDLE                                                                                           \
    "DESIGN CONDITIONS,0\nTYPICAL/EXTREME PERIODS,0\nGROUND TEMPERATURES,0\n"                                \
    "HOLIDAYS/DAYLIGHT SAVINGS,No,0,0,0\nCOMMENTS 1,none\nCOMMENTS 2,\n"
#define EPW_HEAD EPW_PLACE EPW_MIDDLE "DATA PERIODS,1,1,Data,Sunday, 1/ 1,12/31\n"
#define EPW_NO_PERIOD EPW_PLACE EPW_MIDDLE "DATA PERIODS,1,1\n"
/* Up to the direct radiation: year, month, day, hour; dry bulb 15, then the dew point. */
#define EPW_ROW(date, dew) date ",0,?9?9,15.0," dew ",60,101300,0,0,300,400,"
#define EPW_TAIL ",0,0,0,0,180,2.0,5,5,20,1000,9,999999999,100,0.1,0,88,0.2,0,1\n"

/* A fresh file with this content; the caller unlinks it. */
static void write_file(char path[32], const char *extension, const char *text, size_t size) {
    snprintf(path, 32, "/tmp/test-XXXXXX%s", extension);
    const int descriptor = mkstemps(path, (int)strlen(extension));
    ck_assert_int_ge(descriptor, 0);
    ck_assert_int_eq(write(descriptor, text, size), (ssize_t)size);
    close(descriptor);
}

static lam_status read_text(const char *extension, const char *text, weather *w, lam_error *error) {
    char path[32];
    write_file(path, extension, text, strlen(text));
    const lam_status status = weather_read(path, WEATHER_REFUSE, w, error);
    unlink(path);
    return status;
}

static weather must_read(const char *extension, const char *text) {
    weather w = {0};
    lam_error error = {0};
    ck_assert_msg(read_text(extension, text, &w, &error) == LAM_OK, "%s", error.message);
    return w;
}

START_TEST(wea) {
    weather w = must_read(".wea", WEA_HEAD "1 1 0.500 0 0\n6 16 12.500 794 210.5\r\n12\t31  23.5 1 2 \n\n");
    ck_assert_str_eq(w.place, "Somewhere_XX");
    ck_assert_double_eq(w.latitude, 37.5);
    ck_assert_double_eq(w.longitude, -122.25); /* west is positive in the file */
    ck_assert_double_eq(w.time_zone, -8);
    ck_assert_double_eq(w.elevation, 2);
    ck_assert(!w.direct_is_horizontal);
    ck_assert_uint_eq(w.n, 3);
    ck_assert_int_eq(w.hours[1].year, 2001);
    ck_assert_int_eq(w.hours[1].month, 6);
    ck_assert_int_eq(w.hours[1].day, 16);
    ck_assert_double_eq(w.hours[1].hour, 12.5);
    ck_assert_double_eq(w.hours[1].direct, 794);
    ck_assert_double_eq(w.hours[1].diffuse, 210.5);
    ck_assert(isnan(w.hours[1].dew_point));
    ck_assert_double_eq(w.hours[2].diffuse, 2);
    weather_free(&w);
    ck_assert_ptr_null(w.hours);
    /* A leap day makes the year one; the last line may lack its end; direct light may be horizontal. */
    w = must_read(".WEA", "place\nlatitude -10\nlongitude -30\ntime_zone -30\nsite_elevation 0\n"
                          "weather_data_file_units 2\n2 29 12.5 1 1\n3 1 12.5 1 1");
    ck_assert_int_eq(w.hours[0].year, 2000);
    ck_assert_int_eq(w.hours[1].year, 2000);
    ck_assert_double_eq(w.longitude, 30);
    ck_assert_double_eq(w.time_zone, 2);
    ck_assert(w.direct_is_horizontal);
    weather_free(&w);
}
END_TEST

START_TEST(epw) {
    weather w = must_read(".epw", EPW_NO_PERIOD EPW_ROW("1983,5,31,24", "8.5") "0,0" EPW_TAIL EPW_ROW(
                                      "1990,6,1,1", "99.9") "794, 210" EPW_TAIL);
    ck_assert_str_eq(w.place, "Some Where");
    ck_assert_double_eq(w.latitude, 37.5);
    ck_assert_double_eq(w.longitude, -122.25);
    ck_assert_double_eq(w.time_zone, -8);
    ck_assert_double_eq(w.elevation, 2);
    ck_assert(!w.direct_is_horizontal);
    ck_assert_uint_eq(w.n, 2);
    ck_assert_int_eq(w.hours[0].year, 1983);
    ck_assert_double_eq(w.hours[0].hour, 23.5);
    ck_assert_double_eq(w.hours[0].dew_point, 8.5);
    ck_assert_int_eq(w.hours[1].year, 1990);
    ck_assert_int_eq(w.hours[1].day, 1);
    ck_assert_double_eq(w.hours[1].hour, .5);
    ck_assert_double_eq(w.hours[1].direct, 794);
    ck_assert_double_eq(w.hours[1].diffuse, 210);
    ck_assert(isnan(w.hours[1].dew_point));
    weather_free(&w);
    /* This file has a mark of UTF-8 and the ends of lines of another system; a row need not go on after the
     * two. */
    w = must_read(".Epw", "\xEF\xBB\xBF" EPW_NO_PERIOD EPW_ROW("2000,2,29,24", "1") "1,2\r\n");
    ck_assert_uint_eq(w.n, 1);
    ck_assert_double_eq(w.hours[0].hour, 23.5);
    weather_free(&w);
    w = must_read(".wea", "\xEF\xBB\xBF" WEA_HEAD "6 21 23.5 1 2\r\n");
    ck_assert_uint_eq(w.n, 1);
    weather_free(&w);
}
END_TEST

START_TEST(refused) {
    static const struct {
        const char *extension, *text, *wanted;
    } wrong[] = {
        {".wea", "", "ends at line 0, before its line place"},
        {".wea", "place x\nlatitude 1\n", "ends at line 2, before its line longitude"},
        {".wea", "hello\n", "line 1 begins with \"hello\", a WEA has place there"},
        {".wea", "placement\n", "a WEA has place there"},
        {".wea", EPW_HEAD, "a WEA has place there"},
        {".wea", "place x\nlatitude 91\n", "line 2: latitude = 91, must be from -90 to 90"},
        {".wea", "place x\nlatitude north\n", "line 2: latitude is \"north\", must be a number"},
        {".wea", "place x\nlatitude\n", "line 2: latitude is \"\", must be a number"},
        {".wea", "place x\nlatitude nan\n", "line 2: latitude is \"nan\""},
        {".wea", "place x\nlatitude 1e999\n", "line 2: latitude = inf, must be from"},
        {".wea", "place x\nlatitude 1\nlongitude 181\n", "line 3: longitude = 181, must be from -180 to 180"},
        {".wea", "place x\nlatitude 1\nlongitude 1\ntime_zone 240\n", "time_zone = 240"},
        {".wea", "place x\nlatitude 1\nlongitude 1\ntime_zone 0\nsite_elevation x\n", "site_elevation is"},
        {".wea",
         "place x\nlatitude 1\nlongitude 1\ntime_zone 0\nsite_elevation 0\nweather_data_file_units 3\n",
         "line 6: weather_data_file_units = 3, must be from 1 to 2"},
        {".wea",
         "place x\nlatitude 1\nlongitude 1\ntime_zone 0\nsite_elevation 0\nweather_data_file_units 1.5\n",
         "must be 1 (direct light facing the sun) or 2"},
        {".wea", WEA_HEAD, "no hours after its header of 6 lines"},
        {".wea", WEA_HEAD "1 1 0.5 0\n", "line 7 must hold five numbers"},
        {".wea", WEA_HEAD "1 1 0.5 0 0 0\n", "line 7 must hold five numbers"},
        {".wea", WEA_HEAD "1 1 0.5 0 0\n13 1 0.5 0 0\n", "line 8: month = 13, must be from 1 to 12"},
        {".wea", WEA_HEAD "1.5 1 0.5 0 0\n", "line 7: month = 1.5, must be a whole number from 1 to 12"},
        {".wea", WEA_HEAD "4 31 0.5 0 0\n", "line 7: day = 31, must be from 1 to 30"},
        {".wea", WEA_HEAD "2 30 0.5 0 0\n", "line 7: day = 30, must be from 1 to 29"},
        {".wea", WEA_HEAD "1 0 0.5 0 0\n", "line 7: day = 0, must be from 1 to 31"},
        {".wea", WEA_HEAD "1 1 24.5 0 0\n", "line 7: hour = 24.5, must be from 0 to 24"},
        {".wea", WEA_HEAD "1 1 -.5 0 0\n", "line 7: hour = -0.5"},
        {".wea", WEA_HEAD "1 1 .5 -11 0\n", "line 7: direct radiation = -11, must be from 0 to 3000"},
        {".wea", WEA_HEAD "1 1 .5 0 3001\n", "line 7: diffuse horizontal radiation = 3001"},
        {".wea", WEA_HEAD "1 1 12.5 9999 0\n",
         "line 7 (2001-01-01 12:30): direct radiation is missing by day; fill the gap, or give --gaps fill"},
        {".wea", WEA_HEAD "1 1 .5 0x10 0\n", "line 7: direct radiation is \"0x10\""},
        {".epw", "", "ends at line 0, before its line LOCATION"},
        {".epw", WEA_HEAD, "line 1 begins with \"place Somewhere_XX\", an EPW has LOCATION there"},
        {".epw", EPW_PLACE "DATA PERIODS,1,1\n", "line 2 begins with \"DATA PERIODS\", an EPW has DESIGN"},
        {".epw", "LOCATION,a,b,c\n", "line 1: LOCATION has 4 fields, needs 10"},
        {".epw", "LOCATION,a,b,c,d,e,-91,0,0,0\n", "line 1: latitude (field 7) = -91"},
        {".epw", "LOCATION,a,b,c,d,e,0,200,0,0\n", "line 1: longitude (field 8) = 200"},
        {".epw", "LOCATION,a,b,c,d,e,0,0,15,0\n", "line 1: time zone (field 9) = 15, must be from -14 to 14"},
        {".epw", "LOCATION,a,b,c,d,e,0,0,0,\n", "line 1: elevation (field 10) is \"\""},
        {".epw", EPW_PLACE EPW_MIDDLE "DATA PERIODS,1\n", "line 8: DATA PERIODS has 2 fields, needs 3"},
        {".epw", EPW_PLACE EPW_MIDDLE "DATA PERIODS,1,0,\n",
         "line 8: records an hour (field 3) = 0, must be from 1 to 60"},
        {".epw", EPW_HEAD EPW_ROW("1990,1,1,1", "1") "0,0\n",
         ": 8759 hours are missing; fill the gap or state"},
        {".epw", EPW_HEAD, "no hours after its header of 8 lines"},
        {".epw", EPW_HEAD "1990,1,1,1,0\n", "line 9 has 5 fields between commas, needs at least 16"},
        {".epw", EPW_HEAD EPW_ROW("90,1,1,1", "1") "0,0\n", "line 9: year (field 1) = 90, must be from 1900"},
        {".epw", EPW_HEAD EPW_ROW("1990,0,1,1", "1") "0,0\n", "line 9: month = 0"},
        {".epw", EPW_HEAD EPW_ROW("1990,2,29,1", "1") "0,0\n", "line 9: day = 29, must be from 1 to 28"},
        {".epw", EPW_HEAD EPW_ROW("1900,2,29,1", "1") "0,0\n", "line 9: day = 29, must be from 1 to 28"},
        {".epw", EPW_HEAD EPW_ROW("1990,1,1,0", "1") "0,0\n", "line 9: hour (field 4) = 0, must be from 1"},
        {".epw", EPW_HEAD EPW_ROW("1990,1,1,25", "1") "0,0\n", "line 9: hour (field 4) = 25"},
        {".epw", EPW_HEAD EPW_ROW("1990,1,1,1.5", "1") "0,0\n", "line 9: hour (field 4) = 1.5"},
        {".epw", EPW_HEAD EPW_ROW("1990,1,1,1", "x") "0,0\n", "line 9: dew point (field 8) is \"x\""},
        {".epw", EPW_HEAD EPW_ROW("1990,1,1,13", "1") "9999,0\n",
         "line 9 (1990-01-01 12:00): direct normal radiation (field 15) is missing by day"},
        {".epw", EPW_HEAD EPW_ROW("1990,1,1,13", "1") "0,9999\n",
         "line 9 (1990-01-01 12:00): diffuse horizontal radiation (field 16) is missing by day"},
        {".epw", EPW_HEAD EPW_ROW("1990,1,1,1", "1") "0,-30\n", "(field 16) = -30, must be from 0 to 3000"},
        {".epw", EPW_HEAD EPW_ROW("1990,1,1,1", "1") ",0\n", "(field 15) is \"\", must be a number"},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        weather w = {.n = 77};
        lam_error error = {0};
        ck_assert_msg(read_text(wrong[i].extension, wrong[i].text, &w, &error) == LAM_ERR_FORMAT,
                      "was read: %s", wrong[i].wanted);
        ck_assert_msg(strstr(error.message, wrong[i].wanted) != NULL, "\"%s\" lacks \"%s\"", error.message,
                      wrong[i].wanted);
        ck_assert_msg(strncmp(error.message, "/tmp/test-", 10) == 0, "%s", error.message);
        ck_assert_uint_eq(w.n, 77); /* untouched */
    }
}
END_TEST

START_TEST(not_a_text_file) {
    weather w = {0};
    lam_error error = {0};
    char path[32];
    ck_assert_int_eq(weather_read("/nonexistent/a.epw", WEATHER_REFUSE, &w, &error), LAM_ERR_IO);
    ck_assert_ptr_nonnull(strstr(error.message, "/nonexistent/a.epw"));
    ck_assert_int_eq(weather_read("/dev/zero", WEATHER_REFUSE, &w, &error), LAM_ERR_IO);
    ck_assert_int_eq(weather_read("/tmp", WEATHER_REFUSE, &w, &error), LAM_ERR_IO);
    write_file(path, ".wea", "place x\0y\n", 10);
    ck_assert_int_eq(weather_read(path, WEATHER_REFUSE, &w, &error), LAM_ERR_FORMAT);
    ck_assert_ptr_nonnull(strstr(error.message, "line 1 holds a zero byte"));
    unlink(path);
}
END_TEST

START_TEST(names) {
    ck_assert(weather_is_named("a.epw") && weather_is_named("b/a.EPW") && weather_is_named("a.b.wea"));
    ck_assert(!weather_is_named(".epw") && !weather_is_named("a.csv") && !weather_is_named("epw"));
}
END_TEST

int main(void) {
    Suite *s = suite_create("weather");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 60);
    tcase_add_test(c, wea);
    tcase_add_test(c, epw);
    tcase_add_test(c, refused);
    tcase_add_test(c, not_a_text_file);
    tcase_add_test(c, names);
    suite_add_tcase(s, c);
    return suite_run(s);
}
