/* A scene is written as binary glTF 2.0 (ISO/IEC 12113:2022): plan() lays out groups and views, the say_
 * functions write the JSON chunk, and the put_ functions write the binary one. The emission is pi times
 * emissiveFactor times emissiveStrength, which are a luminance, and COLOR_0 is light / white cut to [0, 1].
 */
#include "solver/codec/gltf/gltf.h"

#include "solver/codec/gltf/corner_normals.h"
#include "solver/codec/gltf/gltf_surface.h"
#include "solver/codec/json_writer.h"
#include "store/status.h"

#include <assert.h>
#include <endian.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The heads of a file and of its two chunks. */
#define FILE_HEAD 12u
#define CHUNK_HEAD 8u
static const uint32_t magic = 0x46546C67, version = 2, chunk_json = 0x4E4F534A, chunk_binary = 0x004E4942;

/* The component types and the targets of views are those of the specification. */
enum { TYPE_FLOAT = 5126, TYPE_U32 = 5125, TARGET_VERTICES = 34962, TARGET_INDICES = 34963 };

/* The views of the binary chunk, in this order; each group has one accessor in each. With light there is a
 * colour, and a view for each column. With pictures there are places in the image and reflectances, which
 * only the vertices of groups with an image have, and then a view for each image. */
enum { VIEW_POSITION, VIEW_NORMAL, VIEW_ELEMENT, VIEW_FACE, VIEW_INDEX, VIEW_COLOUR, VIEW_COLUMN };
enum { VIEW_TEXCOORD = VIEW_COLOUR, VIEW_REFLECTANCE, VIEW_IMAGE };

/* A group's part of the file. */
typedef struct part {
    size_t group, n_elements;
    size_t textured;           /* place among the groups with an image */
    size_t vertex, n_vertices; /* first of the file, and how many */
    size_t index, n_indices;
    uint32_t surface;       /* of pictures, that of all its elements; or PICTURE_NONE */
    size_t textured_vertex; /* first among those of groups with an image */
    float low[3], high[3];
    double reflectance[3], emission[3];
} part;

_Static_assert(sizeof(part) <= GLTF_PART_BYTES, "gltf_work_bytes counts less");

typedef struct writer {
    const gltf_mesh *m;
    corner_normals s;
    float (*normals)[3]; /* [4 elements of the largest group] */
    part *parts;         /* [n_parts]: the groups that have elements */
    size_t n_parts, n_vertices, n_indices, n_textured_vertices;
    size_t n_views;                 /* with accessors */
    const scene_pictures *pictures; /* NULL where no group has an image */
    size_t n_textured, n_images;
    size_t *view; /* [n_views + n_images + 1]: offsets in the binary chunk, and its length */
    buffer json;
} writer;

static void writer_free(writer *w) {
    corner_normals_free(&w->s);
    free(w->normals);
    free(w->parts);
    free(w->view);
    buffer_free(&w->json);
}

static size_t corners_of(const gltf_mesh *m, size_t element) {
    return m->elements[element][3] == GLTF_NO_VERTEX ? 3 : 4;
}

static const uint32_t *elements_of(const gltf_mesh *m, size_t g) {
    return m->groups->elements + m->groups->start[g];
}

/* The mean by area of values [C][n] over a group, as red, green and blue. Of an area of 0 it is the plain
 * mean.
 */
static void mean_colour(const gltf_mesh *m, size_t g, const float *values, double colour[3]) {
    const uint32_t *elements = elements_of(m, g);
    const size_t count = m->groups->start[g + 1] - m->groups->start[g], C = m->n_channels;
    double area = 0, grey = 0;
    for (size_t j = 0; j < count; j++) area += m->area[elements[j]];
    for (size_t c = 0; c < C; c++) {
        double sum = 0;
        for (size_t j = 0; j < count; j++)
            sum += (area > 0 ? m->area[elements[j]] / area : 1 / (double)count) *
                   (double)values[c * m->n + elements[j]];
        grey += sum / (double)C;
        if (C == 3) colour[c] = fmax(sum, 0);
    }
    if (C != 3) colour[0] = colour[1] = colour[2] = fmax(grey, 0);
}

