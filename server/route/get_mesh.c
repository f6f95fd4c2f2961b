/* GET /v1/scenes/NAME/mesh: the elements of a scene as binary glTF. */
#include "server/route/kept_answer.h"
#include "solver/codec/gltf/gltf.h"

/* Seconds for an element, roughly: to make its part of the file and to compress that. */
#define PER_ELEMENT 2e-6

static bool build(const call *in, buffer *out, problem *why) {
    const scene *s = in->scene;
    lam_error error;
    const lam_status status = scene_mesh_build(s->mesh, out, &error);
    const problem_kind as = status == LAM_ERR_MEMORY || status == LAM_ERR_IO ? PROBLEM_NO_MEMORY
                            : status == LAM_ERR_ARGUMENT                     ? PROBLEM_NOT_IN_ENCODING
                                                                             : PROBLEM_UNAVAILABLE;
    return status == LAM_OK || problem_set(why, as, "%.100s: %s", s->name, scene_message(s, error.message));
}

bool keeps_mesh(const call *in, kept_source *from, answer *out) {
    scene_mesh *mesh = in->scene->mesh;
    if (in->scene->n > GLTF_ELEMENTS_MOST) {
        answer_refuse(out, PROBLEM_NOT_IN_ENCODING, "%zu elements, a mesh in glTF has at most %zu",
                      in->scene->n, GLTF_ELEMENTS_MOST);
        return false;
    }
    *from = (kept_source){.forms = kept_forms_hold(scene_mesh_forms(mesh)),
                          .type = "model/gltf-binary",
                          .what = "a mesh",
                          .tag = scene_mesh_tag(mesh),
                          .cost = PER_ELEMENT * (double)in->scene->n,
                          .build = build,
                          .build_bytes = scene_mesh_build_bytes(mesh),
                          .most = scene_mesh_bytes_most(mesh)};
    return true;
}
