/* The pairs of a point: w_j = F_j V with V = sum_k K_k T_k / sum_k K_k, the unoccluded factor F_j, samples k
 * on the element, their kernels K = d cos / r^2 and T what reaches the point: 0, 1, or what panes pass. The
 * part of an element that is seen lies in other directions than its whole, so that for a row of the ratio q,
 *     w_j = F_j V + F sum_k K_k q_k (T_k - V) / sum_k K_k,    F the factor of the density d. */
#include "solver/sensor/point_rows.h"

#include "solver/base/random.h"
#include "solver/base/vector3.h"
#include "solver/formfactor/visibility/pane_path.h"
#include "solver/formfactor/visibility/sample.h"

#include <math.h>
#include <string.h>

/* Segments of a pair, of a half, and of one that is partly hidden. */
enum { SEGMENTS = 16, MORE_SEGMENTS = 128 };

/* So few sources are pairs wherever they are, and have all of these segments; of more of them, those that are
 * pairs have larger factors, up to that of a ray where there are SOURCES_MOST, and fewer segments: a row has
 * at most about 2,600 pairs of sources, and what is left of a large light is seen by many rays. */
enum { SOURCES_WHOLE = 256, SOURCES_MOST = 4096, SOURCE_SEGMENTS_LEAST = 4 };

/* Panes pass light by its angle: shares that differ by less are one. */
static const double same_share = .02;

lam_status point_balls_make(const mesh *m, double (**out)[4], lam_error *error) {
    double(*ball)[4] = memory_allocate(m->n, sizeof *ball, "rows of sensors", error);
    if (ball == NULL) return LAM_ERR_MEMORY;
    for (size_t j = 0; j < m->n; j++) {
        double square = 0;
        mesh_centroid(m, j, ball[j]);
        for (size_t c = 0; c < mesh_corners(m, j); c++) {
            double r[3];
            subtract3(m->vertices[m->elements[j][c]], ball[j], r);
            square = fmax(square, dot3(r, r));
        }
        ball[j][3] = sqrt(square);
    }
    *out = ball;
    return LAM_OK;
}

/* True where a point of the plane of an element lies in it, or on its rim. */
static bool is_over(const mesh *m, size_t element, const double at[3], double slack) {
    const size_t n = mesh_corners(m, element);
    double normal[3];
    for (int d = 0; d < 3; d++) normal[d] = (double)m->normal[element][d];
    for (size_t c = 0; c < n; c++) {
        const double *a = m->vertices[m->elements[element][c]],
                     *b = m->vertices[m->elements[element][(c + 1) % n]];
        double edge[3], way[3], inwards[3];
        subtract3(b, a, edge);
        subtract3(at, a, way);
        cross3(normal, edge, inwards);
        if (dot3(inwards, way) < -slack * sqrt(dot3(inwards, inwards))) return false;
    }
    return true;
}

void point_place_set(const point_scene *s, const receiver *r, size_t number, point_place *out) {
    enum { FACES_MOST = 3 };
    static const double against = -.9; /* cosine: it looks into the face */
    const mesh *m = s->m;
    const double rounding = visibility_rounding(s->v);
    /* rounding = 4 2^-24 radius */
    const double radius = rounding * 0x1p22, near = fmax(fmin(1e-3, 1e-4 * radius), 4 * rounding);
    double normals[FACES_MOST][3];
    size_t n_faces = 0;
    *out = (point_place){.r = *r, .n_rows = 1, .number = number};
    if (r->kind >= RECEIVER_HARMONIC) {
        out->probe = *r;
        out->n_rows = HARMONICS;
        out->r = (receiver){.kind = RECEIVER_SPHERE, .at = {r->at[0], r->at[1], r->at[2]}};
    }
    for (size_t j = 0; j < m->n && n_faces < FACES_MOST; j++) {
        const double *ball = s->ball[j];
        double away[3], normal[3], height = 0;
        bool apart = mesh_is_buried(m, j);
        subtract3(out->r.at, ball, away);
        const double reach = ball[3] + near;
        if (apart || dot3(away, away) > reach * reach) continue;
        for (int d = 0; d < 3; d++) normal[d] = (double)m->normal[j][d];
        height = dot3(away, normal);
        const double clear = 2 * rounding + visibility_rise(s->v, j);
        /* One that looks into a face goes behind it: it is in a body, or sees what is below a sheet. */
        const bool behind = dot3(normal, out->r.axis) < against;
        if (!(height >= (behind ? -clear : -near) && height < clear)) continue;
        for (size_t k = 0; k < n_faces; k++)
            apart = apart || (behind ? -1 : 1) * dot3(normals[k], normal) < -.5;
        if (apart || !is_over(m, j, out->r.at, near)) continue;
        for (int d = 0; d < 3; d++) {
            out->r.at[d] += ((behind ? -clear : clear) - height) * normal[d];
            normals[n_faces][d] = (behind ? -1 : 1) * normal[d];
        }
        n_faces++;
    }
    memcpy(out->probe.at, out->r.at, sizeof out->probe.at);
    visibility_recentre(s->v, out->r.at, out->origin);
}

