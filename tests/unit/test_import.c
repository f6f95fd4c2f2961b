#include "support/suite.h"

#include "solver/scene/soup.h"
#include "support/scene.h"

#include <dirent.h>
#include <signal.h>
#include <sys/stat.h>

/* A folder that each test has to itself. */
static char folder[64];

static void setup(void) {
    folder_make(folder);
}

static void teardown(void) {
    folder_remove(folder);
}

/* Imports a text as scene.obj; on LAM_OK m is the caller's. */
static lam_status import_text(const char *text, mesh *m, import_report *report, lam_error *error) {
    char path[256];
    const import_options options = import_plain();
    file_write(folder, "scene.obj", text, path);
    return scene_import(path, &options, m, report, error);
}

static mesh good_text(const char *text, import_report *report) {
    mesh m = {0};
    lam_error error = {0};
    ck_assert_msg(import_text(text, &m, report, &error) == LAM_OK, "%s", error.message);
    return m;
}

/* The text is refused with a message that names the file and says this. */
static void bad_text(const char *text, const char *says) {
    mesh m = {0};
    lam_error error = {0};
    ck_assert_int_eq(import_text(text, &m, NULL, &error), LAM_ERR_FORMAT);
    ck_assert_msg(strstr(error.message, folder) != NULL && strstr(error.message, says) != NULL, "%s",
                  error.message);
    ck_assert_ptr_null(m.vertices);
}

static void write_mtl(const char *text) {
    char path[256];
    file_write(folder, "scene.mtl", text, path);
}

#define SQUARE "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"

/* --- fixtures ------------------------------------------------------------------------------------------ */

static lam_status import_fixture(const char *name, mesh *m, import_report *report, lam_error *error) {
    char path[512];
    const import_options options = import_plain();
    snprintf(path, sizeof path, FIXTURES "/%s", name);
    return scene_import(path, &options, m, report, error);
}

/* A mesh that came out is sound; a refusal is one line that names the file. */
static void assert_loads_or_refuses(const char *path) {
    const import_options options = import_plain();
    mesh m = {0};
    lam_error error = {0};
    const lam_status status = scene_import(path, &options, &m, NULL, &error);
    if (status != LAM_OK) {
        ck_assert_msg(status == LAM_ERR_FORMAT, "%s: status %d", error.message, (int)status);
        ck_assert_msg(strstr(error.message, path) != NULL && strchr(error.message, '\n') == NULL, "%s",
                      error.message);
        ck_assert_msg(strstr(error.message, "crashed") == NULL && strstr(error.message, "answer") == NULL,
                      "%s", error.message);
        return;
    }
    ck_assert_uint_gt(m.n, 0);
    for (size_t i = 0; i < m.n; i++) {
        ck_assert(m.area[i] > 0 && isfinite(m.area[i]));
        ck_assert_uint_lt(m.group[i], m.n_groups);
        for (size_t k = 0; k < 4; k++)
            ck_assert(m.elements[i][k] < m.n_vertices || (k == 3 && m.elements[i][k] == MESH_NO_VERTEX));
    }
    for (size_t i = 0; i < m.n * m.n_channels; i++) {
        ck_assert(m.reflectance[i] >= 0 && m.reflectance[i] < 1);
        ck_assert(m.emission[i] >= 0 && isfinite(m.emission[i]));
    }
    mesh_free(&m);
}

static size_t visit_files(const char *path) {
    size_t n = 0;
    DIR *entries = opendir(path);
    ck_assert_ptr_nonnull(entries);
    for (struct dirent *entry; (entry = readdir(entries)) != NULL;) {
        char full[1024];
        struct stat about;
        if (entry->d_name[0] == '.') continue;
        snprintf(full, sizeof full, "%s/%s", path, entry->d_name);
        ck_assert_int_eq(stat(full, &about), 0);
        if (S_ISDIR(about.st_mode))
            n += visit_files(full);
        else
            assert_loads_or_refuses(full), n++;
    }
    closedir(entries);
    return n;
}

START_TEST(every_odd_file_loads_or_is_refused) {
    const char *const folders[] = {FIXTURES "/obj-odd", FIXTURES "/gltf-odd", FIXTURES "/meshes"};
    const size_t at_least[] = {70, 20, 12};
    ck_assert_uint_ge(visit_files(folders[_i]), at_least[_i]);
}
END_TEST

