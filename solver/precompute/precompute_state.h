/* The state that the stages of a precompute hand on. Private to solver/precompute/. */
#ifndef LAMBERT_PRECOMPUTE_PRECOMPUTE_STATE_H
#define LAMBERT_PRECOMPUTE_PRECOMPUTE_STATE_H

#include "solver/formfactor/blocks/blocks.h"
#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/pairs/pairs_sample.h"
#include "solver/formfactor/pairs/ray_rows.h"
#include "solver/formfactor/source.h"
#include "solver/method/judge/judge.h"
#include "solver/precompute/emitter_list.h"
#include "solver/precompute/error_advice.h"
#include "solver/precompute/forecast.h"
#include "solver/precompute/judging.h"
#include "solver/precompute/precompute.h"
#include "solver/precompute/trial.h"
#include "solver/walk/reuse.h"

/* All that a trial of --epsilon makes. */
typedef struct trial_made {
    form_factors f; /* row_sums are NULL: those of the state */
    block_factors blocks;
    lam_operator *op; /* NULL: nothing was made */
    build_report built;
    error_report errors;
    group_errors by_group;
    double epsilon; /* that it was built for */
    double excess;  /* of the goal that is missed most */
} trial_made;

/* The trials of an --epsilon or a --group-error that is an error to keep. */
typedef struct trial_course {
    double asked;       /* by --epsilon; 0: nothing is kept */
    double group;       /* by --group-error; 0: nothing is kept */
    double epsilon;     /* that the operator is built for */
    size_t count;       /* of trials that ended */
    double lacking;     /* bytes that a finer trial would have needed; 0: memory was no limit */
    double factors;     /* that part of the error, over its limit, before the form factors were made anew; 0:
                           they were not */
    trial_knobs before; /* of the trial before, and its error */
    trial_goal missed;  /* asked is 0: there was none */
    bool group_missed;  /* it was that of a group of the scene */
    bool spent;         /* which hardly lowered it: they are not made again */
    trial_made best;    /* before the last */
    judge_references *references; /* of the judge, for a next trial of the same form factors; NULL: none */
} trial_course;

/* Single elements by which an operator is judged at least, unless --probes gives their number. */
enum { PROBES_LEAST = 32 };

typedef struct precompute_state {
    const precompute_options *options;
    precompute_options chosen;    /* with --time: the options, once it has chosen the recipe */
    double started, started_used; /* by the clock, and by processor seconds */
    terminal *t;
    progress progress;
    double memory;    /* bytes */
    scratch *scratch; /* NULL: none */
    mesh m;
    uint32_t *order;
    double (*centre)[3]; /* [n], with surface where a method needs them */
    uint32_t *surface;
    element_corners corners; /* a view of m */
    form_factors f;
    const build_method *expected;  /* as chosen before the form factors are known */
    bool holds;                    /* rows of F are needed whatever the method is */
    bool streamed;                 /* rows of F are found as the method asks for them; f has none */
    ray_rows *rays;                /* of these, until the operator is built */
    plane_tree tree;               /* of the elements, once blocks are considered */
    block_scene *ready;            /* the mesh on that tree, from a forecast of blocks to these; or NULL */
    block_factors blocks;          /* the form factors where the recipe is blocks; f has no rows then */
    row_stream stream;             /* of rays */
    recipe recipe;                 /* of f */
    face_openings of_faces;        /* of the faces of the file, or around the groups of --portal */
    const face_openings *openings; /* these; NULL: there is no sky, or only a store's mesh is known */
    factor_cost cost;              /* of the recipe, from a sample; seconds is 0 where none was taken */
    bool dear;                     /* the pairs of the recipe so far would take too long */
    bool plain;                    /* near pairs would too: rays alone are taken */
    size_t least_rays;             /* in place of pairs that are dear */
    bool large;                    /* its rows and the judge's lie in the scratch folder */
    size_t sky_tiles;
    size_t probes;
    emitter_list emitters;
    emitter_source emitting; /* a view of emitters, for methods */
    importance importance;   /* n is 0 where all is read, and may emit */
    moving_light light;      /* of --positions or --path; n is 0 where there is none */
    reuse_estimates paths;   /* from it */
    double *position_errors; /* [2][s], relative and indirect; NULL: not judged */
    lam_operator *op;
    build_report built;
    error_report errors;
    mesh_figures errors_of_mesh;
    group_errors by_group;
    double repair; /* relative error of reflected light by faces that count twice; 0: none */
    trial_course trial;
    char advice[ERROR_ADVICE_BYTES]; /* on them; "" where there is none */
    forecast_rates rates;            /* of the machine; processors is 0 before they are measured */
    forecast_times expected_times;   /* the forecast of the first trial */
    forecast_times spent;            /* the time of the same stages */
} precompute_state;

