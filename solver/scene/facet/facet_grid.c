/* A grid along two sides of a typical element finds the element at a point. A cell names the element that
 * fills it, or it lists candidates, of which the first is taken whose min over sides of (a x + b y + c), the
 * distance of the point inside it, is at least 0, or else the one of the largest. */
#include "solver/scene/facet/facet_grid.h"

#include "solver/base/array_grow.h"
#include "solver/base/array_sort.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A cell's code: the element that fills it, marked; or its first candidate. */
#define CELL_FILLED 0x80000000u
#define CELL_EMPTY 0xFFFFFFFFu

/* The margin, in cells: a smaller overlap counts as none, a smaller gap as filled. It is larger than the
 * rounding of coordinates. */
static const double margin = 1e-5;

/* The most cells per element, and the most cells of a facet beside these. */
enum { CELLS_EACH = 4, CELLS_MORE = 16 };

/* Facets of fewer elements are not worth a parallel region. */
enum { MANY_ELEMENTS = 1024 };

struct facet_grid {
    uint32_t nx, ny, first; /* cell (x, y) is cells[first + y nx + x] */
    uint32_t element;       /* the facet's first */
};

/* An element that overlaps a cell. The least a x + b y + c over its sides, with x and y in cells from the
 * cell's corner, is a point's distance inside it. The fourth side of a triangle never is the least. */
typedef struct facet_candidate {
    float a[4], b[4], c[4];
    uint32_t element, last;
} facet_candidate;

/* The plane of a facet in cells. */
typedef struct frame {
    double origin[3], x[3], y[3]; /* place = ((p - origin) . x, (p - origin) . y) */
} frame;

static void to_cells(const frame *f, const double p[3], double at[2]) {
    at[0] = at[1] = 0;
    for (int d = 0; d < 3; d++) {
        at[0] += (p[d] - f->origin[d]) * f->x[d];
        at[1] += (p[d] - f->origin[d]) * f->y[d];
    }
}

/* Takes the two sides of an element at the corner nearest to a right angle as axes, so that regularly divided
 * faces fill cells evenly. */
static void set_axes(const mesh *m, size_t element, frame *f) {
    const size_t corners = mesh_corners(m, element);
    double best = INFINITY, u[3] = {0}, w[3] = {0};
    for (size_t k = 0; k < corners; k++) {
        const double *o = m->vertices[m->elements[element][k]];
        const double *p = m->vertices[m->elements[element][(k + 1) % corners]];
        const double *q = m->vertices[m->elements[element][(k + corners - 1) % corners]];
        double pq = 0, pp = 0, qq = 0;
        for (int d = 0; d < 3; d++) {
            pq += (p[d] - o[d]) * (q[d] - o[d]);
            pp += (p[d] - o[d]) * (p[d] - o[d]);
            qq += (q[d] - o[d]) * (q[d] - o[d]);
        }
        if (fabs(pq) >= best * sqrt(pp * qq)) continue;
        best = fabs(pq) / sqrt(pp * qq);
        for (int d = 0; d < 3; d++) {
            u[d] = p[d] - o[d];
            w[d] = q[d] - o[d];
        }
    }
    /* The dual of (u, w) in their plane. */
    double uu = 0, ww = 0, uw = 0;
    for (int d = 0; d < 3; d++) {
        uu += u[d] * u[d];
        ww += w[d] * w[d];
        uw += u[d] * w[d];
    }
    const double det = uu * ww - uw * uw;
    for (int d = 0; d < 3; d++) {
        f->x[d] = (ww * u[d] - uw * w[d]) / det;
        f->y[d] = (uu * w[d] - uw * u[d]) / det;
    }
}

/* The element whose area is nearest to the facet's mean. */
static uint32_t typical(const mesh *m, const uint32_t *elements, size_t n) {
    double mean = 0, best = INFINITY;
    uint32_t found = elements[0];
    for (size_t k = 0; k < n; k++) mean += m->area[elements[k]] / (double)n;
    for (size_t k = 0; k < n; k++) {
        const double off = fabs(m->area[elements[k]] - mean);
        if (off < best * (1 - 1e-9)) best = off, found = elements[k];
    }
    return found;
}

