/* The visible share of a pair is sum K V / sum K over segments, K = cos cos' / r^2 times the areas that both
 * ends stand for, or over lines where few occluders stand between. segments_of_pair() chooses N by the error
 * SEGMENTS_ERROR N^-SEGMENTS_POWER, and visible_exchange() halves pieces over which K varies much. */
#include "solver/formfactor/sight/occlusion.h"

#include "solver/base/random.h"
#include "solver/formfactor/exchange/affine_segments.h"
#include "solver/formfactor/sight/visible_lines.h"
#include "solver/formfactor/visibility/pane_path.h"
#include "solver/formfactor/visibility/sample.h"

#include <math.h>
#include <string.h>

enum { SEGMENTS_MOST = 1 << 22 };

/* Segments of an occlusion test: a packet for each .001 of the factor, from one packet to MOST segments. */
static size_t first_segments(double F) {
    enum { MOST = 256 };
    const double packets = ceil(fmin(F / 1e-3, MOST / VISIBILITY_PACKET));
    return packets > 1 ? (size_t)packets * VISIBILITY_PACKET : VISIBILITY_PACKET;
}

/* The larger of F_ij and F_ji. */
static double factor_of(const occlusion *o, uint32_t i, uint32_t j, double g) {
    return g / fmin(o->area[i], o->area[j]);
}

/* N with SEGMENTS_ERROR F N^-SEGMENTS_POWER = accuracy. */
static double segments_for(double F, double accuracy) {
    return pow(SEGMENTS_ERROR * F / accuracy, 1 / SEGMENTS_POWER);
}

/* Factors F0 of occlusion_estimate, and from which on the visible part of one counts. */
static const double middle_factor = .005, large_factor = .1;

/* N of a pair of which `visible` is seen, the share of F: see occlusion_estimate. */
static double segments_of_pair(const occlusion *o, uint32_t i, uint32_t j, double F, double visible) {
    const double at_middle = segments_for(middle_factor, o->accuracy), part = F / large_factor;
    const double at_large = at_middle * pow(large_factor / middle_factor, 1 / SEGMENTS_POWER);
    const double ratio = fmin(o->area[i], o->area[j]) / fmax(o->area[i], o->area[j]);
    const double shared = at_middle * F / middle_factor * sqrt(sqrt(sqrt(ratio)));
    const double certain =
        part > 1 ? segments_for(F, o->accuracy * fmax(1, part * visible)) : at_large * part * part;
    const double wanted = fmin(fmax(shared, certain), SEGMENTS_MOST);
    const size_t segments = (size_t)ceil(wanted / VISIBILITY_PACKET) * VISIBILITY_PACKET;
    return (double)(segments > o->segments ? segments : o->segments);
}

double occlusion_segments(const occlusion *o, uint32_t i, uint32_t j, double g) {
    return segments_of_pair(o, i, j, factor_of(o, i, j, g), .5);
}

/* A packet of segments between points of two elements, and the kernel of each: K = cos cos' / r^2 times the
 * areas that the two points stand for. */
typedef struct segment_bundle {
    ray_packet segments;
    uint32_t from[VISIBILITY_PACKET], to[VISIBILITY_PACKET];
    double kernel[VISIBILITY_PACKET];
} segment_bundle;

/* Sets lane k to the segment from the point (x[0], x[1]) of a, the polygon of i or a piece of it, to the
 * point (x[2], x[3]) of b. */
static void segment_set(segment_bundle *s, const occlusion *o, int k, uint32_t i, const polygon *a,
                        uint32_t j, const polygon *b, const double x[4]) {
    double points[2][3], r2 = 0, leaving = 0, arriving = 0;
    float origin[3], end[3];
    const double area = polygon_point(a, x[0], x[1], points[0]) * polygon_point(b, x[2], x[3], points[1]);
    visibility_recentre(o->v, points[0], origin);
    visibility_recentre(o->v, points[1], end);
    for (int d = 0; d < 3; d++) {
        const double r = points[1][d] - points[0][d];
        r2 += r * r;
        leaving += r * a->normal[d];
        arriving -= r * b->normal[d];
        s->segments.origin[d][k] = origin[d];
        s->segments.direction[d][k] = end[d] - origin[d];
    }
    s->kernel[k] = leaving > 0 && arriving > 0 ? area * leaving * arriving / (r2 * r2) : 0;
    s->from[k] = i;
    s->to[k] = j;
}

