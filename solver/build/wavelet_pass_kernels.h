/* What wavelet_pass.c spends its time in; compiled once for each instruction set. KERNEL(name), TARGET,
 * BEYOND(v, x): a bit for every lane of *v whose magnitude is above x. No include guard: it is included for
 * each. */

/* Lanes are turned by the matrix of a node: out_k = sum_m Q_km in_m. */
static inline TARGET void KERNEL(turn_lanes)(const float *columns, size_t inputs, const float *x, lanes *y) {
    lanes sum = x[0] * *(const lanes_unaligned *)columns;
    for (size_t m = 1; m < inputs; m++)
        sum += x[m] * *(const lanes_unaligned *)(columns + m * WAVELET_INPUTS);
    *y = sum;
}

/* Rows of the left and the right child, on the same clusters, become those of their parent. */
static TARGET void KERNEL(merge)(const wavelets *w, size_t node, const kept_rows *left,
                                 const kept_rows *right, live_rows *out) {
    const wavelet_node *a = &w->nodes[node];
    const float *columns = wavelet_columns(w, a);
    size_t l = 0, r = 0, used = 0;
    while (l < left->count || r < right->count) {
        const uint32_t at_left = l < left->count ? left->cluster[l] : UINT32_MAX;
        const uint32_t at_right = r < right->count ? right->cluster[r] : UINT32_MAX;
        const uint32_t at = at_left < at_right ? at_left : at_right;
        const size_t scaling = w->nodes[at].scaling;
        for (size_t k = 0; k < scaling; k++) {
            float x[WAVELET_INPUTS] = {0};
            if (at == at_left)
                for (size_t m = 0; m < a->from_left; m++) x[m] = left->value[l].of[k][m];
            if (at == at_right)
                for (size_t m = a->from_left; m < a->inputs; m++)
                    x[m] = right->value[r].of[k][m - a->from_left];
            KERNEL(turn_lanes)(columns, a->inputs, x, &out->value[used].of[k]);
        }
        out->cluster[used++] = at;
        l += at == at_left;
        r += at == at_right;
    }
    out->count = used;
}

/* out_k += Q_km x for all k: input m of a node on its way up. */
static inline TARGET void KERNEL(spread)(const float *columns, size_t inputs, size_t m, const lanes *x,
                                         lanes *out) {
    const float *column = columns + m * WAVELET_INPUTS;
    for (size_t k = 0; k < inputs; k++) out[k] += column[k] * *x;
}

/* What a column's wavelets are to the rows that are handed up: as far as that column looks. */
static inline TARGET lam_status KERNEL(add_details)(const pass_row *row, uint32_t b, const lanes *out,
                                                    desk *d, lam_error *error) {
    const wavelet_node *node = &row->job->input->basis->nodes[b];
    if (!wavelet_is_near(&row->job->reach, b, row->node)) return LAM_OK;
    const lam_status status = details_reserve(&d->fresh, node->inputs - node->scaling, error);
    if (status != LAM_OK) return status;
    for (size_t k = node->scaling; k < node->inputs; k++) {
        detail *const to = &d->fresh.list[d->fresh.count++];
        *to =
            (detail){.j = node->first + (uint32_t)(k - node->scaling), .weight = row->job->input->weight[b]};
        for (int lane = 0; lane < DETAIL_LANES; lane++) to->of[lane] = out[k][lane];
    }
    return LAM_OK;
}

