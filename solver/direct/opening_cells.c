#include "solver/direct/opening_cells.h"

#include "solver/base/vector3.h"

#include <math.h>
#include <string.h>

/* Cells are as small as for a receiver at this part of the largest extent, however near it is. */
static const double nearest = 1e-3;

/* The lengths of a pair of cells over their distance: with f = D^4 / (D^2 + x^2)^2, the light of a line
 * straight ahead, the error h^4 f'''' / 4320 of a pair is 72 / (81 * 4320) = 2e-4 of it. One cell alone is
 * shorter by `alone`: h^2 f'' / 24 = 4 / (225 * 24) = 7e-4. */
static const double longest_pair = 1. / 3, shortest_pair = .02, alone = .2;

/* The place at (u, w) of a face, and its vector of area for du dw = 1. */
static void face_at(const opening_face *f, double u, double w, double at[3], double area[3]) {
    const bool is_round = f->kind != FACE_PLANE;
    const double c = is_round ? cos(2 * M_PI * w) : 0, s = is_round ? sin(2 * M_PI * w) : 0, z = 2 * u - 1,
                 ring = sqrt(fmax(0, 1 - z * z));
    double part[3] = {0}, along[3], normals[3][3];
    switch (f->kind) {
    case FACE_PLANE:
        part[0] = z, part[1] = 2 * w - 1;
        cross3(f->axis[0], f->axis[1], area);
        for (int d = 0; d < 3; d++) area[d] *= 4;
        break;
    case FACE_DISC:
        part[0] = u * c, part[1] = u * s;
        cross3(f->axis[0], f->axis[1], area);
        for (int d = 0; d < 3; d++) area[d] *= 2 * M_PI * u;
        break;
    case FACE_TUBE:
        part[0] = c, part[1] = s, part[2] = z;
        for (int d = 0; d < 3; d++) along[d] = 4 * M_PI * (c * f->axis[1][d] - s * f->axis[0][d]);
        cross3(along, f->axis[2], area);
        break;
    case FACE_BALL:
        part[0] = ring * c, part[1] = ring * s, part[2] = z;
        for (int k = 0; k < 3; k++) cross3(f->axis[(k + 1) % 3], f->axis[(k + 2) % 3], normals[k]);
        for (int d = 0; d < 3; d++)
            area[d] =
                4 * M_PI * (part[0] * normals[0][d] + part[1] * normals[1][d] + part[2] * normals[2][d]);
        break;
    }
    for (int d = 0; d < 3; d++)
        at[d] = f->middle[d] + part[0] * f->axis[0][d] + part[1] * f->axis[1][d] + part[2] * f->axis[2][d];
}

static double length3(const double v[3]) {
    return sqrt(dot3(v, v));
}

/* The area of a face as a direction sees its front; its axes are at right angles. */
static double projected_area(const opening_face *f, const double direction[3]) {
    const double a = length3(f->axis[0]), b = length3(f->axis[1]), c = length3(f->axis[2]);
    double area[3];
    cross3(f->axis[0], f->axis[1], area);
    if (f->kind == FACE_PLANE) return 4 * fmax(0, dot3(area, direction));
    if (f->kind == FACE_DISC) return M_PI * fmax(0, dot3(area, direction));
    const double x = a > 0 ? dot3(f->axis[0], direction) / a : 0,
                 y = b > 0 ? dot3(f->axis[1], direction) / b : 0,
                 z = c > 0 ? dot3(f->axis[2], direction) / c : 0;
    if (f->kind == FACE_TUBE) return 4 * c * hypot(b * x, a * y);
    return M_PI * sqrt(b * b * c * c * x * x + a * a * c * c * y * y + a * a * b * b * z * z);
}

static void add_face(opening_faces *o, opening_face_kind kind, const double middle[3],
                     const double axes[3][3]) {
    opening_face *f = &o->faces[o->n_faces++];
    f->kind = kind;
    memcpy(f->middle, middle, sizeof f->middle);
    memcpy(f->axis, axes, sizeof f->axis);
}

/* A flat opening, across its smallest extent; a line has one side of no length. */
static void set_flat(opening_faces *o, opening_face_kind kind) {
    static const double middle[3] = {0};
    int across = 2;
    for (int d = 0; d < 2; d++)
        if (o->size[d] < o->size[across]) across = d;
    double axes[3][3] = {{0}};
    axes[0][(across + 1) % 3] = o->size[(across + 1) % 3] / 2;
    axes[1][(across + 2) % 3] = o->size[(across + 2) % 3] / 2;
    o->flat = true;
    add_face(o, kind, middle, (const double(*)[3])axes);
}

