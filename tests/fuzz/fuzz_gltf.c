/* Materials of a glTF or GLB with the images in it; files that it names do not exist. */
#include "fuzz/fuzz.h"
#include "solver/scene/import/imported_faces.h"

#include <math.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    imported_faces s = {0};
    lam_error error = {.message = ""};
    gltf_material *materials = NULL;
    size_t n = 0;
    if (gltf_read_materials("none/scene.gltf", (const char *)data, size, &s, &materials, &n, &error) ==
        LAM_OK) {
        for (size_t i = 0; i < n; i++)
            for (int q = 0; q < TEXTURE_QUANTITIES; q++) {
                const imported_texture *t = &materials[i].textures[q];
                FUZZ_CHECK(t->image <= s.n_images && t->wrap[0] <= TEXTURE_CLAMP &&
                           t->wrap[1] <= TEXTURE_CLAMP);
                FUZZ_CHECK(t->image == 0 || s.images[t->image - 1].pixels != NULL);
            }
    } else {
        FUZZ_CHECK(error.message[0] != '\0' && strchr(error.message, '\n') == NULL);
    }
    free(materials);
    imported_faces_free(&s);
    return 0;
}
