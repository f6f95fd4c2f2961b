/* The parts of a precompute, each made by one stage and const for the next. Private to solver/precompute/. */
#ifndef LAMBERT_PRECOMPUTE_PARTS_H
#define LAMBERT_PRECOMPUTE_PARTS_H

#include "solver/direct/direct_elements.h"
#include "solver/figures/glare.h"
#include "solver/formfactor/blocks/blocks.h"
#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/pairs/pairs_sample.h"
#include "solver/formfactor/pairs/ray_rows.h"
#include "solver/formfactor/source.h"
#include "solver/luminaire/placed_store.h"
#include "solver/method/judge/judge.h"
#include "solver/precompute/emitter_list.h"
#include "solver/precompute/error_advice.h"
#include "solver/precompute/forecast/forecast.h"
#include "solver/precompute/judging.h"
#include "solver/precompute/precompute.h"
#include "solver/precompute/trial.h"
#include "solver/sensor/sensor_rows.h"
#include "solver/sensor/sensors.h"
#include "solver/walk/reuse.h"

/* All that a trial of --epsilon makes. */
typedef struct trial_made {
    form_factors f; /* row_sums are NULL: those of the factors so far */
    block_factors blocks;
    lam_operator *op; /* NULL: nothing was made */
    build_report built;
    error_report errors;
    group_errors by_group;
    double epsilon; /* that it was built for */
    double excess;  /* of the goal that is missed most */
} trial_made;

/* Single elements by which an operator is judged at least, unless --probes gives their number. */
enum { PROBES_LEAST = 32 };

/* The run: set when it begins, and the same for all stages. */
typedef struct precompute_job {
    const precompute_options *options; /* with --time those of the recipe that was taken */
    double started, started_used;      /* by the clock, and by processor seconds */
    terminal *t;
    progress progress;
    double memory;       /* bytes */
    double kept_epsilon; /* the error that --epsilon asks for; 0: none is kept */
    bool holds;          /* rows of F are needed whatever the method is */
} precompute_job;

/* Luminaires, and their direct light at dim 1. */
typedef struct luminaire_columns {
    placed_luminaires placed;         /* n is 0: there are none */
    float *H;                         /* [n][elements], lx */
    double *elements_off, *means_off; /* [n][groups], lx^2, as in direct_light */
    double *scale;                    /* [n], of candela, with that of TILT */
    placed_ignoring *ignoring;        /* [n_ignoring] */
    size_t n_ignoring, ignoring_capacity;
    placed_luminaires before;     /* of the store that is read */
    lam_luminaires *light_before; /* theirs; NULL: it has none */
} luminaire_columns;
void luminaire_columns_free(luminaire_columns *c);

/* Sensors, and what comes to them: rows of a store that is copied stay there. */
typedef struct scene_sensors {
    sensor_list list; /* n is 0: there are none */
    sensor_rows rows;
    float *H;     /* [luminaires][n], lx at dim 1; NULL: no luminaires */
    bool *inside; /* [n], in the opening of a luminaire; NULL likewise */
    size_t n_eyes;
    uint32_t *eyes;     /* [n_eyes], of the receivers; NULL likewise */
    glare_source *seen; /* [luminaires][n_eyes] */
} scene_sensors;
void scene_sensors_free(scene_sensors *s);

/* The scene as it is computed with. */
typedef struct precompute_scene {
    mesh m;
    size_t n_faces; /* of the file, backs left out; 0: a store was read */
    uint32_t *order;
    double (*centre)[3]; /* [n], with surface where a method needs them */
    uint32_t *surface;
    element_corners corners;       /* a view of m */
    plane_tree tree;               /* of the elements, once blocks are considered */
    block_scene *ready;            /* the mesh on that tree, from a forecast of blocks to these; or NULL */
    face_openings of_faces;        /* of the faces of the file, or around the groups of --portal */
    const face_openings *openings; /* these; NULL: there is no sky, or only a store's mesh is known */
    size_t sky_tiles;
    luminaire_columns luminaires;
    scene_sensors sensors;
    emitter_list emitters;
    emitter_source emitting; /* a view of emitters, for methods */
    importance importance;   /* n is 0 where all is read, and may emit */
    bool lightened; /* a view for the error of the mesh, of a scene that reflects nothing (black_scene.h) */
} precompute_scene;

