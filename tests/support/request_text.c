#include "support/request_text.h"

#include "support/suite.h"

#include <string.h>

group_index named_groups(size_t n, const uint32_t *group, size_t n_groups, const char *const *names) {
    group_index made = {0};
    size_t bytes = n_groups * sizeof(char *) + 1;
    for (size_t g = 0; g < n_groups; g++) bytes += strlen(names[g]) + 1;
    char **block = calloc(1, bytes);
    ck_assert_ptr_nonnull(block);
    char *to = (char *)(block + n_groups);
    for (size_t g = 0; g < n_groups; g++, to += strlen(to) + 1) block[g] = strcpy(to, names[g]);
    ck_assert_int_eq(group_index_make(n, 0, group, n_groups, block, &made, NULL), LAM_OK);
    return made;
}

request_scene request_scene_make(const uint32_t group[REQUEST_ELEMENTS], size_t n_channels) {
    static const char *const names[REQUEST_GROUPS] = {"lamp", "box.red", "wall", "box.blue"};
    return (request_scene){.groups = named_groups(REQUEST_ELEMENTS, group, REQUEST_GROUPS, names),
                           .scene = {.n = REQUEST_ELEMENTS,
                                     .n_channels = n_channels,
                                     .n_tiles = 3,
                                     .max_batch = 8,
                                     .max_bytes = 4096}};
}

char *request_text_exact(const char *text, size_t length) {
    char *exact = malloc(length + 1);
    ck_assert_ptr_nonnull(exact);
    memcpy(exact, text, length);
    exact[length] = '\0';
    return exact;
}

uint64_t request_text_random(uint64_t *state) {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return *state;
}

void request_text_change(char *text, size_t length, uint64_t *state) {
    static const char pieces[] = "{}[],:\"\\0123456789.eE+-NIntf \x80\xC3\xFF\x00u";
    for (uint64_t changes = 1 + request_text_random(state) % 3; changes > 0; changes--) {
        const size_t at = request_text_random(state) % length;
        text[at] = request_text_random(state) % 2 ? pieces[request_text_random(state) % (sizeof pieces - 1)]
                                                  : (char)request_text_random(state);
    }
}