/* The state at the beginning of a precompute; frees it: precompute.c. */
precompute_state state_begin(const precompute_options *options, terminal *t);
void state_free(precompute_state *state);

/* stage_forecast.c. Measures the rates of the machine, once (cast: that of rays in the scene, too); and anew
 * the processors that the run has had so far. Logs the forecast, and fails where the disks have no room. Logs
 * the forecast of the stages beside their times. */
lam_status state_measure_rates(precompute_state *state, bool cast, lam_error *error);
void state_update_processors(precompute_state *state);
lam_status stage_forecast(precompute_state *state, lam_error *error);

/* Sets cost.entries of rays for the forecast: of a store those it has, else about half as many as twice the
 * rays of up to 64 elements find, because a pair is an entry if the rays of either element hit the other.
 * Elements that see few others hit these again and again: of 4,096 rays in a part of a town one in 130 finds
 * a new pair, in a canopy one in 27. Leaves other recipes as they are. Cost: a thirtieth of the rays,
 * of fewer than 256 elements up to 262,144 of them. Errors: LAM_ERR_MEMORY. */
lam_status state_count_entries(precompute_state *state, lam_error *error);
void state_log_times(const precompute_state *state);

/* Says how many rows were in the scratch folder already. */
void state_log_kept(precompute_state *state, const form_factors *f);

/* True if the store keeps form factors. */
bool state_keeps(const precompute_options *o);

/* The recipe of the judge's samples: with --rays given, of as many also where a store's form factors had
 * others: stage_scene.c. */
recipe state_judge_recipe(const precompute_state *state, uint64_t seed);

/* The forecast for n elements. */
forecast state_forecast(const precompute_state *state, double n);

/* The place of large arrays; NULL: in memory. */
const large_place *state_large_place(const precompute_state *state);

/* The scene, or a store with its form factors. */
lam_status stage_load_scene(precompute_state *state, lam_error *error);
lam_status stage_load_store(precompute_state *state, lam_error *error);

/* Refines the mesh, orders it, and chooses a recipe that memory has room for. */
lam_status stage_prepare_mesh(precompute_state *state, lam_error *error);

/* Divides the mesh as asked for, and logs what it is: stage_mesh.c. */
lam_status state_refine_mesh(precompute_state *state, lam_error *error);
void state_log_mesh(const precompute_state *state);

/* --positions and --path: all from the scene to the operator, without form factors; its errors; the light, in
 * the store: stage_positions.c, positions_error.c. */
lam_status stage_positions(precompute_state *state, lam_error *error);
lam_status state_judge_positions(precompute_state *state, lam_error *error);
lam_status state_save_positions(const precompute_state *state, store *s, lam_error *error);

/* The error of the mesh by the operator's answers: stage_mesh_error.c. */
lam_status stage_mesh_error(precompute_state *state, lam_error *error);

/* Adds what overlapping faces and the repair of row sums are to all stated errors: overlap_error.c. */
void state_add_overlap(precompute_state *state);
bool state_is_overlapping(const precompute_state *state); /* it is most of the error of random emission */
lam_status state_add_overlap_of_positions(precompute_state *state, lam_error *error);

/* Opens the folder for rows where one was given and is needed. */
lam_status stage_open_scratch(precompute_state *state, lam_error *error);

/* --time: forecasts the recipes that are possible, and goes on with the options of the best that fits, or of
 * the cheapest, with a warning: stage_budget.c. */
lam_status stage_budget(precompute_state *state, lam_error *error);

/* True if the operator leaves out what is below epsilon, or epsilon was given, and no sky lights the scene:
 * all pairs are then no finer than it asks for (recipe_coarser). */
bool state_pairs_follow_epsilon(const precompute_state *state, const build_method *method);

/* All pairs, as defaults take them where they can: stage_scene.c. */
recipe state_pairs_recipe(const precompute_state *state);

/* The first method that builds from blocks. True where blocks are possible, of which the tree is made; fails
 * where they were asked for and cannot be had: stage_blocks.c. */
