/* The visible share V is the integral of F to what is visible over that of F, both over one element, F being
 * Lambert's sum over edges (Lambert 1760; shadow_cut.h). They are sums over cells of 4 x 4 Gauss points, and
 * the cell of the largest error, by its coefficients of P_2 and P_3, is split until the tolerance is kept. */
#include "solver/formfactor/sight/projection.h"

#include "solver/base/random.h"
#include "solver/base/vector3.h"
#include "solver/formfactor/sight/shadow_cut.h"

#include <math.h>
#include <string.h>

/* NODES: of the product rule of a cell. LINES_MOST: lines along which cells are cut; CELLS_MOST: cells of a
 * pair. */
enum { NODES = 4, LINES_MOST = 64, CELLS_MOST = 96, RULE = 3 };

/* The share of a cell: integrals of F to the visible part and to all of the other element, and the
 * coefficients of P_2 and P_3 along both directions of each, which say how rough it is. */
typedef struct cell_sums {
    double visible, full;
    double second[2][2], third[2][2]; /* [visible, full][direction] */
} cell_sums;

typedef struct cell {
    double corner[4][3]; /* of a triangle the last two are equal */
    cell_sums sums;
    unsigned bits; /* of the pair's occluders: those that may block its light */
    bool hidden;   /* one of them blocks all of it */
    bool doubtful; /* all points see all, which is not proven of the whole cell */
    double unseen; /* of a nearly dark cell: about the light that passes beside its points */
    int turn;      /* the direction along which that changes */
} cell;

/* normal . x = level: F is not smooth across its line in the plane of the cells. */
typedef struct break_line {
    double normal[3], level;
} break_line;

typedef struct cells {
    const projection *p;
    const polygon *over, *to; /* over: the cells are parts of it */
    const pair_occluders *among;
    shadow_cut cut;
    double node[2][NODES], weight[2][NODES]; /* by direction */
    double second[NODES], third[NODES];      /* w 5 P_2, w 7 P_3 at the nodes of the rule */
    int n, n_lines;                          /* n_lines: negative before they are found */
    double full;                             /* of the pair; 0: that of the cells */
    bool failed;
    int work;
    cell of[CELLS_MOST];
    break_line lines[LINES_MOST];
} cells;

/* Gauss nodes moved by u -> u + c u (1 - u) with c from the seed and the pair, which keeps cubics exact. Two
 * seeds then miss the breaks of F at different places. */
static void set_nodes(cells *c, const projected_pair *pair) {
    static const double most = .5;
    const gauss_rule *g = &c->p->rules->gauss[RULE];
    for (int k = 0; k < NODES; k++) {
        const double t = 2 * g->node[k] - 1;
        c->second[k] = 5 * .5 * (3 * t * t - 1);
        c->third[k] = 7 * .5 * (5 * t * t * t - 3 * t);
    }
    for (uint64_t d = 0; d < 2; d++) {
        const uint64_t key = random_hash(c->p->seed ^ random_hash((uint64_t)pair->i << 32 | pair->j));
        const double bend = most * (2 * random_to_double(random_hash(key + d)) - 1);
        for (int k = 0; k < NODES; k++) {
            const double u = g->node[k];
            c->node[d][k] = u + bend * u * (1 - u);
            c->weight[d][k] = g->weight[k] * (1 + bend * (1 - 2 * u));
        }
    }
}

/* The point of a cell at u, w, and the vector whose length is area there over that of the unit square. */
static inline void point_of_cell(const cell *one, double u, double w, double x[3], double area[3]) {
    const double(*corner)[3] = (const double(*)[3])one->corner;
    double along_u[3], along_w[3];
    for (int d = 0; d < 3; d++) {
        along_u[d] = (1 - w) * (corner[1][d] - corner[0][d]) + w * (corner[2][d] - corner[3][d]);
        along_w[d] = (1 - u) * (corner[3][d] - corner[0][d]) + u * (corner[2][d] - corner[1][d]);
        x[d] = (1 - w) * ((1 - u) * corner[0][d] + u * corner[1][d]) +
               w * ((1 - u) * corner[3][d] + u * corner[2][d]);
    }
    cross3(along_u, along_w, area);
}

