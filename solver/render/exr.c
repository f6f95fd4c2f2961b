#include "solver/render/exr.h"

#include "solver/base/atomic_file.h"
#include "solver/base/half.h"

#include <OpenEXR/openexr.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* The level of zlib: of smooth light half the time of the library's preset for a few more bytes. */
enum { COMPRESSION = 4 };

/* The state that the library's callbacks share with write_to. */
typedef struct exr_stream {
    int descriptor;
    int cause; /* errno when writing failed, else 0 */
    char message[128];
} exr_stream;

static int64_t on_exr_write(exr_const_context_t exr, void *data, const void *buffer, uint64_t size,
                            uint64_t offset, exr_stream_error_func_ptr_t fail) {
    exr_stream *stream = data;
    const char *from = buffer;
    for (uint64_t done = 0; done < size;) {
        const ssize_t now = pwrite(stream->descriptor, from + done, size - done, (off_t)(offset + done));
        if (now < 0 && errno == EINTR) continue;
        if (now <= 0) {
            stream->cause = now < 0 ? errno : EIO;
            fail(exr, EXR_ERR_WRITE_IO, "write");
            return -1;
        }
        done += (uint64_t)now;
    }
    return (int64_t)size;
}

static void on_exr_error(exr_const_context_t exr, exr_result_t code, const char *message) {
    void *data = NULL;
    (void)code;
    if (exr_get_user_data(exr, &data) != EXR_ERR_SUCCESS || data == NULL) return;
    exr_stream *stream = data;
    if (stream->message[0] == '\0') snprintf(stream->message, sizeof stream->message, "%s", message);
}

static void channel_name(size_t n_channels, size_t c, char name[24]) {
    if (n_channels == 1)
        snprintf(name, 24, "Y");
    else if (n_channels == 3)
        snprintf(name, 24, "%c", "RGB"[c]);
    else
        snprintf(name, 24, n_channels > 10 ? "channel%02zu" : "channel%zu", c);
}

/* The channel of the light that a channel of the file holds: in the file they stand by name. */
static size_t channel_of(size_t n_channels, int16_t in_file) {
    return n_channels == 3 ? 2 - (size_t)in_file : (size_t)in_file;
}

static exr_result_t describe(exr_context_t exr, const picture_values *v, bool single,
                             const exr_notes *notes) {
    int part = 0;
    exr_result_t went = exr_add_part(exr, "light", EXR_STORAGE_SCANLINE, &part);
    if (went == EXR_ERR_SUCCESS)
        went = exr_initialize_required_attr_simple(exr, 0, (int32_t)v->width, (int32_t)v->height,
                                                   EXR_COMPRESSION_ZIP);
    for (size_t c = 0; c < v->channels && went == EXR_ERR_SUCCESS; c++) {
        char name[24];
        channel_name(v->channels, c, name);
        went = exr_add_channel(exr, 0, name, single ? EXR_PIXEL_FLOAT : EXR_PIXEL_HALF,
                               EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1);
    }
    if (v->channels == 3 && went == EXR_ERR_SUCCESS) {
        const exr_attr_chromaticities_t rec709 = {.red_x = .64f,
                                                  .red_y = .33f,
                                                  .green_x = .3f,
                                                  .green_y = .6f,
                                                  .blue_x = .15f,
                                                  .blue_y = .06f,
                                                  .white_x = .3127f,
                                                  .white_y = .329f};
        went = exr_attr_set_chromaticities(exr, 0, "chromaticities", &rec709);
    }
    if (went == EXR_ERR_SUCCESS) went = exr_attr_set_string(exr, 0, "quantity", notes->quantity);
    if (went == EXR_ERR_SUCCESS) went = exr_attr_set_string(exr, 0, "unit", notes->unit);
    if (went == EXR_ERR_SUCCESS) went = exr_attr_set_float(exr, 0, "exposure", 0);
    if (went == EXR_ERR_SUCCESS) went = exr_attr_set_string(exr, 0, "software", "lambert " LAMBERT_VERSION);
    return went == EXR_ERR_SUCCESS ? exr_write_header(exr) : went;
}

/* Puts rows of pixels into planes, one for each channel of the file. */
static size_t fill_planes(const picture_values *v, size_t top, size_t rows, bool single, char *planes) {
    const size_t C = v->channels, size = single ? sizeof(float) : sizeof(uint16_t);
    size_t clamped = 0;
    for (size_t c = 0; c < C; c++) {
        char *to = planes + c * rows * v->width * size;
        const float *from = v->values + top * v->width * C + channel_of(C, (int16_t)c);
        for (size_t i = 0; i < rows * v->width; i++, from += C, to += size) {
            const bool over = !single && *from > HALF_MAX;
            const uint16_t half = half_of_float(over ? HALF_MAX : *from);
            memcpy(to, single ? (const void *)from : (const void *)&half, size);
            clamped += over;
        }
    }
    return clamped;
}

