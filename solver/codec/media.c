#include "solver/codec/media.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* One `name/name; key=value; ...` of a header, a piece at a time. */
typedef struct cursor {
    const char *at;
} cursor;

static void skip_space(cursor *c) {
    while (*c->at == ' ' || *c->at == '\t') c->at++;
}

/* Copies up to one of the stop characters, without space at its ends or quotes around it. */
static void take_piece(cursor *c, const char *stops, char *piece, size_t size) {
    size_t length = 0;
    skip_space(c);
    if (*c->at == '"') {
        for (c->at++; *c->at != '\0' && *c->at != '"'; c->at++) {
            if (*c->at == '\\' && c->at[1] != '\0') c->at++;
            if (length + 1 < size) piece[length++] = *c->at;
        }
        if (*c->at == '"') c->at++;
    }
    for (; *c->at != '\0' && strchr(stops, *c->at) == NULL; c->at++)
        if (length + 1 < size) piece[length++] = *c->at;
    while (length > 0 && (piece[length - 1] == ' ' || piece[length - 1] == '\t')) length--;
    piece[length] = '\0';
}

media_type media_content_type(const char *header) {
    char type[64];
    if (header == NULL) return MEDIA_JSON;
    take_piece(&(cursor){header}, ";,", type, sizeof type);
    if (strcasecmp(type, "application/json") == 0) return MEDIA_JSON;
    if (strcasecmp(type, "application/x-npy") == 0) return MEDIA_NPY;
    return MEDIA_OTHER;
}

/* The quality of an element of Accept, 0 to 1. */
static double read_quality(const char *text) {
    char *end;
    double q = strtod(text, &end);
    return end == text || !(q >= 0.0) ? 0.0 : q > 1.0 ? 1.0 : q;
}

static bool read_npy_type(const char *text, npy_type *type) {
    static const char *const names[] = {[NPY_F2] = "f2", [NPY_F4] = "f4", [NPY_F8] = "f8"};
    if (*text == '<') text++;
    for (int t = NPY_F2; t <= NPY_F8; t++) {
        if (strcasecmp(text, names[t]) != 0) continue;
        *type = (npy_type)t;
        return true;
    }
    return false;
}

/* A type in a header: its quality, 0 where it is not named, and its place among the types named. */
typedef struct named_type {
    double quality;
    size_t place;
} named_type;

/* True if a client likes one type better than another. */
static bool is_better(named_type one, named_type other) {
    return one.quality > other.quality || (one.quality >= other.quality && one.place < other.place);
}

static media_accept choose(const char *header, bool with_zip) {
    media_accept chosen = {MEDIA_JSON, NPY_F4, false};
    named_type json = {-1.0, SIZE_MAX}, npy = {0.0, SIZE_MAX}, zip = {0.0, SIZE_MAX};
    size_t place = 0;
    cursor c = {header == NULL ? "" : header};
    for (; *c.at != '\0'; place++) {
        char type[64];
        double q = 1.0;
        npy_type dtype = NPY_F4;
        bool known = true, given = false;
        take_piece(&c, ";,", type, sizeof type);
        while (*c.at == ';') {
            char key[16], value[32] = "";
            c.at++;
            take_piece(&c, "=;,", key, sizeof key);
            if (*c.at == '=') {
                c.at++;
                take_piece(&c, ";,", value, sizeof value);
            }
            if (strcasecmp(key, "q") == 0)
                q = read_quality(value);
            else if (strcasecmp(key, "dtype") == 0)
                given = known = read_npy_type(value, &dtype);
        }
        if (*c.at == ',') c.at++;
        if (strcasecmp(type, "application/json") == 0) {
            json = (named_type){q, json.place < place ? json.place : place};
        } else if (strcasecmp(type, "application/x-npy") == 0 && known && q > npy.quality) {
            npy = (named_type){q, place};
            chosen.npy = dtype;
            chosen.npy_given = given;
        } else if (with_zip && strcasecmp(type, "application/zip") == 0 && q > zip.quality) {
            zip = (named_type){q, place};
        }
    }
    if (npy.quality > 0.0 && is_better(npy, json)) chosen.type = MEDIA_NPY;
    if (zip.quality > 0.0 && is_better(zip, chosen.type == MEDIA_NPY ? npy : json)) chosen.type = MEDIA_ZIP;
    return chosen;
}

media_accept media_choose(const char *header) {
    return choose(header, false);
}

media_accept media_choose_table(const char *header) {
    return choose(header, true);
}
