/* Encodings of texts, files beside the scene, and heads that lie: files of other programs and of enemies. */
#include "support/suite.h"

#include "solver/scene/import/imported_faces.h"
#include "support/scene.h"

#include <sys/stat.h>
#include <unistd.h>

/* A folder that each test has to itself. */
static char folder[64];

static void setup(void) {
    folder_make(folder);
}

static void teardown(void) {
    folder_remove(folder);
}

#define SQUARE "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"

START_TEST(byte_order_marks_are_passed_over) {
    char path[256];
    import_report report;
    mesh m = obj_good(folder, "\xEF\xBB\xBF" SQUARE "g wall\nf 1 2 3 4\n", &report);
    ck_assert_uint_eq(m.n_vertices, 4);
    mesh_free(&m);
    file_write(folder, "scene.mtl", "\xEF\xBB\xBFnewmtl a\nKd .25 .25 .25\n", path);
    m = obj_good(folder, "mtllib scene.mtl\n" SQUARE "usemtl a\nf 1 2 3 4\n", &report);
    ck_assert_float_eq(m.reflectance[0], .25f);
    mesh_free(&m);
    obj_bad(folder, "\xFF\xFEv", "UTF-16; save it as UTF-8");
}
END_TEST

/* Names of another encoding could not be told in JSON. */
START_TEST(names_become_utf8) {
    import_report report;
    mtl_write(folder, "newmtl wei\xDF\nKd .75 .75 .75\nnewmtl \xE2\x82\xAC\nKd .25 .25 .25\n");
    mesh m = obj_good(folder,
                      "mtllib scene.mtl\n" SQUARE "g K\xFC"
                      "che\nusemtl wei\xDF\nf 1 2 3\nusemtl \xE2\x82\xAC\n"
                      "f 1 3 4\ng K\xFC"
                      "che\nf 2 3 4\n",
                      &report);
    ck_assert_uint_eq(m.n_groups, 2);
    ck_assert_str_eq(m.group_names[m.group[0]], "K\xC3\xBC"
                                                "che.wei\xC3\x9F");
    ck_assert_str_eq(m.group_names[m.group[1]], "K\xC3\xBC"
                                                "che.\xE2\x82\xAC");
    ck_assert_float_eq(m.reflectance[0], .75f);
    ck_assert_float_eq(m.reflectance[2], .25f);
    ck_assert_ptr_nonnull(strstr(report.warnings, "2 names are not UTF-8, read as Latin-1"));
    mesh_free(&m);
}
END_TEST

/* Imports path with a folder of assets; the message of a refusal must say so, or *m is filled. */
static void import_beside(const char *path, const char *assets, const char *says, mesh *m) {
    import_options options = import_plain();
    lam_error error = {0};
    options.assets = assets;
    const lam_status status = scene_import(path, &options, m, NULL, &error);
    if (says == NULL) {
        ck_assert_msg(status == LAM_OK, "%s", error.message);
        return;
    }
    ck_assert_int_eq(status, LAM_ERR_FORMAT);
    ck_assert_msg(strstr(error.message, says) != NULL, "%s", error.message);
}

