#include "solver/formfactor/pairs.h"

#include "solver/formfactor/pair.h"
#include "solver/formfactor/sample.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What the first segments say of a pair. */
typedef enum pair_state { FACING_AWAY, OPEN, HIDDEN, MIXED } pair_state;

enum { MOST_NEIGHBOURS = 12, SEGMENTS_MOST = 1 << 22 };

typedef struct pairs_run {
    const mesh *m;
    const visibility *v;
    const pairs_options *options;
    pair_rules rules;
    polygon *polygons;                       /* [n] */
    uint32_t (*neighbours)[MOST_NEIGHBOURS]; /* [n], sharing an edge; UINT32_MAX: none */
    float *exchange;                         /* upper triangle without the diagonal, row by row */
    uint8_t *state;                          /* likewise */
} pairs_run;

/* Place of the pair i < j in the upper triangle. */
static size_t place_of(size_t n, size_t i, size_t j) {
    return i * (2 * n - i - 1) / 2 + (j - i - 1);
}

static pair_state state_of(const pairs_run *run, size_t i, size_t j) {
    if (i == j) return FACING_AWAY;
    return (pair_state)run->state[i < j ? place_of(run->m->n, i, j) : place_of(run->m->n, j, i)];
}

typedef struct edge_use {
    uint32_t low, high, element;
} edge_use;

static int compare_edges(const void *a, const void *b) {
    const edge_use *one = a, *two = b;
    if (one->low != two->low) return one->low < two->low ? -1 : 1;
    if (one->high != two->high) return one->high < two->high ? -1 : 1;
    return one->element < two->element ? -1 : one->element > two->element;
}

static void add_neighbour(uint32_t list[MOST_NEIGHBOURS], uint32_t element) {
    for (int k = 0; k < MOST_NEIGHBOURS; k++) {
        if (list[k] == element) return;
        if (list[k] == UINT32_MAX) {
            list[k] = element;
            return;
        }
    }
}

static lam_status find_neighbours(pairs_run *run, lam_error *error) {
    const mesh *m = run->m;
    size_t n_edges = 0;
    edge_use *edges = memory_allocate(m->n, 4 * sizeof *edges, "neighbours", error);
    if (edges == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < m->n; i++) {
        const uint32_t *corner = m->elements[i];
        const int corners = corner[3] == MESH_NO_VERTEX ? 3 : 4;
        for (int c = 0; c < corners; c++) {
            const uint32_t a = corner[c], b = corner[(c + 1) % corners];
            edges[n_edges++] = (edge_use){a < b ? a : b, a < b ? b : a, (uint32_t)i};
        }
    }
    qsort(edges, n_edges, sizeof *edges, compare_edges);
    memset(run->neighbours, 0xff, m->n * sizeof *run->neighbours);
    for (size_t e = 0; e + 1 < n_edges; e++)
        for (size_t f = e + 1; f < n_edges && edges[f].low == edges[e].low && edges[f].high == edges[e].high;
             f++) {
            add_neighbour(run->neighbours[edges[e].element], edges[f].element);
            add_neighbour(run->neighbours[edges[f].element], edges[e].element);
        }
    free(edges);
    return LAM_OK;
}

/* The larger of F_ij and F_ji. */
static double factor_of(const pairs_run *run, size_t i, size_t j, double g) {
    return g / fmin(run->m->area[i], run->m->area[j]);
}

/* Segments that leave the factor a standard error of about options->accuracy: those of this sequence leave
 * the seen share one of about 1.6 N^-3/4 (measured on a plate between two plates, from 16 to 165,000). */
static size_t segments_for(const pairs_run *run, double F) {
    const double wanted = fmin(pow(1.6 * F / run->options->accuracy, 4. / 3), SEGMENTS_MOST);
    const size_t packets = ((size_t)wanted + VISIBILITY_PACKET - 1) / VISIBILITY_PACKET;
    const size_t segments = packets * VISIBILITY_PACKET;
    return segments > run->options->segments ? segments : run->options->segments;
}

