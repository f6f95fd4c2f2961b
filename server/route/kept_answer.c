#include "server/route/kept_answer.h"

#include <stdlib.h>

_Static_assert(CODING_ZSTD + 1 == KEPT_FORMS, "a form for each coding");

/* Seconds to compress a byte, roughly. */
#define PER_BYTE 10e-9

/* A call belongs to one request until its answer is made. */
typedef struct kept_call {
    kept_source from;
    content_coding form; /* that is sent */
    size_t room;         /* bytes that the request has taken and not used */
    kept_bytes *body;    /* or NULL, with why */
    problem why;
} kept_call;

kept_source kept_text(kept_forms *forms, const char *type) {
    kept_bytes *plain = kept_forms_find(forms, CODING_IDENTITY);
    const size_t length = plain->content.length;
    kept_bytes_release(plain);
    return (kept_source){.forms = kept_forms_hold(forms),
                         .type = type,
                         .what = "a text",
                         .tag = kept_forms_tag(forms),
                         .cost = PER_BYTE * (double)length};
}

static void answer_kept(const kept_source *from, content_coding form, kept_bytes *body, answer *out) {
    *out = (answer){.status = 200,
                    .type = from->type,
                    .kept = body,
                    .kept_coding = form,
                    .tag = from->tag,
                    .cacheable = true,
                    .by_type = from->by_type};
}

/* The form that answers a request best. */
static content_coding choose_form(const call *in, const kept_source *from) {
    kept_bytes *plain = kept_forms_find(from->forms, CODING_IDENTITY);
    const bool brief = plain != NULL && plain->content.length < COMPRESS_LEAST;
    kept_bytes_release(plain);
    return brief && !in->accepted.forced ? CODING_IDENTITY : in->accepted.coding;
}

/* Answers with the bytes as they are, where they are kept and the client takes them so. */
static bool answer_plain(const call *in, const kept_source *from, answer *out) {
    kept_bytes *plain = in->accepted.forced ? NULL : kept_forms_find(from->forms, CODING_IDENTITY);
    if (plain != NULL) answer_kept(from, CODING_IDENTITY, plain, out);
    return plain != NULL;
}

bool quick_kept(call *in, answer *out) {
    kept_source from = {.forms = NULL};
    if (!in->keeps(in, &from, out)) return true;
    const content_coding form = choose_form(in, &from);
    kept_bytes *body = kept_forms_find(from.forms, form);
    bool answered = body != NULL;
    if (answered)
        answer_kept(&from, form, body, out);
    else if (batch_jobs(in->service->queue) >= in->service->config->max_inflight)
        answered = answer_plain(in, &from, out); /* solves go before it */
    kept_forms_release(from.forms);
    return answered;
}

static size_t compress_bytes(size_t length) {
    return bytes_plus(coding_bytes_most(length), CODER_BYTES);
}

/* Bytes that the request needs, at most: to make the bytes and, while those may be its own, to compress them.
 */
static size_t bytes_needed(const kept_source *from, content_coding form) {
    kept_bytes *kept = kept_forms_find(from->forms, form),
               *plain = kept_forms_find(from->forms, CODING_IDENTITY);
    size_t bytes = 0;
    if (kept == NULL && plain != NULL) {
        bytes = compress_bytes(plain->content.length);
    } else if (kept == NULL) {
        const size_t code = form == CODING_IDENTITY ? 0 : bytes_plus(from->most, compress_bytes(from->most));
        bytes = code > from->build_bytes ? code : from->build_bytes;
    }
    kept_bytes_release(kept);
    kept_bytes_release(plain);
    return bytes;
}

static void drop(call *in) {
    kept_call *state = in->state;
    in->state = NULL;
    kept_bytes_release(state->body);
    kept_forms_release(state->from.forms);
    free(state);
}

