/* A scene is written as binary glTF 2.0 (ISO/IEC 12113:2022): plan() lays out groups and views, the say_
 * functions write the JSON chunk, and gltf_binary.c writes the other one. The emission is pi times
 * emissiveFactor times emissiveStrength, which are a luminance, and COLOR_0 is light / white cut to [0, 1].
 */
#include "solver/codec/gltf/gltf.h"

#include "solver/codec/gltf/gltf_surface.h"
#include "solver/codec/gltf/gltf_writer.h"
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

static void writer_free(gltf_writer *w) {
    corner_normals_free(&w->s);
    free(w->normals);
    free(w->parts);
    free(w->view);
    buffer_free(&w->json);
}

/* The mean by area of values [C][n] over a group, as red, green and blue. Of an area of 0 it is the plain
 * mean.
 */
static void mean_colour(const gltf_mesh *m, size_t g, const float *values, double colour[3]) {
    const uint32_t *elements = gltf_elements_of(m, g);
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

static void measure_part(gltf_writer *w, gltf_part *p) {
    const gltf_mesh *m = w->m;
    const uint32_t *elements = gltf_elements_of(m, p->group);
    for (int d = 0; d < 3; d++) {
        p->low[d] = INFINITY;
        p->high[d] = -INFINITY;
    }
    for (size_t j = 0; j < p->n_elements; j++) {
        const size_t corners = gltf_ring_count(m, elements[j]);
        p->n_vertices += corners;
        p->n_indices += 3 * (corners - 2);
        for (size_t k = 0; k < corners; k++)
            for (int d = 0; d < 3; d++) {
                const float x = w->s.position[gltf_ring_vertex(m, elements[j], k)][d];
                p->low[d] = fminf(p->low[d], x);
                p->high[d] = fmaxf(p->high[d], x);
            }
    }
    if (m->corners != NULL && m->corners->shared) p->n_vertices = gltf_count_shared(m, p);
    mean_colour(m, p->group, m->reflectance, p->reflectance);
    mean_colour(m, p->group, m->emission, p->emission);
}

/* Numbers of an item of a view. */
static size_t count_of(const gltf_writer *w, size_t view) {
    if (view == GLTF_VIEW_POSITION || view == GLTF_VIEW_NORMAL) return 3;
    if (view == w->map_view) return w->m->lightmap != NULL ? 2 : 1;
    if (w->pictures != NULL) return view == GLTF_VIEW_TEXCOORD ? 2 : view == GLTF_VIEW_REFLECTANCE ? 3 : 1;
    return view == GLTF_VIEW_COLOUR ? 3 : 1;
}

static size_t width_of(const gltf_writer *w, size_t view) {
    return count_of(w, view) * sizeof(float);
}

/* Items of a view. */
static size_t items_of(const gltf_writer *w, size_t view) {
    if (view == GLTF_VIEW_INDEX) return w->n_indices;
    if (view == w->map_view) return w->n_vertices;
    return w->pictures != NULL && view >= GLTF_VIEW_TEXCOORD ? w->n_textured_vertices : w->n_vertices;
}

/* The part of the light that a face of a group lets pass at normal incidence. */
static double passes_of(const gltf_mesh *m, size_t g) {
    return m->glass == NULL ? 0 : glass_passes(&m->glass->of[g], false, 1);
}

/* The surface of all elements of a group, or PICTURE_NONE; that of a pane is its mean. */
static uint32_t surface_of(const gltf_mesh *m, size_t g) {
    const uint32_t *elements = gltf_elements_of(m, g);
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

/* Lays out the views of the binary chunk. */
static lam_status plan_views(gltf_writer *w, lam_error *error) {
    const gltf_mesh *m = w->m;
    w->n_common = m->light != NULL ? GLTF_VIEW_COLUMN + m->light->n_columns : GLTF_VIEW_COLOUR;
    w->n_views = w->n_common;
    if (w->n_textured > 0) {
        w->pictures = m->pictures;
        w->n_views = GLTF_VIEW_IMAGE;
        w->n_images = m->pictures->n_files;
    }
    w->map_view = SIZE_MAX;
    if (m->lightmap != NULL) {
        w->map_view = w->n_views++;
        w->n_images++;
    }
    if (m->corners != NULL) {
        w->map_view = w->n_views++;
        w->n_blobs = m->corners->matrix != NULL ? 4 : 0;
    }
    w->view = memory_allocate(w->n_views + w->n_images + w->n_blobs + 1, sizeof *w->view, "glTF", error);
    if (w->view == NULL) return LAM_ERR_MEMORY;
    for (size_t v = 0; v < w->n_views; v++) w->view[v + 1] = w->view[v] + width_of(w, v) * items_of(w, v);
    for (size_t k = 0; k < w->n_images; k++) {
        size_t bytes;
        gltf_image_of(w, k, &bytes);
        w->view[w->n_views + k + 1] = w->view[w->n_views + k] + padded(bytes);
    }
    const size_t blobs = w->n_views + w->n_images;
    for (size_t k = 0; k < w->n_blobs; k++)
        w->view[blobs + k + 1] = w->view[blobs + k] + gltf_blob_bytes(w, k);
    return LAM_OK;
}

static lam_status plan(gltf_writer *w, lam_error *error) {
    lam_status status = LAM_OK;
    const gltf_mesh *m = w->m;
    if (m->n > GLTF_ELEMENTS_MOST)
        FAIL(error, LAM_ERR_ARGUMENT, "%zu elements, at most %zu have a number in glTF", m->n,
             GLTF_ELEMENTS_MOST);
    TRY(corner_normals_create(m, &w->s, error));
    w->normals = memory_allocate(gltf_largest_group(m->groups), 4 * sizeof *w->normals, "normals", error);
    w->parts = memory_allocate(m->groups->n_groups, sizeof *w->parts, "glTF", error);
    assert(m->lightmap == NULL || (m->light == NULL && (m->pictures == NULL || !m->lightmap->emissive)));
    assert(m->corners == NULL || (m->light == NULL && m->lightmap == NULL));
    assert(m->corners == NULL || !m->corners->shared || m->pictures == NULL);
    assert(m->pictures == NULL || (m->light == NULL && (m->n_channels == 1 || m->n_channels == 3)));
    if (w->normals == NULL || w->parts == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t g = 0; g < m->groups->n_groups; g++) {
        const size_t count = m->groups->start[g + 1] - m->groups->start[g];
        if (count == 0) continue;
        gltf_part *p = &w->parts[w->n_parts++];
        *p = (gltf_part){.group = g, .n_elements = count, .vertex = w->n_vertices, .index = w->n_indices};
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
    TRY(plan_views(w, error));
done:
    return status;
}

static bool say_floats(buffer *b, const char *name, const float values[3]) {
    const double numbers[3] = {(double)values[0], (double)values[1], (double)values[2]};
    return buffer_append_text(b, name) && json_write_doubles(b, numbers, 3);
}

static bool say_extras(const gltf_writer *w, buffer *b) {
    bool good = buffer_append_text(b, "\"extras\":{\"lambert\":{\"name\":") &&
                json_write_text(b, w->m->name) &&
                buffer_printf(b, ",\"elements\":%zu,\"channels\":%zu,\"up\":\"%c\"", w->m->n,
                              w->m->n_channels, w->m->up);
    if (w->m->light != NULL)
        good = good && buffer_append_text(b, ",\"white\":") && json_write_double(b, w->m->light->white);
    if (w->m->lightmap != NULL) good = good && gltf_say_lightmap(w->m->lightmap, b);
    if (w->m->glass != NULL)
        good = good && buffer_printf(b, ",\"glass_law\":\"%s\"", glass_law_word(w->m->glass));
    if (w->m->corners != NULL)
        good = good && buffer_printf(b, ",\"corners\":{\"count\":%zu", w->m->corners->nodes->n_nodes) &&
               (w->n_blobs == 0 ||
                buffer_printf(b, ",\"parts\":%zu,\"first\":%zu,\"elements\":%zu,\"weights\":%zu",
                              w->n_views + w->n_images, w->n_views + w->n_images + 1,
                              w->n_views + w->n_images + 2, w->n_views + w->n_images + 3)) &&
               buffer_append_text(b, "}");
    if (w->m->kind != NULL)
        good = good && buffer_append_text(b, ",\"kind\":") && json_write_text(b, w->m->kind);
    return good && buffer_append_text(b, "}}");
}

/* The elements of a part that figures leave out. */
static bool say_buried(const gltf_writer *w, const gltf_part *p, buffer *b) {
    const uint32_t *elements = gltf_elements_of(w->m, p->group);
    const char *before = ",\"buried\":[";
    bool good = true;
    for (size_t j = 0; j < p->n_elements; j++) {
        if (group_index_counts(w->m->groups, elements[j])) continue;
        good = good && buffer_printf(b, "%s%u", before, elements[j]);
        before = ",";
    }
    return good && (before[1] != '\0' || buffer_append_text(b, "]"));
}

static bool say_glass(const gltf_writer *w, const gltf_part *p, buffer *b) {
    if (!(passes_of(w->m, p->group) > 0)) return true;
    const struct group_glass *of = &w->m->glass->of[p->group];
    return buffer_append_text(b, ",\"glass\":{\"transmittance\":") &&
           json_write_double(b, of->transmittance) && buffer_append_text(b, ",\"faces\":") &&
           json_write_double(b, of->faces) && buffer_append_text(b, "}");
}

/* Node 0 is the root, node and mesh and material 1 + k, k and k are those of part k. */
static bool say_nodes(const gltf_writer *w, buffer *b) {
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

/* The first accessor of part k, and that of its place in an image, which stand behind those of all parts, and
 * that of its place in the lightmap, behind these. */
static size_t first_accessor(const gltf_writer *w, size_t k) {
    return w->n_common * k;
}

static size_t textured_accessor(const gltf_writer *w, const gltf_part *p) {
    return first_accessor(w, w->n_parts) + 2 * p->textured;
}

static size_t map_accessor(const gltf_writer *w, const gltf_part *p) {
    return first_accessor(w, w->n_parts) + 2 * w->n_textured + (size_t)(p - w->parts);
}

static bool say_attributes(const gltf_writer *w, const gltf_part *p, size_t first, buffer *b) {
    const gltf_light *light = w->m->light;
    bool good = buffer_printf(b, "\"POSITION\":%zu,\"NORMAL\":%zu,\"_ELEMENT\":%zu,\"_FACE\":%zu",
                              first + GLTF_VIEW_POSITION, first + GLTF_VIEW_NORMAL, first + GLTF_VIEW_ELEMENT,
                              first + GLTF_VIEW_FACE);
    if (p->surface != PICTURE_NONE)
        good = good && buffer_printf(b, ",\"TEXCOORD_0\":%zu,\"_REFLECTANCE\":%zu", textured_accessor(w, p),
                                     textured_accessor(w, p) + 1);
    /* Numbers of TEXCOORD must begin at 0. */
    if (w->m->lightmap != NULL && p->surface == PICTURE_NONE)
        good = good && buffer_printf(b, ",\"TEXCOORD_0\":%zu", map_accessor(w, p));
    if (w->m->lightmap != NULL) good = good && buffer_printf(b, ",\"TEXCOORD_1\":%zu", map_accessor(w, p));
    if (w->m->corners != NULL) good = good && buffer_printf(b, ",\"_CORNER\":%zu", map_accessor(w, p));
    if (light == NULL) return good;
    good = good && buffer_printf(b, ",\"COLOR_0\":%zu", first + GLTF_VIEW_COLOUR);
    for (size_t k = 0; k < light->n_columns; k++)
        good = good && buffer_append_text(b, ",") && json_write_text(b, light->columns[k]) &&
               buffer_printf(b, ":%zu", first + GLTF_VIEW_COLUMN + k);
    return good;
}

static bool say_meshes(const gltf_writer *w, buffer *b) {
    bool good = buffer_append_text(b, ",\"meshes\":[");
    for (size_t k = 0; k < w->n_parts; k++)
        good = good && buffer_append_text(b, k > 0 ? ",{\"name\":" : "{\"name\":") &&
               json_write_text(b, w->m->groups->names[w->parts[k].group]) &&
               buffer_append_text(b, ",\"primitives\":[{\"attributes\":{") &&
               say_attributes(w, &w->parts[k], first_accessor(w, k), b) &&
               buffer_printf(b, "},\"indices\":%zu,\"material\":%zu,\"mode\":4}]}",
                             first_accessor(w, k) + GLTF_VIEW_INDEX, k);
    return good && buffer_append_text(b, "]");
}

static bool say_surface(const gltf_writer *w, const gltf_part *p, buffer *b) {
    gltf_surface s = {.image = -1,
                      .passes = passes_of(w->m, p->group),
                      .lit = w->m->light != NULL,
                      .lightmap = w->m->lightmap,
                      .lightmap_texture = w->pictures != NULL ? (unsigned)w->pictures->n_surfaces : 0};
    memcpy(s.reflectance, p->reflectance, sizeof s.reflectance);
    memcpy(s.emission, p->emission, sizeof s.emission);
    if (p->surface != PICTURE_NONE) {
        s.image = (long)p->surface;
        for (int c = 0; c < 3; c++) s.factor[c] = (double)w->pictures->surfaces[p->surface].factor[c];
    }
    return gltf_say_surface(&s, b);
}

static bool say_materials(const gltf_writer *w, buffer *b) {
    const bool lit = w->m->light != NULL;
    bool good = buffer_append_text(b, ",\"materials\":["), emits = false;
    for (size_t k = 0; k < w->n_parts; k++) {
        const gltf_part *p = &w->parts[k];
        good = good && buffer_append_text(b, k > 0 ? ",{\"name\":" : "{\"name\":") &&
               json_write_text(b, w->m->groups->names[p->group]) && say_surface(w, p, b) &&
               buffer_append_text(b, "}");
        emits = emits || fmax(p->emission[0], fmax(p->emission[1], p->emission[2])) > 0;
    }
    return good && buffer_append_text(b, "]") && gltf_say_extensions(lit, emits, w->m->lightmap, b);
}

/* Textures are numbered as surfaces, each with a sampler of its own; that of a lightmap is the last. */
static bool say_textures(const gltf_writer *w, buffer *b) {
    static const unsigned wraps[] = {10497, 33648, 33071}; /* repeat, mirrored, clamp to edge */
    static const char of_map[] = "{\"magFilter\":9729,\"minFilter\":9729,\"wrapS\":33071,\"wrapT\":33071}";
    const scene_pictures *p = w->pictures;
    const size_t n = p != NULL ? p->n_surfaces : 0, maps = w->m->lightmap != NULL;
    if (w->n_images == 0) return true;
    bool good = buffer_append_text(b, ",\"samplers\":[");
    for (size_t k = 0; k < n; k++)
        good = good && buffer_printf(b, "%s{\"wrapS\":%u,\"wrapT\":%u}", k > 0 ? "," : "",
                                     wraps[p->surfaces[k].wrap[0]], wraps[p->surfaces[k].wrap[1]]);
    if (maps > 0) good = good && buffer_printf(b, "%s%s", n > 0 ? "," : "", of_map);
    good = good && buffer_append_text(b, "],\"textures\":[");
    for (size_t k = 0; k < n + maps; k++)
        good = good && buffer_printf(b, "%s{\"sampler\":%zu,\"source\":%zu}", k > 0 ? "," : "", k,
                                     k < n ? (size_t)p->surfaces[k].file : w->n_images - 1);
    good = good && buffer_append_text(b, "],\"images\":[");
    for (size_t k = 0; k < w->n_images; k++)
        good = good && buffer_printf(b, "%s{\"bufferView\":%zu,\"mimeType\":\"image/%s\"}", k > 0 ? "," : "",
                                     w->n_views + k, k + maps < w->n_images ? "jpeg" : "png");
    return good && buffer_append_text(b, "]");
}

static bool say_accessor(const gltf_writer *w, const gltf_part *p, size_t v, buffer *b) {
    static const char *const types[] = {NULL, "SCALAR", "VEC2", "VEC3"};
    const bool of_image = w->pictures != NULL && v >= GLTF_VIEW_TEXCOORD && v != w->map_view;
    const size_t first = v == GLTF_VIEW_INDEX ? p->index : of_image ? p->textured_vertex : p->vertex;
    bool good =
        buffer_printf(b,
                      "{\"bufferView\":%zu,\"byteOffset\":%zu,\"componentType\":%d,\"count\":%zu,"
                      "\"type\":\"%s\"",
                      v, width_of(w, v) * first, v == GLTF_VIEW_INDEX ? (int)TYPE_U32 : (int)TYPE_FLOAT,
                      v == GLTF_VIEW_INDEX ? p->n_indices : p->n_vertices, types[count_of(w, v)]);
    if (v == GLTF_VIEW_POSITION)
        good = good && say_floats(b, ",\"min\":", p->low) && say_floats(b, ",\"max\":", p->high);
    return good && buffer_append_text(b, "}");
}

static bool say_accessors(const gltf_writer *w, buffer *b) {
    bool good = buffer_append_text(b, ",\"accessors\":[");
    const size_t n_common = first_accessor(w, 1);
    for (size_t k = 0; k < w->n_parts; k++)
        for (size_t v = 0; v < n_common; v++)
            good = good && (k + v == 0 || buffer_append_text(b, ",")) && say_accessor(w, &w->parts[k], v, b);
    for (size_t k = 0; k < w->n_parts && w->pictures != NULL; k++)
        for (size_t v = GLTF_VIEW_TEXCOORD; v < GLTF_VIEW_IMAGE && w->parts[k].surface != PICTURE_NONE; v++)
            good = good && buffer_append_text(b, ",") && say_accessor(w, &w->parts[k], v, b);
    for (size_t k = 0; k < w->n_parts && w->map_view != SIZE_MAX; k++)
        good = good && buffer_append_text(b, ",") && say_accessor(w, &w->parts[k], w->map_view, b);
    return good && buffer_append_text(b, "]");
}

static size_t binary_bytes(const gltf_writer *w) {
    return w->view[w->n_views + w->n_images + w->n_blobs];
}

static bool say_views(const gltf_writer *w, buffer *b) {
    bool good = buffer_append_text(b, ",\"bufferViews\":[");
    for (size_t v = 0; v < w->n_views; v++) {
        good = good && buffer_printf(b, "%s{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu,\"target\":%d",
                                     v > 0 ? "," : "", w->view[v], w->view[v + 1] - w->view[v],
                                     v == GLTF_VIEW_INDEX ? (int)TARGET_INDICES : (int)TARGET_VERTICES);
        if (v != GLTF_VIEW_INDEX) good = good && buffer_printf(b, ",\"byteStride\":%zu", width_of(w, v));
        good = good && buffer_append_text(b, "}");
    }
    for (size_t k = 0; k < w->n_images; k++) {
        size_t bytes;
        gltf_image_of(w, k, &bytes);
        good = good && buffer_printf(b, ",{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu}",
                                     w->view[w->n_views + k], bytes);
    }
    for (size_t k = w->n_views + w->n_images; k < w->n_views + w->n_images + w->n_blobs; k++)
        good = good && buffer_printf(b, ",{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu}", w->view[k],
                                     w->view[k + 1] - w->view[k]);
    return good && buffer_printf(b, "],\"buffers\":[{\"byteLength\":%zu}]", binary_bytes(w));
}

static bool say_json(gltf_writer *w) {
    static const char spaces[] = "   ";
    buffer *b = &w->json;
    return buffer_append_text(b, "{\"asset\":{\"version\":\"2.0\",\"generator\":\"lambert " LAMBERT_VERSION
                                 "\"},") &&
           say_extras(w, b) && say_nodes(w, b) && say_meshes(w, b) && say_materials(w, b) &&
           say_textures(w, b) && say_accessors(w, b) && say_views(w, b) && buffer_append_text(b, "}") &&
           buffer_append(b, spaces, (4 - b->length % 4) % 4);
}

lam_status gltf_write(const gltf_mesh *m, buffer *out, lam_error *error) {
    lam_status status = LAM_OK;
    gltf_writer w = {.m = m};
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
    char *at = gltf_put(gltf_put(gltf_put(made.bytes, magic), version), (uint32_t)length);
    at = gltf_put(gltf_put(at, (uint32_t)w.json.length), chunk_json);
    memcpy(at, w.json.bytes, w.json.length);
    at = gltf_put(gltf_put(at + w.json.length, (uint32_t)binary_bytes(&w)), chunk_binary);
    for (size_t k = 0; k < w.n_parts; k++) TRY(gltf_put_part(&w, &w.parts[k], at, error));
    gltf_put_images(&w, at);
    gltf_put_blobs(&w, at);
    *out = made;
    made = (buffer){0};
done:
    buffer_free(&made);
    writer_free(&w);
    return status;
}
