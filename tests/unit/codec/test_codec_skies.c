/* The body of a request for skies: what is read, what is refused, and texts that are cut. */
#include "solver/codec/sky_request.h"
#include "support/request_text.h"
#include "support/suite.h"

#include <math.h>
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
        "\"photometric\":true,\"sun_in_tiles\":false},{\"weather\":true,\"hour\":12.5,\"gaps\":\"fill\"}]}";
    size_t n = 0;
    ck_assert_uint_eq(read_text(text, sizeof text - 1, &n), 0);
    ck_assert_uint_eq(n, 4);
    ck_assert_str_eq(skies[0].name, "even");
    ck_assert(isnan(skies[0].hour) && isnan(skies[0].azimuth) && skies[0].sun_in_tiles &&
              !skies[0].photometric);
    ck_assert_int_eq(skies[1].source, SKY_BY_NAME);
    ck_assert_str_eq(skies[1].date, "1 May 9:00");
    ck_assert_double_eq(skies[1].latitude * 100 + skies[1].longitude * 10 + skies[1].zone, 117);
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
        "{\"sky\":{\"name\":\"0123456789012345678901234567890123456789012345678\"}}"};
    size_t n;
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++)
        ck_assert_msg(read_text(wrong[i], strlen(wrong[i]), &n) == 422, "%s", wrong[i]);
}
END_TEST

int main(void) {
    Suite *s = suite_create("codec_skies");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 60);
    tcase_add_test(c, members);
    tcase_add_test(c, refused);
    suite_add_tcase(s, c);
    return suite_run(s);
}
