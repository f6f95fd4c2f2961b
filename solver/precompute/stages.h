/* The stages of a precompute, and what they share. Private to solver/precompute/. */
#ifndef LAMBERT_PRECOMPUTE_STAGES_H
#define LAMBERT_PRECOMPUTE_STAGES_H

#include "solver/precompute/parts.h"
#include "solver/sensor/sensors_store.h"

/* stage_forecast.c. Measures the rates of the machine, once (cast: that of rays in the scene, too); and anew
 * the processors that the run has had so far. Logs the forecast, and fails where the disks have no room. Logs
 * the forecast of the stages beside their times. */
lam_status times_measure_rates(const precompute_scene *scene, stage_times *times, bool cast,
                               lam_error *error);
void times_update_processors(const precompute_job *job, stage_times *times);
lam_status stage_forecast(const precompute_job *job, precompute_scene *scene, precompute_plan *plan,
                          precompute_factors *factors, stage_times *times, lam_error *error);

/* Sets cost.entries of rays for the forecast: of a store those it has, else about half as many as twice the
 * rays of up to 64 elements find, because a pair is an entry if the rays of either element hit the other.
 * Elements that see few others hit these again and again: of 4,096 rays in a part of a town one in 130 finds
 * a new pair, in a canopy one in 27. Leaves other recipes as they are. Cost: a thirtieth of the rays,
 * of fewer than 256 elements up to 262,144 of them. Errors: LAM_ERR_MEMORY. */
lam_status plan_count_entries(const precompute_job *job, const precompute_scene *scene, precompute_plan *plan,
                              precompute_factors *factors, lam_error *error);
void times_log(const precompute_job *job, const stage_times *times);

/* The scene, or a store with its form factors. */
lam_status stage_load_scene(const precompute_job *job, precompute_scene *scene, lam_error *error);
lam_status stage_load_store(const precompute_job *job, precompute_scene *scene, precompute_plan *plan,
                            precompute_factors *factors, lam_error *error);

/* Reads --luminaires and the lights of the scene file; those of a store, or --luminaires in their place.
 * Finds the direct light of those that a store did not have; writes them: stage_luminaires.c. */
lam_status scene_take_luminaires(const precompute_job *job, precompute_scene *scene, lam_error *error);
lam_status scene_load_luminaires(const precompute_job *job, store *s, precompute_scene *scene,
                                 lam_error *error);
lam_status stage_luminaires(const precompute_job *job, precompute_scene *scene, lam_error *error);
lam_status luminaires_save(const luminaire_columns *c, const mesh *m, store *s, lam_error *error);

/* Makes sources of the elements that luminaires light, where these are named as sources: by the light of each
 * that an element reflects, over the mean of all that it lights, at most 1: stage_importance.c. */
lam_status scene_light_sources(const precompute_job *job, precompute_scene *scene, lam_error *error);

/* Makes receivers of the elements that light comes from to sensors, where these are named as receivers: by
 * the weight of an element in the rows of a set, over its area, over the mean of all that the set sees, at
 * most 1. Rays without the sky tell them, 8 of a set for each element, or for some that follow each other in
 * the order of the mesh where a set has less: stage_importance.c. */
lam_status scene_read_at_sensors(const precompute_job *job, precompute_scene *scene, lam_error *error);

/* Logs lines as warnings. */
void scene_warn(const precompute_job *job, const luminaire_warnings *w);

/* Reads --sensors; those of a store, or --sensors in their place. Finds the weights of their rows (rows
 * false: the store has them) and the light of luminaires there; writes them: stage_sensors.c. */
lam_status scene_take_sensors(const precompute_job *job, precompute_scene *scene, lam_error *error);
lam_status scene_load_sensors(const precompute_job *job, store *s, precompute_scene *scene, lam_error *error);
lam_status stage_sensors(const precompute_job *job, precompute_scene *scene, const sky_bounce *sky, bool rows,
                         lam_error *error);

/* The light of luminaires at sensors, a view. */
sensors_lit scene_sensors_lit(const precompute_scene *scene);
lam_status scene_sensors_save(const precompute_scene *scene, store *s, lam_error *error);

