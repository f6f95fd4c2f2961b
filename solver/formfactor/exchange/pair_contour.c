#include "solver/formfactor/exchange/pair_contour.h"

#include "solver/base/vector3.h"

#include <math.h>
#include <stdbool.h>

static const double pi = 3.14159265358979323846;

/* The origin on lines that cross at phi is known to 1e-16 / sin^2 phi. Narrower ones are left to quadrature.
 */
static const double sine2_least = 1e-6;
/* The rest of two edges may err by this share of what the tolerance leaves it, by a bound that is hundreds of
 * times too large. The kernel between the centres, of which the tolerance is taken, may be several times the
 * mean kernel; and a factor is no larger than 1. */
static const double share_of_rest = .5, factor_most = .2;
/* No error below this share of the smaller area is asked for. */
static const double least_error = 1e-12;
/* Intervals are halved up to this depth for the rest of two edges. */
enum { DEPTH_MOST = 12 };

typedef struct edge {
    double from[3], along[3]; /* along: unit */
    double length;
} edge;

/* Two polygons, the edges of each, and what several pairs of edges need: ln r^2 of two corners, and the
 * integral P of ln r^2 from a corner of either over an edge of the other; NAN: not known yet. */
typedef struct contour {
    const pair_factor_rules *rules;
    int n[2];
    edge of[2][POLYGON_CORNERS];
    double logarithm[POLYGON_CORNERS][POLYGON_CORNERS]; /* [corner of a][corner of b] */
    double P[2][POLYGON_CORNERS][POLYGON_CORNERS];      /* [whose corner][corner][edge] */
    double error;                                       /* that the rest of two edges may have */
} contour;

/* K'' = ln(x^2 + h^2):  K = (x^2 - h^2)/2 ln(x^2 + h^2) + 2 h x atan(x/h) - 3/2 x^2 */
static double twice_integrated(double x, double h) {
    const double r2 = x * x + h * h;
    if (r2 == 0) return 0;
    return .5 * (x * x - h * h) * log(r2) + (h > 0 ? 2 * h * x * atan(x / h) : 0) - 1.5 * x * x;
}

/* Double integral of ln r^2 over two parallel edges: with x the distance along them, second differences of K.
 */
static double parallel_edges(const edge *one, const edge *two, double cosine) {
    double v[3];
    subtract3(one->from, two->from, v);
    double x = dot3(v, two->along);
    for (int d = 0; d < 3; d++) v[d] -= x * two->along[d];
    const double h = sqrt(dot3(v, v));
    if (cosine < 0) x -= one->length;
    return twice_integrated(x + one->length, h) - twice_integrated(x, h) -
           twice_integrated(x + one->length - two->length, h) + twice_integrated(x - two->length, h);
}

/* The angle that an edge of a length subtends from a point that is `away` from its line and whose foot lies
 * `before` behind its begin. */
static double subtended(double before, double length, double away) {
    return atan2(away * length, away * away - before * (length - before));
}

/* Integral of ln r^2 over edge two from the point at s on edge one: with x along edge two and h the distance
 * from its line, x ln(x^2 + h^2) - 2 x + 2 h atan(x/h) between the ends. The two atan make the angle that the
 * edge subtends. */
static double point_to_edge(const edge *one, const edge *two, double s) {
    double v[3];
    for (int d = 0; d < 3; d++) v[d] = one->from[d] + s * one->along[d] - two->from[d];
    const double a = dot3(v, two->along), b = two->length - a;
    for (int d = 0; d < 3; d++) v[d] -= a * two->along[d];
    const double h2 = dot3(v, v), h = sqrt(h2), from2 = a * a + h2, to2 = b * b + h2;
    return (to2 > 0 ? b * log(to2) : 0) + (from2 > 0 ? a * log(from2) : 0) - 2 * two->length +
           2 * h * subtended(a, two->length, h);
}

/* The places on edge one, in (0, length), where the integrand may be steep: the points nearest to the line of
 * edge two and to its two ends. */
