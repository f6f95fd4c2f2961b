/* Images in binary glTF: places and reflectances of the vertices of groups that have one, samplers, the files
 * themselves. */
#include "solver/codec/gltf/gltf.h"
#include "support/gltf_file.h"
#include "support/request_text.h"
#include "support/suite.h"

#include <string.h>

#define NO GLTF_NO_VERTEX

/* A strip of five triangles: two of a group with one image, one of a group with the other, and two of a group
 * of which one element alone has an image. */
typedef struct strip {
    double vertices[7][3], area[5];
    uint32_t elements[5][4], group[5], surface[5];
    float normal[5][3], reflectance[15], emission[15], texcoord[5][4][2];
    struct picture_surface surfaces[2];
    uint64_t start[3];
    unsigned char bytes[8];
    scene_pictures pictures;
    group_index groups;
    gltf_mesh m;
} strip;

static void fill(strip *s) {
    static const char *const names[] = {"tiles", "mixed", "carpet"};
    static const uint32_t groups[5] = {0, 1, 0, 1, 2}, surfaces[5] = {1, 1, 1, PICTURE_NONE, 0};
    for (int v = 0; v < 7; v++) memcpy(s->vertices[v], (double[3]){v, 0, -(v % 2)}, sizeof s->vertices[v]);
    for (uint32_t i = 0; i < 5; i++) {
        memcpy(s->elements[i], (uint32_t[4]){i, i + 2, i + 1, NO}, sizeof s->elements[i]);
        memcpy(s->normal[i], (float[3]){0, 1, 0}, sizeof s->normal[i]);
        s->area[i] = 1;
        for (uint32_t c = 0; c < 3; c++) s->reflectance[5 * c + i] = (float)(.1 * (i + 1) + .01 * c);
        for (int k = 0; k < 3; k++) {
            s->texcoord[i][k][0] = (float)i;
            s->texcoord[i][k][1] = (float)(-.25 * k);
        }
    }
    memcpy(s->group, groups, sizeof groups);
    memcpy(s->surface, surfaces, sizeof surfaces);
    s->surfaces[0] = (struct picture_surface){.file = 1, .wrap = {0, 2}, .factor = {1, 1, 1}};
    s->surfaces[1] = (struct picture_surface){.file = 0, .wrap = {1, 0}, .factor = {.5, .25, 1}};
    memcpy(s->bytes, "jpeg1two", 8);
    memcpy(s->start, (uint64_t[3]){0, 5, 8}, sizeof s->start);
    s->pictures = (scene_pictures){.n_surfaces = 2,
                                   .n_files = 2,
                                   .surface = s->surface,
                                   .texcoord = s->texcoord,
                                   .surfaces = s->surfaces,
                                   .start = s->start,
                                   .bytes = s->bytes};
    s->groups = named_groups(5, s->group, 3, names);
    s->m = (gltf_mesh){.name = "strip",
                       .n_vertices = 7,
                       .n = 5,
                       .n_channels = 3,
                       .vertices = (const double(*)[3])s->vertices,
                       .elements = (const uint32_t(*)[4])s->elements,
                       .normal = (const float(*)[3])s->normal,
                       .area = s->area,
                       .reflectance = s->reflectance,
                       .emission = s->emission,
                       .groups = &s->groups,
                       .pictures = &s->pictures,
                       .up = 'y'};
}

static const json_t *surface_of(const gltf_primitive *p) {
    return json_object_get(p->material, "pbrMetallicRoughness");
}

