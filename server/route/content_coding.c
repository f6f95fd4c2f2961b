#include "server/route/content_coding.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#define ZLIB_CONST
#include <zlib.h>
#include <zstd.h>

/* The fastest level of both. */
#define LEVEL 1

/* A much longer body is judged by this many samples of this length. */
#define N_SAMPLES 3
#define SAMPLE ((size_t)16 << 10)

/* Longer bodies would occupy a thread for more than half a second; zlib counts in 32 bits. */
#define LONGEST ((size_t)64 << 20)

static const char *const names[] = {"identity", "gzip", "zstd"};
#define N_CODINGS (sizeof names / sizeof names[0])

/* *word: the text up to one of the stops, without white space at its ends. */
static const char *take_word(const char *at, const char *stops, const char **word, size_t *length) {
    at += strspn(at, " \t");
    *word = at;
    at += strcspn(at, stops);
    *length = (size_t)(at - *word);
    while (*length > 0 && strchr(" \t", (*word)[*length - 1]) != NULL) --*length;
    return at;
}

static bool is_word(const char *word, size_t length, const char *name) {
    return strlen(name) == length && strncasecmp(word, name, length) == 0;
}

/* A weight in thousandths (0 to 1 with three decimals); anything else is 0. strtod would follow the locale
 * and accept 0x1 and nan. */
static int read_weight(const char *word, size_t length) {
    int weight = 0, scale = 1000;
    if (length == 0 || (word[0] != '0' && word[0] != '1') || (length > 1 && word[1] != '.')) return 0;
    weight = (word[0] - '0') * scale;
    for (size_t i = 2; i < length; i++) {
        if (word[i] < '0' || word[i] > '9') return 0;
        scale /= 10;
        weight += (word[i] - '0') * scale;
    }
    return weight > 1000 ? 1000 : weight;
}

/* The weights of the codings in thousandths; -1: not named. */
static void read_weights(const char *header, int weights[N_CODINGS], int *others) {
    const char *at = header == NULL ? "" : header;
    *others = -1;
    for (size_t c = 0; c < N_CODINGS; c++) weights[c] = -1;
    while (*at != '\0') {
        const char *word, *value;
        size_t length, value_length;
        int weight = 1000;
        at = take_word(at, ";,", &word, &length);
        while (*at == ';') {
            const char *key;
            size_t key_length;
            at = take_word(at + 1, "=;,", &key, &key_length);
            if (*at != '=') continue;
            at = take_word(at + 1, ";,", &value, &value_length);
            if (is_word(key, key_length, "q")) weight = read_weight(value, value_length);
        }
        if (*at == ',') at++;
        if (is_word(word, length, "*")) *others = weight;
        if (is_word(word, length, "x-gzip")) weights[CODING_GZIP] = weight;
        for (size_t c = 0; c < N_CODINGS; c++)
            if (is_word(word, length, names[c])) weights[c] = weight;
    }
}

coding_choice coding_choose(const char *header) {
    int weights[N_CODINGS], others;
    read_weights(header, weights, &others);
    /* Identity is acceptable unless its name or the star has weight 0, and preferred to a coding only by its
     * name. */
    coding_choice choice = {CODING_IDENTITY, false};
    int best = weights[CODING_IDENTITY] > 0 ? weights[CODING_IDENTITY] : 0;
    for (size_t c = 0; c < N_CODINGS; c++)
        if (weights[c] < 0) weights[c] = others;
    const bool refused = weights[CODING_IDENTITY] == 0;
    for (int c = CODING_ZSTD; c > CODING_IDENTITY; c--) {
        if (weights[c] <= 0 || weights[c] < best || (weights[c] == best && choice.coding != CODING_IDENTITY))
            continue;
        best = weights[c];
        choice.coding = (content_coding)c;
    }
    choice.forced = refused && choice.coding != CODING_IDENTITY;
    return choice;
}

bool coding_accepts(const char *header, content_coding coding) {
    int weights[N_CODINGS], others;
    read_weights(header, weights, &others);
    const int weight = weights[coding] < 0 ? others : weights[coding];
    return weight > 0 && weight >= weights[CODING_IDENTITY];
}

const char *coding_name(content_coding coding) {
    return names[coding];
}