/* Both ends and the sides. A side is as high as the file says, from the lower face on. */
static void set_box(opening_faces *o, const double side[4]) {
    const double half[3] = {o->size[0] / 2, o->size[1] / 2, o->size[2] / 2};
    for (int end = -1; end <= 1; end += 2) {
        const double middle[3] = {0, 0, end * half[2]};
        const double axes[3][3] = {{half[0], 0, 0}, {0, end * half[1], 0}, {0}};
        add_face(o, FACE_PLANE, middle, axes);
    }
    for (int k = 0; k < 4; k++) {
        if (!(side[k] > 0)) continue;
        const int out = k % 2, along = 1 - out;
        const double sign = k < 2 ? 1 : -1, turn = out == 0 ? sign : -sign;
        double middle[3] = {0, 0, side[k] / 2 - half[2]}, axes[3][3] = {{0}};
        middle[out] = sign * half[out];
        axes[0][along] = turn * half[along];
        axes[1][2] = side[k] / 2;
        add_face(o, FACE_PLANE, middle, (const double(*)[3])axes);
    }
}

/* A tube along an axis of the frame with both its ends. */
static void set_cylinder(opening_faces *o, int along) {
    const int x = (along + 1) % 3, y = (along + 2) % 3;
    static const double centre[3] = {0};
    double axes[3][3] = {{0}};
    axes[0][x] = o->size[x] / 2;
    axes[1][y] = o->size[y] / 2;
    axes[2][along] = o->size[along] / 2;
    add_face(o, FACE_TUBE, centre, (const double(*)[3])axes);
    for (int end = -1; end <= 1; end += 2) {
        double middle[3] = {0}, radii[3][3] = {{0}};
        middle[along] = end * o->size[along] / 2;
        radii[0][x] = o->size[x] / 2;
        radii[1][y] = end * o->size[y] / 2;
        add_face(o, FACE_DISC, middle, (const double(*)[3])radii);
    }
}

static void set_ball(opening_faces *o) {
    static const double centre[3] = {0};
    const double axes[3][3] = {{o->size[0] / 2, 0, 0}, {0, o->size[1] / 2, 0}, {0, 0, o->size[2] / 2}};
    add_face(o, FACE_BALL, centre, axes);
}

/* The area of a face, of curved ones that of their projections on six directions, by Cauchy's formula: a
 * choice among faces needs no more. */
static double rough_area(const opening_face *f) {
    double sum = 0;
    for (int k = 0; k < 6; k++) {
        double direction[3] = {0};
        direction[k / 2] = k % 2 == 0 ? 1 : -1;
        sum += projected_area(f, direction);
    }
    return sum;
}

void opening_faces_set(const luminaire_opening *opening, bool is_point, double finest, opening_faces *out) {
    *out = (opening_faces){.flat = true, .step = fmin(longest_pair, fmax(shortest_pair, finest))};
    double sum = 0;
    if (is_point || opening->shape == OPENING_POINT) return;
    memcpy(out->size, opening->size, sizeof out->size);
    switch (opening->shape) {
    case OPENING_BOX:
        set_box(out, opening->side);
        break;
    case OPENING_CYLINDER:
        set_cylinder(out, 2);
        break;
    case OPENING_CYLINDER_X:
    case OPENING_CYLINDER_Y:
        set_cylinder(out, opening->shape == OPENING_CYLINDER_X ? 0 : 1);
        break;
    case OPENING_SPHERE:
    case OPENING_ELLIPSOID:
        set_ball(out);
        break;
    case OPENING_DISC:
    case OPENING_ELLIPSE:
    case OPENING_UPRIGHT_DISC:
        set_flat(out, FACE_DISC);
        break;
    default:
        set_flat(out, FACE_PLANE);
    }
    out->flat = out->n_faces == 1 && out->faces[0].kind <= FACE_DISC;
    for (size_t k = 0; k < out->n_faces; k++) {
        sum += rough_area(&out->faces[k]);
        out->upto[k] = sum;
    }
    for (size_t k = 0; k < out->n_faces; k++) out->upto[k] = sum > 0 ? out->upto[k] / sum : 1;
    out->upto[out->n_faces - 1] = 1;
}