static int steep_places(const edge *one, const edge *two, double cosine, double places[3]) {
    double v[3], candidates[3];
    subtract3(two->from, one->from, v);
    const double to_start = dot3(v, one->along), along_two = dot3(v, two->along);
    candidates[0] = to_start;
    candidates[1] = to_start + cosine * two->length;
    const double sine2 = 1 - cosine * cosine;
    candidates[2] = sine2 > 0 ? (to_start - cosine * along_two) / sine2 : 0;
    int n = 0;
    for (int c = 0; c < 3; c++) {
        const double s = candidates[c], least = 1e-12 * one->length;
        if (!(s > least && s < one->length - least)) continue;
        int at = n++;
        for (; at > 0 && places[at - 1] > s; at--) places[at] = places[at - 1];
        places[at] = s;
    }
    return n;
}

static double distance_to_edge(const double point[3], const edge *e) {
    double v[3];
    subtract3(point, e->from, v);
    const double s = fmin(fmax(dot3(v, e->along), 0), e->length);
    for (int d = 0; d < 3; d++) v[d] -= s * e->along[d];
    return sqrt(dot3(v, v));
}

/* Lines that are nearly parallel: quadrature over edge one, the shorter, of the closed form over edge two. */
static double narrow_edges(const pair_factor_rules *rules, const edge *one, const edge *two, double cosine) {
    double places[3], ends[5] = {0};
    const int n_places = steep_places(one, two, cosine, places);
    /* The distance of the edges is attained at one of those places or at an end. */
    double nearest = INFINITY;
    for (int p = -1; p <= n_places; p++) {
        const double s = p < 0 ? 0 : p == n_places ? one->length : places[p];
        double point[3];
        for (int d = 0; d < 3; d++) point[d] = one->from[d] + s * one->along[d];
        nearest = fmin(nearest, distance_to_edge(point, two));
    }
    double sum = 0;
    /* A singularity at distance delta of the unit interval leaves n Gauss nodes an error of
     * (2 delta + sqrt(1 + 4 delta^2))^-2n: below 1e-9 for these. */
    const double delta = nearest / one->length;
    const gauss_rule *gauss = delta > 1 ? &rules->gauss[5] : delta > .4 ? &rules->gauss[7] : &rules->gauss[8];
    if (delta > .25) {
        for (int k = 0; k < gauss->n; k++)
            sum += gauss->weight[k] * point_to_edge(one, two, gauss->node[k] * one->length);
        return sum * one->length;
    }
    for (int p = 0; p < n_places; p++) ends[p + 1] = places[p];
    ends[n_places + 1] = one->length;
    for (int piece = 0; piece <= n_places; piece++) {
        const double length = ends[piece + 1] - ends[piece];
        double part = 0;
        for (int k = 0; k < STEEP_NODES; k++)
            part +=
                rules->steep_weight[k] * point_to_edge(one, two, ends[piece] + rules->steep_node[k] * length);
        sum += part * length;
    }
    return sum;
}

static double logarithm_of(contour *c, int i, int j) {
    double *out = &c->logarithm[i][j];
    if (isnan(*out)) {
        double v[3];
        subtract3(c->of[0][i].from, c->of[1][j].from, v);
        const double r2 = dot3(v, v);
        *out = r2 > 0 ? log(r2) : 0; /* it is multiplied by 0 */
    }
    return *out;
}

/* The integral of ln r^2 over edge j of the other polygon from corner i of one: with x along the edge and h
 * the distance from its line, x ln(x^2 + h^2) - 2 x + 2 h atan(x/h) between the ends. */
static double from_corner(contour *c, int side, int i, int j) {
    double *out = &c->P[side][i][j];
    if (!isnan(*out)) return *out;
    const edge *e = &c->of[1 - side][j];
    const int next = (j + 1) % c->n[1 - side];
    const double to_begin = side == 0 ? logarithm_of(c, i, j) : logarithm_of(c, j, i);
    const double to_end = side == 0 ? logarithm_of(c, i, next) : logarithm_of(c, next, i);
    double v[3];
    subtract3(c->of[side][i].from, e->from, v);
    const double a = dot3(v, e->along);
    for (int d = 0; d < 3; d++) v[d] -= a * e->along[d];
    const double h = sqrt(dot3(v, v));
    *out = (e->length - a) * to_end + a * to_begin - 2 * e->length + 2 * h * subtended(a, e->length, h);
    return *out;
}