/* Writes all blocks of rows; *pipeline is freed by the caller. */
static exr_result_t write_blocks(exr_context_t exr, const picture_values *v, bool single, char *planes,
                                 int32_t most_rows, exr_encode_pipeline_t *pipeline, size_t *clamped) {
    const size_t size = single ? sizeof(float) : sizeof(uint16_t);
    for (size_t top = 0; top < v->height; top += (size_t)most_rows) {
        const size_t left = v->height - top, rows = left < (size_t)most_rows ? left : (size_t)most_rows;
        exr_chunk_info_t chunk;
        exr_result_t went = exr_write_scanline_chunk_info(exr, 0, (int)top, &chunk);
        if (went == EXR_ERR_SUCCESS)
            went = top == 0 ? exr_encoding_initialize(exr, 0, &chunk, pipeline)
                            : exr_encoding_update(exr, 0, &chunk, pipeline);
        if (went != EXR_ERR_SUCCESS) return went;
        *clamped += fill_planes(v, top, rows, single, planes);
        for (int16_t c = 0; c < pipeline->channel_count; c++) {
            exr_coding_channel_info_t *channel = &pipeline->channels[c];
            channel->user_bytes_per_element = (int16_t)size;
            channel->user_data_type = single ? EXR_PIXEL_FLOAT : EXR_PIXEL_HALF;
            channel->user_pixel_stride = (int32_t)size;
            channel->user_line_stride = (int32_t)(size * v->width);
            channel->encode_from_ptr = (const uint8_t *)planes + (size_t)c * rows * v->width * size;
        }
        if (top == 0) went = exr_encoding_choose_default_routines(exr, 0, pipeline);
        if (went == EXR_ERR_SUCCESS) went = exr_encoding_run(exr, 0, pipeline);
        if (went != EXR_ERR_SUCCESS) return went;
    }
    return EXR_ERR_SUCCESS;
}

/* The error of a call of the library, by what the stream knows of it. */
static lam_status check(exr_result_t went, const exr_stream *stream, const char *path, lam_error *error) {
    if (stream->cause != 0)
        return status_fail(error, LAM_ERR_IO, "%s: cannot write the picture: %s", path,
                           strerror(stream->cause));
    if (went == EXR_ERR_SUCCESS) return LAM_OK;
    if (went == EXR_ERR_OUT_OF_MEMORY)
        return status_fail(error, LAM_ERR_MEMORY, "%s: not enough memory for the picture's encoder", path);
    return status_fail(error, LAM_ERR_INTERNAL, "%s: OpenEXR: %s", path,
                       stream->message[0] != '\0' ? stream->message : exr_get_default_error_message(went));
}

static lam_status write_to(FILE *file, const picture_values *v, bool single, const exr_notes *notes,
                           const char *path, size_t *clamped, lam_error *error) {
    lam_status status = LAM_OK;
    exr_stream stream = {.descriptor = fileno(file)};
    exr_context_initializer_t how = EXR_DEFAULT_CONTEXT_INITIALIZER;
    exr_context_t exr = NULL;
    exr_encode_pipeline_t pipeline = EXR_ENCODE_PIPELINE_INITIALIZER;
    char *planes = NULL;
    int32_t rows = 0;
    how.error_handler_fn = on_exr_error;
    how.user_data = &stream;
    how.write_fn = on_exr_write;
    how.zip_level = COMPRESSION;
    TRY(check(exr_start_write(&exr, path, EXR_WRITE_FILE_DIRECTLY, &how), &stream, path, error));
    TRY(check(describe(exr, v, single, notes), &stream, path, error));
    TRY(check(exr_get_scanlines_per_chunk(exr, 0, &rows), &stream, path, error));
    planes = memory_allocate((size_t)rows * v->width, v->channels * sizeof(float), "picture", error);
    if (planes == NULL) TRY(LAM_ERR_MEMORY);
    TRY(check(write_blocks(exr, v, single, planes, rows, &pipeline, clamped), &stream, path, error));
    exr_encoding_destroy(exr, &pipeline);
    TRY(check(exr_finish(&exr), &stream, path, error));
done:
    if (exr != NULL) {
        exr_encoding_destroy(exr, &pipeline);
        exr_finish(&exr);
    }
    free(planes);
    return status;
}

lam_status exr_write(const picture_values *v, bool single, const exr_notes *notes, const char *path,
                     size_t *clamped, lam_error *error) {
    lam_status status = LAM_OK;
    atomic_file out = {0};
    size_t over = 0;
    TRY(atomic_file_open(path, &out, error));
    TRY(write_to(out.stream, v, single, notes, path, &over, error));
    TRY(atomic_file_commit(&out, error));
    if (clamped != NULL) *clamped = over;
done:
    atomic_file_abort(&out);
    return status;
}
