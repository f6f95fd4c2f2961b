/* The coarse mesh of 2MSC (Fernández et al. 2011, algorithm 1) is split from a heap: the patch of the largest
 * loss = sum_e A_e |v_e - v|^2 is halved by area, up to a number of patches, or while its coherence is below
 * a bound: coherence = 1 - loss / sum_e A_e |v_e|^2, and v_eg = F_eg / A_g^1/2 is the view of group g. */
#include "solver/method/two_mesh/coarse_mesh.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Views whose loss is a smaller share of their squares count as equal: rounding to single precision alone
 * makes them differ by this. */
static const double indistinct = 1e-12;

static lam_status group_views_create(const build_problem *problem, const uint32_t *group, size_t n_groups,
                                     group_views *out, lam_error *error) {
    lam_status status = LAM_OK;
    const csr *F = problem->F;
    double area[VIEWS_MOST] = {0};
    float *v = memory_allocate(problem->n, n_groups * sizeof *v, "views", error);
    if (v == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < problem->n; i++) area[group[i]] += problem->area[i];
#pragma omp parallel for schedule(dynamic, 64)
    for (size_t e = 0; e < problem->n; e++) {
        double F_e[VIEWS_MOST] = {0};
        for (uint64_t p = F->indptr[e]; p < F->indptr[e + 1]; p++)
            F_e[group[F->indices[p]]] += (double)F->data[p];
        for (size_t g = 0; g < n_groups; g++)
            v[e * n_groups + g] = area[g] > 0 ? (float)(F_e[g] / sqrt(area[g])) : 0;
    }
    *out = (group_views){.n_groups = n_groups, .v = v};
done:
    return status;
}

static void group_views_free(group_views *v) {
    free(v->v);
    *v = (group_views){0};
}

coherence_figures coherence_measure(const group_views *v, const double *area, const uint32_t *elements,
                                    size_t count) {
    double sum[VIEWS_MOST] = {0}, squares = 0, total = 0, resultant = 0;
    for (size_t i = 0; i < count; i++) {
        const double A = area[elements[i]];
        const float *v_e = v->v + elements[i] * v->n_groups;
        double square = 0;
        for (size_t g = 0; g < v->n_groups; g++) {
            const double x = (double)v_e[g];
            sum[g] += A * x;
            square += x * x;
        }
        squares += A * square;
        total += A;
    }
    for (size_t g = 0; g < v->n_groups; g++) resultant += sum[g] * sum[g];
    /* sum A |v_e - v|^2 = sum A |v_e|^2 - |sum A v_e|^2 / sum A */
    const double loss = squares - resultant / total;
    if (!(loss > indistinct * squares)) return (coherence_figures){total, 0, 1};
    return (coherence_figures){total, loss, fmax(0, 1 - loss / squares)};
}

/* A patch that may still be split: element[first] ... element[last-1]. */
typedef struct piece {
    size_t first, last;
    coherence_figures figures;
} piece;

typedef struct sort_key {
    double at;
    uint32_t element;
} sort_key;

/* All patches. Those with more than one element are also in a heap, the one of largest loss on top. */
typedef struct splitter {
    const build_problem *problem;
    const group_views *views; /* NULL: patches are compared by area alone */
    uint32_t *element;        /* [n] */
    piece *pieces;            /* room for n */
    size_t n_pieces;
    size_t *heap; /* room for n */
    size_t n_heap;
    sort_key *keys; /* [n] */
} splitter;

static void splitter_free(splitter *s) {
    free(s->element);
    free(s->pieces);
    free(s->heap);
    free(s->keys);
}

static lam_status splitter_create(const build_problem *problem, const group_views *v, splitter *out,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n;
    splitter s = {.problem = problem, .views = v};
    s.element = memory_allocate(n, sizeof *s.element, "patches", error);
    s.pieces = memory_allocate(n, sizeof *s.pieces, "patches", error);
    s.heap = memory_allocate(n, sizeof *s.heap, "patches", error);
    s.keys = memory_allocate(n, sizeof *s.keys, "patches", error);
    if (s.element == NULL || s.pieces == NULL || s.heap == NULL || s.keys == NULL) TRY(LAM_ERR_MEMORY);
    *out = s;
    s = (splitter){0};
done:
    splitter_free(&s);
    return status;
}

static coherence_figures measure(const splitter *s, size_t first, size_t last) {
    if (s->views != NULL)
        return coherence_measure(s->views, s->problem->area, s->element + first, last - first);
    coherence_figures figures = {.coherence = 1};
    for (size_t i = first; i < last; i++) figures.area += s->problem->area[s->element[i]];
    return figures;
}

