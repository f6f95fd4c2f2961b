/* The public C API of Lambert: open a store, apply its transport operator (emission in, radiosity out).
 * Knows nothing of how an operator was built, nor of HTTP. */
#ifndef LAMBERT_H
#define LAMBERT_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* Every status and its text, once. Any status but LAM_OK leaves outputs untouched. */
#define LAM_STATUS_LIST(X)                                                                                   \
    X(LAM_OK, "done")                                                                                        \
    X(LAM_ERR_ARGUMENT, "bad argument")                                                                      \
    X(LAM_ERR_MEMORY, "not enough memory")                                                                   \
    X(LAM_ERR_IO, "cannot read or write")                                                                    \
    X(LAM_ERR_FORMAT, "not a file of this format")                                                           \
    X(LAM_ERR_VERSION, "another version of the format")                                                      \
    X(LAM_ERR_DAMAGED, "damaged file")                                                                       \
    X(LAM_ERR_NUMERIC, "numerically impossible")                                                             \
    X(LAM_ERR_UNSUPPORTED, "not supported")                                                                  \
    X(LAM_ERR_CANCELLED, "cancelled")                                                                        \
    X(LAM_ERR_INTERNAL, "internal error")

#define LAM_STATUS_ENUM(code, text) code,
typedef enum lam_status { LAM_STATUS_LIST(LAM_STATUS_ENUM) } lam_status;
#undef LAM_STATUS_ENUM

/* An error: its code, and one line that names the object, the value and the limit. Owned by the caller. */
typedef struct lam_error {
    lam_status status;
    char message[480];
} lam_error;

/* The text of a status; never NULL, static. */
const char *lam_status_text(lam_status status);

/* Radiosity B, irradiance H (all that is received) or indirect light B - E - rho H0; all in the unit of E. H0
 * is what a sky gives directly, 0 without one. */
typedef enum lam_quantity { LAM_RADIOSITY, LAM_IRRADIANCE, LAM_INDIRECT } lam_quantity;

/* The sources of light that derivatives are by: dimmers of luminaires, emissions that all elements of a group
 * have, radiances of sky tiles; or, of a store of few emitters, their weights. */
typedef enum lam_by { LAM_BY_LUMINAIRES, LAM_BY_GROUPS, LAM_BY_SKY, LAM_BY_EMITTERS } lam_by;

/* A transport operator: immutable once open, so any number of threads may apply it. */
typedef struct lam_operator lam_operator;

/* Opens the store at path and loads its operator; the caller closes it with lam_operator_close.
 * Errors: LAM_ERR_IO, LAM_ERR_FORMAT, LAM_ERR_VERSION, LAM_ERR_DAMAGED, LAM_ERR_MEMORY, LAM_ERR_UNSUPPORTED.
 * Any thread; a child process reads the headers of the file, so SIGCHLD must not be ignored. */
lam_status lam_operator_open(const char *path, lam_operator **op, lam_error *error);

/* Frees an operator; NULL is allowed. */
void lam_operator_close(lam_operator *op);

/* Elements n, channels C, and the bytes of operator that a solve reads. */
size_t lam_operator_elements(const lam_operator *op);
size_t lam_operator_channels(const lam_operator *op);
size_t lam_operator_bytes(const lam_operator *op);

/* The contract's name of its kind ("low_rank", ...); owned by the operator. */
const char *lam_operator_kind(const lam_operator *op);

/* Sets the number of threads that one answer may use, 1 by default; short vectors are answered by one. Call
 * it before the operator is shared and before lam_operator_work_bytes. The bits of an answer do not depend on
 * it. The threads are OpenMP's, which spin while they wait unless the environment that the program starts
 * with has OMP_WAIT_POLICY=passive; beside other busy programs they should not. The programs of Lambert see
 * to that by themselves, a library cannot. */
void lam_operator_set_threads(lam_operator *op, size_t n_threads);

/* Bytes of work area that lam_operator_apply, _selected and its adjoint need for n_rhs vectors; 0 when that
 * overflows.
 */
size_t lam_operator_work_bytes(const lam_operator *op, size_t n_rhs);

