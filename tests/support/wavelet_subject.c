#include "support/wavelet_subject.h"
#include "solver/formfactor/source.h"

static lam_error error;

void scene(subject *s, const char *kind, size_t elements) {
    const generate_options how = {
        .kind = kind, .variant = 1, .terrain = "flat", .elements = elements, .reflectance = -1, .seed = 1};
    const form_factor_options options = {.recipe = {.source = &source_rays, .rays = 256, .seed = 3}};
    form_factors f;
    s->m = generate_good(&how);
    s->order = test_allocate(s->m.n, sizeof *s->order);
    ck_ok(mesh_z_order(&s->m, s->order, &error));
    ck_ok(form_factors_make(&s->m, s->order, &options, &f, &error));
    s->F = f.F;
    f.F = (csr){.n = 0};
    form_factors_free(&f);
}

wavelet_plan plan_of_all(const wavelets *basis) {
    wavelet_plan plan;
    bool *used = test_allocate(basis->n, sizeof *used);
    memset(used, true, basis->n * sizeof *used);
    ck_ok(wavelet_plan_create(basis, used, &plan, &error));
    ck_assert_uint_eq(plan.n_used, basis->n);
    free(used);
    return plan;
}

uint32_t wavelet_subject_part(const subject *s, size_t element) {
    /* Of boxes the third one is one plane. */
    if (element < s->m.n / 3) return 0;
    return memcmp(s->m.normal[element], s->m.normal[s->m.n - 1], sizeof s->m.normal[0]) == 0 ? 2 : 1;
}

subject wavelet_subject_make(int chosen) {
    subject s = {.W = NULL};
    const int which = chosen % SUBJECTS;
    if (which == BOX || which == ROOM) {
        fixture f = fixture_box(which == BOX ? unit_cube : room, which == BOX ? 3 : 7, .5f);
        s.m = f.m;
        s.F = f.F;
        s.order = f.order;
    } else {
        scene(&s, which == CITY ? "city" : "maze", 300);
    }
    const size_t n = s.m.n;
    s.centre = test_allocate(n, sizeof *s.centre);
    for (size_t i = 0; i < n; i++) mesh_centroid(&s.m, i, s.centre[i]);
    uint32_t *part = test_allocate(n, sizeof *part);
    for (size_t i = 0; i < n; i++) part[i] = wavelet_subject_part(&s, i);
    const element_corners corners = {(const double(*)[3])s.m.vertices, (const uint32_t(*)[4])s.m.elements};
    ck_ok(plane_tree_make(n, (const double(*)[3])s.centre, (const float(*)[3])s.m.normal, &corners,
                          chosen < PARTED ? NULL : part, 6, &s.tree, &error));
    free(part);
    ck_ok(wavelet_basis_make(&s.tree, s.m.area, (const double(*)[3])s.centre, &s.basis, &error));
    ck_ok(wavelet_roots_make(&s.tree, &s.basis, &s.roots, &error));
    s.plan = plan_of_all(&s.basis);
    return s;
}

void wavelet_subject_free(subject *s) {
    mesh_free(&s->m);
    csr_free(&s->F);
    free(s->order);
    free(s->centre);
    free(s->W);
    plane_tree_free(&s->tree);
    wavelet_plan_free(&s->plan);
    wavelets_free(&s->basis);
    wavelet_roots_free(&s->roots);
}

void transform(const subject *s, bool back, const float *from, float *to) {
    float *work = test_allocate(wavelet_plan_work(&s->plan), sizeof *work);
    if (back)
        wavelet_plan_inverse(&s->plan, from, to, NULL, NULL, work, 1);
    else
        wavelet_plan_forward(&s->plan, NULL, NULL, from, NULL, to, work, 1);
    free(work);
}

const double *dense_W(subject *s) {
    const size_t n = s->m.n;
    if (s->W != NULL) return s->W;
    float *x = test_allocate(n, sizeof *x), *c = test_allocate(n, sizeof *c);
    s->W = test_allocate(n * n, sizeof *s->W);
    for (size_t p = 0; p < n; p++) {
        memset(x, 0, n * sizeof *x);
        x[p] = 1;
        transform(s, false, x, c);
        for (size_t k = 0; k < n; k++) s->W[k * n + p] = (double)c[k];
    }
    free(x);
    free(c);
    return s->W;
}

double *in_basis(subject *s, const double *A) {
    const size_t n = s->m.n;
    const double *W = dense_W(s);
    double *half = test_allocate(n * n, sizeof *half), *out = test_allocate(n * n, sizeof *out);
    for (size_t i = 0; i < n; i++)
        for (size_t p = 0; p < n; p++) {
            const double w = W[i * n + p];
            for (size_t q = 0; w != 0 && q < n; q++) half[i * n + q] += w * A[p * n + q];
        }
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++)
            for (size_t q = 0; q < n; q++) out[i * n + j] += half[i * n + q] * W[j * n + q];
    free(half);
    return out;
}

double *dense_S(const subject *s) {
    const size_t n = s->m.n;
    double *S = test_allocate(n * n, sizeof *S);
    uint32_t *position = test_allocate(n, sizeof *position);
    for (size_t p = 0; p < n; p++) position[s->tree.order[p]] = (uint32_t)p;
    for (size_t i = 0; i < n; i++)
        for (uint64_t e = s->F.indptr[i]; e < s->F.indptr[i + 1]; e++) {
            const uint32_t j = s->F.indices[e];
            S[position[i] * n + position[j]] = sqrt(s->m.area[i] / s->m.area[j]) * (double)s->F.data[e];
        }
    free(position);
    return S;
}

float *ones(const wavelets *w) {
    float *made = test_allocate(w->n_nodes, sizeof *made);
    for (size_t t = 0; t < w->n_nodes; t++) made[t] = 1;
    return made;
}

csr pass_of(const subject *s, const csr *F, bool one_sided, double reach, float threshold,
            const float *weight, size_t n_threads) {
    row_source rows;
    csr S = {.n = 0};
    row_source_of_csr(&rows, F);
    const wavelet_pass_input input = {.basis = &s->basis,
                                      .rows = &rows,
                                      .one_sided = one_sided,
                                      .area = s->m.area,
                                      .tree = &s->tree,
                                      .threshold = threshold,
                                      .weight = weight,
                                      .centre = (const double(*)[3])s->centre,
                                      .reach = reach,
                                      .n_threads = n_threads};
    ck_ok(wavelet_pass(&input, &S, &error));
    return S;
}

csr pass_within(const subject *s, double reach, float threshold, const float *weight, size_t n_threads) {
    return pass_of(s, &s->F, false, reach, threshold, weight, n_threads);
}

csr pass(const subject *s, float threshold, const float *weight, size_t n_threads) {
    return pass_within(s, INFINITY, threshold, weight, n_threads);
}

double *whole(const csr *upper) {
    const size_t n = upper->n;
    double *A = test_allocate(n * n, sizeof *A);
    for (size_t i = 0; i < n; i++)
        for (uint64_t e = upper->indptr[i]; e < upper->indptr[i + 1]; e++) {
            const uint32_t j = upper->indices[e];
            ck_assert(j >= i && (e == upper->indptr[i] || j > upper->indices[e - 1]));
            A[i * n + j] = A[j * n + i] = (double)upper->data[e];
        }
    return A;
}

double largest_difference(size_t count, const double *A, const double *B) {
    double most = 0;
    for (size_t k = 0; k < count; k++) most = fmax(most, fabs(A[k] - B[k]));
    return most;
}