/* True if patch a is split before patch b: the larger loss first, then the larger area, then the lower
 * number. */
static bool before(const splitter *s, size_t a, size_t b) {
    const coherence_figures *x = &s->pieces[a].figures, *y = &s->pieces[b].figures;
    if (x->loss != y->loss) return x->loss > y->loss;
    if (x->area != y->area) return x->area > y->area;
    return a < b;
}

static void heap_push(splitter *s, size_t patch) {
    size_t at = s->n_heap++;
    while (at > 0 && before(s, patch, s->heap[(at - 1) / 2])) {
        s->heap[at] = s->heap[(at - 1) / 2];
        at = (at - 1) / 2;
    }
    s->heap[at] = patch;
}

static size_t heap_pop(splitter *s) {
    const size_t top = s->heap[0], moved = s->heap[--s->n_heap];
    size_t at = 0;
    for (size_t child = 1; child < s->n_heap; child = 2 * at + 1) {
        if (child + 1 < s->n_heap && before(s, s->heap[child + 1], s->heap[child])) child++;
        if (!before(s, s->heap[child], moved)) break;
        s->heap[at] = s->heap[child];
        at = child;
    }
    s->heap[at] = moved;
    return top;
}

/* Measures a patch and puts it into the heap if it has more than one element. */
static void offer(splitter *s, size_t patch) {
    piece *p = &s->pieces[patch];
    p->figures = measure(s, p->first, p->last);
    if (p->last - p->first > 1) heap_push(s, patch);
}

static int key_order(const void *a, const void *b) {
    const sort_key *x = a, *y = b;
    if (x->at != y->at) return x->at < y->at ? -1 : 1;
    return (x->element > y->element) - (x->element < y->element);
}

/* The longest side of the bounding box of the centres, and its length. */
static int longest_side(const splitter *s, const piece *p, double *length) {
    int longest = 0;
    *length = -1;
    for (int d = 0; d < 3; d++) {
        double low = INFINITY, high = -INFINITY;
        for (size_t i = p->first; i < p->last; i++) {
            const double x = s->problem->centre[s->element[i]][d];
            low = fmin(low, x);
            high = fmax(high, x);
        }
        if (high - low > *length * (1 + 1e-9)) { /* of equal ones, the first */
            *length = high - low;
            longest = d;
        }
    }
    return longest;
}

/* Halves a patch: its elements are sorted along its longest side and cut where the two areas are most nearly
 * equal, if possible between two rows of a regular grid. The second half becomes a new patch. */
static void split(splitter *s, size_t patch) {
    piece *p = &s->pieces[patch];
    const size_t count = p->last - p->first;
    double length, area = 0, sum = 0;
    const int side = longest_side(s, p, &length);
    for (size_t i = 0; i < count; i++) {
        const uint32_t e = s->element[p->first + i];
        s->keys[i] = (sort_key){s->problem->centre[e][side], e};
        area += s->problem->area[e];
    }
    qsort(s->keys, count, sizeof *s->keys, key_order);
    size_t cut = 0;
    for (int rows = 1; rows >= 0 && cut == 0; rows--) {
        double nearest = INFINITY;
        sum = 0;
        for (size_t i = 0; i + 1 < count; i++) {
            sum += s->problem->area[s->keys[i].element];
            if (rows && s->keys[i + 1].at - s->keys[i].at <= 1e-6 * length) continue;
            if (fabs(sum - area / 2) < nearest * (1 - 1e-9)) {
                nearest = fabs(sum - area / 2);
                cut = i + 1;
            }
        }
    }
    for (size_t i = 0; i < count; i++) s->element[p->first + i] = s->keys[i].element;
    s->pieces[s->n_pieces] = (piece){.first = p->first + cut, .last = p->last};
    p->last = p->first + cut;
    s->n_pieces++;
    offer(s, patch);
    offer(s, s->n_pieces - 1);
}

/* The direction among +x, -x, +y, -y, +z, -z that is nearest to a normal, 0 ... 5. */
static uint32_t main_direction(const float normal[3]) {
    uint32_t most = 0;
    for (uint32_t d = 1; d < 3; d++)
        if (fabsf(normal[d]) > fabsf(normal[most]) * 1.0001f) most = d;
    return 2 * most + (normal[most] < 0);
}

/* The initial patches: elements of one surface, or of one main direction, or all of them, the first of these
 * partitions that has at most `most` patches. */