/* out = quantity(M~ E) for a batch.
 * E and out are [n_rhs][C][n] in mesh order and must not overlap. work holds work_bytes, at least what
 * lam_operator_work_bytes says, aligned as malloc does; its content is lost. Allocates nothing.
 * A vector's bits do not depend on the batch it is in.
 * Cost: O(nk) per vector for a low-rank operator. Errors: LAM_ERR_ARGUMENT. */
lam_status lam_operator_apply(const lam_operator *op, size_t n_rhs, lam_quantity quantity, const float *E,
                              float *out, void *work, size_t work_bytes, lam_error *error);

/* The same under a sky that gives the irradiance H0, [n_rhs][C][n] (lam_sky_irradiance; NULL: none):
 * E' = E + rho H0, B = M~ E', H = H0 + F B. Elements without reflectance have an irradiance too. */
lam_status lam_operator_apply_lit(const lam_operator *op, size_t n_rhs, lam_quantity quantity, const float *E,
                                  const float *H0, float *out, void *work, size_t work_bytes,
                                  lam_error *error);

/* The same for some elements only, of which no other row is computed: out is [n_rhs][C][n_selected], in the
 * order of selected, which may name an element twice; bit for bit what the whole answer has there. E and H0
 * are whole. Cost: O((n + n_selected) k) per vector for a low-rank operator, less where E is sparse; for a
 * hierarchical one that of the parts of its tree above the elements selected and those lit, about a quarter
 * of the whole answer where either is one group of nine. Errors: also LAM_ERR_ARGUMENT for an element that is
 * not below n. */
lam_status lam_operator_apply_selected(const lam_operator *op, size_t n_rhs, lam_quantity quantity,
                                       const float *E, const float *H0, size_t n_selected,
                                       const uint32_t *selected, float *out, void *work, size_t work_bytes,
                                       lam_error *error);

/* The share of one caller in a pass over the operator: the arguments of lam_operator_apply_lit. */
typedef struct lam_part {
    size_t n_rhs;
    lam_quantity quantity;
    const float *E, *H0;
    float *out;
} lam_part;

/* lam_operator_apply_lit for several callers at once, whose vectors share passes over the operator: each gets
 * the bits that it would get alone. work_bytes is at least what lam_operator_work_bytes says of all their
 * vectors together. Errors: LAM_ERR_ARGUMENT; then nobody gets anything. */
lam_status lam_operator_apply_parts(const lam_operator *op, size_t n_parts, const lam_part *parts, void *work,
                                    size_t work_bytes, lam_error *error);

/* The number of emitters that a store of few emitters answers for; 0 of any other operator, which answers any
 * emission. Where it is not 0, lam_operator_apply, its variants and its adjoint end in LAM_ERR_ARGUMENT, and
 * lam_operator_apply_emitters and lam_operator_adjoint_emitters take their place. */
size_t lam_operator_emitters(const lam_operator *op);

/* The name of emitter k; owned by the operator. The store's luminaires are the last emitters of one that has
 * luminaires, in their order; weights of them are dimmers. */
const char *lam_operator_emitter_name(const lam_operator *op, size_t k);

/* The weights W [n_rhs][C][s] whose emitters together are the emissions E [n_rhs][C][n] and the sky of
 * radiances L [n_rhs][C][n_tiles]; either may be NULL, for none. The weights of luminaires are 0. Errors:
 * LAM_ERR_ARGUMENT names an element or a tile whose light no weights give (to 1e-5 of it), LAM_ERR_MEMORY. */
lam_status lam_operator_weights(const lam_operator *op, size_t n_rhs, const float *E, size_t n_tiles,
                                const float *L, float *W, lam_error *error);

/* out = the quantity under emitters of weights W [n_rhs][C][s]: out is [n_rhs][C][n], or, where selected is
 * not NULL, [n_rhs][C][n_selected]. Otherwise as lam_operator_apply_selected. Cost: O(ns) per vector. */
lam_status lam_operator_apply_emitters(const lam_operator *op, size_t n_rhs, lam_quantity quantity,
                                       const float *W, size_t n_selected, const uint32_t *selected,
                                       float *out, void *work, size_t work_bytes, lam_error *error);