/* Segments of the first look: one packet, more for a factor that matters more. */
static size_t first_segments(double F) {
    enum { MOST = 256 };
    const double packets = ceil(fmin(F / 1e-3, MOST / VISIBILITY_PACKET));
    return packets > 1 ? (size_t)packets * VISIBILITY_PACKET : VISIBILITY_PACKET;
}

/* Two elements, or pieces of them, and the sequence of points on them. */
typedef struct joined {
    uint32_t i, j;
    const polygon *a, *b;
    pair_sampler sampler;
} joined;

/* Casts segments first ... first+7; returns which are blocked, and the kernel of each: cos cos' / r^2 times
 * the areas that the two points stand for. */
static unsigned cast(const pairs_run *run, const joined *two, size_t first,
                     double kernel[VISIBILITY_PACKET]) {
    uint32_t from[VISIBILITY_PACKET], to[VISIBILITY_PACKET];
    ray_packet segments;
    for (int k = 0; k < VISIBILITY_PACKET; k++) {
        double x[4], points[2][3], r2 = 0, leaving = 0, arriving = 0;
        float origin[3], end[3];
        pair_sampler_place(&two->sampler, (uint32_t)first + (uint32_t)k, x);
        const double area =
            polygon_point(two->a, x[0], x[1], points[0]) * polygon_point(two->b, x[2], x[3], points[1]);
        visibility_recentre(run->v, points[0], origin);
        visibility_recentre(run->v, points[1], end);
        for (int d = 0; d < 3; d++) {
            const double r = points[1][d] - points[0][d];
            r2 += r * r;
            leaving += r * two->a->normal[d];
            arriving -= r * two->b->normal[d];
            segments.origin[d][k] = origin[d];
            segments.direction[d][k] = end[d] - origin[d];
        }
        kernel[k] = leaving > 0 && arriving > 0 ? area * leaving * arriving / (r2 * r2) : 0;
        from[k] = two->i;
        to[k] = two->j;
    }
    return visibility_blocked(run->v, &segments, VISIBILITY_PACKET, from, to);
}

/* Share of two pieces that is seen: sum k V / sum k. */
static double seen_share(const pairs_run *run, const joined *two, size_t n_segments) {
    double seen = 0, all = 0;
    for (size_t first = 0; first < n_segments; first += VISIBILITY_PACKET) {
        double kernel[VISIBILITY_PACKET];
        const unsigned blocked = cast(run, two, first, kernel);
        for (int k = 0; k < VISIBILITY_PACKET; k++) {
            all += kernel[k];
            if ((blocked >> k & 1) == 0) seen += kernel[k];
        }
    }
    return all > 0 ? seen / all : 0;
}

/* A pair that is looked at in pieces. */
typedef struct dissection {
    uint32_t i, j;
    double segments_per_area; /* of exchange: each piece gets its share of the pair's segments */
} dissection;

/* The exchange area that is not hidden. While pieces nearly touch, the kernel varies too much over them for
 * few segments: the larger is quartered, as often as splits allow. path tells the pieces' samples apart. */
