#include "solver/scene/import/gltf_file.h"

#include "solver/base/file_text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint32_t little_endian(const char *bytes) {
    const unsigned char *b = (const unsigned char *)bytes;
    return b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

void gltf_parse(gltf_file *g, const char *bytes, size_t length) {
    if (length >= 20 && memcmp(bytes, "glTF", 4) == 0) { /* a GLB, whose first chunk is the JSON */
        const size_t size = little_endian(bytes + 12);
        if (memcmp(bytes + 16, "JSON", 4) != 0 || size > length - 20) return;
        const char *next = bytes + 20 + size;
        const size_t left = length - 20 - size;
        if (left >= 8 && memcmp(next + 4, "BIN", 4) == 0) {
            g->chunk = next + 8;
            g->chunk_length = little_endian(next) < left - 8 ? little_endian(next) : left - 8;
        }
        bytes += 20;
        length = size;
    }
    g->root = json_loadb(bytes, length, 0, NULL);
}

lam_status gltf_hold_buffers(gltf_file *g, lam_error *error) {
    g->n_buffers = json_array_size(json_object_get(g->root, "buffers"));
    g->buffers = memory_allocate(g->n_buffers + 2, sizeof *g->buffers, "buffers", error);
    return g->buffers != NULL ? LAM_OK : LAM_ERR_MEMORY;
}

lam_status gltf_add_buffer(gltf_file *g, const char *uri, const gltf_numbers *bytes, lam_error *error) {
    json_t *buffer = json_pack("{sIss}", "byteLength", (json_int_t)bytes->length, "uri", uri);
    if (json_array_append_new(json_object_get(g->root, "buffers"), buffer) != 0)
        return status_fail(error, LAM_ERR_MEMORY, "%s: not enough memory for its vertices", g->path);
    g->buffers[g->n_buffers++] = (gltf_buffer){.bytes = bytes->bytes, .length = bytes->length};
    return LAM_OK;
}

void gltf_close(gltf_file *g) {
    for (size_t i = 0; g->buffers != NULL && i < g->n_buffers; i++) free(g->buffers[i].owned);
    free(g->buffers);
    json_decref(g->root);
    *g = (gltf_file){.root = NULL};
}

const json_t *gltf_entry(const gltf_file *g, const char *array, const json_t *index) {
    if (!json_is_integer(index) || json_integer_value(index) < 0) return NULL;
    return json_array_get(json_object_get(g->root, array), (size_t)json_integer_value(index));
}

const json_t *gltf_extension(const json_t *owner, const char *name) {
    return json_object_get(json_object_get(owner, "extensions"), name);
}

double gltf_number(const json_t *value, double otherwise) {
    return json_is_number(value) ? json_number_value(value) : otherwise;
}

static int base64_digit(char c) {
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const char *at = c == '\0' ? NULL : strchr(digits, c);
    return at == NULL ? -1 : (int)(at - digits);
}

char *gltf_data_of_uri(const char *uri, size_t *length, lam_error *error) {
    const char *comma = strchr(uri, ',');
    uint32_t bits = 0;
    int n_bits = 0;
    *length = 0;
    if (comma == NULL || comma - uri < 7 || strncmp(comma - 7, ";base64", 7) != 0) return NULL;
    char *out = memory_allocate(strlen(comma) / 4 + 1, 3, "data URI", error);
    for (const char *c = comma + 1; out != NULL && *c != '\0' && *c != '='; c++) {
        const int digit = base64_digit(*c);
        if (digit < 0) {
            free(out);
            return NULL;
        }
        bits = bits << 6 | (uint32_t)digit;
        n_bits += 6;
        if (n_bits < 8) continue;
        n_bits -= 8;
        out[(*length)++] = (char)(bits >> n_bits & 255);
    }
    return out;
}

void gltf_decode_uri(const char *uri, char out[ASSET_PATH]) {
    size_t n = 0;
    for (const char *c = uri; *c != '\0' && n + 1 < ASSET_PATH; c++) {
        unsigned code;
        if (c[0] == '%' && sscanf(c + 1, "%2x", &code) == 1 && code != 0 && c[1] != '\0' && c[2] != '\0') {
            out[n++] = (char)code;
            c += 2;
        } else
            out[n++] = *c;
    }
    out[n] = '\0';
}

gltf_buffer gltf_read_buffer(gltf_file *g, const json_t *index, lam_error *error) {
    const json_t *buffer = gltf_entry(g, "buffers", index);
    char name[ASSET_PATH], full[ASSET_PATH];
    if (buffer == NULL) return (gltf_buffer){.bytes = NULL};
    gltf_buffer *b = &g->buffers[json_integer_value(index)];
    const char *uri = json_string_value(json_object_get(buffer, "uri"));
    if (b->bytes != NULL) return *b;
    if (uri == NULL) {
        *b = (gltf_buffer){.bytes = g->chunk, .length = g->chunk_length};
    } else if (strncmp(uri, "data:", 5) == 0) {
        b->owned = gltf_data_of_uri(uri, &b->length, error);
    } else {
        gltf_decode_uri(uri, name);
        if (asset_find(g->path, g->s->assets, name, full) == ASSET_FOUND &&
            file_text(full, &b->owned, &b->length, error) != LAM_OK)
            b->owned = NULL;
    }
    if (uri != NULL) b->bytes = b->owned;
    return *b;
}
