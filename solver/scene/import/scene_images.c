/* The images that a scene names, each read once. Runs in the child. */
#include "solver/base/array_grow.h"
#include "solver/base/asset_files.h"
#include "solver/base/file_text.h"
#include "solver/scene/import/images.h"
#include "solver/scene/import/imported_faces.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* *known: the key has been seen; else it has an entry without pixels now, the last one. */
static lam_status find_key(imported_faces *s, const char *key, uint32_t *index, bool *known,
                           lam_error *error) {
    lam_status status = LAM_OK;
    const size_t before = s->image_keys.n;
    TRY(array_grow(&s->images, &s->image_capacity, before + 1, sizeof *s->images, "images", error));
    TRY(name_table_add(&s->image_keys, key, strlen(key), index, error));
    *known = s->image_keys.n == before;
    if (!*known) s->images[s->n_images++] = (texture_image){.pixels = NULL};
done:
    return status;
}

static void say_why(imported_faces *s, const char *path, const char *label, const char *why) {
    import_warn(&s->warnings, "%s: the image '%.200s' is not read: %s; plain colours take its place", path,
                label, why);
}

/* Decodes an image into its entry, or says why not. */
static void decode_image(imported_faces *s, const char *path, const char *label, const char *bytes,
                         size_t length, texture_image *entry) {
    char why[IMAGE_WHY];
    if (!image_decode((const unsigned char *)bytes, length, entry, why)) say_why(s, path, label, why);
    while (entry->width * entry->height > IMAGE_PIXELS_MOST) image_halve(entry);
}

lam_status imported_faces_add_image(imported_faces *s, const char *path, const char *key, const char *label,
                                    const char *bytes, size_t length, uint32_t *image, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t index = 0;
    bool known = false;
    TRY(find_key(s, key, &index, &known, error));
    if (!known) decode_image(s, path, label, bytes, length, &s->images[index]);
    *image = s->images[index].pixels == NULL ? 0 : index + 1;
done:
    return status;
}

lam_status imported_faces_lack_image(imported_faces *s, const char *path, const char *key, const char *label,
                                     const char *why, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t index;
    bool known = false;
    TRY(find_key(s, key, &index, &known, error));
    if (!known) say_why(s, path, label, why);
done:
    return status;
}

lam_status imported_faces_find_image(imported_faces *s, const char *path, const char *file, uint32_t *image,
                                     lam_error *error) {
    lam_status status = LAM_OK;
    lam_error unread;
    char full[ASSET_PATH], key[2 * ASSET_PATH], *bytes = NULL;
    size_t length = 0;
    uint32_t index = 0;
    bool known = false;
    snprintf(key, sizeof key, "%s\n%s", path, file);
    TRY(find_key(s, key, &index, &known, error));
    if (!known) {
        const asset_place place = asset_find(path, s->assets, file, full);
        if (place == ASSET_OUTSIDE)
            say_why(s, path, file,
                    "it lies outside the scene's folder; --assets with its folder lets it be read");
        else if (place == ASSET_MISSING)
            say_why(s, path, file, "it is missing");
        else if (place == ASSET_SEVERAL)
            say_why(s, path, file, "several files differ from it by capitals alone");
        else if (file_text(full, &bytes, &length, &unread) != LAM_OK)
            say_why(s, path, file, "it cannot be opened");
        else
            decode_image(s, path, file, bytes, length, &s->images[index]);
    }
    *image = s->images[index].pixels == NULL ? 0 : index + 1;
done:
    free(bytes);
    return status;
}

void imported_faces_fit_images(imported_faces *s) {
    size_t total = 0;
    for (size_t k = 0; k < s->n_images; k++) total += s->images[k].width * s->images[k].height;
    while (total > IMAGES_PIXELS_MOST) {
        texture_image *largest = &s->images[0];
        for (size_t k = 1; k < s->n_images; k++)
            if (s->images[k].width * s->images[k].height > largest->width * largest->height)
                largest = &s->images[k];
        total -= largest->width * largest->height;
        image_halve(largest);
        total += largest->width * largest->height;
    }
}