/* W = (d quantity / d weights)^T g: g is [n_rhs][C][n], W [n_rhs][C][s]. */
lam_status lam_operator_adjoint_emitters(const lam_operator *op, size_t n_rhs, lam_quantity quantity,
                                         const float *g, float *W, void *work, size_t work_bytes,
                                         lam_error *error);

/* w = (d quantity / d E)^T g for a batch: the transpose of lam_operator_apply, same shapes, same rules. */
lam_status lam_operator_apply_adjoint(const lam_operator *op, size_t n_rhs, lam_quantity quantity,
                                      const float *g, float *w, void *work, size_t work_bytes,
                                      lam_error *error);

/* The limiter keeps light of answers from falling below zero, by the areas and groups of a store's elements;
 * immutable once open. An operator is linear, and its errors put some of its values below zero where little
 * light is. */
typedef struct lam_limiter lam_limiter;

/* Opens the store at path and loads its groups; the caller closes it with lam_limiter_close. Errors and
 * threads as lam_operator_open. */
lam_status lam_limiter_open(const char *path, lam_limiter **limiter, lam_error *error);

/* Frees it; NULL is allowed. */
void lam_limiter_close(lam_limiter *limiter);

/* Bytes of work area that lam_limiter_apply needs, however many vectors there are. */
size_t lam_limiter_work_bytes(const lam_limiter *limiter);

/* Limits answers of an operator of the same store: what out has beside E + rho H0 (of irradiance, beside H0)
 * is nowhere negative after it, and its area-weighted mean over each group is what it was, to rounding, or 0
 * where it was negative. Nothing changes where nothing is negative, nor in a vector's channel whose emission
 * or sky is negative somewhere, as its light may be so too. out is [n_rhs][C][n] from lam_operator_apply_lit
 * with these E and H0 (NULL: none), or from lam_operator_apply_emitters with these weights W [n_rhs][C][s] (E
 * and H0 NULL). limited [n_rhs], unless NULL, gets the number of elements that were below zero, in all
 * channels. Allocates nothing; any thread. A vector's bits do not depend on the batch it is in. Cost: O(n)
 * per vector. Errors: LAM_ERR_ARGUMENT. */
lam_status lam_limiter_apply(const lam_limiter *limiter, const lam_operator *op, size_t n_rhs,
                             lam_quantity quantity, const float *E, const float *H0, const float *W,
                             float *out, size_t *limited, void *work, size_t work_bytes, lam_error *error);

/* The form factors F that a store keeps (lambert precompute --keep-form-factors), as rows of single
 * precision, 8 bytes per entry, or as blocks of clusters; immutable once open. */
typedef struct lam_form_factors lam_form_factors;

/* Opens the store at path and loads them; *F is NULL when it keeps none. The caller closes them with
 * lam_form_factors_close. Takes half as much memory again while it expands what a store of more than 10,240
 * elements keeps. Errors and threads as lam_operator_open. */
lam_status lam_form_factors_open(const char *path, lam_form_factors **F, lam_error *error);

/* Frees them; NULL is allowed. */
void lam_form_factors_close(lam_form_factors *F);

/* Bytes that one product with F reads. */
size_t lam_form_factors_bytes(const lam_form_factors *F);

/* Answers of an operator refined in double until their error is certified against F; immutable. */
typedef struct lam_refiner lam_refiner;

/* Makes ready: finds a bound on |(I - R F)^-1| for every channel. op and F are of one store and outlive it.
 * Freed by lam_refiner_free. Allocates; uses as many threads as op (lam_operator_set_threads). Cost: a few
 * products with F. Errors: LAM_ERR_ARGUMENT (another number of elements), LAM_ERR_MEMORY, LAM_ERR_NUMERIC
 * (reflectance times row sum is too close to 1 for anything to be certified). */
lam_status lam_refiner_create(const lam_operator *op, const lam_form_factors *F, lam_refiner **out,
                              lam_error *error);
void lam_refiner_free(lam_refiner *refiner);