/* The segment to a point of an element, lifted off it, and its direction; K = d cos / r^2, 0 where either
 * turns away. */
static double aim(const point_scene *s, const point_place *p, const element_sampler *sampler, uint32_t j,
                  const pair_sampler *points, uint32_t index, float segment[3], double way[3]) {
    const double height = 2 * visibility_rounding(s->v) + visibility_rise(s->v, j);
    double x[4];
    float point[3];
    pair_sampler_place(points, index, x);
    element_sampler_point(sampler, (float)x[0], (float)x[1], point);
    for (int d = 0; d < 3; d++) {
        way[d] = (double)point[d] - (double)p->origin[d];
        segment[d] = (float)(way[d] + height * (double)s->m->normal[j][d]);
    }
    const double square = dot3(way, way);
    double cosine = 0;
    if (!(square > 0)) return 0;
    for (int d = 0; d < 3; d++) {
        way[d] /= sqrt(square);
        cosine -= way[d] * (double)s->m->normal[j][d];
    }
    return cosine > 0 ? receiver_density(&p->r, way) * cosine / square : 0;
}

/* passed[i] of n segments from the receiver: 0, 1, or what panes pass. */
static void pass(const point_scene *s, const ray_packet *segments, size_t n,
                 double passed[VISIBILITY_PACKET]) {
    static const uint32_t self[VISIBILITY_PACKET] = {
        VISIBILITY_NOTHING, VISIBILITY_NOTHING, VISIBILITY_NOTHING, VISIBILITY_NOTHING,
        VISIBILITY_NOTHING, VISIBILITY_NOTHING, VISIBILITY_NOTHING, VISIBILITY_NOTHING};
    static const double nearly = 1 - 1e-5;
    const unsigned blocked = visibility_between(s->v, segments, n);
    ray_packet cast = *segments;
    hit_packet hits;
    double end[VISIBILITY_PACKET];
    for (size_t i = 0; i < n; i++) {
        passed[i] = 1;
        end[i] = nearly;
    }
    if (blocked != 0 && s->m->glass != NULL) {
        visibility_cast(s->v, &cast, n, self, VISIBILITY_TOGETHER, &hits);
        pane_path_reach(s->v, s->m, &cast, n, &hits, end, passed);
    }
    for (size_t i = 0; i < n; i++)
        if ((blocked >> i & 1) == 0)
            passed[i] = 1;
        else if (s->m->glass == NULL)
            passed[i] = 0;
}

/* Sums of samples of a pair. */
typedef struct share_sums {
    double K, passed, least, most;
    double Kq[HARMONICS], passed_q[HARMONICS]; /* times ratios */
    size_t n;                                  /* those with K > 0 */
} share_sums;

static void add_sample(const point_place *p, const double way[3], double K, double passed, share_sums *sums) {
    double ratio[HARMONICS];
    sums->n++;
    sums->K += K;
    sums->passed += K * passed;
    sums->least = fmin(sums->least, passed);
    sums->most = fmax(sums->most, passed);
    if (p->n_rows == 1) return;
    point_ratios(p, way, ratio);
    for (size_t w = 0; w < p->n_rows; w++) {
        sums->Kq[w] += K * ratio[w];
        sums->passed_q[w] += K * ratio[w] * passed;
    }
}

/* Adds samples first ... last-1 of a half. */
static void add_samples(const point_scene *s, const point_place *p, const element_sampler *sampler,
                        uint32_t j, const pair_sampler *points, uint32_t first, uint32_t last,
                        share_sums *sums) {
    ray_packet segments = {.origin = {{0}}};
    double K[VISIBILITY_PACKET], passed[VISIBILITY_PACKET], way[VISIBILITY_PACKET][3];
    size_t n = 0;
    for (uint32_t k = first; k < last; k++) {
        float segment[3];
        K[n] = aim(s, p, sampler, j, points, k, segment, way[n]);
        for (int d = 0; d < 3; d++) {
            segments.origin[d][n] = p->origin[d];
            segments.direction[d][n] = segment[d];
        }
        n += K[n] > 0;
        if (n == 0 || (n < VISIBILITY_PACKET && k + 1 < last)) continue;
        pass(s, &segments, n, passed);
        for (size_t i = 0; i < n; i++) add_sample(p, way[i], K[i], passed[i], sums);
        n = 0;
    }
}