/* Two elements, or pieces of them, and the sequence of points on them. */
typedef struct piece_pair {
    uint32_t i, j;
    const polygon *a, *b;
    segment_list *among; /* see occlusion_estimate */
    segment_list panes;  /* of occlusion_share, beside those that block */
    bool lifts;          /* both ends, above the planes of the elements */
    affine_pair maps;
    pair_sampler sampler;
} piece_pair;

static piece_pair piece_pair_of(uint64_t seed, segment_list *among, uint32_t i, const polygon *a, uint32_t j,
                                const polygon *b) {
    piece_pair two = {.i = i, .j = j, .a = a, .b = b, .among = among};
    two.maps = (affine_pair){affine_map_of(a), affine_map_of(b)};
    pair_sampler_init(&two.sampler, seed, i, j);
    return two;
}

/* Sets segments first ... first+7 and their kernels; returns which lie in front of both pieces. */
static unsigned segments_of(const occlusion *o, const piece_pair *two, size_t first, ray_packet *s,
                            double kernel[VISIBILITY_PACKET]) {
    double x[4][VISIBILITY_PACKET];
    pair_sampler_packet(&two->sampler, (uint32_t)first, x);
    return affine_segments(&two->maps, x, visibility_centre(o->v), s->origin, s->direction, kernel);
}

/* As visibility_blocked does, so that no occluder in the plane of either piece blocks a segment. */
static void lift(const occlusion *o, const piece_pair *two, ray_packet *s) {
    const double height = 2 * visibility_rounding(o->v), begin = height + visibility_rise(o->v, two->i),
                 end = height + visibility_rise(o->v, two->j);
    for (int d = 0; d < 3; d++) {
        const float from = (float)(begin * two->a->normal[d]), to = (float)(end * two->b->normal[d]);
        for (int k = 0; k < VISIBILITY_PACKET; k++) {
            s->origin[d][k] += from;
            s->direction[d][k] += to - from;
        }
    }
}

/* The segments of some packets that were cast. Those behind either piece have the kernel 0 and no bit. */
typedef struct cast_segments {
    double kernel[SEGMENT_PACKETS][VISIBILITY_PACKET];
    unsigned facing[SEGMENT_PACKETS], blocked[SEGMENT_PACKETS];
} cast_segments;

/* The part of each segment that panes pass, and the bits of those that cross any. */
typedef struct passed_segments {
    double passed[SEGMENT_PACKETS][VISIBILITY_PACKET];
    unsigned crossing[SEGMENT_PACKETS];
} passed_segments;

/* The listed panes that segments of a packet cross. */
static void pass_listed(const occlusion *o, const piece_pair *two, const ray_packet *s, unsigned blocked,
                        double passed[VISIBILITY_PACKET], unsigned *crossing) {
    for (int c = 0; c < two->panes.count; c++) {
        segment_list one = {.count = 1, .of = &two->panes.of[c]};
        unsigned crosses = 0;
        segment_occluders_block(o->occluders, &one, s, 1, &crosses);
        crosses &= ~blocked;
        *crossing |= crosses;
        for (size_t k = 0; k < VISIBILITY_PACKET; k++)
            if (crosses >> k & 1) passed[k] *= pane_path_passes(o->glass, o->occluders[*one.of].pane, s, k);
    }
}

/* The part that is left behind panes of segments that were cast. */
static void pass_panes(const occlusion *o, const piece_pair *two, const ray_packet *s, int packets,
                       const cast_segments *cast, passed_segments *out) {
    uint32_t from[VISIBILITY_PACKET], to[VISIBILITY_PACKET];
    for (int k = 0; k < VISIBILITY_PACKET; k++) {
        from[k] = two->i;
        to[k] = two->j;
    }
    for (int p = 0; p < packets; p++) {
        out->crossing[p] = 0;
        if (two->among == NULL) {
            pane_path_between(o->v, o->glass, &s[p], VISIBILITY_PACKET, from, to, cast->blocked[p],
                              out->passed[p]);
            out->crossing[p] = cast->blocked[p];
            continue;
        }
        for (int k = 0; k < VISIBILITY_PACKET; k++) out->passed[p][k] = cast->blocked[p] >> k & 1 ? 0 : 1;
        pass_listed(o, two, &s[p], cast->blocked[p], out->passed[p], &out->crossing[p]);
    }
}