/* True where a store is to have other luminaires or sensors and nothing else; makes that store: relight.c. */
bool relight_is_asked(const precompute_options *o, const option_result *given);
lam_status relight_run(const precompute_job *job, precompute_scene *scene, lam_error *error);

/* Refines the mesh as asked for; the same where about as many elements fit into memory, orders it, and reads
 * its importance; what it is, in lines of the log: stage_mesh.c. */
lam_status scene_refine(const precompute_job *job, precompute_scene *scene, lam_error *error);
lam_status stage_prepare_mesh(const precompute_job *job, precompute_scene *scene, precompute_plan *plan,
                              lam_error *error);
void scene_log_mesh(const precompute_job *job, const precompute_scene *scene);

/* Marks the elements of a mesh that is made which see nothing, as they lie between a body and the face that
 * it stands on. */
lam_status scene_find_buried(const precompute_job *job, precompute_scene *scene, lam_error *error);

/* Cuts faces along the walls that stand on them, where these extend over at least half of the edge of the
 * elements to be, metres, as long as it makes no more than max(1,000, the faces so far) in addition, nor more
 * than `most` faces; logs the number of faces. Logs how many elements still lie under walls, once the mesh is
 * divided: stage_walls.c. */
lam_status scene_cut_at_walls(const precompute_job *job, precompute_scene *scene, double edge, size_t most,
                              lam_error *error);
lam_status scene_log_under_walls(const precompute_job *job, const precompute_scene *scene, double edge,
                                 lam_error *error);

/* Chooses the form factors, in plan and in the log, and reads emitters then: stage_plan.c. */
lam_status stage_choose_plan(const precompute_job *job, precompute_scene *scene, precompute_plan *plan,
                             lam_error *error);

/* --positions and --path: all from the scene to the operator, without form factors; its errors; the light, in
 * the store: stage_positions.c, positions_error.c. */
lam_status stage_positions(const precompute_job *job, precompute_scene *scene, made_operator *made,
                           walked_light *walked, lam_error *error);
lam_status walked_judge(const precompute_job *job, const precompute_scene *scene, made_operator *made,
                        walked_light *walked, lam_error *error);
lam_status walked_save(const walked_light *walked, store *s, lam_error *error);

/* The error of the mesh by the operator's answers: stage_mesh_error.c. */
lam_status stage_mesh_error(const precompute_job *job, const precompute_scene *scene,
                            const precompute_factors *factors, made_operator *made, lam_error *error);

/* That of the light of luminaires alone, beside what made has. */
lam_status stage_mesh_error_of_luminaires(const precompute_job *job, const precompute_scene *scene,
                                          made_operator *made, lam_error *error);

/* The error of the answer for the scene's own lights and luminaires, by all other errors of made:
 * own_error.c. */
lam_status stage_own_error(const precompute_scene *scene, made_operator *made, lam_error *error);

/* Adds what overlapping faces and the repair of row sums are to all stated errors: overlap_error.c. */
void made_add_overlap(const precompute_job *job, const precompute_scene *scene, const precompute_plan *plan,
                      const precompute_factors *factors, made_operator *made);
bool made_is_overlapping(const precompute_scene *scene,
                         const made_operator *made); /* it is most of the error of random emission */
lam_status walked_add_overlap(const precompute_scene *scene, made_operator *made, const walked_light *walked,
                              lam_error *error);

/* Opens the folder for rows where one was given and is needed: stage_load_store.c. */
lam_status stage_open_scratch(const precompute_job *job, const precompute_plan *plan,
                              precompute_factors *factors, lam_error *error);

/* Finds the form factors of the plan, of a stream the near pairs alone. factors_place is the place of large
 * arrays; NULL: in memory. The log gets their figures; the number of rows that were in the scratch folder
 * already; a warning of groups whose backs take light: stage_factors.c. */
lam_status stage_factors(const precompute_job *job, precompute_scene *scene, const precompute_plan *plan,
                         precompute_factors *factors, lam_error *error);
