#include "support/suite.h"

#include "solver/scene/import/imported_faces.h"
#include "support/scene.h"

/* A folder that each test has to itself. */
static char folder[64];

static void setup(void) {
    folder_make(folder);
}

static void teardown(void) {
    folder_remove(folder);
}

#define SQUARE "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
#define APEXES "v 0 0 1\nv 0 0 2\nv 0 0 3\n"

START_TEST(groups_follow_objects_then_materials) {
    import_report report;
    mtl_write(folder, "newmtl red\nKd .6 .1 .1\nnewmtl grey paint\nKd .5 .5 .5\n");
    mesh m =
        obj_good(folder,
                 "mtllib scene.mtl\n" SQUARE "v 0 0 1\nv 0 0 2\nv 0 0 3\nv 0 0 4\nv 0 0 5\nv 0 0 6\nv 0 0 7\n"
                 "f 1 2 3\n"             /* neither object nor material: the file's stem */
                 "usemtl red\nf 2 3 5\n" /* no object: the material */
                 "g roof\nf 2 3 6\n"     /* a group */
                 "o house\nf 2 3 7\n"    /* an object of two materials, whatever its groups */
                 "g wall\nusemtl grey paint\nf 2 3 8\n"
                 "o roof\nusemtl red\nf 2 3 9\n" /* the same name again */
                 "o mixed.thing\nf 2 3 10\n"
                 "o roof  tiles\nf 2 3 11\n", /* an object, as written */
                 &report);
    const struct {
        const char *name;
        size_t n;
    } expected[] = {
        {"scene", 1},       {"red", 1},        {"roof", 2}, {"house.red", 1}, {"house.grey paint", 1},
        {"mixed.thing", 1}, {"roof  tiles", 1}};
    ck_assert_uint_eq(m.n_groups, 7);
    for (size_t g = 0; g < 7; g++) {
        size_t n;
        group_area(&m, expected[g].name, &n);
        ck_assert_uint_eq(n, expected[g].n);
    }
    mesh_free(&m);
}
END_TEST

/* Programs write a part before or behind the whole; a part of the same size is the first one. */
START_TEST(faces_of_several_groups_are_in_the_smallest) {
    static const char *const texts[] = {
        SQUARE APEXES "g floor all room\nf 1 2 3\ng wall all room\nf 2 3 5\nf 2 3 6\n",
        SQUARE APEXES "g room\tall floor\nf 1 2 3\ng room  all wall \nf 2 3 5\nf 2 3 6\n",
        SQUARE APEXES "g wall room\nf 2 3 5\ng\nf 2 3 7\ng room floor\nf 1 2 3\ng wall room\nf 2 3 6\n",
        SQUARE APEXES "o floor\ng all wall\nf 1 2 3\no\nf 2 3 5\ng wall\nf 2 3 6\n"};
    const size_t n_groups[] = {2, 2, 3, 3}, in_wall[] = {2, 2, 2, 1};
    for (size_t k = 0; k < sizeof texts / sizeof *texts; k++) {
        import_report report;
        size_t n;
        mesh m = obj_good(folder, texts[k], &report);
        ck_assert_uint_eq(m.n_groups, n_groups[k]);
        group_area(&m, "floor", &n);
        ck_assert_uint_eq(n, 1);
        group_area(&m, "wall", &n);
        ck_assert_uint_eq(n, in_wall[k]);
        ck_assert_msg(strstr(report.warnings, "name several groups; a face counts to the smallest") != NULL,
                      "%zu: '%s'", k, report.warnings);
        mesh_free(&m);
    }
    import_report report;
    mesh m = obj_good(folder, SQUARE "g a b\nf 1 2 3\ng wall wall\nf 1 3 4\n", &report);
    ck_assert_str_eq(m.group_names[m.group[0]], "a");
    ck_assert_str_eq(m.group_names[m.group[1]], "wall");
    ck_assert_ptr_nonnull(strstr(report.warnings, "1 lines g name several groups"));
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
            ck_assert_float_eq_tol(m.emission[i], (float)(M_PI * .801471), 1e-5f);
            ck_assert_float_eq_tol(m.reflectance[m.n + i], .311419f, 1e-5f);
            lit++;
        }
    ck_assert_uint_eq(lit, 768);
    mesh_free(&m);
}
END_TEST

