/* Images on the elements of a scene, for those who show it, and the arrays of /mesh that hold them
 * (store/FORMAT.md). Knows no format of images. */
#ifndef LAMBERT_BASE_SCENE_PICTURES_H
#define LAMBERT_BASE_SCENE_PICTURES_H

#include "store/store.h"

/* No surface. */
#define PICTURE_NONE UINT32_MAX

/* Continuations: 0 repeated, 1 mirrored, 2 the border's pixels. */
#define PICTURE_WRAP_MOST 2

/* Images as files, and their places on n elements. */
typedef struct scene_pictures {
    size_t n_surfaces, n_files;
    uint32_t *surface;       /* [n], or PICTURE_NONE */
    float (*texcoord)[4][2]; /* [n], u and v of the corners, v downwards; 0 without a surface or a corner */
    struct picture_surface {
        uint32_t file, wrap[2];
        float factor[3]; /* the reflectance is that of the image times it */
    } *surfaces;
    uint64_t *start;      /* [n_files + 1], of each file in bytes */
    unsigned char *bytes; /* JPEG files, one after the other */
} scene_pictures;

void scene_pictures_free(scene_pictures *p);

/* Writes the arrays of n elements, or nothing where p is NULL. */
lam_status scene_pictures_save(const scene_pictures *p, size_t n, store *s, lam_error *error);

/* Reads and checks them; *out, with what it points to, is freed by the caller, and NULL where there are none.
 * Errors: LAM_ERR_FORMAT, LAM_ERR_MEMORY. */
lam_status scene_pictures_load(store *s, size_t n, scene_pictures **out, lam_error *error);

#endif
