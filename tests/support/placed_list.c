#include "support/placed_list.h"

#include <stdarg.h>

/* Writes an LM-63 file of 1 + 180 / step angles and planes planes, of the intensity in each direction. */
static void write_ies(const char *folder, const char *name, const char *opening, int planes,
                      double (*intensity)(const double direction[3])) {
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "w");
    ck_assert_ptr_nonnull(file);
    fprintf(file, "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 181 %d 1 2 %s\n1 1 10\n", planes, opening);
    for (int g = 0; g <= 180; g++) fprintf(file, "%d\n", g);
    for (int p = 0; p < planes; p++) fprintf(file, "%g\n", planes > 1 ? 90. * p / (planes - 1) : 0);
    for (int p = 0; p < planes; p++)
        for (int g = 0; g <= 180; g++) {
            const double C = planes > 1 ? M_PI / 2 * p / (planes - 1) : 0, gamma = M_PI * g / 180;
            const double direction[3] = {sin(gamma) * cos(C), sin(gamma) * sin(C), -cos(gamma)};
            fprintf(file, "%.9g\n", intensity(direction));
        }
    ck_assert_int_eq(fclose(file), 0);
}

static double of_panel(const double direction[3]) {
    return 1000 * fmax(0, -direction[2]);
}

static double of_ball(const double direction[3]) {
    (void)direction;
    return 100;
}

/* L times the projected area. */
static double of_box(const double direction[3]) {
    return 1000 *
           (.6 * .3 * fabs(direction[2]) + .6 * .2 * fabs(direction[1]) + .3 * .2 * fabs(direction[0]));
}

placed_luminaires placed_list(const char *format, ...) {
    static const placed_options options = {.assets = FIXTURES "/luminaires"};
    static const char cone[] =
        "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 10\n0 60\n0\n1000 1000\n";
    char folder[64], entries[8192], text[8300], path[256];
    placed_luminaires p;
    lam_error error = {.message = ""};
    va_list arguments;
    va_start(arguments, format);
    ck_assert_int_lt(vsnprintf(entries, sizeof entries, format, arguments), (int)sizeof entries);
    va_end(arguments);
    snprintf(text, sizeof text, "{\"luminaires\": [%s]}", entries);
    folder_make(folder);
    write_ies(folder, "panel.ies", ".3 1.2 0", 1, of_panel);
    write_ies(folder, "ball.ies", "-.4 -.4 -.4", 1, of_ball);
    write_ies(folder, "box.ies", ".3 .6 .2", 46, of_box);
    file_write(folder, "cone.ies", cone, path);
    file_write(folder, "list.json", text, path);
    const lam_status status = placed_read(path, &options, &p, &error);
    folder_remove(folder);
    ck_assert_msg(status == LAM_OK, "%s", error.message);
    return p;
}

void obj_text_squares(obj_text *o, const char *group, const double corner[3], const double u[3],
                      const double v[3], int n) {
    static const int turn[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    obj_text_put(o, "o %s\n", group);
    for (int k = 0; k < n * n; k++) {
        for (int c = 0; c < 4; c++) {
            const double a = (k % n + turn[c][0]) / (double)n, b = (k / n + turn[c][1]) / (double)n;
            obj_text_put(o, "v %.9g %.9g %.9g\n", corner[0] + a * u[0] + b * v[0],
                         corner[1] + a * u[1] + b * v[1], corner[2] + a * u[2] + b * v[2]);
        }
        obj_text_put(o, "f -4 -3 -2 -1\n");
    }
}

static void put_faces(obj_text *o, const char *const names[6], const double low[3], const double high[3],
                      int n, bool inside) {
    for (int face = 0; face < 6; face++) {
        const int axis = face / 2;
        double corner[3] = {low[0], low[1], low[2]}, edge[2][3] = {{0}};
        if (face % 2 == 1) corner[axis] = high[axis];
        for (int k = 0; k < 2; k++) {
            const int along = (axis + 1 + k) % 3;
            edge[k][along] = high[along] - low[along];
        }
        /* edge 0 x edge 1 looks along the axis: inwards from its lower face. */
        const bool swap = (face % 2 == 1) == inside;
        obj_text_squares(o, names[face], corner, edge[swap], edge[!swap], n);
    }
}

void obj_text_room(obj_text *o, const double low[3], const double high[3], int n) {
    static const char *const names[6] = {"west", "east", "south", "north", "floor", "ceiling"};
    put_faces(o, names, low, high, n, true);
}

void obj_text_block(obj_text *o, const char *group, const double low[3], const double high[3], int n) {
    const char *const names[6] = {group, group, group, group, group, group};
    put_faces(o, names, low, high, n, false);
}