START_TEST(known_fixtures_have_their_sizes) {
    const struct {
        const char *name;
        size_t n;
        double area, tolerance;
        char up;
    } expected[] = {
        {"meshes/unit_cube.STL", 12, 6, 1e-6, 'z'},
        /* a sphere of 1,280 triangles: .5 % below 4 pi */
        {"meshes/unit_sphere.STL", 1280, 4 * M_PI, .08, 'z'},
        {"meshes/cube_blender_uv.ply", 6, 6, 1e-6, 'z'},
        /* a regular tetrahedron would differ; this one has 4 faces of area sqrt(5) */
        {"meshes/tet.ply", 4, 4 * sqrt(5), 1e-6, 'z'},
        {"meshes/BoxInterleaved.glb", 12, 6, 1e-6, 'y'},
        {"meshes/cube.glb", 12, 24, 1e-4, 'y'}, /* whose chunks lack their padding */
        {"meshes/no_indices_3storybuilding.glb", 72, 12527.6824, .01, 'y'},
        {"gltf-odd/box01.glb", 12, 6, 1e-6, 'y'},
        {"gltf-odd/Cube/Cube.gltf", 12, 24, 1e-4, 'y'},
        {"obj-odd/cube.obj", 6, 24, 1e-12, 'z'},
        {"obj-odd/issue-295-trianguation-failure.obj", 14, 14, 1e-9, 'z'},
    };
    for (size_t i = 0; i < sizeof expected / sizeof *expected; i++) {
        mesh m = {0};
        import_report report;
        lam_error error = {0};
        ck_assert_msg(import_fixture(expected[i].name, &m, &report, &error) == LAM_OK, "%s", error.message);
        ck_assert_uint_eq(m.n, expected[i].n);
        ck_assert_double_eq_tol(total_area(&m), expected[i].area, expected[i].tolerance);
        ck_assert_int_eq(m.up, expected[i].up);
        mesh_free(&m);
    }
}
END_TEST

START_TEST(broken_fixtures_are_refused) {
    const struct {
        const char *name, *says;
    } expected[] = {
        {"obj-odd/test-nan.obj", "test-nan.obj:12: vertex coordinate nan"},
        {"obj-odd/issue-140-zero-face-idx.obj", "obj:16: vertex index 0"},
        {"obj-odd/invalid-relative-vertex-index.obj", "obj:1: vertex index -4"},
        {"obj-odd/invalid-relative-texture-index.obj", "refers to vertex 1, there are 0"},
        {"obj-odd/invalid-face-definition.obj", "scene is empty"},
        {"obj-odd/issue-244-mtl-searchpaths.obj", "obj:2: the material file 'issue-244.mtl' is missing"},
        {"obj-odd/points-prim.obj", "no faces"},
        {"obj-odd/line-prim.obj", "no faces"},
        {"gltf-odd/BoundsChecking/integer-out-of-bounds.gltf", "out of range"},
        {"gltf-odd/BoundsChecking/invalid-buffer-index.gltf", "not a scene that can be read"},
        {"gltf-odd/issue-416.gltf", "not a scene that can be read"},
        {"gltf-odd/issue-492.glb", "no faces"},
        {"gltf-odd/ORIGIN.md", "not a scene that can be read"},
    };
    for (size_t i = 0; i < sizeof expected / sizeof *expected; i++) {
        mesh m = {0};
        lam_error error = {0};
        ck_assert_int_eq(import_fixture(expected[i].name, &m, NULL, &error), LAM_ERR_FORMAT);
        ck_assert_msg(strstr(error.message, expected[i].says) != NULL, "%s", error.message);
    }
}
END_TEST

START_TEST(damaged_files_never_hurt) {
    const char *const names[] = {"meshes/BoxInterleaved.glb", "meshes/cube.glb",  "meshes/tet.ply",
                                 "meshes/unit_cube.STL",      "obj-odd/cube.obj", "gltf-odd/Cube/Cube.gltf"};
    const char *name = names[_i];
    static char bytes[8192], path[256];
    char source[512];
    unsigned state = 12345 + (unsigned)_i;
    snprintf(source, sizeof source, FIXTURES "/%s", name);
    FILE *file = fopen(source, "rb");
    ck_assert_ptr_nonnull(file);
    const size_t length = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    ck_assert_uint_gt(length, 100);
    for (int round = 0; round < 40; round++) {
        static char damaged[8192];
        memcpy(damaged, bytes, length);
        size_t kept = length;
        for (int k = 0; k < 1 + round % 4; k++) {
            state = state * 1664525u + 1013904223u;
            damaged[(state >> 8) % length] ^= (char)(1 << (state & 7));
        }
        if (round % 5 == 4) kept = (state >> 8) % length;
        snprintf(path, sizeof path, "%s/damaged%s", folder, strrchr(name, '.'));
        file = fopen(path, "wb");
        ck_assert_uint_eq(fwrite(damaged, 1, kept, file), kept);
        fclose(file);
        const import_options options = {.unit = 1, .reflectance = -1, .cpu_seconds = 5};
        mesh m = {0};
        lam_error error = {0};
        /* the library may crash on what it was not made for: that, too, is an answer of one line */
        if (scene_import(path, &options, &m, NULL, &error) != LAM_OK)
            ck_assert_msg(strstr(error.message, folder) != NULL, "%s", error.message);
        mesh_free(&m);
    }
}
END_TEST

