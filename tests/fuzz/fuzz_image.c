/* Image files of scenes, in memory of their exact length; means are taken of those that are whole. */
#include "fuzz/fuzz.h"
#include "solver/scene/import/images.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static const double uv[4][2] = {{-.3, .1}, {2.2, -.7}, {2.5, 1.4}, {.1, 1.9}};
    texture_image image;
    texture_table *table = NULL;
    lam_error error;
    char why[IMAGE_WHY] = "";
    if (!image_decode(data, size, &image, why)) {
        FUZZ_CHECK(image.pixels == NULL && why[0] != '\0' && strchr(why, '\n') == NULL);
        return 0;
    }
    FUZZ_CHECK(image.width > 0 && image.height > 0);
    if (image.width * image.height <= 1 << 20) {
        FUZZ_CHECK(texture_table_create(&image, &table, &error) == LAM_OK);
        for (int k = 0; k < 9; k++) {
            const texture_wrap wrap[2] = {(texture_wrap)(k % 3), (texture_wrap)(k / 3)};
            double mean[3];
            texture_table_mean(table, wrap, 4, uv, mean);
            for (int c = 0; c < 3; c++) FUZZ_CHECK(mean[c] >= 0 && mean[c] <= 1);
        }
        texture_table_free(table);
        image_halve(&image);
    }
    free(image.pixels);
    return 0;
}