START_TEST(files_outside_the_folder_need_assets) {
    char path[256], inner[128], mtl[256];
    mesh m = {0};
    file_write(folder, "grey.mtl", "newmtl a\nKd .25 .25 .25\n", mtl);
    snprintf(inner, sizeof inner, "%s/inner", folder);
    ck_assert_int_eq(mkdir(inner, 0700), 0);
    const char *const references[] = {"../grey.mtl", mtl, "link.mtl", "../inner/../grey.mtl"};
    char link[256];
    snprintf(link, sizeof link, "%s/link.mtl", inner);
    ck_assert_int_eq(symlink("../grey.mtl", link), 0);
    for (size_t i = 0; i < sizeof references / sizeof *references; i++) {
        char text[512];
        snprintf(text, sizeof text, "mtllib %s\n" SQUARE "usemtl a\nf 1 2 3 4\n", references[i]);
        file_write(inner, "scene.obj", text, path);
        import_beside(path, NULL, "scene.obj:1: the material file '", &m);
        import_beside(path, inner, "lies outside the scene's folder; --assets", &m);
        import_beside(path, folder, NULL, &m);
        ck_assert_float_eq(m.reflectance[0], .25f);
        mesh_free(&m);
    }
    import_options nowhere = import_plain();
    lam_error error = {0};
    nowhere.assets = path;
    ck_assert_int_eq(scene_import(path, &nowhere, &m, NULL, &error), LAM_ERR_ARGUMENT);
    ck_assert_msg(strstr(error.message, "must be a folder") != NULL, "%s", error.message);
    /* A file that does not lie beside the scene is looked for among the assets. */
    file_write(inner, "scene.obj", "mtllib grey.mtl\n" SQUARE "usemtl a\nf 1 2 3 4\n", path);
    import_beside(path, NULL, "'grey.mtl' is missing", &m);
    import_beside(path, folder, NULL, &m);
    mesh_free(&m);
    /* A folder whose name begins like that of the scene's is another. */
    char beside[128];
    snprintf(beside, sizeof beside, "%s/inner2", folder);
    ck_assert_int_eq(mkdir(beside, 0700), 0);
    file_write(beside, "grey.mtl", "newmtl a\nKd .25 .25 .25\n", path);
    file_write(inner, "scene.obj", "mtllib ../inner2/grey.mtl\n" SQUARE "usemtl a\nf 1 2 3 4\n", path);
    import_beside(path, NULL, "lies outside the scene's folder", &m);
    import_beside(path, beside, NULL, &m);
    mesh_free(&m);
    /* From the folder above, which has the folder of the assets in it. */
    file_write(folder, "above.obj", "mtllib inner/link.mtl\n" SQUARE "usemtl a\nf 1 2 3 4\n", path);
    import_beside(path, NULL, NULL, &m);
    mesh_free(&m);
}
END_TEST

/* Other systems divide paths by backslashes and do not tell capitals from small letters. */
START_TEST(names_of_other_systems_find_their_files) {
    char path[256], text[512], inner[128];
    mesh m = {0};
    file_write(folder, "m.mtl", "newmtl a\nKd .25 .25 .25\n", path);
    snprintf(inner, sizeof inner, "%s/Parts of it", folder);
    ck_assert_int_eq(mkdir(inner, 0700), 0);
    file_write(inner, "Grey.mtl", "newmtl a\nKd .75 .75 .75\n", path);
    const struct {
        const char *name, *refused;
        float grey;
    } cases[] = {{".\\m.mtl", NULL, .25f},
                 {"M.MTL", NULL, .25f},
                 {"./M.mtl", NULL, .25f},
                 {"C:\\Users\\me\\M.mtl", NULL, .25f},
                 {"parts OF it\\grey.MTL", NULL, .75f},
                 {"Parts of it/../M.mtl", NULL, .25f},
                 {"Grey.mtl", "'Grey.mtl' is missing", 0},
                 {"m.mt", "'m.mt' is missing", 0},
                 {"..\\m.mtl", "'..\\m.mtl' is missing", 0},
                 {"C:/", "'C:/' is missing", 0}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        snprintf(text, sizeof text, "mtllib %s\n" SQUARE "usemtl a\nf 1 2 3 4\n", cases[k].name);
        file_write(folder, "scene.obj", text, path);
        import_beside(path, NULL, cases[k].refused, &m);
        if (cases[k].refused == NULL) ck_assert_float_eq(m.reflectance[0], cases[k].grey);
        mesh_free(&m);
    }
    file_write(folder, "scene.obj", "mtllib gREY.mtl\n" SQUARE "usemtl a\nf 1 2 3 4\n", path);
    import_beside(path, inner, NULL, &m); /* among the assets */
    mesh_free(&m);
    file_write(folder, "M.mtl", "newmtl a\nKd .5 .5 .5\n", path);
    file_write(folder, "scene.obj", "mtllib m.mtl\n" SQUARE "usemtl a\nf 1 2 3 4\n", path);
    import_beside(path, NULL, NULL, &m); /* its own spelling */
    ck_assert_float_eq(m.reflectance[0], .25f);
    mesh_free(&m);
    file_write(folder, "scene.obj", "mtllib M.MTL\n" SQUARE "usemtl a\nf 1 2 3 4\n", path);
    import_beside(path, NULL, "several differ from it by capitals alone (", &m);
}
END_TEST