double opening_distance(const opening_faces *o, const double x[3]) {
    double square = 0;
    for (int d = 0; d < 3; d++) {
        const double off = fmax(0, fabs(x[d]) - o->size[d] / 2);
        square += off * off;
    }
    return sqrt(square);
}

/* The cells of a face as they are found. */
typedef struct cell_list {
    const opening_face *face;
    bool is_flat; /* the opening */
    const double *x;
    double step;     /* the length of a pair of cells over their distance from x */
    double apart;    /* the distance of a part from x, at least, over its length */
    double closest;  /* m: the least distance that counts */
    size_t least[2]; /* pairs along each side of the face */

    double whole[2]; /* the part of the map of the face that is seen, along each side */
    size_t n, most;  /* of cells; n may be more */
    opening_cell *cells;
} cell_list;

/* A part of a face: from[0] ... to[0] of u, from[1] ... to[1] of w. */
typedef struct face_part {
    double from[2], to[2];
} face_part;

/* The lengths of a part along u and w, in m, or a little more. */
static void part_lengths(const opening_face *f, const face_part *p, double length[2]) {
    const double a = length3(f->axis[0]), b = length3(f->axis[1]), c = length3(f->axis[2]);
    const double round = fmax(a, b), u = p->to[0] - p->from[0], w = p->to[1] - p->from[1];
    double ring = 1;
    length[0] = 2 * a * u; /* of a plane */
    length[1] = 2 * b * w;
    switch (f->kind) {
    case FACE_PLANE:
        return;
    case FACE_DISC:
        length[0] = round * u;
        length[1] = 2 * M_PI * round * p->to[0] * w;
        return;
    case FACE_TUBE:
        length[0] = 2 * c * u;
        length[1] = 2 * M_PI * round * w;
        return;
    case FACE_BALL:
        if (p->to[0] < .5) ring = 2 * sqrt(p->to[0] * (1 - p->to[0]));
        if (p->from[0] > .5) ring = 2 * sqrt(p->from[0] * (1 - p->from[0]));
        length[0] = fmax(round, c) * (acos(2 * p->from[0] - 1) - acos(2 * p->to[0] - 1));
        length[1] = 2 * M_PI * round * ring * w;
        return;
    }
}

/* The distance of x from a part, or less; of a plane it is exact. */
static double part_distance(const cell_list *l, const face_part *p, const double length[2]) {
    const opening_face *f = l->face;
    double middle[3], area[3], to[3];
    face_at(f, (p->from[0] + p->to[0]) / 2, (p->from[1] + p->to[1]) / 2, middle, area);
    subtract3(l->x, middle, to);
    const double all = dot3(to, to);
    if (f->kind != FACE_PLANE) return sqrt(all) - hypot(length[0], length[1]) / 2;
    double across = all, square = 0;
    for (int k = 0; k < 2; k++) {
        const double axis = length3(f->axis[k]), along = axis > 0 ? dot3(to, f->axis[k]) / axis : 0,
                     off = fmax(0, fabs(along) - length[k] / 2);
        across -= along * along;
        square += off * off;
    }
    return sqrt(fmax(0, across) + square);
}

static void add_cell(cell_list *l, double u, double w, double du, double dw) {
    if (l->n++ >= l->most) return;
    opening_cell *cell = &l->cells[l->n - 1];
    face_at(l->face, u, w, cell->at, cell->area);
    for (int d = 0; d < 3; d++) cell->area[d] *= du * dw;
    cell->share = l->is_flat ? du * dw * (l->face->kind == FACE_DISC ? 2 * u : 1) : 0;
}

/* Places of n pairs of cells, or of one cell where n is 0, along a side. Around a whole turn even ones are
 * best.
 */
static double place_along(const face_part *p, int side, size_t n, size_t k, bool turn) {
    const double apart = turn ? .25 : .28867513459481287 /* 1 / (2 sqrt 3) */,
                 offset = k % 2 == 0 ? -apart : apart;
    if (n == 0) return (p->from[side] + p->to[side]) / 2;
    return p->from[side] + (p->to[side] - p->from[side]) * ((double)(k / 2) + .5 + offset) / (double)n;
}

/* The pairs of cells along both sides of a part, 0 for one cell alone; false, with the longer side, where it
 * is so near that it is divided first. */