/* Sets the frame of the grid and its number of cells. */
static void lay(const mesh *m, const uint32_t *elements, size_t n, frame *f, facet_grid *g) {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    memcpy(f->origin, m->vertices[m->elements[elements[0]][0]], sizeof f->origin);
    set_axes(m, typical(m, elements, n), f);
    for (size_t k = 0; k < n; k++)
        for (size_t c = 0; c < mesh_corners(m, elements[k]); c++) {
            double at[2];
            to_cells(f, m->vertices[m->elements[elements[k]][c]], at);
            for (int d = 0; d < 2; d++) {
                low[d] = fmin(low[d], at[d]);
                high[d] = fmax(high[d], at[d]);
            }
        }
    double cells[2];
    for (int d = 0; d < 2; d++) cells[d] = fmax(1, round(high[d] - low[d]));
    const double most = (double)(CELLS_EACH * n + CELLS_MORE);
    if (cells[0] * cells[1] > most) {
        const double by = sqrt(most / (cells[0] * cells[1]));
        for (int d = 0; d < 2; d++) cells[d] = fmin(fmax(1, floor(cells[d] * by)), most);
        if (cells[0] * cells[1] > most) cells[cells[0] > cells[1] ? 0 : 1] = most;
    }
    g->nx = (uint32_t)cells[0];
    g->ny = (uint32_t)cells[1];
    /* The corner where both are least becomes the origin. origin + s u + t w with u, w dual to x, y. */
    double xx = 0, yy = 0, xy = 0;
    for (int d = 0; d < 3; d++) {
        xx += f->x[d] * f->x[d];
        yy += f->y[d] * f->y[d];
        xy += f->x[d] * f->y[d];
    }
    const double det = xx * yy - xy * xy;
    for (int d = 0; d < 3; d++) {
        const double u = (yy * f->x[d] - xy * f->y[d]) / det, w = (xx * f->y[d] - xy * f->x[d]) / det;
        f->origin[d] += low[0] * u + low[1] * w;
    }
    for (int d = 0; d < 3; d++) {
        f->x[d] *= cells[0] / (high[0] - low[0]);
        f->y[d] *= cells[1] / (high[1] - low[1]);
    }
}

/* An element's sides in cells, as a candidate's, and its bounds. */
typedef struct footprint {
    uint32_t element;
    double a[4], b[4], c[4];
    double low[2], high[2];
} footprint;

static void set_footprint(const mesh *m, const frame *f, uint32_t element, footprint *p) {
    const size_t corners = mesh_corners(m, element);
    double at[4][2], around = 0;
    *p = (footprint){.element = element, .low = {INFINITY, INFINITY}, .high = {-INFINITY, -INFINITY}};
    for (size_t k = 0; k < corners; k++) {
        to_cells(f, m->vertices[m->elements[element][k]], at[k]);
        for (int d = 0; d < 2; d++) {
            p->low[d] = fmin(p->low[d], at[k][d]);
            p->high[d] = fmax(p->high[d], at[k][d]);
        }
    }
    for (size_t k = 1; k + 1 < corners; k++)
        around += (at[k][0] - at[0][0]) * (at[k + 1][1] - at[0][1]) -
                  (at[k][1] - at[0][1]) * (at[k + 1][0] - at[0][0]);
    const double sense = around < 0 ? -1 : 1; /* the frame may look from behind */
    for (size_t k = 0; k < corners; k++) {
        const double *a = at[k], *b = at[(k + 1) % corners];
        const double dx = b[0] - a[0], dy = b[1] - a[1], length = hypot(dx, dy);
        const double by = length > 0 ? sense / length : 0;
        p->a[k] = -dy * by;
        p->b[k] = dx * by;
        p->c[k] = (dy * a[0] - dx * a[1]) * by;
    }
    if (corners == 3) p->c[3] = HUGE_VALF;
}

/* The distance of the cell at (x, y) inside the element, the least over sides, at its best and at its worst
 * corner. */
static void reach(const footprint *p, double x, double y, double *best, double *worst) {
    *best = *worst = INFINITY;
    for (int k = 0; k < 4; k++) {
        const double a = p->a[k], b = p->b[k], at = a * x + b * y + p->c[k];
        *best = fmin(*best, at + fmax(0, a) + fmax(0, b));
        *worst = fmin(*worst, at + fmin(0, a) + fmin(0, b));
    }
}

static void cell_range(double low, double high, uint32_t n, uint32_t *first, uint32_t *last) {
    *first = (uint32_t)fmin(fmax(floor(low + margin), 0), n - 1);
    *last = (uint32_t)fmin(fmax(ceil(high - margin) - 1, *first), n - 1);
}

/* An element that overlaps a cell, while cells are gathered. */
typedef struct overlap {
    uint32_t cell, member; /* of the facet */
    bool fills;
    float depth; /* of the cell in the element, at its best corner */
} overlap;

/* Orders overlaps by cells; in a cell the element that has most of it comes first, where nearly all searches
 * end. */
static int overlap_order(const void *a, const void *b) {
    const overlap *p = a, *q = b;
    if (p->cell != q->cell) return p->cell < q->cell ? -1 : 1;
    if (p->depth < q->depth || q->depth < p->depth) return p->depth > q->depth ? -1 : 1;
    return (p->member > q->member) - (p->member < q->member);
}

