/* Faces cut along walls before they are divided, and the elements that lie under walls nevertheless. */
#include "solver/precompute/stages.h"
#include "solver/scene/facet/wall_cuts.h"

/* A wall that extends over less than this share of the edge of the elements is not cut along: legs of chairs
 * would make many elements and let little light pass. */
static const double wall_share = .5;

/* Faces that cuts along walls may add, or as many as there are. */
enum { WALL_FACES = 1000 };

lam_status scene_cut_at_walls(const precompute_job *job, precompute_scene *scene, double edge, size_t most,
                              lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = scene->m.n, added = n > WALL_FACES ? n : WALL_FACES;
    wall_cuts_report made;
    if (n + added < most) most = n + added;
    TRY(faces_cut_at_walls(&scene->m, wall_share * edge, most, &made, error));
    if (made.faces > 0)
        terminal_log(job->t, "%zu face%s cut along walls that stand on %s, into %zu parts", made.faces,
                     made.faces == 1 ? " is" : "s are", made.faces == 1 ? "it" : "them", made.parts);
    if (made.left > 0)
        terminal_log(job->t, "%zu edges of walls are not cut along, as it would make more than %zu faces",
                     made.left, most);
done:
    return status;
}

lam_status scene_log_under_walls(const precompute_job *job, const precompute_scene *scene, double edge,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    size_t n;
    TRY(elements_under_walls(&scene->m, &n, error));
    if (n > 0)
        terminal_log(
            job->t,
            "%zu element%s on both sides of a wall or a leg, and light passes below it: faces are cut "
            "along those that extend over %.3g m or more",
            n, n == 1 ? " lies" : "s lie", wall_share * edge);
done:
    return status;
}