static lam_status start(splitter *s, size_t most, lam_error *error) {
    lam_status status = LAM_OK;
    const build_problem *problem = s->problem;
    const size_t n = problem->n;
    size_t *first = memory_allocate(n + 1, sizeof *first, "patches", error);
    uint32_t *label = memory_allocate(n, sizeof *label, "patches", error), *number = NULL;
    if (first == NULL || label == NULL) TRY(LAM_ERR_MEMORY);
    number = memory_allocate(n < 6 ? 6 : n, sizeof *number, "patches", error);
    if (number == NULL) TRY(LAM_ERR_MEMORY);
    size_t count = 0;
    for (int coarser = 0; coarser < 3 && (count == 0 || count > most); coarser++) {
        memset(number, 0xff, (n < 6 ? 6 : n) * sizeof *number);
        count = 0;
        for (size_t i = 0; i < n; i++) {
            const uint32_t of = coarser == 0   ? problem->surface[i]
                                : coarser == 1 ? main_direction(problem->normal[i])
                                               : 0;
            if (number[of] == UINT32_MAX) number[of] = (uint32_t)count++;
            label[i] = number[of];
        }
    }
    memset(first, 0, (n + 1) * sizeof *first);
    for (size_t i = 0; i < n; i++) first[label[i] + 1]++;
    for (size_t p = 0; p < count; p++) {
        first[p + 1] += first[p];
        s->pieces[p] = (piece){.first = first[p], .last = first[p + 1]};
    }
    for (size_t i = 0; i < n; i++) s->element[first[label[i]]++] = (uint32_t)i;
    s->n_pieces = count;
    for (size_t p = 0; p < count; p++) offer(s, p);
done:
    free(first);
    free(label);
    free(number);
    return status;
}

/* Divides the scene into at most VIEWS_MOST groups of about equal area and gathers the views over them. */
static lam_status find_views(const build_problem *problem, group_views *out, lam_error *error) {
    lam_status status = LAM_OK;
    splitter s = {0};
    uint32_t *group = memory_allocate(problem->n, sizeof *group, "views", error);
    if (group == NULL) TRY(LAM_ERR_MEMORY);
    TRY(splitter_create(problem, NULL, &s, error));
    TRY(start(&s, VIEWS_MOST, error));
    while (s.n_pieces < VIEWS_MOST && s.n_heap > 0) split(&s, heap_pop(&s));
    for (size_t g = 0; g < s.n_pieces; g++)
        for (size_t i = s.pieces[g].first; i < s.pieces[g].last; i++) group[s.element[i]] = (uint32_t)g;
    TRY(group_views_create(problem, group, s.n_pieces, out, error));
done:
    free(group);
    splitter_free(&s);
    return status;
}