/* Keeps what of a column's wavelets is above the threshold, and hands its scaling up. */
static inline TARGET lam_status KERNEL(hand_up)(const pass_row *row, uint32_t b, unsigned wanted,
                                                const lanes *out, block *up, desk *d, lam_error *error) {
    const wavelet_node *node = &row->job->input->basis->nodes[b];
    for (size_t k = 0; k < node->scaling; k++) up->of[k] = out[k];
    if (wanted & DETAILS) {
        const lam_status status = KERNEL(add_details)(row, b, out, d, error);
        if (status != LAM_OK) return status;
    }
    if (!(wanted & EMIT)) return LAM_OK;
    const float least = row->least * row->job->input->weight[b];
    for (size_t k = node->scaling; k < node->inputs; k++) {
        unsigned beyond = BEYOND(&out[k], least) & row->own_lanes;
        for (; beyond != 0; beyond &= beyond - 1) {
            const unsigned lane = (unsigned)__builtin_ctz(beyond);
            const uint32_t i = row_coefficient(row, lane), j = node->first + (uint32_t)(k - node->scaling);
            const lam_status status = desk_keep(row, d, b, i, j, out[k][lane], error);
            if (status != LAM_OK) return status;
        }
    }
    return LAM_OK;
}

/* Rows on clusters of height below `height` go up to those of that height. */
static TARGET lam_status KERNEL(promote)(const pass_row *row, uint32_t height, unsigned wanted,
                                         const live_rows *in, live_rows *out, desk *d, lam_error *error) {
    lam_status status = LAM_OK;
    const pass_job *job = row->job;
    const wavelets *w = job->input->basis;
    size_t used = 0;
    for (size_t e = 0; e < in->count;) {
        const uint32_t from = in->cluster[e], b = w->nodes[from].parent;
        if (b == WAVELET_NONE || job->reach.height[b] != height) {
            out->cluster[used] = from;
            out->value[used++] = in->value[e++];
            continue;
        }
        const wavelet_node *node = &w->nodes[b];
        const float *columns = wavelet_columns(w, node);
        lanes sums[WAVELET_INPUTS] = {{0}};
        for (; e < in->count && w->nodes[in->cluster[e]].parent == b; e++) {
            const bool is_left = in->cluster[e] == node->left;
            const size_t first = is_left ? 0 : node->from_left;
            const size_t count = is_left ? node->from_left : node->inputs - node->from_left;
            for (size_t m = 0; m < count; m++)
                KERNEL(spread)(columns, node->inputs, first + m, &in->value[e].of[m], sums);
        }
        TRY(KERNEL(hand_up)(row, b, wanted, sums, &out->value[used], d, error));
        out->cluster[used++] = b;
    }
    out->count = used;
done:
    return status;
}

/* Finer columns' wavelets, of the rows of both children: of its own wavelets what is above the threshold is
 * kept (of the root of what it would hand up too), of what it hands up the rest. */
static TARGET lam_status KERNEL(merge_details)(const pass_row *row, const details *left, const details *right,
                                               details *out, desk *d, lam_error *error) {
    lam_status status = LAM_OK;
    const wavelets *w = row->job->input->basis;
    const wavelet_node *a = &w->nodes[row->node];
    const float *columns = wavelet_columns(w, a);
    size_t l = 0, r = 0;
    out->count = 0;
    TRY(details_reserve(out, left->count + right->count, error));
    while (l < left->count || r < right->count) {
        const uint32_t at_left = l < left->count ? left->list[l].j : UINT32_MAX;
        const uint32_t at_right = r < right->count ? right->list[r].j : UINT32_MAX;
        const uint32_t j = at_left < at_right ? at_left : at_right;
        float x[WAVELET_INPUTS] = {0}, weight = 0;
        if (j == at_left) {
            weight = left->list[l].weight;
            for (size_t m = 0; m < a->from_left; m++) x[m] = left->list[l].of[m];
            l++;
        }
        if (j == at_right) {
            weight = right->list[r].weight;
            for (size_t m = a->from_left; m < a->inputs; m++) x[m] = right->list[r].of[m - a->from_left];
            r++;
        }
        lanes y;
        KERNEL(turn_lanes)(columns, a->inputs, x, &y);
        detail *const to = &out->list[out->count++];
        *to = (detail){.j = j, .weight = weight};
        for (int lane = 0; lane < DETAIL_LANES; lane++) to->of[lane] = y[lane];
        const float least = row->least * weight;
        unsigned beyond = BEYOND(&y, least) & row->own_lanes;
        for (; beyond != 0; beyond &= beyond - 1) {
            const unsigned lane = (unsigned)__builtin_ctz(beyond);
            TRY(kept_put(&d->found, row_coefficient(row, lane), j, y[lane], error));
        }
    }
done:
    return status;
}