static void measure_part(writer *w, part *p) {
    const gltf_mesh *m = w->m;
    const uint32_t *elements = elements_of(m, p->group);
    for (int d = 0; d < 3; d++) {
        p->low[d] = INFINITY;
        p->high[d] = -INFINITY;
    }
    for (size_t j = 0; j < p->n_elements; j++) {
        const size_t corners = corners_of(m, elements[j]);
        p->n_vertices += corners;
        p->n_indices += 3 * (corners - 2);
        for (size_t k = 0; k < corners; k++)
            for (int d = 0; d < 3; d++) {
                const float x = w->s.position[m->elements[elements[j]][k]][d];
                p->low[d] = fminf(p->low[d], x);
                p->high[d] = fmaxf(p->high[d], x);
            }
    }
    mean_colour(m, p->group, m->reflectance, p->reflectance);
    mean_colour(m, p->group, m->emission, p->emission);
}

/* Numbers of an item of a view. */
static size_t count_of(const writer *w, size_t view) {
    if (view == VIEW_POSITION || view == VIEW_NORMAL) return 3;
    if (w->pictures != NULL) return view == VIEW_TEXCOORD ? 2 : view == VIEW_REFLECTANCE ? 3 : 1;
    return view == VIEW_COLOUR ? 3 : 1;
}

static size_t width_of(const writer *w, size_t view) {
    return count_of(w, view) * sizeof(float);
}

/* Items of a view. */
static size_t items_of(const writer *w, size_t view) {
    if (view == VIEW_INDEX) return w->n_indices;
    return w->pictures != NULL && view >= VIEW_TEXCOORD ? w->n_textured_vertices : w->n_vertices;
}

/* The part of the light that a face of a group lets pass at normal incidence. */
static double passes_of(const gltf_mesh *m, size_t g) {
    return m->glass == NULL ? 0 : glass_passes(&m->glass->of[g], false, 1);
}

/* The surface of all elements of a group, or PICTURE_NONE; that of a pane is its mean. */
static uint32_t surface_of(const gltf_mesh *m, size_t g) {
    const uint32_t *elements = elements_of(m, g);
    const size_t count = m->groups->start[g + 1] - m->groups->start[g];
    if (m->pictures == NULL || passes_of(m, g) > 0) return PICTURE_NONE;
    for (size_t j = 1; j < count; j++)
        if (m->pictures->surface[elements[j]] != m->pictures->surface[elements[0]]) return PICTURE_NONE;
    return m->pictures->surface[elements[0]];
}

/* Views begin at multiples of 4. */
static size_t padded(size_t bytes) {
    return (bytes + 3) & ~(size_t)3;
}