/* --- groups -------------------------------------------------------------------------------------------- */

START_TEST(groups_follow_objects_then_materials) {
    import_report report;
    write_mtl("newmtl red\nKd .6 .1 .1\nnewmtl grey paint\nKd .5 .5 .5\n");
    mesh m =
        good_text("mtllib scene.mtl\n" SQUARE "f 1 2 3\n" /* neither object nor material: the file's stem */
                  "usemtl red\nf 1 2 4\n"                 /* no object: the material */
                  "g roof  tiles\nf 1 3 4\n"              /* a group, as written */
                  "o house\nf 2 3 4\n" /* an object of two materials, whatever its groups */
                  "g wall\nusemtl grey paint\nf 1 2 3 4\n"
                  "o roof  tiles\nusemtl red\nf 1 2 3\n" /* the same name again */
                  "o mixed.thing\nf 4 3 2 1\n",
                  &report);
    const struct {
        const char *name;
        size_t n;
    } expected[] = {
        {"scene", 1},      {"red", 1}, {"roof  tiles", 2}, {"house.red", 1}, {"house.grey paint", 1},
        {"mixed.thing", 1}};
    ck_assert_uint_eq(m.n_groups, 6);
    for (size_t g = 0; g < 6; g++) {
        size_t n;
        group_area(&m, expected[g].name, &n);
        ck_assert_uint_eq(n, expected[g].n);
    }
    mesh_free(&m);
}
END_TEST

START_TEST(gltf_groups_are_nodes) {
    mesh m = {0};
    import_report report;
    lam_error error = {0};
    ck_assert_msg(import_fixture("meshes/TestScene.gltf", &m, &report, &error) == LAM_OK, "%s",
                  error.message);
    /* two nodes called Cube, with a material each */
    const char *const names[] = {
        "Cube.Default-Material", "Cube.ConstantMat", "Sphere", "Plane", "Cylinder", "d8 (1)", "d8"};
    ck_assert_uint_eq(m.n_groups, 7);
    for (size_t g = 0; g < 7; g++) ck_assert_uint_lt(group_find(&m, names[g]), 7);
    ck_assert_double_eq_tol(group_area(&m, "Plane", NULL), 100, 1e-3);
    ck_assert_double_eq_tol(group_area(&m, "Cube.ConstantMat", NULL), 6, 1e-5);
    ck_assert_double_eq_tol(group_area(&m, "d8", NULL), group_area(&m, "d8 (1)", NULL), 1e-4);
    size_t lit = 0;
    for (size_t i = 0; i < m.n; i++)
        if (m.group[i] == group_find(&m, "Sphere")) {
            ck_assert_float_eq_tol(m.emission[i], .801471f, 1e-5f);
            ck_assert_float_eq_tol(m.reflectance[m.n + i], .311419f, 1e-5f);
            lit++;
        }
    ck_assert_uint_eq(lit, 768);
    mesh_free(&m);
}
END_TEST

START_TEST(mirrored_nodes_keep_their_fronts) {
    /* One triangle that looks along z, in a plain node and in one mirrored in x. */
    static const char gltf[] =
        "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0,1]}],"
        "\"nodes\":[{\"name\":\"plain\",\"mesh\":0},"
        "{\"name\":\"mirrored\",\"mesh\":0,\"scale\":[-2,1,1],\"translation\":[0,0,3]}],"
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],"
        "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\","
        "\"min\":[0,0,0],\"max\":[1,1,0]}],"
        "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],"
        "\"buffers\":[{\"byteLength\":36,\"uri\":\"data:application/"
        "octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}]}";
    char path[256];
    import_report report;
    file_write(folder, "mirror.gltf", gltf, path);
    mesh m = import_good(path, &report);
    ck_assert_uint_eq(m.n, 2);
    ck_assert_double_eq(group_area(&m, "plain", NULL), .5);
    ck_assert_double_eq(group_area(&m, "mirrored", NULL), 1);
    for (size_t i = 0; i < 2; i++) ck_assert_float_eq(m.normal[i][2], 1);
    mesh_free(&m);
}
END_TEST

