/* Bytes of the store and of the scratch folder, and a check that the disks have room for them. */
#include "solver/formfactor/source.h"
#include "solver/precompute/forecast/forecast.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>

double forecast_store_bytes(const forecast *f) {
    const double n = (double)f->n;
    const double kept = f->keep ? recipe_source(&f->recipe)->stored_bytes(n, &f->recipe) : 0;
    return forecast_operator_bytes(f) + kept + forecast_tile_bytes(n) * (double)f->sky_tiles + 300 * n;
}

double forecast_scratch_bytes(const forecast *f) {
    const double n = (double)f->n;
    const factor_source *const own = recipe_source(&f->recipe);
    if (!f->scratch) return 0;
    const double found =
        (f->from_store ? 0 : own->packed_bytes(n, &f->recipe) + 4 * n * (double)f->sky_tiles) +
        (f->probes > 0 ? 2 * recipe_source(&f->judge_recipe)->packed_bytes(n, &f->judge_recipe) : 0);
    if (!f->large) return found;
    return found + own->bytes(n, &f->recipe) + (f->probes > 0 ? forecast_reference_bytes(f) : 0);
}

void forecast_format_room(double bytes, bool up, char text[32]) {
    const double unit = bytes < 10 * 0x1p20   ? 0x1p10
                        : bytes < 10 * 0x1p30 ? 0x1p20
                                              : .1 * 0x1p30,
                 count = up ? ceil(bytes / unit) : floor(bytes / unit);
    if (bytes < 10 * 0x1p30)
        snprintf(text, 32, "%.0f%c", count, bytes < 10 * 0x1p20 ? 'K' : 'M');
    else
        snprintf(text, 32, "%.1fG", count / 10);
}

lam_status forecast_check_disk(const forecast *f, const char *output, const scratch *rows,
                               const char *scratch_folder, lam_error *error) {
    lam_status status = LAM_OK;
    char folder[4096] = ".", needs[32], has[32];
    struct statvfs about;
    struct stat here, there;
    const char *slash = strrchr(output, '/');
    double in_store = forecast_store_bytes(f);
    if (slash != NULL)
        snprintf(folder, sizeof folder, "%.*s", slash == output ? 1 : (int)(slash - output), output);
    if (rows != NULL) {
        const double in_scratch = forecast_scratch_bytes(f), free_there = (double)scratch_free_bytes(rows);
        if (in_scratch > free_there) {
            forecast_format_room(in_scratch, true, needs);
            forecast_format_room(free_there, false, has);
            FAIL(error, LAM_ERR_IO,
                 "--scratch %s: rows of form factors need about %s, %s are free there; use another folder or "
                 "fewer --rays",
                 scratch_folder, needs, has);
        }
        if (stat(scratch_folder, &there) == 0 && stat(folder, &here) == 0 && here.st_dev == there.st_dev)
            in_store += in_scratch - fmin(in_scratch, scratch_used_bytes(rows));
    }
    if (statvfs(folder, &about) != 0) return LAM_OK; /* the write will fail with the reason */
    const double free_here = (double)about.f_bavail * (double)about.f_frsize;
    if (in_store > free_here) {
        forecast_format_room(in_store, true, needs);
        forecast_format_room(free_here, false, has);
        const char *smaller = f->method != NULL ? f->method->smaller : NULL;
        FAIL(error, LAM_ERR_IO, "%s: needs about %s of the disk, %s are free; %s%s%swrite to another disk",
             output, needs, has, f->keep ? "leave out --keep-form-factors or " : "",
             !f->keep && smaller != NULL ? smaller : "", !f->keep && smaller != NULL ? " or " : "");
    }
done:
    return status;
}