static lam_status plan(writer *w, lam_error *error) {
    lam_status status = LAM_OK;
    const gltf_mesh *m = w->m;
    if (m->n > GLTF_ELEMENTS_MOST)
        FAIL(error, LAM_ERR_ARGUMENT, "%zu elements, at most %zu have a number in glTF", m->n,
             GLTF_ELEMENTS_MOST);
    TRY(corner_normals_create(m, &w->s, error));
    w->normals = memory_allocate(gltf_largest_group(m->groups), 4 * sizeof *w->normals, "normals", error);
    w->parts = memory_allocate(m->groups->n_groups, sizeof *w->parts, "glTF", error);
    assert(m->pictures == NULL || (m->light == NULL && (m->n_channels == 1 || m->n_channels == 3)));
    if (w->normals == NULL || w->parts == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t g = 0; g < m->groups->n_groups; g++) {
        const size_t count = m->groups->start[g + 1] - m->groups->start[g];
        if (count == 0) continue;
        part *p = &w->parts[w->n_parts++];
        *p = (part){.group = g, .n_elements = count, .vertex = w->n_vertices, .index = w->n_indices};
        measure_part(w, p);
        p->surface = surface_of(m, g);
        p->textured = w->n_textured;
        p->textured_vertex = w->n_textured_vertices;
        if (p->surface != PICTURE_NONE) {
            w->n_textured++;
            w->n_textured_vertices += p->n_vertices;
        }
        w->n_vertices += p->n_vertices;
        w->n_indices += p->n_indices;
    }
    w->n_views = m->light != NULL ? VIEW_COLUMN + m->light->n_columns : VIEW_COLOUR;
    if (w->n_textured > 0) {
        w->pictures = m->pictures;
        w->n_views = VIEW_IMAGE;
        w->n_images = m->pictures->n_files;
    }
    w->view = memory_allocate(w->n_views + w->n_images + 1, sizeof *w->view, "glTF", error);
    if (w->view == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t v = 0; v < w->n_views; v++) w->view[v + 1] = w->view[v] + width_of(w, v) * items_of(w, v);
    for (size_t k = 0; k < w->n_images; k++)
        w->view[w->n_views + k + 1] =
            w->view[w->n_views + k] + padded(m->pictures->start[k + 1] - m->pictures->start[k]);
done:
    return status;
}

static bool say_floats(buffer *b, const char *name, const float values[3]) {
    const double numbers[3] = {(double)values[0], (double)values[1], (double)values[2]};
    return buffer_append_text(b, name) && json_write_doubles(b, numbers, 3);
}

static bool say_extras(const writer *w, buffer *b) {
    bool good = buffer_append_text(b, "\"extras\":{\"lambert\":{\"name\":") &&
                json_write_text(b, w->m->name) &&
                buffer_printf(b, ",\"elements\":%zu,\"channels\":%zu,\"up\":\"%c\"", w->m->n,
                              w->m->n_channels, w->m->up);
    if (w->m->light != NULL)
        good = good && buffer_append_text(b, ",\"white\":") && json_write_double(b, w->m->light->white);
    if (w->m->glass != NULL)
        good = good && buffer_printf(b, ",\"glass_law\":\"%s\"", glass_law_word(w->m->glass));
    if (w->m->kind != NULL)
        good = good && buffer_append_text(b, ",\"kind\":") && json_write_text(b, w->m->kind);
    return good && buffer_append_text(b, "}}");
}

/* The elements of a part that figures leave out. */
static bool say_buried(const writer *w, const part *p, buffer *b) {
    const uint32_t *elements = elements_of(w->m, p->group);
    const char *before = ",\"buried\":[";
    bool good = true;
    for (size_t j = 0; j < p->n_elements; j++) {
        if (group_index_counts(w->m->groups, elements[j])) continue;
        good = good && buffer_printf(b, "%s%u", before, elements[j]);
        before = ",";
    }
    return good && (before[1] != '\0' || buffer_append_text(b, "]"));
}

static bool say_glass(const writer *w, const part *p, buffer *b) {
    if (!(passes_of(w->m, p->group) > 0)) return true;
    const struct group_glass *of = &w->m->glass->of[p->group];
    return buffer_append_text(b, ",\"glass\":{\"transmittance\":") &&
           json_write_double(b, of->transmittance) && buffer_append_text(b, ",\"faces\":") &&
           json_write_double(b, of->faces) && buffer_append_text(b, "}");
}

/* Node 0 is the root, node and mesh and material 1 + k, k and k are those of part k. */
static bool say_nodes(const writer *w, buffer *b) {
    bool good = buffer_append_text(b, ",\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"name\":") &&
                json_write_text(b, w->m->name) && buffer_append_text(b, ",\"children\":[");
    for (size_t k = 0; k < w->n_parts; k++) good = good && buffer_printf(b, k > 0 ? ",%zu" : "%zu", k + 1);
    good = good && buffer_append_text(b, "],") && say_extras(w, b) && buffer_append_text(b, "}");
    for (size_t k = 0; k < w->n_parts; k++)
        good = good && buffer_append_text(b, ",{\"name\":") &&
               json_write_text(b, w->m->groups->names[w->parts[k].group]) &&
               buffer_printf(b, ",\"mesh\":%zu,\"extras\":{\"group\":%zu,\"elements\":%zu", k,
                             w->parts[k].group, w->parts[k].n_elements) &&
               say_buried(w, &w->parts[k], b) && say_glass(w, &w->parts[k], b) && buffer_append_text(b, "}}");
    return good && buffer_append_text(b, "]");
}