/* Casts as many packets, from segment `first` on; panes, unless NULL, gets what they pass. */
static void cast(const occlusion *o, const piece_pair *two, size_t first, int packets, cast_segments *out,
                 passed_segments *panes) {
    ray_packet s[SEGMENT_PACKETS];
    for (int p = 0; p < packets; p++) {
        out->facing[p] = segments_of(o, two, first + (size_t)p * VISIBILITY_PACKET, &s[p], out->kernel[p]);
        out->blocked[p] = ~out->facing[p];
        if (two->lifts) lift(o, two, &s[p]);
    }
    if (two->among != NULL) {
        segment_occluders_block(o->occluders, two->among, s, packets, out->blocked);
        if (panes != NULL) pass_panes(o, two, s, packets, out, panes);
        return;
    }
    uint32_t from[VISIBILITY_PACKET], to[VISIBILITY_PACKET];
    for (int k = 0; k < VISIBILITY_PACKET; k++) {
        from[k] = two->i;
        to[k] = two->j;
    }
    for (int p = 0; p < packets; p++)
        out->blocked[p] = visibility_blocked(o->v, &s[p], VISIBILITY_PACKET, from, to);
    if (panes != NULL) pass_panes(o, two, s, packets, out, panes);
}

bool occlusion_test_suffices(const occlusion *o, uint32_t i, uint32_t j, double g) {
    return segments_for(factor_of(o, i, j, g), o->accuracy) <= VISIBILITY_PACKET;
}

occlusion_verdict occlusion_test(const occlusion *o, segment_list *among, uint32_t i, uint32_t j, double g,
                                 double *seen) {
    const size_t segments = first_segments(factor_of(o, i, j, g));
    double part = 0, all = 0;
    bool any_open = false, any_blocked = false;
    piece_pair two = piece_pair_of(o->seed, among, i, &o->polygons[i], j, &o->polygons[j]);
    two.lifts = among != NULL;
    for (size_t first = 0; first < segments && !(any_open && any_blocked); first += VISIBILITY_PACKET) {
        cast_segments s;
        cast(o, &two, first, 1, &s, NULL);
        any_open = any_open || (s.facing[0] & ~s.blocked[0]) != 0;
        any_blocked = any_blocked || (s.facing[0] & s.blocked[0]) != 0;
        for (int k = 0; k < VISIBILITY_PACKET; k++) {
            all += s.kernel[0][k];
            if ((s.blocked[0] >> k & 1) == 0) part += s.kernel[0][k];
        }
    }
    *seen = all > 0 ? g * part / all : g;
    if (any_open == any_blocked) return OCCLUSION_PARTIAL;
    return any_open ? OCCLUSION_NONE : OCCLUSION_TOTAL;
}

/* The visible share of two pieces: sum K V / sum K. Segments behind either piece do not count: where few are
 * in front, more are cast. through, unless NULL: V is what panes pass, and *through is set to the part of the
 * share that comes through them. */
static double visible_share(const occlusion *o, const piece_pair *two, size_t n_segments, double *through) {
    enum { TIMES_MOST = 32 };
    double seen = 0, all = 0, crossing = 0;
    size_t facing = 0;
    for (size_t first = 0; facing < n_segments && first < TIMES_MOST * n_segments;) {
        cast_segments s;
        passed_segments panes;
        const size_t wanted = (n_segments - facing + VISIBILITY_PACKET - 1) / VISIBILITY_PACKET;
        const int packets = wanted < SEGMENT_PACKETS ? (int)wanted : SEGMENT_PACKETS;
        cast(o, two, first, packets, &s, through != NULL ? &panes : NULL);
        for (int p = 0; p < packets; p++) {
            facing += (size_t)__builtin_popcount(s.facing[p]);
            for (int k = 0; k < VISIBILITY_PACKET; k++) {
                all += s.kernel[p][k];
                if (through == NULL) {
                    if ((s.blocked[p] >> k & 1) == 0) seen += s.kernel[p][k];
                    continue;
                }
                const double part = s.kernel[p][k] * panes.passed[p][k];
                seen += part;
                if (panes.crossing[p] >> k & 1) crossing += part;
            }
        }
        first += (size_t)packets * VISIBILITY_PACKET;
    }
    if (through != NULL) *through = all > 0 ? crossing / all : 0;
    return all > 0 ? seen / all : 1;
}

/* Moves the panes of a list behind what blocks, into a list of their own. */
static void part_panes(const occlusion *o, piece_pair *two) {
    segment_list *const among = two->among;
    int opaque = 0;
    if (o->glass == NULL || among == NULL) return;
    for (int c = 0; c < among->count; c++) {
        const uint32_t at = among->of[c];
        if (o->occluders[at].pane != MESH_NO_VERTEX) continue;
        among->of[c] = among->of[opaque];
        among->of[opaque++] = at;
    }
    two->panes = (segment_list){.count = among->count - opaque, .of = among->of + opaque};
    among->count = opaque;
}