/* The light that a gap between occluders sends past the points of a nearly dark cell comes to a strip along a
 * side, or to a corner: from x of the cell, the shadow of a convex body on a convex target is convex, and so
 * are the points of the cell that a point of the target does not see. A convex body, of however many
 * occluders, which hides the target from all four corners therefore hides it from the whole cell; other
 * occluders nearly always do. Where corners see something, F falls from there to 0 before the first row of
 * points, about .07 of the side away. The corners lie a little inside, where F is smooth. */
static void look_at_corners(cells *c, cell *one, double area) {
    static const double inset = .01, strip = .07;
    double value[2][2];
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++) {
            double x[3], across[3];
            point_of_cell(one, i == 0 ? inset : 1 - inset, j == 0 ? inset : 1 - inset, x, across);
            value[i][j] = shadow_cut_factor(&c->cut, one->bits, x, c->over->normal, NULL);
            if (value[i][j] < 0) c->failed = true;
        }
    const double mean = .25 * (value[0][0] + value[0][1] + value[1][0] + value[1][1]);
    one->unseen = fmax(0, strip * area * mean - one->sums.visible);
    one->turn = fabs(value[0][0] + value[1][0] - value[0][1] - value[1][1]) >
                fabs(value[0][0] + value[0][1] - value[1][0] - value[1][1]);
    c->work += 4 * (1 + __builtin_popcount(one->bits));
}

static void sum_cell(cells *c, cell *one) {
    enum { MOSTLY_DARK = NODES * (NODES - 1) }; /* all points but a row */
    static const double nearly_dark = .03;
    cell_sums s = {.visible = 0};
    size_t n_open = 0, n_dark = 0;
    double size = 0;
    for (int i = 0; i < NODES && !c->failed; i++)
        for (int j = 0; j < NODES && !c->failed; j++) {
            const double u = c->node[0][i], w = c->node[1][j];
            double x[3], area[3], value[2];
            point_of_cell(one, u, w, x, area);
            const double weight = dot3(area, c->over->normal) * c->weight[0][i] * c->weight[1][j];
            value[0] = shadow_cut_factor(&c->cut, one->bits, x, c->over->normal, &value[1]);
            if (one->hidden) value[0] = 0;
            if (value[0] < 0) c->failed = true;
            n_open += value[0] >= value[1];
            n_dark += value[0] <= 0;
            size += weight;
            s.visible += weight * value[0];
            s.full += weight * value[1];
            for (int k = 0; k < 2; k++) {
                s.second[k][0] += weight * c->second[i] * value[k];
                s.second[k][1] += weight * c->second[j] * value[k];
                s.third[k][0] += weight * c->third[i] * value[k];
                s.third[k][1] += weight * c->third[j] * value[k];
            }
        }
    c->work += NODES * NODES * (1 + (one->hidden ? 0 : __builtin_popcount(one->bits)));
    const bool proven = one->bits == 0 || one->hidden;
    one->doubtful = !proven && n_open == NODES * NODES;
    one->sums = s;
    one->unseen = 0;
    if (!proven && !c->failed && n_dark >= MOSTLY_DARK && s.visible <= nearly_dark * s.full)
        look_at_corners(c, one, size);
}

/* About the error of a cell's part of (integral of F V) - V (integral of F) with V the visible share: by its
 * coefficients of P_3 and P_2, which fall fast where F is smooth. A break of F may leave that of P_3 small by
 * chance. direction: the rougher one. The factors are fits: of pairs of a Cornell box (636 elements) nearly
 * all keep the tolerance. Errors of what is unseen all go one way and add up over the pairs of a group, so
 * that they are kept to a fifth of the tolerance. */
static double cell_error(const cell *one, double share, int *direction) {
    static const double of_third = .3, of_second = .06, of_doubt = .002, of_unseen = 5;
    double second[2], third[2];
    for (int d = 0; d < 2; d++) {
        second[d] = fabs(one->sums.second[0][d] - share * one->sums.second[1][d]);
        third[d] = fabs(one->sums.third[0][d] - share * one->sums.third[1][d]);
    }
    *direction = third[1] + .1 * second[1] > third[0] + .1 * second[0];
    if (one->unseen > 0) *direction = one->turn;
    return (one->doubtful ? of_doubt * one->sums.full : 0) + of_unseen * one->unseen +
           of_third * (third[0] + third[1]) + of_second * (second[0] + second[1]);
}

