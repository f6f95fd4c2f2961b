/* Documents of the sources, which CMake turns into arrays. */
#ifndef LAMBERT_SERVER_ROUTE_DOCUMENT_BYTES_H
#define LAMBERT_SERVER_ROUTE_DOCUMENT_BYTES_H

#include <stddef.h>

/* server/route/openapi.json */
extern const unsigned char openapi_bytes[];
extern const size_t openapi_length;

/* deploy/docs/api.md */
extern const unsigned char manual_bytes[];
extern const size_t manual_length;

#endif