/* The first accessor of part k, and that of its place in an image, which stand behind those of all parts. */
static size_t first_accessor(const writer *w, size_t k) {
    return (w->pictures != NULL ? (size_t)VIEW_TEXCOORD : w->n_views) * k;
}

static size_t textured_accessor(const writer *w, const part *p) {
    return first_accessor(w, w->n_parts) + 2 * p->textured;
}

static bool say_attributes(const writer *w, const part *p, size_t first, buffer *b) {
    const gltf_light *light = w->m->light;
    bool good =
        buffer_printf(b, "\"POSITION\":%zu,\"NORMAL\":%zu,\"_ELEMENT\":%zu,\"_FACE\":%zu",
                      first + VIEW_POSITION, first + VIEW_NORMAL, first + VIEW_ELEMENT, first + VIEW_FACE);
    if (p->surface != PICTURE_NONE)
        good = good && buffer_printf(b, ",\"TEXCOORD_0\":%zu,\"_REFLECTANCE\":%zu", textured_accessor(w, p),
                                     textured_accessor(w, p) + 1);
    if (light == NULL) return good;
    good = good && buffer_printf(b, ",\"COLOR_0\":%zu", first + VIEW_COLOUR);
    for (size_t k = 0; k < light->n_columns; k++)
        good = good && buffer_append_text(b, ",") && json_write_text(b, light->columns[k]) &&
               buffer_printf(b, ":%zu", first + VIEW_COLUMN + k);
    return good;
}

static bool say_meshes(const writer *w, buffer *b) {
    bool good = buffer_append_text(b, ",\"meshes\":[");
    for (size_t k = 0; k < w->n_parts; k++)
        good = good && buffer_append_text(b, k > 0 ? ",{\"name\":" : "{\"name\":") &&
               json_write_text(b, w->m->groups->names[w->parts[k].group]) &&
               buffer_append_text(b, ",\"primitives\":[{\"attributes\":{") &&
               say_attributes(w, &w->parts[k], first_accessor(w, k), b) &&
               buffer_printf(b, "},\"indices\":%zu,\"material\":%zu,\"mode\":4}]}",
                             first_accessor(w, k) + VIEW_INDEX, k);
    return good && buffer_append_text(b, "]");
}

static bool say_surface(const writer *w, const part *p, buffer *b) {
    gltf_surface s = {.image = -1, .passes = passes_of(w->m, p->group), .lit = w->m->light != NULL};
    memcpy(s.reflectance, p->reflectance, sizeof s.reflectance);
    memcpy(s.emission, p->emission, sizeof s.emission);
    if (p->surface != PICTURE_NONE) {
        s.image = (long)p->surface;
        for (int c = 0; c < 3; c++) s.factor[c] = (double)w->pictures->surfaces[p->surface].factor[c];
    }
    return gltf_say_surface(&s, b);
}

static bool say_materials(const writer *w, buffer *b) {
    const bool lit = w->m->light != NULL;
    bool good = buffer_append_text(b, ",\"materials\":["), emits = false;
    for (size_t k = 0; k < w->n_parts; k++) {
        const part *p = &w->parts[k];
        good = good && buffer_append_text(b, k > 0 ? ",{\"name\":" : "{\"name\":") &&
               json_write_text(b, w->m->groups->names[p->group]) && say_surface(w, p, b) &&
               buffer_append_text(b, "}");
        emits = emits || fmax(p->emission[0], fmax(p->emission[1], p->emission[2])) > 0;
    }
    good = good && buffer_append_text(b, "]");
    if (lit) good = good && buffer_append_text(b, ",\"extensionsUsed\":[\"KHR_materials_unlit\"]");
    if (!lit && emits)
        good = good && buffer_append_text(b, ",\"extensionsUsed\":[\"KHR_materials_emissive_strength\"]");
    return good;
}

