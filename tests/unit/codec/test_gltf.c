/* Binary glTF of small meshes, read back by the rules of the specification: heads, accessors, light,
 * materials. Normals are those of test_gltf_normals.c. */
#include "solver/codec/gltf/gltf.h"
#include "support/small_gltf.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>

#define NO GLTF_NO_VERTEX

/* Numbers of a JSON array, to single precision. */
static void is_list(const json_t *list, size_t n, const double *wanted) {
    ck_assert_uint_eq(json_array_size(list), n);
    for (size_t k = 0; k < n; k++)
        ck_assert_double_eq_tol(json_number_value(json_array_get(list, k)), wanted[k],
                                1e-7 * (1 + fabs(wanted[k])));
}

/* A quad and two triangles in two groups, the elements of which are mixed. */
static void fill_mixed(small_gltf *s) {
    for (int k = 0; k < 3; k++) {
        small_gltf_vertex(s, k, 0, -1);
        small_gltf_vertex(s, k, 0, 0);
    }
    small_gltf_element(s, 1, 0, 1, 3, NO);
    small_gltf_element(s, 0, 2, 3, 5, 4);
    small_gltf_element(s, 1, 0, 3, 2, NO);
}

START_TEST(a_file_has_what_the_mesh_has) {
    static const char *const names[] = {"floor", "lamp"};
    small_gltf s = {.m = {.name = "r\"a\xC3\xBCm", .kind = "low_rank"}};
    fill_mixed(&s);
    gltf_file l = gltf_load(small_gltf_finish(&s, 2, names));
    const json_t *asset = json_object_get(l.root, "asset");
    ck_assert_str_eq(json_string_value(json_object_get(asset, "version")), "2.0");
    ck_assert_str_eq(json_string_value(json_object_get(asset, "generator")), "lambert " LAMBERT_VERSION);
    ck_assert_uint_eq(json_array_size(json_object_get(l.root, "nodes")), 3);
    ck_assert_ptr_null(json_object_get(l.root, "extensionsUsed"));
    const json_t *root = gltf_item(l.root, "nodes", 0), *children = json_object_get(root, "children");
    ck_assert_uint_eq(json_array_size(children), 2);
    ck_assert_int_eq(json_integer_value(json_array_get(children, 1)), 2);
    const json_t *holders[2] = {l.root, root};
    for (int k = 0; k < 2; k++) {
        const json_t *about = json_object_get(json_object_get(holders[k], "extras"), "lambert");
        ck_assert_str_eq(json_string_value(json_object_get(about, "name")), s.m.name);
        ck_assert_str_eq(json_string_value(json_object_get(about, "kind")), "low_rank");
        ck_assert_uint_eq(gltf_number(about, "elements"), 3);
        ck_assert_uint_eq(gltf_number(about, "channels"), 1);
    }
    const gltf_primitive floor = gltf_primitive_of(&l, 1), lamp = gltf_primitive_of(&l, 2);
    ck_assert_str_eq(floor.name, "floor");
    ck_assert_str_eq(lamp.name, "lamp");
    ck_assert_uint_eq(gltf_number(lamp.extras, "group"), 1);
    ck_assert_uint_eq(gltf_number(lamp.extras, "elements"), 2);
    ck_assert_uint_eq(floor.n_vertices, 4);
    ck_assert_uint_eq(floor.n_indices, 6);
    ck_assert_uint_eq(lamp.n_vertices, 6);
    ck_assert_uint_eq(lamp.n_indices, 6);
    const uint32_t quad[6] = {0, 1, 2, 0, 2, 3}, corner[4] = {2, 3, 5, 4}, lamps[6] = {0, 1, 3, 0, 3, 2};
    for (size_t k = 0; k < 6; k++) {
        ck_assert_uint_eq(gltf_u32(floor.index + 4 * k), quad[k]);
        ck_assert_uint_eq(gltf_u32(lamp.index + 4 * k), k);
        ck_assert(gltf_float(lamp.element + 4 * k) == (k < 3 ? 0.f : 2.f));
        const double *v = s.vertices[lamps[k]];
        gltf_is_vector(lamp.position + 12 * k, v[0], v[1], v[2]);
        gltf_is_vector(lamp.normal + 12 * k, 0, 1, 0);
    }
    for (size_t k = 0; k < 4; k++) {
        const double *v = s.vertices[corner[k]];
        ck_assert(gltf_float(floor.element + 4 * k) == 1.f);
        gltf_is_vector(floor.position + 12 * k, v[0], v[1], v[2]);
    }
    gltf_unload(&l);
    group_index_free(&s.groups);
}
END_TEST

