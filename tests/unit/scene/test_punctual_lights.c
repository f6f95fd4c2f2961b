/* Lights of a glTF that are no faces: from the file into a mesh, their names, and each fault of them. */
#include "support/suite.h"

#include "solver/scene/import/imported_faces.h"
#include "support/scene.h"

static char folder[64];

static void setup(void) {
    folder_make(folder);
}

static void teardown(void) {
    folder_remove(folder);
}

#define USED "\"extensionsUsed\":[\"KHR_lights_punctual\"],"
#define LIGHTS(list) "\"extensions\":{\"KHR_lights_punctual\":{\"lights\":[" list "]}},"
#define LIGHT(k) "\"extensions\":{\"KHR_lights_punctual\":{\"light\":" #k "}}"

/* A triangle, the mesh of the first node. */
#define TRIANGLE                                                                                             \
    "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],"                                     \
    "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\","                 \
    "\"min\":[0,0,0],\"max\":[1,1,0]}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],"                  \
    "\"buffers\":[{\"byteLength\":36,\"uri\":\"data:application/"                                            \
    "octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}]}"

/* Two nodes have the first light, of which one is a child of a node that turns it by 90 degrees about y,
 * scales it by 2 and moves it; one without a name has a light that has one; one is a camera too; one of
 * another scene. */
static const char gltf[] =
    "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0,1,2,4,5,6,7]},{\"nodes\":[8]}]"
    "," USED LIGHTS(
        "{\"type\":\"spot\",\"intensity\":120,\"color\":[1,0.5,0],\"range\":9,\"spot\":{"
        "\"innerConeAngle\":"
        "0.25,\"outerConeAngle\":0.5}},{\"type\":\"point\",\"name\":\"bulb\"},{\"type\":"
        "\"directional\","
        "\"intensity\":1000},{\"type\":\"spot\",\"spot\":{\"outerConeAngle\":1.5707963705}},"
        "{\"type\":\"spot\"}") "\"nodes\":[{\"name\":\"floor\",\"mesh\":0},"
                               "{\"name\":\"lamp\",\"translation\":[1,2,3]," LIGHT(
                                   0) "},"
                                      "{\"name\":\"arm\",\"children\":[3],\"rotation\":[0,0.70710678,"
                                      "0,0.70710678],\"scale\":[2,2,2],"
                                      "\"translation\":[10,0,0]},"
                                      "{\"name\":\"lamp\",\"translation\":[0,0,1]," LIGHT(
                                          0) "},"
                                             "{\"scale\":[0,0,0]," LIGHT(1) "},{" LIGHT(
                                                 2) "},"
                                                    "{\"name\":\" a=b,\\n\\u00fc "
                                                    "\",\"rotation\":[1,0,0,0],\"camera\":0," LIGHT(
                                                        3) "},"
                                                           "{\"name\":\"flat\",\"scale\":[1,1,0]"
                                                           "," LIGHT(4) "},{\"name\":\"away\"," LIGHT(
                                                               0) "}],"
                                                                  "\"cameras\":[{\"type\":"
                                                                  "\"perspective\",\"perspective\":{"
                                                                  "\"yfov\":1,\"znear\":0.1}}]"
                                                                  "," TRIANGLE;

static const punctual_light expected[] = {
    {"lamp", PUNCTUAL_SPOT, 1, {1, 2, 3}, {0, 0, -1}, 120, {1, .5, 0}, .25, .5},
    {"lamp-2", PUNCTUAL_SPOT, 1, {12, 0, 0}, {-1, 0, 0}, 120, {1, .5, 0}, .25, .5},
    {"bulb", PUNCTUAL_POINT, 0, {0, 0, 0}, {0, 0, -1}, 1, {1, 1, 1}, 0, M_PI_4},
    {"light-2", PUNCTUAL_DIRECTIONAL, 0, {0, 0, 0}, {0, 0, -1}, 1000, {1, 1, 1}, 0, M_PI_4},
    {"a_b__\xc3\xbc", PUNCTUAL_SPOT, 0, {0, 0, 0}, {0, 0, 1}, 1, {1, 1, 1}, 0, M_PI_2},
};
enum { EXPECTED = sizeof expected / sizeof *expected };

/* The turn of the file has 8 digits; all else is kept. */
static void check(const mesh *m, double unit) {
    ck_assert_uint_eq(m->n_punctual, EXPECTED);
    for (size_t k = 0; k < EXPECTED; k++) {
        const punctual_light *l = &m->punctual[k], *e = &expected[k];
        ck_assert_str_eq(l->name, e->name);
        ck_assert(l->kind == e->kind && l->has_range == e->has_range && l->intensity == e->intensity);
        ck_assert_msg(l->inner == e->inner && l->outer == e->outer, "light %zu: %.17g to %.17g", k, l->inner,
                      l->outer);
        for (int d = 0; d < 3; d++) {
            ck_assert_double_eq_tol(l->at[d], unit * e->at[d], 1e-7 * unit);
            ck_assert_double_eq_tol(l->direction[d], e->direction[d], 1e-7);
            ck_assert(l->colour[d] == e->colour[d]);
        }
    }
}