const build_method *state_method_of_blocks(void);
lam_status state_blocks_possible(precompute_state *state, const build_method *method, bool *possible,
                                 lam_error *error);

/* Blocks of form factors: false where options or the number n of elements rule them out; the recipe of blocks
 * in place of that of state where they are asked for, where rows do not fit into memory, or where blocks cost
 * less by a sample, which the log says and which sets cost, with the method that is expected (final: nothing
 * can change it); the stage; a line of the log: stage_blocks.c. */
bool state_may_have_blocks(const precompute_state *state, double n);
lam_status state_choose_blocks(precompute_state *state, const build_method *method, bool final,
                               lam_error *error);
/* The cost of form factors by a recipe, from a sample of them; of blocks the scene is ready for these then,
 * until they are found or it is forgotten. */
lam_status state_sample(precompute_state *state, const recipe *r, factor_cost *cost, lam_error *error);
void state_forget_ready(precompute_state *state);
lam_status stage_blocks(precompute_state *state, lam_error *error);

/* The blocks that a store keeps; refuses options that need rows: stage_blocks.c. */
lam_status state_load_blocks(precompute_state *state, store *s, lam_error *error);
void state_log_blocks(const precompute_state *state);

/* Near pairs and rays as options and quality ask for: stage_scene.c. */
recipe state_near_recipe(const precompute_state *state);

/* Weighs all pairs, where these are the recipe so far, against near pairs and rays by the cost of a sample of
 * both, and near pairs against rays alone, sets cost, dear, plain and least_rays, and logs why:
 * stage_pairs.c. A new choice of the recipe follows where dear is set. */
lam_status state_weigh_pairs(precompute_state *state, lam_error *error);
/* The same once, and the new choice: stage_scene.c. */
lam_status state_weigh_rows(precompute_state *state, lam_error *error);

/* Takes the groups of --portal out of the mesh, and rectangles around them as openings: stage_portals.c. */
lam_status state_take_portals(precompute_state *state, lam_error *error);
/* Without --portal finds the openings of the faces, before these are divided, where there is a sky. */
lam_status state_find_openings(precompute_state *state, lam_error *error);

/* Form factors of a scene, or of a stream the near pairs alone: precompute.c. */
lam_status stage_form_factors(precompute_state *state, lam_error *error);
lam_status stage_near_pairs(precompute_state *state, lam_error *error);

/* --receivers, --importance and --sources, into importance; the importance of all elements by the form
 * factors that were found, or of a stream by a few rays, where it is not known: stage_importance.c. Without
 * these options they do nothing. */
lam_status state_read_importance(precompute_state *state, lam_error *error);
lam_status state_find_importance(precompute_state *state, lam_error *error);

/* The problem for methods: views of state, which must stay where it is. needs: METHOD_GEOMETRY and
 * METHOD_SURFACES, as flags of a method. The options of a build, with the memory that form factors and mesh
 * leave: stage_operator.c. */
lam_status state_problem(precompute_state *state, unsigned needs, build_problem *problem, lam_error *error);
build_options state_build_options(const precompute_state *state);

lam_status stage_operator(precompute_state *state, lam_error *error);
lam_status stage_judge(precompute_state *state, lam_error *error);

/* Warns of a stated error that is large, or above that of --epsilon, and names the option that lowers it:
 * stage_operator.c. */
void state_advise(precompute_state *state);

/* After form factors, operator and judge: where --epsilon or --group-error asks for a smaller error, turns
 * the knobs and releases all that is to be made again; false: the best trial is in place. True where the
 * trial that is being made may not be the last. The trial that was put aside in place of one that failed. The
 * figures of the trials, into the report: stage_trials.c. */
bool state_next_trial(precompute_state *state);
bool state_may_try_again(const precompute_state *state);
bool state_keeps_epsilon(const precompute_state *state);   /* the error of its method is that of --epsilon */
bool state_follows_epsilon(const precompute_state *state); /* its method has a use for --epsilon */
void state_take_back(precompute_state *state);
void state_report_trials(precompute_state *state);
void trial_made_free(trial_made *made);

/* The accuracy of pairs at --quality high: stage_scene.c. */
double state_finest_accuracy(void);

/* The sealed store: stage_store.c. */
lam_status stage_store(precompute_state *state, lam_error *error);

#endif
