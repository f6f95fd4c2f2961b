/* Makes the nodes of a shadow tree from above: of the parts of a node the one that costs most is split until
 * there are eight. A part costs its boxes' area times its triangles; the place of a split is found among
 * bins. */
#include "solver/shadow/shadow_private.h"
#include "solver/shadow/shadow_tree.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BINS = 16 };

typedef struct box {
    float low[3], high[3];
} box;

/* Triangles first ... first + count - 1 of the order so far. */
typedef struct part {
    uint32_t first, count;
    box around, middles;
} part;

typedef struct building {
    shadow_tree *tree;
    box *boxes;  /* [n_pieces], of the triangles in their order */
    size_t room; /* of nodes */
} building;

static const box nothing = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

static void box_add(box *to, const float low[3], const float high[3]) {
    for (int d = 0; d < 3; d++) {
        to->low[d] = low[d] < to->low[d] ? low[d] : to->low[d];
        to->high[d] = high[d] > to->high[d] ? high[d] : to->high[d];
    }
}

static float box_area(const box *b) {
    const float x = b->high[0] - b->low[0], y = b->high[1] - b->low[1], z = b->high[2] - b->low[2];
    return x < 0 ? 0 : x * y + y * z + z * x;
}

static float middle_of(const box *b, int d) {
    return .5f * (b->low[d] + b->high[d]);
}

static part part_of(const building *b, uint32_t first, uint32_t count) {
    part p = {first, count, nothing, nothing};
    for (uint32_t k = first; k < first + count; k++) {
        const box *of = &b->boxes[k];
        const float middle[3] = {middle_of(of, 0), middle_of(of, 1), middle_of(of, 2)};
        box_add(&p.around, of->low, of->high);
        box_add(&p.middles, middle, middle);
    }
    return p;
}

static void swap(building *b, uint32_t i, uint32_t j) {
    const uint32_t piece = b->tree->pieces[i];
    const box of = b->boxes[i];
    b->tree->pieces[i] = b->tree->pieces[j];
    b->boxes[i] = b->boxes[j];
    b->tree->pieces[j] = piece;
    b->boxes[j] = of;
}

/* Puts triangles whose middle along d is below `at` first; returns their number. */
static uint32_t divide(building *b, const part *p, int d, float at) {
    uint32_t below = p->first;
    for (uint32_t k = p->first; k < p->first + p->count; k++)
        if (middle_of(&b->boxes[k], d) < at) swap(b, k, below++);
    return below - p->first;
}

/* The cheapest split of a part by bins along its axes: its place *at on axis *d. False: all middles are one.
 */
static bool find_split(const building *b, const part *p, int *d, float *at) {
    float least = INFINITY;
    for (int axis = 0; axis < 3; axis++) {
        const float low = p->middles.low[axis], extent = p->middles.high[axis] - low;
        const float scale = (float)BINS / extent;
        box bin[BINS], left = nothing, right = nothing;
        uint32_t count[BINS] = {0}, n_left = 0;
        float behind[BINS];
        if (!(extent > 0 && isfinite(scale))) continue;
        for (int k = 0; k < BINS; k++) bin[k] = nothing;
        for (uint32_t k = p->first; k < p->first + p->count; k++) {
            const int of = (int)((middle_of(&b->boxes[k], axis) - low) * scale),
                      in = of < BINS ? of : BINS - 1;
            box_add(&bin[in], b->boxes[k].low, b->boxes[k].high);
            count[in]++;
        }
        uint32_t n_right = 0;
        for (int k = BINS - 1; k > 0; k--) {
            box_add(&right, bin[k].low, bin[k].high);
            n_right += count[k];
            behind[k] = box_area(&right) * (float)n_right;
        }
        for (int k = 1; k < BINS; k++) {
            box_add(&left, bin[k - 1].low, bin[k - 1].high);
            n_left += count[k - 1];
            const float cost = box_area(&left) * (float)n_left + behind[k];
            if (n_left == 0 || n_left == p->count || !(cost < least)) continue;
            least = cost;
            *d = axis;
            *at = low + (float)k / scale;
        }
    }
    return isfinite(least);
}

/* Puts the `half` triangles of lowest middle along the longest axis first (quickselect: Hoare 1961). */
static void divide_evenly(building *b, const part *p, uint32_t half) {
    int d = 0;
    uint32_t first = p->first, last = p->first + p->count - 1;
    const uint32_t wanted = p->first + half;
    for (int axis = 1; axis < 3; axis++)
        if (p->middles.high[axis] - p->middles.low[axis] > p->middles.high[d] - p->middles.low[d]) d = axis;
    while (first < last) {
        const float pivot = middle_of(&b->boxes[first + (last - first) / 2], d);
        uint32_t i = first, j = last;
        while (i <= j) {
            while (middle_of(&b->boxes[i], d) < pivot) i++;
            while (middle_of(&b->boxes[j], d) > pivot) j--;
            if (i > j) break;
            swap(b, i++, j);
            if (j-- == 0) break;
        }
        if (wanted <= j && j < last)
            last = j;
        else if (wanted >= i)
            first = i;
        else
            return;
    }
}

