#include "solver/scene/import/picture_files.h"

#include "solver/base/array_grow.h"
#include "solver/scene/import/images.h"

#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>

/* Pixels of a file, and the quality of the format's usual scale, at which a wall shows no blocks. */
enum { FILE_PIXELS_MOST = 1 << 22, QUALITY = 90 };

static lam_status encode(const texture_image *image, unsigned char **out, unsigned long *length,
                         lam_error *error) {
    lam_status status = LAM_OK;
    texture_image small = {.width = image->width, .height = image->height};
    const size_t pixels = image->width * image->height;
    tjhandle jpeg = tjInitCompress();
    if (jpeg == NULL) FAIL(error, LAM_ERR_MEMORY, "an image: %s", tjGetErrorStr2(NULL));
    small.pixels = memory_allocate(pixels, sizeof *small.pixels, "image", error);
    if (small.pixels == NULL) TRY(LAM_ERR_MEMORY);
    memcpy(small.pixels, image->pixels, pixels * sizeof *small.pixels);
    while (small.width * small.height > FILE_PIXELS_MOST) image_halve(&small);
    if (tjCompress2(jpeg, small.pixels[0], (int)small.width, 0, (int)small.height, TJPF_RGB, out, length,
                    TJSAMP_444, QUALITY, TJFLAG_ACCURATEDCT) != 0)
        FAIL(error, LAM_ERR_MEMORY, "an image: %s", tjGetErrorStr2(jpeg));
done:
    free(small.pixels);
    if (jpeg != NULL) tjDestroy(jpeg);
    return status;
}

/* Encodes the images that surfaces name, and renumbers them; others are left out. */
static lam_status encode_files(const mesh_textures *t, scene_pictures *p, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t *number = memory_allocate(t->n_images, sizeof *number, "images", error);
    unsigned char *made = NULL;
    size_t capacity = 0;
    p->start = memory_allocate(t->n_images + 1, sizeof *p->start, "images", error);
    if (number == NULL || p->start == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < t->n_images; k++) number[k] = TEXTURE_NONE;
    for (size_t k = 0; k < p->n_surfaces; k++) {
        struct picture_surface *s = &p->surfaces[k];
        if (number[s->file] == TEXTURE_NONE) {
            unsigned long length = 0;
            const size_t from = p->start[p->n_files];
            TRY(encode(&t->images[s->file], &made, &length, error));
            TRY(array_grow(&p->bytes, &capacity, from + length, 1, "images", error));
            memcpy(p->bytes + from, made, length);
            tjFree(made);
            made = NULL;
            number[s->file] = (uint32_t)p->n_files++;
            p->start[p->n_files] = from + length;
        }
        s->file = number[s->file];
    }
done:
    tjFree(made);
    free(number);
    return status;
}

lam_status mesh_keep_pictures(mesh *m, lam_error *error) {
    lam_status status = LAM_OK;
    scene_pictures made = {0};
    bool any = false;
    TRY(mesh_pictures_place(m, &made, &any, error));
    if (any) {
        TRY(encode_files(m->textures, &made, error));
        mesh_pictures_drop(m);
        m->pictures = memory_allocate(1, sizeof *m->pictures, "textures", error);
        if (m->pictures == NULL) TRY(LAM_ERR_MEMORY);
        *m->pictures = made;
        made = (scene_pictures){0};
    }
    mesh_textures_release(m);
done:
    scene_pictures_free(&made);
    return status;
}
