/* The body of a request for skies: what is read, what is refused, and texts that are cut. */
#include "solver/codec/sky_request.h"
#include "support/request_text.h"
#include "support/suite.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static sky_request skies[SKY_REQUEST_MOST];

static unsigned read_text(const char *text, size_t length, size_t *n) {
    const codec_scene scene = {.n = 1, .n_channels = 1};
    problem why = {0};
    char *exact = request_text_exact(text, length);
    const bool good = codec_read_skies_json(&scene, exact, length, skies, n, &why);
    ck_assert_int_eq(good, why.status == 0);
    ck_assert(good || why.detail[0] != '\0');
    free(exact);
    return why.status;
}

START_TEST(members) {
    static const char text[] =
        "{\"skies\":[\"even\",{\"name\":\"clear\",\"place\":{\"zone\":-3,\"latitude\":1,\"longitude\":2},"
        "\"date\":\"1 May 9:00\"},"
        "{\"direct\":5,\"diffuse\":6,\"dew_point\":7,\"sun\":{\"azimuth\":8,\"altitude\":9},\"lux_outside\":"
        "10,\"north\":-11,"
        "\"photometric\":true,\"sun_in_tiles\":false},{\"weather\":true,\"hour\":12.5,\"gaps\":\"fill\"},"
        "{\"diffuse\":1,\"direct_horizontal\":2,\"place\":{\"zone\":0,\"latitude\":1,\"longitude\":2},"
        "\"year\":1999,\"hour\":3,\"sun_spread\":true,\"dark\":true}]}";
    size_t n = 0;
    ck_assert_uint_eq(read_text(text, sizeof text - 1, &n), 0);
    ck_assert_uint_eq(n, 5);
    ck_assert_str_eq(skies[0].name, "even");
    ck_assert(isnan(skies[0].hour) && isnan(skies[0].azimuth) && skies[0].sun_in_tiles &&
              !skies[0].photometric);
    ck_assert_int_eq(skies[1].source, SKY_BY_NAME);
    ck_assert_str_eq(skies[1].date, "1 May 9:00");
    ck_assert_double_eq(skies[1].place.latitude * 100 + skies[1].place.longitude * 10 + skies[1].place.zone,
                        117);
    ck_assert_int_eq(skies[2].source, SKY_BY_LIGHT);
    ck_assert_double_eq(skies[2].direct, 5);
    ck_assert_double_eq(skies[2].diffuse, 6);
    ck_assert_double_eq(skies[2].dew_point, 7);
    ck_assert_double_eq(skies[2].azimuth, 8);
    ck_assert_double_eq(skies[2].altitude, 9);
    ck_assert_double_eq(skies[2].lux_outside, 10);
    ck_assert_double_eq(skies[2].north, -11);
    ck_assert(skies[2].photometric && !skies[2].sun_in_tiles);
    ck_assert_int_eq(skies[3].source, SKY_BY_WEATHER);
    ck_assert_double_eq(skies[3].hour, 12.5);
    ck_assert_str_eq(skies[3].gaps, "fill");
    ck_assert(!skies[3].sun_spread && !skies[3].dark && isnan(skies[3].year));
    ck_assert_double_eq(skies[4].direct_horizontal, 2);
    ck_assert(isnan(skies[4].direct) && skies[4].sun_spread && skies[4].dark);
    ck_assert_double_eq(skies[4].year, 1999);
    /* Every beginning of it is refused, and every byte that is another does no harm. */
    for (size_t length = 0; length + 1 < sizeof text; length++)
        ck_assert_uint_eq(read_text(text, length, &n), 400);
    char changed[sizeof text];
    for (size_t at = 0; at + 1 < sizeof text; at++)
        for (const char *c = "\"{[,:9-\0"; *c != '\0'; c++) {
            memcpy(changed, text, sizeof text);
            changed[at] = *c;
            read_text(changed, sizeof text - 1, &n);
        }
}
END_TEST

START_TEST(refused) {
    static const char *const wrong[] = {
        "{}",
        "[]",
        "{\"sky\":1}",
        "{\"sky\":{}}",
        "{\"sky\":\"\"}",
        "{\"skies\":[]}",
        "{\"sky\":\"a\",\"skies\":[\"a\"]}",
        "{\"sky\":\"a\",\"sky\":\"a\"}",
        "{\"sky\":{\"weather\":false}}",
        "{\"sky\":{\"name\":\"a\",\"weather\":true}}",
        "{\"sky\":{\"name\":\"a\",\"direct\":1}}",
        "{\"sky\":{\"direct\":1}}",
        "{\"sky\":{\"diffuse\":3001}}",
        "{\"sky\":{\"diffuse\":1e400}}",
        "{\"sky\":{\"name\":\"a\",\"sun\":{\"azimuth\":1}}}",
        "{\"sky\":{\"name\":\"a\",\"sun\":1}}",
        "{\"sky\":{\"name\":\"a\",\"date\":\"b\",\"hour\":1}}",
        "{\"sky\":{\"weather\":true,\"lux_outside\":1}}",
        "{\"sky\":{\"diffuse\":1,\"direct\":1,\"direct_horizontal\":1}}",
        "{\"sky\":{\"name\":\"a\",\"direct_horizontal\":1}}",
        "{\"sky\":{\"diffuse\":1,\"year\":1999}}",
        "{\"sky\":{\"diffuse\":1,\"place\":{\"zone\":0,\"latitude\":1,\"longitude\":2},\"year\":1999.5}}",
        "{\"sky\":{\"weather\":true,\"year\":1999}}",
        "{\"sky\":{\"name\":\"0123456789012345678901234567890123456789012345678\"}}"};
    size_t n;
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++)
        ck_assert_msg(read_text(wrong[i], strlen(wrong[i]), &n) == 422, "%s", wrong[i]);
}
END_TEST

