#include "solver/codec/headline.h"

#include "solver/codec/json_writer.h"

#include <math.h>
#include <stdio.h>

static const double coarse = .1;
static const char sun_option[] = "--sun exact --sun-points 64";

static const char *verb_of(const headline_part *part) {
    return part->option == sun_option ? "solve" : "precompute";
}

double headline_stated(const headline *h) {
    return stated_of_parts(&h->parts);
}

bool headline_has_light(const stated_parts *parts) {
    return isfinite(parts->rest) && isfinite(parts->mesh);
}

bool headline_is_coarse(const headline *h) {
    return h->known && headline_has_light(&h->parts) && headline_stated(h) > coarse;
}

size_t headline_parts(const headline *h, headline_part out[HEADLINE_PARTS], size_t *largest) {
    const double rest = h->parts.rest, share = fmin(h->share, 1);
    size_t n = 0;
    if (h->share < 0) {
        out[n++] = (headline_part){"walks", "walks", "--paths", rest};
    } else {
        out[n++] = (headline_part){"operator", "operator", "--epsilon", rest * sqrt(share)};
        out[n++] = (headline_part){"form_factors", "form factors", "--quality high", rest * sqrt(1 - share)};
    }
    if (h->parts.mesh >= 0) out[n++] = (headline_part){"mesh", "mesh", "--mesh-error .05", h->parts.mesh};
    if (h->parts.sun > 0) out[n++] = (headline_part){"sun", "sun", sun_option, h->parts.sun};
    if (h->parts.rows > 0)
        out[n++] = (headline_part){"rows", "rows of sensors", "--quality high", h->parts.rows};
    *largest = 0;
    for (size_t k = 1; k < n; k++)
        if (out[k].error > out[*largest].error) *largest = k;
    return n;
}

void headline_raise(headline *h, const stated_parts *parts) {
    const headline other = {.known = true, .parts = *parts};
    /* A figure that is not finite counts as the largest. */
    if (!(headline_stated(&other) <= headline_stated(h))) h->parts = *parts;
}

bool headline_write(buffer *b, const headline *h) {
    headline_part parts[HEADLINE_PARTS];
    size_t largest;
    if (!h->known)
        return buffer_append_text(b, "\"stated\":null,\"advice\":") && json_write_text(b, h->advice);
    const size_t n = headline_parts(h, parts, &largest);
    bool written = buffer_append_text(b, "\"stated\":") && json_write_double(b, headline_stated(h));
    if (headline_is_coarse(h))
        written = written && buffer_printf(b, ",\"coarse\":true,\"advice\":\"%s with %s\"",
                                           verb_of(&parts[largest]), parts[largest].option);
    written = written && buffer_append_text(b, ",\"parts\":{");
    for (size_t k = 0; written && k < n; k++)
        written = buffer_printf(b, "%s\"%s\":", k > 0 ? "," : "", parts[k].name) &&
                  json_write_double(b, parts[k].error);
    return written && buffer_append(b, "}", 1);
}

void headline_text(const headline *h, char text[HEADLINE_BYTES]) {
    headline_part parts[HEADLINE_PARTS];
    size_t largest;
    headline_parts(h, parts, &largest);
    const char *const option = headline_is_coarse(h) ? parts[largest].option : "";
    snprintf(text, HEADLINE_BYTES, "%.2g, most of it by the %s%s%s%s%s", headline_stated(h),
             parts[largest].words, option[0] != '\0' ? ": coarse; " : "",
             option[0] != '\0' ? verb_of(&parts[largest]) : "", option[0] != '\0' ? " with " : "", option);
}

void headline_text_parts(const headline *h, char text[HEADLINE_BYTES]) {
    headline_part parts[HEADLINE_PARTS];
    size_t largest, length = 0;
    const size_t n = headline_parts(h, parts, &largest);
    text[0] = '\0';
    for (size_t k = 0; k < n; k++)
        length += (size_t)snprintf(text + length, HEADLINE_BYTES - length, "%s%s %.2g", k > 0 ? ", " : "",
                                   parts[k].words, parts[k].error);
}
