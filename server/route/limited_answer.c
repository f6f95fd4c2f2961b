#include "server/route/limited_answer.h"

#include "server/queue/batch.h"
#include "server/scene/scene.h"

#include <stdlib.h>
#include <string.h>

/* Finds the elements of the groups of the selected ones. Until they are known their number is taken for that
 * of all; beside them a flag for each element is held. */
static bool find_whole(const call *in, const radiosity_request *request, limited_solve *l, problem *why) {
    const scene *s = in->scene;
    const size_t most = bytes_times(s->n, sizeof *l->whole + 1);
    lam_error error;
    if (!request_memory_take(in->memory, most, why)) return false;
    if (limiter_whole_groups(&s->limiter, request->n_selected, request->selected, &l->whole, &l->n_whole,
                             &error) != LAM_OK)
        return problem_set(why, PROBLEM_NO_MEMORY, "%s", error.message);
    request_memory_give_back(in->memory, most - l->n_whole * sizeof *l->whole);
    const size_t n_rhs = request->n_rhs < BATCH_PASS ? request->n_rhs : BATCH_PASS;
    l->room = call_allocate(in, bytes_times(n_rhs * s->n_channels, bytes_times(l->n_whole, sizeof *l->room)),
                            "the groups of selected elements", why);
    return l->room != NULL;
}

bool limited_begin(const call *in, const radiosity_request *request, limited_solve *out, answer_notes *notes,
                   problem *why) {
    if (request->linear_map) return true;
    out->limited = call_allocate(in, bytes_times(request->n_rhs, sizeof *out->limited), "the limiter", why);
    if (out->limited == NULL) return false;
    notes->limited = out->limited;
    /* A reduction has selected whole groups by itself. */
    return !request->select || request->reduce.on || request->n_selected == 0 ||
           find_whole(in, request, out, why);
}

void limited_free(limited_solve *l) {
    free(l->limited);
    free(l->whole);
    free(l->room);
}

float *limited_place(const limited_solve *l, const radiosity_request *request, float *out, size_t *n_selected,
                     const uint32_t **selected) {
    *n_selected = l->whole != NULL ? l->n_whole : request->n_selected;
    *selected = l->whole != NULL ? l->whole : request->select ? request->selected : NULL;
    return l->whole != NULL ? l->room : out;
}

/* Copies the selected elements of `rows` rows out of those of their groups. where: [n], work. */
static void pick(const limited_solve *l, const radiosity_request *request, size_t rows, float *out,
                 uint32_t *where) {
    for (size_t k = 0; k < l->n_whole; k++) where[l->whole[k]] = (uint32_t)k;
    for (size_t row = 0; row < rows; row++)
        for (size_t k = 0; k < request->n_selected; k++)
            out[row * request->n_selected + k] = l->room[row * l->n_whole + where[request->selected[k]]];
}

void limited_finish(const scene *s, const limited_solve *l, const radiosity_request *request, size_t first,
                    size_t count, const float *H0, const float *W, float *out, void *work) {
    const size_t before = first * s->n_channels;
    size_t n_selected;
    const uint32_t *selected;
    if (l->limited == NULL) return;
    const limiter_light light = {.E = W == NULL ? request->E + before * s->n : NULL,
                                 .H0 = H0 != NULL ? H0 + before * s->n : NULL,
                                 .W = W != NULL ? W + before * s->n_emitters : NULL};
    float *values = limited_place(l, request, out, &n_selected, &selected);
    limiter_limit(&s->limiter, s->op, count, request->quantity, &light, n_selected, selected, values,
                  l->limited + first, work);
    /* The work area of the limiter has room for a number of each element. */
    if (l->whole != NULL) pick(l, request, count * s->n_channels, out, work);
}

void limited_set_header(const limited_solve *l, size_t n_rhs, answer *out) {
    out->counts_limited = l->limited != NULL;
    for (size_t v = 0; out->counts_limited && v < n_rhs; v++) out->limited += l->limited[v];
}