/* The compressed length; 0 if it does not fit or the coder failed. */
static size_t code_gzip(const char *bytes, size_t length, char *out, size_t room) {
    z_stream z = {0};
    size_t written = 0;
    /* 15 bits of window, and 16 for a gzip head. */
    if (deflateInit2(&z, LEVEL, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK) return 0;
    z.next_in = (const Bytef *)bytes;
    z.avail_in = (uInt)length;
    z.next_out = (Bytef *)out;
    z.avail_out = (uInt)room;
    if (deflate(&z, Z_FINISH) == Z_STREAM_END) written = room - z.avail_out;
    deflateEnd(&z);
    return written;
}

static size_t code_zstd(const char *bytes, size_t length, char *out, size_t room) {
    size_t written = ZSTD_compress(out, room, bytes, length, LEVEL);
    return ZSTD_isError(written) ? 0 : written;
}

static size_t code(content_coding coding, const char *bytes, size_t length, char *out, size_t room) {
    return coding == CODING_GZIP ? code_gzip(bytes, length, out, room) : code_zstd(bytes, length, out, room);
}

static size_t worth(size_t length) {
    return length / 5 * 4;
}

/* True if samples spread over the body shrink as much as the whole has to. */
static bool samples_shrink(content_coding coding, const buffer *b) {
    char out[SAMPLE];
    size_t coded = 0;
    for (size_t i = 0; i < N_SAMPLES; i++) {
        const size_t from = (b->length - SAMPLE) / (N_SAMPLES - 1) * i;
        const size_t length = code(coding, b->bytes + from, SAMPLE, out, sizeof out);
        coded += length == 0 ? SAMPLE : length;
    }
    return coded <= worth(N_SAMPLES * SAMPLE);
}

content_coding coding_apply(buffer *b, coding_choice choice) {
    buffer made = {0};
    if (choice.coding == CODING_IDENTITY || b->length > LONGEST) return CODING_IDENTITY;
    if (!choice.forced) {
        if (b->length < COMPRESS_LEAST) return CODING_IDENTITY;
        if (b->length >= 4 * N_SAMPLES * SAMPLE && !samples_shrink(choice.coding, b)) return CODING_IDENTITY;
    }
    /* If it has to shrink, the room is the limit: a coder that fills it stops there. */
    size_t room = worth(b->length);
    if (choice.forced)
        room = choice.coding == CODING_GZIP ? compressBound((uLong)b->length) + 32
                                            : ZSTD_compressBound(b->length);
    if (!buffer_reserve(&made, room)) return CODING_IDENTITY;
    made.length = code(choice.coding, b->bytes == NULL ? "" : b->bytes, b->length, made.bytes, room);
    if (made.length == 0) {
        buffer_free(&made);
        return CODING_IDENTITY;
    }
    buffer_free(b);
    *b = made;
    buffer_trim(b);
    return choice.coding;
}

/* Much that repeats itself shrinks to less than this share. */
#define FIRST_ROOM 4

size_t coding_bytes_most(size_t length) {
    /* Bytes that do not shrink grow by less than a thousandth and some heads; room grows by half. */
    return length / 2 * 3 + length / 512 + 4 * SAMPLE;
}

bool coding_whole(content_coding coding, const char *bytes, size_t length, buffer *to) {
    coder *c = coder_create(coding);
    bool ended = false, good = c != NULL;
    while (good && !ended) {
        /* zlib counts in 32 bits. */
        size_t written = 0, part = length < UINT32_MAX / 2 ? length : UINT32_MAX / 2;
        const bool last = part == length;
        length -= part;
        good = buffer_reserve(to, to->length > 0 ? SAMPLE : part / FIRST_ROOM + SAMPLE);
        const size_t room = good ? to->capacity - to->length - 1 : 0;
        good = good && coder_run(c, &bytes, &part, last, to->bytes + to->length,
                                 room < UINT32_MAX / 2 ? room : UINT32_MAX / 2, &written, &ended);
        length += part;
        to->length += written;
    }
    coder_free(c);
    if (good)
        buffer_trim(to);
    else
        buffer_free(to);
    return good;
}

uint32_t coding_crc32(const char *bytes, size_t length) {
    return (uint32_t)crc32_z(0, (const Bytef *)bytes, length);
}

bool coding_pays(content_coding coding, const char *bytes, size_t length) {
    char out[SAMPLE];
    if (length > SAMPLE) length = SAMPLE;
    const size_t coded = code(coding, bytes, length, out, sizeof out);
    return coded > 0 && coded <= worth(length);
}

struct coder {
    content_coding coding;
    z_stream z;
    ZSTD_CStream *zstd;
};

coder *coder_create(content_coding coding) {
    coder *c = calloc(1, sizeof *c);
    if (c == NULL) return NULL;
    c->coding = coding;
    bool good;
    if (coding == CODING_GZIP) {
        good = deflateInit2(&c->z, LEVEL, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) == Z_OK;
    } else {
        c->zstd = ZSTD_createCStream();
        good = c->zstd != NULL && !ZSTD_isError(ZSTD_initCStream(c->zstd, LEVEL));
    }
    if (good) return c;
    ZSTD_freeCStream(c->zstd);
    free(c);
    return NULL;
}

void coder_free(coder *c) {
    if (c == NULL) return;
    if (c->coding == CODING_GZIP) deflateEnd(&c->z);
    ZSTD_freeCStream(c->zstd);
    free(c);
}

static bool run_gzip(coder *c, const char **bytes, size_t *count, bool last, char *to, size_t room,
                     size_t *written, bool *ended) {
    /* zlib counts in 32 bits; callers bring far less. */
    c->z.next_in = (const Bytef *)*bytes;
    c->z.avail_in = (uInt)*count;
    c->z.next_out = (Bytef *)to;
    c->z.avail_out = (uInt)room;
    const int code = deflate(&c->z, last ? Z_FINISH : Z_NO_FLUSH);
    *bytes = (const char *)c->z.next_in;
    *count = c->z.avail_in;
    *written = room - c->z.avail_out;
    *ended = code == Z_STREAM_END;
    return code == Z_OK || code == Z_STREAM_END || code == Z_BUF_ERROR;
}

static bool run_zstd(coder *c, const char **bytes, size_t *count, bool last, char *to, size_t room,
                     size_t *written, bool *ended) {
    ZSTD_inBuffer in = {.src = *bytes, .size = *count};
    ZSTD_outBuffer out = {.dst = to, .size = room};
    const size_t left = ZSTD_compressStream2(c->zstd, &out, &in, last ? ZSTD_e_end : ZSTD_e_continue);
    *bytes += in.pos;
    *count -= in.pos;
    *written = out.pos;
    *ended = last && left == 0;
    return !ZSTD_isError(left);
}

bool coder_run(coder *c, const char **bytes, size_t *count, bool last, char *to, size_t room, size_t *written,
               bool *ended) {
    return (c->coding == CODING_GZIP ? run_gzip : run_zstd)(c, bytes, count, last, to, room, written, ended);
}
