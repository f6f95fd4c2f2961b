/* The files of the page at GET /, which the build of server/viewer puts into the daemon; none where it was built
 * without the viewer. */
#ifndef LAMBERT_SERVER_ROUTE_VIEWER_FILES_H
#define LAMBERT_SERVER_ROUTE_VIEWER_FILES_H

#include <stddef.h>

typedef struct viewer_file {
    const char *path; /* of its route */
    const char *type;
    const unsigned char *bytes;
    size_t length;
    const unsigned char *gzip; /* the same, compressed */
    size_t gzip_length;
} viewer_file;

extern const viewer_file viewer_files[];
extern const size_t viewer_file_count;

#endif
