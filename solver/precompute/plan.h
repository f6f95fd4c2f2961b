/* The choice of form factors for a scene, of the place where they lie, and of the operator that is expected
 * of them; choose_method is the same of methods. Options say what may be taken; memory, seconds by samples
 * and the laws of the sources (source.h) decide among it. Rows are chosen first, by their number and by
 * memory: all pairs where they are affordable, else near pairs and rays, or rays alone. Samples then say
 * whether blocks, or fewer pairs, cost less. */
#ifndef LAMBERT_PRECOMPUTE_PLAN_H
#define LAMBERT_PRECOMPUTE_PLAN_H

#include "solver/precompute/parts.h"

/* Above this number of elements all pairs take too long by preset. */
enum { PLAN_PAIRS_ELEMENTS = 32768 };

/* plan.c. The plan of a mesh that is ready; the same, where rows take other memory than was thought, since
 * emitters are known; before the mesh is refined to about n elements, that of the rows so far; of a store,
 * whose recipe is in plan. All fail, LAM_ERR_MEMORY with advice, where nothing fits into memory. */
lam_status plan_choose(const precompute_job *job, precompute_scene *scene, precompute_plan *plan,
                       lam_error *error);
lam_status plan_check_mesh(const precompute_job *job, const precompute_scene *scene, double n,
                           precompute_plan *plan, lam_error *error);
lam_status plan_check_rows(const precompute_job *job, const precompute_scene *scene, precompute_plan *plan,
                           lam_error *error);

/* The forecast of a plan for n elements. True if its bytes fit into memory. */
forecast plan_forecast(const precompute_job *job, const precompute_scene *scene, const precompute_plan *plan,
                       double n);
bool plan_fits(const precompute_job *job, const precompute_scene *scene, const precompute_plan *plan,
               double n);

/* The cost of form factors by a recipe, from a sample of them; of blocks the scene is ready for these then,
 * until they are found or it is forgotten. Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status plan_sample(const precompute_job *job, precompute_scene *scene, const recipe *r, factor_cost *cost,
                       lam_error *error);

/* Adds a line to the reason of a plan. */
void plan_explain(precompute_plan *plan, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* plan_rows.c. True if the operator leaves out what is below epsilon, or epsilon was given, and no sky lights
 * the scene: all pairs are then no finer than it asks for (recipe_coarser). */
bool plan_pairs_follow_epsilon(const precompute_job *job, const build_method *method);

/* The recipes that options and quality ask for: all pairs, as presets take them where they can; near pairs
 * and rays; of the judge's samples of n elements, with --rays given of as many also where a store's form
 * factors had others. The accuracy of pairs at --quality high. */
recipe plan_pairs_recipe(const precompute_job *job, const precompute_plan *plan);
recipe plan_near_recipe(const precompute_job *job, const precompute_plan *plan);
recipe plan_judge_recipe(const precompute_job *job, const precompute_plan *plan, double n, uint64_t seed);
double plan_finest_accuracy(void);

/* The method that n elements are going to get, as far as it is known before their form factors are; *final:
 * nothing in them can change it. */
lam_status plan_expect_method(const precompute_job *job, const precompute_scene *scene, double n,
                              double noise, const build_method **method, bool *final, lam_error *error);

/* Chooses rows for n elements: all pairs where they are affordable, or no more than the rays that would do,
 * else rays; in memory, or, where there is a scratch folder and no other way, on disk. */
lam_status plan_rows(const precompute_job *job, const precompute_scene *scene, double n,
                     precompute_plan *plan, lam_error *error);

/* plan_pairs.c. Weighs all pairs, where the plan is these, against near pairs and rays by the cost of a
 * sample of both, and near pairs against rays alone: sets cost, and where others are to be taken, weighed. */
lam_status plan_weigh_pairs(const precompute_job *job, precompute_scene *scene, precompute_plan *plan,
                            lam_error *error);

/* The same where no cost is known yet, and the rows that follow of it. */
lam_status plan_weigh_rows(const precompute_job *job, precompute_scene *scene, precompute_plan *plan,
                           lam_error *error);

/* plan_blocks.c. False where options or the number n of elements rule blocks out. The first method that
 * builds from blocks. True where they are possible, of which the tree is made; fails where they were asked
 * for and cannot be had. */
bool plan_may_have_blocks(const precompute_job *job, double n);
const build_method *plan_method_of_blocks(void);
lam_status plan_blocks_possible(const precompute_job *job, precompute_scene *scene,
                                const build_method *method, bool *possible, lam_error *error);

/* Blocks, with the method that is expected (final: nothing can change it), in place of the plan's rows: where
 * they are asked for, where rows do not fit into memory, or where blocks cost less by a sample. */
lam_status plan_weigh_blocks(const precompute_job *job, precompute_scene *scene, const build_method *method,
                             bool final, precompute_plan *plan, lam_error *error);

/* plan_time.c. --time: forecasts the recipes that are possible, and gives the options of the best that fits
 * into the seconds, or of the cheapest, with a warning. */
lam_status plan_within_time(const precompute_job *job, precompute_scene *scene, const precompute_plan *plan,
                            stage_times *times, precompute_options *chosen, lam_error *error);

#endif