/* A face is a number that a float holds, or -1. */
START_TEST(elements_have_the_numbers_of_their_faces) {
    static const char *const names[2] = {"floor", "lamp"};
    static const uint32_t face[3] = {GLTF_FACES_MOST, UINT32_MAX, GLTF_FACES_MOST + 1};
    for (int known = 0; known < 2; known++) {
        small_gltf s = {.m = {.name = "faces", .kind = "low_rank", .face = known ? face : NULL}};
        fill_mixed(&s);
        gltf_file l = gltf_load(small_gltf_finish(&s, 2, names));
        const gltf_primitive floor = gltf_primitive_of(&l, 1), lamp = gltf_primitive_of(&l, 2);
        for (size_t k = 0; k < 4; k++) ck_assert_float_eq(gltf_float(floor.face + 4 * k), -1);
        for (size_t k = 0; k < 6; k++)
            ck_assert_float_eq(gltf_float(lamp.face + 4 * k), known && k < 3 ? (float)GLTF_FACES_MOST : -1.f);
        gltf_unload(&l);
        group_index_free(&s.groups);
    }
}
END_TEST

/* Elements that figures leave out are named where there are any. */
START_TEST(buried_elements_are_named) {
    static const char *const names[] = {"floor", "lamp"};
    small_gltf s = {.m = {.n = 0}};
    fill_mixed(&s);
    const gltf_mesh *m = small_gltf_finish(&s, 2, names);
    const uint32_t g = s.group[2];
    s.groups.buried = calloc(m->n, sizeof *s.groups.buried);
    s.groups.buried[2] = true;
    gltf_file l = gltf_load(m);
    for (uint32_t k = 0; k < 2; k++) {
        const json_t *list = json_object_get(gltf_primitive_of(&l, k + 1).extras, "buried");
        ck_assert_uint_eq(json_array_size(list), k == g ? 1 : 0);
        ck_assert((list != NULL) == (k == g));
        if (k == g) ck_assert_int_eq(json_integer_value(json_array_get(list, 0)), 2);
    }
    gltf_unload(&l);
    group_index_free(&s.groups);
}
END_TEST

START_TEST(groups_without_elements_are_left_out) {
    static const char *const names[] = {"nothing", "floor", "none", "lamp", "empty"};
    small_gltf s = {.m = {.n = 0}};
    fill_mixed(&s);
    for (int i = 0; i < 3; i++) s.group[i] = s.group[i] == 0 ? 1 : 3;
    gltf_file l = gltf_load(small_gltf_finish(&s, 5, names));
    ck_assert_uint_eq(json_array_size(json_object_get(l.root, "nodes")), 3);
    ck_assert_str_eq(gltf_primitive_of(&l, 1).name, "floor");
    ck_assert_uint_eq(gltf_number(gltf_primitive_of(&l, 2).extras, "group"), 3);
    gltf_unload(&l);
    group_index_free(&s.groups);
}
END_TEST

