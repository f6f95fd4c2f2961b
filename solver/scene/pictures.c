/* Images on the elements of a final mesh. Knows no format of images. */
#include "solver/scene/texture.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void mesh_pictures_drop(mesh *m) {
    if (m->pictures == NULL) return;
    scene_pictures_free(m->pictures);
    free(m->pictures);
    m->pictures = NULL;
}

/* number[i] = the place of surface i among those of elements with an image that differ, or TEXTURE_NONE. */
static void number_surfaces(const mesh *m, uint32_t *number, scene_pictures *out) {
    const mesh_textures *t = m->textures;
    for (size_t i = 0; i < t->n_surfaces; i++) number[i] = TEXTURE_NONE;
    for (size_t i = 0; i < m->n; i++)
        if (m->textured_face[i] != TEXTURE_NONE) number[t->faces[m->textured_face[i]].surface] = 0;
    for (size_t i = 0; i < t->n_surfaces; i++) {
        const texture_surface *from = &t->surfaces[i];
        struct picture_surface s = {.file = from->image[TEXTURE_REFLECTANCE]};
        size_t at = 0;
        if (s.file == TEXTURE_NONE) number[i] = TEXTURE_NONE;
        if (number[i] == TEXTURE_NONE) continue;
        for (int d = 0; d < 2; d++) s.wrap[d] = (uint32_t)from->wrap[TEXTURE_REFLECTANCE][d];
        for (int c = 0; c < 3; c++) s.factor[c] = (float)fmin(from->factor[TEXTURE_REFLECTANCE][c], 1);
        while (at < out->n_surfaces && memcmp(&out->surfaces[at], &s, sizeof s) != 0) at++;
        if (at == out->n_surfaces) out->surfaces[out->n_surfaces++] = s;
        number[i] = (uint32_t)at;
    }
}

lam_status mesh_pictures_place(const mesh *m, scene_pictures *out, bool *any, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh_textures *t = m->textures;
    scene_pictures made = {0};
    uint32_t *number = NULL;
    *any = false;
    if (t == NULL) return LAM_OK;
    number = memory_allocate(t->n_surfaces, sizeof *number, "textures", error);
    made.surfaces = memory_allocate(t->n_surfaces, sizeof *made.surfaces, "textures", error);
    if (number == NULL || made.surfaces == NULL) TRY(LAM_ERR_MEMORY);
    number_surfaces(m, number, &made);
    *any = made.n_surfaces > 0;
    if (!*any) goto done;
    made.surface = memory_allocate(m->n, sizeof *made.surface, "textures", error);
    made.texcoord = memory_allocate(m->n, sizeof *made.texcoord, "textures", error);
    if (made.surface == NULL || made.texcoord == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < m->n; i++) {
        const texture_face *face =
            m->textured_face[i] == TEXTURE_NONE ? NULL : &t->faces[m->textured_face[i]];
        made.surface[i] = face == NULL ? TEXTURE_NONE : number[face->surface];
        if (made.surface[i] == TEXTURE_NONE) continue;
        const size_t corners = mesh_corners(m, i);
        for (size_t k = 0; k < corners; k++)
            for (int d = 0; d < 2; d++)
                made.texcoord[i][k][d] = (float)texture_value_at(
                    face->uv[TEXTURE_REFLECTANCE][d], face->origin, m->vertices[m->elements[i][k]]);
    }
    *out = made;
    made = (scene_pictures){0};
done:
    scene_pictures_free(&made);
    free(number);
    return status;
}