static bool begin(call *in, answer *out) {
    kept_source from = {.forms = NULL};
    problem why = {0};
    if (!in->keeps(in, &from, out)) return false;
    const content_coding form = choose_form(in, &from);
    const size_t bytes = bytes_needed(&from, form);
    kept_call *state = NULL;
    if (request_memory_take(in->memory, bytes, &why) && (state = calloc(1, sizeof *state)) == NULL)
        problem_set(&why, PROBLEM_NO_MEMORY, "not enough memory for %s", from.what);
    if (state == NULL) {
        if (!answer_plain(in, &from, out)) answer_problem(out, &why);
        kept_forms_release(from.forms);
        return false;
    }
    *state = (kept_call){.from = from, .form = form, .room = bytes};
    in->state = state;
    in->job.key = from.forms;
    in->job.n_vectors = 1;
    return true;
}

static double cost(const call *in) {
    return ((const kept_call *)in->state)->from.cost;
}

/* Takes what the request is short of, where a form that was kept when it began is there no more. */
static bool have_room(call *in, size_t bytes) {
    kept_call *state = in->state;
    if (bytes <= state->room) return true;
    if (!request_memory_take(in->memory, bytes - state->room, &state->why)) return false;
    state->room = bytes;
    return true;
}

/* Has made, whose memory the request has taken, kept beside its other forms; or, where --max-memory has no
 * room for it, until the last request that needs it is answered. NULL with why. */
static kept_bytes *keep(call *in, content_coding form, buffer *made) {
    kept_call *state = in->state;
    const size_t bytes = made->capacity;
    kept_bytes *kept = kept_forms_keep(state->from.forms, form, made);
    if (kept == NULL && bytes <= state->room &&
        (kept = kept_bytes_create(made, request_ledger_give_back, in->memory->ledger, bytes)) != NULL) {
        request_memory_hand_over(in->memory, bytes);
        state->room -= bytes;
    }
    if (kept == NULL)
        problem_set(&state->why, PROBLEM_NO_MEMORY, "not enough memory for %s", state->from.what);
    buffer_free(made);
    return kept;
}

static kept_bytes *build(call *in) {
    kept_call *state = in->state;
    buffer made = {0};
    if (!have_room(in, state->from.build_bytes)) return NULL;
    return state->from.build(in, &made, &state->why) ? keep(in, CODING_IDENTITY, &made) : NULL;
}

static kept_bytes *compress(call *in, const kept_bytes *plain, content_coding form) {
    kept_call *state = in->state;
    buffer made = {0};
    if (!have_room(in, compress_bytes(plain->content.length))) return NULL;
    if (coding_whole(form, plain->content.bytes, plain->content.length, &made)) return keep(in, form, &made);
    problem_set(&state->why, PROBLEM_NO_MEMORY, "not enough memory to compress %s", state->from.what);
    return NULL;
}

/* Finds or makes a form; forms that were made are held for other requests of the pass, as the scene may have
 * no room for them. False with why, which stays empty where nobody needs the answer any more. */
static bool get_form(call *in, content_coding form, kept_bytes **forms) {
    const kept_source *from = &((const kept_call *)in->state)->from;
    if (forms[form] == NULL) forms[form] = kept_forms_find(from->forms, form);
    if (forms[form] != NULL) return true;
    if (form == CODING_IDENTITY)
        forms[form] = build(in);
    else if (get_form(in, CODING_IDENTITY, forms) && in->is_wanted(in))
        forms[form] = compress(in, forms[CODING_IDENTITY], form);
    return forms[form] != NULL;
}

static void pass(const batch_part *parts, size_t n_parts, batch_workspace *workspace) {
    kept_bytes *forms[KEPT_FORMS] = {NULL};
    (void)workspace;
    for (size_t k = 0; k < n_parts; k++) {
        call *in = call_of(parts[k].job);
        kept_call *state = in->state;
        if (in->is_wanted(in) && get_form(in, state->form, forms))
            state->body = kept_bytes_hold(forms[state->form]);
    }
    for (size_t form = 0; form < KEPT_FORMS; form++) kept_bytes_release(forms[form]);
}

static void end(call *in, answer *out) {
    kept_call *state = in->state;
    if (state->body != NULL)
        answer_kept(&state->from, state->form, kept_bytes_hold(state->body), out);
    else if (!answer_plain(in, &state->from, out))
        answer_problem(out, &state->why);
    drop(in);
}

const solve_steps send_kept = {.begin = begin, .pass = pass, .end = end, .drop = drop, .cost = cost};
