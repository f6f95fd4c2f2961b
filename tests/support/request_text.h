/* Small scenes that requests are read for, and texts of requests that are copied and changed. */
#ifndef LAMBERT_TESTS_REQUEST_TEXT_H
#define LAMBERT_TESTS_REQUEST_TEXT_H

#include "solver/codec/request.h"

#include <stdint.h>

/* Groups of these names, in one block as store_read_texts gives them; freed with group_index_free. */
group_index named_groups(size_t n, const uint32_t *group, size_t n_groups, const char *const *names);

/* A scene of five elements in the groups 0 lamp, 1 box.red, 2 wall and 3 box.blue, with three tiles. A caller
 * that moves it sets scene.groups anew. */
enum { REQUEST_ELEMENTS = 5, REQUEST_GROUPS = 4 };
typedef struct request_scene {
    group_index groups;
    codec_scene scene;
} request_scene;
request_scene request_scene_make(const uint32_t group[REQUEST_ELEMENTS], size_t n_channels);

/* A copy in memory of its very size, so that AddressSanitizer sees a step beyond its NUL. The caller frees
 * it. */
char *request_text_exact(const char *text, size_t length);

/* Xorshift, the state above 0. */
uint64_t request_text_random(uint64_t *state);

/* Changes one to three bytes of a text, to those that mean something in JSON or to any. */
void request_text_change(char *text, size_t length, uint64_t *state);

#endif