/* --- materials ----------------------------------------------------------------------------------------- */

START_TEST(diffuse_of_one_or_more_is_clamped_with_a_warning) {
    import_report report;
    write_mtl("newmtl snow\nKd 1 1 1\nnewmtl too bright\nKd .2 1.5 .1\nKe 3 2 1\nnewmtl unused\nKd 9 9 9\n");
    mesh m =
        good_text("mtllib scene.mtl\n" SQUARE "usemtl snow\nf 1 2 3\nusemtl too bright\nf 1 3 4\n", &report);
    ck_assert_uint_eq(report.clamped, 2);
    ck_assert_ptr_nonnull(strstr(report.warnings, "material 'snow'"));
    ck_assert_ptr_nonnull(strstr(report.warnings, "material 'too bright'"));
    ck_assert_ptr_null(strstr(report.warnings, "unused"));
    ck_assert_uint_eq(m.n_channels, 3);
    const float reflectance[3][2] = {{.999f, .2f}, {.999f, .999f}, {.999f, .1f}};
    for (size_t c = 0; c < 3; c++)
        for (size_t i = 0; i < 2; i++) {
            ck_assert_float_eq(m.reflectance[c * 2 + i], reflectance[c][i]);
            ck_assert_float_eq(m.emission[c * 2 + i], i == 1 ? 3.f - (float)c : 0.f);
        }
    mesh_free(&m);
}
END_TEST

START_TEST(missing_colours_have_a_default_and_a_warning) {
    import_report report;
    write_mtl("newmtl bare\nKs 1 1 1\nnewmtl grey\nKd .25 .25 .25\n");
    mesh m = good_text("mtllib scene.mtl\n" SQUARE "f 1 2 3\nf 1 3 4\nusemtl bare\nf 1 2 4\n"
                       "usemtl unheard\nf 2 3 4\nusemtl grey\nf 1 2 3 4\n",
                       &report);
    ck_assert_ptr_nonnull(strstr(report.warnings, "2 faces have no material"));
    ck_assert_ptr_nonnull(strstr(report.warnings, "'bare' has no diffuse colour"));
    ck_assert_ptr_nonnull(strstr(report.warnings, "'unheard' is not defined"));
    ck_assert_uint_eq(m.n_channels, 1);
    for (size_t i = 0; i < 5; i++) ck_assert_float_eq(m.reflectance[i], i == 4 ? .25f : .5f);
    mesh_free(&m);
}
END_TEST

START_TEST(bad_colours_are_errors) {
    const char *const scene = "mtllib scene.mtl\n" SQUARE "usemtl a b\nf 1 2 3\n";
    write_mtl("newmtl a b\nKd .5 -.1 .5\n");
    bad_text(scene, "material 'a b': diffuse value -0.1");
    write_mtl("newmtl a b\nKd .5 nan .5\n");
    bad_text(scene, "material 'a b': diffuse value nan");
    write_mtl("newmtl a b\nKd .5 .5 .5\nKe 0 1e999 0\n");
    bad_text(scene, "material 'a b': emission inf");
    write_mtl("newmtl a b\nKd .5 .5 .5\nKe 0 0 -1\n");
    bad_text(scene, "material 'a b': emission -1");
    write_mtl("\nnewmtl a b\nKd spectral x.rfl\n");
    bad_text(scene, "scene.mtl:3: 'spectral x.rfl' is not a colour");
}
END_TEST

START_TEST(reflectance_option_overrides_but_keeps_emission) {
    char path[256];
    import_report report;
    lam_error error = {0};
    mesh m = {0};
    import_options options = {.unit = 1, .reflectance = .3};
    write_mtl("newmtl lamp\nKd 2 .1 .1\nKe 3 2 1\n");
    file_write(folder, "scene.obj", "mtllib scene.mtl\n" SQUARE "f 1 2 3\nusemtl lamp\nf 1 3 4\n", path);
    ck_assert_msg(scene_import(path, &options, &m, &report, &error) == LAM_OK, "%s", error.message);
    ck_assert_str_eq(report.warnings, "");
    ck_assert_uint_eq(m.n_channels, 3);
    for (size_t i = 0; i < 6; i++) ck_assert_float_eq(m.reflectance[i], .3f);
    ck_assert_float_eq(m.emission[3], 2);
    mesh_free(&m);
    options.reflectance = 1;
    ck_assert_int_eq(scene_import(path, &options, &m, &report, &error), LAM_ERR_ARGUMENT);
}
END_TEST

