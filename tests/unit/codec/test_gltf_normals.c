/* Normals of binary glTF: creases stay, surfaces go around corners, and every one is a unit vector. */
#include "support/request_text.h"
#include "support/small_gltf.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>

#define NO GLTF_NO_VERTEX

START_TEST(normals_keep_creases) {
    static const char *const names[] = {"strip", "other"};
    const double steps[4] = {0, 29, 29, 31}, lengths[4] = {1, 2, 3, 1};
    for (int shared = 0; shared < 2; shared++)
        for (int apart = 0; apart < 2; apart++) {
            small_gltf s = {.m = {.n = 0}};
            small_gltf_strip(&s, 4, steps, lengths, shared != 0);
            if (apart) s.group[1] = 1; /* a surface ends with its group */
            gltf_file l = gltf_load(small_gltf_finish(&s, 2, names));
            const gltf_primitive p = gltf_primitive_of(&l, 1);
            const size_t third = apart ? 1 : 2; /* elements 0, 2 and 3 are left where 1 is apart */
            const char *of[4] = {p.normal, p.normal + 48, p.normal + 48 * third, p.normal + 48 * (third + 1)};
            /* Corners 1 and 2 of an element are its end, 0 and 3 its beginning. */
            if (!apart) {
                double mean[3], length = 0;
                for (int d = 0; d < 3; d++) {
                    mean[d] = s.area[0] * (double)s.normal[0][d] + s.area[1] * (double)s.normal[1][d];
                    length += mean[d] * mean[d];
                }
                for (int d = 0; d < 3; d++)
                    ck_assert_double_eq_tol((double)gltf_float(of[0] + 12 + 4 * d), mean[d] / sqrt(length),
                                            1e-6);
                ck_assert_mem_eq(of[0] + 12, of[1], 12);
                ck_assert_mem_eq(of[0] + 24, of[1] + 36, 12);
                ck_assert_mem_eq(of[1] + 12, of[2], 12);
            } else {
                gltf_is_vector(of[0] + 12, 0, 0, 1);
            }
            ck_assert_mem_ne(of[2] + 12, of[3], 12); /* 31 degrees */
            for (size_t d = 0; d < 3; d++) {
                ck_assert_float_eq_tol(gltf_float(of[3] + 4 * d), s.normal[3][d], 1e-6f);
                ck_assert_float_eq_tol(gltf_float(of[2] + 12 + 4 * d), s.normal[2][d], 1e-6f);
            }
            gltf_unload(&l);
            group_index_free(&s.groups);
        }
}
END_TEST

/* At the top of a pyramid of eight sides neighbours meet at less than 30 degrees, and opposite sides at more:
 * all are one surface. */
START_TEST(a_surface_goes_around_its_corner) {
    static const char *const names[] = {"cone"};
    small_gltf s = {.m = {.n = 0}};
    const uint32_t top = small_gltf_vertex(&s, 0, 0, .6);
    for (int k = 0; k < 8; k++)
        small_gltf_vertex(&s, cos(k * 3.14159265358979 / 4), sin(k * 3.14159265358979 / 4), 0);
    for (uint32_t k = 0; k < 8; k++) small_gltf_element(&s, 0, top, 1 + k, 1 + (k + 1) % 8, NO);
    float apart = 0;
    for (int d = 0; d < 3; d++) apart += s.normal[0][d] * s.normal[4][d];
    ck_assert_float_lt(apart, .8f);
    gltf_file l = gltf_load(small_gltf_finish(&s, 1, names));
    const gltf_primitive p = gltf_primitive_of(&l, 1);
    for (size_t k = 0; k < 8; k++) {
        ck_assert_mem_eq(p.normal + 36 * k, p.normal, 12);
        ck_assert_float_eq_tol(gltf_float(p.normal + 36 * k + 8), 1, 1e-6f);
    }
    gltf_unload(&l);
    group_index_free(&s.groups);
}
END_TEST

START_TEST(both_sides_have_their_normals) {
    static const char *const names[] = {"leaf"};
    small_gltf s = {.m = {.up = 'z'}};
    const double steps[2] = {0, 10}, lengths[2] = {1, 1};
    small_gltf_strip(&s, 2, steps, lengths, true);
    for (uint32_t i = 0; i < 2; i++) {
        const uint32_t *e = s.elements[i];
        small_gltf_element(&s, 0, e[3], e[2], e[1], e[0]);
    }
    gltf_file l = gltf_load(small_gltf_finish(&s, 1, names));
    const gltf_primitive p = gltf_primitive_of(&l, 1);
    ck_assert_uint_eq(p.n_vertices, 16);
    for (size_t i = 0; i < 2; i++)
        for (size_t k = 0; k < 4; k++)
            for (size_t d = 0; d < 3; d++)
                ck_assert(gltf_float(p.normal + 48 * i + 12 * k + 4 * d) ==
                          -gltf_float(p.normal + 48 * (i + 2) + 12 * (3 - k) + 4 * d));
    ck_assert_mem_eq(p.normal + 12, p.normal + 48, 12);
    ck_assert(json_is_false(json_object_get(p.material, "doubleSided")));
    gltf_unload(&l);
    group_index_free(&s.groups);
}
END_TEST