/* out = the quantity of B = E' + R F B for a batch, E' = E + rho H0, with a certified error: in every channel
 *     |B - B~| <= tolerance |B~ - E'|      in the maximum norm, 0 < tolerance < 1
 * (where nothing bounces B~ is E', with the rounding of E + rho H0).
 * E, H0 (NULL: none) and out are [n_rhs][C][n] in mesh order; E and H0 from 0 to 1e100.
 * certificates [n_rhs] gets a bound on the difference between any value of that vector of out and the
 * quantity that F gives, in the unit of E, rounding included; iterations [n_rhs] the number of products with
 * F for it. start [n_rhs][C][n] is a first guess of the indirect light, NULL: the operator's answer, or 0 of
 * an operator of few emitters, which refines without its help. Allocates. A vector's bits depend neither on
 * its batch nor on threads; any number of threads may call. Cost: a product with F and one answer an
 * iteration; a factor of about a thirtieth of the error each for a low-rank operator of epsilon .1. Errors:
 * LAM_ERR_ARGUMENT; LAM_ERR_NUMERIC where the tolerance is more than double can certify, or than 2000
 * iterations reach, with the bound reached; LAM_ERR_MEMORY. */
lam_status lam_refine(const lam_refiner *refiner, size_t n_rhs, lam_quantity quantity, const double *E,
                      const double *H0, const float *start, double tolerance, double *out,
                      double *certificates, size_t *iterations, lam_error *error);

/* The irradiance that the elements of a store receive directly from the tiles of a sky; immutable once open.
 */
typedef struct lam_sky lam_sky;

/* Opens the store at path and loads its sky; *sky is NULL when it has none. The caller closes it with
 * lam_sky_close. Errors and threads as lam_operator_open. */
lam_status lam_sky_open(const char *path, lam_sky **sky, lam_error *error);

/* Frees a sky; NULL is allowed. */
void lam_sky_close(lam_sky *sky);

/* Tiles m and elements n. */
size_t lam_sky_tiles(const lam_sky *sky);
size_t lam_sky_elements(const lam_sky *sky);

/* H0 = first_bounce^T L for n_rows rows (vectors times channels): L is [n_rows][m], W/(m^2 sr), H0 is
 * [n_rows][n] in mesh order. Allocates nothing; a row's bits do not depend on its neighbours.
 * Cost: O(mn) per row, less for tiles that are dark. */
void lam_sky_irradiance(const lam_sky *sky, size_t n_rows, const float *L, float *H0);

/* L = first_bounce g, the transpose: the gradient of <g, H0> by the radiance of every tile. g is [n_rows][n],
 * L is [n_rows][m]. */
void lam_sky_adjoint(const lam_sky *sky, size_t n_rows, const float *g, float *L);

/* The irradiance that the elements of a store receive directly from its luminaires; immutable once open. The
 * dimmer of a luminaire is 1 at its full light; its colour is a factor of each channel. */
typedef struct lam_luminaires lam_luminaires;

/* Opens the store at path and loads its luminaires; *luminaires is NULL when it has none. The caller closes
 * them with lam_luminaires_close. Errors and threads as lam_operator_open. */
lam_status lam_luminaires_open(const char *path, lam_luminaires **luminaires, lam_error *error);

/* Frees them; NULL is allowed. */
void lam_luminaires_close(lam_luminaires *luminaires);

/* Luminaires k, channels C and elements n. */
size_t lam_luminaires_count(const lam_luminaires *luminaires);
size_t lam_luminaires_channels(const lam_luminaires *luminaires);
size_t lam_luminaires_elements(const lam_luminaires *luminaires);

/* The name of a luminaire, owned by luminaires, and the dimmer that its list gives it. */
const char *lam_luminaires_name(const lam_luminaires *luminaires, size_t luminaire);
double lam_luminaires_dimmer(const lam_luminaires *luminaires, size_t luminaire);

/* Adds their irradiance under dimmers D [n_rhs][C][k] to H0 [n_rhs][C][n], lx in mesh order, zeroed or that
 * of a sky. Allocates nothing; a vector's bits do not depend on its neighbours. Cost: O(kn) per row, less for
 * luminaires that are dark. */
void lam_luminaires_irradiance(const lam_luminaires *luminaires, size_t n_rhs, const float *D, float *H0);

/* The transpose, the gradient of <g, H0> by every dimmer of every channel: g is [n_rhs][C][n], D is
 * [n_rhs][C][k]. Of a dimmer that all channels share it is the sum over channels. */
void lam_luminaires_adjoint(const lam_luminaires *luminaires, size_t n_rhs, const float *g, float *D);

