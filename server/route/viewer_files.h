/* The files of the page at GET /, which the build of server/viewer puts into the daemon. */
#ifndef LAMBERT_SERVER_ROUTE_VIEWER_FILES_H
#define LAMBERT_SERVER_ROUTE_VIEWER_FILES_H

#include "server/route/call.h"

typedef enum viewer_part {
    VIEWER_PAGE,
    VIEWER_SCRIPT,
    VIEWER_STYLE,
    VIEWER_ICON,
    VIEWER_LICENCES,
    VIEWER_PARTS
} viewer_part;

/* True if the daemon was built with the viewer. */
extern const bool viewer_is_built;

/* Empty where it was not. */
extern const fixed_bytes viewer_files[VIEWER_PARTS];

#endif