/* N of a law error = constant N^-power, in packets of so many. */
static size_t number_for(double error, double constant, double power, size_t packet, size_t most) {
    const float wanted = powf((float)(constant / error), (float)(1 / power));
    return wanted < (float)most ? (size_t)ceilf(wanted / (float)packet) * packet : most;
}

/* A line takes the time of three segments, and to choose lines that of ten lines. Where more than a few
 * occluders are listed, shares of more error are found sooner by segments: patio and atrium (1,508 and 2,030
 * elements) took 10 to 30 % more time for no less error of single elements. */
static const double lines_from = .03;
enum { FEW_OCCLUDERS = 8 };

static bool has_lines(const occlusion *o, const piece_pair *two, double error, line_pair *out) {
    const segment_list *among = two->among;
    if (among == NULL || (among->count > FEW_OCCLUDERS && error > lines_from)) return false;
    return line_pair_choose(o->occluders, among, &two->maps.from, &two->maps.to, visibility_centre(o->v),
                            out);
}

double occlusion_share(const occlusion *o, segment_list *among, uint32_t i, const polygon *a, uint32_t j,
                       const polygon *b, share_effort *effort) {
    enum { SEGMENTS_LAST = 1024, LINES_LAST = 512, SEGMENTS_EACH = SEGMENT_PACKETS * VISIBILITY_PACKET };
    piece_pair two = piece_pair_of(o->seed, among, i, a, j, b);
    line_sums sums = {0, 0};
    line_pair lines;
    const size_t segments =
        number_for(effort->error, SEGMENTS_ERROR, SEGMENTS_POWER, SEGMENTS_EACH, SEGMENTS_LAST);
    effort->segments = effort->lines = effort->replaced = 0;
    effort->through = 0;
    part_panes(o, &two);
    if (two.panes.count > 0 || (o->glass != NULL && among == NULL)) {
        effort->segments = segments;
        return visible_share(o, &two, segments, &effort->through);
    }
    if (!has_lines(o, &two, effort->error, &lines)) {
        effort->segments = segments;
        return visible_share(o, &two, segments, NULL);
    }
    effort->replaced = segments;
    effort->lines = number_for(effort->error, LINES_ERROR, LINES_POWER, VISIBLE_LINES, LINES_LAST);
    for (size_t first = 0; first < effort->lines; first += VISIBLE_LINES) {
        double x[4][VISIBLE_LINES];
        pair_sampler_packet(&two.sampler, (uint32_t)first, x);
        visible_lines_add(o->occluders, among, &lines, visibility_centre(o->v),
                          (const double(*)[VISIBLE_LINES])x, &sums);
    }
    return sums.all > 0 ? sums.seen / sums.all : 1;
}

/* A pair that is estimated piece by piece. */
typedef struct segment_budget {
    uint32_t i, j;
    segment_list *among;      /* see occlusion_estimate */
    double segments_per_area; /* segments for each m^2 of exchange area: pieces share the pair's segments */
} segment_budget;

/* Effective sample size over sample size, (sum K)^2 / (N sum K^2): 1 where the kernel is constant. */
static double effective_share(const occlusion *o, const piece_pair *two) {
    enum { SEGMENTS = 64 };
    double sum = 0, sum2 = 0;
    for (size_t first = 0; first < SEGMENTS; first += VISIBILITY_PACKET) {
        ray_packet s;
        double kernel[VISIBILITY_PACKET];
        segments_of(o, two, first, &s, kernel);
        for (int k = 0; k < VISIBILITY_PACKET; k++) {
            sum += kernel[k];
            sum2 += kernel[k] * kernel[k];
        }
    }
    return sum2 > 0 ? sum * sum / (SEGMENTS * sum2) : 0;
}

/* True where the kernel varies little over two pieces. Pieces that nearly touch are excluded by their
 * distance: their kernel is so steep that a few segments may miss the peak. */
static bool kernel_is_even(const occlusion *o, const piece_pair *two) {
    const double enough = .4, size = two->a->radius + two->b->radius;
    double apart2 = 0;
    for (int d = 0; d < 3; d++) {
        const double r = two->a->centre[d] - two->b->centre[d];
        apart2 += r * r;
    }
    return apart2 > .5 * size * size && effective_share(o, two) > enough;
}