/* The first has no normal, the second neither normal nor area, and the third stands on one place. */
START_TEST(degenerate_elements_have_a_unit_normal) {
    static const char *const names[] = {"odd"};
    small_gltf s = {.m = {.n = 0}};
    small_gltf_vertex(&s, 0, 0, 0);
    small_gltf_vertex(&s, 0, 2, 0);
    small_gltf_vertex(&s, 0, 0, 2);
    small_gltf_element(&s, 0, 0, 1, 2, NO);
    small_gltf_element(&s, 0, 0, 1, 1, NO);
    small_gltf_element(&s, 0, 2, 2, 2, 2);
    for (int i = 0; i < 3; i++) memset(s.normal[i], 0, sizeof s.normal[i]);
    s.area[1] = s.area[2] = 0;
    gltf_file l = gltf_load(small_gltf_finish(&s, 1, names));
    const gltf_primitive p = gltf_primitive_of(&l, 1);
    ck_assert_uint_eq(p.n_vertices, 10);
    for (size_t v = 0; v < p.n_vertices; v++) {
        double square = 0;
        for (size_t d = 0; d < 3; d++) square += pow((double)gltf_float(p.normal + 12 * v + 4 * d), 2);
        ck_assert_double_eq_tol(square, 1, 1e-6);
    }
    for (size_t v = 0; v < 3; v++) gltf_is_vector(p.normal + 12 * v, 1, 0, 0);
    gltf_unload(&l);
    group_index_free(&s.groups);
}
END_TEST

/* A fan of thousands of elements around one vertex: the time is bounded, and flat ones have the exact normal.
 */
START_TEST(a_fan_of_many_elements) {
    enum { FAN = 20000 };
    lam_error error;
    buffer out = {0};
    double(*vertices)[3] = calloc(FAN + 1, sizeof *vertices), *area = calloc(FAN, sizeof *area);
    uint32_t(*elements)[4] = calloc(FAN, sizeof *elements), *group = calloc(FAN, sizeof *group);
    float(*normal)[3] = calloc(FAN, sizeof *normal), *zeros = calloc(FAN, sizeof *zeros);
    for (uint32_t k = 0; k < FAN; k++) {
        vertices[k + 1][0] = cos(k * 6.283185307 / FAN);
        vertices[k + 1][2] = -sin(k * 6.283185307 / FAN);
        memcpy(elements[k], (uint32_t[4]){0, 1 + k, 1 + (k + 1) % FAN, NO}, sizeof *elements);
        area[k] = 1;
        normal[k][1] = 1;
    }
    static const char *const names[] = {"fan"};
    group_index groups = named_groups(FAN, group, 1, names);
    const gltf_mesh m = {.name = "fan",
                         .n_vertices = FAN + 1,
                         .n = FAN,
                         .n_channels = 1,
                         .vertices = (const double(*)[3])vertices,
                         .elements = (const uint32_t(*)[4])elements,
                         .normal = (const float(*)[3])normal,
                         .area = area,
                         .reflectance = zeros,
                         .emission = zeros,
                         .groups = &groups,
                         .up = 'y'};
    ck_ok(gltf_write(&m, &out, &error));
    gltf_file l = gltf_load(&m);
    ck_assert_mem_eq(l.file.bytes, out.bytes, out.length);
    const gltf_primitive p = gltf_primitive_of(&l, 1);
    ck_assert_uint_eq(p.n_vertices, 3 * FAN);
    for (size_t v = 0; v < p.n_vertices; v++) gltf_is_vector(p.normal + 12 * v, 0, 1, 0);
    gltf_unload(&l);
    buffer_free(&out);
    group_index_free(&groups);
    free(vertices);
    free(area);
    free(elements);
    free(group);
    free(normal);
    free(zeros);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("gltf_normals");
    TCase *tests = tcase_create("gltf_normals");
    tcase_add_test(tests, normals_keep_creases);
    tcase_add_test(tests, a_surface_goes_around_its_corner);
    tcase_add_test(tests, both_sides_have_their_normals);
    tcase_add_test(tests, degenerate_elements_have_a_unit_normal);
    tcase_add_test(tests, a_fan_of_many_elements);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