static void has_image(const gltf_file *l, const gltf_primitive *p, size_t texture, const strip *s,
                      const uint32_t *elements) {
    size_t count;
    ck_assert_uint_eq(gltf_number(json_object_get(surface_of(p), "baseColorTexture"), "index"), texture);
    const char *uv = gltf_accessor(l, gltf_number(p->attributes, "TEXCOORD_0"), "VEC2", 5126, 8, &count);
    ck_assert_uint_eq(count, p->n_vertices);
    const char *rho = gltf_accessor(l, gltf_number(p->attributes, "_REFLECTANCE"), "VEC3", 5126, 12, &count);
    ck_assert_uint_eq(count, p->n_vertices);
    for (size_t v = 0; v < count; v++) {
        const uint32_t i = elements[v / 3];
        ck_assert(gltf_float(p->element + 4 * v) == (float)i);
        for (size_t d = 0; d < 2; d++) ck_assert(gltf_float(uv + 8 * v + 4 * d) == s->texcoord[i][v % 3][d]);
        for (size_t c = 0; c < 3; c++)
            ck_assert(gltf_float(rho + 12 * v + 4 * c) == s->reflectance[5 * c + i]);
    }
}

START_TEST(groups_of_one_image_have_it) {
    static const uint32_t tiles[] = {0, 2}, carpet[] = {4};
    strip s = {.area = {0}};
    fill(&s);
    gltf_file l = gltf_load(&s.m);
    const gltf_primitive p[3] = {gltf_primitive_of(&l, 1), gltf_primitive_of(&l, 2),
                                 gltf_primitive_of(&l, 3)};
    has_image(&l, &p[0], 1, &s, tiles);
    has_image(&l, &p[2], 0, &s, carpet);
    /* A group with and without has its mean. */
    ck_assert_ptr_null(json_object_get(p[1].attributes, "TEXCOORD_0"));
    ck_assert_ptr_null(json_object_get(surface_of(&p[1]), "baseColorTexture"));
    const json_t *factor = json_object_get(surface_of(&p[0]), "baseColorFactor");
    for (size_t c = 0; c < 3; c++)
        ck_assert(json_number_value(json_array_get(factor, c)) == (double)s.surfaces[1].factor[c]);
    for (size_t k = 0; k < 2; k++) {
        static const size_t wraps[2][2] = {{10497, 33071}, {33648, 10497}};
        const json_t *texture = gltf_item(l.root, "textures", k),
                     *sampler = gltf_item(l.root, "samplers", gltf_number(texture, "sampler")),
                     *image = gltf_item(l.root, "images", gltf_number(texture, "source")),
                     *view = gltf_item(l.root, "bufferViews", gltf_number(image, "bufferView"));
        ck_assert_uint_eq(gltf_number(sampler, "wrapS"), wraps[k][0]);
        ck_assert_uint_eq(gltf_number(sampler, "wrapT"), wraps[k][1]);
        const uint32_t file = s.surfaces[k].file;
        ck_assert_uint_eq(gltf_number(view, "byteLength"), s.start[file + 1] - s.start[file]);
        ck_assert_uint_eq(gltf_number(view, "byteOffset") % 4, 0);
        ck_assert_mem_eq(l.binary + gltf_number(view, "byteOffset"), s.bytes + s.start[file],
                         s.start[file + 1] - s.start[file]);
    }
    gltf_unload(&l);
    group_index_free(&s.groups);
}
END_TEST

/* A store of one channel has grey images, whose elements have one reflectance for all colours. */
START_TEST(one_channel_has_images_too) {
    static const uint32_t tiles[] = {0, 2};
    size_t count;
    strip s = {.area = {0}};
    fill(&s);
    s.m.n_channels = 1;
    gltf_file l = gltf_load(&s.m);
    const gltf_primitive p = gltf_primitive_of(&l, 1);
    ck_assert_uint_eq(gltf_number(json_object_get(surface_of(&p), "baseColorTexture"), "index"), 1);
    const char *rho = gltf_accessor(&l, gltf_number(p.attributes, "_REFLECTANCE"), "VEC3", 5126, 12, &count);
    ck_assert_uint_eq(count, 6);
    for (size_t k = 0; k < 3 * count; k++) ck_assert(gltf_float(rho + 4 * k) == s.reflectance[tiles[k / 9]]);
    gltf_unload(&l);
    group_index_free(&s.groups);
}
END_TEST

