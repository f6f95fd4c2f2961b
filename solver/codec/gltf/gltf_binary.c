/* The binary chunk of glTF. COLOR_0 is light / white cut to [0, 1]. */
#include "solver/codec/gltf/gltf_writer.h"

#include <assert.h>
#include <endian.h>
#include <math.h>
#include <string.h>

const unsigned char *gltf_image_of(const gltf_writer *w, size_t k, size_t *bytes) {
    const scene_pictures *p = w->pictures;
    if (w->m->lightmap != NULL && k + 1 == w->n_images) {
        *bytes = w->m->lightmap->png_bytes;
        return w->m->lightmap->png;
    }
    *bytes = (size_t)(p->start[k + 1] - p->start[k]);
    return p->bytes + p->start[k];
}

char *gltf_put(char *at, uint32_t value) {
    value = htole32(value);
    memcpy(at, &value, sizeof value);
    return at + sizeof value;
}

char *gltf_put_float(char *at, float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return gltf_put(at, bits);
}

char *gltf_put_vector(char *at, const float v[3]) {
    return gltf_put_float(gltf_put_float(gltf_put_float(at, v[0]), v[1]), v[2]);
}

/* Writes the light of the part's vertices; to is the binary chunk. */
static void put_light(const gltf_writer *w, const gltf_part *p, char *to) {
    const gltf_light *light = w->m->light;
    const uint32_t *elements = gltf_elements_of(w->m, p->group);
    const size_t C = w->m->n_channels;
    char *colour = to + w->view[GLTF_VIEW_COLOUR] + 12 * p->vertex;
    for (size_t k = 0; k < light->n_columns; k++) {
        char *at = to + w->view[GLTF_VIEW_COLUMN + k] + 4 * p->vertex;
        for (size_t j = 0; j < p->n_elements; j++)
            for (size_t corner = 0; corner < gltf_corners_of(w->m, elements[j]); corner++)
                at = gltf_put_float(at, light->value(light->context, k, elements[j], corner));
    }
    for (size_t j = 0; j < p->n_elements; j++)
        for (size_t corner = 0; corner < gltf_corners_of(w->m, elements[j]); corner++) {
            double of[3] = {0, 0, 0}, grey = 0;
            float shown[3];
            for (size_t c = 0; c < C; c++) {
                const double x = (double)light->value(light->context, c, elements[j], corner);
                grey += x / (double)C;
                if (C == 3) of[c] = x;
            }
            if (C != 3) of[0] = of[1] = of[2] = grey;
            for (int d = 0; d < 3; d++) shown[d] = (float)fmin(fmax(of[d] / light->white, 0), 1);
            colour = gltf_put_vector(colour, shown);
        }
}

/* Writes the places in the image and the reflectances of the part's vertices; to is the binary chunk. */
static void put_textured(const gltf_writer *w, const gltf_part *p, char *to) {
    const gltf_mesh *m = w->m;
    const uint32_t *elements = gltf_elements_of(m, p->group);
    char *place = to + w->view[GLTF_VIEW_TEXCOORD] + 8 * p->textured_vertex,
         *reflectance = to + w->view[GLTF_VIEW_REFLECTANCE] + 12 * p->textured_vertex;
    for (size_t j = 0; j < p->n_elements; j++) {
        const size_t i = elements[j];
        for (size_t k = 0; k < gltf_corners_of(m, i); k++) {
            place = gltf_put_float(gltf_put_float(place, w->pictures->texcoord[i][k][0]),
                                   w->pictures->texcoord[i][k][1]);
            for (size_t c = 0; c < 3; c++)
                reflectance =
                    gltf_put_float(reflectance, m->reflectance[(m->n_channels == 3 ? c * m->n : 0) + i]);
        }
    }
}

/* Writes the places in the lightmap of the part's vertices. */
static void put_map(const gltf_writer *w, const gltf_part *p, char *to) {
    const uint32_t *elements = gltf_elements_of(w->m, p->group);
    char *place = to + w->view[w->map_view] + 8 * p->vertex;
    for (size_t j = 0; j < p->n_elements; j++)
        for (size_t k = 0; k < gltf_corners_of(w->m, elements[j]); k++) {
            const float *at = w->m->lightmap->texcoord[elements[j]][k];
            place = gltf_put_float(gltf_put_float(place, at[0]), at[1]);
        }
}

void gltf_put_images(const gltf_writer *w, char *to) {
    for (size_t k = 0; k < w->n_images; k++) {
        size_t bytes;
        const unsigned char *from = gltf_image_of(w, k, &bytes);
        const size_t room = w->view[w->n_views + k + 1] - w->view[w->n_views + k];
        memcpy(to + w->view[w->n_views + k], from, bytes);
        memset(to + w->view[w->n_views + k] + bytes, 0, room - bytes);
    }
}

float gltf_face_number(const gltf_mesh *m, size_t element) {
    if (m->face == NULL || m->face[element] > GLTF_FACES_MOST) return -1;
    return (float)m->face[element];
}

lam_status gltf_put_part(gltf_writer *w, const gltf_part *p, char *to, lam_error *error) {
    lam_status status = LAM_OK;
    const gltf_mesh *m = w->m;
    const uint32_t *elements = gltf_elements_of(m, p->group);
    if (m->corners != NULL) return gltf_put_corners(w, p, to, error);
    char *position = to + w->view[GLTF_VIEW_POSITION] + 12 * p->vertex,
         *normal = to + w->view[GLTF_VIEW_NORMAL] + 12 * p->vertex,
         *element = to + w->view[GLTF_VIEW_ELEMENT] + 4 * p->vertex,
         *face = to + w->view[GLTF_VIEW_FACE] + 4 * p->vertex,
         *index = to + w->view[GLTF_VIEW_INDEX] + 4 * p->index;
    uint32_t vertex = 0;
    TRY(corner_normals_of_group(&w->s, p->group, w->normals, error));
    for (size_t j = 0; j < p->n_elements; j++) {
        const uint32_t corners = (uint32_t)gltf_corners_of(m, elements[j]);
        for (uint32_t k = 0; k < corners; k++) {
            position = gltf_put_vector(position, w->s.position[m->elements[elements[j]][k]]);
            normal = gltf_put_vector(normal, w->normals[4 * j + k]);
            element = gltf_put_float(element, (float)elements[j]);
            face = gltf_put_float(face, gltf_face_number(m, elements[j]));
        }
        for (uint32_t k = 2; k < corners; k++)
            index = gltf_put(gltf_put(gltf_put(index, vertex), vertex + k - 1), vertex + k);
        vertex += corners;
    }
    assert(vertex == p->n_vertices);
    if (m->light != NULL) put_light(w, p, to);
    if (p->surface != PICTURE_NONE) put_textured(w, p, to);
    if (m->lightmap != NULL) put_map(w, p, to);
done:
    return status;
}