static void split(building *b, int level, const part *p, part *left, part *right) {
    int d = 0;
    float at = 0;
    uint32_t half = 0;
    if (level < SHADOW_UNEVEN && find_split(b, p, &d, &at)) half = divide(b, p, d, at);
    if (half == 0 || half == p->count) {
        half = p->count / 2;
        divide_evenly(b, p, half);
    }
    *left = part_of(b, p->first, half);
    *right = part_of(b, p->first + half, p->count - half);
}

/* Splits a part into at most SHADOW_WIDTH; their number. */
static int parts_of(building *b, int level, const part *whole, part parts[SHADOW_WIDTH]) {
    int n = 1;
    parts[0] = *whole;
    while (n < SHADOW_WIDTH) {
        int worst = -1;
        float most = -1;
        for (int k = 0; k < n; k++) {
            const float cost = level < SHADOW_UNEVEN ? box_area(&parts[k].around) * (float)parts[k].count
                                                     : (float)parts[k].count;
            if (parts[k].count <= SHADOW_LEAF || !(cost > most)) continue;
            most = cost;
            worst = k;
        }
        if (worst < 0) break;
        part left, right;
        split(b, level, &parts[worst], &left, &right);
        parts[worst] = left;
        parts[n++] = right;
    }
    return n;
}

static lam_status add_node(building *b, uint32_t *at, lam_error *error) {
    shadow_tree *t = b->tree;
    if (t->n_nodes == b->room) {
        const size_t room = 2 * b->room + 1;
        shadow_node *more = realloc(t->nodes, room * sizeof *more);
        if (more == NULL) return status_fail(error, LAM_ERR_MEMORY, "not enough memory for shadows");
        t->nodes = more;
        b->room = room;
    }
    *at = (uint32_t)t->n_nodes++;
    memset(&t->nodes[*at], 0, sizeof t->nodes[*at]);
    return LAM_OK;
}

/* Fills the node `at` with the parts of a part. Boxes are wider by a rounding. */
static lam_status fill(building *b, uint32_t at, const part *whole, int level, lam_error *error) {
    lam_status status = LAM_OK;
    part parts[SHADOW_WIDTH];
    const float wider = b->tree->rounding;
    const int n = parts_of(b, level, whole, parts);
    assert(level < SHADOW_LEVELS);
    for (int k = 0; k < SHADOW_WIDTH; k++) {
        shadow_node *node = &b->tree->nodes[at];
        for (int d = 0; d < 3; d++) {
            node->low[d][k] = k < n ? parts[k].around.low[d] - wider : INFINITY;
            node->high[d][k] = k < n ? parts[k].around.high[d] + wider : -INFINITY;
        }
        if (k >= n) continue;
        node->child[k] = parts[k].first;
        if (parts[k].count <= SHADOW_LEAF) {
            node->count[k] = (uint8_t)parts[k].count;
            continue;
        }
        uint32_t child = 0;
        TRY(add_node(b, &child, error));
        b->tree->nodes[at].child[k] = child;
        TRY(fill(b, child, &parts[k], level + 1, error));
    }
done:
    return status;
}

size_t shadow_tree_bytes_most(size_t n) {
    /* A node has two parts of more than SHADOW_LEAF triangles together, or is the root. */
    const size_t pieces = 2, nodes = 1;
    const size_t of_panes = sizeof(bool) + sizeof(struct group_glass) + pieces * sizeof(uint32_t);
    const size_t each = sizeof(float[4][3]) + sizeof(float[3]) + 1 + of_panes +
                        pieces * (sizeof(uint32_t) + sizeof(box)) + nodes * 2 * sizeof(shadow_node);
    size_t bytes;
    return size_multiply(n + 2, each, &bytes) ? bytes : SIZE_MAX;
}

lam_status shadow_tree_build(shadow_tree *t, lam_error *error) {
    lam_status status = LAM_OK;
    building b = {.tree = t};
    uint32_t root = 0;
    b.boxes = memory_allocate(t->n_pieces, sizeof *b.boxes, "the shadows of a scene", error);
    if (b.boxes == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t p = 0; p < t->n_pieces; p++) {
        const float(*corner)[3] = (const float(*)[3])t->corners[t->pieces[p] >> 1];
        const uint32_t second = 1 + (t->pieces[p] & 1);
        b.boxes[p] = nothing;
        box_add(&b.boxes[p], corner[0], corner[0]);
        box_add(&b.boxes[p], corner[second], corner[second]);
        box_add(&b.boxes[p], corner[second + 1], corner[second + 1]);
    }
    TRY(add_node(&b, &root, error));
    const part whole = part_of(&b, 0, (uint32_t)t->n_pieces);
    TRY(fill(&b, root, &whole, 0, error));
    shadow_node *fits = realloc(t->nodes, t->n_nodes * sizeof *fits);
    if (fits != NULL) t->nodes = fits;
done:
    free(b.boxes);
    return status;
}