START_TEST(y_is_up) {
    static const char *const names[] = {"floor"};
    static const char ups[] = "xyz";
    for (int u = 0; ups[u] != '\0'; u++) {
        const int up = ups[u] - 'x', east = (up + 1) % 3, north = (up + 2) % 3; /* right-handed */
        small_gltf s = {.m = {.up = ups[u]}};
        for (int k = 0; k < 3; k++) {
            double at[3] = {0, 0, 0};
            at[up] = 5;
            if (k == 1) at[east] = 2;
            if (k == 2) at[north] = 3;
            small_gltf_vertex(&s, at[0], at[1], at[2]);
        }
        small_gltf_element(&s, 0, 0, 1, 2, NO);
        gltf_file l = gltf_load(small_gltf_finish(&s, 1, names));
        const gltf_primitive p = gltf_primitive_of(&l, 1);
        gltf_is_vector(p.position, 0, 5, 0);
        double corner[3][3], normal[3];
        for (size_t k = 0; k < 3; k++) {
            gltf_is_vector(p.normal + 12 * k, 0, 1, 0);
            for (size_t d = 0; d < 3; d++) corner[k][d] = (double)gltf_float(p.position + 12 * k + 4 * d);
        }
        /* No mirror: counter-clockwise stays so, and as large. */
        ck_assert_double_eq(small_gltf_facing(corner[0], corner[1], corner[2], normal), 3);
        ck_assert_double_eq(normal[1], 1);
        if (ups[u] == 'z')
            gltf_is_vector(p.position + 12, 2, 5, 0), gltf_is_vector(p.position + 24, 0, 5, -3);
        /* No component is -0. */
        for (size_t k = 0; k < 9; k++)
            ck_assert(gltf_float(p.position + 4 * k) != 0 || gltf_u32(p.position + 4 * k) == 0);
        for (size_t k = 0; k < 9; k++)
            ck_assert(gltf_float(p.normal + 4 * k) != 0 || gltf_u32(p.normal + 4 * k) == 0);
        gltf_unload(&l);
        group_index_free(&s.groups);
    }
}
END_TEST

/* 100 column + 10 element + corner, in quarters. */
static float some_light(const void *context, size_t column, size_t element, size_t corner) {
    (void)context;
    return (float)(100 * column + 10 * element + corner) / 4;
}

START_TEST(light_is_at_corners) {
    static const char *const names[] = {"strip"}, *const columns[] = {"_A", "_B", "_C", "_D",
                                                                      "_E", "_F", "_G", "_H"};
    const double steps[2] = {0, 90}, lengths[2] = {1, 3};
    static const size_t channels[] = {1, 3, 4};
    for (size_t c = 0; c < 3; c++) {
        const size_t C = channels[c];
        const gltf_light light = {.n_columns = 2 * C, .columns = columns, .value = some_light, .white = 40};
        small_gltf s = {.m = {.n_channels = C, .light = &light}};
        small_gltf_strip(&s, 2, steps, lengths, true);
        s.emission[0] = 1; /* an unlit material has none */
        gltf_file l = gltf_load(small_gltf_finish(&s, 1, names));
        const gltf_primitive p = gltf_primitive_of(&l, 1);
        size_t count;
        const char *colour =
            gltf_accessor(&l, gltf_number(p.attributes, "COLOR_0"), "VEC3", 5126, 12, &count);
        ck_assert_uint_eq(count, 8);
        for (size_t v = 0; v < 8; v++) {
            const size_t element = v / 4, corner = v % 4;
            for (size_t k = 0; k < 2 * C; k++) {
                const char *of =
                    gltf_accessor(&l, gltf_number(p.attributes, columns[k]), "SCALAR", 5126, 4, &count);
                ck_assert(gltf_float(of + 4 * v) == some_light(NULL, k, element, corner));
            }
            /* Four channels are the grey of their mean, 1.5 columns above the first. */
            double shown[3];
            for (size_t d = 0; d < 3; d++)
                shown[d] = fmin(
                    ((double)some_light(NULL, C == 3 ? d : 0, element, corner) + (C == 4 ? 37.5 : 0)) / 40,
                    1);
            gltf_is_vector(colour + 12 * v, shown[0], shown[1], shown[2]);
        }
        ck_assert_ptr_nonnull(
            json_object_get(json_object_get(p.material, "extensions"), "KHR_materials_unlit"));
        ck_assert_ptr_null(json_object_get(p.material, "emissiveFactor"));
        ck_assert_uint_eq(json_array_size(json_object_get(l.root, "extensionsUsed")), 1);
        const json_t *about = json_object_get(json_object_get(l.root, "extras"), "lambert");
        ck_assert_double_eq(json_number_value(json_object_get(about, "white")), 40);
        gltf_unload(&l);
        group_index_free(&s.groups);
    }
}
END_TEST