/* Two edges from the nearest points of their lines, s and t those of their begins and ends. */
typedef struct crossing {
    double cosine, sine, h;
    double s[2], t[2];
} crossing;

/* theta(u): the angle of the edge [t0, t1] from the point at s = (h / sine) sinh u, which is h cosh u away
 * from its line. */
static double theta(const crossing *x, double u) {
    const double e = exp(u), over = 1 / e;
    const double foot = x->cosine * x->h / x->sine * .5 * (e - over), away = x->h * .5 * (e + over);
    return subtended(foot - x->t[0], x->t[1] - x->t[0], away);
}

/* n Gauss nodes on [u0, u1] leave an error of about pi (u1 - u0) rho^-2n, rho the sum of the half axes of the
 * ellipse through the nearest singularity with the foci u0 and u1, as shares of the half distance of these.
 * Where t = (h / sine) sinh v is the end of the other edge, singularities are v + i phi, as sinh of it is
 * where the line meets that end, and -v + i (pi - phi). */
static double ellipse(double u0, double u1, const double v[2], double phi) {
    const double middle = .5 * (u0 + u1), half = .5 * (u1 - u0);
    double least = INFINITY;
    for (int k = 0; k < 4; k++) {
        const double re = ((k < 2 ? v[k] : -v[k - 2]) - middle) / half, im = (k < 2 ? phi : pi - phi) / half;
        const double sum = sqrt((re - 1) * (re - 1) + im * im) + sqrt((re + 1) * (re + 1) + im * im);
        least = fmin(least, sum);
    }
    const double axis = fmax(.5 * least, 1);
    return axis + sqrt(axis * axis - 1);
}

/* The integral of theta from u0 to u1 to an error; depth: of this interval among those that were halved. */
static double integrate_theta(const pair_factor_rules *rules, const crossing *x, double u0, double u1,
                              const double v[2], double phi, double error, int depth) {
    const double bound = pi * (u1 - u0);
    double sum = 0;
    if (!(bound > error)) return 0;
    const double rho = ellipse(u0, u1, v, phi), needed = .5 * log(bound / error) / log(rho);
    int r = 0;
    while (r < GAUSS_RULES && rules->gauss[r].n < needed) r++;
    if (r == GAUSS_RULES && depth < DEPTH_MOST) {
        const double middle = .5 * (u0 + u1);
        return integrate_theta(rules, x, u0, middle, v, phi, .5 * error, depth + 1) +
               integrate_theta(rules, x, middle, u1, v, phi, .5 * error, depth + 1);
    }
    const gauss_rule *g = &rules->gauss[r < GAUSS_RULES ? r : GAUSS_RULES - 1];
    for (int k = 0; k < g->n; k++) sum += g->weight[k] * theta(x, u0 + g->node[k] * (u1 - u0));
    return sum * (u1 - u0);
}

/* h^2 integral integral 1/r^2 */
static double rest_of_edges(const contour *c, const crossing *x) {
    const double factor = x->h * x->h / x->sine, scale = x->sine / x->h;
    /* The angle is at most pi, and asinh of what is below 1e12 at most 29. */
    if (!(2 * 29 * pi * factor > c->error)) return 0;
    const double v[2] = {asinh(scale * x->t[0]), asinh(scale * x->t[1])};
    return factor * integrate_theta(c->rules, x, asinh(scale * x->s[0]), asinh(scale * x->s[1]), v,
                                    atan2(x->sine, x->cosine), c->error / factor, 0);
}