static uint32_t segments_of(const point_scene *s, uint32_t j) {
    if (!s->is_source[j] || s->n_sources <= SOURCES_WHOLE) return SEGMENTS;
    const size_t n = SEGMENTS * SOURCES_WHOLE / s->n_sources;
    return n > SOURCE_SEGMENTS_LEAST ? (uint32_t)n : SOURCE_SEGMENTS_LEAST;
}

/* The factor from which on an element is a pair. */
static double least_factor(const point_scene *s, size_t j) {
    const double of_ray = 1. / (double)(HALVES * s->rays), part = (double)s->n_sources / SOURCES_MOST;
    if (!s->is_source[j]) return s->pair_factor > 0 ? s->pair_factor : of_ray;
    return s->n_sources <= SOURCES_WHOLE ? 0 : of_ray * fmin(part * part, 1);
}

/* The factors of an element by both halves, F of the density. An element of which so little lies above the
 * receiver's horizon that no sample of a half does has the share V of the other half, or 1. */
static void find_factors(const point_scene *s, const point_place *p, uint32_t j, const polygon *face,
                         double F, point_share *out) {
    double whole[HARMONICS] = {F};
    element_sampler sampler;
    pair_sampler points[HALVES];
    share_sums sums[HALVES];
    const uint32_t segments = segments_of(s, j);
    element_sampler_init(&sampler, s->m, s->v, j, s->seed);
    for (size_t h = 0; h < HALVES; h++) {
        sums[h] = (share_sums){.least = INFINITY, .most = -INFINITY};
        pair_sampler_init(&points[h], s->seed + h * RANDOM_STEP, s->m->n + p->number, j);
        add_samples(s, p, &sampler, j, &points[h], 0, segments, &sums[h]);
    }
    const bool partly = fmax(sums[0].most, sums[1].most) - fmin(sums[0].least, sums[1].least) > same_share,
               few = sums[0].n + sums[1].n < segments;
    for (size_t h = 0; h < HALVES && (partly || few); h++)
        add_samples(s, p, &sampler, j, &points[h], segments, MORE_SEGMENTS, &sums[h]);
    if (p->n_rows > 1) receiver_factors(&p->probe, face, whole);
    for (size_t h = 0; h < HALVES; h++) {
        const share_sums *known = sums[h].K > 0 ? &sums[h] : &sums[1 - h];
        const double V = known->K > 0 ? known->passed / known->K : 1, each = known->K > 0 ? F / known->K : 0;
        for (size_t w = 0; w < p->n_rows; w++)
            out[w][h] = whole[w] * V + each * (known->passed_q[w] - V * known->Kq[w]);
    }
}

/* True unless an element is certain to turn its back or to have a smaller factor. */
static bool may_exceed(const point_scene *s, const receiver *r, size_t j, double least) {
    const double *ball = s->ball[j];
    double away[3], height = 0;
    subtract3(ball, r->at, away);
    for (int d = 0; d < 3; d++) height -= away[d] * (double)s->m->normal[j][d];
    if (!(height > 0)) return false;
    if (r->kind == RECEIVER_PLANE && dot3(away, r->axis) <= -ball[3]) return false;
    /* F <= max density A cos / r^2, with the nearest r of the ball */
    const double distance = sqrt(dot3(away, away)), nearest = distance - ball[3];
    if (!(nearest > 0)) return true;
    const double cosine = fmin(height / nearest, 1);
    return receiver_density_most(r->kind) * s->m->area[j] * cosine > least * nearest * nearest;
}

void point_pairs(const point_scene *s, const point_place *p, point_room *room) {
    room->n_pairs = 0;
    for (size_t j = 0; j < s->m->n; j++) {
        const double least = least_factor(s, j);
        if (!may_exceed(s, &p->r, j, least) || mesh_is_buried(s->m, j)) continue;
        polygon face;
        polygon_of_element(s->m, j, &face);
        const double factor = receiver_factor(&p->r, &face);
        if (!(factor > least)) continue;
        find_factors(s, p, (uint32_t)j, &face, factor, room->factor + room->n_pairs * p->n_rows);
        room->known[j] |= IS_PAIR;
        room->pair[room->n_pairs++] = (uint32_t)j;
    }
}
