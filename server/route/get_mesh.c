/* GET /v1/scenes/NAME/mesh: the elements of a scene as binary glTF; with ?corners by the corners that they
 * share. */
#include "server/route/kept_answer.h"
#include "solver/codec/gltf/gltf.h"

#include <string.h>

/* Seconds for an element, roughly: to make its part of the file and to compress that, and to find corners. */
#define PER_ELEMENT 2e-6
#define PER_ELEMENT_CORNERS 6e-6

/* Reads the query: nothing, ?corners or ?corners=elements. */
static bool read_query(const call *in, mesh_form *form, problem *why) {
    *form = MESH_ELEMENTS;
    for (size_t k = 0; k < in->n_query; k++) {
        const query_member *q = &in->query[k];
        if (strcmp(q->name, "corners") != 0)
            return problem_set(why, PROBLEM_WRONG_MEMBERS, "the query has \"%.60s\", may have corners alone",
                               q->name);
        if (*form != MESH_ELEMENTS)
            return problem_set(why, PROBLEM_GIVEN_TWICE, "the query has corners a second time");
        if (*q->value != '\0' && strcmp(q->value, "elements") != 0)
            return problem_set(why, PROBLEM_UNKNOWN_WORD,
                               "corners is \"%.60s\", must be left empty or be elements", q->value);
        *form = *q->value == '\0' ? MESH_CORNERS : MESH_ELEMENTS_CORNERS;
    }
    return true;
}

static bool build(const call *in, buffer *out, problem *why) {
    const scene *s = in->scene;
    lam_error error;
    mesh_form form;
    if (!read_query(in, &form, why)) return false;
    const lam_status status = scene_mesh_build(s->mesh, form, out, &error);
    const problem_kind as = status == LAM_ERR_MEMORY || status == LAM_ERR_IO ? PROBLEM_NO_MEMORY
                            : status == LAM_ERR_ARGUMENT                     ? PROBLEM_NOT_IN_ENCODING
                                                                             : PROBLEM_UNAVAILABLE;
    return status == LAM_OK || problem_set(why, as, "%.100s: %s", s->name, scene_message(s, error.message));
}

bool keeps_mesh(const call *in, kept_source *from, answer *out) {
    scene_mesh *mesh = in->scene->mesh;
    mesh_form form;
    problem why;
    if (!read_query(in, &form, &why)) {
        answer_problem(out, &why);
        return false;
    }
    if (in->scene->n > GLTF_ELEMENTS_MOST) {
        answer_refuse(out, PROBLEM_NOT_IN_ENCODING, "%zu elements, a mesh in glTF has at most %zu",
                      in->scene->n, GLTF_ELEMENTS_MOST);
        return false;
    }
    *from = (kept_source){.forms = kept_forms_hold(scene_mesh_forms(mesh, form)),
                          .type = "model/gltf-binary",
                          .what = "a mesh",
                          .tag = scene_mesh_tag(mesh, form),
                          .cost = (form == MESH_ELEMENTS ? PER_ELEMENT : PER_ELEMENT_CORNERS) *
                                  (double)in->scene->n,
                          .build = build,
                          .build_bytes = scene_mesh_build_bytes(mesh, form),
                          .most = scene_mesh_bytes_most(mesh, form)};
    return true;
}
