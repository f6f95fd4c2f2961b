/* Measures the speed of the codecs: a dense emission of n numbers read from JSON, and as many floats written,
 * beside jansson doing the same, taking turns in one run.
 *
 *     bench_codec [-r ROUNDS] [N ...]
 *
 * CSV, times are medians in milliseconds; round_trips counts the floats that come back as they were.
 */
#include "solver/base/clock.h"
#include "solver/base/random.h"
#include "solver/bench/stats.h"
#include "solver/codec/answer.h"
#include "solver/codec/json_writer.h"
#include "solver/codec/request.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { READ, WRITE, JANSSON_READ, JANSSON_WRITE, MEASURED, MOST_ROUNDS = 99 };
static const char *const names[MEASURED] = {"read", "write", "jansson_read", "jansson_write"};

static void die(const char *what) {
    fprintf(stderr, "bench_codec: %s\n", what);
    exit(1);
}

static codec_scene scene_of(size_t n) {
    return (codec_scene){.n = n, .n_channels = 1, .max_batch = 1, .max_bytes = SIZE_MAX};
}

static size_t read_once(size_t n, const buffer *body, const float *wanted) {
    const codec_scene scene = scene_of(n);
    radiosity_request request = {0};
    problem why = {0};
    size_t same = 0;
    if (!codec_read_json(&scene, body->bytes, body->length, &request, &why)) die(why.detail);
    for (size_t i = 0; i < n && wanted != NULL; i++) same += request.E[i] == wanted[i];
    radiosity_request_free(&request);
    return same;
}

static size_t write_once(size_t n, const float *values) {
    const answer_shape shape = {.n = n, .n_channels = 1, .n_rhs = 1, .n_values = n};
    const media_accept as = {.type = MEDIA_JSON};
    const answer_notes notes = {.scene = "bench"};
    buffer b = {0};
    problem why = {0};
    if (!answer_begin(&b, &shape, &as, &notes, &why) || !answer_add(&b, &shape, &as, 0, 1, values, &why) ||
        !answer_end(&b, &shape, &as, &notes, &why))
        die(why.detail);
    const size_t length = b.length;
    buffer_free(&b);
    return length;
}

/* The same by jansson alone: a tree, and a walk over it. */
static void jansson_read_once(const buffer *body, float *E) {
    json_error_t error;
    json_t *all = json_loadb(body->bytes, body->length, 0, &error), *value;
    const json_t *array = json_object_get(all, "emission");
    size_t i;
    if (array == NULL) die(error.text);
    json_array_foreach(array, i, value) E[i] = (float)json_number_value(value);
    json_decref(all);
}

static void jansson_write_once(size_t n, const float *values) {
    json_t *all = json_object(), *array = json_array();
    for (size_t i = 0; i < n; i++) json_array_append_new(array, json_real((double)values[i]));
    json_object_set_new(all, "radiosity", array);
    char *text = json_dumps(all, JSON_REAL_PRECISION(9) | JSON_COMPACT);
    if (text == NULL) die("jansson: not enough memory");
    free(text);
    json_decref(all);
}

static void measure(size_t n, size_t rounds) {
    float *values = calloc(n, sizeof *values), *E = calloc(n, sizeof *E);
    buffer body = {0};
    double times[MEASURED][MOST_ROUNDS];
    if (values == NULL || E == NULL) die("not enough memory");
    uint64_t state = 1;
    for (size_t i = 0; i < n; i++) values[i] = random_to_float(random_lcg(&state));
    if (!buffer_append_text(&body, "{\"emission\":") || !json_write_floats(&body, values, n) ||
        !buffer_append_text(&body, "}"))
        die("not enough memory");
    const size_t same = read_once(n, &body, values);
    for (size_t r = 0; r < rounds; r++) {
        double at = clock_seconds();
        read_once(n, &body, NULL);
        times[READ][r] = clock_seconds() - at;
        at = clock_seconds();
        write_once(n, values);
        times[WRITE][r] = clock_seconds() - at;
        at = clock_seconds();
        jansson_read_once(&body, E);
        times[JANSSON_READ][r] = clock_seconds() - at;
        at = clock_seconds();
        jansson_write_once(n, values);
        times[JANSSON_WRITE][r] = clock_seconds() - at;
    }
    printf("%zu,%zu,%zu", n, body.length, same);
    for (int k = 0; k < MEASURED; k++) printf(",%.3f", 1e3 * stats_median(times[k], rounds));
    printf("\n");
    fflush(stdout);
    buffer_free(&body);
    free(values);
    free(E);
}

int main(int argc, char **argv) {
    size_t rounds = 21;
    int first = 1;
    if (argc > 2 && strcmp(argv[1], "-r") == 0) {
        rounds = (size_t)atol(argv[2]);
        first = 3;
    }
    if (rounds == 0 || rounds > MOST_ROUNDS) die("-r ROUNDS must be from 1 to 99");
    printf("n,bytes,round_trips");
    for (int k = 0; k < MEASURED; k++) printf(",%s_ms", names[k]);
    printf("\n");
    if (first == argc) {
        measure(10240, rounds);
        measure(163840, rounds);
    }
    for (int k = first; k < argc; k++) {
        const long n = atol(argv[k]);
        if (n <= 0) die("N must be a number above 0");
        measure((size_t)n, rounds);
    }
    return 0;
}
