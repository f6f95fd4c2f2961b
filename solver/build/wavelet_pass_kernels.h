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
    const float *columns = w->padded + (size_t)a->shape * 2 * WAVELET_INPUTS * WAVELET_INPUTS;
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

/* Keeps what of a column's wavelets is above the threshold, and hands its scaling up. */
static inline TARGET lam_status KERNEL(hand_up)(const pass_row *row, uint32_t b, bool emit, const lanes *out,
                                                block *up, desk *d, lam_error *error) {
    const wavelet_node *node = &row->job->input->basis->nodes[b];
    for (size_t k = 0; k < node->scaling; k++) up->of[k] = out[k];
    if (!emit) return LAM_OK;
    const float least = row->least * row->job->input->weight[b];
    for (size_t k = node->scaling; k < node->inputs; k++) {
        unsigned beyond = BEYOND(&out[k], least) & row->wavelet_lanes;
        for (; beyond != 0; beyond &= beyond - 1) {
            const int lane = __builtin_ctz(beyond);
            const uint32_t i = row->first + (uint32_t)lane, j = node->first + (uint32_t)(k - node->scaling);
            const lam_status status = desk_keep(row, d, b, i, j, out[k][lane], error);
            if (status != LAM_OK) return status;
        }
    }
    return LAM_OK;
}

/* Rows on clusters of height below `height` go up to those of that height; emit: what of their wavelets is
 * above the threshold is kept. */
static TARGET lam_status KERNEL(promote)(const pass_row *row, uint32_t height, bool emit, const live_rows *in,
                                         live_rows *out, desk *d, lam_error *error) {
    lam_status status = LAM_OK;
    const pass_job *job = row->job;
    const wavelets *w = job->input->basis;
    size_t used = 0;
    for (size_t e = 0; e < in->count;) {
        const uint32_t from = in->cluster[e], b = w->nodes[from].parent;
        if (b == WAVELET_NONE || job->height[b] != height) {
            out->cluster[used] = from;
            out->value[used++] = in->value[e++];
            continue;
        }
        const wavelet_node *node = &w->nodes[b];
        const float *columns = w->padded + (size_t)node->shape * 2 * WAVELET_INPUTS * WAVELET_INPUTS;
        lanes sums[WAVELET_INPUTS] = {{0}};
        for (; e < in->count && w->nodes[in->cluster[e]].parent == b; e++) {
            const bool is_left = in->cluster[e] == node->left;
            const size_t first = is_left ? 0 : node->from_left;
            const size_t count = is_left ? node->from_left : node->inputs - node->from_left;
            for (size_t m = 0; m < count; m++)
                KERNEL(spread)(columns, node->inputs, first + m, &in->value[e].of[m], sums);
        }
        TRY(KERNEL(hand_up)(row, b, emit, sums, &out->value[used], d, error));
        out->cluster[used++] = b;
    }
    out->count = used;
done:
    return status;
}

/* The rows of a leaf, as they lie in the desk, on leaves. */
static TARGET lam_status KERNEL(begin_leaf)(const pass_row *row, size_t node, live_rows *out, desk *d,
                                            lam_error *error) {
    lam_status status = LAM_OK;
    const pass_job *job = row->job;
    const wavelets *w = job->input->basis;
    const wavelet_node *a = &w->nodes[node];
    const float *turned = w->padded + (size_t)a->shape * 2 * WAVELET_INPUTS * WAVELET_INPUTS;
    size_t used = 0;
    for (size_t word = 0; word < (w->n + 63) / 64; word++)
        while (d->touched[word] != 0) {
            const size_t p = word * 64 + (size_t)__builtin_ctzll(d->touched[word]);
            const uint32_t b = job->leaf_of[p];
            const wavelet_node *leaf = &w->nodes[b];
            const float *columns = w->padded + (size_t)leaf->shape * 2 * WAVELET_INPUTS * WAVELET_INPUTS;
            lanes sums[WAVELET_INPUTS] = {{0}};
            for (size_t m = 0; m < leaf->inputs; m++) {
                const size_t at = leaf->begin + m;
                const uint64_t bit = 1ull << (at & 63);
                if ((d->touched[at >> 6] & bit) == 0) continue;
                d->touched[at >> 6] &= ~bit;
                lanes x;
                KERNEL(turn_lanes)(turned, a->inputs, (const float *)&d->dense[at], &x);
                d->dense[at] = (lanes){0};
                KERNEL(spread)(columns, leaf->inputs, m, &x, sums);
            }
            TRY(KERNEL(hand_up)(row, b, is_near(job, node, b), sums, &out->value[used], d, error));
            out->cluster[used++] = b;
        }
    out->count = used;
done:
    return status;
}

#undef KERNEL
#undef TARGET
#undef BEYOND