START_TEST(materials_are_means_by_area) {
    static const char *const names[] = {"strip"};
    const double steps[2] = {0, 90}, lengths[2] = {1, 3};
    static const struct {
        size_t C;
        float reflectance[8], emission[8];     /* [C][2] */
        double colour[4], factor[3], exitance; /* the largest component */
    } cases[] = {
        {1, {.2f, .6f}, {0, 0}, {.5, .5, .5, 1}, {0, 0, 0}, 0},
        {1, {.2f, .6f}, {8, 0}, {.5, .5, .5, 1}, {1, 1, 1}, 2},
        {3, {.2f, .6f, 0, .4f, 1, 1}, {0, 0, 4, 4, 0, 4}, {.5, .3, 1, 1}, {0, 1, .75}, 4},
        {4,
         {.1f, .1f, .2f, .2f, .3f, .3f, .4f, .4f},
         {0, 0, 0, 0, 0, 0, 8, 8},
         {.25, .25, .25, 1},
         {1, 1, 1},
         2},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        small_gltf s = {.m = {.n_channels = cases[k].C}};
        small_gltf_strip(&s, 2, steps, lengths, true);
        memcpy(s.reflectance, cases[k].reflectance, sizeof cases[k].reflectance);
        memcpy(s.emission, cases[k].emission, sizeof cases[k].emission);
        gltf_file l = gltf_load(small_gltf_finish(&s, 1, names));
        const json_t *material = gltf_primitive_of(&l, 1).material,
                     *pbr = json_object_get(material, "pbrMetallicRoughness");
        ck_assert_str_eq(json_string_value(json_object_get(material, "name")), "strip");
        is_list(json_object_get(pbr, "baseColorFactor"), 4, cases[k].colour);
        ck_assert_uint_eq(gltf_number(pbr, "metallicFactor"), 0);
        ck_assert_uint_eq(gltf_number(pbr, "roughnessFactor"), 1);
        const json_t *extensions = json_object_get(material, "extensions");
        if (cases[k].exitance > 0) {
            is_list(json_object_get(material, "emissiveFactor"), 3, cases[k].factor);
            const json_t *strength = json_object_get(extensions, "KHR_materials_emissive_strength");
            ck_assert_double_eq_tol(json_number_value(json_object_get(strength, "emissiveStrength")),
                                    cases[k].exitance / M_PI, 1e-6);
            ck_assert_str_eq(json_string_value(gltf_item(l.root, "extensionsUsed", 0)),
                             "KHR_materials_emissive_strength");
        } else {
            ck_assert_ptr_null(extensions);
            ck_assert_ptr_null(json_object_get(l.root, "extensionsUsed"));
        }
        gltf_unload(&l);
        group_index_free(&s.groups);
    }
}
END_TEST

START_TEST(limits_are_named) {
    static const char *const names[] = {"floor"};
    lam_error error;
    buffer out = {0};
    small_gltf s = {.m = {.n = 0}};
    fill_mixed(&s);
    memset(s.group, 0, sizeof s.group);
    gltf_mesh m = *small_gltf_finish(&s, 1, names);
    m.n = GLTF_ELEMENTS_MOST + 1; /* refused before any is looked at */
    ck_assert_int_eq(gltf_write(&m, &out, &error), LAM_ERR_ARGUMENT);
    ck_assert_str_eq(error.message, "16777217 elements, at most 16777216 have a number in glTF");
    m.n = 3;
    s.vertices[5][1] = 1e39;
    ck_assert_int_eq(gltf_write(&m, &out, &error), LAM_ERR_ARGUMENT);
    ck_assert_str_eq(error.message, "vertices[5] = 2, 1e+39, 0: glTF holds floats");
    ck_assert_ptr_null(out.bytes);
    const gltf_sizes large = {.n = SIZE_MAX / 2, .n_vertices = SIZE_MAX / 2};
    ck_assert_uint_eq(gltf_bytes_most(&large), SIZE_MAX);
    ck_assert_uint_eq(gltf_work_bytes(&large), SIZE_MAX);
    group_index_free(&s.groups);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("gltf");
    TCase *tests = tcase_create("gltf");
    tcase_add_test(tests, a_file_has_what_the_mesh_has);
    tcase_add_test(tests, elements_have_the_numbers_of_their_faces);
    tcase_add_test(tests, groups_without_elements_are_left_out);
    tcase_add_test(tests, buried_elements_are_named);
    tcase_add_test(tests, y_is_up);
    tcase_add_test(tests, light_is_at_corners);
    tcase_add_test(tests, materials_are_means_by_area);
    tcase_add_test(tests, limits_are_named);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