const large_place *factors_place(const precompute_plan *plan, const precompute_factors *factors);
void factors_log(const precompute_job *job, const precompute_scene *scene, const precompute_factors *factors);
void factors_log_kept(const precompute_job *job, size_t n, const form_factors *f);
lam_status factors_warn_of_backs(const precompute_job *job, const precompute_scene *scene,
                                 const precompute_factors *factors, lam_error *error);

/* --lights in place of the kind of light that file or store say, and a line where that differs. */
void scene_take_lights(const precompute_job *job, mesh *m);

/* Takes the groups of --portal out of the mesh, and rectangles around them as openings: stage_portals.c. */
lam_status scene_take_portals(const precompute_job *job, precompute_scene *scene, lam_error *error);

/* Makes panes of the groups of --glass, too, gives panes their backs and says what light passes:
 * stage_glass.c. */
lam_status scene_take_glass(const precompute_job *job, precompute_scene *scene, lam_error *error);

/* Without --portal finds the openings of the faces, before these are divided, where there is a sky. */
lam_status scene_find_openings(const precompute_job *job, precompute_scene *scene, lam_error *error);

/* --receivers, --importance and --sources, into importance; the importance of all elements by the form
 * factors that were found, or of a stream by a few rays, where it is not known: stage_importance.c. Without
 * these options they do nothing. */
lam_status scene_read_importance(const precompute_job *job, const precompute_plan *plan,
                                 precompute_scene *scene, lam_error *error);
lam_status scene_find_importance(const precompute_job *job, precompute_scene *scene,
                                 const precompute_plan *plan, const precompute_factors *factors,
                                 lam_error *error);

/* The problem for methods: views of scene and factors, which must stay where they are. needs: METHOD_GEOMETRY
 * and METHOD_SURFACES, as flags of a method. The options of a build, with the memory that form factors and
 * mesh leave: stage_operator.c. */
lam_status problem_of(precompute_scene *scene, precompute_factors *factors, unsigned needs,
                      build_problem *problem, lam_error *error);
build_options build_options_of(const precompute_job *job, const precompute_scene *scene,
                               const precompute_factors *factors, const trial_course *course);

lam_status stage_operator(const precompute_job *job, precompute_scene *scene, const precompute_plan *plan,
                          precompute_factors *factors, made_operator *made, const trial_course *course,
                          lam_error *error);
/* kept: where references of the judge stay for a next trial; NULL: there is none. */
lam_status stage_judge(const precompute_job *job, precompute_scene *scene, const precompute_plan *plan,
                       precompute_factors *factors, made_operator *made, judge_references **kept,
                       lam_error *error);

/* Warns of a stated error that is large, or above that of --epsilon, and names the option that lowers it:
 * stage_operator.c. advice: the line, or "". */
void stage_advise(const finished_trial *t, char advice[ERROR_ADVICE_BYTES]);

/* After form factors, operator and judge: where --epsilon or --group-error asks for a smaller error, turns
 * the knobs and releases all that is to be made again; false: the best trial is in place. The trial that was
 * put aside in place of one that failed: stage_trials.c. */
bool stage_next_trial(const precompute_job *job, const precompute_scene *scene, precompute_plan *plan,
                      precompute_factors *factors, made_operator *made, trial_course *course);
void trial_take_back(precompute_factors *factors, made_operator *made, trial_course *course);

/* True where the trial that is being made may not be the last; where the error of its method is that of
 * --epsilon; where its method has a use for --epsilon. The figures of the trials. */
bool trial_may_be_repeated(const finished_trial *t);
bool trial_keeps_epsilon(const finished_trial *t);
bool trial_follows_epsilon(const finished_trial *t);
void trial_report(const finished_trial *t, build_report *r);

/* The sealed store: stage_store.c. */
lam_status stage_store(const precompute_job *job, const precompute_scene *scene, const precompute_plan *plan,
                       precompute_factors *factors, const made_operator *made, const walked_light *walked,
                       lam_error *error);

#endif