/* A GLB of a text, with the triangle in its second chunk. */
static void glb_write(const char *text, char path[256]) {
    static const char end[] = "}]}";
    const float corners[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const char *uri = strstr(text, ",\"uri\":");
    ck_assert_ptr_nonnull(uri);
    const size_t n = (size_t)(uri - text) + strlen(end), padded = (n + 3) / 4 * 4;
    const uint32_t head[5] = {0x46546C67, 2, (uint32_t)(28 + padded + sizeof corners), (uint32_t)padded,
                              0x4E4F534A},
                   next[2] = {sizeof corners, 0x004E4942};
    snprintf(path, 256, "%s/scene.glb", folder);
    FILE *f = fopen(path, "wb");
    ck_assert_ptr_nonnull(f);
    ck_assert_uint_eq(fwrite(head, sizeof head, 1, f), 1);
    fprintf(f, "%.*s%s%.*s", (int)(uri - text), text, end, (int)(padded - n), "   ");
    ck_assert_uint_eq(fwrite(next, sizeof next, 1, f), 1);
    ck_assert_uint_eq(fwrite(corners, sizeof corners, 1, f), 1);
    ck_assert_int_eq(fclose(f), 0);
}

START_TEST(lights_come_with_the_scene) {
    char path[256];
    import_report report;
    lam_error error = {0};
    import_options options = import_plain();
    const mesh_refinement how = {.subdivide_levels = 2};
    mesh m = {0};
    options.unit = .01;
    if (_i == 0)
        file_write(folder, "scene.gltf", gltf, path);
    else
        glb_write(gltf, path);
    ck_ok(scene_import(path, &options, &m, &report, &error));
    check(&m, .01);
    ck_assert_int_eq(m.lights, LIGHT_PHOTOMETRIC);
    ck_assert_uint_eq(m.n_cameras, 1);
    const char *const says[] = {
        ": its 5 lights (KHR_lights_punctual) are read: 1 point, 3 spot, 1 directional",
        ": the range of 2 lights is left out: light ends at surfaces alone",
        ": 1 light (KHR_lights_punctual) is left out: not in the scene that is read",
        ": the light 'flat' is left out: its place or its direction is not usable"};
    for (size_t k = 0; k < sizeof says / sizeof *says; k++)
        ck_assert_msg(strstr(report.warnings, says[k]) != NULL, "%s", report.warnings);
    ck_assert_ptr_null(strstr(report.warnings, "extensions are left out"));
    ck_ok(mesh_refine(&m, &how, &error));
    ck_ok(mesh_make_two_sided(&m, &error));
    check(&m, .01);
    mesh_free(&m);
}
END_TEST

/* Files with one light, or with none, and nodes; nothing is read of a list that no node uses. */
START_TEST(lists_and_nodes_need_each_other) {
    char path[256];
    import_report report;
    const char *const unused[] = {
        "{\"asset\":{\"version\":\"2.0\"},\"scenes\":[{\"nodes\":[0]}]," USED LIGHTS(
            "{\"type\":\"area\"}") "\"nodes\":[{\"mesh\":0}]," TRIANGLE,
        "{\"asset\":{\"version\":\"2.0\"},\"scenes\":[{\"nodes\":[0]}]," USED
        "\"nodes\":[{\"mesh\":0}]," TRIANGLE};
    for (size_t k = 0; k < 2; k++) {
        file_write(folder, "scene.gltf", unused[k], path);
        mesh m = import_good(path, &report);
        ck_assert_uint_eq(m.n_punctual, 0);
        ck_assert_int_eq(m.lights, LIGHT_RADIOMETRIC);
        ck_assert_ptr_null(strstr(report.warnings, "light"));
        mesh_free(&m);
    }
}
END_TEST

/* A light, and what is said of it. */
static const struct {
    const char *light, *says;
} faults[] = {
    {"{}", "lights[0] of KHR_lights_punctual: type = '', must be point, spot or directional"},
    {"{\"type\":\"area\\n\"}", "type = 'area_', must be point, spot or directional"},
    {"{\"type\":\"ar\\nea\"}", "type = 'ar_ea', must be point, spot or directional"},
    {"{\"type\":7}", "type = '', must be point, spot or directional"},
    {"7", "type = '', must be point, spot or directional"},
    {"{\"type\":\"point\",\"intensity\":-3}", "intensity = -3, must be from 0 to 1e+15"},
    {"{\"type\":\"point\",\"intensity\":1e16}", "intensity = 1e+16, must be from 0 to 1e+15"},
    {"{\"type\":\"point\",\"intensity\":\"5\"}", "intensity must be a number"},
    {"{\"type\":\"point\",\"intensity\":null}", "intensity must be a number"},
    {"{\"type\":\"point\",\"color\":[1,-0.5,1]}", "color = -0.5, must be from 0 to 1000000"},
    {"{\"type\":\"point\",\"color\":[1,1]}", "color must be an array of three numbers"},
    {"{\"type\":\"point\",\"color\":[1,1,true]}", "color must be a number"},
    {"{\"type\":\"point\",\"color\":\"red\"}", "color must be an array of three numbers"},
    {"{\"type\":\"spot\",\"spot\":3}", "spot must be an object"},
    {"{\"type\":\"spot\",\"spot\":{\"outerConeAngle\":1.58}}",
     "outerConeAngle = 1.58, must be from 1e-06 to 1.5707"},
    {"{\"type\":\"spot\",\"spot\":{\"outerConeAngle\":0}}", "outerConeAngle = 0, must be from 1e-06"},
    {"{\"type\":\"spot\",\"spot\":{\"innerConeAngle\":-0.1}}", "innerConeAngle = -0.1, must be from 0"},
    {"{\"type\":\"spot\",\"spot\":{\"innerConeAngle\":0.9}}",
     "innerConeAngle = 0.9, must be at most outerConeAngle, 0.7853981634"},
    {"{\"type\":\"spot\",\"spot\":{\"innerConeAngle\":0.6,\"outerConeAngle\":0.5}}",
     "innerConeAngle = 0.6, must be at most outerConeAngle, 0.5"},
};

static void refused(const char *text, const char *says) {
    const import_options options = import_plain();
    char path[256];
    mesh m = {0};
    lam_error error = {0};
    file_write(folder, "scene.gltf", text, path);
    ck_assert_int_eq(scene_import(path, &options, &m, NULL, &error), LAM_ERR_FORMAT);
    ck_assert_msg(strstr(error.message, says) != NULL && strchr(error.message, '\n') == NULL &&
                      strncmp(error.message, path, strlen(path)) == 0,
                  "%s, not %s", error.message, says);
}

#define NODES "\"nodes\":[{\"mesh\":0},{\"name\":\"n\"," LIGHT(0) "}]," TRIANGLE
#define HEAD "{\"asset\":{\"version\":\"2.0\"},\"scenes\":[{\"nodes\":[0,1]}],"

START_TEST(faults_are_named) {
    char text[2048];
    snprintf(text, sizeof text, HEAD USED LIGHTS("%s") NODES, faults[_i].light);
    refused(text, faults[_i].says);
}
END_TEST

START_TEST(lights_that_are_not_there) {
    refused(HEAD USED NODES, "nodes[1]: light of KHR_lights_punctual = 0, but the file has 0 lights");
    refused(HEAD NODES, "nodes[1]: light of KHR_lights_punctual = 0, but the file has 0 lights");
    refused(HEAD USED LIGHTS("{\"type\":\"point\"}") "\"nodes\":[{\"mesh\":0},{" LIGHT(1) "}]," TRIANGLE,
            "nodes[1]: light of KHR_lights_punctual = 1, but the file has 1 lights");
    refused(HEAD USED LIGHTS("{\"type\":\"point\"}") "\"nodes\":[{\"mesh\":0},{" LIGHT(-1) "}]," TRIANGLE,
            "nodes[1]: light of KHR_lights_punctual = -1, but");
    refused(HEAD USED LIGHTS("{\"type\":\"point\"}") "\"nodes\":[{\"mesh\":0},{" LIGHT("x") "}]," TRIANGLE,
            "nodes[1]: light of KHR_lights_punctual must be the number of a light");
}
END_TEST

/* Two angles that single precision made differ, as of a spot without an edge. */
START_TEST(angles_may_be_rounded) {
    char path[256];
    import_report report;
    file_write(folder, "scene.gltf",
               HEAD USED LIGHTS("{\"type\":\"spot\",\"spot\":{\"innerConeAngle\":0.50000003,"
                                "\"outerConeAngle\":0.5}}") NODES,
               path);
    mesh m = import_good(path, &report);
    ck_assert(m.n_punctual == 1 && m.punctual->inner == .5 && m.punctual->outer == .5);
    mesh_free(&m);
}
END_TEST

/* Many lights of one name, with which a number grows, and of names that are cut. */
START_TEST(names_differ) {
    enum { MANY = 3000 };
    char *text = NULL, name[PUNCTUAL_NAME];
    size_t length = 0;
    imported_faces s = {0};
    lam_error error = {0};
    FILE *out = open_memstream(&text, &length);
    fputs("{" LIGHTS("{\"type\":\"point\"}") "\"scenes\":[{\"nodes\":[0", out);
    for (int k = 1; k < MANY; k++) fprintf(out, ",%d", k);
    fputs("]}],\"nodes\":[{\"name\":\"a-3\"," LIGHT(0) "}", out);
    for (int k = 1; k < MANY - 2; k++) fputs(",{\"name\":\"a\"," LIGHT(0) "}", out);
    /* 64 bytes, the last of which is the second of a character. */
    for (int k = 0; k < 2; k++)
        fputs(",{\"name\":\"123456789 123456789 123456789 123456789 123456789 123456789 12\xc3\xbc\"," LIGHT(
                  0) "}",
              out);
    fputs("]}", out);
    fclose(out);
    ck_ok(gltf_read_lights("scene.gltf", text, length, &s, &error));
    ck_assert_uint_eq(s.n_punctual, MANY);
    ck_assert_str_eq(s.punctual[1].name, "a");
    for (int k = 2; k < MANY - 2; k++) { /* a-3 is there */
        snprintf(name, sizeof name, "a-%d", k < 3 ? k : k + 1);
        ck_assert_str_eq(s.punctual[k].name, name);
    }
    ck_assert_str_eq(s.punctual[MANY - 2].name,
                     "123456789 123456789 123456789 123456789 123456789 123456789 12");
    ck_assert_str_eq(s.punctual[MANY - 1].name,
                     "123456789 123456789 123456789 123456789 123456789 123456789 1-2");
    imported_faces_free(&s);
    free(text);
}
END_TEST

START_TEST(broken_files_have_none) {
    static const char *const texts[] = {"{\"KHR_lights_punctual\"", "[\"KHR_lights_punctual\"]",
                                        "{\"nodes\":[7,{\"extensions\":{\"KHR_lights_punctual\":1}}]}"};
    for (size_t k = 0; k < 3; k++) {
        imported_faces s = {0};
        lam_error error = {0};
        ck_ok(gltf_read_lights("scene.gltf", texts[k], strlen(texts[k]), &s, &error));
        ck_assert_uint_eq(s.n_punctual, 0);
        imported_faces_free(&s);
    }
}
END_TEST

START_TEST(lights_are_settled) {
    const punctual_light good = {"a", PUNCTUAL_SPOT, 1, {1, 2, 3}, {0, 3e200, 4e200}, 5, {0, 1, 2}, .1, .2};
    punctual_light l = good;
    ck_assert(punctual_light_settle(&l));
    ck_assert_double_eq_tol(l.direction[1], .6, 1e-15);
    ck_assert_double_eq_tol(l.direction[2], .8, 1e-15);
    for (int k = 0; k < 17; k++) {
        punctual_light bad = good, kept;
        switch (k) {
        case 0:
            bad.name[0] = '\0';
            break;
        case 1:
            memset(bad.name, 'a', sizeof bad.name);
            break;
        case 2:
            strcpy(bad.name, "a=b");
            break;
        case 3:
            strcpy(bad.name, "a\xff");
            break;
        case 4:
            strcpy(bad.name, "a ");
            break;
        case 5:
            bad.kind = PUNCTUAL_KINDS;
            break;
        case 6:
            bad.has_range = 2;
            break;
        case 7:
            bad.at[1] = NAN;
            break;
        case 8:
            bad.at[2] = -1e30;
            break;
        case 9:
            memset(bad.direction, 0, sizeof bad.direction);
            break;
        case 10:
            bad.direction[0] = NAN;
            break;
        case 11:
            bad.intensity = NAN;
            break;
        case 12:
            bad.colour[2] = -1e-9;
            break;
        case 13:
            bad.inner = .3;
            break;
        case 14:
            bad.outer = 1.6;
            break;
        case 15:
            bad.outer = NAN;
            break;
        default:
            bad.inner = bad.outer = 0;
            break;
        }
        kept = bad;
        ck_assert_msg(!punctual_light_settle(&bad), "light %d", k);
        ck_assert_mem_eq(&bad, &kept, sizeof kept);
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("punctual_lights");
    TCase *tests = tcase_create("punctual_lights");
    tcase_set_timeout(tests, 60);
    tcase_add_checked_fixture(tests, setup, teardown);
    tcase_add_loop_test(tests, lights_come_with_the_scene, 0, 2);
    tcase_add_test(tests, lists_and_nodes_need_each_other);
    tcase_add_loop_test(tests, faults_are_named, 0, sizeof faults / sizeof *faults);
    tcase_add_test(tests, lights_that_are_not_there);
    tcase_add_test(tests, angles_may_be_rounded);
    tcase_add_test(tests, names_differ);
    tcase_add_test(tests, broken_files_have_none);
    tcase_add_test(tests, lights_are_settled);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