static bool same_point(const double *a, const double *b) {
    return !(a[0] < b[0] || a[0] > b[0] || a[1] < b[1] || a[1] > b[1] || a[2] < b[2] || a[2] > b[2]);
}

/* Finds which occluders matter to a cell. */
static void sift_occluders(const cells *c, cell *one) {
    polygon part = {.n = same_point(one->corner[2], one->corner[3]) ? 3 : 4};
    memcpy(part.corner, one->corner, sizeof one->corner);
    memcpy(part.normal, c->over->normal, sizeof part.normal);
    for (int d = 0; d < 3; d++) {
        for (int k = 0; k < part.n; k++) part.centre[d] += part.corner[k][d];
        part.centre[d] /= part.n;
    }
    one->bits = pair_occluders_of_part(c->p->occluders, c->among, one->bits, &part, c->to, &one->hidden);
}

/* Adds the polygon's corners as cells of three or four; bits: of the occluders that may matter. */
static void add_cells(cells *c, int n, const double (*corner)[3], unsigned bits, bool sift) {
    for (int first = 1; first + 1 < n && c->n < CELLS_MOST; first += 2) {
        cell *one = &c->of[c->n++];
        memcpy(one->corner[0], corner[0], sizeof one->corner[0]);
        memcpy(one->corner[1], corner[first], sizeof one->corner[0]);
        memcpy(one->corner[2], corner[first + 1], sizeof one->corner[0]);
        memcpy(one->corner[3], corner[first + 2 < n ? first + 2 : first + 1], sizeof one->corner[0]);
        one->bits = bits;
        one->hidden = false;
        if (sift && bits != 0) sift_occluders(c, one);
        sum_cell(c, one);
    }
}

static void add_line(cells *c, const double normal[3], const double at[3]) {
    break_line line;
    double low = INFINITY, high = -INFINITY;
    const double length = sqrt(dot3(normal, normal)), level = dot3(normal, at);
    if (c->n_lines == LINES_MOST || !(length > 0)) return;
    for (int k = 0; k < c->over->n; k++) {
        const double place = dot3(normal, c->over->corner[k]) - level;
        low = fmin(low, place);
        high = fmax(high, place);
    }
    const double least = 1e-3 * c->over->radius * length;
    if (low > -least || high < least) return;
    memcpy(line.normal, normal, sizeof line.normal);
    line.level = level;
    c->lines[c->n_lines++] = line;
}

/* The planes of the occluders, and those through an edge of an occluder and a parallel edge of the other
 * element: the shadow's edge reaches that edge all along its length at once. */
static void find_lines(cells *c) {
    c->n_lines = 0;
    for (int k = 0; k < c->among->count; k++) {
        const occluder *o = &c->p->occluders->of[c->among->of[k]];
        add_line(c, o->normal, o->corner[0]);
        for (int e = 0; e < o->n; e++) {
            double along[3];
            subtract3(o->corner[(e + 1) % o->n], o->corner[e], along);
            for (int f = 0; f < c->to->n; f++) {
                double other[3], turned[3], across[3], normal[3];
                subtract3(c->to->corner[(f + 1) % c->to->n], c->to->corner[f], other);
                cross3(along, other, turned);
                if (dot3(turned, turned) > 1e-12 * dot3(along, along) * dot3(other, other)) continue;
                subtract3(o->corner[e], c->to->corner[f], across);
                cross3(along, across, normal);
                add_line(c, normal, o->corner[e]);
            }
        }
    }
}

/* The line that crosses a cell nearest to its middle; NULL: none does. */
static const break_line *line_across(const cells *c, const cell *one) {
    const break_line *best = NULL;
    double most = .02;
    for (int l = 0; l < c->n_lines; l++) {
        double low = INFINITY, high = -INFINITY;
        for (int k = 0; k < 4; k++) {
            const double place = dot3(c->lines[l].normal, one->corner[k]) - c->lines[l].level;
            low = fmin(low, place);
            high = fmax(high, place);
        }
        const double even = fmin(high, -low) / (high - low);
        if (!(even > most)) continue;
        most = even;
        best = &c->lines[l];
    }
    return best;
}