START_TEST(buffers_outside_the_folder_need_assets) {
    const float corners[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    char path[256], inner[128];
    mesh m = {0};
    snprintf(inner, sizeof inner, "%s/inner", folder);
    ck_assert_int_eq(mkdir(inner, 0700), 0);
    snprintf(path, sizeof path, "%s/corners.bin", folder);
    FILE *file = fopen(path, "wb");
    ck_assert_ptr_nonnull(file);
    ck_assert_uint_eq(fwrite(corners, sizeof corners, 1, file), 1);
    ck_assert_int_eq(fclose(file), 0);
    static const char text[] =
        "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"uri\":\"%s\",\"byteLength\":36}],"
        "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],\"accessors\":[{\"bufferView\":0,"
        "\"componentType\":5126,"
        "\"count\":3,\"type\":\"VEC3\",\"min\":[0,0,0],\"max\":[1,1,0]}],\"meshes\":[{\"primitives\":[{"
        "\"attributes\":{\"POSITION\":0}}]}],\"nodes\":[{\"mesh\":0}],\"scenes\":[{\"nodes\":[0]}],\"scene\":"
        "0%s}";
    char whole[1024];
    snprintf(whole, sizeof whole, text, "../corners.bin", "");
    file_write(inner, "scene.gltf", whole, path);
    import_beside(path, NULL, "'../corners.bin', which lies outside the scene's folder", &m);
    import_beside(path, folder, NULL, &m);
    ck_assert_double_eq_tol(total_area(&m), .5, 1e-12);
    mesh_free(&m);
    snprintf(whole, sizeof whole, text, "corners.bin", ",\"extensionsRequired\":[\"KHR_materials_ior\"]");
    file_write(folder, "scene.gltf", whole, path);
    import_beside(path, NULL, NULL, &m);
    mesh_free(&m);
    snprintf(whole, sizeof whole, text, "corners.bin",
             ",\"extensionsRequired\":[\"KHR_materials_ior\",\"KHR_meshopt_compression\"]");
    file_write(folder, "scene.gltf", whole, path);
    import_beside(path, NULL, "requires the extension 'KHR_meshopt_compression'", &m);
}
END_TEST

/* The library reads on and on behind the end of such a file. */
START_TEST(headers_without_their_entries_are_refused) {
    const char *const formats[] = {"ascii", "binary_little_endian", "binary_big_endian"};
    char path[256], text[512];
    mesh m = {0};
    for (size_t i = 0; i < 3; i++) {
        snprintf(
            text, sizeof text,
            "ply\nformat %s 1.0\ncomment none\nelement vertex 50000000\nproperty float x\nproperty float y\n"
            "property float z\nelement face 40000000\nproperty list uchar int vertex_indices\nend_header\n",
            formats[i]);
        file_write(folder, "scene.ply", text, path);
        import_beside(path, NULL,
                      "cut off: its header names 50000000 entries of 'vertex', and 1 bytes follow", &m);
    }
    /* The least bytes that such a file can have. */
    file_write(
        folder, "scene.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2",
        path);
    import_beside(path, NULL, NULL, &m);
    ck_assert_double_eq_tol(total_area(&m), .5, 1e-12);
    mesh_free(&m);
}
END_TEST

/* - is standard input: its files lie in the current folder, and it may be as large as half of the memory. */
START_TEST(standard_input_is_a_file_without_a_name) {
    char path[256], large[1024];
    const int kept = dup(STDIN_FILENO);
    import_options options = import_plain();
    lam_error error = {0};
    mesh m = {0};
    ck_assert_int_ge(kept, 0);
    options.format = "obj";
    options.assets = folder;
    mtl_write(folder, "newmtl a\nKd .25 .25 .25\n");
    file_write(folder, "odd", "mtllib scene.mtl\n" SQUARE "usemtl a\nf 1 2 3 4\n", path);
    ck_assert_ptr_nonnull(freopen(path, "r", stdin));
    ck_assert_msg(scene_import("-", &options, &m, NULL, &error) == LAM_OK, "%s", error.message);
    ck_assert_float_eq(m.reflectance[0], .25f);
    ck_assert_str_eq(m.name, "stdin");
    mesh_free(&m);
    memset(large, ' ', sizeof large - 1);
    large[sizeof large - 1] = '\0';
    file_write(folder, "odd", large, path);
    ck_assert_ptr_nonnull(freopen(path, "r", stdin));
    options.memory_bytes = 1024;
    ck_assert_int_eq(scene_import("-", &options, &m, NULL, &error), LAM_ERR_MEMORY);
    ck_assert_msg(strstr(error.message, "standard input: more than the") != NULL, "%s", error.message);
    options.format = NULL;
    ck_assert_int_eq(scene_import("-", &options, &m, NULL, &error), LAM_ERR_ARGUMENT);
    ck_assert_int_eq(dup2(kept, STDIN_FILENO), STDIN_FILENO);
    close(kept);
}
END_TEST

#define FACET(A, B, C)                                                                                       \
    "facet normal 0 0 0\nouter loop\nvertex " A "\nvertex " B "\nvertex " C "\nendloop\nendfacet\n"

/* The library takes small letters alone, from the first byte on. */
START_TEST(texts_of_stl_are_read_whatever_their_letters) {
    static const char plain[] = "solid A b\n" FACET("0 0 0", "1.0e0 0 0", "0 1 0") "endsolid A b\n";
    const char *const before[] = {"", "\n  \r\n\t", "\xEF\xBB\xBF", "\xEF\xBB\xBF\n "};
    char path[256], text[512];
    for (size_t k = 0; k < 8; k++) {
        mesh m = {0};
        int length = snprintf(text, sizeof text, "%s%s", before[k / 2], plain);
        for (int c = 0; k % 2 == 1 && c < length; c++)
            if (text[c] >= 'a' && text[c] <= 'z') text[c] = (char)(text[c] - 'a' + 'A');
        file_write(folder, "scene.STL", text, path);
        import_beside(path, NULL, NULL, &m);
        ck_assert_double_eq_tol(total_area(&m), .5, 1e-7);
        ck_assert_str_eq(m.group_names[0], "A");
        mesh_free(&m);
    }
}
END_TEST

/* A head of a binary file may say "solid", and bytes may follow the last triangle. */
START_TEST(binary_stl_may_begin_with_solid) {
    char path[256], bytes[84 + 50 + 2] = " Solid made by a program";
    const float corners[12] = {0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0};
    bytes[80] = 1;
    memcpy(bytes + 84, corners, sizeof corners);
    for (size_t k = 0; k < 3; k++) {
        mesh m = {0};
        snprintf(path, sizeof path, "%s/scene.stl", folder);
        FILE *f = fopen(path, "wb");
        ck_assert_ptr_nonnull(f);
        ck_assert_uint_eq(fwrite(bytes, sizeof bytes - k, 1, f), 1);
        ck_assert_int_eq(fclose(f), 0);
        import_beside(path, NULL, NULL, &m);
        ck_assert_double_eq_tol(total_area(&m), .5, 1e-7);
        mesh_free(&m);
        memmove(bytes, bytes + (k == 0), 24); /* once with a blank before it, then without */
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("import_assets");
    TCase *tests = tcase_create("import_assets");
    tcase_add_checked_fixture(tests, setup, teardown);
    tcase_add_test(tests, byte_order_marks_are_passed_over);
    tcase_add_test(tests, names_become_utf8);
    tcase_add_test(tests, files_outside_the_folder_need_assets);
    tcase_add_test(tests, names_of_other_systems_find_their_files);
    tcase_add_test(tests, buffers_outside_the_folder_need_assets);
    tcase_add_test(tests, headers_without_their_entries_are_refused);
    tcase_add_test(tests, standard_input_is_a_file_without_a_name);
    tcase_add_test(tests, texts_of_stl_are_read_whatever_their_letters);
    tcase_add_test(tests, binary_stl_may_begin_with_solid);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
