#include "support/scene.h"

void folder_make(char path[64]) {
    snprintf(path, 64, "/tmp/lambert-test-XXXXXX");
    ck_assert_ptr_nonnull(mkdtemp(path));
}

void folder_remove(const char *path) {
    char command[128];
    snprintf(command, sizeof command, "rm -rf '%s'", path);
    ck_assert_int_eq(system(command), 0);
}

void file_write(const char *folder, const char *name, const char *text, char path[256]) {
    snprintf(path, 256, "%s/%s", folder, name);
    FILE *file = fopen(path, "w");
    ck_assert_ptr_nonnull(file);
    ck_assert_int_ge(fputs(text, file), 0);
    ck_assert_int_eq(fclose(file), 0);
}

import_options import_plain(void) {
    return (import_options){.unit = 1, .reflectance = -1};
}

mesh import_good(const char *path, import_report *report) {
    const import_options options = import_plain();
    mesh m = {0};
    lam_error error = {0};
    const lam_status status = scene_import(path, &options, &m, report, &error);
    ck_assert_msg(status == LAM_OK, "%s", error.message);
    return m;
}

lam_status obj_import(const char *folder, const char *text, mesh *m, import_report *report,
                      lam_error *error) {
    char path[256];
    const import_options options = import_plain();
    file_write(folder, "scene.obj", text, path);
    return scene_import(path, &options, m, report, error);
}

mesh obj_good(const char *folder, const char *text, import_report *report) {
    mesh m = {0};
    lam_error error = {0};
    ck_assert_msg(obj_import(folder, text, &m, report, &error) == LAM_OK, "%s", error.message);
    return m;
}

void obj_bad(const char *folder, const char *text, const char *says) {
    mesh m = {0};
    lam_error error = {0};
    ck_assert_int_eq(obj_import(folder, text, &m, NULL, &error), LAM_ERR_FORMAT);
    ck_assert_msg(strstr(error.message, folder) != NULL && strstr(error.message, says) != NULL, "%s",
                  error.message);
    ck_assert_ptr_null(m.vertices);
}

void mtl_write(const char *folder, const char *text) {
    char path[256];
    file_write(folder, "scene.mtl", text, path);
}

double total_area(const mesh *m) {
    double sum = 0;
    for (size_t i = 0; i < m->n; i++) sum += m->area[i];
    return sum;
}

size_t group_find(const mesh *m, const char *name) {
    size_t g = 0;
    while (g < m->n_groups && strcmp(m->group_names[g], name) != 0) g++;
    return g;
}

double group_area(const mesh *m, const char *name, size_t *elements) {
    const size_t g = group_find(m, name);
    double sum = 0;
    size_t n = 0;
    ck_assert_msg(g < m->n_groups, "there is no group '%s'", name);
    for (size_t i = 0; i < m->n; i++)
        if (m->group[i] == g) sum += m->area[i], n++;
    if (elements != NULL) *elements = n;
    return sum;
}

double solid_angle(const double p[3], const double *a, const double *b, const double *c) {
    const double *corner[3] = {a, b, c};
    double r[3][3], length[3], dot[3];
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) r[i][k] = corner[i][k] - p[k];
        length[i] = sqrt(r[i][0] * r[i][0] + r[i][1] * r[i][1] + r[i][2] * r[i][2]);
    }
    for (int i = 0; i < 3; i++) {
        const double *u = r[i], *v = r[(i + 1) % 3];
        dot[i] = u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
    }
    const double volume = r[0][0] * (r[1][1] * r[2][2] - r[1][2] * r[2][1]) -
                          r[0][1] * (r[1][0] * r[2][2] - r[1][2] * r[2][0]) +
                          r[0][2] * (r[1][0] * r[2][1] - r[1][1] * r[2][0]);
    /* seen from its front, a triangle runs counter-clockwise, which makes the volume negative */
    return -2 * atan2(volume, length[0] * length[1] * length[2] + dot[0] * length[2] + dot[1] * length[0] +
                                  dot[2] * length[1]);
}

double seen_from(const mesh *m, const double p[3]) {
    double sum = 0;
    for (size_t i = 0; i < m->n; i++) {
        const uint32_t *e = m->elements[i];
        sum += solid_angle(p, m->vertices[e[0]], m->vertices[e[1]], m->vertices[e[2]]);
        if (mesh_corners(m, i) == 4)
            sum += solid_angle(p, m->vertices[e[0]], m->vertices[e[2]], m->vertices[e[3]]);
    }
    return sum;
}

lam_status import_fixture(const char *name, mesh *m, import_report *report, lam_error *error) {
    char path[512];
    const import_options options = import_plain();
    snprintf(path, sizeof path, FIXTURES "/%s", name);
    return scene_import(path, &options, m, report, error);
}

mesh generate_good(const generate_options *how) {
    char folder[64], path[256];
    lam_error error = {0};
    folder_make(folder);
    snprintf(path, sizeof path, "%s/scene.obj", folder);
    ck_assert_msg(scene_generate(how, path, NULL, &error) == LAM_OK, "%s", error.message);
    import_report report = {0};
    const mesh m = import_good(path, &report);
    folder_remove(folder);
    return m;
}
