/* Accept-Encoding, and when a body is coded: what is coded comes back as it was, what does not shrink stays.
 */
#include "server/route/content_coding.h"
#include "support/suite.h"

#include <string.h>

/* The other side, by the same libraries: what a client does. */
#define ZLIB_CONST
#include <zlib.h>
#include <zstd.h>

START_TEST(headers_choose) {
    static const struct {
        const char *header;
        content_coding coding;
        bool forced;
    } cases[] = {
        {NULL, CODING_IDENTITY, false},
        {"", CODING_IDENTITY, false},
        {"gzip", CODING_GZIP, false},
        {"x-gzip", CODING_GZIP, false},
        {"GZip", CODING_GZIP, false},
        {"zstd", CODING_ZSTD, false},
        {"gzip, deflate, br, zstd", CODING_ZSTD, false},
        {"gzip, deflate", CODING_GZIP, false},
        {"deflate, br", CODING_IDENTITY, false},
        {"gzip;q=1, zstd;q=0.9", CODING_GZIP, false},
        {"gzip;q=0.899,zstd;q=0.9", CODING_ZSTD, false},
        {"zstd;q=0, gzip", CODING_GZIP, false},
        {"zstd;q=0.000, gzip ; q=0", CODING_IDENTITY, false},
        {"*", CODING_ZSTD, false},
        {"*, zstd;q=0", CODING_GZIP, false},
        {"gzip, *;q=0", CODING_GZIP, true},
        {"*;q=0", CODING_IDENTITY, false},
        {"identity", CODING_IDENTITY, false},
        {"identity;q=0", CODING_IDENTITY,
         false}, /* nothing else is liked, and it is no 406 of the contract */
        {"identity;q=0, gzip", CODING_GZIP, true},
        {"identity;q=0, *", CODING_ZSTD, true},
        {"identity;q=1, gzip;q=0.5", CODING_IDENTITY, false},
        {"identity;q=0.5, *;q=0.5, gzip;q=0.4", CODING_ZSTD, false},
        {"identity;q=0.5, gzip;q=0.5", CODING_GZIP, false},
        {"identity;q=0.5, *;q=0", CODING_IDENTITY, false},
        {"gzip;q=nan", CODING_IDENTITY, false},
        {"gzip;q=0x1", CODING_IDENTITY, false},
        {"gzip;q=-1", CODING_IDENTITY, false},
        {"gzip;q=", CODING_IDENTITY, false},
        {"gzip;q", CODING_GZIP, false},
        {"gzip;level=9;q=0.5, zstd;q=.6", CODING_GZIP, false}, /* a weight begins with 0 or 1 */
        {",,;;=,gzip", CODING_GZIP, false},
        {"gzipped, zstdx, xgzip", CODING_IDENTITY, false},
        {"\t gzip \t;\tq=1\t", CODING_GZIP, false},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const coding_choice choice = coding_choose(cases[i].header);
        ck_assert_msg(choice.coding == cases[i].coding && choice.forced == cases[i].forced, "%s: %s%s",
                      cases[i].header, coding_name(choice.coding), choice.forced ? " forced" : "");
    }
}
END_TEST

static size_t decode(content_coding coding, const buffer *b, char *out, size_t room) {
    if (coding == CODING_ZSTD) {
        const size_t length = ZSTD_decompress(out, room, b->bytes, b->length);
        ck_assert(!ZSTD_isError(length));
        return length;
    }
    z_stream z = {.next_in = (const Bytef *)b->bytes,
                  .avail_in = (uInt)b->length,
                  .next_out = (Bytef *)out,
                  .avail_out = (uInt)room};
    ck_assert_int_eq(inflateInit2(&z, 15 + 16), Z_OK);
    ck_assert_int_eq(inflate(&z, Z_FINISH), Z_STREAM_END);
    ck_assert_int_eq(inflateEnd(&z), Z_OK);
    ck_assert_uint_eq(z.avail_in, 0);
    return room - z.avail_out;
}

typedef enum content { TEXT, NOISE, MIXED } content;

/* TEXT shrinks, NOISE does not; of MIXED only the first twentieth shrinks. */
static buffer make(content what, size_t length) {
    buffer b = {0};
    uint32_t state = 12345;
    ck_assert(buffer_reserve(&b, length));
    for (; b.length < length; b.length++) {
        state = state * 1664525u + 1013904223u;
        const bool text = what == TEXT || (what == MIXED && b.length < length / 20);
        b.bytes[b.length] = text ? (char)('0' + (state >> 24) % 8) : (char)(state >> 24);
    }
    return b;
}

/* Codes a copy; whether it was, and that it comes back. */
static bool is_coded(const buffer *original, coding_choice choice) {
    buffer b = {0};
    ck_assert(buffer_append(&b, original->bytes, original->length));
    const content_coding coding = coding_apply(&b, choice);
    if (coding == CODING_IDENTITY) {
        ck_assert_uint_eq(b.length, original->length);
        ck_assert(memcmp(b.bytes, original->bytes, b.length) == 0);
    } else {
        ck_assert_int_eq(coding, choice.coding);
        char *back = malloc(original->length + 1);
        ck_assert_uint_eq(decode(coding, &b, back, original->length + 1), original->length);
        ck_assert(memcmp(back, original->bytes, original->length) == 0);
        free(back);
        if (!choice.forced) ck_assert_uint_le(b.length, original->length / 5 * 4);
    }
    buffer_free(&b);
    return coding != CODING_IDENTITY;
}