/* The light that comes to sensors of a store: receivers at points, in named sets, and the weights with which
 * radiosities of elements, radiances of sky tiles and luminaires are gathered at them; immutable once open.
 * Illuminances of points are free of the mean over an element that the radiosity of one is. */
typedef struct lam_sensors lam_sensors;

/* Opens the store at path and loads its sensors; *sensors is NULL when it has none. The caller closes them
 * with lam_sensors_close. Errors and threads as lam_operator_open. */
lam_status lam_sensors_open(const char *path, lam_sensors **sensors, lam_error *error);

/* Frees sensors; NULL is allowed. */
void lam_sensors_close(lam_sensors *sensors);

/* Receivers s, channels C, elements n, sky tiles m and luminaires k (0: none), and the number of sets. */
size_t lam_sensors_count(const lam_sensors *sensors);
size_t lam_sensors_channels(const lam_sensors *sensors);
size_t lam_sensors_elements(const lam_sensors *sensors);
size_t lam_sensors_tiles(const lam_sensors *sensors);
size_t lam_sensors_luminaires(const lam_sensors *sensors);
size_t lam_sensors_sets(const lam_sensors *sensors);

/* The name of a set, owned by sensors, its first receiver and their number. */
const char *lam_sensors_set(const lam_sensors *sensors, size_t set, size_t *first, size_t *count);

/* 0 where a receiver lies in a wall or in a luminaire, so that no value at it is true. */
int lam_sensors_has_value(const lam_sensors *sensors, size_t receiver);

/* out = rows B + sky^T L + luminaires^T (colour D), the irradiances of receivers (of cylinders and spheres
 * those that their weights define; of probes, nine receivers each, coefficients of the radiance, which have
 * either sign): B [n_rhs][C][n] are radiosities of an operator of the same store under
 * the same light, L [n_rhs][C][m] radiances of the sky, D [n_rhs][C][k] dimmers, each of the two NULL for
 * none; out is [n_rhs][C][s]. Direct light comes to the point itself, so that B must have been lit by L and D
 * too (lam_operator_apply_lit). Allocates nothing; a vector's bits do not depend on its neighbours. Cost: the
 * stored weights, m s and k s per row. */
void lam_sensors_gather(const lam_sensors *sensors, size_t n_rhs, const float *B, const float *L,
                        const float *D, float *out);

/* The transpose: of g [n_rhs][C][s], the gradients of <g, out> by B [n_rhs][C][n], L [n_rhs][C][m] and D
 * [n_rhs][C][k], each of which may be NULL. L and D stay as they are where the store has no sky and no
 * luminaires. */
void lam_sensors_adjoint(const lam_sensors *sensors, size_t n_rhs, const float *g, float *B, float *L,
                         float *D);

/* variance [n_rhs][C][s]: estimates of the variance that the sampling of weights gives to values under B and
 * L, as in lam_sensors_gather. Each has one degree of freedom; the mean over a set is sound, one alone is
 * not. */
void lam_sensors_variance(const lam_sensors *sensors, size_t n_rhs, const float *B, const float *L,
                          float *variance);

/* A store as a whole: its operator, sky and luminaires, the names, groups, areas and reflectances of its
 * elements, and the errors that it states; immutable once open, so any number of threads may ask it. */
typedef struct lam_scene lam_scene;

/* Opens the store at path and loads all that the functions below need; the caller closes it with
 * lam_scene_close. Errors and threads as lam_operator_open. */
lam_status lam_scene_open(const char *path, lam_scene **scene, lam_error *error);

/* Frees a scene with all that it has given; NULL is allowed. */
void lam_scene_close(lam_scene *scene);

/* As lam_operator_set_threads: before the scene is shared. */
void lam_scene_set_threads(lam_scene *scene, size_t n_threads);

/* Its parts, owned by the scene; sky and luminaires are NULL where the store has none. */
const lam_operator *lam_scene_operator(const lam_scene *scene);
const lam_limiter *lam_scene_limiter(const lam_scene *scene);
const lam_sky *lam_scene_sky(const lam_scene *scene);
const lam_luminaires *lam_scene_luminaires(const lam_scene *scene);