/* Textures are numbered as surfaces, each with a sampler of its own. */
static bool say_textures(const writer *w, buffer *b) {
    static const unsigned wraps[] = {10497, 33648, 33071}; /* repeat, mirrored, clamp to edge */
    const scene_pictures *p = w->pictures;
    if (p == NULL) return true;
    bool good = buffer_append_text(b, ",\"samplers\":[");
    for (size_t k = 0; k < p->n_surfaces; k++)
        good = good && buffer_printf(b, "%s{\"wrapS\":%u,\"wrapT\":%u}", k > 0 ? "," : "",
                                     wraps[p->surfaces[k].wrap[0]], wraps[p->surfaces[k].wrap[1]]);
    good = good && buffer_append_text(b, "],\"textures\":[");
    for (size_t k = 0; k < p->n_surfaces; k++)
        good = good && buffer_printf(b, "%s{\"sampler\":%zu,\"source\":%u}", k > 0 ? "," : "", k,
                                     p->surfaces[k].file);
    good = good && buffer_append_text(b, "],\"images\":[");
    for (size_t k = 0; k < w->n_images; k++)
        good = good && buffer_printf(b, "%s{\"bufferView\":%zu,\"mimeType\":\"image/jpeg\"}",
                                     k > 0 ? "," : "", w->n_views + k);
    return good && buffer_append_text(b, "]");
}

static bool say_accessor(const writer *w, const part *p, size_t v, buffer *b) {
    static const char *const types[] = {NULL, "SCALAR", "VEC2", "VEC3"};
    const bool of_image = w->pictures != NULL && v >= VIEW_TEXCOORD;
    const size_t first = v == VIEW_INDEX ? p->index : of_image ? p->textured_vertex : p->vertex;
    bool good = buffer_printf(b,
                              "{\"bufferView\":%zu,\"byteOffset\":%zu,\"componentType\":%d,\"count\":%zu,"
                              "\"type\":\"%s\"",
                              v, width_of(w, v) * first, v == VIEW_INDEX ? (int)TYPE_U32 : (int)TYPE_FLOAT,
                              v == VIEW_INDEX ? p->n_indices : p->n_vertices, types[count_of(w, v)]);
    if (v == VIEW_POSITION)
        good = good && say_floats(b, ",\"min\":", p->low) && say_floats(b, ",\"max\":", p->high);
    return good && buffer_append_text(b, "}");
}

static bool say_accessors(const writer *w, buffer *b) {
    bool good = buffer_append_text(b, ",\"accessors\":[");
    const size_t n_common = first_accessor(w, 1);
    for (size_t k = 0; k < w->n_parts; k++)
        for (size_t v = 0; v < n_common; v++)
            good = good && (k + v == 0 || buffer_append_text(b, ",")) && say_accessor(w, &w->parts[k], v, b);
    for (size_t k = 0; k < w->n_parts && w->pictures != NULL; k++)
        for (size_t v = VIEW_TEXCOORD; v < VIEW_IMAGE && w->parts[k].surface != PICTURE_NONE; v++)
            good = good && buffer_append_text(b, ",") && say_accessor(w, &w->parts[k], v, b);
    return good && buffer_append_text(b, "]");
}

static size_t binary_bytes(const writer *w) {
    return w->view[w->n_views + w->n_images];
}

