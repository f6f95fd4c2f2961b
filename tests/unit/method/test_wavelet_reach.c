/* Where the rows of a leaf begin, and what far clusters make of them at once. */
#include "solver/base/random.h"
#include "support/wavelet_subject.h"

static lam_error error;

static wavelet_reach reach_make(const subject *s, double radii) {
    wavelet_reach r;
    ck_ok(
        wavelet_reach_make(&s->basis, &s->tree, s->m.area, (const double(*)[3])s->centre, radii, &r, &error));
    return r;
}

/* The scaling coefficients of node t for a 1 at position p, level by level. */
static void hand_up(const wavelets *w, size_t t, size_t p, double up[3]) {
    const wavelet_node *a = &w->nodes[t];
    const float *columns = w->padded + (size_t)a->shape * 2 * WAVELET_INPUTS * WAVELET_INPUTS;
    double in[WAVELET_INPUTS] = {0}, below[3];
    if (a->from_left == 0) {
        in[p - a->begin] = 1;
    } else {
        const bool left = p < w->nodes[t - 1].begin;
        const size_t child = left ? a->left : t - 1;
        hand_up(w, child, p, below);
        for (size_t k = 0; k < w->nodes[child].scaling; k++) in[(left ? 0 : a->from_left) + k] = below[k];
    }
    for (size_t k = 0; k < 3; k++) {
        up[k] = 0;
        for (size_t m = 0; m < a->inputs && k < a->scaling; m++)
            up[k] += (double)columns[m * WAVELET_INPUTS + k] * in[m];
    }
}

/* Shared matrices differ by 1e-5 from a node's own; a level adds that, and there are at most twelve. */
START_TEST(far_clusters_at_once) {
    subject s = wavelet_subject_make(_i);
    wavelet_reach r = reach_make(&s, 2);
    double most = 0;
    for (size_t t = 0; t < s.basis.n_nodes; t++) {
        const wavelet_node *a = &s.basis.nodes[t];
        const wavelet_affine *f = &r.affine[t];
        if (s.tree.clusters[t].apart) {
            ck_assert(isinf(r.extent[t].radius)); /* it is near everything */
            continue;
        }
        for (size_t p = a->begin; p < a->begin + a->n_elements; p++) {
            const wavelet_place *at = &r.place[p];
            double up[3];
            hand_up(&s.basis, t, p, up);
            for (size_t k = 0; k < 3; k++) {
                const float value =
                    at->root * (f->of[k][0] + f->of[k][1] * (at->u - f->u) + f->of[k][2] * (at->v - f->v));
                most = fmax(most, fabs((double)value - up[k]));
            }
        }
    }
    ck_assert_double_le(most, 12e-5);
    wavelet_reach_free(&r);
    wavelet_subject_free(&s);
}
END_TEST

/* Checks for some positions, from few to all but a few, that the cells that hold them are found, in order and
 * no others. */
static void cells_of_some(const wavelet_reach *r, size_t leaf, const uint32_t *cells, size_t count) {
    const wavelets *w = r->basis;
    uint32_t *lit = test_allocate(w->n, sizeof *lit), *found = test_allocate(r->n_leaves, sizeof *found);
    uint32_t *work = test_allocate(2 * r->height[w->n_nodes - 1] + 4, sizeof *work);
    uint64_t seed = leaf;
    for (int share = 1; share < 1000; share *= 4) {
        size_t n_lit = 0, next = 0, at = 0;
        for (size_t p = 0; p < w->n; p++)
            if (random_unit(&seed) * share < .97) lit[n_lit++] = (uint32_t)p;
        const size_t n_found = wavelet_cells(r, leaf, lit, n_lit, found, work);
        for (size_t c = 0; c < count; c++) {
            const wavelet_node *b = &w->nodes[cells[c]];
            const size_t before = next;
            while (next < n_lit && lit[next] < b->begin + b->n_elements) next++;
            if (next == before) continue;
            ck_assert_uint_lt(at, n_found);
            ck_assert_uint_eq(found[at++], cells[c]);
        }
        ck_assert_uint_eq(at, n_found);
    }
    ck_assert_uint_eq(wavelet_cells(r, leaf, lit, 0, found, work), 0);
    free(lit);
    free(found);
    free(work);
}

/* Cells share out all positions. None is near to a node above the leaf that is as high at most, and of none
 * that was divided is that so; brothers divide alike what is as high as their parent. */
