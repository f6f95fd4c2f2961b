/* Replies of the process that reads scene files: the parent takes it only when it is sound. */
#include "fuzz/fuzz.h"
#include "solver/scene/import/imported_faces.h"

#include <unistd.h>

/* The bytes that the child's reader sends in place of a reply: inherited by the fork, so that it need not be
 * handed in.
 */
typedef struct sent {
    const uint8_t *data;
    size_t size;
} sent;
static sent to_send;

/* This runs in the child, whose only descriptor besides the standard ones is the pipe, at 3. */
static lam_status send_it(const char *path, imported_faces *s, lam_error *error) {
    (void)path;
    (void)s;
    (void)error;
    for (size_t at = 0; at < to_send.size;) {
        const ssize_t written = write(3, to_send.data + at, to_send.size - at);
        if (written <= 0) break;
        at += (size_t)written;
    }
    _exit(0);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    const child_limits limits = {.cpu_seconds = 5, .memory_bytes = (size_t)1 << 28};
    imported_faces s = {0};
    lam_error error = {.message = ""};
    to_send = (sent){data, size};
    if (import_in_child(send_it, "scene.obj", &limits, &s, &error) == LAM_OK) {
        FUZZ_CHECK(s.n_elements > 0);
        for (size_t i = 0; i < s.n_elements; i++)
            for (int k = 0; k < 3; k++) FUZZ_CHECK(s.elements[i].corners[k] < s.points.n);
        for (size_t f = 0; f < s.n_faces; f++) {
            FUZZ_CHECK(s.face_elements[f] < s.n_elements && s.faces[f].surface < s.materials.n);
            for (int q = 0; q < TEXTURE_QUANTITIES; q++)
                FUZZ_CHECK(s.values[s.faces[f].surface].textures[q].image <= s.n_images);
        }
    } else {
        FUZZ_CHECK(error.message[0] != '\0' && strchr(error.message, '\n') == NULL);
    }
    imported_faces_free(&s);
    return 0;
}
