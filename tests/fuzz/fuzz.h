/* Checks and a scene that the harnesses share. Each is a LLVMFuzzerTestOneInput: libFuzzer and AFL++ call it
 * with what they make up, replay.c with files. */
#ifndef LAMBERT_TESTS_FUZZ_H
#define LAMBERT_TESTS_FUZZ_H

#include "solver/codec/problem.h"
#include "solver/codec/request.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Unlike assert, also in a release build. */
#define FUZZ_CHECK(condition)                                                                                \
    do {                                                                                                     \
        if (!(condition)) {                                                                                  \
            fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition);                                  \
            abort();                                                                                         \
        }                                                                                                    \
    } while (0)

/* A copy with a NUL behind it, and nothing that may be read behind that. The caller frees. */
static inline char *fuzz_text(const uint8_t *data, size_t size) {
    char *text = malloc(size + 1);
    FUZZ_CHECK(text != NULL);
    if (size > 0) memcpy(text, data, size);
    text[size] = '\0';
    return text;
}

/* A refusal has a status that the contract lists and a text. */
static inline void fuzz_check_problem(const problem *why) {
    FUZZ_CHECK(why->status == 400 || why->status == 422 || why->status == 503);
    FUZZ_CHECK(why->detail[0] != '\0' && why->status == problem_status(why->kind));
}

/* Faces of the elements of the scene below: face 1 has none, element 5 is a part of two, and 6 is its back.
 */
static inline const face_index *fuzz_faces(void) {
    static uint32_t of[] = {3, 3, 0, 2, 2, SCENE_FACE_NONE, SCENE_FACE_NONE}, start[] = {0, 2, 2, 5, 7},
                    element[] = {2, 5, 3, 4, 5, 0, 1};
    static double area[] = {1, .5, 1, 1, .5, 1, 1};
    static scene_face_part parts[] = {{5, 0, .5}, {5, 2, .5}};
    static const face_index faces = {.n_faces = 4,
                                     .n = 7,
                                     .n_fronts = 6,
                                     .n_entries = 7,
                                     .start = start,
                                     .element = element,
                                     .area = area,
                                     .of = {4, of, 2, parts}};
    return &faces;
}

/* Three luminaires, two of which are a group. */
enum { FUZZ_LUMINAIRES = 3 };
static inline const luminaire_names *fuzz_luminaires(void) {
    static char *each[] = {"spot", "row.0", "row.1"}, *groups[] = {"rows"};
    static uint32_t start[] = {0, 1, 2, 3}, elements[] = {0, 1, 2}, sorted[] = {1, 2, 0}, members[] = {1, 2},
                    of_group[] = {0, 2};
    static const luminaire_names names = {
        .each = {.noun = "luminaire",
                 .n_groups = FUZZ_LUMINAIRES,
                 .names = each,
                 .start = start,
                 .elements = elements,
                 .sorted = sorted},
        .groups = {.n_groups = 1, .names = groups, .start = start, .elements = elements, .sorted = elements},
        .start = of_group,
        .members = members};
    return &names;
}

/* Sets of 2 and of 3 sensors, the last of which has no value. */
enum { FUZZ_SENSORS = 5 };
static inline const group_index *fuzz_sensors(void) {
    static char *names[] = {"room.a", "room.b"};
    static uint32_t start[] = {0, 2, FUZZ_SENSORS}, elements[] = {0, 1, 2, 3, 4}, sorted[] = {0, 1};
    static bool without[] = {false, false, false, false, true};
    static const group_index sets = {.noun = "set of sensors",
                                     .n_groups = 2,
                                     .names = names,
                                     .start = start,
                                     .elements = elements,
                                     .sorted = sorted,
                                     .buried = without};
    return &sets;
}

/* A small scene; shape says of which kind. The caller frees groups. */
static inline codec_scene fuzz_scene(unsigned shape, group_index *groups) {
    static const char *names[] = {"lamp", "wall", "wall.red", "\xc3\xa9t\xc3\xa9"};
    static const uint32_t group_of[] = {0, 1, 2, 3, 1, 2, 3};
    static const double area[] = {1, .5, 2, 1, 0, 3, 1};
    enum { N = sizeof group_of / sizeof *group_of, GROUPS = sizeof names / sizeof *names };
    char **copies = malloc(GROUPS * (sizeof *copies + 16)); /* one block, as a store's names are */
    lam_error error;
    FUZZ_CHECK(copies != NULL);
    for (int g = 0; g < GROUPS; g++) copies[g] = strcpy((char *)(copies + GROUPS) + 16 * g, names[g]);
    FUZZ_CHECK(group_index_make(N, 0, group_of, GROUPS, copies, groups, &error) == LAM_OK);
    FUZZ_CHECK(group_index_measure(groups, area, &error) == LAM_OK);
    return (codec_scene){.n = N,
                         .n_channels = shape & 1 ? 3 : 1,
                         .groups = groups,
                         .faces = shape & 64 ? NULL : fuzz_faces(),
                         .n_tiles = shape & 2 ? 5 : 0,
                         .n_emitters = shape & 4 ? GROUPS : 0,
                         .emitters = groups,
                         .n_luminaires = shape & 32 ? FUZZ_LUMINAIRES : 0,
                         .luminaires = fuzz_luminaires(),
                         .area = area,
                         .sensors = shape & 8 ? fuzz_sensors() : NULL,
                         .max_batch = 4,
                         .max_bytes = 1 << 20,
                         .only_linear = (shape & 24) == 24,
                         .max_rows = shape & 8 ? 8 : 0};
}

#endif