START_TEST(mirrored_nodes_keep_their_fronts) {
    /* One triangle that faces along z, in a plain node and in one mirrored in x. */
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

START_TEST(diffuse_of_one_or_more_is_clamped_with_a_warning) {
    import_report report;
    mtl_write(folder,
              "newmtl snow\nKd 1 1 1\nnewmtl too bright\nKd .2 1.5 .1\nKe 3 2 1\nnewmtl unused\nKd 9 9 9\n");
    mesh m = obj_good(
        folder, "mtllib scene.mtl\n" SQUARE "usemtl snow\nf 1 2 3\nusemtl too bright\nf 1 3 4\n", &report);
    ck_assert_uint_eq(report.clamped, 2);
    ck_assert_ptr_nonnull(strstr(report.warnings, "material 'snow'"));
    ck_assert_ptr_nonnull(strstr(report.warnings, "material 'too bright'"));
    ck_assert_ptr_null(strstr(report.warnings, "unused"));
    ck_assert_uint_eq(m.n_channels, 3);
    const float reflectance[3][2] = {{.9999f, .2f}, {.9999f, .9999f}, {.9999f, .1f}};
    for (size_t c = 0; c < 3; c++)
        for (size_t i = 0; i < 2; i++) {
            ck_assert_float_eq(m.reflectance[c * 2 + i], reflectance[c][i]);
            ck_assert_float_eq(m.emission[c * 2 + i], i == 1 ? 3.f - (float)c : 0.f);
        }
    mesh_free(&m);
}
END_TEST

/* A value of 1 is not darker than one that stays. */
START_TEST(brighter_colours_never_become_darker) {
    import_report report;
    mtl_write(folder,
              "newmtl a\nKd .9999 .9999 .9999\nnewmtl b\nKd .99995 .99995 .99995\nnewmtl c\nKd 1 1 1\n");
    mesh m = obj_good(folder,
                      "mtllib scene.mtl\n" SQUARE "usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\nusemtl c\nf 1 2 4\n",
                      &report);
    ck_assert_uint_eq(report.clamped, 2);
    for (size_t i = 0; i < 3; i++) ck_assert_float_eq(m.reflectance[i], .9999f);
    mesh_free(&m);
}
END_TEST

START_TEST(textures_that_are_not_read_have_a_default_and_a_warning) {
    import_report report;
    mtl_write(folder,
              "newmtl carpet\nmap_Kd carpet.png\nnewmtl lamp\nKd .2 .2 .2\nKe 3 3 3\nmap_Ke lamp.png\n");
    mesh m = obj_good(folder, "mtllib scene.mtl\n" SQUARE "usemtl carpet\nf 1 2 3\nusemtl lamp\nf 1 3 4\n",
                      &report);
    ck_assert_ptr_nonnull(
        strstr(report.warnings, "scene.mtl: the image 'carpet.png' is not read: it is missing"));
    ck_assert_ptr_nonnull(
        strstr(report.warnings, "scene.mtl: the image 'lamp.png' is not read: it is missing"));
    ck_assert_ptr_nonnull(strstr(
        report.warnings, "material 'carpet' has no colour beside its image; its reflectance is set to 0.5"));
    ck_assert_ptr_null(strstr(report.warnings, "no diffuse colour")); /* one line says enough */
    ck_assert_float_eq(m.reflectance[0], .5f);
    ck_assert_float_eq(m.reflectance[1], .2f);
    ck_assert_float_eq(m.emission[1], 3);
    mesh_free(&m);
    mtl_write(folder, "newmtl carpet\nKd 1 1 1\nmap_Kd carpet.png\n");
    m = obj_good(folder, "mtllib scene.mtl\n" SQUARE "usemtl carpet\nf 1 2 3\nf 1 3 4\n", &report);
    ck_assert_uint_eq(report.clamped, 0);
    ck_assert_float_eq(m.reflectance[0], .5f);
    mesh_free(&m);
}
END_TEST

START_TEST(missing_colours_have_a_default_and_a_warning) {
    import_report report;
    mtl_write(folder, "newmtl bare\nKs 1 1 1\nnewmtl grey\nKd .25 .25 .25\n");
    mesh m = obj_good(folder,
                      "mtllib scene.mtl\n" SQUARE "f 1 2 3\nf 1 3 4\nusemtl bare\nf 1 2 4\n"
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
    mtl_write(folder, "newmtl a b\nKd .5 -.1 .5\n");
    obj_bad(folder, scene, "material 'a b': diffuse value -0.1");
    mtl_write(folder, "newmtl a b\nKd .5 nan .5\n");
    obj_bad(folder, scene, "material 'a b': diffuse value nan");
    mtl_write(folder, "newmtl a b\nKd .5 .5 .5\nKe 0 1e999 0\n");
    obj_bad(folder, scene, "material 'a b': emission inf");
    mtl_write(folder, "newmtl a b\nKd .5 .5 .5\nKe 0 0 -1\n");
    obj_bad(folder, scene, "material 'a b': emission -1");
    mtl_write(folder, "\nnewmtl a b\nKd spectral x.rfl\n");
    obj_bad(folder, scene, "scene.mtl:3: 'spectral x.rfl' is not a colour");
}
END_TEST

START_TEST(reflectance_option_overrides_but_keeps_emission) {
    char path[256];
    import_report report;
    lam_error error = {0};
    mesh m = {0};
    import_options options = {.unit = 1, .reflectance = .3};
    mtl_write(folder, "newmtl lamp\nKd 2 .1 .1\nKe 3 2 1\n");
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

/* Rhino and others write these beside polygons. */
START_TEST(free_form_surfaces_are_told) {
    import_report report;
    mesh m = obj_good(
        folder,
        SQUARE "f 1 2 3\ncstype bspline\ndeg 1 1\nsurf 0 1 0 1 1 2 3 4\nend\nsurf 0 1 0 1 1 2 3 4\nend\n",
        &report);
    ck_assert_uint_eq(m.n, 1);
    ck_assert_msg(
        strstr(report.warnings,
               ":8: faces are missing: 2 free-form surfaces (surf) are not read; export polygons") != NULL,
        "%s", report.warnings);
    mesh_free(&m);
}
END_TEST

START_TEST(missing_material_files_are_named_with_their_line) {
    char path[256];
    obj_bad(folder, SQUARE "mtllib nowhere.mtl\nf 1 2 3\n",
            "scene.obj:5: the material file 'nowhere.mtl' is missing");
    mtl_write(folder, "newmtl a\nKd .1 .1 .1\n");
    obj_bad(folder, "mtllib scene.mtl nowhere.mtl\n" SQUARE "f 1 2 3\n",
            "scene.obj:1: the material file 'nowhere.mtl'");
    obj_bad(folder, "mtllib my room.mtl\n" SQUARE "f 1 2 3\n",
            "scene.obj:1: the material file 'my room.mtl', or 'my' if these are several names, is missing");
    file_write(folder, "with a blank.mtl", "newmtl b\nKd .2 .2 .2\n", path);
    import_report report;
    mesh m = obj_good(folder,
                      "mtllib with a blank.mtl\nmtllib scene.mtl with\\ a\\ blank.mtl\n" SQUARE
                      "usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n",
                      &report);
    ck_assert_float_eq(m.reflectance[0], .1f);
    ck_assert_float_eq(m.reflectance[1], .2f);
    mesh_free(&m);
}
END_TEST

START_TEST(planar_convex_quads_stay_and_others_become_triangles) {
    import_report report;
    mesh m = obj_good(folder,
                      SQUARE "v 0 1 .5\nv .5 .5 0\nv .5 0 0\n"
                             "f 1 2 3 4\n"   /* a quad */
                             "f 1 2 3 5\n"   /* not planar: two triangles */
                             "f 1 2 3 6\n"   /* a straight corner at 6: one triangle */
                             "f 1 7 2 3 4\n" /* a straight corner at 7: a quad again */
                             "f 1 2 2 3\n"   /* a corner twice: a triangle */
                             "f 1 3 4 4 4\n" /* and again */
                             "f 1 2 1 2\nf 1 7 2\nf 3 3 3\nf 1 2\np 1\nl 1 2 3\n",
                      &report);
    /* Seven pieces; two of the quads are the same, and three of the triangles, of which one is kept each; two
     * triangles lie in the quad. */
    ck_assert_uint_eq(m.n + report.coincident.dropped + report.coincident.covered, 7);
    ck_assert_uint_eq(report.coincident.dropped, 3);
    ck_assert_uint_eq(report.coincident.covered, 2);
    size_t quads = 0;
    for (size_t i = 0; i < m.n; i++) quads += m.elements[i][3] != MESH_NO_VERTEX;
    ck_assert_uint_eq(quads, 1);
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
            mesh m = obj_good(folder, text, &report);
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

/* The scene is 3,606 units across; a vertex that no face has does not count. */
START_TEST(scenes_of_any_possible_size_are_read) {
    static const struct {
        double unit;
        bool possible;
    } cases[] = {
        {.9e-12 / 3606, false}, {1.1e-12 / 3606, true}, {.9e15 / 3606, true}, {1.1e15 / 3606, false}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char path[256];
        lam_error error = {0};
        mesh m = {0};
        const import_options options = {.unit = cases[i].unit, .reflectance = -1};
        file_write(folder, "sized.obj", "v 0 0 0\nv 2000 0 0\nv 0 3000 0\nv 1e6 0 0\nf 1 2 3\n", path);
        const lam_status status = scene_import(path, &options, &m, NULL, &error);
        ck_assert_msg((status == LAM_OK) == cases[i].possible, "%zu: %s", i, error.message);
        if (!cases[i].possible) ck_assert_ptr_nonnull(strstr(error.message, "m across with --unit"));
        mesh_free(&m);
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
    obj_bad(folder, "", "scene is empty");
    obj_bad(folder, "f 1 2 3\n", "scene.obj:1: face refers to vertex 1, there are 0");
    obj_bad(folder, SQUARE "f 1 2 9\n", "scene.obj:5: face refers to vertex 9, there are 4");
    obj_bad(folder, SQUARE "f 1 2 99999999999999999999\n", "scene.obj:5: vertex index 99999999999999999999");
    obj_bad(folder, SQUARE "f 1 2 4294967296\n", "scene.obj:5: vertex index 4294967296");
    obj_bad(folder, SQUARE "f 1 two 3\n", "scene.obj:5: 'two 3' is not a vertex");
    obj_bad(folder, SQUARE "f 1 2.5 3\n", "scene.obj:5");
    obj_bad(folder, SQUARE "f 0 1 2\n", "scene.obj:5: vertex index 0");
    obj_bad(folder, "v 0 0\n", "scene.obj:1: a vertex needs three numbers");
    obj_bad(folder, "v 0 0 0\nv 1 inf 0\nv 0 1 0\nf 1 2 3\n", "scene.obj:2: vertex coordinate inf");
    obj_bad(folder, "v 0 0 0\nv 1 1e999 0\nv 0 1 0\nf 1 2 3\n", "scene.obj:2: vertex coordinate inf");
    obj_bad(folder, "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "none of its 1 faces has an area");
    obj_bad(folder, "v 0 0 0\nv 1 0 0\nv .5 1e-15 0\nf 1 2 3\n", "none of its 1 faces has an area");
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
            (size_t)snprintf(obj + obj_used, sizeof obj - obj_used,
                             "v 0 0 %d\nv 1 0 %d\nv 1 1 %d\nusemtl bright%d\nf -3 -2 -1\n", i, i, i, i);
    }
    import_report report;
    mtl_write(folder, mtl);
    mesh m = obj_good(folder, obj, &report);
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

int main(void) {
    Suite *suite = suite_create("import");
    TCase *tests = tcase_create("import");
    tcase_set_timeout(tests, 300);
    tcase_add_checked_fixture(tests, setup, teardown);
    tcase_add_test(tests, groups_follow_objects_then_materials);
    tcase_add_test(tests, faces_of_several_groups_are_in_the_smallest);
    tcase_add_test(tests, gltf_groups_are_nodes);
    tcase_add_test(tests, mirrored_nodes_keep_their_fronts);
    tcase_add_test(tests, diffuse_of_one_or_more_is_clamped_with_a_warning);
    tcase_add_test(tests, brighter_colours_never_become_darker);
    tcase_add_test(tests, textures_that_are_not_read_have_a_default_and_a_warning);
    tcase_add_test(tests, missing_colours_have_a_default_and_a_warning);
    tcase_add_test(tests, bad_colours_are_errors);
    tcase_add_test(tests, reflectance_option_overrides_but_keeps_emission);
    tcase_add_test(tests, free_form_surfaces_are_told);
    tcase_add_test(tests, missing_material_files_are_named_with_their_line);
    tcase_add_test(tests, planar_convex_quads_stay_and_others_become_triangles);
    tcase_add_test(tests, concave_polygons_keep_area_and_side);
    tcase_add_test(tests, coordinates_are_scaled_but_not_turned);
    tcase_add_test(tests, scenes_of_any_possible_size_are_read);
    tcase_add_test(tests, single_precision_far_from_the_origin_is_told);
    tcase_add_test(tests, bad_geometry_is_refused_by_line);
    tcase_add_test(tests, files_that_cannot_be_read_are_named);
    tcase_add_test(tests, warnings_are_cut_with_a_count);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