static bool say_views(const writer *w, buffer *b) {
    bool good = buffer_append_text(b, ",\"bufferViews\":[");
    for (size_t v = 0; v < w->n_views; v++) {
        good = good && buffer_printf(b, "%s{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu,\"target\":%d",
                                     v > 0 ? "," : "", w->view[v], w->view[v + 1] - w->view[v],
                                     v == VIEW_INDEX ? (int)TARGET_INDICES : (int)TARGET_VERTICES);
        if (v != VIEW_INDEX) good = good && buffer_printf(b, ",\"byteStride\":%zu", width_of(w, v));
        good = good && buffer_append_text(b, "}");
    }
    for (size_t k = 0; k < w->n_images; k++)
        good = good && buffer_printf(b, ",{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu}",
                                     w->view[w->n_views + k],
                                     (size_t)(w->pictures->start[k + 1] - w->pictures->start[k]));
    return good && buffer_printf(b, "],\"buffers\":[{\"byteLength\":%zu}]", binary_bytes(w));
}

static bool say_json(writer *w) {
    static const char spaces[] = "   ";
    buffer *b = &w->json;
    return buffer_append_text(b, "{\"asset\":{\"version\":\"2.0\",\"generator\":\"lambert " LAMBERT_VERSION
                                 "\"},") &&
           say_extras(w, b) && say_nodes(w, b) && say_meshes(w, b) && say_materials(w, b) &&
           say_textures(w, b) && say_accessors(w, b) && say_views(w, b) && buffer_append_text(b, "}") &&
           buffer_append(b, spaces, (4 - b->length % 4) % 4);
}

static char *put(char *at, uint32_t value) {
    value = htole32(value);
    memcpy(at, &value, sizeof value);
    return at + sizeof value;
}

static char *put_float(char *at, float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return put(at, bits);
}

static char *put_vector(char *at, const float v[3]) {
    return put_float(put_float(put_float(at, v[0]), v[1]), v[2]);
}

/* Writes the light of the part's vertices; to is the binary chunk. */
static void put_light(const writer *w, const part *p, char *to) {
    const gltf_light *light = w->m->light;
    const uint32_t *elements = elements_of(w->m, p->group);
    const size_t C = w->m->n_channels;
    char *colour = to + w->view[VIEW_COLOUR] + 12 * p->vertex;
    for (size_t k = 0; k < light->n_columns; k++) {
        char *at = to + w->view[VIEW_COLUMN + k] + 4 * p->vertex;
        for (size_t j = 0; j < p->n_elements; j++)
            for (size_t corner = 0; corner < corners_of(w->m, elements[j]); corner++)
                at = put_float(at, light->value(light->context, k, elements[j], corner));
    }
    for (size_t j = 0; j < p->n_elements; j++)
        for (size_t corner = 0; corner < corners_of(w->m, elements[j]); corner++) {
            double of[3] = {0, 0, 0}, grey = 0;
            float shown[3];
            for (size_t c = 0; c < C; c++) {
                const double x = (double)light->value(light->context, c, elements[j], corner);
                grey += x / (double)C;
                if (C == 3) of[c] = x;
            }
            if (C != 3) of[0] = of[1] = of[2] = grey;
            for (int d = 0; d < 3; d++) shown[d] = (float)fmin(fmax(of[d] / light->white, 0), 1);
            colour = put_vector(colour, shown);
        }
}

/* Writes the places in the image and the reflectances of the part's vertices; to is the binary chunk. */
static void put_textured(const writer *w, const part *p, char *to) {
    const gltf_mesh *m = w->m;
    const uint32_t *elements = elements_of(m, p->group);
    char *place = to + w->view[VIEW_TEXCOORD] + 8 * p->textured_vertex,
         *reflectance = to + w->view[VIEW_REFLECTANCE] + 12 * p->textured_vertex;
    for (size_t j = 0; j < p->n_elements; j++) {
        const size_t i = elements[j];
        for (size_t k = 0; k < corners_of(m, i); k++) {
            place =
                put_float(put_float(place, w->pictures->texcoord[i][k][0]), w->pictures->texcoord[i][k][1]);
            for (size_t c = 0; c < 3; c++)
                reflectance = put_float(reflectance, m->reflectance[(m->n_channels == 3 ? c * m->n : 0) + i]);
        }
    }
}

