/* An answer that is encoded while it is sent has the bytes of one that is encoded as a whole, whatever the
 * rooms in which it is asked for. */
#include "solver/codec/answer_stream.h"
#include "support/suite.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static uint64_t next_random(uint64_t *state) {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return *state;
}

/* Numbers of all lengths in JSON, 0 among them, within half precision. */
static float *make_values(size_t count, uint64_t *state) {
    float *x = malloc(count * sizeof *x);
    for (size_t i = 0; i < count; i++) {
        const double unit = (double)(next_random(state) >> 11) * 0x1p-53;
        x[i] = i % 7 == 0   ? 0.0f
               : i % 5 == 0 ? (float)(i % 100)
                            : (float)(unit * pow(10, (double)(i % 15) - 10));
    }
    return x;
}

static const answer_notes notes = {.scene = "box", .has_time = true, .parse_ms = 1};

/* The whole, and the stream of it; x is taken over. */
static buffer encode(const answer_shape *shape, const media_accept *as, float *x, answer_stream **stream) {
    buffer whole = {0}, head = {0}, tail = {0};
    problem why = {0};
    ck_assert(answer_begin(&whole, shape, as, &notes, &why) && answer_begin(&head, shape, as, &notes, &why));
    ck_assert(answer_add(&whole, shape, as, 0, shape->n_rhs, x, &why));
    ck_assert(answer_end(&whole, shape, as, &notes, &why) && answer_end(&tail, shape, as, &notes, &why));
    ck_assert(answer_check_encoding(shape, as, x, &why));
    *stream = answer_stream_create(shape, as, &head, x, &tail);
    ck_assert_ptr_nonnull(*stream);
    return whole;
}

/* Reads all in rooms of `least` to `most` bytes, each a block of its own so that a byte behind it is found.
 */
static void compare(const buffer *whole, answer_stream *stream, size_t least, size_t most, uint64_t *state) {
    size_t at = 0;
    for (;;) {
        const size_t room = least + next_random(state) % (most - least + 1);
        char *to = malloc(room), *ahead = malloc(room);
        const size_t seen = answer_stream_look(stream, ahead, room),
                     count = answer_stream_read(stream, to, room);
        ck_assert_uint_le(count, room);
        ck_assert_uint_eq(seen, count);
        ck_assert_uint_le(at + count, whole->length);
        ck_assert(memcmp(to, whole->bytes + at, count) == 0 && memcmp(ahead, to, count) == 0);
        free(to);
        free(ahead);
        if (count == 0) break;
        at += count;
    }
    ck_assert_uint_eq(at, whole->length);
}

START_TEST(bytes_are_those_of_the_whole) {
    static const media_accept kinds[] = {{.type = MEDIA_JSON},
                                         {.type = MEDIA_NPY, .npy = NPY_F2},
                                         {.type = MEDIA_NPY, .npy = NPY_F4},
                                         {.type = MEDIA_NPY, .npy = NPY_F8}};
    static const size_t rooms[][2] = {{ANSWER_STREAM_LEAST, ANSWER_STREAM_LEAST},
                                      {ANSWER_STREAM_LEAST, 200},
                                      {1000, 40000},
                                      {1 << 20, 1 << 20}};
    uint64_t state = 7;
    for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++)
        for (size_t n_rhs = 1; n_rhs <= 3; n_rhs += 2)
            for (size_t C = 1; C <= 3; C += 2)
                for (size_t n = 1; n <= 1000; n = n * 9 + 1)
                    for (size_t r = 0; r < sizeof rooms / sizeof rooms[0]; r++) {
                        const answer_shape shape = {.n = n + 3,
                                                    .n_channels = C,
                                                    .n_rhs = n_rhs,
                                                    .batch = n_rhs > 1 || r == 1,
                                                    .n_values = n};
                        answer_stream *stream;
                        buffer whole = encode(&shape, &kinds[k], make_values(n_rhs * C * n, &state), &stream);
                        ck_assert_uint_le(whole.length, answer_bytes_most(&shape, &kinds[k]));
                        ck_assert_uint_le(whole.length, answer_stream_most(stream));
                        ck_assert_uint_ge(answer_stream_held(stream), n_rhs * C * n * sizeof(float));
                        ck_assert_uint_eq(answer_stream_length(stream),
                                          kinds[k].type == MEDIA_JSON ? UINT64_MAX : whole.length);
                        compare(&whole, stream, rooms[r][0], rooms[r][1], &state);
                        answer_stream_free(stream);
                        buffer_free(&whole);
                    }
}
END_TEST

START_TEST(numbers_outside_an_encoding_are_refused) {
    const answer_shape shape = {.n = 2, .n_channels = 1, .n_rhs = 1, .n_values = 2};
    const float far[] = {1, 1e5f}, none[] = {1, INFINITY};
    problem why = {0};
    ck_assert(answer_check_encoding(&shape, &(media_accept){.type = MEDIA_JSON}, far, &why));
    ck_assert(!answer_check_encoding(&shape, &(media_accept){.type = MEDIA_NPY, .npy = NPY_F2}, far, &why));
    ck_assert_uint_eq(why.status, 422);
    ck_assert(!answer_check_encoding(&shape, &(media_accept){.type = MEDIA_JSON}, none, &why));
}
END_TEST

START_TEST(sizes_that_overflow_are_the_largest) {
    const answer_shape shape = {.n_channels = 3, .n_rhs = SIZE_MAX / 4, .n_values = 1000};
    ck_assert_uint_eq(answer_bytes_most(&shape, &(media_accept){.type = MEDIA_JSON}), SIZE_MAX);
    ck_assert_uint_eq(answer_bytes_most(&shape, &(media_accept){.type = MEDIA_NPY, .npy = NPY_F8}), SIZE_MAX);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("answer_stream");
    TCase *all = tcase_create("all");
    tcase_add_test(all, bytes_are_those_of_the_whole);
    tcase_add_test(all, numbers_outside_an_encoding_are_refused);
    tcase_add_test(all, sizes_that_overflow_are_the_largest);
    suite_add_tcase(suite, all);
    return suite_run(suite);
}