static bool count_pairs(const cell_list *l, const face_part *p, size_t n[2], int *side) {
    double length[2] = {0};
    part_lengths(l->face, p, length);
    const double far = part_distance(l, p, length), most = fmax(length[0], length[1]);
    *side = length[0] >= length[1] ? 0 : 1;
    if (!(far > most * l->apart) && most > l->closest) return false;
    const double step = l->step * fmax(far, l->closest);
    for (int k = 0; k < 2; k++) {
        const double whole = p->to[k] - p->from[k];
        const size_t least = (size_t)ceil((double)l->least[k] * fmin(1, whole / l->whole[k]) - 1e-9);
        n[k] = length[k] > alone * step ? (size_t)ceil(length[k] / step) : 0;
        if (length[k] > 0 && n[k] < least) n[k] = least;
    }
    return true;
}

static void add_part(cell_list *l, const face_part *p) {
    size_t n[2];
    int side;
    if (l->n > l->most) return;
    if (!count_pairs(l, p, n, &side)) {
        face_part half[2] = {*p, *p};
        half[0].to[side] = half[1].from[side] = (p->from[side] + p->to[side]) / 2;
        add_part(l, &half[0]);
        add_part(l, &half[1]);
        return;
    }
    const size_t many[2] = {n[0] > 0 ? 2 * n[0] : 1, n[1] > 0 ? 2 * n[1] : 1};
    const double du = (p->to[0] - p->from[0]) / (double)many[0],
                 dw = (p->to[1] - p->from[1]) / (double)many[1];
    const bool turn = l->face->kind != FACE_PLANE && p->to[1] - p->from[1] >= 1;
    for (size_t i = 0; i < many[0]; i++)
        for (size_t j = 0; j < many[1]; j++)
            add_cell(l, place_along(p, 0, n[0], i, false), place_along(p, 1, n[1], j, turn), du, dw);
}

/* The pairs along both sides of a face for so many cells of the opening, 1, 16 or 256. Round faces have
 * enough of them to stand for a circle, and curved ones for the half of it that is seen. */
static void least_pairs(const opening_faces *o, const opening_face *f, size_t cells, size_t least[2]) {
    static const face_part whole = {{0, 0}, {1, 1}};
    double length[2] = {0};
    part_lengths(f, &whole, length);
    const bool is_line = !(length[0] > 0 && length[1] > 0), many_faces = o->n_faces > 1;
    least[0] = cells == 1 ? 0 : cells == 16 ? (many_faces ? 1 : 2) : (many_faces ? 4 : 8);
    if (is_line) least[0] *= cells == 16 ? 4 : 16;
    least[1] = least[0];
    const size_t around = f->kind == FACE_TUBE ? 1 : 2, along = 1;
    if (f->kind == FACE_PLANE) return;
    if (least[0] < along) least[0] = along;
    if (least[1] < around) least[1] = around;
}

/* The part of a face of a body whose front x sees; false: none. A curved face is turned about itself so that
 * the part is one of its map, about the way to x: with y = x in units of its axes, of a ball all with n . y >
 * 1, and of a tube the same across its axis. */
static bool seen_part(const opening_faces *o, const opening_face *f, const double x[3], opening_face *turned,
                      face_part *part) {
    double to[3], area[3], y[3] = {0}, axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    *turned = *f;
    *part = (face_part){{0, 0}, {1, 1}};
    if (o->flat) return true;
    subtract3(x, f->middle, to);
    if (f->kind == FACE_PLANE || f->kind == FACE_DISC) {
        cross3(f->axis[0], f->axis[1], area);
        return dot3(to, area) > 0;
    }
    const int n_axes = f->kind == FACE_BALL ? 3 : 2;
    for (int k = 0; k < n_axes; k++) y[k] = dot3(to, f->axis[k]) / dot3(f->axis[k], f->axis[k]);
    const double length = length3(y);
    if (!(length > 1)) return false;
    for (int k = 0; k < 3; k++) y[k] /= length;
    if (f->kind == FACE_BALL) {
        const int least = fabs(y[0]) < .6 ? 0 : 1;
        double along[3] = {0};
        along[least] = 1;
        memcpy(axes[2], y, sizeof y);
        cross3(y, along, axes[0]);
        const double across = length3(axes[0]);
        for (int k = 0; k < 3; k++) axes[0][k] /= across;
        cross3(y, axes[0], axes[1]);
        part->from[0] = .5 + .5 / length;
    } else {
        memcpy(axes[0], y, sizeof y);
        axes[1][0] = -y[1], axes[1][1] = y[0];
        part->to[1] = acos(1 / length) / (2 * M_PI);
        part->from[1] = -part->to[1];
    }
    for (int k = 0; k < 3; k++)
        for (int d = 0; d < 3; d++)
            turned->axis[k][d] =
                axes[k][0] * f->axis[0][d] + axes[k][1] * f->axis[1][d] + axes[k][2] * f->axis[2][d];
    return true;
}

