/* GET /v1/scenes/NAME/mesh: the elements of a scene as binary glTF. The file is made, and compressed, by a
 * pass of the queue, which requests of one scene share: those that come meanwhile wait without a thread, and
 * find it made.
 */
#include "server/route/routes.h"
#include "solver/codec/gltf/gltf.h"

#include <stdlib.h>
#include <string.h>

_Static_assert(CODING_ZSTD + 1 == SCENE_MESH_FORMS, "a form for each coding");

/* Seconds for an element, roughly: to make its part of the file and to compress that. */
#define PER_ELEMENT 2e-6

/* Of one request, until its answer is made. */
typedef struct mesh_call {
    size_t room;      /* bytes that the request has taken and not used */
    kept_bytes *body; /* or NULL, with why */
    problem why;
} mesh_call;

static void answer_mesh(const call *in, kept_bytes *body, answer *out) {
    *out = (answer){.status = 200,
                    .type = "model/gltf-binary",
                    .kept = body,
                    .kept_coding = in->accepted.coding,
                    .tag = scene_mesh_tag(in->scene->mesh)};
}

bool quick_mesh(call *in, answer *out) {
    kept_bytes *body = scene_mesh_find(in->scene->mesh, in->accepted.coding);
    if (body != NULL) answer_mesh(in, body, out);
    return body != NULL;
}

static size_t compress_bytes(size_t length) {
    return bytes_plus(coding_bytes_most(length), CODER_BYTES);
}

/* Bytes that the request needs, at most: to make the file and, while that may be its own, to compress it. */
static size_t bytes_needed(const call *in) {
    scene_mesh *mesh = in->scene->mesh;
    const content_coding form = in->accepted.coding;
    kept_bytes *kept = scene_mesh_find(mesh, form), *plain = scene_mesh_find(mesh, CODING_IDENTITY);
    const size_t build = scene_mesh_build_bytes(mesh), most = scene_mesh_bytes_most(mesh);
    size_t bytes = 0;
    if (kept == NULL && plain != NULL)
        bytes = compress_bytes(plain->content.length);
    else if (kept == NULL && form == CODING_IDENTITY)
        bytes = build;
    else if (kept == NULL)
        bytes =
            bytes_plus(most, compress_bytes(most)) > build ? bytes_plus(most, compress_bytes(most)) : build;
    kept_bytes_release(kept);
    kept_bytes_release(plain);
    return bytes;
}

static bool begin(call *in, answer *out) {
    const size_t bytes = bytes_needed(in);
    problem why = {0};
    if (in->scene->n > GLTF_ELEMENTS_MOST)
        problem_set(&why, PROBLEM_NOT_IN_ENCODING, "%zu elements, a mesh in glTF has at most %zu",
                    in->scene->n, GLTF_ELEMENTS_MOST);
    else if (request_memory_take(in->memory, bytes, &why) &&
             (in->state = calloc(1, sizeof(mesh_call))) == NULL)
        problem_set(&why, PROBLEM_NO_MEMORY, "not enough memory for a mesh");
    if (in->state == NULL) {
        answer_problem(out, &why);
        return false;
    }
    ((mesh_call *)in->state)->room = bytes;
    in->job.key = in->scene->mesh;
    in->job.n_vectors = 1;
    return true;
}

static double cost(const call *in) {
    return PER_ELEMENT * (double)in->scene->n;
}

static bool refuse(const scene *s, lam_status status, const lam_error *error, problem *why) {
    const problem_kind as = status == LAM_ERR_MEMORY || status == LAM_ERR_IO ? PROBLEM_NO_MEMORY
                            : status == LAM_ERR_ARGUMENT                     ? PROBLEM_NOT_IN_ENCODING
                                                                             : PROBLEM_UNAVAILABLE;
    return problem_set(why, as, "%.100s: %s", s->name, scene_message(s, error->message));
}

/* Takes what the request is short of, where a form that was kept when it began is there no more. */
static bool have_room(call *in, size_t bytes) {
    mesh_call *state = in->state;
    if (bytes <= state->room) return true;
    if (!request_memory_take(in->memory, bytes - state->room, &state->why)) return false;
    state->room = bytes;
    return true;
}

/* Has made, whose memory the request has taken, kept by the scene; or, where --max-memory has no room for it,
 * until the last request that needs it is answered. NULL with why. */
static kept_bytes *keep(call *in, content_coding form, buffer *made) {
    mesh_call *state = in->state;
    const size_t bytes = made->capacity;
    kept_bytes *kept = scene_mesh_keep(in->scene->mesh, form, made);
    if (kept == NULL && bytes <= state->room &&
        (kept = kept_bytes_create(made, request_ledger_give_back, in->memory->ledger, bytes)) != NULL) {
        request_memory_hand_over(in->memory, bytes);
        state->room -= bytes;
    }
    if (kept == NULL) problem_set(&state->why, PROBLEM_NO_MEMORY, "not enough memory for a mesh");
    buffer_free(made);
    return kept;
}

static kept_bytes *build(call *in) {
    const scene *s = in->scene;
    buffer made = {0};
    lam_error error;
    if (!have_room(in, scene_mesh_build_bytes(s->mesh))) return NULL;
    const lam_status status = scene_mesh_build(s->mesh, &made, &error);
    if (status == LAM_OK) return keep(in, CODING_IDENTITY, &made);
    refuse(s, status, &error, &((mesh_call *)in->state)->why);
    return NULL;
}

static kept_bytes *compress(call *in, const kept_bytes *plain, content_coding form) {
    buffer made = {0};
    if (!have_room(in, compress_bytes(plain->content.length))) return NULL;
    if (coding_whole(form, plain->content.bytes, plain->content.length, &made)) return keep(in, form, &made);
    problem_set(&((mesh_call *)in->state)->why, PROBLEM_NO_MEMORY, "not enough memory to compress a mesh");
    return NULL;
}

/* Finds or makes a form; forms that were made are held for other requests of the pass, as the scene may have
 * no room for them. False with why, which stays empty where nobody needs the answer any more. */
static bool get_form(call *in, content_coding form, kept_bytes **forms) {
    if (forms[form] == NULL) forms[form] = scene_mesh_find(in->scene->mesh, form);
    if (forms[form] != NULL) return true;
    if (form == CODING_IDENTITY)
        forms[form] = build(in);
    else if (get_form(in, CODING_IDENTITY, forms) && in->is_wanted(in))
        forms[form] = compress(in, forms[CODING_IDENTITY], form);
    return forms[form] != NULL;
}

static void pass(const batch_part *parts, size_t n_parts, batch_workspace *workspace) {
    kept_bytes *forms[SCENE_MESH_FORMS] = {NULL};
    (void)workspace;
    for (size_t k = 0; k < n_parts; k++) {
        call *in = call_of(parts[k].job);
        mesh_call *state = in->state;
        const content_coding form = in->accepted.coding;
        if (in->is_wanted(in) && get_form(in, form, forms)) state->body = kept_bytes_hold(forms[form]);
    }
    for (size_t form = 0; form < SCENE_MESH_FORMS; form++) kept_bytes_release(forms[form]);
}

static void drop(call *in) {
    mesh_call *state = in->state;
    in->state = NULL;
    kept_bytes_release(state->body);
    free(state);
}

static void end(call *in, answer *out) {
    mesh_call *state = in->state;
    if (state->body != NULL)
        answer_mesh(in, kept_bytes_hold(state->body), out);
    else
        answer_problem(out, &state->why);
    drop(in);
}

const solve_steps get_mesh = {.begin = begin, .pass = pass, .end = end, .drop = drop, .cost = cost};