/* Rows on the elements of a leaf, as they lie in the desk, turned, become what its matrix makes of them. */
static TARGET void KERNEL(gather_leaf)(const pass_row *row, const wavelet_node *a, const wavelet_node *leaf,
                                       const uint32_t *p, size_t count, const desk *d, lanes *sums) {
    const wavelets *w = row->job->input->basis;
    const float *turned = wavelet_columns(w, a);
    const float *columns = wavelet_columns(w, leaf);
    for (size_t k = 0; k < count; k++) {
        lanes x;
        KERNEL(turn_lanes)(turned, a->inputs, (const float *)&d->dense[p[k]], &x);
        d->dense[p[k]] = (lanes){0};
        KERNEL(spread)(columns, leaf->inputs, p[k] - leaf->begin, &x, sums);
    }
}

/* Of a far cluster only what it hands up. */
static TARGET void KERNEL(gather_far)(const pass_row *row, const wavelet_node *a, uint32_t b,
                                      const uint32_t *p, size_t count, const desk *d, lanes *out) {
    const wavelet_reach *reach = &row->job->reach;
    const wavelets *w = reach->basis;
    const wavelet_affine *f = &reach->affine[b];
    const float *turned = wavelet_columns(w, a);
    lanes sums[SCALING] = {{0}};
    for (size_t e = 0; e < count; e++) {
        const wavelet_place *at = &reach->place[p[e]];
        const lanes x = at->root * d->dense[p[e]];
        const float u = at->u - f->u, v = at->v - f->v;
        __builtin_prefetch(&d->dense[p[e + AHEAD]], 1);
        __builtin_prefetch(&reach->place[p[e + AHEAD]]);
        d->dense[p[e]] = (lanes){0};
        for (size_t k = 0; k < SCALING; k++) sums[k] += (f->of[k][0] + f->of[k][1] * u + f->of[k][2] * v) * x;
    }
    for (size_t k = 0; k < SCALING; k++)
        KERNEL(turn_lanes)(turned, a->inputs, (const float *)&sums[k], &out[k]);
}

/* The rows of a leaf, as they lie in the desk, on its cells. */
static TARGET lam_status KERNEL(begin_leaf)(const pass_row *row, size_t node, live_rows *out, desk *d,
                                            lam_error *error) {
    lam_status status = LAM_OK;
    const pass_job *job = row->job;
    const wavelets *w = job->input->basis;
    const size_t n_cells = wavelet_cells(&job->reach, node, d->cells, d->work), n_lit = marks_take(&d->lit);
    const uint32_t *lit = d->lit.taken;
    size_t used = 0, first = 0, last = 0;
    for (size_t c = 0; c < n_cells && last < n_lit; c++, first = last) {
        const uint32_t b = d->cells[c];
        const wavelet_node *cell = &w->nodes[b];
        while (last < n_lit && lit[last] < cell->begin + cell->n_elements) last++;
        if (last == first) continue;
        if (cell->from_left > 0) {
            KERNEL(gather_far)(row, &w->nodes[node], b, lit + first, last - first, d, out->value[used].of);
        } else {
            lanes sums[WAVELET_INPUTS] = {{0}};
            KERNEL(gather_leaf)(row, &w->nodes[node], cell, lit + first, last - first, d, sums);
            const unsigned emit = wavelet_is_near(&job->reach, node, b) ? EMIT : 0;
            TRY(KERNEL(hand_up)(row, b, emit | row->wanted, sums, &out->value[used], d, error));
        }
        out->cluster[used++] = b;
    }
    out->count = used;
done:
    return status;
}

#undef KERNEL
#undef TARGET
#undef BEYOND