static unsigned read_sun(const char *text, size_t length, sun_request *out) {
    const codec_scene scene = {.n_channels = 1};
    problem why = {0};
    char *exact = request_text_exact(text, length);
    const bool good = codec_read_sun_json(&scene, exact, length, out, &why);
    ck_assert_int_eq(good, why.status == 0);
    ck_assert(good || why.detail[0] != '\0');
    free(exact);
    return why.status;
}

START_TEST(suns) {
    static const char text[] = "{\"hours\":[0,12.5,8760],\"place\":{\"zone\":-3,\"longitude\":2,"
                               "\"latitude\":1},\"year\":1999}";
    static const char *const wrong[] = {"{}",
                                        "{\"hours\":[1]}",
                                        "{\"place\":{\"zone\":0,\"latitude\":1,\"longitude\":2}}",
                                        "{\"hours\":[8761]}",
                                        "{\"hours\":[-1]}",
                                        "{\"hours\":1}",
                                        "{\"year\":1.5}",
                                        "{\"place\":{\"zone\":0}}",
                                        "{\"date\":\"1 May 9:00\"}"};
    sun_request out = {.hours = malloc(SUN_REQUEST_MOST * sizeof *out.hours)};
    ck_assert_uint_eq(read_sun(text, sizeof text - 1, &out), 0);
    ck_assert_uint_eq(out.n_hours, 3);
    ck_assert(out.hours[0] == 0 && out.hours[1] == 12.5 && out.hours[2] == 8760);
    ck_assert(out.place.latitude == 1 && out.place.longitude == 2 && out.place.zone == -3 &&
              out.year == 1999);
    for (size_t length = 0; length + 1 < sizeof text; length++)
        ck_assert_uint_eq(read_sun(text, length, &out), 400);
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++)
        ck_assert_msg(read_sun(wrong[i], strlen(wrong[i]), &out) == 422, "%s", wrong[i]);
    /* One more than there is room for. */
    const size_t bytes = 16 + 2 * ((size_t)SUN_REQUEST_MOST + 1);
    char *many = malloc(bytes);
    size_t at = (size_t)sprintf(many, "{\"hours\":[");
    for (size_t k = 0; k <= SUN_REQUEST_MOST; k++) {
        many[at++] = '1';
        many[at++] = k < SUN_REQUEST_MOST ? ',' : ']';
    }
    many[at++] = '}';
    ck_assert_uint_eq(read_sun(many, at, &out), 422);
    free(many);
    free(out.hours);
}
END_TEST

static unsigned read_weather(const char *text, bool beside, weather_request *out) {
    const codec_scene scene = {.n_channels = 1};
    problem why = {0};
    char *exact = request_text_exact(text, strlen(text));
    const bool good = codec_read_weather_json(&scene, beside, exact, strlen(text), out, &why);
    ck_assert_int_eq(good, why.status == 0);
    ck_assert(good || (why.detail[0] != '\0' && out->text == NULL));
    free(exact);
    return why.status;
}

START_TEST(weathers) {
    weather_request out;
    ck_assert_uint_eq(read_weather("{\"gaps\":\"fill\",\"text\":\"a\\nb\"}", false, &out), 0);
    ck_assert_uint_eq(out.length, 3);
    ck_assert_int_eq(memcmp(out.text, "a\nb", 3), 0);
    ck_assert_str_eq(out.gaps, "fill");
    free(out.text);
    ck_assert_uint_eq(read_weather("{}", true, &out), 0);
    ck_assert(out.text == NULL && out.gaps[0] == '\0');
    ck_assert_uint_eq(read_weather("{}", false, &out), 422);
    ck_assert_uint_eq(read_weather("{\"text\":\"a\"}", true, &out), 422);
    ck_assert_uint_eq(read_weather("{\"text\":\"\"}", false, &out), 422);
    ck_assert_uint_eq(read_weather("{\"text\":1}", false, &out), 422);
    ck_assert_uint_eq(read_weather("{\"text\":\"a\",\"text\":\"b\"}", false, &out), 422);
    ck_assert_uint_eq(read_weather("{\"text\":\"a\"", false, &out), 400);
}
END_TEST

int main(void) {
    Suite *s = suite_create("codec_skies");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 60);
    tcase_add_test(c, members);
    tcase_add_test(c, refused);
    tcase_add_test(c, suns);
    tcase_add_test(c, weathers);
    suite_add_tcase(s, c);
    return suite_run(s);
}