START_TEST(missing_material_files_are_named_with_their_line) {
    char path[256];
    bad_text(SQUARE "mtllib nowhere.mtl\nf 1 2 3\n",
             "scene.obj:5: the material file 'nowhere.mtl' is missing");
    write_mtl("newmtl a\nKd .1 .1 .1\n");
    bad_text("mtllib scene.mtl nowhere.mtl\n" SQUARE "f 1 2 3\n",
             "scene.obj:1: the material file 'nowhere.mtl'");
    file_write(folder, "with a blank.mtl", "newmtl b\nKd .2 .2 .2\n", path);
    import_report report;
    mesh m = good_text("mtllib with a blank.mtl\nmtllib scene.mtl with\\ a\\ blank.mtl\n" SQUARE
                       "usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n",
                       &report);
    ck_assert_float_eq(m.reflectance[0], .1f);
    ck_assert_float_eq(m.reflectance[1], .2f);
    mesh_free(&m);
}
END_TEST

/* --- geometry ------------------------------------------------------------------------------------------ */

START_TEST(planar_convex_quads_stay_and_others_become_triangles) {
    import_report report;
    mesh m = good_text(SQUARE "v 0 1 .5\nv .5 .5 0\nv .5 0 0\n"
                              "f 1 2 3 4\n"   /* a quad */
                              "f 1 2 3 5\n"   /* not planar: two triangles */
                              "f 1 2 3 6\n"   /* a straight corner at 6: one triangle */
                              "f 1 7 2 3 4\n" /* a straight corner at 7: a quad again */
                              "f 1 2 2 3\n"   /* a corner twice: a triangle */
                              "f 1 3 4 4 4\n" /* and again */
                              "f 1 2 1 2\nf 1 7 2\nf 3 3 3\nf 1 2\np 1\nl 1 2 3\n",
                       &report);
    ck_assert_uint_eq(m.n, 7);
    size_t quads = 0;
    for (size_t i = 0; i < m.n; i++) quads += m.elements[i][3] != MESH_NO_VERTEX;
    ck_assert_uint_eq(quads, 2);
    ck_assert_uint_eq(report.dropped_faces, 4);
    mesh_free(&m);
}
END_TEST

START_TEST(concave_polygons_keep_area_and_side) {
    /* Polygons in the plane and their areas: an arrow head, an L, a comb, a spiral, a square with a notch. */
    static const struct {
        double area;
        size_t n;
        double p[20][2];
    } shapes[] = {
        {1, 4, {{0, 0}, {2, 1}, {0, 2}, {1, 1}}},
        {3, 6, {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}}},
        {6 - 2 * .5,
         12,
         {{0, 0},
          {6, 0},
          {6, 1},
          {5, 1},
          {5, .5},
          {4, .5},
          {4, 1},
          {2, 1},
          {2, .5},
          {1, .5},
          {1, 1},
          {0, 1}}},
        {14,
         12,
         {{0, 0},
          {5, 0},
          {5, 5},
          {1, 5},
          {1, 2},
          {2, 2},
          {2, 4},
          {4, 4},
          {4, 1},
          {0, 1},
          {0, .75},
          {0, .25}}},
        {4 - 2 * 1.75 / 2, 5, {{0, 0}, {2, 0}, {2, 2}, {1, .25}, {0, 2}}},
        {4 - .125, 7, {{0, 0}, {2, 0}, {2, 2}, {1.25, 2}, {1, 1.5}, {.75, 2}, {0, 2}}},
    };
    for (size_t s = 0; s < sizeof shapes / sizeof *shapes; s++)
        for (int turned = 0; turned < 3; turned++) {
            char text[4096] = "";
            size_t used = 0;
            /* in the plane across (1, 2, 2) / 3, far from the origin: u = (2, 1, -2) / 3, w = (-2, 2, -1) / 3
             */
            for (size_t i = 0; i < shapes[s].n; i++) {
                const double *p = shapes[s].p[(i + (size_t)turned * 2) % shapes[s].n];
                used += (size_t)snprintf(text + used, sizeof text - used, "v %.17g %.17g %.17g\n",
                                         84878.468 + (2 * p[0] - 2 * p[1]) / 3,
                                         447586.999 + (p[0] + 2 * p[1]) / 3, (-2 * p[0] - p[1]) / 3);
            }
            used += (size_t)snprintf(text + used, sizeof text - used, "f");
            for (size_t i = 0; i < shapes[s].n; i++)
                used += (size_t)snprintf(text + used, sizeof text - used, " %zu", i + 1);
            snprintf(text + used, sizeof text - used, "\n");
            import_report report;
            mesh m = good_text(text, &report);
            /* Coordinates round at 447587 * 2^-53 = 5e-11. Pieces of one plane whose normals agree do not
             * overlap when their areas sum up to the polygon's. */
            ck_assert_double_eq_tol(total_area(&m), shapes[s].area, 1e-8);
            for (size_t i = 0; i < m.n; i++) {
                ck_assert_float_eq_tol(m.normal[i][0], 1.f / 3, 1e-6f);
                ck_assert_float_eq_tol(m.normal[i][1], 2.f / 3, 1e-6f);
            }
            ck_assert_str_eq(strstr(report.warnings, "precision") == NULL ? "" : report.warnings, "");
            mesh_free(&m);
        }
}
END_TEST