/* The unit of its light, "W" or "lm", static: emissions are W/m^2 or lm/m^2. */
const char *lam_scene_lights(const lam_scene *scene);

/* Of elements in mesh order, owned by the scene: areas [n], m^2; reflectances [C][n]; unit normals towards
 * the front and area centroids, m, [n][3], in the axes of the scene. */
const double *lam_scene_areas(const lam_scene *scene);
const float *lam_scene_reflectances(const lam_scene *scene);
const float *lam_scene_normals(const lam_scene *scene);
const float *lam_scene_centres(const lam_scene *scene);

/* The number of groups; the name of one, owned by the scene; the area of those of its elements that figures
 * take in, m^2, which is without elements that lie below a body; and all its elements in mesh order. */
size_t lam_scene_groups(const lam_scene *scene);
const char *lam_scene_group(const lam_scene *scene, size_t group);
double lam_scene_group_area(const lam_scene *scene, size_t group);
const uint32_t *lam_scene_group_elements(const lam_scene *scene, size_t group, size_t *count);

/* The groups that a name means, as requests to the daemon have names: that of a group, of an object of
 * several materials, or "desk*". Returns how many, 0 for an unknown name; *groups is owned by the scene. */
size_t lam_scene_find(const lam_scene *scene, const char *name, const uint32_t **groups);

/* The light of one vector; what is NULL or 0 is dark, and all parts add up. In a store of few emitters it has
 * to be one that weights give (lam_operator_weights). */
typedef struct lam_light {
    const float *E;         /* [C][n], emissions of elements */
    const uint32_t *groups; /* [n_groups], groups whose elements all emit alike */
    const float *exitances; /* [n_groups][C], of these */
    size_t n_groups;
    const float *L; /* [C][m], radiances of sky tiles */
    const float *D; /* [C][k], dimmers of luminaires */
    const float *W; /* [C][s], weights of emitters, of a store of few */
} lam_light;

/* out [n_lights][C][n] = the quantity under each light. limited [n_lights] gets the number of elements that
 * were below zero before the limiter took that away (lam_limiter_apply); NULL: the linear map is wanted.
 * Allocates; a vector's bits do not depend on its batch. Errors: LAM_ERR_ARGUMENT, LAM_ERR_MEMORY. */
lam_status lam_scene_answer(const lam_scene *scene, lam_quantity quantity, size_t n_lights,
                            const lam_light *lights, float *out, size_t *limited, lam_error *error);

/* Figures of groups: sum A x / sum A, sum A x, min, max, min / mean and sum A (x - mean)^2 / sum A. */
typedef enum lam_figure {
    LAM_MEAN,
    LAM_SUM,
    LAM_MIN,
    LAM_MAX,
    LAM_UNIFORMITY,
    LAM_VARIANCE,
    LAM_FIGURES
} lam_figure;

/* figures [n_rhs][C][LAM_FIGURES] of the elements of some groups together, of values [n_rhs][C][n] in mesh
 * order. NaN where a figure has no value: of groups without area, and of a mean of 0. Cost: that of the
 * elements of the groups. Errors: LAM_ERR_ARGUMENT. */
lam_status lam_scene_reduce(const lam_scene *scene, size_t n_groups, const uint32_t *groups, size_t n_rhs,
                            const float *values, double *figures, lam_error *error);

/* The stated error of an answer: stated = sqrt(rest^2 + mesh^2), relative to the light that surfaces reflect,
 * of operator and form factors and of constants on elements (negative: not stated). own is 0 where it is that
 * of the scene's lights, or of single elements, as the store states none by group. */
typedef struct lam_stated {
    double stated, rest, mesh;
    int own;
} lam_stated;

/* *out = the stated error of an answer, values [C][n] of the quantity under the light: of the mean over some
 * groups together, or of all elements where n_groups is 0. Not finite where something shines and nothing is
 * reflected. Allocates; cost: O(C n). Errors: LAM_ERR_UNSUPPORTED where the store states nothing of such an
 * answer; LAM_ERR_ARGUMENT, LAM_ERR_MEMORY. */
lam_status lam_scene_stated(const lam_scene *scene, lam_quantity quantity, const lam_light *light,
                            const float *values, size_t n_groups, const uint32_t *groups, lam_stated *out,
                            lam_error *error);