static void split_at_line(cells *c, const cell *one, const break_line *line) {
    double sides[2][8][3];
    int n[2] = {0, 0};
    for (int k = 0; k < 4; k++) {
        const double *from = one->corner[k], *to = one->corner[(k + 1) % 4];
        const double here = dot3(line->normal, from) - line->level,
                     there = dot3(line->normal, to) - line->level;
        if (same_point(from, to)) continue; /* a triangle */
        for (int side = 0; side < 2; side++)
            if (side == 0 ? here >= 0 : here <= 0) memcpy(sides[side][n[side]++], from, sizeof sides[0][0]);
        if ((here > 0 && there < 0) || (here < 0 && there > 0)) {
            const double f = here / (here - there);
            for (int d = 0; d < 3; d++)
                sides[0][n[0]][d] = sides[1][n[1]][d] = from[d] + f * (to[d] - from[d]);
            n[0]++, n[1]++;
        }
    }
    for (int side = 0; side < 2; side++)
        add_cells(c, n[side], (const double(*)[3])sides[side], one->bits, true);
}

static void split_in_middle(cells *c, const cell *one, int direction) {
    double middle[2][3], half[4][3];
    const int a = direction == 0 ? 0 : 1; /* sides a and a + 2 are cut */
    for (int d = 0; d < 3; d++) {
        middle[0][d] = .5 * (one->corner[a][d] + one->corner[a + 1][d]);
        middle[1][d] = .5 * (one->corner[a + 2][d] + one->corner[(a + 3) % 4][d]);
    }
    memcpy(half[0], one->corner[a], sizeof half[0]);
    memcpy(half[1], middle[0], sizeof half[0]);
    memcpy(half[2], middle[1], sizeof half[0]);
    memcpy(half[3], one->corner[(a + 3) % 4], sizeof half[0]);
    add_cells(c, 4, (const double(*)[3])half, one->bits, true);
    memcpy(half[0], middle[0], sizeof half[0]);
    memcpy(half[1], one->corner[a + 1], sizeof half[0]);
    memcpy(half[2], one->corner[a + 2], sizeof half[0]);
    memcpy(half[3], middle[1], sizeof half[0]);
    add_cells(c, 4, (const double(*)[3])half, one->bits, true);
}

/* Cuts all cells of a pair that windows cut. They leave what sees anything of the other element, over which F
 * rises to a plateau: the points of a whole cell lie on the plateau rather than on its slopes and find too
 * much light, and cells' sums do not tell. A square between four lines has 25 parts. */
static void cut_at_lines(cells *c) {
    enum { CUT_MOST = 25 };
    if (c->failed) return;
    find_lines(c);
    for (int k = 0; k < c->n && c->n < CUT_MOST;) {
        const cell one = c->of[k];
        const break_line *line = line_across(c, &one);
        if (line == NULL) {
            k++;
            continue;
        }
        c->of[k] = c->of[--c->n];
        split_at_line(c, &one, line);
    }
}

/* Splits the cell with the largest error until the whole is within the tolerance: the cells' errors are
 * independent. All light to a room may pass one small window, in pairs each of which has less than the
 * tolerance; their errors go one way, as said above. So a pair that windows cut is also found to a share of
 * its light. */
