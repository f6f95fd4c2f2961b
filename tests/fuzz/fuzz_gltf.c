/* Materials of a glTF or GLB with the images in it, its lights, and the file as the library gets it; files
 * that it names do not exist. */
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
    gltf_materials_free(n, materials);
    error.message[0] = '\0';
    if (gltf_read_lights("none/scene.gltf", (const char *)data, size, &s, &error) == LAM_OK)
        for (size_t k = 0; k < s.n_punctual; k++) FUZZ_CHECK(punctual_light_settle(&s.punctual[k]));
    else
        FUZZ_CHECK(error.message[0] != '\0' && strchr(error.message, '\n') == NULL);
    char *rewritten = NULL;
    size_t length = 0;
    gltf_numbers unpacked = {.length = 0}, numbers = {.length = 0};
    error.message[0] = '\0';
    if (gltf_rewrite("none/scene.gltf", (const char *)data, size, &s, &rewritten, &length, &unpacked,
                     &numbers, &error) != LAM_OK)
        FUZZ_CHECK(error.message[0] != '\0' && strchr(error.message, '\n') == NULL);
    FUZZ_CHECK(rewritten == NULL || length > 0);
    FUZZ_CHECK(numbers.length <= numbers.capacity && numbers.length % sizeof(float) == 0);
    free(rewritten);
    free(unpacked.bytes);
    free(numbers.bytes);
    imported_faces_free(&s);
    return 0;
}