typedef struct gathering {
    footprint *footprints;
    overlap *overlaps;
    size_t n, footprint_capacity, capacity;
} gathering;

static lam_status gather(const mesh *m, const uint32_t *elements, size_t n, const frame *f,
                         const facet_grid *grid, gathering *g, lam_error *error) {
    if (array_grow(&g->footprints, &g->footprint_capacity, n, sizeof *g->footprints, "facets", error) !=
        LAM_OK)
        return LAM_ERR_MEMORY;
    g->n = 0;
#pragma omp parallel for schedule(static) if (n >= MANY_ELEMENTS)
    for (size_t k = 0; k < n; k++) set_footprint(m, f, elements[k], &g->footprints[k]);
    for (size_t k = 0; k < n; k++) {
        const footprint *p = &g->footprints[k];
        uint32_t x0, x1, y0, y1;
        cell_range(p->low[0], p->high[0], grid->nx, &x0, &x1);
        cell_range(p->low[1], p->high[1], grid->ny, &y0, &y1);
        for (uint32_t y = y0; y <= y1; y++)
            for (uint32_t x = x0; x <= x1; x++) {
                double best, worst;
                reach(p, x, y, &best, &worst);
                if (best <= margin) continue;
                if (array_grow(&g->overlaps, &g->capacity, g->n + 1, sizeof *g->overlaps, "facets", error) !=
                    LAM_OK)
                    return LAM_ERR_MEMORY;
                g->overlaps[g->n++] = (overlap){y * grid->nx + x, (uint32_t)k, worst >= -margin, (float)best};
            }
    }
    array_sort(g->overlaps, g->n, sizeof *g->overlaps, overlap_order);
    return LAM_OK;
}

static lam_status fill_cells(const facet_grid *grid, const gathering *g, facet_grids *out, lam_error *error) {
    const size_t n_cells = (size_t)grid->nx * grid->ny;
    if (array_grow(&out->cells, &out->cell_capacity, out->n_cells + n_cells, sizeof *out->cells, "facets",
                   error) != LAM_OK)
        return LAM_ERR_MEMORY;
    uint32_t *cells = out->cells + out->n_cells;
    out->n_cells += n_cells;
    for (size_t k = 0; k < n_cells; k++) cells[k] = CELL_EMPTY;
    if (array_grow(&out->candidates, &out->candidate_capacity, out->n_candidates + g->n,
                   sizeof *out->candidates, "facets", error) != LAM_OK)
        return LAM_ERR_MEMORY;
    for (size_t first = 0, last; first < g->n; first = last) {
        const uint32_t cell = g->overlaps[first].cell;
        bool filled = false;
        for (last = first; last < g->n && g->overlaps[last].cell == cell; last++) {
            if (!g->overlaps[last].fills) continue;
            filled = true;
            cells[cell] = CELL_FILLED | g->footprints[g->overlaps[last].member].element;
        }
        if (filled) continue;
        cells[cell] = (uint32_t)out->n_candidates;
        for (size_t k = first; k < last; k++) {
            const footprint *p = &g->footprints[g->overlaps[k].member];
            facet_candidate *c = &out->candidates[out->n_candidates++];
            *c = (facet_candidate){.element = p->element, .last = k + 1 == last};
            for (int side = 0; side < 4; side++) {
                c->a[side] = (float)p->a[side];
                c->b[side] = (float)p->b[side];
                c->c[side] =
                    (float)(p->c[side] + p->a[side] * (cell % grid->nx) + p->b[side] * (cell / grid->nx));
            }
        }
    }
    return LAM_OK;
}

/* The largest number whose cell is one of n. */
static float last_place(uint32_t n) {
    float most = nextafterf((float)n, 0);
    while ((uint32_t)most >= n) most = nextafterf(most, 0);
    return most;
}

/* Sets the map of a piece from its corner and the two sides from there. */
static void place_piece(const mesh *m, const frame *f, const uint32_t piece[4], const facet_grid *grid,
                        piece_place *out) {
    double o[2], u[2], w[2];
    to_cells(f, m->vertices[piece[0]], o);
    to_cells(f, m->vertices[piece[1]], u);
    to_cells(f, m->vertices[piece[corner_count(piece) - 1]], w);
    out->x[0] = (float)o[0], out->x[1] = (float)(u[0] - o[0]), out->x[2] = (float)(w[0] - o[0]);
    out->y[0] = (float)o[1], out->y[1] = (float)(u[1] - o[1]), out->y[2] = (float)(w[1] - o[1]);
    out->most[0] = last_place(grid->nx);
    out->most[1] = last_place(grid->ny);
    out->nx = grid->nx;
    out->first = grid->first;
}