static double seen_exchange(const pairs_run *run, const dissection *pair, const polygon *a, const polygon *b,
                            int splits, uint64_t path) {
    enum { MOST_SPLITS = 6 };
    const double g = pair_exchange(&run->rules, a, b, run->options->tolerance);
    if (g <= 0) return 0;
    double apart2 = 0;
    for (int d = 0; d < 3; d++) apart2 += (a->centre[d] - b->centre[d]) * (a->centre[d] - b->centre[d]);
    const double size = a->radius + b->radius;
    if (splits == MOST_SPLITS || apart2 > .5 * size * size) {
        const double packets = ceil(g * pair->segments_per_area / VISIBILITY_PACKET);
        joined two = {.i = pair->i, .j = pair->j, .a = a, .b = b};
        pair_sampler_init(&two.sampler, run->options->seed + path, pair->i, pair->j);
        return g * seen_share(run, &two, (size_t)packets * VISIBILITY_PACKET);
    }
    polygon quarters[4];
    double sum = 0;
    polygon_quarter(a->radius > b->radius ? a : b, quarters);
    for (uint64_t q = 0; q < 4; q++)
        sum += a->radius > b->radius
                   ? seen_exchange(run, pair, &quarters[q], b, splits + 1, path * 5 + q + 1)
                   : seen_exchange(run, pair, a, &quarters[q], splits + 1, path * 5 + q + 1);
    return sum;
}

static pair_state first_look(const pairs_run *run, size_t i, size_t j, double g) {
    if (g <= 0) return FACING_AWAY;
    const unsigned all = (1u << VISIBILITY_PACKET) - 1;
    const size_t segments = first_segments(factor_of(run, i, j, g));
    double kernel[VISIBILITY_PACKET];
    joined two = {.i = (uint32_t)i, .j = (uint32_t)j, .a = &run->polygons[i], .b = &run->polygons[j]};
    pair_sampler_init(&two.sampler, run->options->seed, i, j);
    const unsigned first = cast(run, &two, 0, kernel);
    if (first != 0 && first != all) return MIXED;
    for (size_t next = VISIBILITY_PACKET; next < segments; next += VISIBILITY_PACKET)
        if (cast(run, &two, next, kernel) != first) return MIXED;
    return first == 0 ? OPEN : HIDDEN;
}

/* Whether a pair next to this one, with either element replaced by a neighbour of it, came out otherwise. */
static bool at_a_border(const pairs_run *run, size_t i, size_t j, pair_state state) {
    for (int side = 0; side < 2; side++) {
        const size_t kept = side == 0 ? i : j;
        const uint32_t *others = run->neighbours[side == 0 ? j : i];
        for (int k = 0; k < MOST_NEIGHBOURS && others[k] != UINT32_MAX; k++) {
            const pair_state other = state_of(run, kept, others[k]);
            if (other != FACING_AWAY && other != state) return true;
        }
    }
    return false;
}

/* First pass: magnitudes and first looks; second pass: what is hidden of the pairs that need it. */
static void look_at_row(pairs_run *run, size_t i) {
    const size_t n = run->m->n;
    for (size_t j = i + 1; j < n; j++) {
        const size_t at = place_of(n, i, j);
        const double g =
            pair_exchange(&run->rules, &run->polygons[i], &run->polygons[j], run->options->tolerance);
        run->exchange[at] = (float)g;
        run->state[at] = (uint8_t)first_look(run, i, j, g);
    }
}

static void refine_row(pairs_run *run, size_t i, pairs_report *row) {
    const size_t n = run->m->n;
    for (size_t j = i + 1; j < n; j++) {
        const size_t at = place_of(n, i, j);
        const pair_state state = (pair_state)run->state[at];
        if (state == FACING_AWAY) continue;
        row->facing++;
        if (state == MIXED || at_a_border(run, i, j, state)) {
            const double g = (double)run->exchange[at];
            const dissection pair = {.i = (uint32_t)i,
                                     .j = (uint32_t)j,
                                     .segments_per_area =
                                         (double)segments_for(run, factor_of(run, i, j, g)) / g};
            row->mixed++;
            /* The pieces sum to the whole within the tolerance; nothing between may raise it. */
            run->exchange[at] =
                (float)fmin(g, seen_exchange(run, &pair, &run->polygons[i], &run->polygons[j], 0, 0));
        } else if (state == OPEN) {
            row->open++;
        } else {
            row->hidden++;
            run->exchange[at] = 0;
        }
    }
}