/* The outcome of the samples of pairs. too_slow: all pairs cost more than they are worth, so that at least
 * least_rays are cast; rays_alone: near pairs do, too. */
typedef struct pairs_weighed {
    bool too_slow, rays_alone;
    size_t least_rays;
} pairs_weighed;

/* The way in which form factors are found. */
enum { PLAN_REASON_BYTES = 1024 };
typedef struct precompute_plan {
    recipe recipe;
    const build_method *method; /* as chosen before the form factors are known */
    factor_cost cost;           /* of the recipe, from a sample; seconds is 0 where none was taken */
    bool streamed;              /* rows of F are found as the method asks for them; none are held */
    bool large;                 /* its rows and the judge's lie in the scratch folder */
    size_t probes;
    pairs_weighed weighed;
    char reason[PLAN_REASON_BYTES]; /* lines on what was weighed, each ended */
} precompute_plan;

/* The form factors: rows, a stream of them, or blocks, with what the rays beside them found. */
typedef struct precompute_factors {
    form_factors f;       /* has no rows of a stream or of blocks */
    block_factors blocks; /* n is 0: none */
    ray_rows *rays;       /* of the stream, until the operator is built */
    row_stream stream;    /* of rays */
    scratch *scratch;     /* the folder where rows lie as they are found; NULL: none */
} precompute_factors;

/* The operator that was made, and what is stated of it. */
typedef struct made_operator {
    lam_operator *op;
    build_report built;
    error_report errors;
    mesh_figures errors_of_mesh;
    group_errors by_group;
    own_figures own; /* own_error.h */
    double repair;   /* relative error of reflected light by faces that count twice; 0: none */
    char advice[ERROR_ADVICE_BYTES]; /* on them; "" where there is none */
} made_operator;

/* The light of --positions or --path. */
typedef struct walked_light {
    moving_light light;      /* n is 0 where there is none */
    reuse_estimates paths;   /* from it */
    double *position_errors; /* [2][s], relative and indirect; NULL: not judged */
} walked_light;

/* Processor seconds of the stages, and the pace of the machine. */
typedef struct stage_times {
    forecast_rates rates;    /* processors is 0 before they are measured */
    forecast_times expected; /* the forecast of the first trial */
    forecast_times spent;    /* the time of the same stages */
} stage_times;

/* The trials of an --epsilon or a --group-error that is an error to keep. */
typedef struct trial_course {
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

/* All that a trial made, for those who only read it. */
typedef struct finished_trial {
    const precompute_job *job;
    const precompute_scene *scene;
    const precompute_plan *plan;
    const precompute_factors *factors;
    const made_operator *made;
    const trial_course *course;
} finished_trial;

/* All parts of a run: for precompute.c and classify, which hand them to the stages one by one. */
typedef struct precompute_parts {
    precompute_job job;
    precompute_options chosen; /* with --time: the options of the recipe that was taken */
    precompute_scene scene;
    precompute_plan plan;
    precompute_factors factors;
    made_operator made;
    trial_course course;
    stage_times times;
    walked_light walked;
} precompute_parts;
precompute_parts parts_begin(const precompute_options *options, terminal *t);
void parts_free(precompute_parts *p);
finished_trial parts_view(const precompute_parts *p);

/* Makes the tree of the elements, once. Frees what a sample of blocks has made ready. */
lam_status scene_make_tree(precompute_scene *scene, lam_error *error);
void scene_forget_ready(precompute_scene *scene);

void trial_made_free(trial_made *made);

#endif