/* The number of sources of a kind: columns of derivatives by them. */
size_t lam_scene_sources(const lam_scene *scene, lam_by by);

/* Derivatives of values of elements by all sources of a kind, out [C][n_elements][lam_scene_sources]: times
 * what the sources give they are the answer of the linear map. Allocates. Cost: as many answers as there are
 * elements or sources, whichever are fewer. NaN where a store of few emitters has no weights for a source.
 * Errors: LAM_ERR_ARGUMENT, LAM_ERR_MEMORY. */
lam_status lam_scene_jacobian(const lam_scene *scene, lam_quantity quantity, size_t n_elements,
                              const uint32_t *elements, lam_by by, float *out, lam_error *error);

/* Rows of the means of groups, which are linear in the light; immutable once made. */
typedef struct lam_rows lam_rows;

/* Makes rows [n_names] of the means over what each name means (lam_scene_find). The caller closes them with
 * lam_rows_close before the scene. Cost: an answer each, once; C n floats of memory each. Errors:
 * LAM_ERR_ARGUMENT names an unknown name and the nearest one; LAM_ERR_MEMORY. */
lam_status lam_rows_create(const lam_scene *scene, lam_quantity quantity, size_t n_names,
                           const char *const *names, lam_rows **rows, lam_error *error);
void lam_rows_close(lam_rows *rows);

/* The area that the mean of row k is over, m^2; times the mean it is the sum. */
double lam_rows_area(const lam_rows *rows, size_t k);

/* means [n_lights][rows][C] of the linear map; NaN of a row without area. A limited mean is this or 0, where
 * it is negative and no light is. Cost: rows times lit sources, whatever n is; C n more for E. Errors:
 * LAM_ERR_ARGUMENT; of a store of few emitters also for light that no weights are known for; LAM_ERR_MEMORY.
 */
lam_status lam_rows_means(const lam_rows *rows, size_t n_lights, const lam_light *lights, double *means,
                          lam_error *error);

/* The derivatives of the means by all sources of a kind, out [C][rows][lam_scene_sources]. NaN as in
 * lam_scene_jacobian, and of a row without area. */
void lam_rows_jacobian(const lam_rows *rows, lam_by by, float *out);

/* The corners that elements of a store share, of which pictures of light are smooth: elements of one group
 * that meet at less than 20 degrees share them, so that light spreads neither around edges nor into other
 * groups; where a corner lies inside an edge of a larger element, it has the light of that edge. Immutable
 * once open. */
typedef struct lam_corners lam_corners;

/* Opens the store at path and finds its corners, some 3 us an element; the caller closes them with
 * lam_corners_close. Errors: as lam_operator_open, LAM_ERR_ARGUMENT (more than 2^32 weights). Any thread. */
lam_status lam_corners_open(const char *path, lam_corners **corners, lam_error *error);

/* Frees corners; NULL is allowed. */
void lam_corners_close(lam_corners *corners);

/* Elements n and corners k. */
size_t lam_corners_elements(const lam_corners *corners);
size_t lam_corners_count(const lam_corners *corners);

/* Their places [k][3], m, in the axes of the store; owned by corners. */
const double *lam_corners_positions(const lam_corners *corners);

/* The corners of an element's polygon, counter-clockwise, those inside its edges among them: *list, owned by
 * corners; returns their number, 3 or more. element is below n. */
size_t lam_corners_of(const lam_corners *corners, size_t element, const uint32_t **list);

/* Light at corners of light at elements, x [n_rows][n], rows being vectors times channels: out is
 * [n_rows][k], bit for bit what lambertd answers at corners. Linear light is reproduced; nothing falls below
 * 0, nor below the least of x where that is negative. work [n] is lost. Allocates nothing; a row's bits do
 * not depend on its neighbours. Cost: O(n). */
void lam_corners_apply(const lam_corners *corners, size_t n_rows, const float *x, float *out, float *work);

/* The transpose, the gradient of <g, out> by x where no value was bounded: g is [n_rows][k], x [n_rows][n].
 * work [n + 2 k] is lost. */
void lam_corners_adjoint(const lam_corners *corners, size_t n_rows, const float *g, float *x, float *work);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