/* Where no group has one image on all its elements, the file is that of a mesh without. */
START_TEST(without_a_group_of_one_image_there_is_none) {
    strip s = {.area = {0}};
    fill(&s);
    s.surface[0] = 0;
    s.surface[4] = PICTURE_NONE;
    gltf_file with = gltf_load(&s.m);
    s.m.pictures = NULL;
    gltf_file without = gltf_load(&s.m);
    ck_assert_uint_eq(with.file.length, without.file.length);
    ck_assert_mem_eq(with.file.bytes, without.file.bytes, with.file.length);
    gltf_unload(&with);
    gltf_unload(&without);
    group_index_free(&s.groups);
}
END_TEST

/* Places in the map are TEXCOORD_1, and TEXCOORD_0 too of a group without an image; the map is the last image
 * and texture. An emissive one stands alone. */
START_TEST(a_lightmap_is_the_last_image) {
    static const uint32_t members[3][2] = {{0, 2}, {1, 3}, {4, 4}};
    static const unsigned char png[] = "a map";
    float places[5][4][2];
    size_t count;
    strip s = {.area = {0}};
    fill(&s);
    for (int i = 0; i < 5; i++)
        for (int k = 0; k < 4; k++) memcpy(places[i][k], (float[2]){.1f * (float)i, .2f * (float)k}, 8);
    gltf_lightmap map = {.texcoord = (const float(*)[4][2])places,
                         .png = png,
                         .png_bytes = 5,
                         .intensity = 6.5,
                         .white = 250,
                         .unit = "lx"};
    s.m.lightmap = &map;
    for (int emissive = 0; emissive < 2; emissive++) {
        map.emissive = emissive == 1;
        s.m.pictures = map.emissive ? NULL : &s.pictures;
        gltf_file l = gltf_load(&s.m);
        const size_t before = map.emissive ? 0 : 2;
        for (size_t g = 0; g < 3; g++) {
            const gltf_primitive p = gltf_primitive_of(&l, 1 + g);
            const size_t own = gltf_number(p.attributes, "TEXCOORD_1");
            const char *uv = gltf_accessor(&l, own, "VEC2", 5126, 8, &count);
            ck_assert_uint_eq(count, p.n_vertices);
            for (size_t v = 0; v < count; v++)
                for (size_t d = 0; d < 2; d++)
                    ck_assert(gltf_float(uv + 8 * v + 4 * d) == places[members[g][v / 3]][v % 3][d]);
            ck_assert_int_eq(gltf_number(p.attributes, "TEXCOORD_0") == own, map.emissive || g == 1);
            const json_t *extension =
                json_object_get(json_object_get(p.material, "extensions"), "MOZ_lightmap");
            const json_t *texture = map.emissive ? json_object_get(p.material, "emissiveTexture") : extension;
            ck_assert_uint_eq(gltf_number(texture, "index"), before);
            ck_assert(map.emissive == (extension == NULL));
            if (extension != NULL)
                ck_assert(json_number_value(json_object_get(extension, "intensity")) == 6.5);
        }
        const json_t *texture = gltf_item(l.root, "textures", before),
                     *image = gltf_item(l.root, "images", gltf_number(texture, "source")),
                     *view = gltf_item(l.root, "bufferViews", gltf_number(image, "bufferView"));
        ck_assert_str_eq(json_string_value(json_object_get(image, "mimeType")), "image/png");
        ck_assert_uint_eq(gltf_number(view, "byteLength"), 5);
        ck_assert_mem_eq(l.binary + gltf_number(view, "byteOffset"), png, 5);
        ck_assert_uint_eq(json_array_size(json_object_get(l.root, "textures")), before + 1);
        gltf_unload(&l);
    }
    group_index_free(&s.groups);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("gltf_images");
    TCase *tests = tcase_create("images");
    tcase_add_test(tests, groups_of_one_image_have_it);
    tcase_add_test(tests, one_channel_has_images_too);
    tcase_add_test(tests, a_lightmap_is_the_last_image);
    tcase_add_test(tests, without_a_group_of_one_image_there_is_none);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
