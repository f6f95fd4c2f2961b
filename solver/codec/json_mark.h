/* The byte order mark before a text of JSON, for every reader of such texts. */
#ifndef LAMBERT_CODEC_JSON_MARK_H
#define LAMBERT_CODEC_JSON_MARK_H

#include <stddef.h>

/* The bytes of the byte order mark before a text in UTF-8, which is passed over (RFC 8259, 8.1). *fault
 * becomes a static text where it is in another encoding of Unicode, and stays else. */
size_t json_mark_length(const char *text, size_t length, const char **fault);

#endif