static void put_images(const writer *w, char *to) {
    for (size_t k = 0; k < w->n_images; k++) {
        const size_t bytes = w->pictures->start[k + 1] - w->pictures->start[k],
                     room = w->view[w->n_views + k + 1] - w->view[w->n_views + k];
        memcpy(to + w->view[w->n_views + k], w->pictures->bytes + w->pictures->start[k], bytes);
        memset(to + w->view[w->n_views + k] + bytes, 0, room - bytes);
    }
}

/* The number of an element's face as glTF has it: -1 of none, of several, or where it is no float. */
static float face_number(const gltf_mesh *m, size_t element) {
    if (m->face == NULL || m->face[element] > GLTF_FACES_MOST) return -1;
    return (float)m->face[element];
}

/* Writes the part's vertices and triangles; to is the binary chunk. */
static lam_status put_part(writer *w, const part *p, char *to, lam_error *error) {
    lam_status status = LAM_OK;
    const gltf_mesh *m = w->m;
    const uint32_t *elements = elements_of(m, p->group);
    char *position = to + w->view[VIEW_POSITION] + 12 * p->vertex,
         *normal = to + w->view[VIEW_NORMAL] + 12 * p->vertex,
         *element = to + w->view[VIEW_ELEMENT] + 4 * p->vertex,
         *face = to + w->view[VIEW_FACE] + 4 * p->vertex, *index = to + w->view[VIEW_INDEX] + 4 * p->index;
    uint32_t vertex = 0;
    TRY(corner_normals_of_group(&w->s, p->group, w->normals, error));
    for (size_t j = 0; j < p->n_elements; j++) {
        const uint32_t corners = (uint32_t)corners_of(m, elements[j]);
        for (uint32_t k = 0; k < corners; k++) {
            position = put_vector(position, w->s.position[m->elements[elements[j]][k]]);
            normal = put_vector(normal, w->normals[4 * j + k]);
            element = put_float(element, (float)elements[j]);
            face = put_float(face, face_number(m, elements[j]));
        }
        for (uint32_t k = 2; k < corners; k++)
            index = put(put(put(index, vertex), vertex + k - 1), vertex + k);
        vertex += corners;
    }
    assert(vertex == p->n_vertices);
    if (m->light != NULL) put_light(w, p, to);
    if (p->surface != PICTURE_NONE) put_textured(w, p, to);
done:
    return status;
}

lam_status gltf_write(const gltf_mesh *m, buffer *out, lam_error *error) {
    lam_status status = LAM_OK;
    writer w = {.m = m};
    buffer made = {0};
    TRY(plan(&w, error));
    if (!say_json(&w)) FAIL(error, LAM_ERR_MEMORY, "not enough memory for glTF");
    const size_t head = FILE_HEAD + CHUNK_HEAD + w.json.length + CHUNK_HEAD;
    if (w.json.length > UINT32_MAX || binary_bytes(&w) > UINT32_MAX - head)
        FAIL(error, LAM_ERR_ARGUMENT, "%zu bytes, glTF has at most 2^32", head + binary_bytes(&w));
    const size_t length = head + binary_bytes(&w);
    if (!buffer_reserve(&made, length))
        FAIL(error, LAM_ERR_MEMORY, "not enough memory for %zu bytes of glTF", length);
    made.length = length;
    made.bytes[length] = '\0';
    char *at = put(put(put(made.bytes, magic), version), (uint32_t)length);
    at = put(put(at, (uint32_t)w.json.length), chunk_json);
    memcpy(at, w.json.bytes, w.json.length);
    at = put(put(at + w.json.length, (uint32_t)binary_bytes(&w)), chunk_binary);
    for (size_t k = 0; k < w.n_parts; k++) TRY(put_part(&w, &w.parts[k], at, error));
    put_images(&w, at);
    *out = made;
    made = (buffer){0};
done:
    buffer_free(&made);
    writer_free(&w);
    return status;
}