START_TEST(bodies_are_coded_where_it_pays) {
    /* Eight letters alike are 3 bits of 8; below and above the length from which samples are looked at. */
    static const size_t lengths[] = {0, 1, COMPRESS_LEAST - 1, COMPRESS_LEAST, 5000, 100000, 196608, 1000003};
    for (int c = CODING_GZIP; c <= CODING_ZSTD; c++)
        for (size_t i = 0; i < sizeof lengths / sizeof lengths[0]; i++)
            for (int what = TEXT; what <= MIXED; what++) {
                buffer b = make((content)what, lengths[i]);
                const coding_choice free_choice = {(content_coding)c, false},
                                    forced = {(content_coding)c, true};
                ck_assert_int_eq(is_coded(&b, free_choice), what == TEXT && lengths[i] >= COMPRESS_LEAST);
                ck_assert(b.bytes == NULL || is_coded(&b, forced));
                buffer_free(&b);
            }
}
END_TEST

/* Codes b by a coder that gets and gives pieces of any length. */
static buffer code_in_pieces(const buffer *b, content_coding coding, size_t piece, size_t room) {
    buffer coded = {0};
    coder *c = coder_create(coding);
    char *to = malloc(room);
    size_t at = 0, left = 0, written;
    const char *bytes = b->bytes;
    bool ended = false;
    ck_assert_ptr_nonnull(c);
    while (!ended) {
        if (left == 0 && at < b->length) {
            bytes = b->bytes + at;
            left = b->length - at < piece ? b->length - at : piece;
            at += left;
        }
        ck_assert(coder_run(c, &bytes, &left, at == b->length && left == 0, to, room, &written, &ended));
        ck_assert(buffer_append(&coded, to, written));
    }
    free(to);
    coder_free(c);
    return coded;
}

START_TEST(pieces_are_coded_as_one) {
    static const size_t pieces[] = {1, 1000, 16384, 1 << 20}, rooms[] = {64, 5000, 65536};
    for (int coding = CODING_GZIP; coding <= CODING_ZSTD; coding++)
        for (int what = TEXT; what <= MIXED; what++)
            for (size_t p = 0; p < 4; p++)
                for (size_t r = 0; r < 3; r++) {
                    buffer b = make((content)what, pieces[p] == 1 ? 3000 : 300001);
                    buffer coded = code_in_pieces(&b, (content_coding)coding, pieces[p], rooms[r]);
                    char *back = malloc(b.length + 1);
                    ck_assert_uint_eq(decode((content_coding)coding, &coded, back, b.length + 1), b.length);
                    ck_assert(memcmp(back, b.bytes, b.length) == 0);
                    if (what != MIXED)
                        ck_assert_int_eq(coding_pays((content_coding)coding, b.bytes, b.length),
                                         what == TEXT);
                    free(back);
                    buffer_free(&coded);
                    buffer_free(&b);
                }
}
END_TEST

START_TEST(whole_bodies_are_coded_whatever_they_hold) {
    static const size_t lengths[] = {0, 1, 1000, 300001, 3 << 20};
    for (int coding = CODING_GZIP; coding <= CODING_ZSTD; coding++)
        for (int what = TEXT; what <= MIXED; what++)
            for (size_t i = 0; i < sizeof lengths / sizeof *lengths; i++) {
                buffer b = make((content)what, lengths[i]), coded = {0};
                char *back = malloc(b.length + 1);
                ck_assert(
                    coding_whole((content_coding)coding, b.bytes != NULL ? b.bytes : "", b.length, &coded));
                ck_assert_uint_le(coded.capacity, coding_bytes_most(b.length));
                ck_assert_uint_eq(decode((content_coding)coding, &coded, back, b.length + 1), b.length);
                ck_assert(b.length == 0 || memcmp(back, b.bytes, b.length) == 0);
                free(back);
                buffer_free(&coded);
                buffer_free(&b);
            }
}
END_TEST

START_TEST(identity_touches_nothing) {
    buffer b = make(TEXT, 5000);
    const char *before = b.bytes;
    ck_assert_int_eq(coding_apply(&b, (coding_choice){CODING_IDENTITY, false}), CODING_IDENTITY);
    ck_assert_ptr_eq(b.bytes, before);
    buffer_free(&b);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("codec_compress");
    TCase *all = tcase_create("all");
    tcase_add_test(all, headers_choose);
    tcase_add_test(all, bodies_are_coded_where_it_pays);
    tcase_add_test(all, pieces_are_coded_as_one);
    tcase_add_test(all, whole_bodies_are_coded_whatever_they_hold);
    tcase_add_test(all, identity_touches_nothing);
    suite_add_tcase(suite, all);
    return suite_run(suite);
}