static double crossing_edges(contour *c, int i, int j, double cosine, const double across[3], double sine2) {
    const edge *one = &c->of[0][i], *two = &c->of[1][j];
    double v[3];
    subtract3(one->from, two->from, v);
    const double along_one = dot3(v, one->along), along_two = dot3(v, two->along);
    crossing x = {.cosine = cosine, .sine = sqrt(sine2)};
    x.h = fabs(dot3(v, across)) / x.sine;
    x.s[0] = (along_one - cosine * along_two) / sine2;
    x.t[0] = (cosine * along_one - along_two) / sine2;
    x.s[1] = x.s[0] + one->length;
    x.t[1] = x.t[0] + two->length;
    const int next_i = (i + 1) % c->n[0], next_j = (j + 1) % c->n[1];
    const double ends = x.s[1] * from_corner(c, 0, next_i, j) - x.s[0] * from_corner(c, 0, i, j) +
                        x.t[1] * from_corner(c, 1, next_j, i) - x.t[0] * from_corner(c, 1, j, i);
    return .5 * ends - one->length * two->length + rest_of_edges(c, &x);
}

/* Double integral of ln r^2. The closed form for parallel edges loses the ratio of their lengths to rounding.
 */
static double two_edges(contour *c, int i, int j, double cosine) {
    const edge *a = &c->of[0][i], *b = &c->of[1][j];
    const edge *one = a->length <= b->length ? a : b, *two = one == a ? b : a;
    double across[3];
    cross3(a->along, b->along, across);
    const double sine2 = dot3(across, across);
    if (sine2 > sine2_least) return crossing_edges(c, i, j, cosine, across, sine2);
    if (sine2 < 1e-24 && one->length > .01 * two->length) return parallel_edges(one, two, cosine);
    return narrow_edges(c->rules, one, two, cosine);
}

/* The edges of a polygon about an origin in another unit of length. Returns their number, less those without
 * length. */
static int set_edges(const polygon *p, const double origin[3], double scale, edge *edges) {
    int n = 0;
    for (int k = 0; k < p->n; k++) {
        const double *from = p->corner[k], *to = p->corner[(k + 1) % p->n];
        edge *e = &edges[n];
        for (int d = 0; d < 3; d++) {
            e->from[d] = scale * (from[d] - origin[d]);
            e->along[d] = scale * (to[d] - from[d]);
        }
        e->length = sqrt(dot3(e->along, e->along));
        if (!(e->length > 0)) continue;
        for (int d = 0; d < 3; d++) e->along[d] /= e->length;
        n++;
    }
    return n;
}

/* The error that A F may have, in a unit of length, from the kernel between the centres. */
static double error_allowed(const polygon *a, const polygon *b, double scale, double tolerance) {
    double r[3];
    subtract3(b->centre, a->centre, r);
    const double r2 = dot3(r, r), cosines = dot3(r, a->normal) * -dot3(r, b->normal) / r2;
    const double of_a = polygon_area(a), of_b = polygon_area(b);
    const double least = fmin(of_a, of_b),
                 exchange = fmin(cosines * of_a * of_b / (pi * r2), factor_most * least);
    return scale * scale * fmax(tolerance * exchange, least_error * least);
}

double pair_contour(const pair_factor_rules *rules, const polygon *a, const polygon *b, double distance,
                    double tolerance) {
    /* The edges of each polygon sum to 0, so that any unit of length gives the same; the one chosen keeps the
     * logarithms small. */
    const double scale = 1 / fmax(distance, a->radius + b->radius);
    contour c = {.rules = rules};
    c.n[0] = set_edges(a, a->centre, scale, c.of[0]);
    c.n[1] = set_edges(b, a->centre, scale, c.of[1]);
    c.error = 4 * pi * share_of_rest * error_allowed(a, b, scale, tolerance) / (c.n[0] * c.n[1]);
    for (int i = 0; i < POLYGON_CORNERS; i++)
        for (int j = 0; j < POLYGON_CORNERS; j++) c.logarithm[i][j] = c.P[0][i][j] = c.P[1][i][j] = NAN;
    double sum = 0;
    for (int i = 0; i < c.n[0]; i++)
        for (int j = 0; j < c.n[1]; j++) {
            const double cosine = dot3(c.of[0][i].along, c.of[1][j].along);
            if (fabs(cosine) < 1e-15) continue;
            sum += cosine * two_edges(&c, i, j, cosine);
        }
    return fmax(sum / (4 * pi * scale * scale), 0);
}