static lam_status run_passes(pairs_run *run, pairs_report *report, lam_error *error) {
    const size_t n = run->m->n;
    const progress *p = run->options->progress;
    pairs_report sum = {0};
    for (int pass = 0; pass < 2; pass++) {
        bool cancelled = false;
        size_t finished = 0;
#pragma omp parallel for schedule(dynamic, 4)
        for (size_t i = 0; i < n; i++) {
            bool stop;
            pairs_report row = {0};
#pragma omp atomic read
            stop = cancelled;
            if (stop) continue;
            if (pass == 0)
                look_at_row(run, i);
            else
                refine_row(run, i, &row);
#pragma omp critical(pairs_progress)
            {
                sum.facing += row.facing;
                sum.open += row.open;
                sum.hidden += row.hidden;
                sum.mixed += row.mixed;
                finished++;
                progress_report(p, run->options->stage, .5 * (pass + (double)finished / (double)n));
                if (progress_cancelled(p)) {
#pragma omp atomic write
                    cancelled = true;
                }
            }
        }
        if (cancelled) return status_fail(error, LAM_ERR_CANCELLED, "cancelled");
    }
    *report = sum;
    return LAM_OK;
}

/* Both triangles of what is not zero, rows ascending. */
static lam_status gather(const pairs_run *run, csr *G, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = run->m->n;
    csr rows = {.n = n};
    rows.indptr = memory_allocate(n + 1, sizeof *rows.indptr, "form factor rows", error);
    if (rows.indptr == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++)
        for (size_t j = i + 1; j < n; j++)
            if (run->exchange[place_of(n, i, j)] > 0) {
                rows.indptr[i + 1]++;
                rows.indptr[j + 1]++;
            }
    for (size_t i = 0; i < n; i++) rows.indptr[i + 1] += rows.indptr[i];
    rows.indices = memory_allocate(rows.indptr[n], sizeof *rows.indices, "form factor rows", error);
    rows.data = memory_allocate(rows.indptr[n], sizeof *rows.data, "form factor rows", error);
    if (rows.indices == NULL || rows.data == NULL) TRY(LAM_ERR_MEMORY);
#pragma omp parallel for schedule(dynamic, 16)
    for (size_t i = 0; i < n; i++) {
        uint64_t at = rows.indptr[i];
        for (size_t j = 0; j < n; j++) {
            if (i == j) continue;
            const float g = run->exchange[i < j ? place_of(n, i, j) : place_of(n, j, i)];
            if (g <= 0) continue;
            rows.indices[at] = (uint32_t)j;
            rows.data[at++] = g;
        }
    }
    *G = rows;
    rows = (csr){0};
done:
    csr_free(&rows);
    return status;
}

lam_status pairs_exchange(const mesh *m, const visibility *v, const pairs_options *options, csr *G,
                          pairs_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = m->n;
    size_t n_pairs;
    pairs_run run = {.m = m, .v = v, .options = options};
    if (!size_multiply(n, n > 0 ? n - 1 : 0, &n_pairs))
        FAIL(error, LAM_ERR_MEMORY, "%zu elements have too many pairs; use --quality draft", n);
    n_pairs /= 2;
    pair_rules_init(&run.rules);
    run.polygons = memory_allocate(n, sizeof *run.polygons, "pairs", error);
    run.neighbours = memory_allocate(n, sizeof *run.neighbours, "pairs", error);
    run.exchange = memory_allocate(n_pairs, sizeof *run.exchange, "pairs", error);
    run.state = memory_allocate(n_pairs, sizeof *run.state, "pairs", error);
    if (run.polygons == NULL || run.neighbours == NULL || run.exchange == NULL || run.state == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) polygon_of_element(m, i, &run.polygons[i]);
    TRY(find_neighbours(&run, error));
    TRY(run_passes(&run, report, error));
    TRY(gather(&run, G, error));
done:
    free(run.polygons);
    free(run.neighbours);
    free(run.exchange);
    free(run.state);
    return status;
}