START_TEST(coordinates_are_scaled_but_not_turned) {
    char path[256];
    lam_error error = {0};
    mesh m = {0};
    import_options options = {.unit = .001, .up = 'x', .reflectance = -1};
    file_write(folder, "scene.obj",
               "v 0 0 0 .5\r\nv 2000 0 0 1 1 1\r\n  v\t0 3000 \\\r\n 1000\r\n# v x\r\nf -3/1/1 -2//2 -1\r\n",
               path);
    ck_assert_msg(scene_import(path, &options, &m, NULL, &error) == LAM_OK, "%s", error.message);
    ck_assert_uint_eq(m.n_vertices, 3);
    ck_assert_double_eq(m.vertices[1][0], 2000 * .001);
    ck_assert_double_eq(m.vertices[2][1], 3000 * .001);
    ck_assert_double_eq(m.vertices[2][2], 1000 * .001);
    ck_assert_int_eq(m.up, 'x');
    ck_assert_double_eq(m.unit, .001);
    ck_assert_str_eq(m.name, "scene");
    char hash[33];
    mesh_geometry_hash(&m, hash);
    ck_assert_str_eq(m.source_hash, hash);
    mesh_free(&m);
    const double units[] = {0, -1, NAN, INFINITY};
    for (size_t i = 0; i < 4; i++) {
        options.unit = units[i];
        ck_assert_int_eq(scene_import(path, &options, &m, NULL, &error), LAM_ERR_ARGUMENT);
    }
}
END_TEST

START_TEST(single_precision_far_from_the_origin_is_told) {
    char path[256];
    import_report report;
    const char *const triangle = "solid s\nfacet normal 0 0 1\nouter loop\nvertex %s0 0 0\nvertex %s1 0 0\n"
                                 "vertex %s0 1 0\nendloop\nendfacet\nendsolid s\n";
    char text[512];
    snprintf(text, sizeof text, triangle, "44758", "44758", "44758");
    file_write(folder, "far.stl", text, path);
    mesh m = import_good(path, &report);
    ck_assert_ptr_nonnull(strstr(report.warnings, "single precision"));
    mesh_free(&m);
    snprintf(text, sizeof text, triangle, "4", "4", "4");
    file_write(folder, "near.stl", text, path);
    m = import_good(path, &report);
    ck_assert_ptr_null(strstr(report.warnings, "single precision"));
    mesh_free(&m);
}
END_TEST

