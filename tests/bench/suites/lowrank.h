/* The parts of the suite lowrank and what they share. */
#ifndef LAMBERT_BENCH_LOWRANK_H
#define LAMBERT_BENCH_LOWRANK_H

#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/pairs/first_light.h"
#include "solver/method/judge/judge.h"
#include "solver/method/low_rank/factorizer.h"
#include "tests/bench/suites/bench.h"

/* A scene with its form factors as a matrix. */
typedef struct lowrank_scene {
    const char *name; /* static */
    mesh m;
    uint32_t *z_order, *mesh_order; /* [n] */
    double (*centre)[3];            /* [n] centroids */
    uint32_t *surface;              /* [n] */
    form_factors f;
    double seconds; /* of the form factors */
} lowrank_scene;

void lowrank_scene_free(lowrank_scene *s);

/* Takes the mesh over and finds its form factors by a recipe, or leaves them for later where it is NULL; name
 * is static. */
lam_status lowrank_open(const bench_run *run, const char *name, mesh *m, const recipe *how,
                        lowrank_scene *out, lam_error *error);
lam_status lowrank_trace(const bench_run *run, lowrank_scene *s, const recipe *how, lam_error *error);

/* Pair by pair up to 24,000 elements, rays beyond. */
recipe lowrank_recipe(const bench_run *run, size_t elements);

/* The scene as builders see it; the scene must outlive it. */
build_problem lowrank_problem(const lowrank_scene *s);

/* Five walls of a cube, each of divisions x divisions squares of two triangles: 10 divisions^2 elements,
 * which are the sizes of the thesis' Cornell box, 640 x 4^k. */
lam_status lowrank_room(const bench_run *run, size_t divisions, lowrank_scene *out, lam_error *error);

/* The same without form factors. */
lam_status lowrank_bare_room(const bench_run *run, size_t divisions, lowrank_scene *out, lam_error *error);

/* The Cornell box with its blocks; a courtyard of two storeys with galleries. About so many elements. */
lam_status lowrank_cornell(const bench_run *run, size_t elements, lowrank_scene *out, lam_error *error);
lam_status lowrank_patio(const bench_run *run, size_t elements, lowrank_scene *out, lam_error *error);

/* Calls one with the Cornell box of sizes[0] elements, then with the courtyard of sizes[1], and hands
 * the table on. */
typedef lam_status lowrank_of_scene(const bench_run *run, const lowrank_scene *s, bool courtyard, table *out,
                                    lam_error *error);
lam_status lowrank_box_and_patio(const bench_run *run, const size_t sizes[2], lowrank_of_scene *one,
                                 table *out, lam_error *error);

/* lowrank_begin_peak returns the bytes of memory now and resets the peak of the process (where the kernel
 * allows it); lowrank_peak returns how far the peak has passed them since. */
double lowrank_begin_peak(void);
double lowrank_peak(double before);

/* Cost and error of one factorization. */
typedef struct lowrank_result {
    double seconds; /* median of the repeats */
    size_t rank;
    double real; /* |S - Q V^T|_2 */
    double peak; /* bytes of memory, the most while it ran, beside what was there before */
    factorizer_report report;
} lowrank_result;

lam_status lowrank_factorize(const bench_run *run, const lowrank_scene *s, const char *name,
                             const factorizer_options *options, bool in_z_order, size_t repeats,
                             lowrank_result *out, lam_error *error);

/* The default options of precompute. */
factorizer_options lowrank_options(const bench_run *run, double epsilon, size_t rank);

/* Settings of an operator and of its errors; the other settings are the defaults of precompute. */
typedef struct lowrank_case {
    const char *method, *factorizer;
    double epsilon;
    size_t rank;                    /* 0: by epsilon */
    size_t probes;                  /* single elements, at most */
    double threshold;               /* sparse; 0: its preset */
    const char *assign;             /* two meshes; NULL: its preset */
    const emitter_source *emitters; /* of the method emitters; else NULL */
    const csr *independent;         /* another sample of F, or NULL: no total error */
    first_light *first;             /* of single elements, more exact than that sample; or NULL */
    bool weighed;                   /* stored is found */
} lowrank_case;

typedef struct lowrank_verdict {
    build_report built;
    error_report judged;
    double answer_seconds; /* of one radiosity, median, one thread; light from everywhere or all emitters */
    double bytes;          /* that an answer reads */
    double stored;         /* bytes of the operator in a store, where it was weighed */
} lowrank_verdict;

/* Median seconds of one radiosity over a number of solves, at most LOWRANK_SOLVES_MOST; of the kind emitters
 * the radiosity of all its emitters. */
enum { LOWRANK_SOLVES_MOST = 31 };
lam_status lowrank_time_answer(const lam_operator *op, size_t solves, double *median, lam_error *error);

/* Bytes of a store that holds nothing but the operator; it is written to a temporary file. */
lam_status lowrank_stored_bytes(const lam_operator *op, double *bytes, lam_error *error);

lam_status lowrank_judge(const bench_run *run, const lowrank_scene *s, const lowrank_case *of,
                         lowrank_verdict *out, lam_error *error);

/* Tables 3.1 to 3.5 of the thesis and figures 3.3 to 3.5. */
lam_status lowrank_of_alpha(const bench_run *run, const lowrank_scene *s, lam_error *error);
lam_status lowrank_of_order(const bench_run *run, const lowrank_scene *const *scenes, size_t n,
                            lam_error *error);
lam_status lowrank_of_compression(const bench_run *run, const lowrank_scene *s, lam_error *error);
lam_status lowrank_of_factorizers(const bench_run *run, const lowrank_scene *const *scenes, size_t n,
                                  lam_error *error);
lam_status lowrank_of_levels(const bench_run *run, const lowrank_scene *const *scenes, size_t n,
                             lam_error *error);
lam_status lowrank_of_rank(const bench_run *run, const lowrank_scene *const *scenes, size_t n,
                           lam_error *error);

/* HF of rows that are not kept, and its memory (tables 3.2 and 3.3). */
lam_status lowrank_of_streamed(const bench_run *run, lam_error *error);

/* Tables 3.6 and 3.7: radiosity. */
lam_status lowrank_of_radiosity(const bench_run *run, lam_error *error);

/* Table 3.6: time of a factorization and radiosities a second, also at the size of Sponza. */
lam_status lowrank_of_frames(const bench_run *run, lam_error *error);

/* Every method: run time and memory against error, and two meshes against the SVD at equal k. */
lam_status lowrank_of_methods(const bench_run *run, lam_error *error);

/* Two meshes of real scenes, by either way to give elements to patches. */
lam_status lowrank_of_two_meshes(const bench_run *run, lam_error *error);

/* The lamps of two scenes by iterations without an operator, beside operators. */
lam_status lowrank_of_relaxation(const bench_run *run, lam_error *error);

/* Tables 1 to 5 of Fernández et al. 2011: the index vector, and frames a second. */
lam_status lowrank_of_index_vector(const bench_run *run, lam_error *error);

#endif
