/* GET /: the page in the browser, and the files that it asks for. */
#include "server/route/routes.h"
#include "server/route/viewer_files.h"

/* The page asks its own origin only, and runs no script but its own. */
#define POLICY                                                                                               \
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src "      \
    "'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"

static const char off_page[] =
    "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Lambert</title><h1>Lambert</h1>"
    "<p>%s</p><p>The scenes stand at <a href=\"v1/scenes\">/v1/scenes</a>, the routes at "
    "<a href=\"v1/openapi.json\">/v1/openapi.json</a>.</p></html>\n";

static const char *why_off(const call *in) {
    if (in->service->config->no_viewer) return "The viewer is switched off (--no-viewer).";
    if (!viewer_is_built)
        return "This daemon was built without the viewer. Its build makes it where it finds Node.js and npm: "
               "install them, then run cmake with -DLAMBERT_VIEWER=ON and build lambertd again.";
    return NULL;
}

static void answer_file(call *in, answer *out, viewer_part part, const char *type) {
    if (why_off(in) != NULL) {
        answer_refuse(out, PROBLEM_NOT_FOUND, "%s", why_off(in));
        return;
    }
    out->status = 200;
    out->type = type;
    out->fixed = &viewer_files[part];
}

void get_viewer_page(call *in, answer *out) {
    const char *off = why_off(in);
    if (off == NULL) {
        answer_file(in, out, VIEWER_PAGE, "text/html; charset=utf-8");
        out->policy = POLICY;
        return;
    }
    buffer b = {0};
    answer_json(out, &b, buffer_printf(&b, off_page, off));
    if (out->status == 200) out->type = "text/html; charset=utf-8";
    out->policy = POLICY;
}

void get_viewer_script(call *in, answer *out) {
    answer_file(in, out, VIEWER_SCRIPT, "text/javascript; charset=utf-8");
}

void get_viewer_style(call *in, answer *out) {
    answer_file(in, out, VIEWER_STYLE, "text/css; charset=utf-8");
}

void get_viewer_icon(call *in, answer *out) {
    answer_file(in, out, VIEWER_ICON, "image/svg+xml");
}

void get_viewer_licences(call *in, answer *out) {
    answer_file(in, out, VIEWER_LICENCES, "text/plain; charset=utf-8");
}