lam_status facet_grids_create(const mesh *m, const facets *f, facet_grids *out, lam_error *error) {
    lam_status status = LAM_OK;
    gathering g = {.n = 0};
    uint32_t *grid_of = memory_allocate(f->n, sizeof *grid_of, "facets", error);
    frame *frames = NULL;
    *out = (facet_grids){.n_grids = 0};
    if (grid_of == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < f->n; k++)
        grid_of[k] = f->first[k + 1] - f->first[k] > 1 ? (uint32_t)out->n_grids++ : 0;
    frames = memory_allocate(out->n_grids, sizeof *frames, "facets", error);
    out->grids = memory_allocate(out->n_grids, sizeof *out->grids, "facets", error);
    out->pieces = memory_allocate(f->n_pieces, sizeof *out->pieces, "facets", error);
    if (frames == NULL || out->grids == NULL || out->pieces == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < f->n; k++) {
        const uint32_t *elements = f->elements + f->first[k];
        const size_t n = f->first[k + 1] - f->first[k];
        facet_grid *grid = &out->grids[grid_of[k]];
        if (n == 1) continue;
        grid->first = (uint32_t)out->n_cells;
        grid->element = elements[0];
        lay(m, elements, n, &frames[grid_of[k]], grid);
        TRY(gather(m, elements, n, &frames[grid_of[k]], grid, &g, error));
        TRY(fill_cells(grid, &g, out, error));
    }
    for (size_t p = 0; p < f->n_pieces; p++) {
        const uint32_t facet = f->piece_facet[p];
        if (f->first[facet + 1] - f->first[facet] == 1) continue;
        out->pieces[p].grid = grid_of[facet];
        place_piece(m, &frames[grid_of[facet]], f->pieces[p], &out->grids[grid_of[facet]], &out->pieces[p]);
    }
done:
    free(grid_of);
    free(frames);
    free(g.footprints);
    free(g.overlaps);
    if (status != LAM_OK) facet_grids_free(out);
    return status;
}

void facet_grids_free(facet_grids *g) {
    free(g->pieces);
    free(g->grids);
    free(g->cells);
    free(g->candidates);
    *g = (facet_grids){.n_grids = 0};
}

/* A place within the grid. */
static float within(float x, float most) {
    const float above = x > 0 ? x : 0;
    return above < most ? above : most;
}

static float inside(const facet_candidate *c, float x, float y) {
    typedef float lanes __attribute__((vector_size(16), aligned(4), may_alias));
    const lanes at = *(const lanes *)c->a * x + *(const lanes *)c->b * y + *(const lanes *)c->c;
    const float least = at[0] < at[1] ? at[0] : at[1], other = at[2] < at[3] ? at[2] : at[3];
    return least < other ? least : other;
}

static uint32_t choose(const facet_candidate *c, float x, float y) {
    const facet_candidate *best = c;
    float most = inside(c, x, y);
    while (most < 0 && !c->last) {
        const float at = inside(++c, x, y);
        if (at <= most) continue;
        most = at;
        best = c;
    }
    return best->element;
}

void facet_grids_find(const facet_grids *g, size_t n, const uint32_t *piece, const float *u, const float *v,
                      uint32_t *element) {
    float x[FACET_SEARCHES], y[FACET_SEARCHES]; /* in their cells */
    uint32_t cell[FACET_SEARCHES], open[FACET_SEARCHES];
    size_t n_open = 0;
    /* All searches advance step by step together, so that their cache misses overlap. */
    for (size_t i = 0; i < n; i++) {
        const piece_place *p = &g->pieces[piece[i]];
        x[i] = p->x[0] + u[i] * p->x[1] + v[i] * p->x[2];
        y[i] = p->y[0] + u[i] * p->y[1] + v[i] * p->y[2];
        const uint32_t column = (uint32_t)within(x[i], p->most[0]), row = (uint32_t)within(y[i], p->most[1]);
        x[i] -= (float)column;
        y[i] -= (float)row;
        cell[i] = p->first + row * p->nx + column;
        __builtin_prefetch(&g->cells[cell[i]]);
    }
    /* Cells that no element fills are listed without branches, which would be mispredicted. */
    for (size_t i = 0; i < n; i++) {
        cell[i] = g->cells[cell[i]];
        element[i] = cell[i] & ~CELL_FILLED;
        open[n_open] = (uint32_t)i;
        n_open += (cell[i] == CELL_EMPTY) | ((cell[i] & CELL_FILLED) == 0);
    }
    for (size_t k = 0; k < n_open; k++)
        if (cell[open[k]] != CELL_EMPTY) __builtin_prefetch(&g->candidates[cell[open[k]]]);
    for (size_t k = 0; k < n_open; k++) {
        const uint32_t i = open[k];
        element[i] = cell[i] == CELL_EMPTY ? g->grids[g->pieces[piece[i]].grid].element
                                           : choose(&g->candidates[cell[i]], x[i], y[i]);
    }
}