START_TEST(bad_geometry_is_refused_by_line) {
    bad_text("", "scene is empty");
    bad_text("f 1 2 3\n", "scene.obj:1: face refers to vertex 1, there are 0");
    bad_text(SQUARE "f 1 2 9\n", "scene.obj:5: face refers to vertex 9, there are 4");
    bad_text(SQUARE "f 1 2 99999999999999999999\n", "scene.obj:5: vertex index 99999999999999999999");
    bad_text(SQUARE "f 1 2 4294967296\n", "scene.obj:5: vertex index 4294967296");
    bad_text(SQUARE "f 1 two 3\n", "scene.obj:5: 'two 3' is not a vertex");
    bad_text(SQUARE "f 1 2.5 3\n", "scene.obj:5");
    bad_text(SQUARE "f 0 1 2\n", "scene.obj:5: vertex index 0");
    bad_text("v 0 0\n", "scene.obj:1: a vertex needs three numbers");
    bad_text("v 0 0 0\nv 1 inf 0\nv 0 1 0\nf 1 2 3\n", "scene.obj:2: vertex coordinate inf");
    bad_text("v 0 0 0\nv 1 1e999 0\nv 0 1 0\nf 1 2 3\n", "scene.obj:2: vertex coordinate inf");
    bad_text("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "none of its 1 faces has an area");
    bad_text("v 0 0 0\nv 1 0 0\nv .5 1e-15 0\nf 1 2 3\n", "none of its 1 faces has an area");
}
END_TEST

START_TEST(files_that_cannot_be_read_are_named) {
    const import_options options = import_plain();
    mesh m = {0};
    lam_error error = {0};
    char path[256];
    const char *const names[] = {"missing.obj", "missing.glb", "missing"};
    for (size_t i = 0; i < 3; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        ck_assert_int_eq(scene_import(path, &options, &m, NULL, &error), LAM_ERR_IO);
        ck_assert_msg(strstr(error.message, path) != NULL && strstr(error.message, "No such file") != NULL,
                      "%s", error.message);
    }
    ck_assert_int_eq(scene_import(folder, &options, &m, NULL, &error), LAM_ERR_IO);
    file_write(folder, "scene.txt", "hello", path);
    ck_assert_int_eq(scene_import(path, &options, &m, NULL, &error), LAM_ERR_FORMAT);
    ck_assert_ptr_nonnull(strstr(error.message, path));
}
END_TEST

START_TEST(warnings_are_cut_with_a_count) {
    static char mtl[20000], obj[20000] = "mtllib scene.mtl\n" SQUARE;
    size_t mtl_used = 0, obj_used = strlen(obj);
    for (int i = 0; i < 200; i++) {
        mtl_used += (size_t)snprintf(mtl + mtl_used, sizeof mtl - mtl_used, "newmtl bright%d\nKd 1 1 1\n", i);
        obj_used +=
            (size_t)snprintf(obj + obj_used, sizeof obj - obj_used, "usemtl bright%d\nf 1 2 3 4\n", i);
    }
    import_report report;
    write_mtl(mtl);
    mesh m = good_text(obj, &report);
    ck_assert_uint_eq(report.clamped, 200);
    ck_assert_uint_eq(m.n_groups, 200);
    unsigned lines = 0, more = 0;
    for (const char *line = report.warnings; line != NULL; line = strchr(line, '\n')) {
        line += *line == '\n';
        if (sscanf(line, "%u more warnings", &more) != 1) lines++;
        if (*line == '\0') break;
    }
    ck_assert_uint_eq(lines + more, 200);
    mesh_free(&m);
}
END_TEST

/* --- a hostile child ----------------------------------------------------------------------------------- */

static lam_status reads_well(const char *path, soup *s, lam_error *error) {
    const uint32_t corners[3] = {0, 1, 2};
    (void)path;
    for (int i = 0; i < 3; i++) {
        lam_status status = soup_add_vertex(s, (const double[3]){i == 1, i == 2, 0}, error);
        if (status != LAM_OK) return status;
    }
    return soup_add_polygon(s, corners, 3, TABLE_NONE, TABLE_NONE, 0, error);
}

static lam_status crashes(const char *path, soup *s, lam_error *error) {
    (void)path, (void)s, (void)error;
    raise(SIGSEGV);
    return LAM_OK;
}

static lam_status aborts(const char *path, soup *s, lam_error *error) {
    (void)path, (void)s, (void)error;
    abort();
}

static lam_status leaves(const char *path, soup *s, lam_error *error) {
    (void)path, (void)s, (void)error;
    _exit(0);
}

static lam_status spins(const char *path, soup *s, lam_error *error) {
    (void)path, (void)s, (void)error;
    for (volatile unsigned i = 0; i < 1000; i = 0) continue;
    return LAM_OK;
}

static lam_status sleeps(const char *path, soup *s, lam_error *error) {
    (void)path, (void)s, (void)error;
    while (pause() < 0) continue;
    return LAM_OK;
}

static lam_status hoards(const char *path, soup *s, lam_error *error) {
    void *all = memory_allocate(3, (size_t)1 << 30, "hoard", error);
    if (all == NULL) return LAM_ERR_MEMORY;
    free(all);
    return reads_well(path, s, error);
}

static lam_status writes_a_file(const char *path, soup *s, lam_error *error) {
    FILE *file = fopen(path, "w");
    if (file == NULL) return status_fail(error, LAM_ERR_IO, "%s: could not even open it", path);
    fputs("written by the child", file);
    fclose(file);
    return reads_well(path, s, error);
}

/* Something on every descriptor but standard input, output and error, where the reply's pipe must be. */
static lam_status babbles(const char *path, soup *s, lam_error *error) {
    (void)path, (void)s, (void)error;
    static const char nonsense[65536] = "lamsoup";
    for (int fd = 3; fd < 32; fd++)
        if (write(fd, nonsense, sizeof nonsense) < 0) continue;
    _exit(0);
}

static lam_status lies_about_corners(const char *path, soup *s, lam_error *error) {
    (void)path;
    /* after soup_split there is nobody who checks this but the parent: an element added by hand */
    lam_status status = reads_well(path, s, error);
    struct soup_element *element = calloc(64, sizeof *element);
    for (int i = 0; i < 4; i++) element->corners[i] = 1000000;
    s->elements = element;
    s->n_elements = 1;
    s->element_capacity = 64;
    return status;
}

static lam_status run_child(soup_reader *reader, soup *s, lam_error *error) {
    const child_limits limits = {.cpu_seconds = 1, .memory_bytes = (size_t)1 << 30};
    char path[256];
    file_write(folder, "scene.xyz", "untouched", path);
    return import_in_child(reader, path, &limits, s, error);
}

START_TEST(child_is_survived) {
    const struct {
        soup_reader *reader;
        lam_status status;
        const char *says;
    } cases[] = {
        {crashes, LAM_ERR_FORMAT, "the importer crashed (signal 11)"},
        {aborts, LAM_ERR_FORMAT, "the importer crashed (signal 6)"},
        {leaves, LAM_ERR_FORMAT, "without an answer"},
        {spins, LAM_ERR_FORMAT, "more than its 1 s"},
        {sleeps, LAM_ERR_FORMAT, "more than its 1 s"},
        {babbles, LAM_ERR_INTERNAL, "damaged reply"},
        {lies_about_corners, LAM_ERR_INTERNAL, "damaged reply"},
#ifndef LAMBERT_SANITIZED /* where address space cannot be limited, and a killed write ends otherwise */
        {hoards, LAM_ERR_MEMORY, "more than its 1024 MiB"},
#endif
        {writes_a_file, LAM_ERR_FORMAT, "crashed (signal 25)"}, /* SIGXFSZ */
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        soup s = {0};
        lam_error error = {0};
        const lam_status status = run_child(cases[i].reader, &s, &error);
        ck_assert_msg(status == cases[i].status && strstr(error.message, cases[i].says) != NULL,
                      "case %zu: status %d, %s", i, (int)status, error.message);
        ck_assert_ptr_null(s.elements);
    }
    (void)hoards;
    soup s = {0};
    lam_error error = {0};
    ck_assert_int_eq(run_child(reads_well, &s, &error), LAM_OK);
    ck_assert_uint_eq(s.n_elements, 1);
    soup_free(&s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("import");
    TCase *tests = tcase_create("import");
    tcase_set_timeout(tests, 300);
    tcase_add_checked_fixture(tests, setup, teardown);
    tcase_add_loop_test(tests, every_odd_file_loads_or_is_refused, 0, 3);
    tcase_add_test(tests, known_fixtures_have_their_sizes);
    tcase_add_test(tests, broken_fixtures_are_refused);
    tcase_add_loop_test(tests, damaged_files_never_hurt, 0, 6);
    tcase_add_test(tests, groups_follow_objects_then_materials);
    tcase_add_test(tests, gltf_groups_are_nodes);
    tcase_add_test(tests, mirrored_nodes_keep_their_fronts);
    tcase_add_test(tests, diffuse_of_one_or_more_is_clamped_with_a_warning);
    tcase_add_test(tests, missing_colours_have_a_default_and_a_warning);
    tcase_add_test(tests, bad_colours_are_errors);
    tcase_add_test(tests, reflectance_option_overrides_but_keeps_emission);
    tcase_add_test(tests, missing_material_files_are_named_with_their_line);
    tcase_add_test(tests, planar_convex_quads_stay_and_others_become_triangles);
    tcase_add_test(tests, concave_polygons_keep_area_and_side);
    tcase_add_test(tests, coordinates_are_scaled_but_not_turned);
    tcase_add_test(tests, single_precision_far_from_the_origin_is_told);
    tcase_add_test(tests, bad_geometry_is_refused_by_line);
    tcase_add_test(tests, files_that_cannot_be_read_are_named);
    tcase_add_test(tests, warnings_are_cut_with_a_count);
    tcase_add_test(tests, child_is_survived);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