/* Fernández et al. 2011, algorithm 1; its list L is the heap. */
static lam_status split_all(splitter *s, const coarse_options *o, const progress *how, lam_error *error) {
    lam_status status = LAM_OK;
    while (s->n_heap > 0 && (o->patches == 0 || s->n_pieces < o->patches)) {
        if (progress_cancelled(how)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
        const size_t patch = heap_pop(s);
        const coherence_figures *figures = &s->pieces[patch].figures;
        if (o->patches > 0 || (figures->coherence < o->coherence && figures->area > o->min_area))
            split(s, patch);
    }
done:
    return status;
}

/* cos 60 degrees */
static const double facing = .5;

typedef struct site {
    double centre[3]; /* centroid by area */
    double normal[3]; /* mean by area, of length 1 or 0 */
} site;

static double square_distance(const double a[3], const double b[3]) {
    const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z;
}

static site site_of(const build_problem *problem, const uint32_t *elements, size_t count) {
    site s = {{0}, {0}};
    double area = 0, length = 0;
    for (size_t i = 0; i < count; i++) {
        const uint32_t e = elements[i];
        for (int d = 0; d < 3; d++) {
            s.centre[d] += problem->area[e] * problem->centre[e][d];
            s.normal[d] += problem->area[e] * (double)problem->normal[e][d];
        }
        area += problem->area[e];
    }
    for (int d = 0; d < 3; d++) {
        s.centre[d] /= area;
        s.normal[d] /= area;
        length += s.normal[d] * s.normal[d];
    }
    /* A patch whose normals cancel has no mean normal, so no element is assigned to it. */
    for (int d = 0; d < 3; d++) s.normal[d] = length > 1e-12 ? s.normal[d] / sqrt(length) : 0;
    return s;
}

static uint32_t nearest_site(const build_problem *problem, size_t k, const site *sites, size_t e,
                             uint32_t own) {
    const float *normal = problem->normal[e];
    uint32_t best = own;
    double best_distance = INFINITY;
    for (size_t p = 0; p < k; p++) {
        const double *m = sites[p].normal;
        if ((double)normal[0] * m[0] + (double)normal[1] * m[1] + (double)normal[2] * m[2] < facing) continue;
        const double distance = square_distance(problem->centre[e], sites[p].centre);
        if (distance < best_distance) {
            best_distance = distance;
            best = (uint32_t)p;
        }
    }
    return best;
}

/* Assigns elements to patches by proximity (Fernández et al. 2011, section 3.2): an element moves to the
 * patch of nearest centroid among those whose mean normal is within 60 degrees of its own, the first of equal
 * ones, and stays if there is none. The element nearest to a patch's centroid stays, so that no patch is
 * emptied. element and begin are changed in place; the elements of a patch come out in mesh order. */
static lam_status assign_by_proximity(const build_problem *problem, size_t k, uint32_t *element,
                                      uint64_t *begin, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n;
    site *sites = memory_allocate(k, sizeof *sites, "patches", error);
    uint32_t *patch = memory_allocate(n, sizeof *patch, "patches", error), *stays = NULL;
    stays = memory_allocate(k, sizeof *stays, "patches", error);
    if (sites == NULL || patch == NULL || stays == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t p = 0; p < k; p++) {
        double nearest = INFINITY;
        sites[p] = site_of(problem, element + begin[p], begin[p + 1] - begin[p]);
        for (uint64_t i = begin[p]; i < begin[p + 1]; i++) {
            const double distance = square_distance(problem->centre[element[i]], sites[p].centre);
            patch[element[i]] = (uint32_t)p;
            if (distance < nearest) {
                nearest = distance;
                stays[p] = element[i];
            }
        }
    }
#pragma omp parallel for schedule(static, 64)
    for (size_t e = 0; e < n; e++)
        if (stays[patch[e]] != e) patch[e] = nearest_site(problem, k, sites, e, patch[e]);

    memset(begin, 0, (k + 1) * sizeof *begin);
    for (size_t e = 0; e < n; e++) begin[patch[e] + 1]++;
    for (size_t p = 0; p < k; p++) begin[p + 1] += begin[p];
    for (size_t e = n; e-- > 0;) /* backwards: begin[p + 1] ends at the first element of patch p */
        element[--begin[patch[e] + 1]] = (uint32_t)e;
    memmove(begin, begin + 1, k * sizeof *begin);
    begin[k] = n;
done:
    free(sites);
    free(patch);
    free(stays);
    return status;
}

static int piece_order(const void *a, const void *b) {
    const piece *p = a, *q = b;
    return (p->first > q->first) - (p->first < q->first);
}

/* Area and coherence of each final patch, and the smallest of both. */
static void judge_patches(const build_problem *problem, const group_views *v, coarse_mesh *c) {
    c->smallest_area = c->smallest_coherence = INFINITY;
    for (size_t p = 0; p < c->k; p++) {
        const coherence_figures figures =
            coherence_measure(v, problem->area, c->element + c->begin[p], c->begin[p + 1] - c->begin[p]);
        c->area[p] = figures.area;
        c->coherence[p] = (float)figures.coherence;
        c->smallest_area = fmin(c->smallest_area, figures.area);
        c->smallest_coherence = fmin(c->smallest_coherence, figures.coherence);
    }
}

lam_status coarse_mesh_create(const build_problem *problem, const coarse_options *options, const progress *p,
                              coarse_mesh *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n;
    group_views v = {0};
    splitter s = {0};
    coarse_mesh c = {.n = n};
    TRY(find_views(problem, &v, error));
    TRY(splitter_create(problem, &v, &s, error));
    TRY(start(&s, options->patches > 0 ? options->patches : n, error));
    TRY(split_all(&s, options, p, error));
    qsort(s.pieces, s.n_pieces, sizeof *s.pieces, piece_order);

    c.k = s.n_pieces;
    c.begin = memory_allocate(c.k + 1, sizeof *c.begin, "patches", error);
    c.area = memory_allocate(c.k, sizeof *c.area, "patches", error);
    c.coherence = memory_allocate(c.k, sizeof *c.coherence, "patches", error);
    if (c.begin == NULL || c.area == NULL || c.coherence == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t q = 0; q < c.k; q++) c.begin[q + 1] = s.pieces[q].last;
    c.element = s.element;
    s.element = NULL;
    if (options->proximity) TRY(assign_by_proximity(problem, c.k, c.element, c.begin, error));
    judge_patches(problem, &v, &c);
    *out = c;
    c = (coarse_mesh){0};
done:
    group_views_free(&v);
    splitter_free(&s);
    coarse_mesh_free(&c);
    return status;
}

void coarse_mesh_free(coarse_mesh *mesh) {
    free(mesh->element);
    free(mesh->begin);
    free(mesh->area);
    free(mesh->coherence);
    *mesh = (coarse_mesh){0};
}
