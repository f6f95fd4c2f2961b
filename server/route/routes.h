/* The one table of routes. Knows no HTTP library. */
#ifndef LAMBERT_SERVER_ROUTE_ROUTES_H
#define LAMBERT_SERVER_ROUTE_ROUTES_H

#include "server/route/call.h"

typedef void route_handler(call *in, answer *out);

/* Answers on the I/O thread if that takes well below a millisecond and waits for nobody; false, with nothing
 * done, if the handler has to. */
typedef bool route_shortcut(call *in, answer *out);

/* A solve that shares passes over an operator with those of other clients (server/queue/batch.h). begin sets
 * the key and n_vectors of the job, and `state` and `refines` of the call; or it makes the answer, usually a
 * problem, and returns false. */
typedef struct solve_steps {
    bool (*begin)(call *in, answer *out);
    void (*pass)(const batch_part *parts, size_t n_parts, batch_workspace *workspace);
    void (*end)(call *in, answer *out);
    void (*drop)(call *in);         /* frees the state in place of end */
    double (*cost)(const call *in); /* seconds of a pass, about; NULL: as passes over the operator have */
} solve_steps;

typedef struct route {
    const char *method;
    const char *pattern;
    route_handler *handle;    /* or */
    const solve_steps *steps; /* of a solve that shares passes */
    route_shortcut *shortcut; /* or NULL */
    route_keeps *keeps;       /* of an answer that is kept: steps and shortcut are send_kept, quick_kept */
    bool with_body;  /* the body may have --max-body bytes; the handler runs on a thread that solves, as steps
                        do */
    bool with_query; /* the call has the query of the target, which others leave unread; without a body it
                        accepts a table of numbers (media_choose_table) */
    bool open;       /* no token is needed, unless one has the right */
    token_right right; /* that a token must have; 0: TOKEN_READ */
    bool any_host;     /* asked for by those that know no name of the daemon */
    bool below_any;    /* the pattern may follow any folder of a path */
    bool also_built;   /* {name} may also be a variant that is not served yet */
} route;

#define ROUTE_NAME_MAX CATALOG_NAME_MAX

/* Labels for metrics: the patterns, then "other". */
size_t route_label_count(void);
const char *route_label(size_t label);

/* The route of a method and a raw path (escapes not resolved). */
typedef struct route_match {
    const route *route; /* NULL: the answer was made */
    size_t label;
    bool with_token; /* the path needs a token, whatever the method */
    bool any_host;   /* the path is answered to under any name */
    bool has_name;
    char name[ROUTE_NAME_MAX]; /* of {name}, escapes resolved; "" if no scene can have it */
} route_match;

/* Sets *match, and *out to 404 or 405 if there is no route, or to 204 for OPTIONS of a path that there is. A
 * path of "*" is the daemon as a whole (RFC 9110, 9.3.7). */
void route_find(const char *method, const char *path, route_match *match, answer *out);

route_handler get_healthz, get_readyz, get_metrics, post_skies, post_sun, post_weather, put_reflectance,
    delete_reflectance, delete_scene, get_viewer_page, get_viewer_script, get_viewer_style, get_viewer_icon,
    get_viewer_licences;
route_shortcut quick_radiosity, quick_kept;
route_keeps keeps_scenes, keeps_scene, keeps_mesh, keeps_elements, keeps_sky, keeps_luminaires, keeps_sensors,
    keeps_groups, keeps_weather, keeps_openapi, keeps_manual;
extern const solve_steps post_radiosity, post_adjoint, post_jacobian, send_kept;

/* The description of the routes, for service.openapi. Errors: LAM_ERR_MEMORY. */
lam_status openapi_keep(kept_forms **out, lam_error *error);

/* Their manual, for service.manual. Errors: LAM_ERR_MEMORY. */
lam_status manual_keep(kept_forms **out, lam_error *error);

#endif