/* The visible exchange area of two pieces, g sum K V / sum K. Where the kernel varies too much the larger
 * piece is halved first, at most MOST_SPLITS times and only while the pieces' share of the segments is more
 * than a packet. path makes the samples of different pieces independent. */
static double visible_exchange(const occlusion *o, const segment_budget *pair, const polygon *a,
                               const polygon *b, int splits, uint64_t path) {
    enum { MOST_SPLITS = 14 };
    const double g = pair_factor_exchange(o->rules, a, b, o->tolerance);
    if (g <= 0) return 0;
    const piece_pair two = piece_pair_of(o->seed + path, pair->among, pair->i, a, pair->j, b);
    const double packets = ceil(g * pair->segments_per_area / VISIBILITY_PACKET);
    if (splits == MOST_SPLITS || packets <= 1 || kernel_is_even(o, &two))
        return g * visible_share(o, &two, (size_t)packets * VISIBILITY_PACKET, NULL);
    const bool of_a = a->radius > b->radius;
    polygon halves[2];
    double sum = 0;
    polygon_halve(of_a ? a : b, halves);
    for (uint64_t h = 0; h < 2; h++)
        sum += visible_exchange(o, pair, of_a ? &halves[h] : a, of_a ? b : &halves[h], splits + 1,
                                path * 3 + h + 1);
    return sum;
}

/* N of a pair; what is seen of large factors is estimated by PILOT segments. */
static double segments_wanted(const occlusion *o, segment_list *among, uint32_t i, uint32_t j, double g) {
    enum { PILOT = 64 };
    const double F = factor_of(o, i, j, g);
    if (F <= large_factor) return segments_of_pair(o, i, j, F, .5);
    const piece_pair two = piece_pair_of(o->seed, among, i, &o->polygons[i], j, &o->polygons[j]);
    return segments_of_pair(o, i, j, F, visible_share(o, &two, PILOT, NULL));
}

double occlusion_estimate(const occlusion *o, segment_list *among, uint32_t i, uint32_t j, double g) {
    return occlusion_estimate_by(o, among, i, j, g, 0);
}

double occlusion_estimate_by(const occlusion *o, segment_list *among, uint32_t i, uint32_t j, double g,
                             double segments) {
    const segment_budget pair = {.i = i,
                                 .j = j,
                                 .among = among,
                                 .segments_per_area = fmax(segments_wanted(o, among, i, j, g), segments) / g};
    /* The exchange areas of the pieces sum to g only within the tolerance, and occlusion never adds. */
    return fmin(g, visible_exchange(o, &pair, &o->polygons[i], &o->polygons[j], 0, 0));
}

bool occlusion_is_total(const occlusion *o, const cluster_tree *t, const cluster *a, const cluster *b,
                        double factor) {
    enum { LEAST = 128, MOST = 1024 };
    const double wanted = factor / o->accuracy;
    if (wanted > MOST) return false;
    const size_t segments = wanted > LEAST ? (size_t)wanted : LEAST;
    const uint32_t n_a = a->last - a->first, n_b = b->last - b->first;
    /* Testing the pairs one by one is cheaper. */
    if ((double)VISIBILITY_PACKET * n_a * n_b < (double)segments) return false;
    size_t blocked = 0;
    pair_sampler sampler;
    pair_sampler_init(&sampler, o->seed, a->first, b->first);
    /* Not of a sequence: each element is to meet each place on it. */
    uint64_t elements = random_hash(~o->seed) ^ random_hash((uint64_t)a->first << 32 | b->first);
    for (uint32_t index = 0; blocked < segments; index += VISIBILITY_PACKET) {
        /* Clusters with few elements that face each other are better split. */
        if (index > 64 && blocked < index / 4) return false;
        segment_bundle s;
        unsigned facing = 0;
        for (uint32_t k = 0; k < VISIBILITY_PACKET; k++) {
            double x[4];
            pair_sampler_place(&sampler, index + k, x);
            const uint32_t i = t->element[a->first + (uint32_t)(random_unit(&elements) * n_a)];
            const uint32_t j = t->element[b->first + (uint32_t)(random_unit(&elements) * n_b)];
            segment_set(&s, o, (int)k, i, &o->polygons[i], j, &o->polygons[j], x);
            facing |= (unsigned)(s.kernel[k] > 0) << k;
        }
        /* Segments behind either element do not count. */
        if ((facing & ~visibility_blocked(o->v, &s.segments, VISIBILITY_PACKET, s.from, s.to)) != 0)
            return false;
        blocked += (size_t)__builtin_popcount(facing);
    }
    return true;
}