static void refine(cells *c, double tolerance) {
    enum { ADDED_MOST = 4 };
    static const double of_window = .01;
    while (!c->failed && c->n + ADDED_MOST <= CELLS_MOST) {
        double visible = 0, full = 0, square = 0, most = 0;
        int worst = 0, direction = 0;
        for (int k = 0; k < c->n; k++) {
            visible += c->of[k].sums.visible;
            full += c->of[k].sums.full;
        }
        if (!(full > 0)) return;
        const double share = c->full > 0 ? 0 : visible / full;
        for (int k = 0; k < c->n; k++) {
            int rough;
            const double error = cell_error(&c->of[k], share, &rough);
            square += error * error;
            if (error <= most) continue;
            most = error;
            worst = k;
            direction = rough;
        }
        double goal = tolerance * (c->full > 0 ? c->full : full);
        if (c->full > 0 && visible > 0) goal = fmin(goal, of_window * visible);
        if (sqrt(square) <= goal) return;
        if (c->n_lines < 0) find_lines(c);
        const cell one = c->of[worst];
        const break_line *line = line_across(c, &one);
        c->of[worst] = c->of[--c->n];
        if (line != NULL)
            split_at_line(c, &one, line);
        else
            split_in_middle(c, &one, direction);
    }
}

/* True where a is the element to integrate over: the farther the occluders are from it, and the larger the
 * other element, the slower F changes. */
static bool over_first(const projection *p, const projected_pair *pair) {
    double nearer = 0;
    for (int k = 0; k < pair->among->count; k++) {
        const occluder *o = &p->occluders->of[pair->among->of[k]];
        const double a = fabs(dot3(o->normal, pair->a->centre) - o->level);
        const double b = fabs(dot3(o->normal, pair->b->centre) - o->level);
        nearer += (a - b) / (a + b + 1e-300);
    }
    if (pair->among->count > 0) nearer /= pair->among->count;
    return nearer + (pair->b->radius - pair->a->radius) / (pair->b->radius + pair->a->radius) >= 0;
}

/* The share by cells of the first element of the pair, or of the other one. */
static double share_over(const projection *p, const projected_pair *pair, bool first, double tolerance,
                         double *work) {
    double visible = 0, full = 0;
    cells c; /* large: what is not set here is set before its use */
    c.p = p;
    c.over = first ? pair->a : pair->b;
    c.to = first ? pair->b : pair->a;
    c.among = pair->among;
    c.n = 0;
    c.n_lines = -1;
    c.full = pair->full;
    c.failed = false;
    c.work = 0;
    shadow_cut_init(&c.cut, p->occluders, pair->among, c.to);
    set_nodes(&c, pair);
    add_cells(&c, c.over->n, c.over->corner, (1u << pair->among->count) - 1, false);
    if (c.full > 0) cut_at_lines(&c);
    refine(&c, tolerance);
    *work += c.work;
    if (c.failed) return -1;
    for (int k = 0; k < c.n; k++) {
        visible += c.of[k].sums.visible;
        full += c.of[k].sums.full;
    }
    if (c.full > 0) full = c.full;
    return full > 0 ? fmin(fmax(visible / full, 0), 1) : 0;
}

/* True where a corner of one element of the pair sees something of the other one. */
static bool corners_see(const projection *p, const projected_pair *pair, bool first, double *work) {
    static const double inset = .01;
    const polygon *from = first ? pair->a : pair->b, *to = first ? pair->b : pair->a;
    shadow_cut cut;
    bool any = false;
    shadow_cut_init(&cut, p->occluders, pair->among, to);
    for (int k = 0; k < from->n && !any; k++) {
        double x[3];
        for (int d = 0; d < 3; d++)
            x[d] = from->corner[k][d] + inset * (from->centre[d] - from->corner[k][d]);
        any = shadow_cut_factor(&cut, ~0u, x, from->normal, NULL) > 0;
        *work += 1 + pair->among->count;
    }
    return any;
}

/* Light past the side of one element may come to a narrow strip in the middle of the other one, between its
 * points. Of two half planes with edges parallel to each other and to sides of both elements, light in a gap
 * meets a corner of either. */
double projection_share(const projection *p, const projected_pair *pair, double tolerance, double *work) {
    const bool first = over_first(p, pair);
    const double found = share_over(p, pair, first, tolerance, work);
    return !(found > 0) && found >= 0 && corners_see(p, pair, !first, work)
               ? share_over(p, pair, !first, tolerance, work)
               : found;
}

double projection_point_factor(const projection *p, const projected_pair *pair, const double x[3],
                               const double n[3], double *full) {
    shadow_cut cut;
    shadow_cut_init(&cut, p->occluders, pair->among, pair->b);
    return shadow_cut_factor(&cut, ~0u, x, n, full);
}
