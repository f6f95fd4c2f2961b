#include "solver/scene/size_question.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static int axis_of(char up) {
    return up == 'x' ? 0 : up == 'y' ? 1 : 2;
}

/* The height and the two widths of a scene, the larger one last. */
static void sides_of(const mesh *m, double *height, double width[2]) {
    double low[3], high[3];
    const int up = axis_of(m->up);
    mesh_box(m, low, high);
    *height = high[up] - low[up];
    const double a = high[(up + 1) % 3] - low[(up + 1) % 3], b = high[(up + 2) % 3] - low[(up + 2) % 3];
    width[0] = fmin(a, b);
    width[1] = fmax(a, b);
}

/* True where faces enclose a place that they look into: the volume by Gauss' theorem is below 0. */
static bool looks_inward(const mesh *m) {
    double low[3], high[3], volume = 0;
    mesh_box(m, low, high);
    for (size_t i = 0; i < m->n; i++) {
        const double *corner = m->vertices[m->elements[i][0]];
        for (int k = 0; k < 3; k++)
            volume += m->area[i] * (corner[k] - (low[k] + high[k]) / 2) * (double)m->normal[i][k] / 3;
    }
    return volume < 0;
}

const length_unit *mesh_likely_unit(const mesh *m) {
    double height, width[2];
    sides_of(m, &height, width);
    /* No building is a kilometre high, and no town is as high as a fifth of its width. A room of 2 to 3 m, or
     * a house of some storeys, has such figures in its own unit; of a single room in feet only its height
     * tells. */
    if (height > 1000 && width[1] < 100 * height) return length_unit_find("mm");
    if (height > 150 && width[1] < 5 * height && width[0] > .5 * height) return length_unit_find("cm");
    if (height > 7.4 && height < 10.6 && width[0] > 7.4 && width[1] < 22 && looks_inward(m))
        return length_unit_find("ft");
    return NULL;
}

/* True where a name has one of the words of places that face up or down. */
static bool names_level(const char *name) {
    static const char *const words[] = {"floor", "ceiling", "boden", "decke"};
    char small[64];
    size_t n = 0;
    for (; name[n] != '\0' && n + 1 < sizeof small; n++) small[n] = (char)tolower((unsigned char)name[n]);
    small[n] = '\0';
    for (size_t k = 0; k < sizeof words / sizeof *words; k++)
        if (strstr(small, words[k]) != NULL) return true;
    return false;
}

/* The area of faces along each axis; of groups that are called so, or of all. */
static void areas_along(const mesh *m, bool named, double area[3]) {
    area[0] = area[1] = area[2] = 0;
    for (size_t i = 0; i < m->n; i++) {
        if (named && !names_level(m->group_names[m->group[i]])) continue;
        for (int k = 0; k < 3; k++)
            if (fabs((double)m->normal[i][k]) > .9) area[k] += m->area[i];
    }
}

/* The direction of all lamps together, without its signs: of a box that lacks its top it is down. */
static void lamps_along(const mesh *m, double direction[3]) {
    direction[0] = direction[1] = direction[2] = 0;
    for (size_t i = 0; i < m->n; i++) {
        bool lit = false;
        for (size_t c = 0; c < m->n_channels; c++) lit = lit || m->emission[c * m->n + i] > 0;
        for (int k = 0; lit && k < 3; k++) direction[k] += m->area[i] * (double)m->normal[i][k];
    }
    for (int k = 0; k < 3; k++) direction[k] = fabs(direction[k]);
}

char mesh_likely_up(const mesh *m) {
    double level[3], lit[3], all[3], height, width[2], low[3], high[3];
    const int up = axis_of(m->up);
    if (m->up == 'x') return 0;
    const int other = up == 1 ? 2 : 1;
    areas_along(m, true, level);
    const double sum = level[0] + level[1] + level[2];
    if (sum > 0) return level[other] > .9 * sum ? "xyz"[other] : 0;
    lamps_along(m, lit);
    areas_along(m, false, all);
    mesh_box(m, low, high);
    sides_of(m, &height, width);
    const double side = high[other] - low[other], third = high[0] - low[0];
    const bool shortest = side > 0 && side < .7 * height && side < .7 * third;
    /* Lamps look up or down. A corridor is as narrow as a room is low. */
    const double lamps = lit[0] + lit[1] + lit[2], most = fmax(all[0], all[up]);
    if (lit[up] > 0 && lit[up] > .5 * lamps) return 0;
    const double times = lit[other] > 0 && lit[other] > .9 * lamps ? 1.1 : 1.6;
    return shortest && all[other] > times * most ? "xyz"[other] : 0;
}