START_TEST(cells_of_a_leaf) {
    subject s = wavelet_subject_make(_i);
    wavelet_reach r = reach_make(&s, 2);
    const wavelets *w = &s.basis;
    const size_t N = w->n_nodes;
    uint32_t *cells = test_allocate(r.n_leaves, sizeof *cells);
    uint32_t *work = test_allocate(2 * r.height[N - 1] + 4, sizeof *work);
    uint32_t *every = test_allocate(w->n, sizeof *every);
    size_t coarse = 0;
    for (size_t p = 0; p < w->n; p++) every[p] = (uint32_t)p;
    for (size_t leaf = 0; leaf < N; leaf++) {
        if (w->nodes[leaf].from_left > 0) continue;
        const size_t count = wavelet_cells(&r, leaf, every, w->n, cells, work);
        if (leaf % 5 == 0) cells_of_some(&r, leaf, cells, count);
        size_t next = 0;
        for (size_t c = 0; c < count; c++) {
            const wavelet_node *b = &w->nodes[cells[c]];
            ck_assert(b->begin == next);
            ck_assert(!s.tree.clusters[cells[c]].apart); /* no closed form holds for its functions */
            next += b->n_elements;
            coarse += b->from_left > 0;
            for (size_t a = leaf; b->from_left > 0; a = w->nodes[a].parent) {
                if (r.height[a] > r.height[cells[c]]) break;
                ck_assert(!wavelet_is_near(&r, a, cells[c]));
            }
        }
        ck_assert_uint_eq(next, w->n);
    }
    ck_assert((coarse > 0) == (_i % SUBJECTS != BOX)); /* which is so small that all is near */
    free(every);
    free(cells);
    free(work);
    wavelet_reach_free(&r);
    wavelet_subject_free(&s);
}
END_TEST

/* True where a node knows another of its height whole: both halves of it. */
static bool sees_all(const wavelet_reach *r, size_t a, size_t b) {
    const wavelet_node *node = &r->basis->nodes[b];
    if (node->from_left == 0) return wavelet_is_near(r, a, b);
    return wavelet_is_near(r, a, node->left) && wavelet_is_near(r, a, b - 1);
}

/* Coefficients of two nodes of one height that see each other are those of a pass that looks everywhere. */
START_TEST(what_is_near_is_whole) {
    subject s = wavelet_subject_make(_i);
    const size_t n = s.m.n;
    float *weight = ones(&s.basis);
    wavelet_reach r = reach_make(&s, 1);
    csr far = pass(&s, 0, weight, 1), near = pass_within(&s, 1, 0, weight, 2);
    double *all = whole(&far), *some = whole(&near);
    size_t compared = 0, left_out = 0;
    for (size_t t = 0; t < s.basis.n_nodes; t++)
        for (size_t u = 0; u < s.basis.n_nodes; u++) {
            const wavelet_node *a = &s.basis.nodes[t], *b = &s.basis.nodes[u];
            if (r.height[t] != r.height[u]) continue;
            const bool whole_there = sees_all(&r, t, u) && sees_all(&r, u, t);
            for (size_t i = a->first; i < a->first + a->inputs - a->scaling; i++)
                for (size_t j = b->first; j < b->first + b->inputs - b->scaling; j++) {
                    left_out += some[i * n + j] == 0 && all[i * n + j] != 0;
                    if (!whole_there) continue;
                    ck_assert(fabs(some[i * n + j] - all[i * n + j]) < 1e-4);
                    compared += some[i * n + j] != 0;
                }
        }
    ck_assert_uint_gt(compared, n);
    ck_assert((left_out > 0) == (_i % SUBJECTS != BOX));
    csr_free(&far);
    csr_free(&near);
    free(weight);
    free(all);
    free(some);
    wavelet_reach_free(&r);
    wavelet_subject_free(&s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("wavelet reach");
    TCase *cases = tcase_create("wavelet reach");
    tcase_set_timeout(cases, 240);
    tcase_add_loop_test(cases, far_clusters_at_once, 0, SUBJECTS_AND_PARTED);
    tcase_add_loop_test(cases, cells_of_a_leaf, 0, SUBJECTS_AND_PARTED);
    tcase_add_loop_test(cases, what_is_near_is_whole, 0, SUBJECTS_AND_PARTED);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