/* True where one cell stands for all of the opening. */
static bool is_small(const opening_faces *o, const double x[3]) {
    const double largest = fmax(fmax(o->size[0], o->size[1]), o->size[2]);
    return o->n_faces == 0 || largest <= alone * o->step * opening_distance(o, x);
}

static cell_list list_begin(const opening_faces *o, const double x[3], size_t most, opening_cell *cells) {
    const double largest = fmax(fmax(o->size[0], o->size[1]), o->size[2]);
    return (cell_list){.is_flat = o->flat,
                       .x = x,
                       .step = o->step,
                       .apart = .5,
                       .closest = nearest * largest,
                       .most = most,
                       .cells = cells};
}

size_t opening_cells(const opening_faces *o, const double x[3], size_t least, size_t most,
                     opening_cell *cells) {
    cell_list l = list_begin(o, x, most, cells);
    if (o->n_faces == 0 || (least == 1 && is_small(o, x))) {
        cells[0] = (opening_cell){.share = 1};
        return 1;
    }
    for (;; l.step *= 1.5, l.apart /= 1.5, l.closest *= 2) {
        l.n = 0;
        for (size_t f = 0; f < o->n_faces; f++) {
            opening_face face;
            face_part part;
            if (!seen_part(o, &o->faces[f], x, &face, &part)) continue;
            l.face = &face;
            for (int k = 0; k < 2; k++) l.whole[k] = part.to[k] - part.from[k];
            least_pairs(o, l.face, least, l.least);
            add_part(&l, &part);
        }
        if (l.n <= most) break;
    }
    return l.n;
}

size_t opening_cells_keep(const opening_faces *o, const double x[3], size_t most, kept_cells *k) {
    static const face_part whole = {{0, 0}, {1, 1}};
    cell_list l = list_begin(o, x, most, k->cells);
    size_t pairs[2];
    int side;
    if (o->flat && !is_small(o, x)) {
        l.face = &o->faces[0];
        l.whole[0] = l.whole[1] = 1;
        least_pairs(o, l.face, 1, l.least);
        if (count_pairs(&l, &whole, pairs, &side)) {
            if (k->of == o && memcmp(k->pairs, pairs, sizeof pairs) == 0) return k->n;
            k->n = opening_cells(o, x, 1, most, k->cells);
            k->of = k->n == (pairs[0] > 0 ? 2 * pairs[0] : 1) * (pairs[1] > 0 ? 2 * pairs[1] : 1) ? o : NULL;
            memcpy(k->pairs, pairs, sizeof pairs);
            return k->n;
        }
    }
    k->of = NULL;
    return opening_cells(o, x, 1, most, k->cells);
}

void opening_place(const opening_faces *o, double u, double w, opening_cell *out) {
    if (o->n_faces == 0) {
        *out = (opening_cell){.share = 1};
        return;
    }
    size_t f = 0;
    while (f + 1 < o->n_faces && u >= o->upto[f]) f++;
    const double before = f > 0 ? o->upto[f - 1] : 0, part = o->upto[f] - before;
    u = part > 0 ? fmin(1, (u - before) / part) : .5;
    double density = part > 0 ? 1 / part : 0;
    if (o->faces[f].kind == FACE_DISC) { /* uniform in area: u = r^2 */
        u = sqrt(u);
        density /= 2 * fmax(u, 1e-12);
    }
    face_at(&o->faces[f], u, w, out->at, out->area);
    for (int d = 0; d < 3; d++) out->area[d] *= density;
    out->share = o->flat ? 1 : 0;
}

double opening_projected(const opening_faces *o, const double direction[3]) {
    const double against[3] = {-direction[0], -direction[1], -direction[2]};
    double sum = 0;
    for (size_t f = 0; f < o->n_faces; f++) {
        const double front = projected_area(&o->faces[f], direction);
        sum += o->flat ? fmax(front, projected_area(&o->faces[f], against)) : front;
    }
    return sum;
}

double opening_part(const opening_faces *o, const opening_cell *cell, const double direction[3]) {
    if (o->flat || cell->share > 0) return cell->share;
    const double own = dot3(cell->area, direction);
    if (!(own > 0)) return 0;
    const double all = opening_projected(o, direction);
    return all > 0 ? own / all : 0;
}
